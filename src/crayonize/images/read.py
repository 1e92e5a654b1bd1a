"""The way in for pictures: a photo or array becomes linear RGB of the wished size, upright, on its
ground.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from io import BytesIO
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from stroke_gen.alike import plain_opencv

from ..light import area
from .files import Decoded, Stored, identified, of_picture, stored
from .icc import lineariser
from .scan import Scan, check_size, scan_array

Source = str | os.PathLike[str] | Image.Image | NDArray[Any] | bytes

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


class Photo:
    """A photo whose header has been read, and whose light can be taken once.

    name: as in messages.   width, height: pixels as stored.   decoding: bytes that taking the light
    needs beside the light.   exif: what it tells of itself, warning: what is wrong with it ("" if
    nothing); both once its light has been taken.
    """

    def __init__(self, source: Source, name: str, picture: Stored) -> None:
        self.source = source
        self.width, self.height, self.decoding = picture.width, picture.height, picture.decoding
        self.exif: Image.Exif | None = None
        self.warning = ""
        self.name = name
        self._decode: Callable[[], Decoded] | None = picture.decode

    @plain_opencv()
    def light(
        self, max_side: int | None = None, ground: tuple[float, float, float] = (1.0, 1.0, 1.0)
    ) -> NDArray[np.float32]:
        """Decode it, as `read_linear` says; the decoded pixels are given back at the end."""
        assert self._decode is not None, "the light of a photo is taken once"
        with _named(self.name):
            scan, self.exif, self.warning = self._decode()
            self._decode = None
            return _light(scan, max_side, ground)


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
        found = Decoded(scan, None, "")
        yield Photo(source, "array", Stored(scan.width, scan.height, 0, lambda: found))
    elif isinstance(source, Image.Image):
        with _named("picture"):
            picture = of_picture(source, None)
        yield Photo(source, "picture", picture)
    elif isinstance(source, bytes):
        with _named("bytes"):
            picture = stored(BytesIO(source))
        yield Photo(source, "bytes", picture)
    else:
        with _named(shown(source)):
            file = _opened(source)
        with file:
            with _named(shown(source)):
                picture = stored(file)
            yield Photo(source, shown(source), picture)


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
        picture = identified(file)
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
        values = scan.rows(top, bottom)
        colours, alpha = values[..., :channels], values[..., channels:]
        if alpha.size and scan.premultiplied:
            colours = _divided(colours, alpha, scan.full)
        light = np.empty((*values.shape[:2], 3), np.float32)
        light[...] = to_light(colours)
        if alpha.size:
            share = np.clip(alpha.astype(np.float32) / np.float32(scan.full), 0, 1)
            light = light * share + ground * (1 - share)
        if scan.key is not None:
            light[(colours == scan.key).all(axis=-1)] = ground
        return light

    return strip


def _divided(colours: NDArray[Any], alpha: NDArray[Any], full: float) -> NDArray[Any]:
    """Stored colours as they were before they were multiplied by alpha."""
    whole = np.minimum(colours * (full / np.maximum(alpha, 1e-9)), full)
    return (np.rint(whole) if colours.dtype.kind == "u" else whole).astype(colours.dtype)
