"""A stroke, contact after contact: what happens on the sheet under a crayon that is drawn along
(Fig. 3).

Kernels here get all memory from outside (`window`) and know nothing of other strokes.
"""

from typing import NamedTuple

import numpy as np

from stroke_gen.jit import inner_kernel, lean_kernel

from .columns import Columns
from .deposit import break_off, lay_ready
from .force import balance, overlap
from .grains import scratch
from .load import carry_off, drop, give_back, luck
from .physics import Constants
from .smear import settle, smear, weigh
from .window import (
    AHEAD,
    CARRIED,
    CONTACTS,
    DITHER_X,
    DITHER_Y,
    GRITTY,
    HEIGHT,
    LEAN_X,
    LEAN_Y,
    OWN,
    PRESENT,
    REGAINED,
    SPREAD_XX,
    SPREAD_XY,
    SPREAD_YY,
    WALKED,
    WORN,
    look,
    open_slot,
)

# how far a dab slides, in extents of its tip: the least that leaves a mark in every tooth
DAB = np.float32(0.04)
# of the force, where that is finer than epsilon: light touches must not be rounded off
ACCURACY = np.float32(0.01)
# powers of 1 / 1.3247 (Roberts' R2): offsets that fill a cell evenly
TURN_X, TURN_Y = 0.7548776662, 0.5698402910


class Table(NamedTuple):
    """What lies on the table beside the crayon: the sheet, and the constants that hold on it."""

    smears: bool
    constants: Constants
    per_lambda: np.float32  # overlap in um times cells for each newton
    rows: int
    cols: int
    columns: Columns


class Held(NamedTuple):
    """The crayon in hand."""

    wax: np.uint8  # its number in the box
    side: int  # of its window, in cells
    reach: int  # border of the window that only smeared wax goes to
    present: int  # cells of the tip


@lean_kernel
def press(w, mask, wax, side, reach, cols, own):  # type: ignore[no-untyped-def]
    """Put a tip on a sheet `cols` cells wide: the beginning of a stroke; returns the crayon as it
    is held.

    own: the stroke's number, from which all that happens by chance follows.
    """
    present, mx, my, xx, xy, yy = 0, 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(side):
        for i in range(side):
            at = j * side + i
            w.where[at] = j * cols + i
            w.mask[at] = mask[at]
            w.loaded[at] = w.lost[at] = 0
            if mask[at] < PRESENT:
                present += 1
                mx, my, xx, xy, yy = mx + i, my + j, xx + i * i, xy + i * j, yy + j * j
    w.hand[:] = 0.5
    w.hand[HEIGHT] = 1e9  # lifted: from far below, float32 would miss the paper
    w.hand[WALKED] = w.hand[CONTACTS] = w.hand[CARRIED] = w.hand[GRITTY] = w.hand[WORN] = 0
    w.hand[OWN] = own
    w.hand[LEAN_X] = w.hand[LEAN_Y] = 0
    mx, my = mx / present, my / present
    w.hand[SPREAD_XX] = xx / present - mx * mx
    w.hand[SPREAD_XY] = xy / present - mx * my
    w.hand[SPREAD_YY] = yy / present - my * my
    return Held(np.uint8(wax), side, reach, present)


@inner_kernel
def _extent(w, vx, vy):  # type: ignore[no-untyped-def]
    """How long the tip is along its way, in cells: four standard deviations, which is a disc's
    diameter.
    """
    spread = (
        vx * vx * w.hand[SPREAD_XX] + 2 * vx * vy * w.hand[SPREAD_XY] + vy * vy * w.hand[SPREAD_YY]
    )
    return np.float32(max(1.0, 4 * np.sqrt(max(spread, 0.0))))


@inner_kernel
def _hop(contact, mean, scatter):  # type: ignore[no-untyped-def]
    """How many cells smeared wax goes at a contact: `mean`, by chance up to `scatter` more or less.

    Wax that always went equally far would part the cells into lattices; a pattern would show as a
    ladder.
    """
    chance = scatter * (np.float32(2) * luck(contact) - np.float32(1))
    return max(1, int(np.floor(mean + np.float32(0.5) + chance)))


@inner_kernel
def _grip(own, along):  # type: ignore[no-untyped-def]
    """How much harder (to 1) or lighter (to -1) the crayon presses than the hand, as it sticks and
    slips.

    along: the way so far, in lengths over which that changes.   own: differs from stroke to stroke.
    """
    step = np.int64(along)
    part = np.float32(along - step)
    chance = (np.float32(1) - part) * luck(own + step) + part * luck(own + step + 1)
    return np.float32(2) * chance - np.float32(1)


