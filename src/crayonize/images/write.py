"""The way out for pictures: whole or not at all, settings inside, the same bytes for the same
picture.
"""

from __future__ import annotations

import json
import os
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageCms, PngImagePlugin

from stroke_gen.files import check_target, whole_file

from .metadata import flat
from .read import open_picture, shown
from .told import exif_tag

SOFTWARE = "crayonize"  # the name under which settings are found again
Settings = dict[str, str | int | float]

_FORMATS = {
    ".png": "PNG",
    ".jpg": "JPEG",
    ".jpeg": "JPEG",
    ".webp": "WEBP",
    ".tif": "TIFF",
    ".tiff": "TIFF",
}
_LONGEST_SIDE = {"JPEG": 65535, "WEBP": 16383}
_EXIF_DESCRIPTION, _EXIF_SOFTWARE = 270, 305
_EXIF_X_RESOLUTION, _EXIF_Y_RESOLUTION, _EXIF_RESOLUTION_UNIT, _EXIF_INCH = 282, 283, 296, 2


def write_image(
    path: str | os.PathLike[str] | BinaryIO,
    srgb8: NDArray[np.uint8],
    *,
    settings: Settings | None = None,
    dpi: float | None = None,
    quality: int = 95,
    kept: Image.Exif | None = None,
) -> None:
    """Write a picture so that its name never stands for half a file: the old one, the new one, or
    none.

    path: PNG, JPEG, WebP or TIFF by its suffix; a link is replaced, never written through. What is
        open for writing gets a PNG.
    srgb8: uint8 (h, w, 3), sRGB-encoded. settings: stored inside, see read_settings. dpi: pixels
        per inch on
    paper. quality: 1..100, of JPEG and WebP. kept: tags of the photo, see metadata.py.
    The sRGB profile goes in, no time does.
    ValueError for what the caller can mend; OSError with the path if the disk is full or refuses.
    """
    if not isinstance(path, str | os.PathLike):
        path.write(_encode(srgb8, "PNG", "picture", settings or {}, dpi, quality, kept).getbuffer())
        return
    format_ = file_format(path)
    check_target(path)
    data = _encode(srgb8, format_, shown(path), settings or {}, dpi, quality, kept)
    with whole_file(path) as part:
        part.write_bytes(data.getbuffer())


def file_format(path: str | os.PathLike[str]) -> str:
    """The format that the suffix of an output stands for ("PNG", "JPEG", "WEBP", "TIFF"), or
    ValueError.
    """
    suffix = Path(os.fsdecode(path)).suffix.lower()
    if suffix not in _FORMATS:
        raise ValueError(
            f"{shown(path)}: cannot write {suffix or 'without suffix'}; use {', '.join(_FORMATS)}"
        )
    return _FORMATS[suffix]


def same_file(a: str | os.PathLike[str], b: str | os.PathLike[str]) -> bool:
    """Whether two paths lead to one file, by any link, hard link or spelling the file system takes
    as one.
    """
    try:
        return os.path.samefile(a, b)
    except OSError:  # one or both do not exist yet
        return os.path.realpath(os.fsdecode(a)) == os.path.realpath(os.fsdecode(b))


def read_settings(path: str | os.PathLike[str]) -> Settings:
    """The settings write_image stored in a picture, empty if there are none; ValueError if no
    picture.
    """
    with open_picture(path) as (picture, _):
        text = (
            picture.info.get(SOFTWARE)
            if picture.format == "PNG"
            else exif_tag(picture, _EXIF_DESCRIPTION)
        )
    try:
        found = json.loads(text or "")
        found = found if picture.format == "PNG" else found[SOFTWARE]
    except (ValueError, TypeError, KeyError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}


def holds_other_picture(path: str | os.PathLike[str]) -> bool:
    """Whether there is a picture here that write_image did not write."""
    try:
        with open_picture(path) as (picture, _):
            by = (
                picture.info.get("Software")
                if picture.format == "PNG"
                else exif_tag(picture, _EXIF_SOFTWARE)
            )
            return by != SOFTWARE
    except (OSError, ValueError):
        return False


