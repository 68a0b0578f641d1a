"""Values for fuzz tests: objects, numbers, texts and arrays that no call expects."""

from __future__ import annotations

import array
import datetime
import decimal
import fractions
import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import ddem
import numpy as np
from hypothesis import strategies as st
from sample_models import ROCK, SEAM, column


class FuzzError(ValueError):
    """Exception that objects of the fuzz tests raise."""


class Raises:
    """An object whose conversions and methods all raise."""

    def _raise(self, *_: Any, **__: Any) -> Any:
        raise FuzzError("fuzz")

    __float__ = __int__ = __index__ = __len__ = __iter__ = __getitem__ = __bool__ = _raise
    __array__ = __fspath__ = __str__ = __repr__ = __call__ = tolist = keys = items = _raise


class Silent:
    """An object that raises when any attribute is read."""

    def __getattr__(self, name: str) -> Any:
        raise FuzzError(name)


class Row(Sequence[Any]):
    """A sequence whose length is wrong."""

    def __init__(self, length: int, *, ends: bool = True) -> None:
        self.length, self.ends = length, ends

    def __len__(self) -> int:
        return self.length

    def __getitem__(self, index: Any) -> Any:
        if self.ends and index >= 3:
            raise IndexError
        if index > 100_000:
            raise FuzzError("far enough")
        return 1.0


class UnreadableMapping(Mapping[Any, Any]):
    """A mapping whose items cannot be read."""

    def __init__(self, entries: Any) -> None:
        self.entries = entries

    def __getitem__(self, key: Any) -> Any:
        return 1.0

    def __iter__(self) -> Iterator[Any]:
        raise FuzzError("no keys")

    def __len__(self) -> int:
        return 1

    def items(self) -> Any:
        return self.entries


class Itself:
    """An object whose `tolist` returns the object itself."""

    def tolist(self) -> Any:
        return self


class Float(float):
    def __float__(self) -> float:
        raise FuzzError("no float")


class Text(str):
    def __str__(self) -> str:
        raise FuzzError("no text")


class Whole(int):
    def __index__(self) -> int:
        raise FuzzError("no index")


class Array(np.ndarray):  # type: ignore[type-arg]
    def __array_finalize__(self, other: Any) -> None:
        pass

    def tolist(self) -> Any:
        raise FuzzError("no list")


class Somewhere(os.PathLike[str]):
    def __init__(self, path: Any) -> None:
        self.path = path

    def __fspath__(self) -> Any:
        if self.path is None:
            raise FuzzError("nowhere")
        return self.path


def cyclic() -> list[Any]:
    cycle: list[Any] = [1.0]
    cycle.append(cycle)
    return cycle


def cyclic_table() -> dict[str, Any]:
    cycle: dict[str, Any] = {"ratio": 1.0}
    cycle["mass"] = [cycle]
    return cycle


def deep(levels: int = 60) -> list[Any]:
    nested: list[Any] = []
    for _ in range(levels):
        nested = [nested]
    return nested


def shared() -> list[Any]:
    row: list[Any] = [0.0, 1.0]
    for _ in range(4):
        row = [row] * 5
    return row


def mixed() -> Any:
    row = np.zeros(3, dtype=object)
    row[0], row[1] = Raises(), None
    return row


def masked() -> Any:
    return np.ma.masked_array(np.zeros((54, 3)), mask=np.eye(54, 3))


# --- pools of values ---

