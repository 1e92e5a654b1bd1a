"""Hard grains in the wax: each scratches a soft-edged track for a while and leaves a speck.

They come out of the tip by chance, so many to the area drawn over, and are lost by chance. Only
those at the trailing half of its rim are seen: what others scratch, the tip covers again.
"""

import numpy as np

from stroke_gen.jit import inner_kernel, lean_kernel

from .columns import BLEND, LAYERS, add, whole
from .load import luck
from .window import CONTACTS, GRAINS, GRITTY, OWN

# What `grain` holds of each: where it stands across the way, -1 to 1 of the tip's breadth; how deep
# it goes, as a share of the film; and how far it still goes, in cells.
ASIDE, DEPTH, LEFT, KEPT = range(4)
RIM = 0.42  # of the tip's extent: where grains stand
ENDS = 2.5  # a track's half breadth, and how far its wax is pushed aside, in its deviations


@lean_kernel
def scratch(w, held, table, x, y, vx, vy, stride, along, across):  # type: ignore[no-untyped-def]
    """Scratch over the last `stride` cells of the way to x, y; returns the wax left in specks.

    along, across: extents of the tip in cells.
    """
    c = table.constants
    number = 32452843 * np.int64(w.hand[CONTACTS]) + np.int64(w.hand[OWN])
    given, g = np.float32(0), 0
    while g < np.int64(w.hand[GRITTY]):
        aside = w.grain[KEPT * g + ASIDE]
        back = np.sqrt(1 - aside * aside)
        gx = x - RIM * (back * along * vx + aside * across * vy)
        gy = y - RIM * (back * along * vy - aside * across * vx)
        w.grain[KEPT * g + LEFT] -= stride
        if w.grain[KEPT * g + LEFT] > 0:
            _track(held, table, x, y, gx, gy, vx, vy, stride, w.grain[KEPT * g + DEPTH])
            g += 1
        else:
            given += _speck(held, table, x, y, gx, gy)
            w.hand[GRITTY] -= 1
            last = KEPT * np.int64(w.hand[GRITTY])
            for v in range(KEPT):
                w.grain[KEPT * g + v] = w.grain[last + v]
    if g < GRAINS and luck(number) < c.grains * across * stride:
        w.grain[KEPT * g + ASIDE] = 1.8 * luck(number + 1) - 0.9
        w.grain[KEPT * g + DEPTH] = 0.7 - 0.4 * luck(number + 2)
        w.grain[KEPT * g + LEFT] = -c.lasts * np.log(1 - luck(number + 3))
        w.hand[GRITTY] += 1
    return given


@inner_kernel
def _within(held, table, x, y, i, j):  # type: ignore[no-untyped-def]
    """Whether cell i, j lies on the sheet and under the tip's window around x, y."""
    far = held.side // 2
    near = abs(i - int(x)) <= far and abs(j - int(y)) <= far
    return near and 0 <= i < table.cols and 0 <= j < table.rows


@lean_kernel
def _track(held, table, x, y, gx, gy, vx, vy, stride, depth):  # type: ignore[no-untyped-def]
    """Push wax to both sides all along the way of a grain that is now at gx, gy."""
    breadth = table.constants.track
    wide = ENDS * breadth
    far = stride + wide + 1
    for j in range(int(gy - far), int(gy + far) + 1):
        for i in range(int(gx - far), int(gx + far) + 1):
            dx, dy = i + 0.5 - gx, j + 0.5 - gy
            t, d = dx * vx + dy * vy, dy * vx - dx * vy
            if not -stride < t <= 0 or abs(d) > wide or not _within(held, table, x, y, i, j):
                continue
            push = wide if d >= 0 else -wide
            to_i, to_j = int(np.floor(i + 0.5 - push * vy)), int(np.floor(j + 0.5 + push * vx))
            if not _within(held, table, x, y, to_i, to_j) or (to_i == i and to_j == j):
                continue
            cell, to = j * table.cols + i, to_j * table.cols + to_i
            share = depth * np.exp(-0.5 * d * d / (breadth * breadth))
            _shift(table, cell, to, np.float32(share * table.columns.total[cell]))


@lean_kernel
def _shift(table, cell, to, left):  # type: ignore[no-untyped-def]
    """Move the topmost `left` um of one column onto another: pure layers, and of the blend what is
    missing.
    """
    columns, thin = table.columns, table.constants.thin
    moved = left
    while left > 0 and columns.used[cell]:
        top = whole(cell * LAYERS + columns.used[cell] - 1)
        part = min(left, columns.layer[top])
        add(whole(to), columns.crayon[top], part, thin, columns)
        columns.layer[top] -= part
        columns.used[cell] -= columns.layer[top] <= 0
        left -= part
    held = columns.blend[cell * BLEND]
    if left > 0 and held > thin:
        share = min(left / held, np.float32(1))
        for c in range(BLEND):
            part = share * columns.blend[cell * BLEND + c]
            columns.blend[cell * BLEND + c] -= part
            columns.blend[to * BLEND + c] += part
        columns.total[to] += share * held
        left -= share * held
    columns.total[cell] -= moved - left


@lean_kernel
def _speck(held, table, x, y, gx, gy):  # type: ignore[no-untyped-def]
    """A crumb of the crayon's own wax, where a grain was lost; returns its volume, um times
    cells.
    """
    c = table.constants
    breadth, given = np.float32(1.5) * c.track, np.float32(0)
    far = ENDS * breadth
    for j in range(int(gy - far), int(gy + far) + 1):
        for i in range(int(gx - far), int(gx + far) + 1):
            dx, dy = i + 0.5 - gx, j + 0.5 - gy
            d = (dx * dx + dy * dy) / (breadth * breadth)
            if d < ENDS * ENDS and _within(held, table, x, y, i, j):
                height = np.float32(c.speck * np.exp(-0.5 * d))
                add(whole(j * table.cols + i), held.wax, height, c.thin, table.columns)
                given += height
    return given
