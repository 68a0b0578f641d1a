"""Fixtures of all tests of pictures."""

import pytest
from ddem._plot import plot
from four_blocks import four_blocks


@pytest.fixture
def simulation():
    return four_blocks()


@pytest.fixture
def drawn(simulation):
    """The meshes of a picture by the name of their actor."""
    plotters = []

    def draw(*args, **options):
        plotters.append(plot(options.pop("of", simulation), *args, show=False, **options))
        return {
            name: actor.mapper.dataset
            for name, actor in plotters[-1].actors.items()
            if hasattr(getattr(actor, "mapper", None), "dataset")
        }

    yield draw
    for plotter in plotters:
        plotter.close()
