"""Deposit: friction rubs wax off the tip (Eq. 3, Fig. 6)."""

import numpy as np

from stroke_gen.jit import inner_kernel, lean_kernel, lean_sum_kernel

CLIFF = np.float32(1e6)  # um; a rise like this is the edge of the sheet


@lean_kernel
def deposit(w, side, reach, vx, vy, push, stride, c):  # type: ignore[no-untyped-def]
    """Rub wax off the tip over `stride` cells of the way; returns the tip's loss in um times cells.

    c: the `Constants`. What breaks off joins slot 0 and deepens the mask by c.wear of it.
    """
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
    inflow, broken = w.arriving[a:b], w.broken[a:b]
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
        broken,
    )
    return _wear(broken, c.wear, inflow, w.mask[a:b])


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
def _wear(broken, wear, inflow, mask):  # type: ignore[no-untyped-def]
    """Make what broke off ready to be laid, and deepen the mask by `wear` of it; returns its
    sum.
    """
    lost = np.float32(0)
    for i in range(broken.size):
        inflow[i] += broken[i]
        mask[i] += wear * broken[i]
        lost += broken[i]
    return lost
