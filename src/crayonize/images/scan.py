"""Decoded pictures as strips of stored values, with all that is needed to know what the values
mean.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import UnidentifiedImageError

from ..machine.memory import MAX_PIXELS
from .icc import SRGB, Light

MAX_SIDE = 1_000_000

# floats of an array may leave 0..1 by this much (sharpening, resampling) and are clipped
_OVERSHOOT = 0.1
# floats of a TIFF up to here are 0..1 with highlights; beyond, 0..255 or 0..65535
_HIGHLIGHTS = 8.0


@dataclass(frozen=True)
class Scan:
    """A decoded picture that hands out its rows in strips of stored values."""

    height: int
    width: int
    # (top, bottom) -> (bottom - top, width, 1..4); the 2nd of two and the 4th of four is alpha
    rows: Callable[[int, int], NDArray[Any]]
    full: float = 255.0  # the stored value that stands for 1.0
    light: Light = SRGB
    key: tuple[int, ...] | None = None  # the stored colour that means "nothing here"
    orientation: int = 1  # of Exif, still to be applied
    premultiplied: bool = False  # the colours have been multiplied by alpha


class Refused(ValueError):
    """A picture that is whole but is not read, in one line that says why."""


def check_size(width: int, height: int) -> None:
    """ValueError for a picture of no pixels, or of more than we decode."""
    if min(width, height) < 1:
        raise Refused(f"is empty ({width} x {height} pixels); a picture needs at least one pixel")
    if width * height > MAX_PIXELS or max(width, height) > MAX_SIDE:
        most = f"{MAX_PIXELS // 1_000_000} million, {MAX_SIDE} a side"
        raise Refused(f"has {width} x {height} pixels; at most {most} are taken: reduce it first")


@contextmanager
def damage_named() -> Iterator[None]:
    """Damaged files raise nearly anything inside a reader (OSError, SyntaxError, KeyError ...)."""
    try:
        yield
    except (MemoryError, UnidentifiedImageError, Refused):
        raise
    except Exception as error:
        reason = " ".join(str(error).split())[:120] or type(error).__name__
        raise ValueError(f"is damaged or cut short ({reason}); copy or save it again") from error


def full_scale(values: NDArray[Any]) -> float:
    """The value that stands for white: the smallest usual full scale that holds the brightest
    pixel.

    Refused for values below 0, which no convention calls black, and for such as are no numbers.
    """
    kind, low, high = values.dtype, float(values.min()), float(values.max())
    if not np.isfinite([low, high]).all():
        raise Refused(
            "holds values that are not finite numbers; every value must be a brightness"
        )
    if kind.kind == "f":
        usual: tuple[float, ...] = (255.0, 65535.0, 2.0**31 - 1, 2.0**32 - 1)
        return 1.0 if high <= _HIGHLIGHTS else next((f for f in usual if high <= f), high)
    if low < 0:
        raise Refused(f"holds values below 0 ({low:g}); save it with unsigned values")
    most = float(np.iinfo(kind).max)
    if kind.itemsize < 4:
        return most
    return next((full for full in (255.0, 65535.0) if high <= full), most)


def scan_array(values: NDArray[Any]) -> Scan:
    """An array given by the caller, taken by its contract and checked against it."""
    values = np.asarray(values)  # a matrix or another subclass behaves otherwise
    if values.ndim == 2:
        values = values[..., np.newaxis]
    if values.ndim != 3 or values.shape[2] not in (1, 3, 4):
        raise ValueError(
            f"has the shape {values.shape}; it must be (h, w), (h, w, 1), (h, w, 3) or (h, w, 4)"
        )
    check_size(values.shape[1], values.shape[0])
    values = values.astype(values.dtype.newbyteorder("="), copy=False)
    if values.dtype.kind == "f":
        low, high = float(values.min()), float(values.max())
        if not (low >= -_OVERSHOOT and high <= 1 + _OVERSHOOT):  # also catches NaN
            raise ValueError(
                f"holds floats from {low:g} to {high:g}; they must be finite and lie in 0..1"
            )
        return strips_of(values, 1.0)
    if values.dtype not in (np.uint8, np.uint16):
        raise ValueError(f"is of type {values.dtype}; it must be uint8, uint16 or float")
    return strips_of(values, float(np.iinfo(values.dtype).max))


def strips_of(values: NDArray[Any], full: float, **more: Any) -> Scan:
    """The rows of an array (h, w, channels); more: fields of Scan."""
    height, width = values.shape[:2]
    return Scan(height, width, lambda top, bottom: values[top:bottom], full, **more)
