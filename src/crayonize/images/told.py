"""What a picture says its numbers mean: by a profile, by code points, by PNG's chunks, by Exif.

The first in this order that can be right counts; a profile of another kind of picture or one that
makes no sense is passed over, and what tells nothing is sRGB.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from io import BytesIO
from typing import IO, Any

import numpy as np
from PIL import Image, ImageCms

from . import boxes, png, primaries
from .icc import SRGB, Light, light_from_profile, srgb_curve

Transform = ImageCms.ImageCmsTransform

_EXIF_FOLDER, _INTEROP_FOLDER = 0x8769, 0xA005
_COLOUR_SPACE, _GAMMA, _INTEROP_INDEX = 40961, 42240, 1
_ADOBE_SPACE = 2  # never in the standard, but cameras write it
_WHITE_POINT, _CHROMATICITIES = 318, 319
_SRGB_GAMMA, _NEARLY = 0.45455, 0.0005  # what writers of sRGB put into gAMA
_WHITE_OFF = 0.15  # a profile's white may be off sRGB's white by this much light in a channel
_DARK, _BRIGHT = 32, 200  # stored values between which a table must lead from dark to light
_CONTRAST = 0.2  # by at least so much, as an sRGB value


@dataclass(frozen=True)
class Told:
    """What a file tells of its colours.

    mode: "L", "LA", "RGB", "RGBA" or "CMYK".   profile: ICC.   codes: primaries and transfer of
    H.273.   notes: Pillow's `info` of a PNG, empty for others.   first: code points go before the
    profile (PNG).
    """

    mode: str
    profile: bytes = b""
    codes: tuple[int, int] | None = None
    notes: Mapping[Any, Any] = field(default_factory=dict)
    exif: Image.Exif | None = None
    codes_first: bool = False

    def light(self) -> tuple[Light, Transform | None]:
        """Curves and primaries, or a transform to sRGB by tables where there is a profile of such.

        ValueError for colours that cannot be read.
        """
        by_codes = primaries.of_codes(*self.codes) if self.codes else None
        if self.codes_first and by_codes:
            return by_codes, None
        light = light_from_profile(self.profile)
        if light is not None and _fits(light, self.mode):
            return light, None
        if light is None and (transform := _by_tables(self.profile, self.mode)):
            return SRGB, transform
        return by_codes or _of_png(self.notes) or _of_exif(self.exif) or SRGB, None


def told_by(picture: Image.Image, file: IO[bytes] | None, mode: str) -> Told:
    """What a decoded Pillow image and the file it came from tell."""
    is_png = picture.format == "PNG"
    codes = None
    if file is not None and is_png and (found := png.content(file, b"cICP", 4)):
        codes = found[0], found[1]
    elif file is not None and picture.format in ("AVIF", "HEIF"):
        codes = boxes.codes(file)
    return Told(mode, picture.info.get("icc_profile") or b"", codes,
                picture.info if is_png else {}, exif_of(picture), is_png)  # fmt: skip


def exif_of(picture: Image.Image) -> Image.Exif | None:
    """The Exif of a decoded picture; None if it is broken, which raises nearly anything."""
    try:
        return picture.getexif()
    except Exception:
        return None


def exif_tag(picture: Image.Image, number: int) -> Any:
    """A tag of the first Exif folder, None if it is not there or cannot be read."""
    exif = exif_of(picture)
    return None if exif is None else exif.get(number)


def _fits(light: Light, mode: str) -> bool:
    """Whether a profile is one for such pictures, and can be meant: white is white, and curves
    rise.
    """
    if mode == "CMYK" or (light.is_grey and mode not in ("L", "LA")):
        return False
    steps = np.linspace(0, 1, 64)
    for curve in light.curves:
        ramp = curve(steps)
        if (np.diff(ramp) < -1e-3).any() or ramp[0] > 0.1 or not 0.9 < ramp[-1] < 1.1:
            return False
    return light.matrix is None or bool((np.abs(light.matrix.sum(1) - 1) < _WHITE_OFF).all())


def _by_tables(profile: bytes, mode: str) -> Transform | None:
    """A transform by LittleCMS, if there are tables and they lead from dark to light."""
    if b"A2B0" not in profile or mode in ("L", "LA"):
        return None
    try:
        transform = ImageCms.buildTransform(
            ImageCms.getOpenProfile(BytesIO(profile)),
            ImageCms.createProfile("sRGB"),
            mode,
            "RGBA" if mode == "RGBA" else "RGB",
            ImageCms.Intent.RELATIVE_COLORIMETRIC,
            ImageCms.Flags.BLACKPOINTCOMPENSATION,
        )
        # not black and white: LittleCMS sets white right by itself
        ends = Image.new(mode, (2, 1), (_DARK,) * len(mode))
        ends.putpixel((1, 0), (_BRIGHT,) * len(mode))
        shown = np.asarray(ImageCms.applyTransform(ends, transform))[0, :, :3] / 255
    except (OSError, ValueError, TypeError, ImageCms.PyCMSError):
        return None
    rise = float((shown[1] - shown[0]).mean()) * (-1 if mode == "CMYK" else 1)
    return transform if rise > _CONTRAST else None


def _of_png(notes: Mapping[Any, Any]) -> Light | None:
    """sRGB, gAMA and cHRM, in this order."""
    gamma, spots = notes.get("gamma"), notes.get("chromaticity")
    if "srgb" in notes or not (gamma or spots):
        return None
    curve = primaries.power(1 / gamma) if gamma else srgb_curve
    light = Light((curve,))
    if spots:
        white, *colours = zip(spots[::2], spots[1::2], strict=True)
        try:
            light = primaries.of_chromaticities(white, colours, curve)
        except ValueError:
            return None
    same = light.matrix is None or np.abs(light.matrix - np.eye(3)).max() < 0.01
    return SRGB if same and gamma and abs(gamma - _SRGB_GAMMA) < _NEARLY else light


def _of_exif(exif: Image.Exif | None) -> Light | None:
    """Adobe RGB (DCF's R03), or primaries and a gamma."""
    if exif is None:
        return None
    try:
        inside, interop = exif.get_ifd(_EXIF_FOLDER), exif.get_ifd(_INTEROP_FOLDER)
        space, index = inside.get(_COLOUR_SPACE), str(interop.get(_INTEROP_INDEX, "")).strip("\0 ")
        if space == 1 or index == "R98":
            return None
        if space == _ADOBE_SPACE or index == "R03":
            return primaries.adobe()
        white, spots = exif.get(_WHITE_POINT), exif.get(_CHROMATICITIES)
        if not (white and spots and len(spots) == 6):
            return None
        gamma = inside.get(_GAMMA)
        x = [float(v) for v in (*white, *spots)]
        curve = [primaries.power(float(gamma))] if gamma and float(gamma) > 0 else []
        spans = list(zip(x[::2], x[1::2], strict=True))
        return primaries.of_chromaticities(spans[0], spans[1:], *curve)
    except Exception:  # broken EXIF raises nearly anything
        return None
