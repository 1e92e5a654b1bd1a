"""Deposit: friction rubs wax off the tip (Eq. 3, Fig. 6)."""

import numpy as np

from stroke_gen.jit import inner_kernel, lean_kernel, lean_sum_kernel

from .window import WORN

SELDOM = 4  # contacts after which the tip is worn down
CLIFF = np.float32(1e6)  # um; a rise like this is the edge of the sheet


@lean_kernel
def break_off(w, side, reach, vx, vy, push, stride, c):  # type: ignore[no-untyped-def]
    """What breaks off the tip over `stride` cells of the way, into `broken`. c: the `Constants`."""
    # One cell ahead along the longer axis (P'): it lies between two cells of the window.
    longest = max(abs(vx), abs(vy))
    ax, ay = vx / longest, vy / longest
    sx, sy = (1 if ax > 0 else -1), (1 if ay > 0 else -1)
    if abs(ax) >= abs(ay):
        ahead, aside, slant = sx, sx + sy * side, abs(ay)
    else:
        ahead, aside, slant = sy * side, sx + sy * side, abs(ax)

    a = reach * side + reach
    b = side * side - a
    _break_off(
        w.surface[a:b],
        w.surface[a + ahead : b + ahead],
        w.surface[a + aside : b + aside],
        w.film[a:b],
        w.film[a + ahead : b + ahead],
        w.film[a + aside : b + aside],
        slant,
        w.over[a:b],
        w.before[a:b],
        push,
        c.rate * stride,
        c.film,
        c.mu_paper,
        c.mu_wax,
        c.relief,
        c.heap,
        c.firm,
        w.broken[a:b],
    )


@lean_kernel
def lay_ready(w, side, reach, c):  # type: ignore[no-untyped-def]
    """What broke off joins slot 0, and wears the mask; returns the tip's loss in um times cells.

    A cell takes its neighbours along that lie within `c.brings` cells, with c.wear of its loss in
    all; as they hardly change from contact to contact, that is done once in SELDOM of them.
    """
    a = reach * side + reach
    b = side * side - a
    broken, inflow = w.broken[a:b], w.arriving[a:b]
    given = _lose(broken, c.wear, inflow, w.mask[a:b], w.lost[a:b])
    if c.brings <= 1:
        return given
    w.hand[WORN] += 1
    if w.hand[WORN] >= SELDOM:
        w.hand[WORN] = 0
        _wear_down(w, side, reach, c)
    return given


@inner_kernel
def _break_off(here, ahead, aside, film, film_ahead, film_aside,  # type: ignore[no-untyped-def]
               slant, over, before, push, rate, thick, mu_paper, mu_wax, relief, heap, firm,
               broken):  # fmt: skip
    """What breaks off each cell: rate * mu * sin(S, F) of the room, where S is the surface and F
    the force.

    Loops over arrays of the same length; P' lies between `ahead` and `aside`, `slant` of the way to
    the latter.
    """
    one = np.float32(1)
    straight = one - slant
    length2 = one + slant * slant  # of the way to P'
    press, push = one / np.sqrt(one + push * push), push * np.sqrt(length2)
    for i in range(broken.size):
        # Room: by how much the tip is below the surface after smearing, less what is out of its
        # reach.
        room = over[i] + firm * (film[i] - before[i]) - heap * film[i]

        # Sine between the surface and the force, the angle addition of Eq. 3 without angles.
        rise = straight * ahead[i] + slant * aside[i] - here[i]
        rise = relief * rise if rise < CLIFF else np.float32(0)
        sine = press * (push + rise) / np.sqrt(length2 + rise * rise)

        # Friction at P': from paper to wax, smoothly over thin films.
        bare = thick / (thick + straight * film_ahead[i] + slant * film_aside[i])
        mu = bare * mu_paper + (one - bare) * mu_wax

        # Faces steeper than the force get none, and a cell never more than its room.
        given = min(rate * sine * mu, one) * room
        broken[i] = given if over[i] > 0 and sine > 0 and room > 0 else np.float32(0)


@lean_sum_kernel
def _lose(broken, share, inflow, mask, loss):  # type: ignore[no-untyped-def]
    """Make what broke off ready to be laid, and book `share` of it as lost; returns its sum."""
    total = np.float32(0)
    for i in range(broken.size):
        inflow[i] += broken[i]
        mask[i] += share * broken[i]
        loss[i] += broken[i]
        total += broken[i]
    return total


@lean_kernel
def _wear_down(w, side, reach, c):  # type: ignore[no-untyped-def]
    """Spread what was lost over the neighbours, and lower the mask by it.

    It falls evenly with distance along rows and along columns. Were neighbours taken along alike, a
    cell that stands out would not be worn more than they, and single cells would grow out of the
    tip.
    """
    far = min(np.int64(np.ceil(c.brings)) - 1, reach)
    a, ends = far * side + far, side * side
    total = np.float32(0)
    for k in range(-far, far + 1):
        total += np.float32(1) - abs(k) / c.brings
    for at in range(ends):
        w.lowered[at] = 0
    for k in range(-far, far + 1):
        share = (np.float32(1) - abs(k) / c.brings) / total
        _plus(w.lowered[a : ends - a], w.lost[a + k : ends - a + k], share)
    for k in range(-far, far + 1):
        share = c.around * (np.float32(1) - abs(k) / c.brings) / total
        to = k * side
        _plus(w.mask[a : ends - a], w.lowered[a + to : ends - a + to], share)
    for at in range(ends):
        w.lost[at] = 0


@inner_kernel
def _plus(total, more, share):  # type: ignore[no-untyped-def]
    for i in range(more.size):
        total[i] += share * more[i]
