"""The margin: paper left along the sheet's border, as ragged as hatching ends."""

import cv2
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]
RAGGED = 0.45  # tips to and fro


def inside(shape: tuple[int, ...], margin: float, tip: float, rng: np.random.Generator) -> Floats:
    """1 where the hand draws and 0 in the margin (h, w); margin and tip in cells."""
    h, w = shape[:2]
    if margin <= 0:
        return np.ones((h, w), np.float32)
    top, bottom = (_ragged(w, margin, tip, rng) for _ in range(2))
    left, right = (_ragged(h, margin, tip, rng) for _ in range(2))
    y, x = np.ogrid[:h, :w]
    within = (y >= top[None]) & (h - 1 - y >= bottom[None]) & (x >= left[:, None]) & (w - 1 - x >= right[:, None])
    return within.astype(np.float32)


def _ragged(length: int, margin: float, tip: float, rng: np.random.Generator) -> Floats:
    """Width of the margin along one side."""
    noise = np.abs(rng.standard_normal((1, max(2, int(length / (2.5 * tip)) + 2)))).astype(np.float32)
    swing = cv2.resize(noise, (length, 1), interpolation=cv2.INTER_LINEAR)[0]
    return np.asarray(margin + RAGGED * tip * (swing - 0.8), np.float32)
