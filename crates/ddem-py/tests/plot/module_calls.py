"""Wrong calls, one for each message of the Rust sources of the module; see test_messages.py."""

import copy
import warnings

import ddem
import numpy as np
from ddem import _progress
from sample_models import ENDLESS, ROCK, SEAM, column, staged


def module_calls(tmp_path, monkeypatch):
    """Wrong calls, by name."""
    yield from array_calls()
    yield from value_calls()
    yield from model_calls(tmp_path)
    yield from name_calls()
    yield from run_calls()
    yield from warning_calls()
    yield from folder_calls(tmp_path / "runs", monkeypatch)


def array_calls():
    """Wrong arrays and whole numbers, by name."""
    simulation = column().build()
    zeros = np.zeros((54, 3))
    velocities = {
        "rows of different lengths": [[1, 2, 3], [1, 2]],
        "type of an array": zeros.astype(complex),
        "shape of an array": zeros[:5],
        "number that is not finite": zeros + np.nan,
    }
    for name, value in velocities.items():
        yield name, lambda value=value: setattr(simulation, "velocity", value)
    numbers = {
        "number of nodes": np.broadcast_to(0, 2_000_000),
        "mask of nodes": np.zeros(3, bool),
        "fractions as nodes": [0.5],
        "rows of nodes": [[0]],
        "missing node": [54],
    }
    for name, value in numbers.items():
        yield name, lambda value=value: simulation.reaction(value)
    out = {"list": [0.0], "shape": np.zeros(3), "type": zeros.astype("f4")}
    for name, value in out.items():
        yield f"{name} for numbers", lambda value=value: simulation.field("velocity", out=value)
    yield "forces on nodes", lambda: simulation.apply_force([0, 1], 0.0)
    yield "field of elements", lambda: simulation.field("stress", nodes=[0])
    yield "number of steps", lambda: simulation.step(-1)
    yield "number of threads", lambda: column().build(threads=2000)


def value_calls():
    """Values that no deck has, by name."""

    class Unreadable:
        def tolist(self):
            raise ValueError("no list")

    endless = []
    endless.append(endless)
    values = {
        "list in itself": endless,
        "number of entries": np.broadcast_to(0.0, 6_000_000),
        "kind of value": object(),
        "unreadable value": Unreadable(),
        "key of a dictionary": {1: 2},
        "digits of a number": 10**30,
        "infinite number": np.inf,
    }
    for name, value in values.items():
        yield name, lambda value=value: column().load(traction=value)
    yield "material as a joint", lambda: column().add_blocks(joint=ROCK)
    yield "joint as a material", lambda: column().add_blocks(material=SEAM)
    yield "material as a number", lambda: ddem.Model(gravity=ROCK)
    granite = ddem.Material(density=2700, young=50e9, poisson=0.25, name="granite")
    yield "material with a name", lambda: column().load(traction=granite)
    yield "joint in a dictionary", lambda: ddem.Model.from_deck({"blocks": [{"joint": SEAM}]})
    yield "key given twice", lambda: column().load(**{"from": "a", "from_": "b"})
    yield "function without a history", lambda: column().probe("a", history=abs)
    yield "no selection", lambda: column().remove()


def model_calls(tmp_path):
    """Wrong calls about models and their decks, by name."""
    decks = tmp_path / "decks"
    decks.mkdir()
    column().to_deck(decks / "deck.toml")
    driven, growing = column(), column()
    driven.load(pressure=1.0, z=2.0, history=lambda time: "a")
    other = ddem.Material(density=1, young=1, poisson=0, name="material-1")

    class Number(dict):
        def __float__(self):
            return 1.0

    class Growing:
        def tolist(self):
            count = len(growing.deck["materials"])
            rock = ddem.Material(density=count, young=1, poisson=0)
            growing.add_blocks(size=(1, 1, 1), material=rock)
            return count

    yield "kind of deck", lambda: ddem.Model.from_deck(5)
    yield "deck that is a number", lambda: ddem.Model.from_deck(Number())
    yield "kind of deck to run", lambda: ddem.run_deck(5)
    yield "missing deck", lambda: ddem.Model.from_deck(decks / "dek.toml")
    yield "missing surface", lambda: column().cut(surface="rock.stl")
    yield "name of a file", lambda: column().to_deck("a\0b")
    yield "function in a deck", driven.to_deck
    yield "result of a function", lambda: driven.build().step()
    yield "model that grows", lambda: growing.load(pressure=Growing(), z=2.0)
    yield "name of a material", lambda: column().add_blocks(material=other)
    yield "copy of a simulation", lambda: copy.copy(column().build())