@inner_kernel
def _lean(w, side, slope_x, slope_y):  # type: ignore[no-untyped-def]
    """Lower the tip by so many um from cell to cell, to the side to which the crayon leans."""
    for j in range(side):
        below = slope_y * np.float32(j - side // 2)
        for i in range(side):
            w.over[j * side + i] += below + slope_x * np.float32(i - side // 2)


@lean_kernel
def touch(w, held, table, x, y, force, vx, vy, stride):  # type: ignore[no-untyped-def]
    """One contact, for `stride` cells of the way: adjust the height, smear, deposit; returns the
    wax given.
    """
    one, c, side = np.float32(1), table.constants, held.side
    contact = np.int64(w.hand[CONTACTS])
    w.hand[CONTACTS] += 1

    if force <= 0:
        return np.float32(0)

    # Rounding to whole cells by an even sequence of offsets leaves no stair steps.
    left = int(np.floor(x - 0.5 + w.hand[DITHER_X])) - side // 2
    top = int(np.floor(y - 0.5 + w.hand[DITHER_Y])) - side // 2
    w.hand[DITHER_X] = (w.hand[DITHER_X] + TURN_X) % 1.0
    w.hand[DITHER_Y] = (w.hand[DITHER_Y] + TURN_Y) % 1.0
    inside = look(w, side, held.present, top, left, table.rows, table.cols, c.firm, table.columns)
    if inside <= 0:
        return np.float32(0)

    if w.hand[LEAN_X] != 0 or w.hand[LEAN_Y] != 0:
        _lean(w, side, c.lean * np.float32(w.hand[LEAN_X]), c.lean * np.float32(w.hand[LEAN_Y]))

    # The tip sinks until the paper bears the force, but for what the wax itself does not bear.
    grip = one + c.slip * _grip(np.int64(w.hand[OWN]), contact * stride / c.slip_cells)
    wanted = min(force * grip * table.per_lambda, c.most * held.present) * inside
    cells = side * side
    h = balance(
        w.over[:cells], wanted, np.float32(w.hand[HEIGHT]), min(c.epsilon, ACCURACY * wanted)
    )
    w.hand[HEIGHT] = h
    overlap(w.over[:cells], h)

    # Wax that stands in its way is pushed aside, then more is rubbed off, and all of it laid on.
    home, slots = top * table.cols + left, 1
    w.hand[REGAINED] = 0
    open_slot(w, cells, 0, held.wax, 0)
    w.end[0] = cells
    if table.smears:
        hop = _hop(contact, c.hop, c.scatter)
        weigh(w, side, hop, vx, vy, c.alpha, c.beta)
        slots = smear(w, side, hop, home, one - (one - c.nu) ** stride, c, table.columns)
    break_off(w, side, held.reach, vx, vy, c.push if c.push > 0 else force, stride, c)
    if w.hand[CARRIED] > 0:
        slots = give_back(w, side, held.reach, slots, c.covers)
        slots = drop(w, side, held.reach, held.present, stride, slots, c)
    given = lay_ready(w, side, held.reach, c) - w.hand[REGAINED]
    settle(w, slots, home, c.thin, table.columns)
    if c.grains > 0:
        along, across = _extent(w, vx, vy), _extent(w, -vy, vx)
        given += scratch(w, held, table, x, y, vx, vy, stride, along, across)
    return given


@lean_kernel
def move(w, held, table, a, b):  # type: ignore[no-untyped-def]
    """Draw on from point a to point b, each x, y in cells and force in N, and maybe the crayon's
    slope; returns the wax given.

    There is a contact every so many cells: a share `step` of the tip's extent along the way, at
    least one.
    """
    dx, dy = b[0] - a[0], b[1] - a[1]
    length = np.hypot(dx, dy)
    if length == 0:
        return 0.0
    vx, vy = dx / length, dy / length
    stride = max(np.float32(1), table.constants.step * _extent(w, vx, vy))
    w.hand[LEAN_X] = w.hand[LEAN_Y] = 0
    given, ahead = 0.0, np.float32(w.hand[AHEAD]) * stride
    while ahead < length:
        t = ahead / length
        force = a[2] + t * (b[2] - a[2])
        if a.size > 3:
            w.hand[LEAN_X] = a[3] + t * (b[3] - a[3])
            w.hand[LEAN_Y] = a[4] + t * (b[4] - a[4])
        given += touch(w, held, table, a[0] + t * dx, a[1] + t * dy, force, vx, vy, stride)
        ahead += stride
    w.hand[AHEAD] = (ahead - length) / stride
    w.hand[WALKED] += length
    return given


@lean_kernel
def lift(w, held, table, b, carried):  # type: ignore[no-untyped-def]
    """End a stroke at point b; one so short that nothing touched becomes a dab.

    Returns the wax given; carried: by crayon, is added the wax that leaves with the tip.
    """
    given = 0.0
    if w.hand[CONTACTS] == 0:
        across, still = np.float32(1), np.float32(0)
        if b.size > 3:
            w.hand[LEAN_X], w.hand[LEAN_Y] = b[3], b[4]
        slides = max(np.float32(w.hand[WALKED]), DAB * _extent(w, across, still))
        given += touch(w, held, table, b[0], b[1], b[2], across, still, slides)
    carry_off(w, held.side, carried)
    return given


@lean_kernel
def stroke(w, held, table, points, carried):  # type: ignore[no-untyped-def]
    """A stroke over points (n, 3 or 5) from press to lift.

    Returns the wax given, in um times cells; carried: by crayon, is added what leaves with the tip.
    """
    given = 0.0
    for i in range(1, len(points)):
        given += move(w, held, table, points[i - 1], points[i])
    return given + lift(w, held, table, points[len(points) - 1], carried)
