"""Which strokes may be drawn side by side.

Strokes that share no tile of the sheet commute. A stroke waits for the last one before it on each
tile it touches, and for nothing else, so on any number of threads the wax is the same, bit for bit,
as if all strokes were drawn one after another.
"""

import threading
import time
from collections.abc import Callable
from typing import Any, NamedTuple, cast

import numpy as np
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, overload
from numpy.typing import NDArray

from stroke_gen.jit import kernel, lean_kernel

TILE = 16  # cells
NONE, OVER = -1, -2  # in place of a stroke's number: none is ready yet, none will be
READY, LEFT, STOP = range(3)  # what a queue's `state` holds
AWAY = 32  # place beside the lock that is no neighbour to the processor: to pass the time with
PATIENCE = 100  # times a thread asks for a stroke before it sleeps ...
PAUSE_S = 5e-5  # ... for so long


class Order(NamedTuple):
    """For each stroke how many it waits for, and which wait for it: heirs[first[s] : first[s +
    1]].
    """

    waits: NDArray[np.int32]
    first: NDArray[np.int64]
    heirs: NDArray[np.int32]


@kernel
def _touch(points, first, reach, s, tile, mark, found):  # type: ignore[no-untyped-def]
    """Numbers of the tiles within `reach` of stroke s's path into `found`; returns how many.

    The path is sampled once a tile, so samples must reach half a tile further than the tip.
    """
    tiles_y, tiles_x = mark.shape
    number, at = 0, first[s]  # the latest sample
    for i in range(first[s], first[s + 1]):
        j = max(i - 1, first[s])
        far = max(abs(points[i, 0] - points[at, 0]), abs(points[i, 1] - points[at, 1]))
        if i > first[s] and far <= tile / 2:
            # the way here from the sample, and so all between, lies within what the sample reaches
            continue
        dx, dy = points[i, 0] - points[j, 0], points[i, 1] - points[j, 1]
        parts = 1 + int(max(abs(dx), abs(dy)) / tile)
        at = i
        for p in range(parts + 1):
            t = p / parts
            x, y = points[j, 0] + t * dx, points[j, 1] + t * dy
            top, bottom = (
                max(0, int((y - reach[s]) // tile)),
                min(tiles_y - 1, int((y + reach[s]) // tile)),
            )
            left, right = (
                max(0, int((x - reach[s]) // tile)),
                min(tiles_x - 1, int((x + reach[s]) // tile)),
            )
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
        for n in range(_touch(points, first, reach, s, tile, mark, found)):
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
    points: NDArray[np.float32],
    first: NDArray[np.int64],
    reach: NDArray[np.float32],
    rows: int,
    cols: int,
) -> Order:
    """What each stroke waits for; `points` (n, 3) in cells, `reach` (strokes,) how far its tip can
    change cells.

    A path between two points is sampled once a tile, so `reach` is widened by half a tile.
    """
    return Order(*_order(points, first, (reach + TILE // 2).astype(np.float32), rows, cols, TILE))


# ---- at work -------------------------------------------------------------------------------------


class Queue(NamedTuple):
    """An order being worked off: what is ready lies in a heap, the earliest stroke on top."""

    waits: NDArray[np.int32]  # for how many strokes each still waits
    first: NDArray[np.int64]  # as in the order
    heirs: NDArray[np.int32]
    ready: NDArray[np.int32]  # the heap
    # how many are ready, how many are not yet drawn, whether to stop before the end
    state: NDArray[np.int64]
    lock: NDArray[np.int32]  # its first is 1 while a thread changes any of this


def queue(plan: Order) -> Queue:
    """An order of which nothing is drawn yet."""
    ready = np.flatnonzero(plan.waits == 0).astype(np.int32)  # sorted, which is a heap
    heap = np.concatenate([ready, np.zeros(len(plan.waits) - len(ready), np.int32)])
    state = np.array([len(ready), len(plan.waits), 0])
    return Queue(
        plan.waits.copy(), plan.first, plan.heirs, heap, state, np.zeros(2 * AWAY, np.int32)
    )


def exchange(array: NDArray[np.int32], index: int, value: int) -> int:
    """Put a value into an array and return what was there, in one step that no other thread can
    divide.

    Here as Python does it, without a compiler for one thread alone; kernels have the machine's
    instruction.
    """
    before, array[index] = array[index], value
    return int(before)


@intrinsic
def _exchange(typing: Any, array: Any, index: Any, value: Any) -> Any:
    def code(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        kind, pointer = signature.args[0], cast(Any, cgutils.get_item_pointer)
        place = pointer(
            context, builder, kind, context.make_array(kind)(context, builder, given[0]), [given[1]]
        )
        return builder.atomic_rmw("xchg", place, given[2], "seq_cst")

    return array.dtype(array, types.intp, array.dtype), code


@overload(exchange)
def _exchange_for(array, index, value):  # type: ignore[no-untyped-def]
    compiled: Any = _exchange
    return lambda array, index, value: compiled(array, index, value)


@lean_kernel
def take(queue, done):  # type: ignore[no-untyped-def]
    """The earliest stroke that is ready, or NONE or OVER; those that waited for `done` alone become
    so before.

    done: a stroke taken earlier, or NONE or OVER.
    """
    while exchange(queue.lock, 0, 1):
        pass
    if done >= 0:
        queue.state[LEFT] -= 1
        for h in range(queue.first[done], queue.first[done + 1]):
            heir = queue.heirs[h]
            queue.waits[heir] -= 1
            if queue.waits[heir] == 0:
                _push(queue.ready, queue.state[READY], heir)
                queue.state[READY] += 1
    taken = NONE
    if queue.state[STOP] or not queue.state[LEFT]:
        taken = OVER
    elif queue.state[READY]:
        queue.state[READY] -= 1
        taken = _pop(queue.ready, queue.state[READY])
    exchange(queue.lock, 0, 0)
    return taken


@lean_kernel
def _push(heap, size, value):  # type: ignore[no-untyped-def]
    """Add a value to a heap of `size`."""
    at = size
    while at and heap[(at - 1) // 2] > value:
        heap[at] = heap[(at - 1) // 2]
        at = (at - 1) // 2
    heap[at] = value


@lean_kernel
def _pop(heap, size):  # type: ignore[no-untyped-def]
    """Take the least value off a heap, which then holds `size`."""
    least, value, at = heap[0], heap[size], 0
    while 2 * at + 1 < size:
        child = 2 * at + 1
        if child + 1 < size and heap[child + 1] < heap[child]:
            child += 1
        if heap[child] >= value:
            break
        heap[at] = heap[child]
        at = child
    heap[at] = value
    return np.int64(least)


@lean_kernel
def patient_take(queue, done):  # type: ignore[no-untyped-def]
    """As `take`, but asks many times before it returns NONE: what is ready next mostly is so within
    microseconds.
    """
    taken = take(queue, done)
    for _ in range(PATIENCE):
        if taken != NONE:
            break
        for _ in range(50):
            exchange(queue.lock, AWAY, 0)
        taken = take(queue, NONE)
    return taken


def run(
    draw: Callable[[Queue, int], int],
    plan: Order,
    threads: int,
    progress: Callable[[int], None] = lambda done: None,
) -> None:
    """Have strokes drawn on `threads` threads, each stroke after those it waits for.

    draw(queue, done): tells the queue that `done` is drawn, and takes from it and draws one stroke
    or many; returns the last one if the queue does not yet know that it is drawn, else NONE or
    OVER.
    progress: called in this thread with the number of strokes done.
    """
    work, failures = queue(plan), list[BaseException]()
    strokes = len(plan.waits)

    def hand() -> None:
        done = NONE
        try:
            while (done := draw(work, done)) != OVER:
                if done == NONE:
                    time.sleep(PAUSE_S)
        except BaseException as error:
            failures.append(error)
            work.state[STOP] = 1

    hands = [threading.Thread(target=hand, daemon=True) for _ in range(threads)]
    for each in hands:
        each.start()
    try:
        for each in hands:
            while each.is_alive():
                each.join(0.1)
                progress(strokes - int(work.state[LEFT]))
    except BaseException as error:
        failures.append(error)
        work.state[STOP] = 1
        for each in hands:
            each.join()
    if failures:
        raise failures[0]
    progress(strokes)
