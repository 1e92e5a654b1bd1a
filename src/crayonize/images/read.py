"""The way in for pictures: a photo or array becomes linear RGB of the wished size, upright, on its
ground.
"""

from __future__ import annotations

import os
import stat
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from importlib import import_module
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, UnidentifiedImageError

from stroke_gen.alike import plain_opencv

from ..light import area
from ..machine import memory
from .icc import lineariser
from .scan import Scan, check_size, damage_named, scan_array, scan_picture

Source = str | os.PathLike[str] | Image.Image | NDArray[Any]

FORMATS = ("JPEG", "PNG", "WEBP", "TIFF", "AVIF")

# pixels turned into light at a time: 1.5 MB of float32, which the cache holds
_STRIP_PIXELS = 1 << 17

# EXIF orientation -> what turns the stored picture upright.
_TURNS: dict[int, Callable[[NDArray[Any]], NDArray[Any]]] = {
    2: lambda a: a[:, ::-1],
    3: lambda a: a[::-1, ::-1],
    4: lambda a: a[::-1],
    5: lambda a: a.swapaxes(0, 1),
    6: lambda a: a.swapaxes(0, 1)[:, ::-1],
    7: lambda a: a[::-1, ::-1].swapaxes(0, 1),
    8: lambda a: a.swapaxes(0, 1)[::-1],
}

_pillow_limit = threading.Lock()


def read_linear(
    source: Source,
    max_side: int | None = None,
    ground: tuple[float, float, float] = (1.0, 1.0, 1.0),
) -> NDArray[np.float32]:
    """Read a picture as light: upright, in sRGB primaries, laid on the ground, reduced to the size
    needed.

    source: a path (JPEG, PNG, WebP, TIFF, AVIF; HEIC with the extra `heic`; of a moving picture the
        first frame), an open Pillow image (of 8 bits if in colour), or an array (h, w), (h, w, 1),
        (h, w, 3) or (h, w, 4) of uint8, uint16 or sRGB-encoded floats 0..1.
    max_side: longest side of the result in pixels; None keeps the size, and nothing is ever
        enlarged. Each pixel of the result is the mean of the area it covers, taken in linear light.
    ground: linear RGB behind transparent pixels.
    Returns linear RGB, float32 (h, w, 3) in [0, 1], C-contiguous, writable, ours alone.
    ValueError, one line with the name of the file, for anything that is not a whole picture within
    the limits MAX_PIXELS and MAX_SIDE of scan.py.
    """
    with open_photo(source) as photo:
        return photo.light(max_side, ground)


@dataclass
class Photo:
    """A photo whose header has been read, and whose light can be taken once.

    width, height: pixels as stored.   decoding: bytes that taking the light needs beside the light.
    exif: what it tells of itself, once its light has been taken; None for an array, or if broken.
    """

    source: Source
    width: int
    height: int
    decoding: int
    _name: str
    _picture: Image.Image | None
    _scan: Callable[[], Scan]
    exif: Image.Exif | None = None

    @plain_opencv()
    def light(
        self, max_side: int | None = None, ground: tuple[float, float, float] = (1.0, 1.0, 1.0)
    ) -> NDArray[np.float32]:
        """Decode it, as `read_linear` says; the decoded pixels are given back at the end."""
        with _named(self._name):
            light = _light(self._scan(), max_side, ground)
        if self._picture is not None:
            # Not before it is decoded: Pillow decodes a PNG for them, and an error would be lost.
            with suppress(Exception):  # broken EXIF raises nearly anything
                self.exif = self._picture.getexif()
            if not isinstance(self.source, Image.Image):
                self._picture.close()
        return light


@contextmanager
def open_photo(source: Source | Photo) -> Iterator[Photo]:
    """Read the header of a photo: nothing is decoded before its light is asked for.

    source and ValueErrors as for `read_linear`; a Photo is handed back as it is.
    """
    if isinstance(source, Photo):
        yield source
    elif isinstance(source, np.ndarray):
        with _named("array"):
            scan = scan_array(source)
        yield Photo(source, scan.width, scan.height, 0, "array", None, lambda: scan)
    elif isinstance(source, Image.Image):
        with _named("picture"):
            check_size(source.width, source.height)
        yield _photo(source, source, "picture", None)
    else:
        with _named(shown(source)):
            file = _opened(source)
        with file:
            with _named(shown(source)):
                picture = _identify(file)
                check_size(picture.width, picture.height)
            yield _photo(source, picture, shown(source), file)


def _photo(source: Source, picture: Image.Image, name: str, file: IO[bytes] | None) -> Photo:
    deep = ";16" in repr(getattr(picture, "tile", ""))
    decoding = memory.decoding(picture.format, picture.width * picture.height, deep)
    return Photo(
        source, *picture.size, decoding, name, picture, lambda: scan_picture(picture, file)
    )


