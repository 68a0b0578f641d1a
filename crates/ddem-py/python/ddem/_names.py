"""Names of fields and their units, and messages about wrong ones."""

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


# Names that a message lists; of more it has the nearest and some others.
_MOST = 40


def choices(given: object, valid: Iterable[str]) -> str:
    """The nearest valid name, if one is near, and the others as far as a message has room."""
    names = list(valid)
    # Among many names some are near to anything.
    near = difflib.get_close_matches(str(given), names, n=1 if len(names) <= _MOST else 5)
    # What begins like it, such as a word that was cut short.
    near = near or [name for name in names if given and name.startswith(str(given))][:1]
    if len(names) > _MOST:
        others = f"{len(names)} names are valid, such as {', '.join(map(repr, (near or names)[:5]))}"
        return f"did you mean {near[0]!r}? {others}" if near else others
    hint = f"did you mean {near[0]!r}? " if near else ""
    return f"{hint}valid: {', '.join(map(repr, names)) or 'none'}"


def one_of(argument: str, given: object, valid: Iterable[str]) -> str:
    """The value itself, or a ValueError with the argument, the nearest valid value and the others."""
    names = list(valid)
    if isinstance(given, str) and given in names:
        return given
    raise ValueError(f"{argument}: {given!r} is not one of them; {choices(given, names)}")
