"""Messages about impossible models, with the line of the script."""

from __future__ import annotations

import inspect
import re
from pathlib import Path
from typing import Any

import ddem
import numpy as np
import pytest
from sample_models import ROCK, SEAM, column, refused

HERE = Path(__file__).name

GRANITE = ddem.Material(density=2700, young=50e9, poisson=0.25, name="granite")


def line() -> int:
    """Line number of the caller."""
    frame = inspect.currentframe()
    assert frame is not None and frame.f_back is not None
    return frame.f_back.f_lineno


# --- one call ---


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda m: m.fix("xyz", hist=3), "hist: unknown key `hist` (did you mean `history`?"),
        (lambda m: m.fix(5), "axes: expected text"),
        (lambda m: m.contact(frction=3), "frction: unknown key `frction` (did you mean `friction`"),
        (lambda m: m.contact(damping="much"), "damping: expected a number"),
        (lambda m: m.contact(z=0.0), "z: unknown key `z`"),
        (
            lambda m: m.stage("a", kind="dyn"),
            'kind: expected `"relax"` or `"dynamic"` or `"safety"`, found "dyn"',
        ),
        (lambda m: m.load(force=(1, 2)), "force: expected 3 numbers, found 2"),
        (lambda m: m.load(force=(1, 2, np.nan)), "force[2]: must be a finite number, found NaN"),
        (lambda m: m.load(pressure=np.inf), "pressure: must be a finite number, found inf"),
        (lambda m: m.load(force=(1, 2, 3), x="a"), "x: expected a number (a plane) or two numbers"),
        (lambda m: m.load(force=(1, 2, 3), x=(1, 2, 3)), "x: expected a number (a plane) or two"),
        (lambda m: m.load(force=(1, 2, 3), history={"ram": 1}), "history.ram: unknown key `ram`"),
        (lambda m: m.fix("x", from_=3), "from_: expected text"),
        (lambda m: m.fix("x", sphere={"centre": (0, 0, 0)}), "sphere.radius: key `radius`"),
        (lambda m: m.add_blocks(material=ROCK, count=(1, 1, -1)), "count[2]: expected a whole"),
        (lambda m: m.add_blocks(material=ROCK, divisions=2.5), "divisions: expected a whole"),
        (lambda m: m.add_blocks(material=ROCK, edges={"q": [0, 1]}), "edges.q: unknown key `q`"),
        (lambda m: m.add_blocks(material=10**30), "material: "),
        (lambda m: m.probe("p", quantity="strain", at=(0, 0, 0)), "quantity: expected"),
        (lambda m: m.initial(velocity=object()), "velocity: expected a number, text, a list"),
        (lambda m: m.boundary("free"), 'kind: expected `"viscous"` or `"free-field"`'),
        (lambda m: m.refine(factor=0.5, z=0.0), "factor: expected a whole"),
        (lambda m: ddem.Model(gravty=1), "gravty: unknown key `gravty` (did you mean `gravity`?"),
        (lambda m: ddem.Model(gravity=(1, 2)), "gravity: expected 3 numbers, found 2"),
        (lambda m: ddem.Model(kinematics="big"), "kinematics: expected"),
        (lambda m: ddem.Material(density=1, young=1), "poisson: key `poisson` is missing"),
        (lambda m: ddem.Material(density="a", young=1, poisson=0), "density: expected a number"),
        (lambda m: ddem.Joint(thicknes=1), "thicknes: unknown key `thicknes` (did you mean"),
        (lambda m: ddem.Joint(thickness=1, material=SEAM), "material: expected a material, found a joint"),
        (lambda m: m.add_blocks(material=SEAM), "material: expected a material, found a joint"),
        (lambda m: m.add_blocks(material=ROCK, joint=ROCK), "joint: expected a joint, found a material"),
        (lambda m: m.add_blocks(material=ROCK, joint={"x": ROCK}), "joint.x: expected a joint, found a"),
        (lambda m: m.load(traction=ROCK), "traction: found a material, which is allowed only as `mat"),
        (lambda m: m.load(traction=(SEAM, 0, 0)), "traction[0]: found a joint, which is allowed only"),
        (lambda m: m.load(traction=(1, 0, 0), z=GRANITE), "z: found the material `granite`, which"),
        (lambda m: m.load(pressure=1, history=ROCK), "history: found a material, which is allowed"),
        (lambda m: m.fix(GRANITE), "axes: found the material `granite`, which is allowed only as"),
        (lambda m: m.cut(plane={"dip": ROCK}), "plane.dip: found a material, which is allowed only"),
        (lambda m: m.cut(bridge=ROCK), "bridge: expected a joint, found a material"),
        (lambda m: m.stage("a", kind=ROCK), "kind: found a material, which is allowed only as"),
        (lambda m: m.contact(friction=SEAM), "friction: found a joint, which is allowed only as"),
        (lambda m: m.build().relax(tolerance=ROCK), "tolerance: found a material, which is allowed"),
        (lambda m: m.build().run(ROCK), "duration: found a material, which is allowed only as"),
        (lambda m: m.build().nodes(x=ROCK), "x: found a material, which is allowed only as"),
        (lambda m: ddem.factor_of_safety(m, joints=[SEAM]), "joints[0]: found a joint, which is"),
        (lambda m: ddem.Material(density=GRANITE), "density: found the material `granite`, which"),
        (lambda m: ddem.Joint(thickness=ROCK), "thickness: found a material, which is allowed only"),
        (lambda m: ddem.Joint(material=[ROCK]), "material[0]: found a material, which is allowed"),
        (
            lambda m: ddem.Model.from_deck({"blocks": [{"material": GRANITE}]}),
            "deck.blocks[0].material: expected a name, found the material `granite`",
        ),
        (lambda m: ddem.Joint(fracture_energy=1), "fracture_energy: expected a list of 2 numbers"),
    ],
)
def test_invalid_arguments_are_refused_at_once(call: Any, message: str) -> None:
    model = column()
    before = model.deck
    with pytest.raises(ddem.ModelError) as caught:
        call(model)
    assert str(caught.value).startswith(message)
    ((place, text, _, _),) = caught.value.faults
    assert f"{place}: {text}" in str(caught.value)
    assert model.deck == before


