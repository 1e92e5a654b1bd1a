"""What stands out from the borders of a picture: its subject, where no network knows one.

Minimum barrier distance, after Zhang et al., "Minimum Barrier Salient Object Detection at 80 FPS"
(ICCV 2015): ground is what a path from the border reaches without its colour going far up and down;
paths grow in raster scans, there and back.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from .jit import lean_kernel

Floats = NDArray[np.float32]
SIDE = 160  # cells along the long side on which paths are sought
SCANS = 4  # there and back, twice
LOW, HIGH = 0.10, 0.30  # barriers in OKLab that say ground, and subject


@lean_kernel
def _scan(value, high, low, distance, back):  # type: ignore[no-untyped-def]
    """A raster scan over a channel: each place takes the lower barrier of two neighbours passed."""
    h, w = value.shape
    step = -1 if back else 1
    for i in range(h):
        y = h - 1 - i if back else i
        for j in range(w):
            x = w - 1 - j if back else j
            for k in range(2):
                v, u = (y - step, x) if k == 0 else (y, x - step)
                if 0 <= v < h and 0 <= u < w:
                    top, bottom = max(high[v, u], value[y, x]), min(low[v, u], value[y, x])
                    if top - bottom < distance[y, x]:
                        distance[y, x], high[y, x], low[y, x] = top - bottom, top, bottom


def saliency(lab: Floats) -> Floats:
    """How far each place of a picture in OKLab (h, w, 3) stands out from its borders, 0..1 (h, w).

    The scale is absolute: where nothing stands out (a wall, a far landscape) it stays low.
    """
    h, w = lab.shape[:2]
    scale = min(1.0, SIDE / max(h, w))
    size = max(2, round(w * scale)), max(2, round(h * scale))
    small = cv2.GaussianBlur(cv2.resize(lab, size, interpolation=cv2.INTER_AREA), (0, 0), 1.0)
    total = np.zeros(small.shape[:2], np.float32)
    for channel in np.moveaxis(small, 2, 0):
        value = np.ascontiguousarray(channel)
        high, low = value.copy(), value.copy()
        distance = np.full(value.shape, np.inf, np.float32)
        distance[[0, -1]] = distance[:, [0, -1]] = 0
        for i in range(SCANS):
            _scan(value, high, low, distance, i % 2)
        total += distance
    rows, cols = (np.abs(np.linspace(-1, 1, n, dtype=np.float32)) for n in total.shape)
    middle = 1 - 0.35 * np.hypot(rows[:, None], cols)
    level = np.clip((total * middle - LOW) / (HIGH - LOW), 0, 1)
    return np.asarray(
        cv2.resize(level * level * (3 - 2 * level), (w, h), interpolation=cv2.INTER_LINEAR),
        np.float32,
    )
