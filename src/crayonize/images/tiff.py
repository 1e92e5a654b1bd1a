"""TIFF: Pillow reads the plain ones, tifffile those whose values Pillow would read wrongly.

tifffile understands every layout (planes, signs, floats, alpha, colour maps, BigTIFF) but, without
imagecodecs, unpacks only zlib and PackBits; LZW is given to it by way of Pillow.
"""

from __future__ import annotations

import logging
import struct
from io import BytesIO
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, UnidentifiedImageError

from . import pillow
from .scan import Refused, Scan, check_size, damage_named, full_scale, strips_of
from .told import Told

STARTS = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")

_SUBFILE, _DNG_VERSION, _PROFILE = 254, 50706, 34675
_WHITE_IS_ZERO, _BLACK_IS_ZERO, _RGB, _PALETTE, _CMYK = 0, 1, 2, 3, 5
_UNPACKED = (1, 5, 8, 32773, 32946)  # compressions: none, LZW, zlib, PackBits, zlib
_PREDICTORS = (1, 2)
_SEPARATE = 2
_ASSOCIATED, _UNASSOCIATED = 1, 2
_MOST_SAMPLES = 8


def page_of(file: IO[bytes]) -> Any:
    """The first page as tifffile describes it.

    ValueError for a damaged one, a raw file, or one too large.
    """
    import tifffile

    logging.getLogger("tifffile").setLevel(logging.CRITICAL)
    codecs: Any = vars(tifffile.tifffile)["imagecodecs"]
    if not hasattr(codecs, "lzw_decode"):
        codecs.lzw_decode = _lzw
    file.seek(0)
    with damage_named():
        page: Any = tifffile.TiffFile(file).pages[0]
        tags = page.tags
        if _DNG_VERSION in tags or int(page.subfiletype or 0) & 1:
            raise Refused(
                "is a camera raw file or holds only a preview; develop it to JPEG, PNG or TIFF "
                "first"
            )
        check_size(int(page.imagewidth), int(page.imagelength))
        if int(page.imagedepth) != 1 or not 1 <= int(page.samplesperpixel) <= _MOST_SAMPLES:
            raise Refused("is no flat picture; save it as PNG")
    return page


def pillow_picture(file: IO[bytes], page: Any) -> Image.Image | None:
    """Pillow's view of it if that is right, None if tifffile is to decode it."""
    try:
        picture = pillow.opened(file, ("TIFF",))
    except (UnidentifiedImageError, ValueError):
        picture = None
    if not can_decode(page):
        if picture is None or not _is_sure(page):
            raise Refused(
                f"is a TIFF of a kind that is not read ({_kind(page)}); save it as PNG or JPEG"
            )
        return picture
    return picture if picture is not None and _is_plain(page) else None


def can_decode(page: Any) -> bool:
    """Whether tifffile can make an array of it, and we know what its values mean."""
    bits = page.bitspersample
    return (
        page.dtype is not None
        and page.compression in _UNPACKED
        and page.predictor in _PREDICTORS
        and page.photometric in (_WHITE_IS_ZERO, _BLACK_IS_ZERO, _RGB, _PALETTE, _CMYK)
        and isinstance(bits, int)
        and bits in (8, 16, 32, 64)
    )


def decoding_bytes(page: Any) -> int:
    """Bytes that `scan` takes: the array, a copy of it, and strips."""
    return (
        int(page.imagewidth)
        * int(page.imagelength)
        * (2 * int(page.samplesperpixel) * page.dtype.itemsize + 8)
    )


def scan(file: IO[bytes], page: Any) -> Scan:
    """Decode it, and choose how its values are to be read."""
    _check_whole(file, page)
    with damage_named():
        planes = page.asarray(squeeze=False, maxworkers=1)[:, 0]  # (planes, h, w, samples)
    values = np.moveaxis(planes, 0, 2)
    values = values.reshape(*values.shape[:2], -1)
    values = values.astype(values.dtype.newbyteorder("="), copy=False)
    profile = page.tags.get(_PROFILE)
    orientation = int(page.tags.valueof(274, 1) or 1)
    if page.photometric == _CMYK:
        return _as_cmyk(values, profile.value if profile else b"", orientation)
    values, full = _brightness(values, page)
    values, premultiplied = _with_alpha(values, page)
    mode = {1: "L", 2: "LA", 3: "RGB", 4: "RGBA"}[values.shape[2]]
    light, transform = Told(mode, profile.value if profile else b"").light()
    if transform is not None:
        eight = (values.astype(np.float32) * (255 / full) + 0.5).astype(np.uint8)
        return pillow.of_8_bits(Image.fromarray(eight, mode), transform, orientation)
    return strips_of(values, full, light=light, orientation=orientation,
                     premultiplied=premultiplied)  # fmt: skip


