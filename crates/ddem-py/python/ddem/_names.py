"""Names of fields and their units, and what is said of wrong ones."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

NODAL = ("displacement", "velocity", "force", "mass")
ELEMENTAL = ("stress", "block", "fragment")
# Of models that ask for them.
PEAKS = ("peak_velocity", "peak_tension", "peak_compression")
JOINTS = ("state", "failure_time", "slip", "opening", "traction", "damage")
# What is a stress: rigid blocks have none.
STRESSES = ("stress", "peak_tension", "peak_compression")
UNITS = {
    "displacement": "m",
    "velocity": "m/s",
    "force": "N",
    "mass": "kg",
    "stress": "Pa",
    "peak_velocity": "m/s",
    "peak_tension": "Pa",
    "peak_compression": "Pa",
    "failure_time": "s",
    "slip": "m",
    "opening": "m",
    "traction": "Pa",
}
VECTOR = ("x", "y", "z")
TENSOR = ("xx", "yy", "zz", "xy", "yz", "zx")


def choices(given: object, valid: Iterable[str]) -> str:
    """The nearest valid name, if one is near, and all of them."""
    names = list(valid)
    near = difflib.get_close_matches(str(given), names, n=1)
    hint = f"did you mean {near[0]!r}? " if near else ""
    return f"{hint}valid: {', '.join(map(repr, names)) or 'none'}"


def one_of(argument: str, given: object, valid: Iterable[str]) -> str:
    """`given`, or a ValueError that names the argument, the nearest valid value and all of them."""
    names = list(valid)
    if isinstance(given, str) and given in names:
        return given
    raise ValueError(f"{argument}: {given!r} is not one of them; {choices(given, names)}")
