"""Pictures that Pillow decodes: all of 8 bits, grey of any depth, and PNG of 16 bits with OpenCV.

Nothing is decoded before its scan is asked for.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import IO, Any

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageCms

from . import boxes, jpeg
from .scan import Refused, Scan, check_size, damage_named, full_scale, strips_of
from .told import Transform, exif_tag, told_by

_ORIENTATION = 274
_COMPARED = 64  # rows that two readers must agree on

_limit = threading.Lock()
_lifted = 0  # how many decode now
_before: int | None = None

_MODES = {
    "1": "L",
    "L": "L",
    "LA": "LA",
    "La": "LA",
    "PA": "RGBA",
    "RGBA": "RGBA",
    "RGBa": "RGBA",
}


@contextmanager
def without_limit() -> Iterator[None]:
    """Pillow without its own limit of pixels, which is the process's; ours is `check_size`."""
    global _lifted, _before
    with _limit:
        if not _lifted:
            _before = Image.MAX_IMAGE_PIXELS
        _lifted += 1
        Image.MAX_IMAGE_PIXELS = None
    try:
        yield
    finally:
        with _limit:
            _lifted -= 1
            if not _lifted:
                Image.MAX_IMAGE_PIXELS = _before


def opened(file: IO[bytes], formats: tuple[str, ...]) -> Image.Image:
    """The header of a picture in one of Pillow's formats."""
    file.seek(0)
    with damage_named(), without_limit():
        return Image.open(file, formats=formats)


def decoded(picture: Image.Image, file: IO[bytes] | None) -> tuple[Image.Image, str]:
    """The picture with its pixels, and a warning if it is not quite whole."""
    with damage_named(), without_limit():
        try:
            picture.load()
        except OSError:
            mended = jpeg.ended(file) if file and picture.format in ("JPEG", "MPO") else None
            if mended is None:
                raise
            return mended, "lacks its end; what is there is drawn"
        if picture.mode == "P" and picture.palette is None:
            raise ValueError("its table of colours is missing")
    return picture, ""


def scan(picture: Image.Image, file: IO[bytes] | None, layout: str) -> Scan:
    """Choose how the values of a decoded picture are to be read.

    file: where it comes from, if known.   layout: Pillow's name for how the file stores them.
    """
    check_size(picture.width, picture.height)
    mode = "CMYK" if picture.mode == "CMYK" else _mode_wanted(picture)
    light, transform = told_by(picture, file, mode).light()
    if picture.mode.startswith(("I", "F")):
        values = np.asarray(picture)
        full = 4095.0 if layout == "I;12" else full_scale(values)
        found = strips_of(values[..., np.newaxis], full)
    elif transform is None and file is not None and is_deep_png(layout):
        found = _deep_png(picture, file)
    else:
        found = of_8_bits(picture, transform)
    return replace(found, light=light, key=_key(picture, layout), orientation=_orientation(picture))


def cropped(scan: Scan, part: boxes.Crop | None) -> Scan:
    """Only a part of a picture."""
    if part is None:
        return scan
    left, right = part.left, part.left + part.width
    return replace(
        scan,
        height=part.height,
        width=part.width,
        rows=lambda top, bottom: scan.rows(part.top + top, part.top + bottom)[:, left:right],
    )


def layout_of(picture: Image.Image) -> str:
    """How the values lie in the file, such as `L;4`; empty once the picture is decoded."""
    tiles = getattr(picture, "tile", None)
    told = tiles[0][3] if tiles else ""
    return str(told[0] if isinstance(told, tuple) else told)


def is_deep_png(layout: str) -> bool:
    """Whether this is colour of 16 bits a channel, of which Pillow keeps 8."""
    return layout in ("RGB;16B", "RGBA;16B", "LA;16B")


def _key(picture: Image.Image, layout: str) -> tuple[int, ...] | None:
    """The one colour of a PNG that means "nothing here", as Pillow gives the pixels."""
    key = picture.info.get("transparency") if picture.mode in ("1", "L", "RGB", "I;16") else None
    if isinstance(key, int):
        return (key * {"L;2": 85, "L;4": 17}.get(layout, 1),)  # the pixels are spread over 0..255
    return key if isinstance(key, tuple) else None


def _orientation(picture: Image.Image) -> int:
    """The EXIF orientation still to be applied: Pillow itself turns TIFF on decoding, and drops the
    tag.
    """
    value = exif_tag(picture, _ORIENTATION)
    return value if isinstance(value, int) else 1


def _mode_wanted(picture: Image.Image) -> str:
    """The plain 8-bit mode that holds all a picture has: L, LA, RGB or RGBA."""
    if picture.mode == "P" and picture.has_transparency_data:
        return "RGBA"
    return _MODES.get(picture.mode, "RGB")


def of_8_bits(picture: Image.Image, transform: Transform | None, orientation: int = 1) -> Scan:
    """Pictures of 8 bits and less, converted strip by strip."""
    mode = _mode_wanted(picture)

    def rows(top: int, bottom: int) -> NDArray[Any]:
        with without_limit():
            strip = picture.crop((0, top, picture.width, bottom))
        if transform is None:
            strip = strip.convert(mode)
        else:
            strip = strip if strip.mode == "CMYK" else strip.convert(mode)
            strip = ImageCms.applyTransform(strip, transform) or strip
        return np.asarray(strip).reshape(bottom - top, picture.width, -1)

    return Scan(picture.height, picture.width, rows, orientation=orientation)


def _deep_png(picture: Image.Image, file: IO[bytes]) -> Scan:
    """16-bit colour decoded once more, by OpenCV from memory, and compared with what Pillow
    found.
    """
    file.seek(0)
    try:
        values = cv2.imdecode(np.frombuffer(file.read(), np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error:
        values = None
    order = [2, 1, 0, 3][: len(picture.mode)]
    if values is None or values.ndim != 3 or values.shape[2] < len(order):
        return of_8_bits(picture, None)
    height, width = values.shape[:2]
    found = Scan(height, width, lambda top, bottom: values[top:bottom, :, order], 65535.0)
    check_agreement(found, picture)
    return found


def check_agreement(scan: Scan, picture: Image.Image) -> None:
    """Refused if values of 16 bits have not the upper bytes Pillow found, in some rows of all."""
    agree = (scan.width, scan.height) == picture.size and scan.rows(0, 1).dtype == np.uint16
    for y in range(0, scan.height, max(1, scan.height // _COMPARED)) if agree else ():
        with without_limit():
            seen = np.asarray(picture.crop((0, y, scan.width, y + 1)))
        agree = agree and np.array_equal(scan.rows(y, y + 1) >> 8, seen)
    if not agree:
        raise Refused("is read differently by two readers; save it again as PNG or JPEG")
