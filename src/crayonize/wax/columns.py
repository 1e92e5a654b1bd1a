"""The wax on each cell: pure layers over a blend, and how more of it is laid on.

A column holds up to LAYERS layers of pure crayons, top last, over one blend of all that has sunk.
Optical properties travel as a crayon's number (pure layers) or as sums of k*h and s*h (the blend):
both are linear in height, so wax can be split, moved and merged and no pigment is lost.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stroke_gen.jit import inner_kernel

LAYERS = 4  # pure layers a cell
BLEND = 7  # height, then k*h and s*h for red, green, blue

Floats = NDArray[np.float32]


class Columns(NamedTuple):
    """All columns of a sheet as flat arrays, cell by cell, row by row."""

    paper: Floats  # height of the tooth, um
    total: Floats  # height of all wax, um
    used: NDArray[np.uint8]  # how many pure layers
    crayon: NDArray[np.uint8]  # LAYERS a cell
    layer: Floats  # heights, LAYERS a cell, um
    blend: Floats  # BLEND a cell
    optics: Floats  # k, s per um in red, green, blue: 6 a crayon


@inner_kernel
def whole(number):  # type: ignore[no-untyped-def]
    """The number, known not to be negative, so that the compiler indexes without a test."""
    return np.int64(np.uint32(number))


@inner_kernel
def add(cell, wax, height, thin, columns):  # type: ignore[no-untyped-def]
    """Lay `height` um of pure crayon `wax` on a column.

    Films thinner than `thin` um are dust: they do not part two layers of one crayon, and when a
    column is full the thinnest of them sinks into the blend (section 3.1: "thin layers are
    blended"). Without dust the lowest sinks.
    """
    used, crayon, layer = columns.used, columns.crayon, columns.layer
    columns.total[cell] += height
    base, n = whole(cell * LAYERS), whole(used[cell])

    # The highest layer of this crayon with only dust above it. Upwards and without branches, for
    # which way they go could not be foretold.
    found = LAYERS
    for j in range(LAYERS):
        parted = LAYERS if layer[base + j] >= thin else found
        found = (j if crayon[base + j] == wax else parted) if j < n else found
    if found < LAYERS:
        layer[base + found] += height
        return

    # A full column makes room: what is hidden least missed sinks, those above it move down.
    if n == LAYERS:
        sinks, least = 0, thin
        for j in range(LAYERS):
            if layer[base + j] < least:
                sinks, least = j, layer[base + j]
        h, first, sunk = layer[base + sinks], whole(crayon[base + sinks] * 6), whole(cell * BLEND)
        columns.blend[sunk] += h
        for c in range(6):
            columns.blend[sunk + 1 + c] += h * columns.optics[first + c]
        for j in range(LAYERS - 1):
            if j >= sinks:
                crayon[base + j] = crayon[base + j + 1]
                layer[base + j] = layer[base + j + 1]
        n -= 1

    # A new layer on top.
    crayon[base + n] = wax
    layer[base + n] = height
    used[cell] = n + 1
