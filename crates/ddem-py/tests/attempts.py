"""Calls that may be refused but neither panic, crash nor hang."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable
from typing import Any

import ddem
from hypothesis import HealthCheck, settings
from nasty import Nasty
from small import breaking

#: Of each test. `DDEM_EXAMPLES=2000 pytest -k nasty` looks further, each time elsewhere.
EXAMPLES = int(os.environ.get("DDEM_EXAMPLES", "0"))
some = settings(
    max_examples=EXAMPLES or 80,
    derandomize=not EXAMPLES,
    database=None,
    deadline=None,
    suppress_health_check=list(HealthCheck),
)

#: What may come out of a call.
ALLOWED = (ddem.Error, ValueError, TypeError, OSError, MemoryError, OverflowError, AttributeError)


def attempt(call: Callable[[], Any]) -> Any:
    """What a call gives, if it is no more than refused."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return call()
        except ALLOWED as error:
            assert "internal error, please report it" not in str(error), str(error)
            assert str(error) != "" or isinstance(error, (Nasty, MemoryError))
            return None
        # Anything else fails the test, PanicException included, which is no Exception.


# `n` and a duration are how long a call takes: nothing in between is asked for.
LONG = {"n", "duration", "max_steps", "frames", "every_steps", "increments"}


def endless(arguments_: dict[str, Any]) -> bool:
    """Whether a call would take long if it were not refused."""
    for key in LONG & set(arguments_):
        given_ = arguments_[key]
        try:
            number = float(given_)
        except Exception:
            continue
        if number > (1e-3 if key == "duration" else 20):
            return True
    return False


def affordable(model: ddem.Model) -> bool:
    """Whether a model is small, or too large for any memory."""
    nodes = int(repr(model).rsplit(", ", 1)[1].split()[0])
    return not 10**4 < nodes < 10**10


def looked(simulation: ddem.Simulation) -> None:
    """Everything is looked at."""
    for name in dir(simulation):
        if not name.startswith("__") and not callable(getattr(ddem.Simulation, name)):
            attempt(lambda name=name: getattr(simulation, name))
    repr(simulation)
    attempt(lambda: simulation.reaction(simulation.nodes()))


BREAKING = breaking()
BREAKING.stage("a", kind="dynamic", duration=1e-4)
