"""SI prefixes of units by the size of numbers, as in the summary of a run."""

from __future__ import annotations

import math

# SI prefixes from the largest, and their factors.
_PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"))
# Units that take a prefix. The kilogram already has one.
_PREFIXED = ("m", "m/s", "Pa", "N", "J", "s")


def prefix(size: float, unit: str) -> tuple[float, str]:
    """Factor and prefix of a unit that suit the size of a quantity.

    Parameters
    ----------
    size : float
        Magnitude of the largest number, in `unit`.
    unit : str
        SI unit.

    Returns
    -------
    (float, str)
        Factor and prefix, such as ``(1e6, "M")``; ``(1.0, "")`` if the size is 0 or not finite, or
        if the unit takes no prefix.
    """
    if unit not in _PREFIXED or size == 0.0 or not math.isfinite(size):
        return 1.0, ""
    # Metres and seconds take no prefix above 1: large displacements are not written in kilometres.
    most = 1.0 if unit[0] in "ms" else math.inf
    for factor, name in _PREFIXES:
        if factor <= most and size >= 0.9995 * factor:
            return factor, name
    return _PREFIXES[-1]
