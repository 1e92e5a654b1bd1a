"""A bench for tests of the wax: blank sheets, a box of test crayons, strokes, with either
physics.
"""

from dataclasses import dataclass, replace

import naive
import numpy as np

from crayonize.crayons.palette import Palette
from crayonize.wax import rub
from crayonize.wax.box import Box
from crayonize.wax.paper import Paper, tooth
from crayonize.wax.physics import Physics
from crayonize.wax.sheet import Sheet
from stroke_gen.drawing import Stroke, Tip

CRAYONS = {  # k and s per um, unlike in all channels
    "red": ((0.005, 0.12, 0.1), (0.03, 0.01, 0.012)),
    "yellow": ((0.002, 0.006, 0.15), (0.03, 0.028, 0.005)),
    "blue": ((0.15, 0.08, 0.01), (0.005, 0.01, 0.03)),
    "white": ((0.001, 0.001, 0.0012), (0.06, 0.055, 0.05)),
    "black": ((0.3, 0.31, 0.29), (0.004, 0.005, 0.006)),
    "green": ((0.1, 0.01, 0.09), (0.01, 0.03, 0.011)),
    "brown": ((0.05, 0.1, 0.2), (0.02, 0.015, 0.013)),
}


@dataclass
class Bench:
    """Where a test draws: one physics, one box of crayons."""

    physics: Physics
    palette: Palette

    def sheet(self, heights: np.ndarray, cell_mm: float = 0.1) -> Sheet:
        """A blank sheet with a given tooth in um."""
        crayons = self.palette.crayons
        k, s = (
            np.array([c.k for c in crayons], np.float32),
            np.array([c.s for c in crayons], np.float32),
        )
        return Sheet(heights.astype(np.float32), cell_mm, k, s)

    def felt(
        self, rows: int, cols: int, cell_mm: float = 0.1, seed: int = 0, wavelength_mm: float = 0.8
    ) -> Sheet:
        """A blank sheet of felt-pressed paper, tooth 45 um."""
        return self.sheet(
            tooth(Paper("", "", "felt", wavelength_mm, 45.0), rows, cols, cell_mm, seed), cell_mm
        )

    def stroke(
        self, path_mm: object, um: float, crayon: str = "red", tip: Tip | None = None
    ) -> Stroke:
        """A stroke whose force makes a mean overlap of `um` under a blunt tip of 1.6 mm or another
        tip.
        """
        tip = tip or Tip("blunt", 1.6)
        path = np.array(path_mm, np.float32).reshape(-1, 2)
        force = um * self.physics.lam * np.pi / 4 * tip.width_mm**2
        return Stroke(path, np.full(len(path), force, np.float32), crayon, tip)

    def draw(self, sheet: Sheet, strokes: list[Stroke], **options: object) -> float:
        """Draw with fresh crayons; returns the wax given in um times cells."""
        return rub.rub(sheet, strokes, Box(self.palette, self.physics, sheet.cell_mm), **options)

    def changed(self, **constants: float) -> "Bench":
        """The same bench with other constants of the wax."""
        return Bench(replace(self.physics, **constants), self.palette)

    def scribble(
        self, rng: np.random.Generator, number: int, size_mm: float, um: float = 6.0
    ) -> list[Stroke]:
        """Random strokes of all crayons and tips, some of them over the edge of the sheet."""
        strokes = []
        for _ in range(number):
            path = rng.uniform(-0.05, 1.05, 2) * size_mm + np.cumsum(
                rng.normal(0, 1.2, (rng.integers(1, 6), 2)), 0
            )
            kind = str(rng.choice(["sharp", "blunt", "rim", "side"]))
            tip = Tip(kind, float(rng.uniform(0.8, 2.0)), float(rng.uniform(0, 360)))
            crayon = str(rng.choice([c.name for c in self.palette.crayons]))
            strokes.append(self.stroke(path, um * float(rng.uniform(0.1, 2.5)), crayon, tip))
        return strokes


def old_wax(sheet, rng, thickness=12.0):
    """Cover a sheet with columns of every sort: bare, thin, many layers, a blend under four
    layers.
    """
    for cell in range(sheet.rows * sheet.cols):
        column = naive.Column(0.0)
        for _ in range(rng.integers(0, 9)):
            height = thickness * rng.random() ** 3
            naive.add(column, int(rng.integers(len(sheet.optics))), height, sheet.optics)
        if rng.random() < 0.3:
            column.layers = []
        sheet.used[cell] = len(column.layers)
        for j, (crayon, height) in enumerate(column.layers):
            sheet.crayon[cell, j], sheet.layer[cell, j] = crayon, height
        sheet.blend[cell] = column.blend
        sheet.total[cell] = column.wax()
    return sheet


def pigments(sheet: Sheet) -> np.ndarray:
    """Sums of h, k*h and s*h over the sheet (7): what smearing must not change."""
    sums = sheet.blend.sum(0, dtype=np.float64)
    used = np.arange(sheet.layer.shape[1]) < sheet.used[:, None]
    for index, optics in enumerate(sheet.optics.astype(np.float64)):
        height = float(sheet.layer[used & (sheet.crayon == index)].sum(dtype=np.float64))
        sums[0] += height
        sums[1:] += height * optics
    return sums
