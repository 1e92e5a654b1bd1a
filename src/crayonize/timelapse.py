"""A film of a drawing being drawn: bare paper first, then stroke by stroke at a hand's pace, compressed.

The frames come from the one simulation. An Easel hands its strokes to a Timelapse, which hands them back in
slices, one slice a frame, and after each slice renders only the tiles that were touched, already reduced to
the size of the film. Slices are in drawing order, so the drawing stays the same, bit for bit.

A stroke that has only begun when a frame is due is drawn whole by the simulation; the film shows the part
that the crayon has passed.
"""

import os
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import cv2
import numpy as np
from numpy.typing import NDArray

from stroke_gen.colour import oklab
from stroke_gen.drawing import Stroke
from stroke_gen.jit import kernel

from . import film, optics
from .image_color import encode_srgb
from .wax import Sheet

if TYPE_CHECKING:
    from .pipeline import Easel

LONG_SIDE = 800  # of a film at most, in pixels
FIRST, LAST = 0.4, 1.5  # seconds for which the bare sheet and the finished drawing stand
FILL_MM_S, LINE_MM_S = 200.0, 60.0  # how fast a hand fills a plane, and draws a line
LINES = ("line", "detail", "outline")  # notes of strokes that are drawn slowly
LIFT_S, DAB_S = 0.25, 0.1  # time from stroke to stroke, and for a dab
TILE = 16  # pixels of the film that are renewed together
SHADES = 32768  # steps of light in the table of sRGB codes

Floats = NDArray[np.float32]
Frame = NDArray[np.uint8]


class Timelapse:
    """Watches an Easel (`Easel.watch`) and films it; a context manager, whose end completes the file."""

    def __init__(self, path: str | os.PathLike[str], seconds: float = 12.0, show_tip: bool = False) -> None:
        """path: .webp, .gif, .png, .apng or .mp4. ValueError at once for what cannot be written."""
        if not 3 <= seconds <= 600:
            raise ValueError(f"seconds: {seconds:g} is not between 3 and 600")
        film.check(path)
        self.path, self.show_tip = path, show_tip
        self.steps = round((seconds - FIRST - LAST) * film.FPS)  # frames on which something is drawn
        self._promised, self._shown = 0.0, 0
        self._view: _View | None = None
        self._writer: film.Writer | None = None

    def __enter__(self) -> "Timelapse":
        return self

    def __exit__(self, kind: object, error: object, trace: object) -> None:
        if self._writer and kind is not None:
            self._writer.abort()
        elif self._writer and self._view:
            for _ in range(self.steps + 1 - self._shown):
                self._writer.add(self._view.now)
            self._writer.close()

    def __call__(self, easel: "Easel", strokes: Sequence[Stroke], share: float) -> Iterator[Sequence[Stroke]]:
        """Slices of strokes for the easel to draw, in order; `share` is their part of the film's time."""
        view = self._open(easel)
        start, end = pace(strokes)
        self._promised += share * self.steps
        frames = min(round(self._promised), self.steps) - self._shown
        drawn = 0
        for time in (np.arange(frames) + 1) / max(frames, 1) * (end[-1] if strokes else 0):
            until = int(np.searchsorted(start, time, "right"))
            if until > drawn:
                yield strokes[drawn:until]
                view.renew(strokes[drawn:until])
                drawn = until
            passed = (time - start[drawn - 1]) / (end[drawn - 1] - start[drawn - 1]) if drawn else 1.0
            self._show(view, strokes[drawn - 1] if drawn else None, passed)
        if drawn < len(strokes):  # more strokes than the film has time for
            yield strokes[drawn:]
            view.renew(strokes[drawn:])

    def _open(self, easel: "Easel") -> "_View":
        if self._view is None:
            self._view = view = _View(easel)
            rows, cols = view.now.shape[:2]
            first, last = round(FIRST * film.FPS), round(LAST * film.FPS)
            reel = film.Reel(cols, rows, self.steps + 2, first, last, _colours(easel))
            self._writer = film.Writer(self.path, reel)
            self._writer.add(view.now.copy())
        return self._view

    def _show(self, view: "_View", stroke: Stroke | None, passed: float) -> None:
        assert self._writer
        frame = view.frame(stroke, passed)
        if stroke and self.show_tip:
            where = _along(stroke.path_mm, passed)[-1] * view.pixels_per_mm
            _draw_crayon(frame, where, view.colours[stroke.crayon])
        self._writer.add(frame)
        self._shown += 1


