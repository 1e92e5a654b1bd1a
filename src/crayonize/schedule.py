"""Which strokes may be drawn side by side.

Strokes that share no tile of the sheet commute. A stroke's level is one more than the highest level on
the tiles it touches, so strokes of one level may run on any threads at once and the wax is the same, bit
for bit, as if all were drawn in order.
"""

import numpy as np
from numpy.typing import NDArray

from stroke_gen.jit import kernel

TILE = 32  # cells


@kernel
def _levels(points, first, reach, tiles_y, tiles_x, tile, level):  # type: ignore[no-untyped-def]
    """Level of each stroke, from the highest level on the tiles within `reach` of its path."""
    board = np.zeros((tiles_y, tiles_x), np.int32)
    seen = np.full((tiles_y, tiles_x), -1, np.int32)
    mine = np.empty(tiles_y * tiles_x, np.int32)
    for s in range(first.size - 1):
        number, highest = 0, 0
        for i in range(first[s], first[s + 1]):
            j = max(i - 1, first[s])
            dx, dy = points[i, 0] - points[j, 0], points[i, 1] - points[j, 1]
            parts = 1 + int(max(abs(dx), abs(dy)) / tile)
            for p in range(parts):
                t = (p + 1) / parts
                x, y = points[j, 0] + t * dx, points[j, 1] + t * dy
                top, left = max(0, int((y - reach[s]) // tile)), max(0, int((x - reach[s]) // tile))
                for ty in range(top, min(tiles_y - 1, int((y + reach[s]) // tile)) + 1):
                    for tx in range(left, min(tiles_x - 1, int((x + reach[s]) // tile)) + 1):
                        if seen[ty, tx] != s:
                            seen[ty, tx] = s
                            mine[number] = ty * tiles_x + tx
                            number += 1
                            highest = max(highest, board[ty, tx])
        level[s] = highest
        for m in range(number):
            board[mine[m] // tiles_x, mine[m] % tiles_x] = highest + 1


def levels(
    points: NDArray[np.float32], first: NDArray[np.int64], reach: NDArray[np.float32], rows: int, cols: int
) -> NDArray[np.int32]:
    """Level of each stroke; `points` (n, 3) in cells, `reach` (strokes,) how far its tip can change cells.

    A path between two points is sampled once a tile, so `reach` is widened by half a tile.
    """
    level = np.empty(first.size - 1, np.int32)
    widened = (reach + TILE // 2).astype(np.float32)
    _levels(points, first, widened, -(-rows // TILE), -(-cols // TILE), TILE, level)
    return level


def shares(members: NDArray[np.int64], cost: NDArray[np.float64], threads: int) -> list[NDArray[np.int64]]:
    """Split one level's strokes into at most `threads` lists of about equal cost (longest first)."""
    if threads == 1 or members.size == 1:
        return [members]
    order = members[np.argsort(-cost[members], kind="stable")]
    load = [0.0] * threads
    lists: list[list[int]] = [[] for _ in range(threads)]
    for stroke in order:
        lightest = load.index(min(load))
        lists[lightest].append(int(stroke))
        load[lightest] += float(cost[stroke])
    return [np.array(part, np.int64) for part in lists if part]
