"""How deep a tip sinks: the height at which paper and wax bear the hand's force (Fig. 4, Eq. 2)."""

import numpy as np

from stroke_gen.jit import inner_kernel, lean_kernel, lean_sum_kernel


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


@lean_kernel
def balance(gap, wanted, start, epsilon):  # type: ignore[no-untyped-def]
    """Height of the tip at which the overlaps sum to `wanted` (Fig. 4). `start`: the last height.

    F(h) = sum max(0, gap - h) is convex and falls with h, so a step of Newton's method lands left
    of the solution and the next ones rise to it without passing: exact after few steps, where Fig.
    4 bisects.
    """
    h = start
    force, touching = _force(gap, h)

    # Lifted: from the height at which the highest cell alone would bear it all.
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
def overlap(gap, h):  # type: ignore[no-untyped-def]
    """Turn gaps into overlaps."""
    for i in range(gap.size):
        gap[i] = max(gap[i] - h, np.float32(0))