NUMBERS = [
    0, -1, 1, 2, 3, 7, 54, 2**31, 2**32 - 1, 2**32, 2**53 + 1, 2**63 - 1, 2**63, -(2**63), 10**30,
    10**400, True, False, 0.0, -0.0, 0.5, 1.5, -1.0, 1e-300, 5e-324, -5e-324, 1e-12, 1e12, 1e150,
    1e300, 1.7e308, -1.7e308, math.nan, math.inf, -math.inf,
]  # fmt: skip
TEXTS = [
    "", " ", "x", "xyz", "zyx", "xx", "none", "auto", "all", "a", "top", "relax", "dynamic", "ü",
    "\0", "a\0b", "\ud800", "\n", "a,b", '"', "'''", "\\", "a" * 3000, "nan", "]", "[a]", "a.b",
    "displacement", "velocity", "stress", "reaction", "force", "traction", "state", "from", "where",
]  # fmt: skip
OBJECTS: list[Callable[[], Any]] = [
    lambda: None,
    object,
    Raises,
    Silent,
    Itself,
    lambda: Raises,
    lambda: Row(3),
    lambda: Row(2**62),
    lambda: Row(2**40),
    lambda: Row(3, ends=False),
    lambda: range(2**40),
    lambda: range(2**62),
    lambda: range(3),
    lambda: UnreadableMapping(None),
    lambda: UnreadableMapping([1]),
    lambda: UnreadableMapping([(1, 2, 3)]),
    lambda: UnreadableMapping([("ratio", 1.0)]),
    lambda: UnreadableMapping([([], 1.0)]),
    lambda: Float(1.0),
    lambda: Text("x"),
    lambda: Whole(1),
    cyclic,
    cyclic_table,
    deep,
    shared,
    masked,
    lambda: decimal.Decimal("NaN"),
    lambda: decimal.Decimal("1.5"),
    lambda: fractions.Fraction(1, 3),
    lambda: 1 + 2j,
    lambda: b"bytes",
    lambda: bytearray(24),
    lambda: memoryview(b"12345678"),
    lambda: array.array("d", [1.0, 2.0, 3.0]),
    lambda: {1, 2, 3},
    lambda: (one for one in (1.0, 2.0, 3.0)),
    lambda: iter([1.0]),
    lambda: datetime.datetime(2020, 1, 1),
    lambda: slice(0, 3),
    lambda: Ellipsis,
    lambda: NotImplemented,
    lambda: ValueError("x"),
    lambda: ROCK,
    lambda: SEAM,
    lambda: column(),
    lambda: ddem,
    lambda: lambda time: 1.0,
    lambda: {"ramp": 1.0},
    lambda: {"table": [[0.0, 1.0], [1.0, 0.0]]},
    lambda: [[0.0, 1.0]],
    lambda: [],
    lambda: {},
    lambda: (),
    lambda: {"x": 1.0, "y": SEAM, "z": ROCK},
    lambda: {"centre": [0, 0, 0], "radius": 1},
    lambda: {"": 1},
    lambda: {1: 2},
    lambda: {"a\0b": 1},
    lambda: {"\ud800": 1},
    lambda: {"ratio": math.nan},
    lambda: {"mass": -1},
    lambda: np.float16(1.5),
    lambda: np.longdouble(1.5),
    lambda: np.complex64(1),
    lambda: np.datetime64("2020-01-01"),
    lambda: np.timedelta64(3, "s"),
    lambda: np.str_("xyz"),
    lambda: np.bytes_(b"x"),
    lambda: np.bool_(True),
    lambda: np.void(b"1234"),
    lambda: np.zeros(3, "f4,i4"),
    lambda: mixed(),
    lambda: np.array("2020-01-01", "M8[s]"),
    lambda: np.zeros((54, 3)).view(Array),
    lambda: np.matrix([[1.0, 2.0, 3.0]]),
]  # fmt: skip
DTYPES = [
    "f8", "f4", "f2", "g", ">f8", "i8", ">i4", "u8", "i1", "?", "c16", "O", "U3", "S3", "M8[s]",
    "m8[s]", "f8,i4", "V8",
]  # fmt: skip
SHAPES = [
    (), (0,), (1,), (3,), (54,), (0, 3), (1, 3), (2, 3), (54, 3), (3, 54), (54, 4), (54, 0), (9,),
    (9, 3), (16, 6), (1, 1, 3), (54, 3, 1), (0, 0, 0), (1,) * 32,
]  # fmt: skip


def shaped(kind: str, shape: tuple[int, ...], number: Any, layout: str) -> Any:
    """An array of a kind in a memory layout."""
    made = np.zeros(shape, kind)
    with np.errstate(all="ignore"):
        try:
            if made.dtype.kind not in "VMm":
                made[...] = number
        except (ValueError, OverflowError, TypeError):
            pass
    if layout == "fortran":
        made = np.asfortranarray(made)
    elif layout == "strided" and made.ndim:
        wide = np.zeros((*shape[:-1], 2 * shape[-1]), kind)
        wide[..., ::2] = made
        made = wide[..., ::2]
    elif layout == "backward" and made.ndim:
        made = made[::-1]
    elif layout == "spread":
        made = np.broadcast_to(np.zeros((), kind), shape)
    elif layout == "unaligned" and made.dtype.kind == "f":
        raw = np.zeros(made.nbytes + 1, "u1")[1:]
        made = raw.view(kind).reshape(shape) if made.size else made
    elif layout == "frozen":
        made.setflags(write=False)
    elif layout == "masked":
        made = np.ma.masked_array(made)
    return made


numbers = st.sampled_from(NUMBERS) | st.floats() | st.integers()
arrays = st.builds(
    shaped,
    st.sampled_from(DTYPES),
    st.sampled_from(SHAPES),
    numbers,
    st.sampled_from("plain fortran strided backward spread unaligned frozen masked".split()),
)
objects = st.sampled_from(OBJECTS).map(lambda make: make())
texts = st.sampled_from(TEXTS) | st.text(max_size=5)
leaves = numbers | texts | objects
nested = st.recursive(
    leaves,
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.tuples(inner, inner)
        | st.dictionaries(st.sampled_from(["ratio", "mass", "x", "y", "a", ""]), inner, max_size=3)
    ),
    max_leaves=6,
)
vectors = st.lists(numbers, min_size=3, max_size=3)
any_value = st.one_of(numbers, numbers, texts, vectors, objects, arrays, nested)
