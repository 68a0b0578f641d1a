"""Exceptions, all derived from :class:`Error`."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple


class Fault(NamedTuple):
    """One error in a model or an argument."""

    place: str
    """Key or argument, as written in Python."""
    message: str
    """Value and the rule that it breaks."""
    help: str | None
    """Expected value, or None."""
    code: str
    """Stable code, as in ``out-of-range``."""


class Error(Exception):
    """Base class of the errors of ddem, except ``OSError`` (files) and ``MemoryError``.

    Attributes
    ----------
    code : str or None
        Stable code of the error, as in ``no-equilibrium``.
    """

    def __init__(self, *args: object) -> None:
        self.code: str | None = None
        super().__init__(*args)

    def __str__(self) -> str:
        return str(self.args[0]) if self.args else ""


class ModelError(Error, ValueError):
    """Error in a model or an argument.

    Attributes
    ----------
    faults : list of (place, message, help, code)
        The errors: key as written in Python, message, expected value (or None) and code.
    """

    def __init__(
        self, message: str, faults: Iterable[tuple[str, str, str | None, str]] = ()
    ) -> None:
        self.faults = [Fault(*fault) for fault in faults]
        super().__init__(message, self.faults)
        self.code = self.faults[0].code if self.faults else None


class NotConverged(Error):
    """Relaxation that did not reach equilibrium.

    Attributes
    ----------
    ratio : float
        Unbalanced force ratio reached.
    """

    def __init__(self, message: str, ratio: float) -> None:
        self.ratio = ratio
        super().__init__(message, ratio)


class Collapsed(NotConverged):
    """Failure without equilibrium: blocks separate or slide without end.

    Relaxations raise it, and runs with `until_rest`.

    Attributes
    ----------
    ratio : float
        Unbalanced force ratio reached.
    blocks : (int, int)
        The two neighbouring blocks with the largest displacement relative to each other since pairs
        last failed, or since the start of the stage or increment.
    distance : float
        Magnitude of this relative displacement [m].
    moving : list of (str, int, float, (float, float, float))
        Moving blocks: set, number, distance moved in the stage [m] and its direction. The block
        that has moved farthest comes first.
    """

    def __init__(
        self,
        message: str,
        ratio: float,
        blocks: tuple[int, int],
        distance: float,
        moving: list[tuple[str, int, float, tuple[float, float, float]]],
    ) -> None:
        super().__init__(message, ratio)
        self.blocks = blocks
        self.distance = distance
        self.moving = moving
        self.args = (message, ratio, blocks, distance, moving)


class Diverged(Error):
    """Divergence: forces are no longer finite.

    Attributes
    ----------
    step : int
        Steps since the start of the run.
    time : float
        Simulated time [s].
    block, node : int
        Block of the first node without a finite force, and number of this node in the block.
    """

    def __init__(self, message: str, step: int, time: float, block: int, node: int) -> None:
        self.step = step
        self.time = time
        self.block = block
        self.node = node
        super().__init__(message, step, time, block, node)


class Busy(Error):
    """Use of a busy simulation: another thread, or a call that is running your function, uses it."""
