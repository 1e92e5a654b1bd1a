"""Which strokes may be drawn side by side.

Strokes that share no tile of the sheet commute. A stroke waits for the last one before it on each tile it
touches, and for nothing else, so on any number of threads the wax is the same, bit for bit, as if all strokes
were drawn one after another.
"""

import heapq
import threading
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stroke_gen.jit import kernel

TILE = 16  # cells
LEAST_WORK = 6_000.0  # cell-steps: smaller strokes are handed to a thread several at once


@dataclass(frozen=True, eq=False)
class Order:
    """For each stroke how many it waits for, and which wait for it: heirs[first[s] : first[s + 1]]."""

    waits: NDArray[np.int32]
    first: NDArray[np.int64]
    heirs: NDArray[np.int32]


@kernel
def _touch(points, first, reach, s, rows, cols, tile, mark, found):  # type: ignore[no-untyped-def]
    """Numbers of the tiles within `reach` of stroke s's path into `found`; returns how many."""
    tiles_y, tiles_x = mark.shape
    number = 0
    for i in range(first[s], first[s + 1]):
        j = max(i - 1, first[s])
        dx, dy = points[i, 0] - points[j, 0], points[i, 1] - points[j, 1]
        parts = 1 + int(max(abs(dx), abs(dy)) / tile)
        for p in range(parts):
            t = (p + 1) / parts
            x, y = points[j, 0] + t * dx, points[j, 1] + t * dy
            top, bottom = max(0, int((y - reach[s]) // tile)), min(tiles_y - 1, int((y + reach[s]) // tile))
            left, right = max(0, int((x - reach[s]) // tile)), min(tiles_x - 1, int((x + reach[s]) // tile))
            for ty in range(top, bottom + 1):
                for tx in range(left, right + 1):
                    if mark[ty, tx] != s:
                        mark[ty, tx] = s
                        found[number] = ty * tiles_x + tx
                        number += 1
    return number


@kernel
def _order(points, first, reach, rows, cols, tile):  # type: ignore[no-untyped-def]
    """How many strokes each waits for, where its heirs begin, and the heirs."""
    tiles_y, tiles_x = -(-rows // tile), -(-cols // tile)
    mark = np.full((tiles_y, tiles_x), -1, np.int32)
    found = np.empty(tiles_y * tiles_x, np.int32)
    last = np.full(tiles_y * tiles_x, -1, np.int32)
    strokes = first.size - 1
    heir = np.full(strokes, -1, np.int32)  # the latest stroke known to wait for each
    waits, begins = np.zeros(strokes, np.int32), np.zeros(strokes + 1, np.int64)
    pairs, known = np.empty((8 * strokes, 2), np.int32), 0  # one waited for, and one that waits
    for s in range(strokes):
        for n in range(_touch(points, first, reach, s, rows, cols, tile, mark, found)):
            before = last[found[n]]
            last[found[n]] = s
            if before >= 0 and heir[before] != s:
                heir[before] = s
                waits[s] += 1
                begins[before + 1] += 1
                if known == len(pairs):
                    pairs = np.concatenate((pairs, np.empty_like(pairs)))
                pairs[known, 0], pairs[known, 1] = before, s
                known += 1
    for s in range(strokes):
        begins[s + 1] += begins[s]
    heirs, filled = np.empty(known, np.int32), begins.copy()
    for i in range(known):
        before = pairs[i, 0]
        heirs[filled[before]] = pairs[i, 1]
        filled[before] += 1
    return waits, begins, heirs


def order(
    points: NDArray[np.float32], first: NDArray[np.int64], reach: NDArray[np.float32], rows: int, cols: int
) -> Order:
    """What each stroke waits for; `points` (n, 3) in cells, `reach` (strokes,) how far its tip can change cells.

    A path between two points is sampled once a tile, so `reach` is widened by half a tile.
    """
    return Order(*_order(points, first, (reach + TILE // 2).astype(np.float32), rows, cols, TILE))


class _Crew:
    """Threads that draw what is ready, earliest stroke first."""

    def __init__(self, draw: Callable[[NDArray[np.int64]], None], plan: Order, cost: NDArray[np.float64]) -> None:
        self.draw, self.cost = draw, cost.tolist()
        self.waits, self.first, self.heirs = plan.waits.tolist(), plan.first.tolist(), plan.heirs.tolist()
        self.ready = [s for s, count in enumerate(self.waits) if count == 0]
        self.left = len(self.waits)
        self.failure: BaseException | None = None
        self.change = threading.Condition()
        self.over = threading.Event()

    def work(self) -> None:
        """What each thread does until nothing is left."""
        while picked := self._pick():
            try:
                self.draw(np.array(picked, np.int64))
            except BaseException as error:
                self.failure = error
            self._release(picked)
        self.over.set()

    def _pick(self) -> list[int]:
        """Strokes to draw next: one, or several small ones; none when all is done or something failed."""
        with self.change:
            while not self.ready and self.left and not self.failure:
                self.change.wait()
            if not self.left or self.failure:
                return []
            picked = [heapq.heappop(self.ready)]
            work = self.cost[picked[0]]
            while self.ready and work + self.cost[self.ready[0]] < LEAST_WORK:
                picked.append(heapq.heappop(self.ready))
                work += self.cost[picked[-1]]
            return picked

    def _release(self, picked: list[int]) -> None:
        """Let those go that have waited for strokes just drawn, and call no more threads than they can use."""
        with self.change:
            for s in picked:
                for heir in self.heirs[self.first[s] : self.first[s + 1]]:
                    self.waits[heir] -= 1
                    if self.waits[heir] == 0:
                        heapq.heappush(self.ready, heir)
            self.left -= len(picked)
            if self.left and not self.failure:
                self.change.notify(len(self.ready) - 1)  # this one goes on itself
            else:
                self.change.notify_all()


def run(
    draw: Callable[[NDArray[np.int64]], None],
    plan: Order,
    cost: NDArray[np.float64],
    threads: int,
    progress: Callable[[int], None] = lambda done: None,
) -> None:
    """Call `draw` with lists of strokes on `threads` threads, each stroke after those it waits for.

    cost (strokes,): work in cell-steps; progress: called in this thread with the number of strokes done.
    """
    crew = _Crew(draw, plan, cost)
    hands = [threading.Thread(target=crew.work, daemon=True) for _ in range(threads)]
    for hand in hands:
        hand.start()
    try:
        while not crew.over.wait(0.1):
            progress(len(crew.waits) - crew.left)
    except BaseException as error:
        with crew.change:
            crew.failure = error
            crew.change.notify_all()
    for hand in hands:
        hand.join()
    if crew.failure:
        raise crew.failure
    progress(len(crew.waits))
