"""What is left out: a margin along the sheet's border and, in a sketch, the ground; both as ragged
as hatching ends.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from .analysis import wide_blur

Floats = NDArray[np.float32]
NEAR = 0.12  # long sides over which what lies near the subject is drawn with it
DRAWN = 0.6  # care from which nothing is left out
FRAYED = 0.3  # how far the fading goes to and fro, in powers of e of the nearness
RAGGED = 0.45  # tips to and fro


def inside(shape: tuple[int, ...], margin: float, tip: float, rng: np.random.Generator) -> Floats:
    """1 where the hand draws and 0 in the margin (h, w); margin and tip in cells."""
    h, w = shape[:2]
    if margin <= 0:
        return np.ones((h, w), np.float32)
    top, bottom = (_ragged(w, margin, tip, rng) for _ in range(2))
    left, right = (_ragged(h, margin, tip, rng) for _ in range(2))
    y, x = np.ogrid[:h, :w]
    within = (
        (y >= top[None])
        & (h - 1 - y >= bottom[None])
        & (x >= left[:, None])
        & (w - 1 - x >= right[:, None])
    )
    return within.astype(np.float32)


def faded(
    care: Floats, fade: float, tip: float, wrist_deg: float, rng: np.random.Generator
) -> Floats:
    """1 where the hand draws and 0 where the ground is left out (h, w), in streaks along the
    wrist's direction.

    care: 0..1 (h, w); fade: the share of the sheet that is left out, the farthest from where care
        is due.
    """
    if fade <= 0:
        return np.ones_like(care)
    near = (
        care + wide_blur(care, NEAR * max(care.shape)) + wide_blur(care, 3 * NEAR * max(care.shape))
    )
    near = np.log(near + 1e-3) + FRAYED * _streaks(care.shape, tip, wrist_deg, rng)
    return ((near > np.quantile(near[::2, ::2], fade)) | (care > DRAWN)).astype(np.float32)


def _streaks(
    shape: tuple[int, ...], cells: float, wrist_deg: float, rng: np.random.Generator
) -> Floats:
    """Noise of unit variance in streaks along a direction, about three lines wide and fifteen
    long.
    """
    angle = np.deg2rad(wrist_deg)
    y, x = np.ogrid[: shape[0], : shape[1]]
    along = (x * np.cos(angle) + y * np.sin(angle)) / (15 * cells)
    across = (y * np.cos(angle) - x * np.sin(angle)) / (3 * cells)
    along, across = along - along.min(), across - across.min()
    noise = rng.standard_normal((int(across.max()) + 3, int(along.max()) + 3)).astype(np.float32)
    return np.asarray(
        cv2.remap(noise, along.astype(np.float32), across.astype(np.float32), cv2.INTER_LINEAR)
    )


def _ragged(length: int, margin: float, tip: float, rng: np.random.Generator) -> Floats:
    """Width of the margin along one side."""
    noise = np.abs(rng.standard_normal((1, max(2, int(length / (2.5 * tip)) + 2)))).astype(
        np.float32
    )
    swing = cv2.resize(noise, (length, 1), interpolation=cv2.INTER_LINEAR)[0]
    return np.asarray(margin + RAGGED * tip * (swing - 0.8), np.float32)
