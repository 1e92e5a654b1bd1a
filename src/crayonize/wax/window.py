"""The cells under a crayon: a thread's work space, and how a contact looks at the sheet through it.

A window is a square of cells, kept row by row in flat arrays, in which the neighbour on one side of
every cell lies equally far on. So weighing, flowing and rubbing off are plain loops over arrays,
which the compiler turns into vector instructions; only taking wax off columns and laying it on goes
cell by cell.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stroke_gen.jit import inner_kernel, lean_kernel

from .columns import BLEND, whole

NONE = 255  # no slot
PRESENT = np.float32(1e8)  # um; cells of a tip's mask that stand higher are no part of it

LOADS = 4  # crayons whose wax a tip carries at most
GRAINS = 6  # hard grains that stand out of a tip at most

# What `hand` holds: height of the tip (um), offsets (cells), strides to the next contact, cells
# walked, contacts so far, the stroke's own number, how many crayons' wax sticks to the tip, what it
# regained of its own at this contact (um), how many grains stand out of it, contacts since it was
# worn down, the crayon's slope along x and y, and how its tip spreads about its middle (cells^2).
HEIGHT, DITHER_X, DITHER_Y, AHEAD, WALKED, CONTACTS, OWN, CARRIED, REGAINED, GRITTY = range(10)
WORN, LEAN_X, LEAN_Y, SPREAD_XX, SPREAD_XY, SPREAD_YY = range(10, 16)

Floats = NDArray[np.float32]


class Window(NamedTuple):
    """A thread's work space. Up to `arriving` it holds values for each cell of the window, row by
    row.

    Wax on its way is sorted by crayon: each crayon met at a contact gets a slot, the one in hand
        slot 0.
    """

    where: NDArray[np.uint32]  # number of the cell on the sheet, less that of the window's first
    touch: NDArray[np.uint32]  # a list of cells
    mask: Floats  # height of the tip, um
    surface: Floats  # what it meets: paper and the firm share of the wax; very high off the sheet
    before: Floats  # wax at the beginning of the contact, um
    film: Floats  # wax now
    over: Floats  # surface less mask, and then the overlap of both; 0 without contact
    weights: Floats  # sum of Eq. 4 over the neighbours
    weight: Floats  # Eq. 4, for one neighbour after the other
    broken: Floats  # what breaks off
    lost: Floats  # what broke off since the tip was worn down
    lowered: Floats  # how far it is worn down, on the way there
    load: Floats  # wax that sticks to the tip: LOADS planes, one for each crayon carried
    loaded: Floats  # their sum
    share: Floats  # of the load that comes off
    blended: Floats  # blend that arrives: BLEND values a cell
    taken: Floats  # wax that leaves over the sum of weights, for one slot after the other
    arriving: Floats  # wax that comes, likewise
    slot_of: NDArray[np.uint8]  # by crayon
    crayon_of: NDArray[np.uint8]  # by slot
    begin: NDArray[np.int64]  # by slot: cells between which it holds anything
    end: NDArray[np.int64]
    load_of: NDArray[np.uint8]  # place among the loads, by crayon
    load_crayon: NDArray[np.uint8]  # ... and back
    grain: NDArray[np.float64]  # how each of GRAINS grains stands, see `grains`
    hand: NDArray[np.float64]  # the stroke so far


def window(cells: int, crayons: int) -> Window:
    """Work space for tips of up to `cells` cells, border included, and so many crayons in the
    box.
    """

    def floats(planes: int) -> Floats:
        return np.zeros(planes * cells, np.float32)

    def numbers(kind: type[np.generic], size: int, value: int = 0) -> NDArray[Any]:
        return np.full(size, value, kind)

    slots = crayons + 1
    return Window(
        where=numbers(np.uint32, cells),
        touch=numbers(np.uint32, cells + 1),
        mask=floats(1),
        surface=floats(1),
        before=floats(1),
        film=floats(1),
        over=floats(1),
        weights=floats(1),
        weight=floats(8),
        broken=floats(1),
        lost=floats(1),
        lowered=floats(1),
        load=floats(LOADS),
        loaded=floats(1),
        share=floats(1),
        blended=floats(BLEND),
        taken=floats(slots),
        arriving=floats(slots),
        slot_of=numbers(np.uint8, 256, NONE),
        crayon_of=numbers(np.uint8, 256),
        begin=numbers(np.int64, 256),
        end=numbers(np.int64, 256),
        load_of=numbers(np.uint8, 256, NONE),
        load_crayon=numbers(np.uint8, LOADS),
        grain=numbers(np.float64, 4 * GRAINS),
        hand=numbers(np.float64, 16),
    )


@inner_kernel
def neighbour(k):  # type: ignore[no-untyped-def]
    """(dy, dx) of neighbour k: four along the axes, then four diagonal ones."""
    if k < 4:
        return (k & 1) * (k - 2), (1 - (k & 1)) * (k - 1)
    return ((k >> 1) & 1) * 2 - 1, (k & 1) * 2 - 1


@inner_kernel
def step(k, side, hop):  # type: ignore[no-untyped-def]
    """How far on in the window neighbour k lies, `hop` cells away."""
    dy, dx = neighbour(k)
    return (dy * side + dx) * hop


@lean_kernel
def look(w, side, present, top, left, rows, cols, firm, columns):  # type: ignore[no-untyped-def]
    """Surface, film and gap under the window; returns which share of the tip is on the sheet."""
    paper, total = columns.paper, columns.total
    wide = whole(side)

    # All on the sheet: rows of cells, without a test for each.
    if top >= 0 and left >= 0 and top + side <= rows and left + side <= cols:
        for j in range(wide):
            at, cell = whole(j * wide), whole((top + j) * cols + left)
            for i in range(wide):
                w.film[at + i] = w.before[at + i] = total[cell + i]
                height = paper[cell + i] + firm * total[cell + i]
                w.surface[at + i] = height
                w.over[at + i] = height - w.mask[at + i]
        return np.float32(1)

    # Over the edge: what lies off the sheet stands too high for wax and too low for the tip.
    inside = 0
    for j in range(wide):
        y = top + j
        for i in range(wide):
            at, x = j * wide + i, left + i
            if 0 <= y < rows and 0 <= x < cols:
                cell = y * cols + x
                w.film[at] = w.before[at] = total[cell]
                w.surface[at] = paper[cell] + firm * total[cell]
                w.over[at] = w.surface[at] - w.mask[at]
                inside += w.mask[at] < PRESENT
            else:
                w.film[at] = w.before[at] = 0
                w.surface[at] = np.float32(1e9)
                w.over[at] = np.float32(-1e9)
    return np.float32(inside) / np.float32(present)


@lean_kernel
def open_slot(w, cells, slot, wax, begin):  # type: ignore[no-untyped-def]
    """Give a crayon the next slot, empty."""
    w.slot_of[wax] = slot
    w.crayon_of[slot] = wax
    w.begin[slot] = begin
    plane = whole(slot * w.film.size)
    for at in range(cells):
        w.taken[plane + at] = 0
    for at in range(cells):
        w.arriving[plane + at] = 0
