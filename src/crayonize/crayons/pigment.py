"""What a crayon's colour means as wax: Kubelka-Munk absorption k and scattering s per micrometre.

They decide what colour a crayon has in light and in heavy strokes, alone and over others. A crayon
is given by the colour it shows on white paper under a film of reference thickness (`film_um`) and
by its hiding: the share of that colour it still shows on black (data/palettes). Those two colours
fix k and s (Curtis et al. 1997, "Computer-generated watercolor"). The crayons of the 2003
wax-crayon paper come as in its Table 2 instead: a colour, and the transmittance t and reflectance s
of a layer that is `layer_films` such films thick.
"""

import math
from collections.abc import Sequence

from ..images.srgb import RGB, hex_of, light_of, to_light
from .palette import Crayon

# of the light that meets wax its surface reflects (Fresnel; n of paraffin 1.44)
FRONT = ((1.44 - 1) / (1.44 + 1)) ** 2
_CLEAN = 0.5  # how much better than its hiding a crayon hides in a channel of reflectance 1/2

# A crayon is never perfectly black or white in any channel; the inversion needs colours strictly
# between.
_DARKEST, _LIGHTEST = 0.005, 0.985


def default_hiding(colour: str) -> float:
    """The hiding of a colour nobody has measured: pale and grey wax hides, vivid wax is clear.

    0.36 + 0.34 L/100 - 0.0045 C, kept within 0.12 to 0.70, with CIELab lightness L and chroma C
    (D65) of `colour` (#rrggbb): white 0.70, mid grey 0.54, pastels about 0.5, vivid red and blue
    under 0.2.
    """
    lightness, chroma = _lightness_chroma(light_of(colour))
    return min(0.70, max(0.12, 0.36 + 0.34 * lightness / 100 - 0.0045 * chroma))


def colour_crayon(name: str, colour: str, hiding: float, film_um: float) -> Crayon:
    """A crayon from its colour over white, Rw, and black, Rb: R = Rb, T^2 = (Rw - Rb)(1 - Rb).

    What its front surface reflects is taken off the colour. Rb is `hiding` Rw, and more in channels
    half bright: there thick wax of even hiding would be much darker than its hex, and heavy red
    brown, which it is not.
    """
    layers = []
    for value in light_of(colour):
        white = min(_LIGHTEST, max(_DARKEST, (value - FRONT) / (1 - FRONT)))
        black = white * (
            hiding + (1 - hiding) * _CLEAN * (1 - (1 - white) ** 6) * (1 - white**2 / 2)
        )
        layers.append((black, math.sqrt((white - black) * (1 - black))))
    k, s = _per_um(layers, film_um)
    return Crayon(name, colour, k, s)


def layer_crayon(
    name: str, colour: Sequence[float], t: float, s: float, film_um: float, layer_um: float
) -> Crayon:
    """A crayon as in the 2003 paper: sRGB colour (0..1), transmittance t and reflectance s of a
    layer of layer_um.
    """
    tints = [max(_DARKEST, to_light(value)) for value in colour]
    k, sc = _per_um([(s * tint, t * tint) for tint in tints], layer_um)
    over_white = [
        FRONT + (1 - FRONT) * _over_white(k[c] * film_um, sc[c] * film_um) for c in range(3)
    ]
    return Crayon(name, hex_of(over_white), k, sc)


def _per_um(layers: Sequence[tuple[float, float]], thickness_um: float) -> tuple[RGB, RGB]:
    """(k, s) per micrometre of three channels, each given as (reflectance, transmittance) of one
    layer.
    """
    pairs = [_absorption_scattering(r, t) for r, t in layers]
    k, s = ([value / thickness_um for value in column] for column in zip(*pairs, strict=True))
    return (k[0], k[1], k[2]), (s[0], s[1], s[2])


def _absorption_scattering(r: float, t: float) -> tuple[float, float]:
    """(K h, S h) of the layer that reflects r and transmits t, r + t < 1: Kubelka (1948) solved for
    them.
    """
    a_less_1 = (1 - r - t) * (1 - r + t) / (2 * r)
    b = math.sqrt(a_less_1 * (a_less_1 + 2))
    scattering = math.asinh(b * r / t) / b
    return a_less_1 * scattering, scattering


def _over_white(absorption: float, scattering: float) -> float:
    """Reflectance of a layer (K h, S h) on a perfect white, Kubelka (1948); w = b coth(b S h)."""
    a = 1 + absorption / scattering
    b = math.sqrt(a * a - 1)
    w = b / math.tanh(b * scattering)
    return (1 - a + w) / (a - 1 + w)


def _lightness_chroma(light: RGB) -> tuple[float, float]:
    """CIELab lightness and chroma of linear sRGB light (D65 white)."""
    r, g, b = light
    x = (0.4124564 * r + 0.3575761 * g + 0.1804375 * b) / 0.95047
    y = 0.2126729 * r + 0.7151522 * g + 0.0721750 * b
    z = (0.0193339 * r + 0.1191920 * g + 0.9503041 * b) / 1.08883
    fx, fy, fz = (
        v ** (1 / 3) if v > 216 / 24389 else (24389 / 27 * v + 16) / 116 for v in (x, y, z)
    )
    return 116 * fy - 16, math.hypot(500 * (fx - fy), 200 * (fy - fz))
