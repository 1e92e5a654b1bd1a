"""What the camera of a film sees: the sheet reduced to the film's size, square by square, and the
crayon on it.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import cv2
import numpy as np
from numpy.typing import NDArray

from stroke_gen.colour import oklab
from stroke_gen.drawing import Stroke
from stroke_gen.jit import kernel

from ..images.icc import encode_srgb
from ..images.srgb import codes
from ..light import optics
from ..wax.queue import TILE
from ..wax.sheet import Sheet

if TYPE_CHECKING:
    from ..pipeline import Easel

LONG_SIDE = 900  # of a film at most, in pixels; half of it at least, if the drawing has as many
# cells of a square that is looked at as a whole; squares lie within the tiles of the schedule
LOOK = 8
SHADES = 32768  # steps of light in the table of sRGB codes

Floats = NDArray[np.float32]
Frame = NDArray[np.uint8]


class View:
    """The sheet at the film's size.

    now, before: (h, w, 3) sRGB, after this frame's strokes and the last's.
    """

    def __init__(self, easel: "Easel", shaded: bool) -> None:
        sheet = easel.sheet
        self.easel, self.shaded = easel, shaded
        self.factor = 1  # cells a pixel: a power of two, so that tiles are whole pixels
        while max(sheet.rows, sheet.cols) > LONG_SIDE * self.factor and self.factor < TILE:
            self.factor *= 2
        self.cells = max(LOOK, self.factor)  # of the side of a square
        self.side = self.cells // self.factor  # of a square, in pixels
        self.pixels_per_mm = 1 / (self.factor * sheet.cell_mm)
        self.colours = {c.name: codes(c.hex) for c in easel.box.palette.crayons}
        self.light = easel.picture(shaded)
        self.codes = encode_srgb(np.linspace(0, 1, SHADES, dtype=np.float32))
        rows, cols = max(1, sheet.rows // self.factor), max(1, sheet.cols // self.factor)
        self.now = np.empty((rows, cols, 3), np.uint8)
        squares = np.argwhere(self.board() < 0)
        self.put(squares, self.patches(squares))
        self.before = self.now.copy()

    def board(self) -> NDArray[np.int64]:
        """-1 for each square of the sheet."""
        sheet = self.easel.sheet
        return np.full((-(-sheet.rows // self.cells), -(-sheet.cols // self.cells)), -1, np.int64)

    def look(self, squares: NDArray[np.int64]) -> Frame:
        """Render squares (n, 2), row and column, and return them as patches of the film."""
        sheet = self.easel.sheet
        low = squares * self.cells
        high = np.minimum(low + self.cells, (sheet.rows, sheet.cols))
        parts = np.stack([low[:, 0], high[:, 0], low[:, 1], high[:, 1]], 1)
        optics.render_parts(sheet, self.easel.ground, parts, self.light, light=self.shaded)
        return self.patches(squares)

    def patches(self, squares: NDArray[np.int64]) -> Frame:
        """Squares (n, 2) of the light, reduced to the film's size: (n, side, side, 3) sRGB."""
        out = np.empty((len(squares), self.side, self.side, 3), np.uint8)
        _reduce(squares * self.cells, self.factor, self.light, self.codes, out)
        return out

    def put(self, squares: NDArray[np.int64], patches: Frame) -> None:
        """Put patches where they belong."""
        _paste(squares * self.side, patches, self.now)

    def frame(self, stroke: Stroke | None, passed: float) -> Frame:
        """The sheet as it is while the crayon is on its way through `stroke`."""
        frame = self.now.copy()
        if stroke is None or passed >= 1:
            return frame
        low = (
            np.floor((stroke.path_mm.min(0) - stroke.tip.width_mm) * self.pixels_per_mm)
            .astype(int)
            .clip(0)
        )
        high = (
            np.ceil((stroke.path_mm.max(0) + stroke.tip.width_mm) * self.pixels_per_mm)
            .astype(int)
            .clip(0)
            + 1
        )
        part = np.s_[low[1] : high[1], low[0] : high[0]]
        if frame[part].size:
            ahead = self._swath(
                along(stroke.path_mm[::-1], 1 - passed), stroke, low, frame[part].shape[:2]
            )
            ahead &= ~self._swath(along(stroke.path_mm, passed), stroke, low, frame[part].shape[:2])
            np.copyto(frame[part], self.before[part], where=ahead[..., None])
        return frame

    def _swath(
        self, path: Floats, stroke: Stroke, corner: NDArray[np.int64], shape: tuple[int, ...]
    ) -> NDArray[np.bool_]:
        """Where the tip touches on its way along a path, in a part of the film of this corner and
        shape.
        """
        mask = np.zeros(shape, np.uint8)
        points = np.round((path * self.pixels_per_mm - corner) * 16).astype(np.int32)
        width = max(
            1, round((stroke.tip.width_mm + 3 * self.easel.sheet.cell_mm) * self.pixels_per_mm)
        )
        cv2.polylines(mask, [points], False, 1, width, cv2.LINE_8, 4)
        return mask > 0


