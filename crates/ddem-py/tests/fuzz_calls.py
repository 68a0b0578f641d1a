"""Calls that may be refused but must not panic, crash or hang."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable
from typing import Any

import ddem
from fuzz_values import FuzzError
from hypothesis import HealthCheck, settings
from sample_models import breaking

#: Examples per test. `DDEM_EXAMPLES=2000 pytest -k fuzz` tries more, and others in each run.
EXAMPLES = int(os.environ.get("DDEM_EXAMPLES", "0"))
some = settings(
    max_examples=EXAMPLES or 80,
    derandomize=not EXAMPLES,
    database=None,
    deadline=None,
    suppress_health_check=list(HealthCheck),
)

#: Exceptions that a call may raise.
ALLOWED = (ddem.Error, ValueError, TypeError, OSError, MemoryError, OverflowError, AttributeError)


def attempt(call: Callable[[], Any]) -> Any:
    """Result of a call, or None if the call is refused."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return call()
        except ALLOWED as error:
            assert "internal error, please report it" not in str(error), str(error)
            assert str(error) != "" or isinstance(error, (FuzzError, MemoryError))
            return None
        # Any other exception fails the test, including PanicException, which is no Exception.


# These arguments, such as `n` and a duration, determine how long a call takes; no call is
# interrupted.
LONG = {"n", "duration", "max_steps", "frames", "every_steps", "increments"}


def endless(arguments_: dict[str, Any]) -> bool:
    """True if a call would take long unless it were refused."""
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
    """True if a model is small, or too large for any memory."""
    nodes = int(repr(model).rsplit(", ", 1)[1].split()[0])
    return not 10**4 < nodes < 10**10


def read_everything(simulation: ddem.Simulation) -> None:
    """Reads everything that a simulation offers."""
    for name in dir(simulation):
        if not name.startswith("__") and not callable(getattr(ddem.Simulation, name)):
            attempt(lambda name=name: getattr(simulation, name))
    repr(simulation)
    attempt(lambda: simulation.reaction(simulation.nodes()))


BREAKING = breaking()
BREAKING.stage("a", kind="dynamic", duration=1e-4)
