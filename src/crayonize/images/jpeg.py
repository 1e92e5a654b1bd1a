"""JPEG that ends too soon: without its end marker, or without its last blocks.

Cameras, cards and cut transfers leave such files, and every viewer shows them. libjpeg fills what
is not there with grey once it is given an end. How much that is, is found by taking still more
away: the last bytes that are there show in the last blocks that are there.
"""

from __future__ import annotations

from io import BytesIO
from typing import IO

import numpy as np
from numpy.typing import NDArray
from PIL import Image

_END = b"\xff\xd9"
_BLOCK = 16  # pixels
_LOST = 0.05  # of the blocks, at most
_RUN_OVER = 0.15  # of a block's pixels, to which the colours of the block before run over
_TAIL = 0.01  # of the bytes, taken away for the trial
_NO_CONTENT = (0x01, *range(0xD0, 0xD9))  # markers that stand alone


def ended(file: IO[bytes]) -> Image.Image | None:
    """The picture of a JPEG whose end is missing; None if more of it is missing than the end."""
    file.seek(0)
    data = file.read().rstrip(b"\0")
    scans = _scans(data)
    if not scans:
        return None
    tail = max(8, int(len(data) * _TAIL))
    try:
        picture, shorter = (_decoded(part + _END) for part in (data, data[:-tail]))
    except (OSError, SyntaxError):
        return None
    differ = _changed_shares(np.asarray(picture), np.asarray(shorter))
    changed = np.flatnonzero(differ > (_RUN_OVER if scans == 1 else 0))
    return picture if len(changed) and changed[-1] + 1 >= (1 - _LOST) * differ.size else None


def _decoded(data: bytes) -> Image.Image:
    picture = Image.open(BytesIO(data), formats=("JPEG",))
    picture.load()
    return picture


def _changed_shares(one: NDArray[np.uint8], other: NDArray[np.uint8]) -> NDArray[np.float64]:
    """The share of pixels in which two pictures differ, block by block as they are stored."""
    differ = (one != other).reshape(*one.shape[:2], -1).any(-1)
    height, width = differ.shape
    fill = ((0, -height % _BLOCK), (0, -width % _BLOCK))
    blocks = np.pad(differ, fill).reshape(-(-height // _BLOCK), _BLOCK, -1, _BLOCK)
    return blocks.mean((1, 3)).ravel()


def _scans(data: bytes) -> int:
    """How many scans have begun; 0 if some coefficient of a component is not told to its last
    bit.
    """
    scans, components, told, at = 0, 0, set(), 2
    while (found := data.find(b"\xff", at)) >= 0 and found + 4 <= len(data):
        marker, at = data[found + 1], found + 1 if data[found + 1] == 0xFF else found + 2
        if marker in (0, 0xFF, *_NO_CONTENT):
            continue
        size = int.from_bytes(data[at : at + 2])
        body = data[at + 2 : at + size]
        at += size
        if 0xC0 <= marker <= 0xCF and marker not in (0xC4, 0xC8, 0xCC) and len(body) > 5:
            components = body[5]
        elif marker == 0xDA and len(body) >= 4 and len(body) >= 4 + 2 * body[0]:
            scans += 1
            first, last, bits = body[-3:]
            if not bits & 0x0F:
                told |= {
                    (body[1 + 2 * i], k) for i in range(body[0]) for k in range(first, last + 1)
                }
    return scans if 0 < 64 * components == len(told) else 0