@pytest.mark.parametrize(
    "call",
    [
        lambda m: m.fix("xyz", q=3),
        lambda m: m.load(q=3),
        lambda m: m.probe("a", q=3),
        lambda m: m.build().nodes(q=3),
    ],
)
def test_unknown_key_lists_python_keys(call: Any) -> None:
    message = refused(lambda: call(column()), ddem.ModelError)
    assert message.startswith("q: unknown key `q`")
    for key in ("`x`", "`y`", "`z`", "`sphere`", "`set`"):
        assert key in message
    assert "`where`" not in message and "`from`" not in message


def test_remove_needs_a_region() -> None:
    message = refused(column().remove, ddem.ModelError)
    assert "`x`" in message and "`where`" not in message


# --- the whole model ---


def test_build_errors_name_the_script_line() -> None:
    model = column()
    model.fix("q", z=0.0); fixed = line()  # fmt: skip # noqa: E702
    model.load(force=(1, 0, 0), x=77.0)
    model.add_blocks(
        size=(1, 1, 1),
        origin=(9, 9, 9),
        material="chalk",
    )
    with pytest.raises(ddem.ModelError) as caught:
        model.build()
    lines = str(caught.value).splitlines()
    places = [fault.place for fault in caught.value.faults]
    assert any(text.startswith(f"{HERE}:{fixed}: fix[1].axes: ") for text in lines)
    assert any(
        re.match(rf"{HERE}:\d+: blocks\[1\].material: there is no material named `chalk`", text)
        for text in lines
    )
    assert places and len(places) == len(lines)
    model = column()
    model.contact(friction=20)
    model.contact(friction=90, damping=1); report = line()  # fmt: skip # noqa: E702
    model.add_blocks(size=(1, 1, 1), origin=(9, 9, 9), material=ROCK)
    message = refused(model.build, ddem.ModelError)
    what = "contact.friction: `friction` is 90 but must be 0 or more and below 90 (as in `friction=35`)"
    assert message == f"{HERE}:{report}: {what} [out-of-range]"
    model = column()
    model.load(force=(1, 0, 0), x=77.0); loaded = line()  # fmt: skip # noqa: E702
    message = refused(model.build, ddem.ModelError)
    assert message.startswith(f"{HERE}:{loaded}: load[0]")
    assert "selects nothing" in message


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda m: m.refine(factor=2, x=(3, 4)), "that of the nearest is at [0.5, 0.5, "),
        (lambda m: m.refine(factor=1, z=(0, 2)), "1 parts leave blocks as they are (at least 2)"),
        (lambda m: m.refine(factor=40, z=(0, 2)), "less than four times the thickness of joint"),
        (lambda m: m.charge(x=(3, 4), pressure=1e6), "the nearest is a joint with its centre at"),
        (lambda m: m.charge(z=(0, 2), mass=1.0), "`mass` needs `explosive`"),
        (lambda m: m.charge(z=(0, 2), mass=1.0, explosive="tn"), "did you mean `tnt`?"),
        (lambda m: m.charge(z=(0, 2), pressure=1e6, delay=-1.0), "`delay` is -1 but must be 0 or"),
    ],
)
def test_invalid_blasts_are_refused(call: Any, message: str) -> None:
    model = column()
    call(model)
    assert message in refused(model.build, ddem.ModelError)