def name_calls():
    """Unknown names, by name."""
    simulation = column().build()
    yield "key of a cut", lambda: column().cut(foo=1)
    yield "attribute of a material", lambda: ROCK.yung
    yield "attribute of a simulation", lambda: simulation.displacements
    yield "peaks of a field", lambda: simulation.peak_velocity
    yield "near name", lambda: staged().build().enter("pus")
    yield "no names", lambda: simulation.enter("push")
    yield "argument of a run", lambda: simulation.run(1e-3, evry=0)
    yield "kind of a relaxation", lambda: simulation.relax(kind="relax")


def run_calls():
    """Wrong calls about functions of a run and times, by name."""
    simulation = column().build()

    def run(**keys):
        simulation.run(1e-4, quiet=True, **keys)

    yield "function of a run", lambda: run(until=3)
    yield "interval without functions", lambda: run(every=1e-4)
    yield "kind of interval", lambda: run(every="a", until=print)
    yield "interval of functions", lambda: run(every=0, until=print)
    yield "step in a function", lambda: run(callback=ddem.Simulation.step)
    yield "checkpoints", lambda: ddem.run_deck(column(), checkpoint_every=-1)


def warning_calls():
    """Calls with a warning, by name."""

    def warned(code, call):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            warnings.filterwarnings("error", rf".*\[{code}\]")
            call()

    def factor(model, **keys):
        return lambda: ddem.factor_of_safety(model, **keys)

    wait, rest = "waiting-stages", "not-in-equilibrium"
    yield "stage of loads", lambda: warned(wait, lambda: staged().build().run(1e-4, quiet=True))
    yield "stage of a factor", lambda: warned(wait, factor(staged()))
    yield "start of a factor", lambda: warned(rest, factor(column(), max_steps=2))


def folder_calls(runs, monkeypatch):
    """Wrong calls about folders of results, by name."""
    model, other = (column(title=title) for title in ("model", "other"))
    for one in (model, other):
        one.stage("run", kind="dynamic", duration=1e-4)
    simulation = model.build()

    def run(name, one=model, **keys):
        ddem.run_deck(one, out=runs / name, quiet=True, **keys)

    def record(name, **keys):
        simulation.run(1e-4, record=runs / name, quiet=True, **keys)

    def changed():
        model.fix("x", z=2.0)
        run("earlier", resume=True)

    def lost():
        record("lost")
        (runs / "lost/checkpoint.h5").unlink()
        record("lost")

    def full():
        record("full")
        # A file of Linux without space.
        (runs / "full/summary.json.part").symlink_to("/dev/full")
        record("full")

    def interrupted(*arguments):
        raise KeyboardInterrupt

    def stopped():
        endless = column()
        endless.stage("run", kind="dynamic", duration=ENDLESS)
        with monkeypatch.context() as keys:
            keys.setattr(_progress.ProgressBar, "update", interrupted)
            ddem.run_deck(endless, out=runs / "stopped")

    run("earlier")
    (runs / "foreign").mkdir()
    for file in ("foreign/energy.csv", "file"):
        (runs / file).write_text("")
    yield "results of another deck", lambda: run("earlier", other, overwrite=True)
    yield "changed deck", changed
    yield "file of another program", lambda: run("foreign")
    yield "file as a folder", lambda: run("file")
    yield "folder in use", lambda: record("in use", callback=lambda _: run("in use"))
    yield "missing checkpoint", lost
    yield "full disk", full
    yield "Ctrl-C", stopped
