"""A sheet of paper and the wax on it (section 3.1 of the paper).

A sheet is a height field (the paper's tooth) with a column of wax on each cell, see `columns`.
Heights are in um. Per cell: paper 4, total 4, used 1, crayons 4, layer heights 16, blend 28 = 57
bytes.
"""

import numpy as np
from numpy.typing import NDArray

from .columns import BLEND, LAYERS, Columns

Floats = NDArray[np.float32]


class Sheet:
    """A sheet of paper and the wax on it. All arrays are flat views over rows x cols cells."""

    def __init__(self, tooth: Floats, cell_mm: float, k: Floats, s: Floats) -> None:
        """`tooth` (rows, cols) um; `k`, `s` (crayons, 3) absorption and scattering per um, linear
        RGB.
        """
        self.rows, self.cols = tooth.shape
        self.cell_mm = cell_mm
        self.optics = np.ascontiguousarray(np.concatenate([k, s], 1), np.float32)
        cells = tooth.size
        self.paper = np.ascontiguousarray(tooth, np.float32).ravel()
        self.total = np.zeros(cells, np.float32)
        self.used = np.zeros(cells, np.uint8)
        self.crayon = np.zeros((cells, LAYERS), np.uint8)
        self.layer = np.zeros((cells, LAYERS), np.float32)
        self.blend = np.zeros((cells, BLEND), np.float32)

    def columns(self) -> Columns:
        """What the kernels take."""
        crayon, layer, blend = (
            self.crayon.reshape(-1),
            self.layer.reshape(-1),
            self.blend.reshape(-1),
        )
        return Columns(
            self.paper, self.total, self.used, crayon, layer, blend, self.optics.reshape(-1)
        )

    def film_um(self) -> Floats:
        """Height of the wax (rows, cols) in um."""
        return self.total.reshape(self.rows, self.cols)
