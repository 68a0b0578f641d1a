"""Names of fields and their units, and messages about wrong names."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

NODAL = ("displacement", "velocity", "force", "mass")
ELEMENTAL = ("stress", "block", "fragment")
# Fields of models with `peaks=True`.
PEAKS = ("peak_velocity", "peak_tension", "peak_compression")
JOINTS = ("state", "failure_time", "slip", "opening", "traction", "damage")
# Stresses, which rigid blocks do not have.
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


# Largest number of names that a message lists in full; of more names it lists up to five.
_MOST = 40


def choices(given: object, valid: Iterable[str]) -> str:
    """Hint for a wrong name: the nearest valid name, if one is near, and the valid names."""
    names = list(valid)
    # Among many names several may be near.
    near = difflib.get_close_matches(str(given), names, n=1 if len(names) <= _MOST else 5)
    # Otherwise a name that begins with the given word, which may be a shortened one.
    near = near or [name for name in names if given and name.startswith(str(given))][:1]
    if len(names) > _MOST:
        others = f"{len(names)} names are valid, such as {', '.join(map(repr, (near or names)[:5]))}"
        return f"did you mean {near[0]!r}? {others}" if near else others
    hint = f"did you mean {near[0]!r}? " if near else ""
    return f"{hint}valid: {', '.join(map(repr, names)) or 'none'}"


def one_of(argument: str, given: object, valid: Iterable[str]) -> str:
    """Return the value if it is valid, else raise a ValueError with the argument and the valid values."""
    names = list(valid)
    if isinstance(given, str) and given in names:
        return given
    raise ValueError(f"{argument}: {given!r} is not valid; {choices(given, names)}")