def along(path: Floats, passed: float) -> Floats:
    """The first part of a path (n, 2), `passed` of its length."""
    steps = np.hypot(*np.diff(path, axis=0).T)
    walked = np.concatenate([[0.0], np.cumsum(steps)])
    here = passed * walked[-1]
    last = int(np.searchsorted(walked, here, "right"))
    point = [np.interp(here, walked, path[:, axis]) for axis in (0, 1)]
    return np.concatenate([path[:last], [point]]).astype(np.float32)


# ---- colours and the crayon in view --------------------------------------------------------------


def colours(easel: "Easel") -> Frame:
    """255 of the colours that can appear: (255, 3) sRGB.

    What can appear: each crayon thin to thick on the paper, and each over each other. Of a box that
    is not too large all of the first are taken; then in turn the colour farthest from those taken
    (Gonzalez 1985).
    """
    crayons = range(len(easel.box.palette.crayons))
    columns: list[list[tuple[int, float]]] = [
        [],
        *([(i, h)] for i in crayons for h in (0.7, 1.5, 3.0, 6.0, 12.0)),
    ]
    alone = len(columns)
    columns += [[(i, h), (j, 5.0)] for i in crayons for j in crayons for h in (3.0, 12.0) if i != j]
    sheet = Sheet(
        np.zeros((1, len(columns)), np.float32), 1.0, *np.split(easel.sheet.optics, 2, axis=1)
    )
    for cell, column in enumerate(columns):
        sheet.used[cell] = len(column)
        sheet.total[cell] = sum(height for _, height in column)
        for layer, (crayon, height) in enumerate(column):
            sheet.crayon[cell, layer], sheet.layer[cell, layer] = crayon, height
    seen = optics.render(sheet, easel.ground, light=False)[0]
    lab = oklab(seen)
    taken = list(range(alone)) if alone <= 150 else [0]
    far = ((lab[:, None] - lab[None, taken]) ** 2).sum(2).min(1)
    while len(taken) < min(255, len(lab)):
        taken.append(int(far.argmax()))
        far = np.minimum(far, ((lab - lab[taken[-1]]) ** 2).sum(1))
    return encode_srgb(seen[None, taken])[0]


def draw_crayon(frame: Frame, tip: NDArray[np.float32], colour: tuple[int, int, int]) -> None:
    """A crayon with its point at `tip` (x, y in pixels), held to the lower right."""
    size = max(frame.shape[:2]) / 100
    axis = np.array([np.cos(0.9), np.sin(0.9)]) * size
    across = np.array([-axis[1], axis[0]])

    def body(
        start: float, end: float, half_start: float, half_end: float, rgb: Sequence[float]
    ) -> None:
        a, b = tip + axis * start, tip + axis * end
        sides = across * half_start, across * half_end
        outline = np.array([a + sides[0], a - sides[0], b - sides[1], b + sides[1]])
        points = np.round(outline * 16).astype(np.int32)
        cv2.fillPoly(frame, [points], rgb, cv2.LINE_AA, 4)
        cv2.polylines(frame, [points], True, [c * 0.55 for c in rgb], 1, cv2.LINE_AA, 4)

    wrapper = [(c + 40) * 0.75 for c in colour]
    body(0, 1.6, 0.25, 0.6, colour)  # the point
    body(1.6, 2.4, 0.8, 0.8, colour)
    body(2.4, 9, 0.8, 0.8, wrapper)  # the paper round it
    for band in (3.0, 8.0):
        body(band, band + 0.35, 0.8, 0.8, [c * 0.3 for c in colour])


# ---- kernels -------------------------------------------------------------------------------------


@kernel
def _paste(corners, patches, out):  # type: ignore[no-untyped-def]
    """Copy patches (n, side, side, 3) into `out` from each corner on, as far as it goes."""
    for n in range(corners.shape[0]):
        for y in range(corners[n, 0], min(corners[n, 0] + patches.shape[1], out.shape[0])):
            for x in range(corners[n, 1], min(corners[n, 1] + patches.shape[2], out.shape[1])):
                for c in range(3):
                    out[y, x, c] = patches[n, y - corners[n, 0], x - corners[n, 1], c]


@kernel
def _reduce(corners, factor, light, codes, out):  # type: ignore[no-untyped-def]
    """Patches (n, side, side, 3) as means of factor x factor cells of linear light from each corner
    on, in sRGB.
    """
    steps = codes.size - 1
    rows, cols = light.shape[:2]
    for n in range(corners.shape[0]):
        for y in range(out.shape[1]):
            for x in range(out.shape[2]):
                top, left = corners[n, 0] + y * factor, corners[n, 1] + x * factor
                bottom, right = min(top + factor, rows), min(left + factor, cols)
                share = np.float32(1) / np.float32(max(1, (bottom - top) * (right - left)))
                for c in range(3):
                    total = np.float32(0)
                    for j in range(top, bottom):
                        for i in range(left, right):
                            total += light[j, i, c]
                    mean = min(max(total * share, np.float32(0)), np.float32(1))
                    out[n, y, x, c] = codes[int(mean * steps + np.float32(0.5))]
