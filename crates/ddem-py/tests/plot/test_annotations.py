"""Text on pictures: stage, step or time, magnification, units, and omitted blocks."""

import subprocess
import sys

import ddem
import numpy as np
import pytest
from ddem import _layers, _units
from ddem._plot import plot
from sample_models import ROCK, column, environment, staged

pv = pytest.importorskip("pyvista")
pytest.importorskip("plotly")


def written(source, *args, **options):
    """All texts on a picture."""
    plotter = plot(source, *args, show=False, **options)
    texts = [actor.input for actor in plotter.actors.values() if hasattr(actor, "input")]
    plotter.close()
    return texts


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Results of a column that settles and is pushed."""
    out = tmp_path_factory.mktemp("words") / "staged"
    ddem.run_deck(staged(), out=out, quiet=True)
    return out


def test_title_shows_steps_of_relaxation_and_time_of_motion(folder):
    results = ddem.Results(folder)
    assert [frame.still for frame in results] == [True] * 2 + [False] * 5
    step = results.steps[1]
    assert f"settle, step {step}, true displacements" in written(results[1], scale=1.0)
    assert "settle, step 0, true displacements" in written(folder, frame=0)
    assert "push, t = 0.002 s, displacements × 50" in written(folder, scale=50.0)
    assert "0.002 s" in repr(results[-1]) and f"step {step}" in repr(results[1])


def test_simulation_title_shows_time_after_dynamic_steps():
    simulation = column().build(threads=1)
    steps = simulation.relax(quiet=True)
    assert f"relax 1, step {steps}, displacements × 20" in written(simulation, scale=20)
    simulation.run(1e-4, quiet=True)
    assert "run 2, t = 0.0001 s, true displacements" in written(simulation, scale=1)
    # No stage is shown as finished during a stage, or after plain steps.
    during = []
    simulation.run(1e-4, callback=lambda s: during.append(written(s, scale=1)), every=5e-5, quiet=True)
    assert any(text.startswith("t = 0.0001") for text in during[0])
    simulation.step()
    assert not any("run" in text for text in written(simulation, scale=1))


@pytest.mark.parametrize(
    ("size", "unit", "expected"),
    [
        (0.0, "m", (1.0, "")),
        (1.2345e-3, "m", (1e-3, "m")),
        (3e-9, "m", (1e-6, "µ")),
        (12_345.0, "m", (1.0, "")),
        (999.99, "Pa", (1e3, "k")),
        (12.5e6, "Pa", (1e6, "M")),
        (4e9, "Pa", (1e9, "G")),
        (4e4, "kg", (1.0, "")),
        (np.inf, "Pa", (1.0, "")),
    ],
)
def test_prefixes_equal_those_of_the_summary(size, unit, expected):
    assert _units.prefix(size, unit) == expected


@pytest.mark.parametrize(
    ("clim", "unit", "title", "texts"),
    [
        ((0.0, 2.466e-3), "m", "u (mm)", ["0", "1", "2", "2.466"]),
        ((0.0, 4.634), "m", "u (m)", ["0", "2", "4.634"]),
        ((-7.3e6, 7.3e6), "Pa", "u (MPa)", ["-7.3", "-5", "0", "5", "7.3"]),
        ((0.0, 1.0), "m", "u (m)", ["0", "0.25", "0.5", "0.75", "1"]),
        ((1e6, 1.0001e6), "Pa", "u (MPa)", ["1", "1.000025", "1.00005", "1.000075", "1.0001"]),
    ],
)
def test_bars_have_round_numbers_with_prefixed_unit(clim, unit, title, texts):
    bar = _layers.ColourBar(f"u ({unit})", None, clim, unit)
    assert bar.title == title
    marks = _layers.ticks(bar)
    assert [text for _, text in marks] == texts
    factor, _ = bar.scale
    assert np.allclose([value / factor for value, _ in marks], np.array(texts, float), rtol=5e-3)


def test_uniform_field_has_one_tick(simulation):
    for value, text in ((0.0, "0"), (12.5, "12.5")):
        bar = _layers.bar_of("u (m)", np.full(4, value), None, None, unit="m")
        assert [text for _, text in _layers.ticks(bar)] == [text]
    texts = written(simulation, np.full(len(simulation.points), np.nan), label="mine")
    assert "mine: no values" in texts and "0" not in texts and "1" not in texts


def test_units_have_prefixes(simulation):
    texts = written(simulation)
    most = np.linalg.norm(simulation.displacement, axis=1).max()
    assert "displacement magnitude (mm)" in texts and f"{1e3 * most:.4g}" in texts
    # Numbers of the user are shown unchanged.
    texts = written(simulation, simulation.displacement[:, 2], label="rise (m)")
    assert "rise (m)" in texts and f"{simulation.displacement[:, 2].max():.4g}" in texts


def test_rigid_blocks_have_no_stress_colour(tmp_path):
    model = ddem.Model(contact=False, gravity=(0, 0, -9.81), title="two kinds")
    model.add_blocks(size=(1, 1, 1), divisions=2, material=ROCK)
    model.add_blocks(origin=(2, 0, 0), size=(1, 1, 1), divisions=1, material=ROCK, body="rigid")
    # A deformable block without stress is not rigid.
    model.add_blocks(origin=(4, 0, 0), size=(1, 1, 1), divisions=1, material=ROCK)
    model.stage("fall", kind="dynamic", duration=1e-3, frames=1)
    simulation = ddem.run_deck(model, out=tmp_path, quiet=True)
    rigid = np.array([False] * 8 + [True, False])
    assert np.array_equal(simulation.element_rigid, rigid)
    assert np.array_equal(ddem.Results(tmp_path)[0].rigid, rigid)
    for source in (simulation, tmp_path):
        plotter = plot(source, "stress", show=False)
        mesh = plotter.actors["blocks"].mapper.dataset
        texts = [actor.input for actor in plotter.actors.values() if hasattr(actor, "input")]
        plotter.close()
        values = mesh.cell_data["stress von Mises (Pa)"]
        assert np.array_equal(np.isnan(values), rigid[mesh["element"]])
        assert "rigid, no stress (1 block)" in texts
        assert not any("rigid" in text for text in written(source, "velocity"))
    assert np.array_equal(simulation.mesh()["rigid"], rigid)
    film = ddem.animate(tmp_path, tmp_path / "film.gif", "stress")
    assert film.stat().st_size > 1000


def test_rigid_model_has_no_stress_bar(simulation):
    simulation.element_rigid = np.ones(len(simulation.elements), bool)
    texts = written(simulation, "stress")
    assert "rigid, no stress (4 blocks)" in texts and not any("Pa" in text for text in texts)


def row(n):
    """Blocks in a row, each joined to the next."""
    model = ddem.Model(contact=False)
    joint = ddem.Joint(normal_stiffness=1e10, shear_stiffness=1e10)
    model.add_blocks(size=(n, 1, 1), count=(n, 1, 1), divisions=1, material=ROCK, joint=joint)
    return model.build(threads=1)


@pytest.mark.parametrize(("gone", "there"), [(1, True), (2, True), (3, False)])
def test_distant_blocks_do_not_shrink_the_view(gone, there, tmp_path):
    simulation = row(8)
    still = simulation.displacement
    still[simulation.node_block == 7, 2] = 1e-3
    simulation.displacement = still
    seen = plot(simulation, scale=1.0, show=False)
    moved = still.copy()
    moved[simulation.node_block < gone, 2] += 500.0
    simulation.displacement = moved
    after = plot(simulation, scale=1.0, show=False)
    heights = [plotter.camera.parallel_scale for plotter in (seen, after)]
    bars = [plotter.actors["blocks"].mapper.scalar_range[1] for plotter in (seen, after)]
    texts = [actor.input for actor in after.actors.values() if hasattr(actor, "input")]
    for plotter in (seen, after):
        plotter.close()
    message = [text for text in texts if "outside the picture" in text]
    if there:
        # The remaining blocks are fewer, so the picture is at most that much larger.
        assert 0.5 * heights[0] < heights[1] <= heights[0] * 1.001
        assert bars == pytest.approx([1e-3, 1e-3])
        number = "1 block is" if gone == 1 else "2 blocks are"
        beyond = "(displacement magnitude up to 500 m)"
        assert [text.partition("true displacements, ")[2] for text in message] == [
            f"{number} far outside the picture {beyond}"
        ]
    else:
        assert not message and heights[1] > 10 * heights[0]


def command(*arguments):
    run = [sys.executable, "-m", "ddem", "plot", *map(str, arguments)]
    return subprocess.run(run, capture_output=True, text=True, timeout=120, env=environment())


def test_command_draws_a_folder(folder, tmp_path):
    done = command(folder)
    assert (done.returncode, done.stdout.strip()) == (0, str(folder / "plot.png")), done.stderr
    first = pv.read(folder / "plot.png").active_scalars
    assert len(np.unique(first, axis=0)) > 100
    side = tmp_path / "side.png"
    for more in (("--field", "traction"), ("--field", "stress", "--frame", "-2", "--scale", "1")):
        done = command(folder, "--out", side, "--view=-xz", *more)
        assert (done.returncode, done.stdout.strip()) == (0, str(side)), done.stderr
        assert not np.array_equal(first, pv.read(side).active_scalars)


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (("--field", "velocty"), "did you mean 'velocity'"),
        (("--field", "slipp"), "did you mean 'slip'"),
        (("--scale", "inf"), "scale: inf is not finite"),
        (("--frame", "7"), "--frame: 7 does not exist, the folder has 7 frames"),
        (("--frame", "first"), "'first' is neither a whole number nor 'last'"),
        (("--view", "zx"), "invalid choice: 'zx'"),
        (("--out", "no/such/folder/a.png"), "no/such/folder"),
    ],
)
def test_command_reports_errors(folder, more, message):
    done = command(folder, *more)
    assert (done.returncode, done.stdout) == (2, "") and message in done.stderr


def test_slabs_are_viewed_from_the_side():
    from ddem.__main__ import _view

    assert _view(np.array([[0, 0, 0], [10, 0.5, 8]])) == "xz"
    assert _view(np.array([[0, 0, 0], [10, 8, 0.5]])) == "xy"
    assert _view(np.array([[0, 0, 0], [10, 1, 1]])) == "iso"