def exif(file: IO[bytes]) -> Image.Exif | None:
    """Its tags as Exif, which has the same form."""
    tags = Image.Exif()
    try:
        tags.load_from_fp(file, None)
        return tags
    except Exception:  # broken tags raise nearly anything
        return None


def _is_plain(page: Any) -> bool:
    """Whether Pillow reads it right: unsigned samples of 8 bits and less, or 16 in grey, side by
    side.
    """
    bits, samples = page.bitspersample, int(page.samplesperpixel)
    deep_grey = bits == 16 and samples == 1 and page.photometric == _BLACK_IS_ZERO
    side_by_side = page.planarconfig != _SEPARATE or samples == 1
    one_alpha = len(page.extrasamples) <= 1
    colours_of_16 = page.photometric != _PALETTE or page.colormap is None \
        or int(page.colormap.max()) > 255  # fmt: skip
    return (
        _is_sure(page)
        and side_by_side
        and one_alpha
        and colours_of_16
        and (bits == 8 or (isinstance(bits, int) and bits < 8) or deep_grey)
    )


def _is_sure(page: Any) -> bool:
    """Whether Pillow, where it opens it, sees what is meant: unsigned values in no odd order."""
    return page.sampleformat in (1, 4) and (
        page.planarconfig != _SEPARATE or page.bitspersample == 8
    )


def _kind(page: Any) -> str:
    return (
        f"{page.samplesperpixel} samples of {page.bitspersample} bits, compression "
        f"{int(page.compression)}, photometric {int(page.photometric or 0)}"
    )


def _check_whole(file: IO[bytes], page: Any) -> None:
    """tifffile takes a strip that lies beyond the end for an empty one."""
    end = file.seek(0, 2)
    spans = list(zip(page.dataoffsets, page.databytecounts, strict=True))
    if not spans or not all(at > 0 and size > 0 and at + size <= end for at, size in spans):
        raise ValueError("is damaged or cut short (strips are missing); copy or save it again")


def _brightness(values: NDArray[Any], page: Any) -> tuple[NDArray[Any], float]:
    """Values as brightness, and the one that stands for white."""
    if values.dtype.kind == "f":
        values = values.astype(np.float32, copy=False)
    if page.photometric == _PALETTE:
        table = np.asarray(page.colormap)
        table = table * np.uint16(257 if table.max() <= 255 else 1)
        return np.ascontiguousarray(table[:, values[..., 0]].transpose(1, 2, 0)), 65535.0
    full = full_scale(values)
    if page.photometric == _WHITE_IS_ZERO:
        values = values.dtype.type(full) - values
    return values, full


def _with_alpha(values: NDArray[Any], page: Any) -> tuple[NDArray[Any], bool]:
    """The colours, their alpha if there is one among the further samples, and whether they have
    been multiplied by it.
    """
    colours = 3 if page.photometric in (_RGB, _PALETTE) else 1
    if values.shape[2] < colours:
        raise Refused(f"is a TIFF of a kind that is not read ({_kind(page)}); save it as PNG")
    for i, meaning in enumerate(page.extrasamples):
        if meaning in (_ASSOCIATED, _UNASSOCIATED) and colours + i < values.shape[2]:
            kept = [*range(colours), colours + i]
            return values[..., kept], meaning == _ASSOCIATED
    return values[..., :colours], False


def _as_cmyk(values: NDArray[Any], profile: bytes, orientation: int) -> Scan:
    """Inks, by way of Pillow and with its 8 bits."""
    if values.dtype.kind != "u" or values.shape[2] < 4:
        raise Refused("holds inks in a form that is not read; save it as PNG")
    eight = (values[..., :4] >> (8 * (values.dtype.itemsize - 1))).astype(np.uint8)
    _, transform = Told("CMYK", profile).light()
    return pillow.of_8_bits(Image.fromarray(eight, "CMYK"), transform, orientation)


def _lzw(data: bytes, /, *, out: Any = None) -> bytes:
    """Unpack one strip by having Pillow read it as a grey TIFF of one row."""
    size = int(out)
    tags = {256: size, 257: 1, 258: 8, 259: 5, 262: 1, 273: 0, 277: 1, 278: 1, 279: len(data)}
    tags[273] = at = 8 + 2 + 12 * len(tags) + 4
    rows = b"".join(struct.pack("<HHII", tag, 4, 1, value) for tag, value in tags.items())
    head = b"II*\0" + struct.pack("<IH", 8, len(tags)) + rows + bytes(4)
    assert len(head) == at
    with pillow.without_limit():
        return Image.open(BytesIO(head + data), formats=("TIFF",)).tobytes()
