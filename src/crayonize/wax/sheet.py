"""Wax on a sheet, and the constants it obeys (section 3 of the paper).

A sheet is a height field (the paper's tooth) with a column of wax on each cell: up to four layers of
pure crayons, top last, over one blend into which the lowest layer sinks when a fifth is laid.
Heights are in um; optical properties travel with the wax as an index (pure layers) or as sums of
k*h and s*h (the blend), both linear in height, so moving wax conserves every pigment.

Per cell: paper 4, total 4, count 1, indices 4, layer heights 16, blend 28 = 57 bytes.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .contact import BLEND, LAYERS

THIN_UM = 0.4  # a film thinner than this counts as one with the layer beneath it

Floats = NDArray[np.float32]


@dataclass(frozen=True)
class Physics:
    """Constants of the wax (Table 1), with the paper's grey level read as 1 um; see data/physics.toml."""

    mu_paper: float  # friction of bare paper
    mu_wax: float  # friction of wax
    film_um: float  # film at which half of the way from paper to wax friction is gone
    rate_per_mm: float  # wax rubbed off per mm of path and um of overlap, at friction 1
    push: float  # down force over drag force, Fig. 6; 0: take the stroke's own force in newton
    relief: float  # how steep a height difference of the paper looks to the crayon
    nu: float  # share of the displaced wax that leaves its cell ...
    nu_mm: float  # ... per this length of path
    reach_mm: float  # how far it goes at a time: to the eight neighbours on cells of this size
    alpha: float  # flow smear factor, per um
    beta: float  # directional smear factor
    lam: float  # N per um of overlap and mm^2 of contact: .0005 a cell of 0.1 mm
    epsilon_um: float  # accuracy of the force, as a sum of overlaps over cells
    firm: float  # share of the wax's height that holds the crayon up; the rest yields to it (Fig. 4 has all hold: 1)
    heap: float  # share of a cell's wax that counts as out of reach: Fig. 6 rubs on the paper alone (1)
    wear: float  # share of a cell's loss that deepens the cell itself; the rest the whole tip shares

    def reach(self, cell_mm: float) -> int:
        """How many cells smeared wax goes at most: `reach_mm`, and one more where that is several cells."""
        cells = self._reach(cell_mm)
        return cells + (cells > 1)

    def _reach(self, cell_mm: float) -> int:
        return max(1, round(self.reach_mm / cell_mm))

    def constants(self, cell_mm: float) -> Floats:
        """The kernel's arguments for cells of `cell_mm`."""
        relief = self.relief / (1000 * cell_mm)
        longer = self._reach(cell_mm) * cell_mm / self.reach_mm  # it goes by whole cells
        nu = 1 - (1 - self.nu) ** (cell_mm / self.nu_mm / longer**2)  # as in diffusion
        values = (self.mu_paper, self.mu_wax, self.film_um, self.rate_per_mm * cell_mm, self.push, relief,
                  nu, self.alpha, self.beta, self.epsilon_um, self.wear, THIN_UM,
                  self.heap, self.firm)  # fmt: skip
        return np.array(values, np.float32)


class Sheet:
    """A sheet of paper and the wax on it. All arrays are flat views over rows x cols cells."""

    def __init__(self, tooth: Floats, cell_mm: float, k: Floats, s: Floats) -> None:
        """`tooth` (rows, cols) um; `k`, `s` (crayons, 3) absorption and scattering per um, linear RGB."""
        self.rows, self.cols = tooth.shape
        self.cell_mm = cell_mm
        self.optics = np.ascontiguousarray(np.concatenate([k, s], 1), np.float32)
        cells = tooth.size
        self.paper = np.ascontiguousarray(tooth, np.float32).ravel()
        self.total = np.zeros(cells, np.float32)
        self.count = np.zeros(cells, np.uint8)
        self.crayon = np.zeros((cells, LAYERS), np.uint8)
        self.layer = np.zeros((cells, LAYERS), np.float32)
        self.blend = np.zeros((cells, BLEND), np.float32)

    def columns(self) -> tuple[Any, ...]:
        """What the kernels take."""
        flat = (a.reshape(-1) for a in (self.crayon, self.layer, self.blend, self.optics))
        return self.paper, self.total, self.count, *flat

    def film_um(self) -> Floats:
        """Height of the wax (rows, cols) in um."""
        return self.total.reshape(self.rows, self.cols)

    def pigments(self) -> NDArray[np.float64]:
        """Sums of h, k*h and s*h over the sheet (7): what smearing must not change."""
        sums = self.blend.sum(0, dtype=np.float64)
        used = np.arange(LAYERS) < self.count[:, None]
        for index, optics in enumerate(self.optics.astype(np.float64)):
            height = float(self.layer[used & (self.crayon == index)].sum(dtype=np.float64))
            sums[0] += height
            sums[1:] += height * optics
        return sums
