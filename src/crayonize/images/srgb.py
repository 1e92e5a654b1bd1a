"""The sRGB curve (IEC 61966-2-1) for single numbers, and colours written #rrggbb.

No numpy here: palettes are listed without waiting for it. The curve for arrays is in icc.py.
"""

import re
from collections.abc import Sequence

RGB = tuple[float, float, float]

_HEX = re.compile(r"#?([0-9a-fA-F]{6})")


def to_light(encoded: float) -> float:
    """sRGB value to linear light, both 0..1."""
    return encoded / 12.92 if encoded <= 0.04045 else float(((encoded + 0.055) / 1.055) ** 2.4)


def to_srgb(light: float) -> float:
    """Linear light to sRGB value, both 0..1."""
    return light * 12.92 if light <= 0.0031308 else float(1.055 * light ** (1 / 2.4) - 0.055)


def is_hex(text: str) -> bool:
    """Whether a text is a colour as rrggbb, with # before it or without."""
    return _HEX.fullmatch(text) is not None


def codes(colour: str) -> tuple[int, int, int]:
    """Red, green and blue of #rrggbb, 0..255; ValueError if it is none.

    >>> codes("#ff8000")
    (255, 128, 0)
    """
    found = _HEX.fullmatch(colour)
    if not found:
        raise ValueError(f"{colour!r} is not #rrggbb")
    r, g, b = bytes.fromhex(found[1])
    return r, g, b


def light_of(colour: str) -> RGB:
    """Linear RGB of #rrggbb."""
    r, g, b = (to_light(code / 255) for code in codes(colour))
    return r, g, b


def hex_of(light: Sequence[float]) -> str:
    """#rrggbb of linear RGB."""
    return "#" + "".join(f"{round(255 * to_srgb(v)):02x}" for v in light)


def luminance(colour: str) -> float:
    """Relative luminance of #rrggbb, 0 black to 1 white."""
    r, g, b = light_of(colour)
    return 0.2126 * r + 0.7152 * g + 0.0722 * b
