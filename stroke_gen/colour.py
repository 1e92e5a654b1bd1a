"""Colour for decisions: linear RGB to OKLab with the chroma axes doubled.

Doubling a and b makes distances agree with judged colour differences (Ottosson's fits to COMBVD and
OSA-UCS, as quoted by CSS Color 4, section 20.5), so grey is not taken for teal.
"""

import numpy as np
from numpy.typing import NDArray

from .alike import times

CHROMA = 2.0  # weight of a and b
TO_LMS = np.array(
    [[0.4122214708, 0.5363325363, 0.0514459929],
     [0.2119034982, 0.6806995451, 0.1073969566],
     [0.0883024619, 0.2817188376, 0.6299787005]], np.float32)  # fmt: skip
TO_LAB = np.array(
    [[0.2104542553, 0.7936177850, -0.0040720468],
     [1.9779984951 * CHROMA, -2.4285922050 * CHROMA, 0.4505937099 * CHROMA],
     [0.0259040371 * CHROMA, 0.7827717662 * CHROMA, -0.8086757660 * CHROMA]],
    np.float32)  # fmt: skip
_FROM_LMS, _FROM_LAB = (
    np.linalg.inv(m.astype(np.float64)).astype(np.float32) for m in (TO_LMS, TO_LAB)
)


def oklab(linear: NDArray[np.float32]) -> NDArray[np.float32]:
    """OKLab (..., 3) of linear RGB (..., 3), a and b doubled; L is 0..1."""
    lms = np.cbrt(times(np.maximum(linear, 0).astype(np.float32), TO_LMS))
    return np.asarray(times(lms, TO_LAB), np.float32)


def from_oklab(lab: NDArray[np.float32]) -> NDArray[np.float32]:
    """Linear RGB in [0, 1] of OKLab with a and b doubled; out of gamut is clipped."""
    lms = times(lab, _FROM_LAB)
    return np.clip(times(lms**3, _FROM_LMS), 0, 1).astype(np.float32)


def cube_root(x):  # type: ignore[no-untyped-def]
    """Cube root for kernels, x in 0..1, to 1e-4: a first guess from the float's bits, two Newton
    steps.
    """
    if x < np.float32(1e-7):
        return np.float32(0)
    y = np.int32(np.float32(x).view(np.int32) // 3 + 709921077).view(np.float32)
    for _ in range(2):
        y = (y + y + x / (y * y)) * np.float32(0.33333334)
    return y
