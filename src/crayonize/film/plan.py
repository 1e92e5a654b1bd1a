"""A film of a drawing being drawn: bare paper first, then stroke by stroke at a hand's pace, compressed.

The frames come from the one simulation. Strokes are drawn side by side, but a tile of the sheet sees them in
order: right after the last stroke of a frame that touches a tile, the tile is rendered, reduced to the size of
the film and put aside for that frame. The drawing is not held up, and stays the same, bit for bit.

A stroke that has only begun when a frame is due is drawn whole by the simulation; the film shows the part
that the crayon has passed.
"""

import itertools
import os
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING

import cv2
import numpy as np
from numpy.typing import NDArray

from stroke_gen.colour import oklab
from stroke_gen.drawing import Note, Stroke
from stroke_gen.jit import kernel

from ..images.icc import encode_srgb
from ..images.srgb import codes
from ..light import optics
from ..wax import rub
from ..wax.queue import TILE
from ..wax.sheet import Sheet
from . import writers as film

if TYPE_CHECKING:
    from ..pipeline import Easel

LONG_SIDE = 900  # of a film at most, in pixels; half of it at least, if the drawing has as many
FIRST, LAST = 0.4, 1.5  # seconds for which the bare sheet and the finished drawing stand
FILL_MM_S, LINE_MM_S = 200.0, 60.0  # how fast a hand fills a plane, and draws a line
LINES = (Note.LINE, Note.DETAIL, Note.OUTLINE)  # notes of strokes that are drawn slowly
LIFT_S, DAB_S = 0.25, 0.1  # time from stroke to stroke, and for a dab
LOOK = 8  # cells of a square that is looked at as a whole; squares lie within the tiles of the schedule
SHADES = 32768  # steps of light in the table of sRGB codes

Floats = NDArray[np.float32]
Frame = NDArray[np.uint8]


class Timelapse:
    """Looks on while an Easel is drawn on, and films it; a context manager, whose end completes the file."""

    def __init__(
        self, path: str | os.PathLike[str], seconds: float = 12.0, show_tip: bool = False, light: bool = True
    ) -> None:
        """path: .webp, .gif, .png, .apng or .mp4. light: shade the relief. ValueError for what cannot be written."""
        if not 3 <= seconds <= 600:
            raise ValueError(f"seconds: {seconds:g} is not between 3 and 600")
        film.check(path)
        self.path, self.show_tip, self.shaded = path, show_tip, light
        self.steps = round((seconds - FIRST - LAST) * film.FPS)  # frames on which something is drawn
        self._promised, self._planned = 0.0, 0
        self._scenes: list[_Scene] = []
        self._news = threading.Condition()
        self._over = self._aborted = False
        self._pool = ThreadPoolExecutor(1)
        self._written: Future[None] | None = None

    def __enter__(self) -> "Timelapse":
        return self

    def __exit__(self, kind: object, error: object, trace: object) -> None:
        with self._news:
            self._over, self._aborted = True, kind is not None
            self._news.notify()
        self._pool.shutdown()
        if self._written and not self._aborted:
            self._written.result()

    def open(self, easel: "Easel") -> None:
        """Begin the film with the bare sheet on the easel."""
        self._view = _View(easel, self.shaded)
        rows, cols = self._view.now.shape[:2]
        first, last = round(FIRST * film.FPS), round(LAST * film.FPS)
        reel = film.Reel(cols, rows, self.steps + 2, first, last, _colours(easel))
        self._written = self._pool.submit(film.write, self.path, reel, self._frames())

    def strokes(self, strokes: Sequence[Stroke], share: float) -> rub.Watch:
        """Plan the frames for strokes that take `share` of the film's time."""
        if self._written and self._written.done():
            self._written.result()  # raises: no reason to draw on for a film that cannot be written
        self._promised += share * self.steps
        frames = max(0, min(round(self._promised), self.steps) - self._planned)
        scene = _Scene(self._view, strokes, frames, self._news)
        self._planned += frames
        with self._news:
            self._scenes.append(scene)
            self._news.notify()
        return scene.watch

    def _frames(self) -> Iterator[Frame]:
        """All frames in order, each as soon as its strokes are drawn; runs in the writer's thread."""
        yield self._view.now.copy()
        shown = 0
        for scene in self._all_scenes():
            for number in range(scene.frames):
                self._wait(partial(scene.ready, number))
                scene.put(number)
                yield self._frame(scene, number)
                shown += 1
            self._wait(partial(scene.ready, scene.frames))
            scene.put(scene.frames)
        for _ in range(self.steps + 1 - shown):
            yield self._view.now.copy()

    def _all_scenes(self) -> "Iterator[_Scene]":
        """The scenes as they come, until the film is over."""
        for number in itertools.count():
            self._wait(partial(self._has_scene_or_is_over, number))
            if number >= len(self._scenes):
                return
            yield self._scenes[number]

    def _has_scene_or_is_over(self, number: int) -> bool:
        return len(self._scenes) > number or self._over

    def _wait(self, ready: Callable[[], bool]) -> None:
        """Wait until something is ready."""
        with self._news:
            self._news.wait_for(lambda: self._aborted or ready())
        if self._aborted:
            raise film.Aborted

    def _frame(self, scene: "_Scene", number: int) -> Frame:
        stroke, passed = scene.under_way(number)
        frame = self._view.frame(stroke, passed)
        if stroke and self.show_tip:
            where = _along(stroke.path_mm, passed)[-1] * self._view.pixels_per_mm
            _draw_crayon(frame, where, self._view.colours[stroke.crayon])
        return frame


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
    """The sheet at the film's size. now, before: (h, w, 3) sRGB, after this frame's strokes and the last's."""

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
        low = np.floor((stroke.path_mm.min(0) - stroke.tip.width_mm) * self.pixels_per_mm).astype(int).clip(0)
        high = np.ceil((stroke.path_mm.max(0) + stroke.tip.width_mm) * self.pixels_per_mm).astype(int).clip(0) + 1
        part = np.s_[low[1] : high[1], low[0] : high[0]]
        if frame[part].size:
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


