"""Strokes as the kernels take them: points in cells, and what must be known of each before it is
drawn.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from stroke_gen.drawing import Stroke
from stroke_gen.jit import lean_kernel

from . import box


def in_cells(
    strokes: Sequence[Stroke], cell_mm: float
) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """All points as (x, y in cells, force), and where each stroke begins.

    If any stroke is drawn with the crayon tilted, points are (x, y, force, slope along x, along y):
    by how much the tip is lower from one cell to the next, as a tangent.
    """
    first = np.zeros(len(strokes) + 1, np.int64)
    np.cumsum([len(s.path_mm) for s in strokes], out=first[1:])
    tilts = any(s.tilt_deg is not None and s.tilt_deg[:, 0].any() for s in strokes)
    points = np.zeros((int(first[-1]), 5 if tilts else 3), np.float32)
    points[:, :2] = np.concatenate([s.path_mm for s in strokes])
    points[:, :2] /= cell_mm
    points[:, 2] = np.concatenate([s.force_n for s in strokes])
    for begin, stroke in zip(first.tolist() if tilts else (), strokes, strict=False):
        if stroke.tilt_deg is not None:
            tilt, azimuth = np.deg2rad(stroke.tilt_deg.T)
            towards = np.stack([np.cos(azimuth), np.sin(azimuth)], 1)
            points[begin : begin + len(azimuth), 3:] = np.tan(tilt)[:, None] * towards
    return points, first


def ways(
    points: NDArray[np.float32], first: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """Of each stroke: force times length (newton cells), length in cells, and its mean direction.

    Directions count alike to and fro, and are given as one of box.HEADINGS.
    """
    newton_cells, cells, double = np.zeros((3, len(first) - 1))
    _measure(points, first, newton_cells, cells, double)
    return (
        newton_cells,
        cells,
        np.round(double / (2 * np.pi) * box.HEADINGS).astype(np.int64) % box.HEADINGS,
    )


@lean_kernel
def _measure(points, first, newton_cells, cells, double):  # type: ignore[no-untyped-def]
    """Force times length, length, and twice the angle of the mean direction of each stroke."""
    for s in range(newton_cells.size):
        along, across = 0.0, 0.0
        for i in range(first[s], first[s + 1] - 1):
            dx = np.float64(points[i + 1, 0] - points[i, 0])
            dy = np.float64(points[i + 1, 1] - points[i, 1])
            step = np.sqrt(dx * dx + dy * dy)
            newton_cells[s] += step * points[i, 2]
            cells[s] += step
            if step > 0:
                along += (dx * dx - dy * dy) / step
                across += 2 * dx * dy / step
        double[s] = np.arctan2(across, along)
