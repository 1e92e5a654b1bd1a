"""A film of a drawing being drawn: bare paper first, then stroke by stroke at a hand's pace,
compressed.

The frames come from the one simulation. Strokes are drawn side by side, but a tile of the sheet
sees them in order: right after the last stroke of a frame that touches a tile, the tile is
rendered, reduced to the size of the film and put aside for that frame. The drawing is not held up,
and stays the same, bit for bit.

A stroke that has only begun when a frame is due is drawn whole by the simulation; the film shows
the part that the crayon has passed.
"""

import itertools
import os
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from stroke_gen.drawing import Note, Stroke
from stroke_gen.jit import kernel

from ..wax import rub
from . import writers
from .view import Floats, Frame, View, along, colours, draw_crayon

if TYPE_CHECKING:
    from ..pipeline import Easel

FIRST, LAST = 0.4, 1.5  # seconds for which the bare sheet and the finished drawing stand
FILL_MM_S, LINE_MM_S = 200.0, 60.0  # how fast a hand fills a plane, and draws a line
LINES = (Note.LINE, Note.DETAIL, Note.OUTLINE)  # notes of strokes that are drawn slowly
LIFT_S, DAB_S = 0.25, 0.1  # time from stroke to stroke, and for a dab


class Timelapse:
    """Looks on while an Easel is drawn on, and films it; a context manager, whose end completes the
    file.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        seconds: float = 12.0,
        show_tip: bool = False,
        light: bool = True,
    ) -> None:
        """path: .webp, .gif, .png, .apng or .mp4.

        light: shade the relief. ValueError for what cannot be written.
        """
        if not 3 <= seconds <= 600:
            raise ValueError(f"seconds: {seconds:g} is not between 3 and 600")
        writers.check(path)
        self.path, self.show_tip, self.shaded = path, show_tip, light
        # frames on which something is drawn
        self.steps = round((seconds - FIRST - LAST) * writers.FPS)
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
        self._view = View(easel, self.shaded)
        rows, cols = self._view.now.shape[:2]
        first, last = round(FIRST * writers.FPS), round(LAST * writers.FPS)
        reel = writers.Reel(cols, rows, self.steps + 2, first, last, colours(easel))
        self._written = self._pool.submit(writers.write, self.path, reel, self._frames())

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
        """All frames in order, each as soon as its strokes are drawn; runs in the writer's
        thread.
        """
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
            raise writers.Aborted

    def _frame(self, scene: "_Scene", number: int) -> Frame:
        stroke, passed = scene.under_way(number)
        frame = self._view.frame(stroke, passed)
        if stroke and self.show_tip:
            where = along(stroke.path_mm, passed)[-1] * self._view.pixels_per_mm
            draw_crayon(frame, where, self._view.colours[stroke.crayon])
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


@dataclass
class _Scene:
    """Strokes that are drawn at one go, and the frames they are shown on."""

    view: View
    strokes: Sequence[Stroke]
    frames: int
    news: threading.Condition
    # strokes of each frame that are not yet drawn, and of those after all
    missing: list[int] = field(init=False)

    def __post_init__(self) -> None:
        self.start, self.end = pace(self.strokes)
        all_s = float(self.end[-1]) if len(self.strokes) else 0.0
        self.times = (np.arange(self.frames) + 1) / max(self.frames, 1) * all_s
        self.frame_of = np.searchsorted(self.times, self.start)
        self.missing = np.bincount(self.frame_of, minlength=self.frames + 1).tolist()
        self.seen: list[list[tuple[NDArray[np.int64], Frame]]] = [[] for _ in self.missing]

    def watch(self, points: Floats, first: NDArray[np.int64], reach: Floats) -> rub.Drawn:
        """Plan which squares to look at after which stroke: after the last of a frame that touches
        them.
        """
        view = self.view
        counted = _due(
            points,
            first,
            reach,
            self.frame_of,
            view.cells,
            view.board(),
            np.empty((0, 3), np.int64),
        )
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
    """Which squares to look at after which stroke, last stroke first, as (stroke, row, col) into
    due; their number.

    points (n, 3), reach (strokes,) in cells; board: of each square the frame that it has been
    claimed for, or -1.
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
                for ty in range(
                    max(0, int((y - reach[s]) // side)),
                    min(rows - 1, int((y + reach[s]) // side)) + 1,
                ):
                    for tx in range(
                        max(0, int((x - reach[s]) // side)),
                        min(cols - 1, int((x + reach[s]) // side)) + 1,
                    ):
                        if board[ty, tx] != frame_of[s]:
                            board[ty, tx] = frame_of[s]
                            if number < due.shape[0]:
                                due[number, 0], due[number, 1], due[number, 2] = s, ty, tx
                            number += 1
    return number
