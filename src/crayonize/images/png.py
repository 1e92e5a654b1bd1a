"""PNG chunk by chunk: what Pillow does not tell of them, and files that are wrong beside the point.

A chunk with a wrong check sum that the picture does not need is left out, as every viewer does;
Pillow would refuse the whole file.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from io import BytesIO
from typing import IO, NamedTuple

SIGNATURE = b"\x89PNG\r\n\x1a\n"
_MOST = 10_000  # chunks that are looked at
_PIECE = 1 << 20  # bytes summed up at a time


class Chunk(NamedTuple):
    """One chunk: its name, where its content begins, and how many bytes it has."""

    name: bytes
    start: int
    size: int

    @property
    def needed(self) -> bool:
        """Whether there is no picture without it (critical, in the words of the standard)."""
        return not self.name[0] & 0x20


def mended(file: IO[bytes]) -> IO[bytes] | None:
    """The file without damaged chunks that are not needed; None if there is none of them."""
    bad = [chunk for chunk in _chunks(file) if not chunk.needed and not _is_whole(file, chunk)]
    if not bad:
        return None
    file.seek(0)
    data, at, kept = file.read(), 0, bytearray()
    for chunk in bad:
        kept += data[at : chunk.start - 8]
        at = chunk.start + chunk.size + 4
    return BytesIO(kept + data[at:])


def content(file: IO[bytes], name: bytes, size: int) -> bytes | None:
    """What the first chunk of a name holds, if it is whole and of this size."""
    for chunk in _chunks(file):
        if chunk.name == name and chunk.size == size and _is_whole(file, chunk):
            file.seek(chunk.start)
            return file.read(size)
    return None


def _chunks(file: IO[bytes]) -> Iterator[Chunk]:
    """The chunks up to the pixels, as far as they lie in the file."""
    end = file.seek(0, 2)
    at = len(SIGNATURE)
    for _ in range(_MOST):
        file.seek(at)
        head = file.read(8)
        size = int.from_bytes(head[:4])
        if len(head) < 8 or head[4:] == b"IDAT" or at + 12 + size > end:
            return
        yield Chunk(head[4:], at + 8, size)
        at += 12 + size


def _is_whole(file: IO[bytes], chunk: Chunk) -> bool:
    file.seek(chunk.start)
    total, left = zlib.crc32(chunk.name), chunk.size
    while left:
        piece = file.read(min(left, _PIECE))
        total, left = zlib.crc32(piece, total), left - len(piece)
    return total == int.from_bytes(file.read(4))