def _light(
    scan: Scan, max_side: int | None, ground: tuple[float, float, float]
) -> NDArray[np.float32]:
    if max_side is not None and max_side < 1:
        raise ValueError(
            f"max_side is {max_side}; it must be at least 1 pixel, or None to keep the size"
        )
    under = np.array(ground, np.float32)
    if under.shape != (3,) or not ((under >= 0) & (under <= 1)).all():
        raise ValueError(f"ground is {ground!r}; it must be three numbers from 0 to 1 (linear RGB)")
    return _develop(scan, max_side, under)


@contextmanager
def open_picture(path: str | os.PathLike[str]) -> Iterator[tuple[Image.Image, IO[bytes]]]:
    """Open a picture by our own handle, header only: (Pillow image, file).

    Names itself in ValueErrors.
    """
    with _named(shown(path)), _opened(path) as file:
        picture = _identify(file)
        check_size(picture.width, picture.height)
        yield picture, file


def shown(path: str | os.PathLike[str]) -> str:
    """A path as one printable line, whatever bytes its name is made of."""
    return repr(os.fsdecode(path))


@contextmanager
def _named(name: str) -> Iterator[None]:
    """Put the name of the picture before any ValueError from inside."""
    try:
        yield
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from error


def _opened(path: str | os.PathLike[str]) -> IO[bytes]:
    """The file, if it is one: opening a pipe would wait for ever, opening a device may set it
    going.
    """
    try:
        if stat.S_ISREG(os.stat(path).st_mode):
            return open(path, "rb")
    except OSError as error:
        raise ValueError(
            f"cannot be opened ({error.strerror}); give the path of a readable picture"
        ) from error
    raise ValueError("is no ordinary file; give the path of one picture")


def _identify(file: IO[bytes]) -> Image.Image:
    """Let Pillow read the header, by content and among our formats only."""
    start = file.read(16)
    if not start:
        raise ValueError("is an empty file; give a picture")
    try:
        return _open_unlimited(file, FORMATS)
    except UnidentifiedImageError as error:
        if start[4:8] == b"ftyp":  # the family of HEIC and AVIF
            return _open_heic(file)
        kinds = "JPEG, PNG, WebP, TIFF or AVIF"
        raise ValueError(
            f"is no {kinds} picture, or its header is damaged; convert it to one of these"
        ) from error


def _open_heic(file: IO[bytes]) -> Image.Image:
    try:
        import_module("pi_heif").register_heif_opener()
    except ImportError as error:
        raise ValueError(
            'seems to be a HEIC picture; to read it: pip install "crayonize[heic]"'
        ) from error
    try:
        return _open_unlimited(file, ("HEIF",))
    except UnidentifiedImageError as error:
        raise ValueError(
            "is no HEIC or AVIF picture, or its header is damaged; convert it to JPEG"
        ) from error


def _open_unlimited(file: IO[bytes], formats: tuple[str, ...]) -> Image.Image:
    """Image.open without Pillow's global limit (warning at 89, end at 179 million); ours is
    check_size.
    """
    file.seek(0)
    with _pillow_limit, damage_named():
        before, Image.MAX_IMAGE_PIXELS = Image.MAX_IMAGE_PIXELS, None
        try:
            return Image.open(file, formats=formats)
        finally:
            Image.MAX_IMAGE_PIXELS = before


def _develop(scan: Scan, max_side: int | None, ground: NDArray[np.float32]) -> NDArray[np.float32]:
    """Turn strips into light, lay them on the ground, reduce them, and set the picture upright."""
    height, width = scan.height, scan.width
    shrink = min(1.0, (max_side or max(height, width)) / max(height, width))
    out = np.zeros((max(1, round(height * shrink)), max(1, round(width * shrink)), 3), np.float32)
    step = max(1, _STRIP_PIXELS // width)
    to_light = _strip_reader(scan, ground)
    for top in range(0, height, step):
        strip = to_light(top, min(top + step, height))
        if shrink < 1:
            area.add_rows(out, area.narrowed(strip, out.shape[1]), top, height)
        else:
            out[top : top + len(strip)] = strip
    np.clip(out, 0, 1, out=out)
    turn = _TURNS.get(scan.orientation)
    return out if turn is None else np.array(turn(out), order="C")


def _strip_reader(
    scan: Scan, ground: NDArray[np.float32]
) -> Callable[[int, int], NDArray[np.float32]]:
    """(top, bottom) -> linear RGB (bottom - top, width, 3) of these rows over the ground."""
    first = scan.rows(0, 1)
    channels = 3 if first.shape[2] > 2 else 1
    to_light = lineariser(scan.light, channels, first.dtype, scan.full)

    def strip(top: int, bottom: int) -> NDArray[np.float32]:
        stored = scan.rows(top, bottom)
        light = np.empty((*stored.shape[:2], 3), np.float32)
        light[...] = to_light(stored[..., :channels])
        if stored.shape[2] > channels:
            alpha = np.clip(stored[..., channels:].astype(np.float32) / np.float32(scan.full), 0, 1)
            light = light * alpha + ground * (1 - alpha)
        if scan.key is not None:
            light[(stored[..., :channels] == scan.key).all(axis=-1)] = ground
        return light

    return strip
