"""Smearing: standing wax is pushed to the eight neighbours (Eq. 4, Fig. 7).

All amounts come from one snapshot, so no cell is favoured. Wax on its way lies sorted by crayon in
slots of the window, slot 0 for the crayon in hand, and is laid on when the contact is over
(`settle`).
"""

import numpy as np

from stroke_gen.jit import inner_kernel, lean_kernel

from .columns import BLEND, LAYERS, add, whole
from .load import stick
from .window import NONE, neighbour, open_slot, step

STANDING = np.float32(1e-3)  # um; less than this is not pushed on
FAINT = np.float32(1e-4)  # a weaker pull is none: shares of it would be too small for a float32


@inner_kernel
def _pull(here, there, alpha, directional, weight, weights):  # type: ignore[no-untyped-def]
    """Eq. 4 towards one neighbour, which is also added to `weights`."""
    for i in range(weights.size):
        pull = alpha * (here[i] - there[i]) + directional
        pull = pull if pull > FAINT else np.float32(0)
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


@lean_kernel
def weigh(w, side, hop, vx, vy, alpha, beta):  # type: ignore[no-untyped-def]
    """How strongly each cell is drawn to each neighbour (Eq. 4); those off the sheet stand too
    high.
    """
    size, edge = w.film.size, hop * side + hop
    end = side * side - edge
    for at in range(edge, end):
        w.weights[at] = 0
    for k in range(8):
        dy, dx = neighbour(k)
        near = np.float32(1) if k < 4 else np.float32(0.70710678)
        # cosine and distance, diagonally 1/sqrt 2 each
        share = np.float32(1) if k < 4 else np.float32(0.5)
        directional = beta * (np.float32(dx) * vx + np.float32(dy) * vy) * share
        to, plane = step(k, side, hop), k * size
        _pull(
            w.surface[edge:end],
            w.surface[edge + to : end + to],
            alpha * near,
            directional,
            w.weight[plane + edge : plane + end],
            w.weights[edge:end],
        )


@lean_kernel
def smear(w, side, hop, home, nu, c, columns):  # type: ignore[no-untyped-def]
    """Push standing wax to the neighbours `hop` cells away (Fig. 7); returns the slots in use.

    Of what stands the share nu * pull / (pull + yields) goes, where `pull` is the sum of weights.
    Fig. 7 moves nu of it however small the pull (yields = 0): past the level that it seeks, and
    back at the next contact, which leaves a grain of single cells. Pure wax is on its way in
    `arriving` when this returns; the blend has already arrived. c: the `Constants`.
    """
    size, edge = w.film.size, hop * side + hop

    # The cells in contact, as a list.
    contacts = 0
    for i in range(edge, side * side - edge):
        w.touch[contacts] = i
        contacts += int(w.over[i] > 0)

    # What stands higher than the tip leaves, the topmost layers first.
    slots, low, high = 1, whole(side * side), whole(0)
    for t in range(contacts):
        at = np.int64(w.touch[t])
        standing, pull = min(w.film[at], w.over[at]), w.weights[at]
        if standing <= STANDING or pull <= 0:
            continue
        moved = nu * standing * pull / (pull + c.yields)
        cell = whole(home + w.where[at])
        if c.sticks > 0:
            stuck = stick(w, side, at, cell, moved, c, columns)
            w.film[at] -= stuck
            moved -= stuck
        missing, slots = _take(w, side * side, slots, at, cell, moved, 1 / pull, columns)
        if missing > 0:
            missing = _take_blend(w, side, hop, at, cell, missing, 1 / pull, columns.blend)
            low, high = min(low, at), at + 1
        w.film[at] -= moved - missing
        columns.total[cell] = w.film[at]

    # It goes to the neighbours, neighbour by neighbour for the whole window.
    w.begin[0], w.end[0] = edge, side * side - edge
    for slot in range(slots):
        begin, end, plane = w.begin[slot], w.end[slot], slot * size
        for k in range(8):
            to = plane + step(k, side, hop)
            _flow(
                w.taken[plane + begin : plane + end],
                w.weight[k * size + begin : k * size + end],
                w.arriving[to + begin : to + end],
            )
        w.begin[slot], w.end[slot] = begin - edge, end + edge
        begin, end = w.begin[slot], w.end[slot]
        _add_to(w.film[begin:end], w.arriving[plane + begin : plane + end])
    if high:
        _blend_in(w, low - edge, high + edge, home, columns.total, columns.blend)
    return slots


@inner_kernel
def _take(w, cells, slots, at, cell, left, scale, columns):  # type: ignore[no-untyped-def]
    """Lift `left` um off the pure layers of a column; returns what they did not have, and the slots
    in use.
    """
    crayon, layer = columns.crayon, columns.layer
    base, n, kept = whole(cell * LAYERS), np.int64(columns.used[cell]), 0
    for down in range(LAYERS):
        j = LAYERS - 1 - down
        there = layer[base + j] if j < n else np.float32(0)
        part = min(left, there)
        slot = np.int64(w.slot_of[crayon[base + j]]) if part > 0 else 0
        if slot == NONE:
            slot = slots
            slots += 1
            open_slot(w, cells, slot, crayon[base + j], at)
        w.taken[whole(slot * w.film.size + at)] += part * scale
        w.end[slot] = at + 1
        left -= part
        layer[base + j] = there - part
        kept += there > part
    columns.used[cell] = kept
    return left, slots


@inner_kernel
def _take_blend(w, side, hop, at, cell, left, scale, blend):  # type: ignore[no-untyped-def]
    """Take `left` um from a column without pure layers; returns what was not there to take."""
    base, size = whole(cell * BLEND), w.film.size
    held = blend[base]
    if held <= STANDING * STANDING:  # halved ever again it would end below what a float32 can hold
        return left
    part = min(np.float32(1), left / held)
    for k in range(8):
        share = w.weight[k * size + at] * scale * part
        if share > 0:
            to = whole((at + step(k, side, hop)) * BLEND)
            for c in range(BLEND):
                w.blended[to + c] += share * blend[base + c]
    for c in range(BLEND):
        blend[base + c] -= part * blend[base + c]
    return left - part * held


@lean_kernel
def _blend_in(w, begin, end, home, total, blend):  # type: ignore[no-untyped-def]
    """Let the blend that was taken arrive in the neighbours' blends."""
    for at in range(begin, end):
        if w.blended[at * BLEND] > 0:
            cell = whole(home + w.where[at])
            w.film[at] += w.blended[at * BLEND]
            total[cell] += w.blended[at * BLEND]
            for c in range(BLEND):
                blend[cell * BLEND + c] += w.blended[at * BLEND + c]
                w.blended[at * BLEND + c] = 0


@lean_kernel
def _lay(w, slot, home, thin, columns):  # type: ignore[no-untyped-def]
    """Lay what arrived in one slot."""
    plane, wax, touched = whole(slot * w.film.size), w.crayon_of[slot], 0
    for i in range(whole(w.begin[slot]), w.end[slot]):
        w.touch[touched] = i
        touched += int(w.arriving[plane + i] > 0)
    for t in range(touched):
        at = np.int64(w.touch[t])
        add(whole(home + w.where[at]), wax, w.arriving[plane + at], thin, columns)


@lean_kernel
def settle(w, slots, home, thin, columns):  # type: ignore[no-untyped-def]
    """Lay what arrived in all slots, of the crayon in hand last."""
    for turn in range(1, slots + 1):
        slot = whole(turn % slots)
        _lay(w, slot, home, thin, columns)
        w.slot_of[w.crayon_of[slot]] = NONE
