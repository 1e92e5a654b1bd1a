"""Carving: wax that sticks to the tip, is carried along, and comes off again (section 6).

Of the wax that a tip displaces a share sticks to it, the more the thicker the film, and each cell
of the tip carries it as a load of up to LOADS crayons. What breaks off later is load and the
crayon's own wax, mixed as they cover the tip (soft as it is, a load holds nothing up); and where
much has gathered, a clump of it comes off at once. A tip begins each stroke clean, so strokes on
different tiles commute.
"""

import numpy as np

from stroke_gen.jit import inner_kernel, lean_kernel, lean_sum_kernel

from .columns import LAYERS, whole
from .window import CARRIED, CONTACTS, LOADS, NONE, OWN, PRESENT, REGAINED, open_slot

FAINT = np.float32(0.01)  # um; less is no load, and stays on the tip


@inner_kernel
def luck(number):  # type: ignore[no-untyped-def]
    """From 0 up to 1 for each whole number, in no order (Knuth's multiplicative hash, twice)."""
    once = (number * 2654435761) & 0xFFFFFFFF
    twice = ((once ^ (once >> 15)) * 2654435761) & 0xFFFFFFFF
    return np.float32(twice >> 16) / np.float32(65536)


@inner_kernel
def stick(w, side, at, cell, moved, c, columns):  # type: ignore[no-untyped-def]
    """Let a share of the `moved` um stick to the tip, off the topmost layer; returns how much.

    Wax of the crayon in hand is no load but crayon again, and sticks only where it lies so thick
    (c.peel) that the tip ploughs through: that is why a film does not grow for ever.
    """
    used, crayon, layer = columns.used, columns.crayon, columns.layer
    if used[cell] == 0:
        return np.float32(0)
    top = whole(cell * LAYERS + used[cell] - 1)
    own = crayon[top] == w.crayon_of[0]
    film, half = w.film[at], c.peel if own else c.carve
    wanted = c.sticks * film * film / (film * film + half * half) * moved
    if wanted < FAINT * FAINT:
        return np.float32(0)
    k = np.int64(w.load_of[crayon[top]])
    if not own and k == NONE:
        k = np.int64(w.hand[CARRIED])
        if k == LOADS:
            return np.float32(0)
        w.hand[CARRIED] += 1
        w.load_of[crayon[top]] = k
        w.load_crayon[k] = crayon[top]
        for i in range(side * side):
            w.load[k * w.film.size + i] = 0
    part = min(wanted, layer[top])
    layer[top] -= part
    used[cell] -= layer[top] <= 0
    if own:
        w.hand[REGAINED] += part
    else:
        w.load[whole(k * w.film.size + at)] += part
        w.loaded[at] += part
    return part


@lean_sum_kernel
def _shares(broken, loaded, covers, share):  # type: ignore[no-untyped-def]
    """Which share of each cell's load breaks off with all that does; returns their sum in um."""
    total = np.float32(0)
    for i in range(share.size):
        part = min(broken[i] / (loaded[i] + covers), np.float32(1))
        share[i] = part if loaded[i] > FAINT else np.float32(0)
        total += share[i] * loaded[i]
    return total


@inner_kernel
def _hand_over(load, share, arriving):  # type: ignore[no-untyped-def]
    for i in range(share.size):
        part = share[i] * load[i]
        arriving[i] += part
        load[i] -= part


@inner_kernel
def _replace(broken, share, loaded):  # type: ignore[no-untyped-def]
    """Where load breaks off, so much less of the crayon does."""
    for i in range(share.size):
        part = share[i] * loaded[i]
        broken[i] = max(broken[i] - part, np.float32(0))
        loaded[i] -= part


@lean_kernel
def give_back(w, side, reach, slots, covers):  # type: ignore[no-untyped-def]
    """Load comes off with what breaks off, as if it covered the tip among `covers` um of the
    crayon's own wax; returns the slots in use.
    """
    a = reach * side + reach
    b = side * side - a
    broken, loaded, share = w.broken[a:b], w.loaded[a:b], w.share[a:b]
    if _shares(broken, loaded, covers, share) <= 0:
        return slots
    _replace(broken, share, loaded)
    for k in range(np.int64(w.hand[CARRIED])):
        slot, slots = _slot_for(w, side * side, slots, k, a, b)
        load, plane = k * w.film.size, slot * w.film.size
        _hand_over(w.load[load + a : load + b], share, w.arriving[plane + a : plane + b])
    return slots


@inner_kernel
def _slot_for(w, cells, slots, k, begin, end):  # type: ignore[no-untyped-def]
    """The slot of the load's crayon k, made to hold all from `begin` to `end`; and the slots in
    use.
    """
    slot = np.int64(w.slot_of[w.load_crayon[k]])
    if slot == NONE:
        slot = slots
        slots += 1
        open_slot(w, cells, slot, w.load_crayon[k], begin)
        w.end[slot] = end
    w.begin[slot], w.end[slot] = min(w.begin[slot], begin), max(w.end[slot], end)
    return slot, slots


@lean_kernel
def drop(w, side, reach, present, stride, slots, c):  # type: ignore[no-untyped-def]
    """Now and then a clump comes off: all that sticks around one cell, drawn together to half the
    breadth; returns the slots in use.

    Each place of the tip is tried once in `c.way` cells of path, and lets go of a mean load of
    `c.clump` um.
    """
    number = np.int64(w.hand[OWN]) + 15485863 * np.int64(w.hand[CONTACTS])
    radius = max(c.site, np.float32(1))
    tries = np.float32(present) * stride / (np.float32(np.pi) * radius * radius * c.way)
    if w.hand[CARRIED] == 0 or luck(number) >= tries:
        return slots
    wide = side - 2 * reach
    y, x = reach + int(luck(number + 1) * wide), reach + int(luck(number + 2) * wide)
    if w.over[y * side + x] <= 0:
        return slots
    far = int(radius)
    top, bottom = max(reach, y - far), min(side - reach, y + far + 1)
    left, right = max(reach, x - far), min(side - reach, x + far + 1)
    gathered, cells = np.float32(0), np.float32(0)
    for j in range(top, bottom):
        for i in range(left, right):
            if (j - y) ** 2 + (i - x) ** 2 <= radius * radius:
                gathered += w.loaded[j * side + i]
                cells += w.mask[j * side + i] < PRESENT
    if gathered < c.clump * cells:
        return slots
    begin, end = top * side + left, (bottom - 1) * side + right
    for k in range(np.int64(w.hand[CARRIED])):
        slot, slots = _slot_for(w, side * side, slots, k, begin, end)
        for j in range(top, bottom):
            for i in range(left, right):
                at = j * side + i
                if (j - y) ** 2 + (i - x) ** 2 <= radius * radius:
                    to = (j + y + 1) // 2 * side + (i + x + 1) // 2
                    w.arriving[whole(slot * w.film.size + to)] += w.load[k * w.film.size + at]
                    w.loaded[at] -= w.load[k * w.film.size + at]
                    w.load[k * w.film.size + at] = 0
    return slots


@lean_kernel
def carry_off(w, side, carried):  # type: ignore[no-untyped-def]
    """Take what sticks to the tip away with it, and book it in `carried`, um times cells by
    crayon.
    """
    for k in range(np.int64(w.hand[CARRIED])):
        for at in range(side * side):
            carried[w.load_crayon[k]] += w.load[k * w.film.size + at]
        w.load_of[w.load_crayon[k]] = NONE
    w.hand[CARRIED] = 0
