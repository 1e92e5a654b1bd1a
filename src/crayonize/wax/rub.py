"""Strokes onto a sheet: from a Drawing's millimetres to the wax kernels, on all threads."""

import threading
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stroke_gen.drawing import Stroke
from stroke_gen.jit import lean_kernel

from . import queue as schedule
from .box import Box
from .contact import Table, press, stroke
from .sheet import Sheet
from .strokes import in_cells, ways
from .window import window

Progress = Callable[[int, int], None]
Drawn = Callable[[int], None]
Watch = Callable[[NDArray[np.float32], NDArray[np.int64], NDArray[np.float32]], Drawn]


class Work(NamedTuple):
    """Strokes to be drawn, and what is booked of each."""

    points: NDArray[np.float32]  # (n, 3): x, y in cells, force in N; (n, 5): and the slope
    first: NDArray[np.int64]  # (strokes + 1): where each stroke's points begin
    wax_of: NDArray[np.int64]  # (strokes,): its crayon's number
    tip_of: NDArray[np.int64]  # ... its mask's
    own_of: NDArray[np.int64]  # ... and its own
    loss: NDArray[np.float64]  # (strokes,): wax given
    carried: NDArray[np.float64]  # (strokes, crayons): wax that left on the tip


@lean_kernel
def _draw(queue, done, alone, work, masks, sides, reach, table, w):  # type: ignore[no-untyped-def]
    """Draw strokes as the queue gives them out (see `queue.run`).

    done: a stroke drawn before that the queue is told of; alone: return after one stroke.
    masks (tips, cells): with a border of `reach` ABSENT cells, `sides` long.
    """
    s = schedule.patient_take(queue, done)
    while s >= 0:
        mask, side = masks[work.tip_of[s]], sides[work.tip_of[s]]
        held = press(w, mask, work.wax_of[s], side, reach, table.cols, work.own_of[s])
        points = work.points[work.first[s] : work.first[s + 1]]
        work.loss[s] = stroke(w, held, table, points, work.carried[s])
        if alone:
            break
        s = schedule.patient_take(queue, s)
    return s


def rub(
    sheet: Sheet,
    strokes: Sequence[Stroke],
    box: Box,
    *,
    threads: int = 1,
    smears: bool = True,
    progress: Progress | None = None,
    watch: Watch | None = None,
) -> float:
    """Draw strokes on a sheet in order; returns the wax the crayons gave, in um times cells.

    Some of it leaves on the tips again: `box.carried_mm3`.

    watch: is given the points (n, 3) in cells, where each stroke begins among them, and how far
    each reaches; what it returns is called, in any thread, with the number of the stroke just
    drawn: then the tiles (of queue.TILE cells) within its reach hold this stroke and all before
    it, and no later one.
    """
    if not strokes:
        return 0.0
    points, first = in_cells(strokes, sheet.cell_mm)
    newton_cells, _, heading = ways(points, first)
    place = {name: box.palette.index(name) for name in {s.crayon for s in strokes}}
    wax_of = np.array([place[s.crayon] for s in strokes], np.int64)
    tip_of = box.take(strokes, newton_cells * sheet.cell_mm, heading)
    own_of = np.array([box.own_number(s.crayon) for s in strokes], np.int64)
    masks, sides = box.stacked()
    reach = (sides[tip_of] / 2 + 2).astype(np.float32)
    order = schedule.order(points, first, reach, sheet.rows, sheet.cols)
    drawn = watch(points, first, reach) if watch else None
    loss, carried = np.zeros(len(strokes)), np.zeros((len(strokes), len(sheet.optics)))
    work = Work(points, first, wax_of, tip_of, own_of, loss, carried)
    table, desk = table_of(sheet, box, smears), threading.local()

    def draw(queue: schedule.Queue, done: int) -> int:
        if not hasattr(desk, "window"):
            desk.window = window(masks.shape[1], len(sheet.optics))
        watched = drawn is not None
        last: int = _draw(queue, done, watched, work, masks, sides, box.reach, table, desk.window)
        if drawn and last >= 0:
            drawn(last)
        return last

    def report(done: int) -> None:
        if progress:
            progress(done, len(strokes))

    schedule.run(draw, order, threads, report)
    for one, given, off in zip(strokes, loss, carried, strict=True):
        box.book(one.crayon, float(given), off)
    return float(loss.sum())


def table_of(sheet: Sheet, box: Box, smears: bool) -> Table:
    """What the kernels take beside the crayon in hand."""
    per_lambda = np.float32(1 / (box.constants.lam * sheet.cell_mm**2))
    constants = box.constants.constants(sheet.cell_mm)
    return Table(smears, constants, per_lambda, sheet.rows, sheet.cols, sheet.columns())