@dataclass
class _Scene:
    """Strokes that are drawn at one go, and the frames they are shown on."""

    view: _View
    strokes: Sequence[Stroke]
    frames: int
    news: threading.Condition
    missing: list[int] = field(init=False)  # strokes of each frame that are not yet drawn, and of those after all

    def __post_init__(self) -> None:
        self.start, self.end = pace(self.strokes)
        all_s = float(self.end[-1]) if len(self.strokes) else 0.0
        self.times = (np.arange(self.frames) + 1) / max(self.frames, 1) * all_s
        self.frame_of = np.searchsorted(self.times, self.start)
        self.missing = np.bincount(self.frame_of, minlength=self.frames + 1).tolist()
        self.seen: list[list[tuple[NDArray[np.int64], Frame]]] = [[] for _ in self.missing]

    def watch(self, points: Floats, first: NDArray[np.int64], reach: Floats) -> rub.Drawn:
        """Plan which squares to look at after which stroke: after the last of a frame that touches them."""
        view = self.view
        counted = _due(points, first, reach, self.frame_of, view.cells, view.board(), np.empty((0, 3), np.int64))
        due = np.empty((counted, 3), np.int64)
        _due(points, first, reach, self.frame_of, view.cells, view.board(), due)
        due = due[::-1]
        begin = np.searchsorted(due[:, 0], np.arange(len(self.strokes) + 1)).tolist()
        squares = np.ascontiguousarray(due[:, 1:])

        def drawn(stroke: int) -> None:
            where, frame = squares[begin[stroke] : begin[stroke + 1]], self.frame_of[stroke]
            patches = view.look(where) if len(where) else None
            with self.news:
                if patches is not None:
                    self.seen[frame].append((where, patches))
                self.missing[frame] -= 1
                if not self.missing[frame]:
                    self.news.notify()

        return drawn

    def ready(self, number: int) -> bool:
        """Whether all strokes of a frame are drawn."""
        return self.missing[number] == 0

    def put(self, number: int) -> None:
        """Bring the view to the state of a frame. Its patches are of different squares."""
        if self.seen[number]:
            self.view.before[:] = self.view.now
            for squares, patches in self.seen[number]:
                self.view.put(squares, patches)
            self.seen[number] = []

    def under_way(self, number: int) -> tuple[Stroke | None, float]:
        """The stroke that the crayon is at on a frame, and how much of it has been passed."""
        index = int(np.searchsorted(self.frame_of, number, "right")) - 1
        if index < 0:
            return None, 1.0
        begin, end = self.start[index], self.end[index]
        return self.strokes[index], float(min(1.0, (self.times[number] - begin) / (end - begin)))


@kernel
def _due(points, first, reach, frame_of, side, board, due):  # type: ignore[no-untyped-def]
    """Which squares to look at after which stroke, last stroke first, as (stroke, row, col) into due; their number.

    points (n, 3), reach (strokes,) in cells; board: of each square the frame that it has been claimed for, or -1.
    """
    rows, cols = board.shape
    number = 0
    for s in range(first.size - 2, -1, -1):
        for i in range(first[s], first[s + 1]):
            j = max(i - 1, first[s])
            dx, dy = points[i, 0] - points[j, 0], points[i, 1] - points[j, 1]
            parts = 1 + int(max(abs(dx), abs(dy)))
            for p in range(parts):
                t = (p + 1) / parts
                x, y = points[j, 0] + t * dx, points[j, 1] + t * dy
                for ty in range(max(0, int((y - reach[s]) // side)), min(rows - 1, int((y + reach[s]) // side)) + 1):
                    for tx in range(
                        max(0, int((x - reach[s]) // side)), min(cols - 1, int((x + reach[s]) // side)) + 1
                    ):
                        if board[ty, tx] != frame_of[s]:
                            board[ty, tx] = frame_of[s]
                            if number < due.shape[0]:
                                due[number, 0], due[number, 1], due[number, 2] = s, ty, tx
                            number += 1
    return number


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
    """Patches (n, side, side, 3) as means of factor x factor cells of linear light from each corner on, in sRGB."""
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


# ---- colours and the crayon in view ------------------------------------------------------------------------


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
        sheet.used[cell] = len(column)
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