def pace(strokes: Sequence[Stroke]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """When each stroke begins and ends, in seconds of a hand's work."""
    took = np.array([_seconds(s) for s in strokes])
    end = np.cumsum(took + LIFT_S)
    return end - took, end


def _seconds(stroke: Stroke) -> float:
    steps = np.diff(stroke.path_mm, axis=0)
    speed = LINE_MM_S if stroke.note in LINES else FILL_MM_S
    return DAB_S + float(np.hypot(steps[:, 0], steps[:, 1]).sum()) / speed


def _along(path: Floats, passed: float) -> Floats:
    """The first part of a path (n, 2), `passed` of its length."""
    steps = np.hypot(*np.diff(path, axis=0).T)
    walked = np.concatenate([[0.0], np.cumsum(steps)])
    here = passed * walked[-1]
    last = int(np.searchsorted(walked, here, "right"))
    point = [np.interp(here, walked, path[:, axis]) for axis in (0, 1)]
    return np.concatenate([path[:last], [point]]).astype(np.float32)


# ---- what the camera sees ----------------------------------------------------------------------------------


class _View:
    """The sheet at the film's size, renewed where strokes were drawn. now: (h, w, 3) sRGB."""

    def __init__(self, easel: "Easel") -> None:
        sheet = easel.sheet
        self.easel = easel
        self.factor = -(-max(sheet.rows, sheet.cols) // LONG_SIDE)  # cells a pixel
        self.pixels_per_mm = 1 / (self.factor * sheet.cell_mm)
        self.colours = {c.name: _rgb(c.hex) for c in easel.box.palette.crayons}
        self.light = easel.picture()
        self.now = np.empty((max(1, sheet.rows // self.factor), max(1, sheet.cols // self.factor), 3), np.uint8)
        self.codes = encode_srgb(np.linspace(0, 1, SHADES, dtype=np.float32))
        _reduce(0, self.now.shape[0], 0, self.now.shape[1], self.factor, self.light, self.codes, self.now)
        self.before = self.now.copy()

    def renew(self, strokes: Sequence[Stroke]) -> None:
        """Look again where strokes have been drawn."""
        self.before[:] = self.now
        rows, cols = self.now.shape[:2]
        easel, factor = self.easel, self.factor
        parts = [(row * TILE, min((row + 1) * TILE, rows), first * TILE, min(end * TILE, cols))
                 for row, first, end in self._runs(strokes)]  # fmt: skip
        cells = [(top * factor, bottom * factor, left * factor, right * factor) for top, bottom, left, right in parts]
        optics.render_parts(easel.sheet, easel.ground, cells, self.light, threads=easel.threads)
        for part in parts:
            _reduce(*part, factor, self.light, self.codes, self.now)

    def frame(self, stroke: Stroke | None, passed: float) -> Frame:
        """The sheet as it is while the crayon is on its way through `stroke`."""
        frame = self.now.copy()
        if stroke is None or passed >= 1:
            return frame
        low = np.floor((stroke.path_mm.min(0) - stroke.tip.width_mm) * self.pixels_per_mm).astype(int).clip(0)
        high = np.ceil((stroke.path_mm.max(0) + stroke.tip.width_mm) * self.pixels_per_mm).astype(int).clip(0) + 1
        part = np.s_[low[1] : high[1], low[0] : high[0]]
        ahead = self._swath(_along(stroke.path_mm[::-1], 1 - passed), stroke, low, frame[part].shape[:2])
        ahead &= ~self._swath(_along(stroke.path_mm, passed), stroke, low, frame[part].shape[:2])
        np.copyto(frame[part], self.before[part], where=ahead[..., None])
        return frame

    def _swath(
        self, path: Floats, stroke: Stroke, corner: NDArray[np.int64], shape: tuple[int, ...]
    ) -> NDArray[np.bool_]:
        """Where the tip touches on its way along a path, in a part of the film of this corner and shape."""
        mask = np.zeros(shape, np.uint8)
        points = np.round((path * self.pixels_per_mm - corner) * 16).astype(np.int32)
        width = max(1, round((stroke.tip.width_mm + 3 * self.easel.sheet.cell_mm) * self.pixels_per_mm))
        cv2.polylines(mask, [points], False, 1, width, cv2.LINE_8, 4)
        return mask > 0

    def _runs(self, strokes: Sequence[Stroke]) -> list[tuple[int, int, int]]:
        """Rows of tiles that strokes touched: (row, first tile, tile after the last)."""
        cells = TILE * self.factor
        touched = np.zeros((-(-self.now.shape[0] // TILE), -(-self.now.shape[1] // TILE)), np.uint8)
        points = np.concatenate([s.path_mm for s in strokes]) / np.float32(self.easel.sheet.cell_mm)
        reach = np.array([_reach(s, self.easel.sheet) for s in strokes], np.float32)
        _touch(points, np.cumsum([0, *(len(s.path_mm) for s in strokes)]), reach, cells, touched)
        edges = np.diff(np.pad(touched, ((0, 0), (1, 1))).astype(np.int8), axis=1)
        rows, first = np.nonzero(edges == 1)
        return list(zip(rows.tolist(), first.tolist(), np.nonzero(edges == -1)[1].tolist(), strict=True))


def _reach(stroke: Stroke, sheet: Sheet) -> float:
    """How far from its path a stroke can change what is seen, in cells: half the tip, its border, its shadow."""
    return float(stroke.tip.width_mm / sheet.cell_mm / 2 + 5)


@kernel
def _touch(points, first, reach, tile, touched):  # type: ignore[no-untyped-def]
    """Mark the tiles within reach of each path; points (n, 2) and reach (paths,) in cells."""
    rows, cols = touched.shape
    for s in range(first.size - 1):
        for i in range(first[s], first[s + 1]):
            j = max(i - 1, first[s])
            dx, dy = points[i, 0] - points[j, 0], points[i, 1] - points[j, 1]
            parts = 1 + int(max(abs(dx), abs(dy)) / tile * 4)
            r = reach[s] + tile / 8  # a path is sampled four times a tile
            for p in range(parts):
                t = (p + 1) / parts
                x, y = points[j, 0] + t * dx, points[j, 1] + t * dy
                for ty in range(max(0, int((y - r) // tile)), min(rows - 1, int((y + r) // tile)) + 1):
                    for tx in range(max(0, int((x - r) // tile)), min(cols - 1, int((x + r) // tile)) + 1):
                        touched[ty, tx] = 1


@kernel
def _reduce(top, bottom, left, right, factor, light, codes, out):  # type: ignore[no-untyped-def]
    """Pixels top..bottom, left..right of `out` as means of factor x factor cells of linear light, in sRGB."""
    share = np.float32(1) / np.float32(factor * factor)
    steps = codes.size - 1
    for y in range(top, bottom):
        for x in range(left, right):
            for c in range(3):
                total = np.float32(0)
                for j in range(y * factor, (y + 1) * factor):
                    for i in range(x * factor, (x + 1) * factor):
                        total += light[j, i, c]
                mean = min(max(total * share, np.float32(0)), np.float32(1))
                out[y, x, c] = codes[int(mean * steps + np.float32(0.5))]


# ---- colours and the crayon in view ------------------------------------------------------------------------


def _rgb(colour: str) -> tuple[int, int, int]:
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def _colours(easel: "Easel") -> Frame:
    """255 of the colours that can appear: (255, 3) sRGB.

    What can appear: each crayon thin to thick on the paper, and each over each other. Of a box that is not
    too large all of the first are taken; then in turn the colour farthest from those taken (Gonzalez 1985).
    """
    crayons = range(len(easel.box.palette.crayons))
    columns: list[list[tuple[int, float]]] = [[], *([(i, h)] for i in crayons for h in (0.7, 1.5, 3.0, 6.0, 12.0))]
    alone = len(columns)
    columns += [[(i, h), (j, 5.0)] for i in crayons for j in crayons for h in (3.0, 12.0) if i != j]
    sheet = Sheet(np.zeros((1, len(columns)), np.float32), 1.0, *np.split(easel.sheet.optics, 2, axis=1))
    for cell, column in enumerate(columns):
        sheet.count[cell] = len(column)
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


def _draw_crayon(frame: Frame, tip: NDArray[np.float32], colour: tuple[int, int, int]) -> None:
    """A crayon with its point at `tip` (x, y in pixels), held to the lower right."""
    size = max(frame.shape[:2]) / 100
    axis = np.array([np.cos(0.9), np.sin(0.9)]) * size
    across = np.array([-axis[1], axis[0]])

    def body(start: float, end: float, half_start: float, half_end: float, rgb: Sequence[float]) -> None:
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
