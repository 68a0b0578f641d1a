"""No deck, as a dictionary or a file, panics, crashes or hangs."""

from __future__ import annotations

from typing import Any

import ddem
from fuzz_calls import BREAKING, affordable, attempt, endless, read_everything, some
from fuzz_values import numbers, texts
from hypothesis import given
from hypothesis import strategies as st
from sample_models import ROCK, SEAM, breaking


@st.composite
def decks(draw: st.DrawFn) -> dict[str, Any]:
    """A deck with any numbers in place of numbers; sizes stay small or are far too large."""
    deck = full_deck()
    places: list[tuple[Any, Any]] = []

    def visit(item: Any) -> None:
        for key, value in item.items() if isinstance(item, dict) else enumerate(item):
            if isinstance(value, (dict, list)):
                visit(value)
            elif isinstance(value, (int, float)) and not isinstance(value, bool):
                places.append((item, key))

    visit(deck)
    for item, key in draw(st.lists(st.sampled_from(places), min_size=1, max_size=4)):
        whole = isinstance(item[key], int)
        if whole:
            item[key] = draw(st.sampled_from([0, -1, 1, 2, 3, 10**6, 2**31, 2**32, 2**63 - 1]))
        else:
            scale = draw(st.sampled_from([0.0, -1.0, 0.5, 2.0, 1e-9, 1e9, 1e-300, 1e200]))
            other = numbers.filter(lambda number: isinstance(number, float))
            item[key] = draw(st.just(item[key] * scale) | other)
    return deck


def full_deck() -> dict[str, Any]:
    model = breaking()
    model.assign(joint=SEAM, z=1.0, y=(0.0, 0.1))
    model.load(force=(1, 0, 0), sphere={"centre": (1, 1, 2), "radius": 0.2})
    model.load(line=(1, 0, 0), x=0.0, z=2.0, history=[[0, 0], [1e-4, 1]])
    model.load(pressure=1.0, x=1.0, y=(0.2, 0.7))
    model.fix("x", velocity=(1, 0, 0), z=2.0)
    model.initial(velocity=(0, 0, 1), spin=(1, 0, 0), centre=(0, 0, 0))
    rough = ddem.Joint(
        thickness=0.01, material=ROCK, jrc=8, jcs=50e6, residual_friction=28, tension=1e3
    )
    soft = ddem.Joint(
        normal_stiffness=1e10,
        shear_stiffness=5e9,
        cohesion=1e3,
        tension=1e3,
        friction=30,
        residual_cohesion=1.0,
        residual_friction=20,
        dilation=5,
        fracture_energy=(100, 400),
    )
    model.add_blocks(
        origin=(5, 0, 0),
        edges={"x": [0, 1, 2.5]},
        size=(2.5, 1, 1),
        divisions=1,
        material=ROCK,
        joint=rough,
    )
    model.add_blocks(
        origin=(9, 0, 0), size=(1, 1, 2), count=(1, 1, 2), divisions=1, material=ROCK, joint=soft
    )
    model.fix("xyz", x=(4, 30), z=0.0)
    model.probe("foot", quantity="reaction", z=0.0)
    model.stage("a", kind="relax", max_steps=30, increments=2)
    model.stage("b", kind="dynamic", duration=1e-4, damping=0.1, frames=2)
    return model.deck


@some
@given(decks())
def test_decks_survive_any_number(tmp_path_factory: Any, deck: dict[str, Any]) -> None:
    model = attempt(lambda: ddem.Model.from_deck(deck))
    if model is None:
        return
    if not affordable(model):
        return
    simulation = attempt(lambda: model.build(threads=1))
    if simulation is None:
        return
    assert simulation.n_nodes < 10**5
    read_everything(simulation)
    for call in (
        lambda: simulation.enter("a"),
        lambda: simulation.relax(max_steps=10, quiet=True),
        lambda: simulation.enter("b"),
        lambda: simulation.step(10),
    ):
        attempt(call)
    read_everything(simulation)
    a, b = model.deck["stage"]
    if not endless(a) and not endless(b) and (b.get("time_step") in (None, "auto")):
        out = tmp_path_factory.mktemp("deck")
        attempt(lambda: ddem.run_deck(model, out=out / "out", threads=1, quiet=True))


DECK_TEXT = BREAKING.to_deck()


@some
@given(
    st.integers(0, len(DECK_TEXT)),
    st.integers(0, 30),
    st.binary(max_size=8) | texts.map(lambda t: t.encode(errors="surrogatepass")),
)
def test_damaged_deck_files_are_refused_or_read(
    tmp_path_factory: Any, at: int, length: int, put: bytes
) -> None:
    path = tmp_path_factory.getbasetemp() / "deck.toml"
    text = DECK_TEXT.encode()
    path.write_bytes(text[:at] + put + text[at + length :])
    model = attempt(lambda: ddem.Model.from_deck(path))
    if model is not None and len(model.deck.get("blocks", [])) < 3:
        repr(model)
