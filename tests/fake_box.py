"""A box of nine made-up crayons as the generator sees them, and a sheet that knows no wax: both
need no simulator.
"""

from itertools import groupby

import cv2
import numpy as np

from stroke_gen.swatches import Swatches, covered, firmness

PRESSURES = np.array([0.04, 0.1, 0.2, 0.38, 0.62, 0.95], np.float32)
PAPER = np.array([0.97, 0.97, 0.95], np.float32)
COLOURS = {  # linear light of a heavy coat
    "white": (0.95, 0.95, 0.93),
    "yellow": (0.9, 0.75, 0.05),
    "pink": (0.85, 0.4, 0.4),
    "red": (0.6, 0.03, 0.03),
    "sky": (0.2, 0.5, 0.8),
    "green": (0.05, 0.35, 0.08),
    "blue": (0.02, 0.05, 0.4),
    "brown": (0.12, 0.06, 0.03),
    "black": (0.015, 0.015, 0.015),
}


OVER_WAX = 0.6  # wax takes hold of wax as a lighter hand does of paper


def box(paper: np.ndarray = PAPER) -> Swatches:
    """The table of the nine: more pressure covers more of the ground, and wax lets a quarter of it
    through.
    """
    wax = np.array(list(COLOURS.values()), np.float32)[:, None]
    cover, over = (
        (1 - np.exp(-hold * PRESSURES / 0.25)).astype(np.float32)[None, :, None]
        for hold in (1.0, OVER_WAX)
    )
    grain = 0.12 * (1 - np.cbrt(wax.mean(2))) * np.sqrt(cover * (1 - cover))[..., 0]
    a = np.stack([1 - part + 0.25 * part * wax for part in (cover, over)])
    b = np.stack([0.75 * part * wax for part in (cover, over)])
    return Swatches(
        tuple(COLOURS), PRESSURES, a, b, grain.astype(np.float32), np.asarray(paper, np.float32)
    )


class FlatSheet:
    """A sheet on which strokes are even bands of their swatch's colour."""

    def __init__(self, width_mm: float, height_mm: float, table: Swatches | None = None) -> None:
        self.size_mm, self.table = np.array([width_mm, height_mm]), table or box()
        self.light: np.ndarray | None = None

    def look(self, shape):
        """Linear light (h, w, 3), as `generate` asks for; the first look says how fine the sheet
        is.
        """
        if self.light is None:
            self.light = np.tile(self.table.paper, (*shape, 1)).astype(np.float32)
        return self.light.copy()

    def draw(self, strokes):
        """Draw strokes, in order."""
        shape = self.light.shape[:2]
        scale = np.array(shape[::-1]) / self.size_mm
        for (crayon, width), part in groupby(strokes, lambda s: (s.crayon, s.tip.width_mm)):
            level = np.zeros(shape, np.float32)
            for stroke in part:
                pressure = float(stroke.force_n.mean()) / (0.785 * width * width) / firmness(width)
                points = np.round(stroke.path_mm * scale * 16).astype(np.int32)
                cv2.polylines(
                    level, [points], False, pressure, max(1, round(width * scale[0])), cv2.LINE_8, 4
                )
            self._lay(self.table.names.index(crayon), level)

    def _lay(self, k, level):
        """One crayon at a pressure (h, w), by the table's two lines."""
        drawn, table = level > 0, self.table
        ground = self.light[drawn]
        waxed = covered(ground, table.paper)
        for c in range(3):
            bare, over = (
                np.interp(level[drawn], table.pressures, table.a[on, k, :, c]) * ground[:, c]
                + np.interp(level[drawn], table.pressures, table.b[on, k, :, c])
                for on in (0, 1)
            )
            self.light[drawn, c] = bare + waxed * (over - bare)
