"""PNG on all threads: bands of rows are packed side by side, and their streams joined into one.

Every row takes the filter "average": on crayon grain it packs better than choosing a filter row by row, and
packing harder than the first level takes longer and saves nothing.
"""

import struct
import zlib
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from io import BytesIO

import numpy as np
from numpy.typing import NDArray

BAND = 1 << 20  # bytes packed by one task
_AVERAGE = 3
_HEAD, _EMPTY_LAST_BLOCK = b"\x78\x01", b"\x03\x00"  # of a zlib stream
_PRIME = 65521  # of Adler's checksum

Rows = NDArray[np.uint8]  # (h, 3 w)


def with_picture(frame: bytes, srgb8: NDArray[np.uint8], threads: int | None = None) -> BytesIO:
    """A PNG file whose picture is replaced by uint8 (h, w, 3); all else that it holds stays.

    frame: a whole file that shows RGB of 8 bits, of any size, in one piece.
    """
    out = BytesIO()
    out.write(frame[:8])
    at = 8
    while at < len(frame):
        size, name = struct.unpack_from(">I4s", frame, at)
        if name == b"IHDR":
            shape = struct.pack(">II", *srgb8.shape[1::-1])
            out.write(_chunk(name, shape + frame[at + 16 : at + 8 + size]))
        elif name == b"IDAT":
            for part in _packed(srgb8.reshape(len(srgb8), -1), threads):
                out.write(_chunk(name, part))
        else:
            out.write(frame[at : at + 12 + size])
        at += 12 + size
    return out


def _chunk(name: bytes, body: bytes) -> bytes:
    return struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(body, zlib.crc32(name)))


def _packed(rows: Rows, threads: int | None) -> Iterator[bytes]:
    """The zlib stream of a picture, part by part: the same on any number of threads."""
    step = max(1, BAND // rows.shape[1])
    checksum = 1
    yield _HEAD
    with ThreadPoolExecutor(threads) as pool:
        for part, own, size in pool.map(lambda top: _band(rows, top, top + step), range(0, len(rows), step)):
            checksum = _joined(checksum, own, size)
            yield part
    yield _EMPTY_LAST_BLOCK + struct.pack(">I", checksum)


def _band(rows: Rows, top: int, bottom: int) -> tuple[bytes, int, int]:
    """Rows packed up to a whole byte, the checksum of what was packed, and its size."""
    filtered = _filtered(rows[top:bottom], rows[top - 1 : top])
    packer = zlib.compressobj(1, zlib.DEFLATED, -zlib.MAX_WBITS)
    return packer.compress(filtered.data) + packer.flush(zlib.Z_SYNC_FLUSH), zlib.adler32(filtered.data), filtered.size


def _filtered(rows: Rows, before: Rows) -> Rows:
    """Each row less the mean of left neighbour and row above, its filter's number first (PNG 3rd edition, 9.2)."""
    up, left = np.zeros_like(rows), np.zeros_like(rows)
    up[1:], left[:, 3:] = rows[:-1], rows[:, :-3]
    up[: len(before)] = before
    out = np.empty((rows.shape[0], 1 + rows.shape[1]), np.uint8)
    out[:, 0] = _AVERAGE
    np.subtract(rows, (left & up) + ((left ^ up) >> 1), out=out[:, 1:])
    return out


def _joined(first: int, second: int, size: int) -> int:
    """Adler's checksum of two pieces, the second `size` bytes long, from the checksums of both."""
    a, b = first & 0xFFFF, first >> 16
    return (b + (second >> 16) + size * (a - 1)) % _PRIME << 16 | (a + (second & 0xFFFF) - 1) % _PRIME
