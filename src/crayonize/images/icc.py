"""Colour at the doors: the sRGB curve both ways, and what an ICC profile says about a picture's
numbers.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

Curve = Callable[[NDArray[Any]], NDArray[Any]]  # stored value 0..1 -> light 0..1

_CHUNK = 1 << 20  # values encoded at a time, so that the scratch arrays stay in the cache
_BINS = (
    # of the encoding table: narrower than the narrowest sRGB step (1 / 3294), so one edge a bin at
    # most
    4095
)

# Columns: red, green, blue of sRGB as XYZ under D50, in the rounding of ICC profiles (IEC
# 61966-2-1).
_SRGB_TO_XYZ = np.array([[28576, 25239, 9375], [14581, 46983, 3972], [912, 6361, 46787]]) / 65536


def srgb_curve(encoded: NDArray[Any]) -> NDArray[Any]:
    """Stored value to light, both 0..1 (IEC 61966-2-1)."""
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


@dataclass(frozen=True)
class Light:
    """How stored numbers become linear sRGB: one curve or one a channel, then primaries."""

    curves: tuple[Curve, ...] = (srgb_curve,)
    matrix: NDArray[np.float32] | None = None  # (3, 3), None when the primaries are those of sRGB
    is_grey: bool = False  # of a profile for grey pictures


SRGB = Light()


def lineariser(
    light: Light, channels: int, dtype: np.dtype[Any], full: float
) -> Callable[[NDArray[Any]], NDArray[Any]]:
    """Prepare the way from stored values to light.

    channels: 1 (grey) or 3. full: the stored value that stands for 1.0. The function returned takes
    (h, w, channels) of the given dtype and gives linear sRGB, float32 in [0, 1], of the same shape.
    8 and 16 bit go through a table.
    """
    curves, matrix = light.curves, light.matrix
    if channels == 1:  # a grey picture under an RGB profile: the middle curve, neutral
        curves, matrix = (curves[len(curves) // 2],), None
    tables = None
    if dtype in (np.uint8, np.uint16):
        steps = np.minimum(np.arange(np.iinfo(dtype).max + 1) / full, 1.0)
        tables = [np.clip(curve(steps), 0, 1).astype(np.float32) for curve in curves]

    def channel(stored: NDArray[Any], index: int) -> NDArray[Any]:
        if tables is not None:
            return np.take(tables[index], stored)
        share = np.clip(stored.astype(np.float32, copy=False) / np.float32(full), 0, 1)
        return curves[index](share).astype(np.float32)

    def linearise(stored: NDArray[Any]) -> NDArray[Any]:
        if len(curves) == 1:
            linear = channel(stored, 0)
        else:
            linear = np.stack([channel(stored[..., i], i) for i in range(channels)], axis=-1)
        if matrix is not None:
            linear = np.clip(cv2.transform(linear, matrix), 0, 1)
        return linear

    return linearise


def decode_srgb(encoded: NDArray[Any]) -> NDArray[np.float32]:
    """Undo the sRGB curve (IEC 61966-2-1): uint8, uint16 or float 0..1, any shape -> linear
    float32.
    """
    encoded = np.asarray(encoded)
    full = float(np.iinfo(encoded.dtype).max) if encoded.dtype.kind == "u" else 1.0
    return lineariser(SRGB, 1, encoded.dtype, full)(encoded)


@lru_cache(maxsize=1)
def _encoding_tables() -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """(the code at the lower end of each bin, the light from which each code gives way to the
    next).
    """
    edges = np.append(srgb_curve((np.arange(255) + 0.5) / 255), np.inf).astype(np.float32)
    # A hundredth below the bin, as rounding may put a value into the bin above; the edge test mends
    # it.
    low = np.searchsorted(edges, (np.arange(_BINS + 1) - 0.01) / _BINS, side="right")
    return low.astype(np.uint8), edges


def encode_srgb(linear: NDArray[Any]) -> NDArray[np.uint8]:
    """Put light through the sRGB curve (IEC 61966-2-1) and round to the nearest of 256 steps.

    linear: float of any shape; below 0 and above 1 is clipped. Exact and the same on every machine:
    a table finds the step or the one below, a comparison with the edge between them decides.
    ValueError for NaN.
    """
    low, edges = _encoding_tables()
    flat = np.ascontiguousarray(linear, np.float32).reshape(-1)
    codes = np.empty(flat.shape, np.uint8)
    for start in range(0, len(flat), _CHUNK):
        light = np.clip(flat[start : start + _CHUNK], 0, 1)
        if np.isnan(light).any():
            raise ValueError(
                "linear: holds values that are not numbers (NaN); they must be light from 0 to 1"
            )
        code = low[(light * _BINS).astype(np.uint16)]
        codes[start : start + _CHUNK] = code + (light >= edges[code])
    return codes.reshape(np.shape(linear))


def light_from_profile(profile: bytes) -> Light | None:
    """Read an ICC profile made of curves and primaries (ICC.1:2022, 9.2 and 10.6, 10.18).

    That is nearly every profile of a camera, screen or working space (sRGB, Display P3, Adobe RGB,
    ProPhoto, grey gammas). None for profiles made of tables (printers, scanners), other colour
    spaces, damaged ones.
    Read here, not by LittleCMS, because Pillow offers that in 8 bits only: wide primaries would
        band.
    """
    try:
        with np.errstate(over="raise", invalid="raise", divide="raise"):
            return _read_profile(profile)
    except (struct.error, LookupError, ValueError, ArithmeticError):
        return None


def _read_profile(profile: bytes) -> Light | None:
    space, connection = profile[16:20], profile[20:24]
    (count,) = struct.unpack_from(">I", profile, 128)
    tags: dict[bytes, bytes] = {}
    for i in range(min(count, 100)):
        name, start, size = struct.unpack_from(">4sII", profile, 132 + 12 * i)
        tags[name] = profile[start : start + size]
    if profile[36:40] != b"acsp" or connection != b"XYZ " or b"A2B0" in tags:
        return None
    if space == b"GRAY":
        return Light((_curve(tags[b"kTRC"]),), is_grey=True)
    if space != b"RGB ":
        return None
    primaries = [struct.unpack_from(">3i", tags[name], 8) for name in (b"rXYZ", b"gXYZ", b"bXYZ")]
    to_srgb = np.linalg.solve(_SRGB_TO_XYZ, np.array(primaries).T / 65536)
    curves = tuple(_curve(tags[name]) for name in (b"rTRC", b"gTRC", b"bTRC"))
    return simplified(Light(curves, to_srgb.astype(np.float32)))


def simplified(light: Light) -> Light:
    """The light, or plain SRGB if that is the same to a tenth of an 8-bit step.

    Unusable curves raise.
    """
    steps = np.linspace(0, 1, 256)
    ramps = np.stack([curve(steps) for curve in light.curves])
    same_primaries = light.matrix is None or np.abs(light.matrix - np.eye(3)).max() < 4e-4
    return SRGB if same_primaries and np.abs(ramps - srgb_curve(steps)).max() < 4e-4 else light


def _curve(tag: bytes) -> Curve:
    """A curve tag: a power, a sampled table or one of the five formulas of "para"."""
    kind, number = struct.unpack_from(">4s4xI", tag)
    if kind == b"curv" and number > 1:
        samples = np.array(struct.unpack_from(f">{number}H", tag, 12)) / 65535
        return lambda x: np.interp(x, np.linspace(0, 1, len(samples)), samples)
    if kind == b"curv":
        gamma = struct.unpack_from(">H", tag, 12)[0] / 256 if number else 1.0
        return _formula(gamma)
    if kind != b"para":
        raise ValueError("unknown kind of curve")
    form = number >> 16
    values = [v / 65536 for v in struct.unpack_from(f">{(1, 3, 4, 5, 7)[min(form, 4)]}i", tag, 12)]
    match form, values:
        case 0, [gamma]:
            return _formula(gamma)
        case 1, [gamma, a, b]:
            return _formula(gamma, a, b, d=-b / a)
        case 2, [gamma, a, b, c]:
            return _formula(gamma, a, b, d=-b / a, e=c, f=c)
        case ((3 | 4), _):
            return _formula(*values)
    raise ValueError("unknown formula")


def _formula(
    gamma: float, a: float = 1, b: float = 0, c: float = 0, d: float = 0, e: float = 0, f: float = 0
) -> Curve:
    """(a x + b)^gamma + e from d on, c x + f below."""
    return lambda x: np.where(x >= d, np.maximum(a * x + b, 0) ** gamma + e, c * x + f)
