"""Checks and conversions of arguments. Every error names the argument, what was expected and what was found."""

from __future__ import annotations

import operator
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float32]


def number(name: str, value: object, meaning: str) -> float:
    """A real number as a float; ``meaning`` says what it should be."""
    is_number = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
    if not is_number:
        raise TypeError(f"{name}: expected {meaning}, found {_described(value)}")
    return float(value)  # type: ignore[arg-type]


def whole(name: str, value: object, meaning: str) -> int:
    """A whole number that is not negative."""
    if isinstance(value, (bool, np.bool_)) or not hasattr(type(value), "__index__"):
        raise TypeError(f"{name}: expected {meaning}, found {_described(value)}")
    found = operator.index(value)  # type: ignore[arg-type]
    if found < 0:
        raise ValueError(f"{name}: expected {meaning}, found {found}")
    return found


def text(name: str, value: object, meaning: str) -> str:
    """A string."""
    if not isinstance(value, str):
        raise TypeError(f"{name}: expected {meaning}, found {_described(value)}")
    return value


def margin(value: int | tuple[int, int]) -> tuple[int, int]:
    """Columns and rows of a guard band on each side."""
    meaning = "pixels, an integer >= 0 or a pair (x, y) of them"
    if isinstance(value, (tuple, list)):
        if len(value) != 2:
            raise ValueError(f"margin: expected {meaning}, found {len(value)} values")
        return whole("margin", value[0], meaning), whole("margin", value[1], meaning)
    both = whole("margin", value, meaning)
    return both, both


def floats(name: str, value: ArrayLike, axes: Sequence[str]) -> Floats:
    """An array of floating-point numbers as C-contiguous float32, without a copy where it is that already.

    ``axes`` says what its axes are; a digit stands for a fixed length.
    """
    array = np.asarray(value)
    expected = f"an array of floating-point numbers of shape ({', '.join(axes)})"
    if not np.issubdtype(array.dtype, np.floating):
        raise TypeError(f"{name}: expected {expected}, found dtype {array.dtype}")
    fits = array.ndim == len(axes) and all(not a.isdigit() or int(a) == n for a, n in zip(axes, array.shape))
    if not fits or array.size == 0:
        raise ValueError(f"{name}: expected {expected}, found shape {array.shape}")
    return np.require(array, np.float32, ["C_CONTIGUOUS", "ALIGNED"])


def image(name: str, value: ArrayLike, shape: tuple[int, ...], because: str) -> Floats:
    """:func:`floats` of a given shape; ``because`` says where the shape comes from."""
    axes = ["height", "width", "3"][: len(shape)]
    array = floats(name, value, axes)
    if array.shape != shape:
        raise ValueError(f"{name}: expected shape {shape}, {because}, found {array.shape}")
    return array


def matrix(name: str, value: ArrayLike, sides: Sequence[int]) -> list[list[float]]:
    """A square matrix of one of the given sizes as rows of a 4x4 matrix."""
    expected = f"a {' or '.join(f'{n}x{n}' for n in sides)} matrix"
    array = np.asarray(value)
    if not (np.issubdtype(array.dtype, np.floating) or np.issubdtype(array.dtype, np.integer)):
        raise TypeError(f"{name}: expected {expected} of numbers, found dtype {array.dtype}")
    if array.shape not in [(n, n) for n in sides]:
        raise ValueError(f"{name}: expected {expected}, found shape {array.shape}")
    if not np.all(np.isfinite(array)):
        raise ValueError(f"{name}: expected {expected} of finite numbers, found {array.tolist()}")
    rows = np.eye(4)
    rows[: len(array), : len(array)] = array
    return [[float(number) for number in row] for row in rows]


def out(value: object, shape: tuple[int, int]) -> Floats:
    """An array that a result can be written to."""
    expected = f"a writeable float32 array of shape {shape}"
    if not isinstance(value, np.ndarray):
        raise TypeError(f"out: expected {expected}, found {_described(value)}")
    if value.dtype != np.float32:
        raise TypeError(f"out: expected {expected}, found dtype {value.dtype}")
    if value.shape != shape:
        raise ValueError(f"out: expected {expected}, found shape {value.shape}")
    if not value.flags.writeable:
        raise ValueError(f"out: expected {expected}, found one that is read-only")
    return value


def _described(value: object) -> str:
    """None as it is, and the type of anything else."""
    return "None" if value is None else f"{type(value).__name__} {value!r:.60}"
