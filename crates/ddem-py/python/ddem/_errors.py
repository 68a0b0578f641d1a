"""Exceptions, all under :class:`Error`."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple


class Fault(NamedTuple):
    """One error in a model or in an argument."""

    place: str
    """Key or argument, as it is written in Python."""
    message: str
    """The value and the rule that it breaks."""
    help: str | None
    """Expected value, or None."""
    code: str
    """Stable code, as in ``out-of-range``."""


class Error(Exception):
    """Everything that ddem raises itself, but for files (``OSError``) and memory (``MemoryError``).

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
    """A model or an argument that is wrong.

    Attributes
    ----------
    faults : list of (place, message, help, code)
        The errors: key as it is written in Python, message, expected value (or None) and code.
    """

    def __init__(
        self, message: str, faults: Iterable[tuple[str, str, str | None, str]] = ()
    ) -> None:
        self.faults = [Fault(*fault) for fault in faults]
        super().__init__(message, self.faults)
        self.code = self.faults[0].code if self.faults else None


class NotConverged(Error):
    """A relaxation did not reach equilibrium.

    Attributes
    ----------
    ratio : float
        Unbalanced force ratio that was reached.
    """

    def __init__(self, message: str, ratio: float) -> None:
        self.ratio = ratio
        super().__init__(message, ratio)


class Collapsed(NotConverged):
    """A relaxation in which blocks part or slide without end: there is no equilibrium.

    Attributes
    ----------
    ratio : float
        Unbalanced force ratio that was reached.
    blocks : (int, int)
        The two blocks that have moved farthest against each other since pairs last failed.
    distance : float
        How far [m].
    moving : list of (str, int, float, (float, float, float))
        Blocks that move, those first that have gone farthest: set, number, distance [m] and direction.
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
    """Forces are no longer finite.

    Attributes
    ----------
    step : int
        Steps since the start of the run.
    time : float
        Simulated time [s].
    block, node : int
        The first node without a finite force, and its block.
    """

    def __init__(self, message: str, step: int, time: float, block: int, node: int) -> None:
        self.step = step
        self.time = time
        self.block = block
        self.node = node
        super().__init__(message, step, time, block, node)


class Busy(Error):
    """A simulation is being used by another thread."""
