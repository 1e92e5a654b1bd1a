"""One contact after another: what happens on the sheet under a crayon that is drawn along (Figs. 3 to 7).

At each contact the cells under the tip, and those around them that smearing can reach, are looked at through
a window: a square of cells, kept row by row in flat arrays, in which the neighbour on one side of every cell
lies equally far on. So weighing, flowing and rubbing off are plain loops over arrays, which the compiler
turns into vector instructions; only taking wax off columns and laying it on goes cell by cell.

Kernels here get all memory from outside (`window`); strokes they get from the queue of `schedule`.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stroke_gen.jit import inner_kernel, lean_kernel, lean_sum_kernel

from .queue import patient_take

LAYERS = 4  # pure layers a cell
BLEND = 7  # height, then k*h and s*h for red, green, blue
NONE = 255  # no slot
HEIGHT, DITHER_X, DITHER_Y, AHEAD, WALKED, CONTACTS, BEGUN = range(7)  # what `hand` holds

Floats = NDArray[np.float32]


class Columns(NamedTuple):
    """The wax on a sheet, cell by cell (see `Sheet`), as flat arrays."""

    paper: Floats
    total: Floats
    used: NDArray[np.uint8]  # how many pure layers
    crayon: NDArray[np.uint8]  # LAYERS a cell
    layer: Floats  # LAYERS a cell
    blend: Floats  # BLEND a cell
    optics: Floats  # 6 a crayon


class Window(NamedTuple):
    """A thread's work space. All but the last five hold a value for each cell of the window, row by row.

    Wax on its way is sorted by crayon: each crayon met at a contact gets a slot, the one in hand slot 0.
    """

    where: NDArray[np.uint32]  # number of the cell on the sheet, less that of the window's first
    touch: NDArray[np.uint32]  # a list of cells
    mask: Floats  # height of the tip
    surface: Floats  # what it meets: paper and the firm share of the wax; very high off the sheet
    film: Floats  # wax
    over: Floats  # surface less mask, and then the overlap of both; 0 without contact
    weights: Floats  # sum of Eq. 4 over the neighbours
    weight: Floats  # Eq. 4, for one neighbour after the other
    broken: Floats  # what breaks off
    blended: Floats  # blend that arrives: BLEND values a cell
    taken: Floats  # wax that leaves over the sum of weights, for one slot after the other
    arriving: Floats  # wax that comes, likewise
    slot_of: NDArray[np.uint8]  # by crayon
    crayon_of: NDArray[np.uint8]  # by slot
    begin: NDArray[np.int64]  # by slot: cells between which it holds anything
    end: NDArray[np.int64]
    hand: NDArray[np.float64]  # the stroke so far: height of the tip, offsets, strides to the next contact, ...


def window(cells: int, crayons: int) -> Window:
    """Work space for tips of up to `cells` cells, border included, and so many crayons in the box."""

    def floats(planes: int) -> Floats:
        return np.zeros(planes * cells, np.float32)

    def numbers(kind: type[np.generic], size: int, value: int = 0) -> NDArray[Any]:
        return np.full(size, value, kind)

    slots = crayons + 1
    return Window(
        where=numbers(np.uint32, cells), touch=numbers(np.uint32, cells + 1),
        mask=floats(1), surface=floats(1), film=floats(1), over=floats(1), weights=floats(1), weight=floats(8),
        broken=floats(1), blended=floats(BLEND), taken=floats(slots), arriving=floats(slots),
        slot_of=numbers(np.uint8, 256, NONE), crayon_of=numbers(np.uint8, 256),
        begin=numbers(np.int64, 256), end=numbers(np.int64, 256), hand=numbers(np.float64, 7),
    )  # fmt: skip


# ---- plain loops -------------------------------------------------------------------------------------------


@inner_kernel
def _whole(number):  # type: ignore[no-untyped-def]
    """The number itself, which the compiler now knows not to be negative: it indexes without a test."""
    return np.int64(np.uint32(number))


@lean_sum_kernel
def _force(gap, h):  # type: ignore[no-untyped-def]
    """Sum and number of the overlaps max(0, gap - h): the force of Eq. 2 in units of lambda."""
    total = np.float32(0)
    touching = 0
    for i in range(gap.size):
        over = gap[i] - h
        total += max(over, np.float32(0))
        touching += over > 0
    return total, touching


@inner_kernel
def _overlap(gap, h):  # type: ignore[no-untyped-def]
    """Turn gaps into overlaps."""
    for i in range(gap.size):
        gap[i] = max(gap[i] - h, np.float32(0))


@inner_kernel
def _pull(here, there, alpha, directional, weight, weights):  # type: ignore[no-untyped-def]
    """Eq. 4 towards one neighbour, which is also added to `weights`."""
    for i in range(weights.size):
        pull = max(alpha * (here[i] - there[i]) + directional, np.float32(0))
        weight[i] = pull
        weights[i] += pull


@inner_kernel
def _flow(taken, weight, arriving):  # type: ignore[no-untyped-def]
    """What goes to one neighbour."""
    for i in range(taken.size):
        arriving[i] += taken[i] * weight[i]


@inner_kernel
def _add_to(total, more):  # type: ignore[no-untyped-def]
    for i in range(more.size):
        total[i] += more[i]


@inner_kernel
def _break_off(here, ahead, aside, slant, over, film, inflow, push, rate, thick, mu_paper, mu_wax, relief,  # type: ignore[no-untyped-def]
               heap, broken):  # fmt: skip
    """Eq. 3 and Fig. 6: what breaks off the tip. Ahead lies a point between `ahead` and `aside`."""
    one = np.float32(1)
    length2 = one + slant * slant
    press, push = one / np.sqrt(one + push * push), push * np.sqrt(length2)
    for i in range(broken.size):
        wax_here = film[i] + inflow[i]
        room = over[i] + inflow[i] - heap * wax_here
        rise = (one - slant) * ahead[i] + slant * aside[i] - here[i]
        rise = relief * rise if rise < np.float32(1e6) else np.float32(0)
        slope = press * (push + rise) / np.sqrt(length2 + rise * rise)
        bare = thick / (thick + wax_here)
        given = min(rate * slope * (bare * mu_paper + (one - bare) * mu_wax), one) * room
        broken[i] = given if over[i] > 0 and slope > 0 and room > 0 else np.float32(0)


@lean_sum_kernel
def _wear(broken, wear, inflow, mask):  # type: ignore[no-untyped-def]
    """Make what broke off ready to be laid, and deepen the mask by `wear` of it; returns its sum."""
    lost = np.float32(0)
    for i in range(broken.size):
        inflow[i] += broken[i]
        mask[i] += wear * broken[i]
        lost += broken[i]
    return lost


# ---- columns of wax ----------------------------------------------------------------------------------------


@inner_kernel
def _add(cell, wax, height, thin, columns):  # type: ignore[no-untyped-def]
    """Lay `height` of pure crayon `wax` on a column; films thinner than `thin` do not part two layers."""
    used, crayon, layer = columns.used, columns.crayon, columns.layer
    columns.total[cell] += height
    base, n = _whole(cell * LAYERS), _whole(used[cell])
    found = LAYERS
    for j in range(LAYERS):  # upwards and without branches, for which way they go could not be foretold
        parted = LAYERS if layer[base + j] >= thin else found
        found = (j if crayon[base + j] == wax else parted) if j < n else found
    if found < LAYERS:
        layer[base + found] += height
        return
    if n == LAYERS:  # the lowest layer is hidden: it sinks into the blend
        h, low, sunk = layer[base], _whole(crayon[base] * 6), _whole(cell * BLEND)
        columns.blend[sunk] += h
        for c in range(6):
            columns.blend[sunk + 1 + c] += h * columns.optics[low + c]
        for j in range(LAYERS - 1):
            crayon[base + j] = crayon[base + j + 1]
            layer[base + j] = layer[base + j + 1]
        n -= 1
    crayon[base + n] = wax
    layer[base + n] = height
    used[cell] = n + 1


@lean_kernel
def _lay(w, slot, home, thin, columns):  # type: ignore[no-untyped-def]
    """Lay what arrived in one slot."""
    plane, wax, touched = _whole(slot * w.film.size), w.crayon_of[slot], 0
    for i in range(_whole(w.begin[slot]), w.end[slot]):
        w.touch[touched] = i
        touched += int(w.arriving[plane + i] > 0)
    for t in range(touched):
        at = np.int64(w.touch[t])
        _add(_whole(home + w.where[at]), wax, w.arriving[plane + at], thin, columns)


@lean_kernel
def _settle(w, slots, home, thin, columns):  # type: ignore[no-untyped-def]
    """Lay what arrived in all slots, of the crayon in hand last."""
    for turn in range(1, slots + 1):
        slot = _whole(turn % slots)
        _lay(w, slot, home, thin, columns)
        w.slot_of[w.crayon_of[slot]] = NONE


@inner_kernel
def _take(w, cells, slots, at, cell, left, scale, columns):  # type: ignore[no-untyped-def]
    """Lift `left` um off the top of a column, as far as its pure layers go; returns what is missing, and slots."""
    crayon, layer = columns.crayon, columns.layer
    base, n, kept = _whole(cell * LAYERS), np.int64(columns.used[cell]), 0
    for down in range(LAYERS):
        j = LAYERS - 1 - down
        there = layer[base + j] if j < n else np.float32(0)
        part = min(left, there)
        slot = np.int64(w.slot_of[crayon[base + j]]) if part > 0 else 0
        if slot == NONE:
            slot = slots
            slots += 1
            _open(w, cells, slot, crayon[base + j], at)
        w.taken[_whole(slot * w.film.size + at)] += part * scale
        w.end[slot] = at + 1
        left -= part
        layer[base + j] = there - part
        kept += there > part
    columns.used[cell] = kept
    return left, slots


@lean_kernel
def _open(w, cells, slot, wax, begin):  # type: ignore[no-untyped-def]
    """Give a crayon the next slot, empty."""
    w.slot_of[wax] = slot
    w.crayon_of[slot] = wax
    w.begin[slot] = begin
    plane = _whole(slot * w.film.size)
    for at in range(cells):
        w.taken[plane + at] = 0
    for at in range(cells):
        w.arriving[plane + at] = 0


@inner_kernel
def _take_blend(w, side, reach, at, cell, left, scale, blend):  # type: ignore[no-untyped-def]
    """Take `left` um from a column that has no pure layer any more; returns what was not there to take."""
    base, size = _whole(cell * BLEND), w.film.size
    held = blend[base]
    if held <= 0:
        return left
    part = min(np.float32(1), left / held)
    for k in range(8):
        share = w.weight[k * size + at] * scale * part
        if share > 0:
            to = _whole((at + _step(k, side, reach)) * BLEND)
            for c in range(BLEND):
                w.blended[to + c] += share * blend[base + c]
    for c in range(BLEND):
        blend[base + c] -= part * blend[base + c]
    return left - part * held


# ---- the steps of Fig. 3 -----------------------------------------------------------------------------------


@lean_kernel
def _look(w, side, present, top, left, rows, cols, firm, columns):  # type: ignore[no-untyped-def]
    """Surface, film and gap under the window; returns which share of the tip is on the sheet."""
    paper, total = columns.paper, columns.total
    wide = _whole(side)
    if top >= 0 and left >= 0 and top + side <= rows and left + side <= cols:
        for j in range(wide):
            at, cell = _whole(j * wide), _whole((top + j) * cols + left)
            for i in range(wide):
                w.film[at + i] = total[cell + i]
                height = paper[cell + i] + firm * total[cell + i]
                w.surface[at + i] = height
                w.over[at + i] = height - w.mask[at + i]
        return np.float32(1)
    inside = 0
    for j in range(wide):
        y = top + j
        for i in range(wide):
            at, x = j * wide + i, left + i
            if 0 <= y < rows and 0 <= x < cols:
                cell = y * cols + x
                w.film[at] = total[cell]
                w.surface[at] = paper[cell] + firm * total[cell]
                w.over[at] = w.surface[at] - w.mask[at]
                inside += w.mask[at] < np.float32(1e8)
            else:
                w.film[at] = 0
                w.surface[at] = np.float32(1e9)
                w.over[at] = np.float32(-1e9)
    return np.float32(inside) / np.float32(present)


@lean_kernel
def _balance(gap, wanted, start, epsilon):  # type: ignore[no-untyped-def]
    """Height of the tip at which the overlaps sum to `wanted` (Fig. 4). `start`: the last height.

    F(h) = sum max(0, gap - h) is convex and falls with h, so a step of Newton's method lands left of
    the solution and the next ones rise to it without passing: exact after few steps.
    """
    h = start
    force, touching = _force(gap, h)
    if touching == 0:
        top = gap[0]
        for i in range(1, gap.size):
            top = max(top, gap[i])
        h = top - wanted
        force, touching = _force(gap, h)
    for _ in range(40):
        if abs(force - wanted) <= epsilon or touching == 0:
            break
        h += (force - wanted) / np.float32(touching)
        force, touching = _force(gap, h)
    return h


@inner_kernel
def _neighbour(k):  # type: ignore[no-untyped-def]
    """(dy, dx) of neighbour k: four along the axes, then four diagonal ones."""
    if k < 4:
        return (k & 1) * (k - 2), (1 - (k & 1)) * (k - 1)
    return ((k >> 1) & 1) * 2 - 1, (k & 1) * 2 - 1


@inner_kernel
def _step(k, side, reach):  # type: ignore[no-untyped-def]
    """How far on in the window neighbour k lies."""
    dy, dx = _neighbour(k)
    return (dy * side + dx) * reach


@lean_kernel
def _weigh(w, side, reach, vx, vy, alpha, beta):  # type: ignore[no-untyped-def]
    """How strongly each cell is drawn to each of its neighbours (Eq. 4); those off the sheet stand too high."""
    size, edge = w.film.size, reach * side + reach
    end = side * side - edge
    for at in range(edge, end):
        w.weights[at] = 0
    for k in range(8):
        dy, dx = _neighbour(k)
        near = np.float32(1) if k < 4 else np.float32(0.70710678)
        directional = beta * (np.float32(dx) * vx + np.float32(dy) * vy) * (np.float32(1) if k < 4 else np.float32(0.5))
        to, plane = _step(k, side, reach), k * size
        _pull(w.surface[edge:end], w.surface[edge + to : end + to], alpha * near, directional,
              w.weight[plane + edge : plane + end], w.weights[edge:end])  # fmt: skip


@lean_kernel
def _smear(w, side, reach, home, nu, yields, columns):  # type: ignore[no-untyped-def]
    """Push standing wax to the eight neighbours (Fig. 7); all amounts come from one snapshot.

    Of what stands the share nu * pull / (pull + yields) goes, where `pull` is the sum of weights. Fig. 7 moves nu
    of it however small the pull (yields = 0): past the level that it seeks, and back at the next contact.

    Wax is on its way in `arriving` when this returns (the blend has already arrived); returns the slots in use.
    """
    size, edge = w.film.size, reach * side + reach
    contacts = 0
    for i in range(edge, side * side - edge):
        w.touch[contacts] = i
        contacts += int(w.over[i] > 0)
    slots, low, high = 1, _whole(side * side), _whole(0)
    for t in range(contacts):
        at = np.int64(w.touch[t])
        standing = min(w.film[at], w.over[at])
        if standing <= np.float32(1e-3) or w.weights[at] <= 0:
            continue
        pull = w.weights[at]
        wanted, scale = nu * standing * pull / (pull + yields), np.float32(1) / pull
        cell = _whole(home + w.where[at])
        missing, slots = _take(w, side * side, slots, at, cell, wanted, scale, columns)
        if missing > 0:
            missing = _take_blend(w, side, reach, at, cell, missing, scale, columns.blend)
            low, high = min(low, at), at + 1
        w.over[at] -= wanted
        w.film[at] -= wanted - missing
        columns.total[cell] = w.film[at]
    w.begin[0], w.end[0] = edge, side * side - edge
    for slot in range(slots):
        begin, end, plane = w.begin[slot], w.end[slot], slot * size
        for k in range(8):
            to = plane + _step(k, side, reach)
            _flow(w.taken[plane + begin : plane + end], w.weight[k * size + begin : k * size + end],
                  w.arriving[to + begin : to + end])  # fmt: skip
        w.begin[slot], w.end[slot] = begin - edge, end + edge
        if slot > 0:
            begin, end = w.begin[slot], w.end[slot]
            _add_to(w.film[begin:end], w.arriving[plane + begin : plane + end])
    if high:
        _blend_in(w, low - edge, high + edge, home, columns.total, columns.blend)
    return slots


@lean_kernel
def _blend_in(w, begin, end, home, total, blend):  # type: ignore[no-untyped-def]
    """Let the blend that was taken arrive."""
    for at in range(begin, end):
        if w.blended[at * BLEND] > 0:
            cell = _whole(home + w.where[at])
            w.film[at] += w.blended[at * BLEND]
            total[cell] += w.blended[at * BLEND]
            for c in range(BLEND):
                blend[cell * BLEND + c] += w.blended[at * BLEND + c]
                w.blended[at * BLEND + c] = 0


@lean_kernel
def _deposit(w, side, reach, vx, vy, push, rate, thick, mu_paper, mu_wax, relief, wear, heap):  # type: ignore[no-untyped-def]
    """Rub wax off the tip by friction (Eq. 3, Fig. 6).

    The share of the overlap that breaks off (less `heap` of the wax already there) is rate * mu * sin(S, F),
    where S is the surface ahead and F the crayon's force; faces steeper than F get none. What breaks off
    joins slot 0, deepens the mask by `wear` of it, and is returned as the tip's loss.
    """
    longest = max(abs(vx), abs(vy))
    ax, ay = vx / longest, vy / longest  # one cell ahead along the longer axis
    sx, sy = (1 if ax > 0 else -1), (1 if ay > 0 else -1)
    if abs(ax) >= abs(ay):
        ahead, aside, slant = sx, sx + sy * side, abs(ay)
    else:
        ahead, aside, slant = sy * side, sx + sy * side, abs(ax)
    a = reach * side + reach
    b = side * side - a
    inflow, broken = w.arriving[a:b], w.broken[a:b]
    _break_off(w.surface[a:b], w.surface[a + ahead : b + ahead], w.surface[a + aside : b + aside], slant, w.over[a:b],
               w.film[a:b], inflow, push, rate, thick, mu_paper, mu_wax, relief, heap, broken)  # fmt: skip
    return _wear(broken, wear, inflow, w.mask[a:b])


# ---- strokes -----------------------------------------------------------------------------------------------


@lean_kernel
def _press(w, mask, worn, side, cols):  # type: ignore[no-untyped-def]
    """Put a tip on a sheet `cols` cells wide: the beginning of a stroke; returns how many cells the tip has.

    worn: um of its height that have been rubbed off, which cuts its profile flat from below.
    """
    present = 0
    for j in range(side):
        for i in range(side):
            at = j * side + i
            w.where[at] = j * cols + i
            there = mask[at] < np.float32(1e8)
            w.mask[at] = max(mask[at] - worn, np.float32(0)) if there else mask[at]
            present += int(there)
    w.hand[:] = 0.5
    w.hand[HEIGHT] = 1e9  # lifted: from far below, float32 would miss the paper
    w.hand[WALKED] = w.hand[CONTACTS] = 0
    return present


@inner_kernel
def _luck(number):  # type: ignore[no-untyped-def]
    """From 0 up to 1 for each whole number, in no order (Knuth's multiplicative hash, twice)."""
    once = (number * 2654435761) & 0xFFFFFFFF
    twice = ((once ^ (once >> 15)) * 2654435761) & 0xFFFFFFFF
    return np.float32(twice >> 16) / np.float32(65536)


@inner_kernel
def _hop(contact, mean, scatter):  # type: ignore[no-untyped-def]
    """How many cells smeared wax goes at a contact: `mean` on average, by chance up to `scatter` more or less.

    Wax that always went equally far would part the cells into lattices; a pattern would show as a ladder.
    """
    return max(1, int(np.floor(mean + np.float32(0.5) + scatter * (np.float32(2) * _luck(contact) - np.float32(1)))))


@inner_kernel
def _grip(stroke, along):  # type: ignore[no-untyped-def]
    """How much harder (to 1) or lighter (to -1) the crayon presses than the hand, as it sticks and slips.

    along: the way so far, in lengths over which that changes.   stroke: a number that differs from stroke to stroke.
    """
    step = np.int64(along)
    part = np.float32(along - step)
    luck = (np.float32(1) - part) * _luck(stroke + step) + part * _luck(stroke + step + 1)
    return np.float32(2) * luck - np.float32(1)


@lean_kernel
def _contact(w, wax, side, reach, present, x, y, force, vx, vy, stride, smears, constants, per_lambda,  # type: ignore[no-untyped-def]
             rows, cols, columns):  # fmt: skip
    """One contact, for `stride` cells of the way: adjust the height, smear, deposit (Fig. 3); returns the wax given."""
    one = np.float32(1)
    contact = np.int64(w.hand[CONTACTS])
    w.hand[CONTACTS] += 1
    if contact == 0:  # strokes that begin a quarter of a slip apart slip each in its own way
        per_cell = np.float32(4) / constants.slip_cells
        w.hand[BEGUN] = np.floor(x * per_cell) * 7919 + np.floor(y * per_cell) * 104729
    if force <= 0:
        return np.float32(0)
    # Rounding to whole cells by an even sequence of offsets leaves no stair steps.
    left = int(np.floor(x - 0.5 + w.hand[DITHER_X])) - side // 2
    top = int(np.floor(y - 0.5 + w.hand[DITHER_Y])) - side // 2
    w.hand[DITHER_X] = (w.hand[DITHER_X] + 0.7548776662) % 1.0
    w.hand[DITHER_Y] = (w.hand[DITHER_Y] + 0.5698402910) % 1.0
    inside = _look(w, side, present, top, left, rows, cols, constants.firm, columns)
    if inside <= 0:
        return np.float32(0)
    # The tip sinks until the paper bears the force.
    grip = one + constants.slip * _grip(np.int64(w.hand[BEGUN]), contact * stride / constants.slip_cells)
    wanted = min(force * grip * per_lambda, constants.most * present) * inside
    cells = side * side
    allowed = min(constants.epsilon, np.float32(0.01) * wanted)
    h = _balance(w.over[:cells], wanted, np.float32(w.hand[HEIGHT]), allowed)
    w.hand[HEIGHT] = h
    _overlap(w.over[:cells], h)
    home, slots = top * cols + left, 1
    _open(w, cells, 0, wax, 0)
    w.end[0] = cells
    if smears:
        hop = _hop(contact, constants.hop, constants.scatter)
        _weigh(w, side, hop, vx, vy, constants.alpha, constants.beta)
        nu = one - (one - constants.nu) ** stride
        slots = _smear(w, side, hop, home, nu, constants.yields, columns)
    push = constants.push if constants.push > 0 else force
    given = _deposit(w, side, reach, vx, vy, push, constants.rate * stride, constants.film, constants.mu_paper,
                     constants.mu_wax, constants.relief, constants.wear, constants.heap)  # fmt: skip
    _settle(w, slots, home, constants.thin, columns)
    return given


@lean_kernel
def _move(w, wax, side, reach, present, a, b, step, smears, constants, per_lambda, rows, cols, columns):  # type: ignore[no-untyped-def]
    """Draw on from point a to point b, each x, y in cells and force: a contact every so many cells; returns the wax.

    step: cells from one contact to the next as a share of the tip's width, at least one cell.
    """
    stride = max(np.float32(1), step * np.float32(side - 2 * reach))
    dx, dy = b[0] - a[0], b[1] - a[1]
    length = np.hypot(dx, dy)
    given, ahead = 0.0, np.float32(w.hand[AHEAD]) * stride
    while ahead < length:
        t = ahead / length
        given += _contact(w, wax, side, reach, present, a[0] + t * dx, a[1] + t * dy, a[2] + t * (b[2] - a[2]),
                          dx / length, dy / length, stride, smears, constants, per_lambda, rows, cols,
                          columns)  # fmt: skip
        ahead += stride
    w.hand[AHEAD] = (ahead - length) / stride
    w.hand[WALKED] += length
    return given


@lean_kernel
def _lift(w, wax, side, reach, present, b, smears, constants, per_lambda, rows, cols, columns):  # type: ignore[no-untyped-def]
    """End a stroke at point b; one so short that nothing touched becomes a dab. Returns the wax given."""
    if w.hand[CONTACTS] > 0:
        return 0.0
    slides = max(np.float32(w.hand[WALKED]), np.float32(0.04) * np.float32(side - 2 * reach))  # by 1/25 of the tip
    return np.float64(_contact(w, wax, side, reach, present, b[0], b[1], b[2], np.float32(1), np.float32(0), slides,
                               smears, constants, per_lambda, rows, cols, columns))  # fmt: skip


@lean_kernel
def _rub(queue, done, alone, points, first, wax_of, tip_of, worn_of, masks, sides, reach, step, smears, constants,  # type: ignore[no-untyped-def]
         per_lambda, rows, cols, columns, loss, w):  # fmt: skip
    """Draw strokes as the queue gives them out; see `schedule.run`.

    done: a stroke drawn before that the queue is told of; alone: return after one stroke.
    points (n, 3): x, y in cells, force in N; first (strokes + 1): where each stroke's points begin; masks
    (tips, cells): fresh masks with a border of `reach` ABSENT cells, `sides` long; tip_of, worn_of (strokes,): which
    of them, and how much of its height in um is rubbed off; loss (strokes,): wax given.
    Smeared wax goes `reach` cells at a contact, or one or two fewer, at least one.
    """
    s = patient_take(queue, done)
    while s >= 0:
        side, wax = sides[tip_of[s]], np.uint8(wax_of[s])
        present = _press(w, masks[tip_of[s]], worn_of[s], side, cols)
        given = 0.0
        for i in range(first[s] + 1, first[s + 1]):
            given += _move(w, wax, side, reach, present, points[i - 1], points[i], step, smears, constants,
                           per_lambda, rows, cols, columns)  # fmt: skip
        given += _lift(w, wax, side, reach, present, points[first[s + 1] - 1], smears, constants, per_lambda,
                       rows, cols, columns)  # fmt: skip
        loss[s] = given
        if alone:
            break
        s = patient_take(queue, s)
    return s
