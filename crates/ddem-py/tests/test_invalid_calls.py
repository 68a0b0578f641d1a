"""Messages about arguments of stages, and about arguments of a wrong type."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import ddem
import numpy as np
import pytest
from sample_models import column, cube, refused


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda s: s.run(-1), "duration: `duration` is -1 but must be above 0"),
        (lambda s: s.run(0), "duration: `duration` is 0 but must be above 0"),
        (lambda s: s.run(np.nan), "duration: must be a finite number, found NaN"),
        (lambda s: s.run("long"), "duration: expected a number"),
        (lambda s: s.run(1e300), "duration: `duration` is 1e300 but must be at most 1e30"),
        (lambda s: s.run(1e20), "duration: the stage needs "),
        (lambda s: s.run(1e-320), "duration: "),
        (lambda s: s.run(1e-3, time_step=1e-320), "time_step: "),
        (lambda s: s.run(1e-3, damping=-1), "damping.ratio: `ratio` is -1 but must be 0 or more"),
        (lambda s: s.run(1e-3, damping={"local": 1}), "damping.local: `local` is 1"),
        (lambda s: s.run(1e-3, damping={"masss": 1}), "damping.masss: unknown key"),
        (lambda s: s.run(1e-3, damping="much"), "damping: expected"),
        (lambda s: s.run(1e-3, frames=0), "frames: `frames` is 0 but must be 1 or more"),
        (lambda s: s.run(1e-3, fields_every=-1), "fields_every: "),
        (lambda s: s.run(1e-3, kind="relax"), "kind: "),
        (lambda s: s.run(1e-3, tolerance=1e-3), "tolerance: "),
        (lambda s: s.run(1e-3, x=1.0), "x: unknown key `x`"),
        (lambda s: s.run(1e-3, time_step=1), "time_step: "),
        (lambda s: s.start(time_step=1), "time_step: "),
        (lambda s: s.start(time_step=-1), "time_step: "),
        (lambda s: s.start(damping=-1), "damping.ratio: `ratio` is -1"),
        (lambda s: s.relax(tolerance=2), "tolerance: `tolerance` is 2 but must be"),
        (lambda s: s.relax(increments=0), "increments: `increments` is 0"),
        (lambda s: s.relax(max_steps=-1), "max_steps: expected a whole number"),
        (lambda s: s.relax(duration=1.0), "duration: "),
        (lambda s: s.enter("psh"), "stage: there is no `psh` (did you mean `push`?"),
        (lambda s: s.nodes(set="al"), "set: "),
        (lambda s: s.nodes(x=(3, 1)), "x: "),
        (lambda s: s.nodes(sphere={"centre": (0, 0, 0), "radius": -1}), "sphere.radius: "),
        (lambda s: s.nodes(x=np.inf), "x: must be a finite number, found inf"),
        (lambda s: s.nodes(from_="push"), "from_: "),
    ],
)
def test_invalid_stage_arguments_are_refused(call: Any, message: str) -> None:
    model = column()
    model.stage("push", kind="dynamic", duration=1.0)
    simulation = model.build()
    with pytest.raises(ddem.ModelError) as caught:
        call(simulation)
    assert str(caught.value).startswith(message)
    assert simulation.steps == 0 and not simulation.displacement.any()
    assert simulation.summary["stages"] == []
    simulation.step(2)
    assert np.isfinite(simulation.velocity).all()


def test_unknown_key_lists_keys_of_the_method() -> None:
    simulation = cube().build()
    for call in (lambda: simulation.run(1e-3, foo=1), lambda: simulation.start(foo=1)):
        message = refused(call, ddem.ModelError)
        assert message.startswith("foo: ")
        assert "`damping`" in message and "`time_step`" in message
        assert "`kind`" not in message
    message = refused(lambda: simulation.relax(foo=1), ddem.ModelError)
    assert "`tolerance`" in message and "`kind`" not in message


def test_time_step_above_critical_is_refused() -> None:
    simulation = column().build()
    critical = simulation.critical_step
    for call in (
        lambda step: simulation.run(1e-3, time_step=step, quiet=True),
        lambda step: simulation.start(time_step=step),
    ):
        message = refused(lambda call=call: call(1.001 * critical), ddem.ModelError)
        assert message.startswith("time_step: ")
        assert "critical" in message and f"{critical:.4e}".split("e")[0][:5] in message
        call(0.999 * critical)


@pytest.mark.parametrize("threads", [0, -1, 10**9, 2**70, 1.5, "two"])
def test_invalid_threads_are_refused(threads: Any, tmp_path: Path) -> None:
    model = column()
    simulation = model.build()
    simulation.save(tmp_path / "state.h5")
    model.stage("a", kind="relax")
    for call in (
        lambda: model.build(threads=threads),
        lambda: ddem.load(tmp_path / "state.h5", threads=threads),
        lambda: ddem.run_deck(model, out=tmp_path / "out", threads=threads, quiet=True),
    ):
        assert "threads" in refused(call, (ValueError, TypeError))  # type: ignore[arg-type]
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("call", "name"),
    [
        (lambda: ddem.Model(title=5), "title"),
        (lambda: ddem.Material(density=1, young=1, poisson=0, name=5), "name"),
        (lambda: ddem.Joint(thickness=1, name=5), "name"),
        (lambda: cube().build().enter(5), "stage"),
        (lambda: cube().build().field(5), "name"),
        (lambda: cube().build().run(1e-3, name=5), "name"),
        (lambda: cube().build().save(5), "path"),
        (lambda: cube().build().run(1e-3, record=5), "record"),
        (lambda: ddem.load(5), "path"),
        (lambda: cube().to_deck(5), "path"),
        (lambda: ddem.run_deck(5), "deck"),
        (lambda: ddem.Model.from_deck(5), "deck"),
        (lambda: ddem.load("a", model=5), "model"),
        (lambda: cube().build().run(1e-3, quiet="no"), "quiet"),
    ],
)
def test_wrong_types_name_the_argument(call: Any, name: str) -> None:
    assert name in refused(call, (ValueError, TypeError))  # type: ignore[arg-type]


def test_read_only_and_unknown_attributes_are_refused() -> None:
    with pytest.raises(TypeError):
        ddem.Simulation()
    simulation = cube().build()
    with pytest.raises(AttributeError, match="time"):
        simulation.time = 3.0
    with pytest.raises(AttributeError, match="foo"):
        simulation.foo = 3.0
    with pytest.raises(AttributeError):
        del simulation.velocity
    with pytest.raises(TypeError):
        type("Mine", (ddem.Simulation,), {})


def test_arguments_given_twice_are_refused() -> None:
    model = column()
    for call in (
        lambda: model.fix("x", where={"x": 1.0}, x=0.0),
        lambda: model.load(pressure=1.0, z=2.0, **{"from": "a", "from_": "b"}),
    ):
        assert "is given twice" in refused(call)
    assert "where" in refused(lambda: model.fix("x", where=5, x=0.0))
    model.fix("x", where={"y": 0.0}, x=0.0)
    assert model.deck["fix"][-1]["where"] == {"x": 0.0, "y": 0.0}


def test_unknown_keys_are_reported_before_wrong_types() -> None:
    simulation = cube().build()
    law = lambda slip: 0.0  # noqa: E731
    for call in (
        lambda: simulation.relax(callback=law),
        lambda: simulation.run(1e-3, law=law),
        lambda: ddem.Joint(law=law),
        lambda: ddem.Model(law=law),
        lambda: cube().contact(law=law),
        lambda: cube().fix("xyz", law=law),
    ):
        assert ": unknown key `" in refused(call, ddem.ModelError)
    message = refused(lambda: simulation.run(1e-3, dt=1e-5), ddem.ModelError)
    assert all(f"`{name}`" in message for name in ("until", "every", "callback", "record"))
    assert "`tolerance`" not in message
    message = refused(lambda: simulation.relax(tolerence=1e-5), ddem.ModelError)
    assert "did you mean `tolerance`? arguments here: `record`, `name`, `quiet`, `tolerance`" in message
    assert "is a key of dynamic stages" in refused(lambda: simulation.relax(frames=5), ddem.ModelError)
    assert "is not an argument" in refused(lambda: simulation.relax(kind="relax"), ddem.ModelError)


def test_setting_state_in_callback_moves_nothing() -> None:
    simulation = cube().build()

    def push(seen: ddem.Simulation) -> None:
        seen.velocity = seen.velocity

    def shift(seen: ddem.Simulation) -> None:
        seen.displacement = seen.displacement

    for move in (push, shift):
        with pytest.raises(ddem.Busy):
            simulation.run(1e-4, callback=move, quiet=True)
    push(simulation)


def test_unknown_attributes_suggest_similar_ones() -> None:
    simulation = cube().build()
    assert "did you mean `displacement`?" in refused(lambda: simulation.displacements, AttributeError)
    assert "did you mean `add_blocks`?" in refused(lambda: cube().add_block, AttributeError)
    assert not hasattr(simulation, "nothing_like_it")


def test_messages_use_python_notation() -> None:
    message = refused(lambda: cube(gravity=(0, 0, -9.81)).build().relax(quiet=True), ddem.ModelError)
    assert "prevent this motion with `Model.fix`" in message and "[[" not in message
    message = refused(lambda: cube().load(pressure=1.0, history="ramp"), ddem.ModelError)
    assert '`{"ramp": seconds}`, `{"table": [[time, factor], …]}`' in message
    message = refused(lambda: cube().build().run(1e-4, damping="ratio", quiet=True), ddem.ModelError)
    assert '`{"local": number}`' in message
    model = cube(gravity=(0, 0, -9.81), contact=False)
    model.contact(friction=20)
    with pytest.warns(UserWarning) as caught:
        model.build()
    texts = [str(warning.message) for warning in caught]
    assert any("`Model.fix` or `Model.boundary` supports it" in text for text in texts), texts
    assert any("`contact=False` in `Model(...)`" in text for text in texts), texts
    assert not any("[[" in text or "[contact]" in text for text in texts), texts


def test_advice_on_initial_stress_is_python() -> None:
    model = cube()
    model.initial(stress=(-1e6, -1e6, -1e6, 0, 0, 0))
    with pytest.warns(UserWarning, match="put in") as caught:
        model.build()
    advice = [str(w.message).split("put in\n")[1].strip() for w in caught if "put in\n" in str(w.message)]
    for line in advice:
        assert line.startswith("model."), line
        exec(line, {"model": model})
    assert advice
    model.build()


def test_single_joint_name_is_not_split_into_letters() -> None:
    message = refused(lambda: ddem.factor_of_safety(cube().build(), joints="plane"), ddem.ModelError)
    assert message.startswith("joints: there is no joint named `plane`")
