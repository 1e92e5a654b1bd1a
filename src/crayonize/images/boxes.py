"""The boxes of AVIF and HEIC (ISO 14496-12, 23008-12): what they are, and what Pillow leaves out.

Pillow hands on neither the colours told by code points (colr nclx) nor the clean aperture (clap).
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import IO, NamedTuple

_LARGEST = 1 << 20  # bytes of a meta box that is looked through
_AVIF = (b"avif", b"avis")


class Crop(NamedTuple):
    """The part of a picture to be shown, in pixels as stored."""

    left: int
    top: int
    width: int
    height: int


def is_boxed(start: bytes) -> bool:
    """Whether a file that begins so is of this family."""
    return start[4:8] == b"ftyp"


def is_avif(file: IO[bytes]) -> bool:
    """Whether the file says that it is AVIF, by its main brand or among the others."""
    file.seek(0)
    brands = file.read(min(1024, max(16, int.from_bytes(file.read(4)))) - 4)[4:]
    return any(brands[i : i + 4] in _AVIF for i in (0, *range(8, len(brands) - 3, 4)))


def codes(file: IO[bytes]) -> tuple[int, int] | None:
    """(primaries, transfer) of the main picture, if it tells its colours by code points."""
    for kind, body in _properties(file):
        if kind == b"colr" and body[:4] == b"nclx" and len(body) >= 10:
            primaries, transfer = struct.unpack_from(">HH", body, 4)
            return primaries, transfer
    return None


def crop(file: IO[bytes], width: int, height: int) -> Crop | None:
    """The clean aperture of the main picture of this size; None if there is none within it."""
    for kind, body in _properties(file):
        if kind == b"clap" and len(body) >= 32:
            values = struct.unpack_from(">IIIIiIiI", body)
            if not all(values[1::2]):
                return None
            w, h, across, down = (values[i] / values[i + 1] for i in range(0, 8, 2))
            left = round((width - w) / 2 + across)
            top = round((height - h) / 2 + down)
            part = Crop(left, top, round(w), round(h))
            fits = left >= 0 and top >= 0 and left + part.width <= width
            return part if fits and part.height and top + part.height <= height else None
    return None


def _properties(file: IO[bytes]) -> list[tuple[bytes, bytes]]:
    """(name, content) of what is said about the main picture; empty if that cannot be made out."""
    try:
        file.seek(0)
        return _of_main(_meta(file))
    except (struct.error, LookupError):
        return []


def _meta(file: IO[bytes]) -> bytes:
    """The content of the box `meta`; LookupError if it is not there."""
    while len(head := file.read(8)) == 8:
        size, kind = struct.unpack(">I4s", head)
        if kind == b"meta":
            return file.read(min(max(0, size - 8), _LARGEST))[4:]
        if size < 8:
            break
        file.seek(size - 8, 1)
    raise LookupError


def _of_main(meta: bytes) -> list[tuple[bytes, bytes]]:
    top = dict(_inside(meta))
    pitm, inner = top[b"pitm"], dict(_inside(top[b"iprp"]))
    main = int.from_bytes(pitm[4 : 8 if pitm[0] else 6])
    all_ = list(_inside(inner[b"ipco"]))
    numbers = dict(_associations(inner[b"ipma"]))[main]
    return [all_[n - 1] for n in numbers if 0 < n <= len(all_)]


def _inside(body: bytes) -> Iterator[tuple[bytes, bytes]]:
    at = 0
    while at + 8 <= len(body):
        size, kind = struct.unpack_from(">I4s", body, at)
        if size < 8:
            return
        yield kind, body[at + 8 : at + size]
        at += size


def _associations(body: bytes) -> Iterator[tuple[int, list[int]]]:
    """(item, numbers of its properties) of an `ipma` box."""
    wide_item, wide_number = body[0] > 0, body[3] & 1
    (count,) = struct.unpack_from(">I", body, 4)
    at = 8
    for _ in range(min(count, 10_000)):
        (item,) = struct.unpack_from(">I" if wide_item else ">H", body, at)
        at += 4 if wide_item else 2
        number = body[at]
        step = 2 if wide_number else 1
        rows = [body[at + 1 + i * step : at + 1 + (i + 1) * step] for i in range(number)]
        yield item, [int.from_bytes(row) & (0x7FFF if wide_number else 0x7F) for row in rows]
        at += 1 + number * step
