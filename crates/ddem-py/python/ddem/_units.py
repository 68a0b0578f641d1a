"""Prefixes of units by the size of numbers, as those of the summary of a run."""

from __future__ import annotations

import math

# SI prefixes from the largest, and their factors.
_PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"))
# Units that take one. A kilogram has its own already.
_PREFIXED = ("m", "m/s", "Pa", "N", "J", "s")


def prefix(size: float, unit: str) -> tuple[float, str]:
    """The factor that goes with the size of a quantity, and its prefix.

    Parameters
    ----------
    size : float
        Size of the largest number, in `unit`.
    unit : str
        Unit in SI.

    Returns
    -------
    (float, str)
        Such as ``(1e6, "M")``; ``(1.0, "")`` of nothing, and of units that take no prefix.
    """
    if unit not in _PREFIXED or size == 0.0 or not math.isfinite(size):
        return 1.0, ""
    # Nobody writes kilometres for large displacements, or kiloseconds.
    most = 1.0 if unit[0] in "ms" else math.inf
    for factor, name in _PREFIXES:
        if factor <= most and size >= 0.9995 * factor:
            return factor, name
    return _PREFIXES[-1]