def test_open_cavity_warns() -> None:
    model = ddem.Model()
    model.add_blocks(size=(3, 3, 3), count=(3, 3, 3), divisions=1, material=ROCK, joint=SEAM)
    model.remove(x=(1, 2), y=(1, 2), z=(1, 3))
    model.charge(x=(0.9, 2.1), y=(0.9, 2.1), z=(0.9, 3), pressure=1e6)
    with pytest.warns(UserWarning, match=r"open to the outside.*\[open-cavity\]"):
        model.build()


def test_summary_has_initial_charge_data() -> None:
    model = ddem.Model()
    model.add_blocks(size=(3, 3, 3), count=(3, 3, 3), divisions=1, material=ROCK, joint=SEAM)
    model.remove(x=(1, 2), y=(1, 2), z=(1, 2))
    hole = {"x": (0.9, 2.1), "y": (0.9, 2.1), "z": (0.9, 2.1)}
    own = {"density": 1000.0, "detonation_velocity": 4000.0, "gamma": 3.0}
    model.charge(**hole, mass=100.0, explosive=own)
    (charge,) = model.build().summary["charges"]
    assert (charge["walls"], charge["joints"]) == (6, 0)
    assert (charge["mass"], charge["density"]) == (100, 1000)
    assert charge["filling"] == pytest.approx(100.0 / charge["volume"], rel=1e-12)
    # 1000 · 4000²/(2 · 4) Pa, expanded from a tenth of a cubic metre.
    assert charge["pressure"] == pytest.approx(2e9 * (0.1 / charge["volume"]) ** 3, rel=1e-12)
    model.charge(**hole, mass=0.01, explosive=own)
    with pytest.warns(UserWarning, match=r"charge\[1\].mass: 0.01 kg of explosive begin with"):
        model.build()


def test_probe_far_from_all_blocks_warns() -> None:
    model = column()
    model.probe("off", at=(500, 500, 3000))
    with pytest.warns(UserWarning, match="probe `off` has no block at"):
        model.build()


def test_all_errors_are_reported_at_once() -> None:
    model = ddem.Model()
    chalk = ddem.Material(density=-1, young=0, poisson=0.5)
    model.add_blocks(size=(1, 1, 0), count=(2, 1, 1), material=chalk)
    with pytest.raises(ddem.ModelError) as caught:
        model.build()
    places = {fault.place for fault in caught.value.faults}
    assert {
        "materials.material-1.density",
        "materials.material-1.young",
        "materials.material-1.poisson",
    } <= places
    assert len(caught.value.faults) >= 5


@pytest.mark.parametrize("form", ["model", "dictionary"])
def test_model_errors_name_script_not_file(form: str, tmp_path: Path) -> None:
    model = column()
    model.stage("a", kind="relax")
    model.load(force=(1, 0, 0), x=77.0); loaded = line()  # fmt: skip # noqa: E702
    given = model if form == "model" else model.deck
    message = refused(
        lambda: ddem.run_deck(given, out=tmp_path / "out", quiet=True), ddem.ModelError
    )
    assert "model.toml" not in message
    assert "load[0]" in message and "selects nothing" in message
    if form == "model":
        assert message.startswith(f"{HERE}:{loaded}: ")
    assert list(tmp_path.iterdir()) == []


def test_deck_without_stage_is_refused(tmp_path: Path) -> None:
    message = refused(lambda: ddem.run_deck(column(), out=tmp_path / "out"), ddem.ModelError)
    assert "no stage" in message
    assert list(tmp_path.iterdir()) == []


def test_deck_file_errors_name_line(tmp_path: Path) -> None:
    text = column().to_deck().replace("young", "yuong")
    path = tmp_path / "deck.toml"
    path.write_text(text)
    for call in (lambda: ddem.Model.from_deck(path), lambda: ddem.run_deck(path)):
        message = refused(call, ddem.ModelError)
        number = 1 + text.splitlines().index(next(t for t in text.splitlines() if "yuong" in t))
        assert f"deck.toml:{number}:" in message
        assert "did you mean `young`?" in message
        assert "\x1b" not in message


@pytest.mark.parametrize("divisions", [1300, 4_000_000, 2**32 - 1, 2**32, 2**63 - 1])
def test_too_large_models_are_refused(divisions: int) -> None:
    model = ddem.Model()
    with pytest.raises((MemoryError, ddem.ModelError)) as caught:
        model.add_blocks(size=(1, 1, 1), divisions=divisions, material=ROCK)
        model.build()
    assert str(caught.value)
    if divisions == 1300:
        assert isinstance(caught.value, MemoryError)


def test_warnings_point_to_the_calling_line() -> None:
    weak = ddem.Joint(thickness=0.01, material=ROCK, cohesion=1e4, friction=20, tension=1e5)
    with pytest.warns(UserWarning, match="joints.joint-1.tension: the tensile strength"):
        column(weak).build()
    with pytest.warns(UserWarning) as found:
        column(weak).build()
    assert all(Path(one.filename).name == HERE for one in found), "of the line that built it"
