"""Decoded pictures as strips of stored values, with all that is needed to know what the values
mean.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from io import BytesIO
from typing import IO, Any

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageCms, UnidentifiedImageError

from ..machine.memory import MAX_PIXELS
from .icc import SRGB, Light, light_from_profile

MAX_SIDE = 1_000_000

# floats of an array may leave 0..1 by this much (sharpening, resampling) and are clipped
_OVERSHOOT = 0.1
# floats of a TIFF up to here are 0..1 with highlights; beyond, 0..255 or 0..65535
_HIGHLIGHTS = 8.0

_TIFF_BITS, _TIFF_PHOTOMETRIC, _TIFF_SAMPLE_FORMAT, _TIFF_SUBFILE, _DNG_VERSION = (
    258,
    262,
    339,
    254,
    50706,
)
_EXIF_ORIENTATION = 274


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
    orientation: int = 1


def check_size(width: int, height: int) -> None:
    """ValueError for a picture of no pixels, or of more than we decode."""
    if min(width, height) < 1:
        raise ValueError(
            f"is empty ({width} x {height} pixels); a picture needs at least one pixel"
        )
    if width * height > MAX_PIXELS or max(width, height) > MAX_SIDE:
        most = f"{MAX_PIXELS // 1_000_000} million, {MAX_SIDE} a side"
        raise ValueError(
            f"has {width} x {height} pixels; at most {most} are taken: reduce it first"
        )


@contextmanager
def damage_named() -> Iterator[None]:
    """Damaged files raise nearly anything inside Pillow (OSError, SyntaxError, KeyError ...)."""
    try:
        yield
    except (MemoryError, UnidentifiedImageError):
        raise
    except Exception as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise ValueError(f"is damaged or cut short ({reason}); copy or save it again") from error


def scan_picture(picture: Image.Image, file: IO[bytes] | None = None) -> Scan:
    """Decode a Pillow image and choose how its values are to be read.

    file: where it comes from, if known.
    """
    if _tag(picture, _DNG_VERSION, 0) or _tag(picture, _TIFF_SUBFILE, 0) & 1:
        raise ValueError(
            "is a camera raw file or holds only a preview; develop it to JPEG, PNG or TIFF first"
        )
    check_size(picture.width, picture.height)
    with damage_named():
        picture.load()
        if picture.mode == "P" and picture.palette is None:
            raise ValueError("its table of colours is missing")
    light, transform = _color_management(picture)
    if picture.mode.startswith(("I", "F")):
        scan = _scan_deep_grey(picture)
    elif transform is None and file is not None and _is_deep_color(picture, file):
        scan = _scan_deep_color(picture, file) or _scan_8_bit(picture, None)
    else:
        scan = _scan_8_bit(picture, transform)
    key = picture.info.get("transparency") if picture.mode in ("1", "L", "RGB", "I;16") else None
    key = (key,) if isinstance(key, int) else key
    return replace(
        scan,
        light=light,
        key=key if isinstance(key, tuple) else None,
        orientation=_orientation(picture),
    )


def _tag(picture: Image.Image, number: int, default: int) -> int:
    """A TIFF tag as a whole number (the first if there are several)."""
    value = getattr(picture, "tag_v2", {}).get(number, default)
    value = value[0] if isinstance(value, tuple) and value else value
    return value if isinstance(value, int) else default


def exif_tag(picture: Image.Image, number: int) -> Any:
    """A tag of the first EXIF folder, None if it is not there or cannot be read."""
    try:
        return picture.getexif().get(number)
    except Exception:  # broken EXIF raises nearly anything, and the picture itself may be whole
        return None


def _orientation(picture: Image.Image) -> int:
    """The EXIF orientation still to be applied: Pillow itself turns TIFF on decoding, and drops the
    tag.
    """
    value = exif_tag(picture, _EXIF_ORIENTATION)
    return value if isinstance(value, int) else 1


def _mode_wanted(picture: Image.Image) -> str:
    """The plain 8-bit mode that holds all a picture has: L, LA, RGB or RGBA."""
    if picture.mode == "P" and picture.has_transparency_data:
        return "RGBA"
    plain = {
        "1": "L",
        "L": "L",
        "LA": "LA",
        "La": "LA",
        "PA": "RGBA",
        "RGBA": "RGBA",
        "RGBa": "RGBA",
    }
    return plain.get(picture.mode, "RGB")


def _color_management(picture: Image.Image) -> tuple[Light, ImageCms.ImageCmsTransform | None]:
    """What the embedded profile asks for: curves and primaries, or tables by LittleCMS; broken is
    sRGB.
    """
    profile = picture.info.get("icc_profile") or b""
    mode = "CMYK" if picture.mode == "CMYK" else _mode_wanted(picture)
    light = light_from_profile(profile)
    if light is not None or mode == "LA" or b"A2B0" not in profile:
        return light or SRGB, None
    try:
        return SRGB, ImageCms.buildTransform(
            ImageCms.getOpenProfile(BytesIO(profile)),
            ImageCms.createProfile("sRGB"),
            mode,
            "RGBA" if mode == "RGBA" else "RGB",
            ImageCms.Intent.RELATIVE_COLORIMETRIC,
            ImageCms.Flags.BLACKPOINTCOMPENSATION,
        )
    except (OSError, ValueError, ImageCms.PyCMSError):
        return SRGB, None


def _scan_8_bit(picture: Image.Image, transform: ImageCms.ImageCmsTransform | None) -> Scan:
    """Pictures of 8 bits and less, converted strip by strip."""
    mode = _mode_wanted(picture)

    def rows(top: int, bottom: int) -> NDArray[Any]:
        strip = picture.crop((0, top, picture.width, bottom))
        if transform is None:
            strip = strip.convert(mode)
        else:
            strip = strip if strip.mode == "CMYK" else strip.convert(mode)
            strip = ImageCms.applyTransform(strip, transform) or strip
        return np.asarray(strip).reshape(bottom - top, picture.width, -1)

    return Scan(picture.height, picture.width, rows)


def _scan_deep_grey(picture: Image.Image) -> Scan:
    """Grey of 12, 16 or 32 bits or floats, whose full scale depends on what was stored."""
    values = np.asarray(picture)
    if values.dtype.kind == "u":
        full = float(2 ** min(_tag(picture, _TIFF_BITS, 16), 16) - 1)
        values = values.astype(np.uint16, copy=False)
        # white is zero; Pillow turns this over for 8 bits only
        if _tag(picture, _TIFF_PHOTOMETRIC, 1) == 0:
            values = int(full) - values
    else:
        if values.dtype.kind == "i" and _tag(picture, _TIFF_SAMPLE_FORMAT, 2) == 1:  # unsigned
            values = values.view(np.uint32)
        full = _full_scale(float(values.min()), float(values.max()), values.dtype.kind)
    return _strips_of(values[..., np.newaxis], full)


def _full_scale(low: float, high: float, kind: str) -> float:
    """The value that stands for white: the smallest usual full scale that holds the brightest
    pixel.
    """
    if not np.isfinite([low, high]).all():
        raise ValueError(
            "holds values that are not finite numbers; every value must be a brightness"
        )
    if kind == "f" and high <= _HIGHLIGHTS:
        return 1.0
    usual = (255.0, 65535.0, 2.0**31 - 1, 2.0**32 - 1)
    return next((full for full in usual if high <= full), high)


def _is_deep_color(picture: Image.Image, file: IO[bytes]) -> bool:
    """Whether the file holds RGB of 16 bits a channel, of which Pillow keeps 8."""
    if picture.mode not in ("RGB", "RGBA"):
        return False
    if picture.format == "PNG":
        file.seek(24)  # the bit depth in the header chunk
        return file.read(1) == b"\x10"
    return _tag(picture, _TIFF_BITS, 8) == 16


def _scan_deep_color(picture: Image.Image, file: IO[bytes]) -> Scan | None:
    """16-bit RGB decoded once more, by OpenCV from memory; None if that is not the picture Pillow
    found.
    """
    file.seek(0)
    try:
        values = cv2.imdecode(np.frombuffer(file.read(), np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error:
        return None
    order = [2, 1, 0, 3][: len(picture.mode)]
    if (
        values is None
        or values.dtype != np.uint16
        or values.ndim != 3
        or values.shape[2] < len(order)
    ):
        return None
    scan = Scan(
        values.shape[0], values.shape[1], lambda top, bottom: values[top:bottom, :, order], 65535.0
    )
    return scan if _same_picture(scan, picture) else None


def _same_picture(scan: Scan, picture: Image.Image) -> bool:
    """Whether up to 128 rows have the upper bytes Pillow found: OpenCV misreads some layouts of
    TIFF.
    """
    if (scan.width, scan.height) != picture.size:
        return False
    for y in range(0, scan.height, max(1, scan.height // 64)):
        if not np.array_equal(
            scan.rows(y, y + 1) >> 8, np.asarray(picture.crop((0, y, scan.width, y + 1)))
        ):
            return False
    return True


def scan_array(values: NDArray[Any]) -> Scan:
    """An array given by the caller, taken by its contract and checked against it."""
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
        return _strips_of(values, 1.0)
    if values.dtype not in (np.uint8, np.uint16):
        raise ValueError(f"is of type {values.dtype}; it must be uint8, uint16 or float")
    return _strips_of(values, float(np.iinfo(values.dtype).max))


def _strips_of(values: NDArray[Any], full: float) -> Scan:
    height, width = values.shape[:2]
    return Scan(height, width, lambda top, bottom: values[top:bottom], full)