def _encode(
    srgb8: NDArray[np.uint8],
    format_: str,
    name: str,
    settings: Settings,
    dpi: float | None,
    quality: int,
    kept: Image.Exif | None,
) -> BytesIO:
    """The whole file in memory, where no full disk can hurt it."""
    if srgb8.dtype != np.uint8 or srgb8.ndim != 3 or srgb8.shape[2] != 3 or srgb8.size == 0:
        raise ValueError(
            f"{name}: srgb8 is {srgb8.dtype} {srgb8.shape}; it must be uint8 (h, w, 3), not empty"
        )
    longest = _LONGEST_SIDE.get(format_, max(srgb8.shape))
    if max(srgb8.shape) > longest:
        raise ValueError(
            f"{name}: {format_} holds at most {longest} pixels a side, not {max(srgb8.shape)}; use "
            "PNG"
        )
    if dpi is not None and not 1 <= dpi <= 65535:
        raise ValueError(f"{name}: dpi is {dpi}; it must lie between 1 and 65535")
    if not 1 <= quality <= 100:
        raise ValueError(f"{name}: quality is {quality}; it must lie between 1 and 100")
    try:
        text = json.dumps(settings, sort_keys=True, allow_nan=False) if settings else None
    except (ValueError, TypeError) as error:
        raise ValueError(
            f"{name}: settings: {error}; they must be text or finite numbers"
        ) from error
    data, options = BytesIO(), _options(format_, text, dpi, quality, kept)
    try:
        Image.fromarray(srgb8).save(data, format_, **options)
    except ValueError as error:
        raise ValueError(f"{name}: cannot be written as {format_}: {error}") from error
    return data


def _options(
    format_: str, text: str | None, dpi: float | None, quality: int, kept: Image.Exif | None
) -> dict[str, Any]:
    """What Pillow's writer of each format is to be told. text: the settings as JSON (ASCII)."""
    options: dict[str, Any] = {"icc_profile": _srgb_profile()}
    if format_ == "PNG":
        options["compress_level"] = 1  # grain hardly packs: more takes far longer and saves little
        options["pnginfo"] = notes = PngImagePlugin.PngInfo()
        notes.add_text("Software", SOFTWARE)
        if text is not None:
            notes.add_itxt(SOFTWARE, text)
        if kept is not None:
            options["exif"] = kept
    else:
        options["exif"] = _exif(
            text, dpi, flat(kept) if kept is not None and format_ == "TIFF" else kept
        )
    if dpi is not None and format_ in ("PNG", "JPEG"):
        options["dpi"] = (dpi, dpi)
    if format_ == "TIFF":
        options["compression"] = "tiff_deflate"
    elif format_ in ("JPEG", "WEBP"):
        options["quality"] = quality
    if format_ == "JPEG":
        options["subsampling"] = "4:4:4"
    return options


def _exif(text: str | None, dpi: float | None, kept: Image.Exif | None) -> Image.Exif:
    """The settings as the picture's description, the one text tag that JPEG, WebP and TIFF all
    keep.
    """
    exif = Image.Exif() if kept is None else kept
    exif[_EXIF_SOFTWARE] = SOFTWARE
    if text is not None:
        exif[_EXIF_DESCRIPTION] = f'{{"{SOFTWARE}": {text}}}'
    if dpi is not None:
        exif[_EXIF_X_RESOLUTION] = exif[_EXIF_Y_RESOLUTION] = float(dpi)
        exif[_EXIF_RESOLUTION_UNIT] = _EXIF_INCH
    return exif


def _srgb_profile() -> bytes:
    """The sRGB profile of LittleCMS with a fixed date in place of the present one."""
    profile = bytearray(ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes())
    profile[24:36] = b"".join(n.to_bytes(2, "big") for n in (2000, 1, 1, 0, 0, 0))
    return bytes(profile)
