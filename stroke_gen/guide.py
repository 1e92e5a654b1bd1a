"""The photo as a guide: values made smooth where the photo is smooth and crisp where it is crisp.

A guided filter (He, Sun and Tang 2010, with a coarse grid as in He and Sun 2015): in each window
the values become a linear function of the photo's colours.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from .analysis import blur

Floats = NDArray[np.float32]
COARSE = 3  # work cells to a cell of the coarse grid
EPS = 4e-4  # OKLab units squared: the photo's differences below it are smoothed over


class Guide:
    """The photo's colours as the guide of smooth plates; its windows are worked out once.

    coarse: OKLab (rows, cols, 3) on the coarse grid.
    """

    def __init__(self, lab: Floats, radius: float) -> None:
        """lab: OKLab (h, w, 3) on the work grid; radius of the windows in work cells."""
        h, w = lab.shape[:2]
        size = (-(-w // COARSE), -(-h // COARSE))
        self.lab = lab
        self.coarse = np.asarray(cv2.resize(lab, size, interpolation=cv2.INTER_AREA), np.float32)
        self._sigma = radius / COARSE
        self._mean = blur(self.coarse, self._sigma)
        products = np.einsum("...i,...j->...ij", self.coarse, self.coarse).reshape(
            *self.coarse.shape[:2], 9
        )
        spread = blur(products, self._sigma).reshape(*self.coarse.shape, 3)
        spread -= np.einsum("...i,...j->...ij", self._mean, self._mean)
        self._inverse = np.linalg.inv(spread + EPS * np.eye(3, dtype=np.float32)).astype(np.float32)

    def spread(self, values: Floats) -> Floats:
        """Values (rows, cols) of the coarse grid on the work grid, as smooth as the photo is."""
        mean = blur(values, self._sigma)
        cross = blur(self.coarse * values[..., None], self._sigma) - self._mean * mean[..., None]
        slope = np.einsum("...ij,...j->...i", self._inverse, cross)
        level = mean - (slope * self._mean).sum(-1)
        lines = blur(np.dstack([slope, level]).astype(np.float32), self._sigma)
        fine = np.asarray(
            cv2.resize(lines, self.lab.shape[1::-1], interpolation=cv2.INTER_LINEAR), np.float32
        )
        return np.asarray((fine[..., :3] * self.lab).sum(-1) + fine[..., 3], np.float32)
