"""Colour spaces told by numbers: chromaticities and curves, and the code points of ITU-T H.273.

PNG (gAMA, cHRM, cICP), AVIF and HEIC (nclx) and Exif name their colours so. What is brighter than
white (PQ and HLG, BT.2100) is drawn together to fit below it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .icc import Curve, Light, simplified, srgb_curve

Chromaticity = tuple[float, float]

_D65, _DCI, _C, _E = (0.3127, 0.3290), (0.314, 0.351), (0.310, 0.316), (1 / 3, 1 / 3)
_SRGB_PRIMARIES = ((0.64, 0.33), (0.30, 0.60), (0.15, 0.06))
# H.273, table 2: code -> white, red, green, blue
_PRIMARIES: dict[int, tuple[Chromaticity, ...]] = {
    1: (_D65, *_SRGB_PRIMARIES),
    4: (_C, (0.67, 0.33), (0.21, 0.71), (0.14, 0.08)),
    5: (_D65, (0.64, 0.33), (0.29, 0.60), (0.15, 0.06)),
    6: (_D65, (0.630, 0.340), (0.310, 0.595), (0.155, 0.070)),
    7: (_D65, (0.630, 0.340), (0.310, 0.595), (0.155, 0.070)),
    8: (_C, (0.681, 0.319), (0.243, 0.692), (0.145, 0.049)),
    9: (_D65, (0.708, 0.292), (0.170, 0.797), (0.131, 0.046)),
    10: (_E, (1.0, 0.0), (0.0, 1.0), (0.0, 0.0)),
    11: (_DCI, (0.680, 0.320), (0.265, 0.690), (0.150, 0.060)),
    12: (_D65, (0.680, 0.320), (0.265, 0.690), (0.150, 0.060)),
    22: (_D65, (0.630, 0.340), (0.295, 0.605), (0.155, 0.077)),
}
_ADOBE_GAMMA = 2 + 51 / 256
_BRADFORD = np.array(
    [[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]]
)
_SHOULDER = 0.6  # light, of diffuse white, above which what is brighter than white is drawn in
_WHITE_NITS = 203.0  # diffuse white of BT.2408
_HLG_WHITE = 0.2650  # scene light of HLG's signal .75, its diffuse white
_HLG_SYSTEM_GAMMA = 1.2  # at 1000 nits


def power(gamma: float) -> Curve:
    """Light is the stored value to this power."""
    return lambda x: np.maximum(x, 0) ** gamma


def of_chromaticities(
    white: Chromaticity, primaries: Sequence[Chromaticity], curve: Curve = srgb_curve
) -> Light:
    """How numbers in a space of these primaries become sRGB; its white becomes sRGB's (Bradford).

    ValueError for primaries that span no colours.
    """
    try:
        to_xyz = _to_xyz(white, primaries)
        cones, aim = (_BRADFORD @ _xyz(w) for w in (white, _D65))
        adapted = np.linalg.inv(_BRADFORD) @ np.diag(aim / cones) @ _BRADFORD @ to_xyz
        matrix = np.linalg.solve(_to_xyz(_D65, _SRGB_PRIMARIES), adapted)
    except (np.linalg.LinAlgError, ZeroDivisionError) as error:
        raise ValueError("its primaries span no colours") from error
    if not np.isfinite(matrix).all() or np.abs(matrix).max() > 10:
        raise ValueError("its primaries span no colours")
    return simplified(Light((curve,), matrix.astype(np.float32)))


def of_codes(primaries: int, transfer: int) -> Light:
    """The colours of code points for primaries and transfer; ValueError for a curve nobody uses."""
    if transfer not in _CURVES:
        raise ValueError(
            f"its colours follow a curve that is not read (transfer {transfer}); save it as sRGB"
        )
    known = _PRIMARIES.get(primaries, _PRIMARIES[1])
    return of_chromaticities(known[0], known[1:], _CURVES[transfer])


def adobe() -> Light:
    """Adobe RGB (1998)."""
    return of_chromaticities(_D65, ((0.64, 0.33), (0.21, 0.71), (0.15, 0.06)), power(_ADOBE_GAMMA))


def _xyz(colour: Chromaticity) -> NDArray[Any]:
    x, y = colour
    return np.array([x, y, 1 - x - y]) / y


def _to_xyz(white: Chromaticity, primaries: Sequence[Chromaticity]) -> NDArray[Any]:
    """Columns: XYZ of the primaries, as strong as their white asks for."""
    columns = np.array([[x, y, 1 - x - y] for x, y in primaries]).T
    return columns * np.linalg.solve(columns, _xyz(white))


def _drawn_in(light: NDArray[Any]) -> NDArray[Any]:
    """Light in units of diffuse white: as it is up to the shoulder, from there ever closer to 1."""
    room = 1 - _SHOULDER
    over = np.maximum(light - _SHOULDER, 0)
    return np.minimum(light, _SHOULDER) + room * over / (over + room)


def _pq(stored: NDArray[Any]) -> NDArray[Any]:
    """SMPTE ST 2084."""
    m1, m2, c1, c2, c3 = 0.1593017578125, 78.84375, 0.8359375, 18.8515625, 18.6875
    root = np.clip(stored, 0, 1) ** (1 / m2)
    nits = 10_000 * (np.maximum(root - c1, 0) / (c2 - c3 * root)) ** (1 / m1)
    return _drawn_in(nits / _WHITE_NITS)


def _hlg(stored: NDArray[Any]) -> NDArray[Any]:
    """Hybrid log-gamma, as shown on a screen of 1000 nits."""
    a, b, c = 0.17883277, 0.28466892, 0.55991073
    x = np.clip(stored, 0, 1)
    scene = np.where(x <= 0.5, x * x / 3, (np.exp((x - c) / a) + b) / 12)
    return _drawn_in((scene / _HLG_WHITE) ** _HLG_SYSTEM_GAMMA)


# H.273, table 3. The curves of video (1, 6, 7, 11, 12, 14, 15) are shown on screens as sRGB is.
_CURVES: dict[int, Curve] = dict.fromkeys((1, 2, 6, 7, 11, 12, 13, 14, 15), srgb_curve) | {
    4: power(2.2),
    5: power(2.8),
    8: power(1.0),
    16: _pq,
    17: lambda x: np.maximum(x, 0) ** 2.6 * (52.37 / 48),
    18: _hlg,
}
