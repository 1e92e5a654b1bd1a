"""Which reader a file needs, found by its content: headers now, pixels when they are asked for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import IO, NamedTuple

from PIL import Image, UnidentifiedImageError

from ..machine import memory
from . import boxes, pillow, png, tiff
from .scan import Scan, check_size
from .told import exif_of

FORMATS = ("JPEG", "PNG", "WEBP", "TIFF", "AVIF")
_KINDS = "JPEG, PNG, WebP, TIFF or AVIF"


class Decoded(NamedTuple):
    """A picture with its pixels, what it tells of itself, and what is wrong with it ("" if
    nothing).
    """

    scan: Scan
    exif: Image.Exif | None
    warning: str


@dataclass
class Stored:
    """A picture whose header has been read.

    width, height: pixels as stored.   decoding: bytes that `decode` takes beside the result.
    """

    width: int
    height: int
    decoding: int
    decode: Callable[[], Decoded]


def stored(file: IO[bytes]) -> Stored:
    """Read the header of a picture; ValueError if it is none, or beyond the limits."""
    start = file.read(16)
    if not start:
        raise ValueError("is an empty file; give a picture")
    if start[:4] in tiff.STARTS:
        return _stored_tiff(file)
    warning = ""
    if start.startswith(png.SIGNATURE) and (mended := png.mended(file)):
        file, warning = mended, "has notes with wrong check sums beside the picture, left out here"
    return of_picture(identified(file), file, warning)


def of_picture(picture: Image.Image, file: IO[bytes] | None, warning: str = "") -> Stored:
    """A picture that Pillow has opened, from a file if that is known."""
    check_size(picture.width, picture.height)
    layout = pillow.layout_of(picture)
    part = boxes.crop(file, *picture.size) if file and picture.format == "AVIF" else None
    width, height = (part.width, part.height) if part else picture.size
    pixels, deep = picture.width * picture.height, pillow.is_deep_png(layout)

    def decode() -> Decoded:
        whole, missing = pillow.decoded(picture, file)
        scan = pillow.cropped(pillow.scan(whole, file, layout), part)
        # Exif not before the pixels: Pillow decodes a PNG for it, and an error would be lost.
        return Decoded(scan, exif_of(whole), warning or missing)

    return Stored(width, height, memory.decoding(picture.format, pixels, deep), decode)


def _stored_tiff(file: IO[bytes]) -> Stored:
    page = tiff.page_of(file)
    picture = tiff.pillow_picture(file, page)
    if picture is not None:
        return of_picture(picture, file)

    def decode() -> Decoded:
        return Decoded(tiff.scan(file, page), tiff.exif(file), "")

    return Stored(page.imagewidth, page.imagelength, tiff.decoding_bytes(page), decode)


def identified(file: IO[bytes]) -> Image.Image:
    """What Pillow makes of a file, by content and among our formats only."""
    try:
        return pillow.opened(file, FORMATS)
    except UnidentifiedImageError as error:
        file.seek(0)
        if not boxes.is_boxed(file.read(8)):
            raise ValueError(
                f"is no {_KINDS} picture, or its header is damaged; convert it to one of these"
            ) from error
        if boxes.is_avif(file):
            raise ValueError("is an AVIF picture with a damaged header; save it again") from error
        return _heic(file)


def _heic(file: IO[bytes]) -> Image.Image:
    try:
        import_module("pi_heif").register_heif_opener()
    except ImportError as error:
        raise ValueError(
            'seems to be a HEIC picture; to read it: pip install pi-heif'
        ) from error
    try:
        return pillow.opened(file, ("HEIF",))
    except UnidentifiedImageError as error:
        raise ValueError(
            "is no HEIC or AVIF picture, or its header is damaged; convert it to JPEG"
        ) from error
