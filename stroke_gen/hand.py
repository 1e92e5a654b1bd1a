"""The hand: from ideal paths to strokes with swelling pressure, wobble and overshoot.

All strokes of a crayon and coat are worked on at once as flat arrays. Every number is rounded as
the drawing's file rounds it, so that a saved drawing gives the same picture.
"""

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .drawing import Stroke, Tip
from .jit import inner_kernel, lean_kernel
from .params import Style

Floats = NDArray[np.float32]
HATCH_TAPER = 1.2  # tips over which a stroke of hatching begins and ends
TOUCH = 0.4  # share of the pressure at a stroke's very ends; it rises to all of it over the taper
FORCES_N = (0.02, 60.0)  # what a hand presses with, at least and at most
TURN_DIP = 0.15  # share of the pressure lost where a zigzag turns
TABLE = 8192  # random numbers that slow noise walks through


@dataclass(frozen=True, eq=False)
class Paths:
    """Paths of one coat: points (n, 2), pressure in N/mm^2 and leg of the zigzag at each, where
    each begins.
    """

    points: Floats
    pressure: Floats
    leg: NDArray[np.int32]
    first: NDArray[np.int64]  # (paths + 1,)


def draw(
    paths: Paths,
    scale_mm: float,
    crayon: str,
    tip: Tip,
    note: str,
    style: Style,
    rng: np.random.Generator,
    taper: float = HATCH_TAPER,
) -> list[Stroke]:
    """Strokes along paths given in units of `scale_mm`; taper: tips over which they begin and
    end.
    """
    number, width = len(paths.first) - 1, tip.width_mm
    if not number:
        return []
    beyond = style.overshoot * width * np.abs(rng.standard_normal((2, number)))
    wobble, swell = (
        Slow(rng.standard_normal(TABLE), rng.integers(TABLE, size=number)) for _ in range(2)
    )
    legs = number + np.count_nonzero(np.diff(paths.leg))  # or fewer
    firmness = np.exp(style.force_spread * rng.standard_normal(legs))
    path, along = paths.points.astype(np.float64) * scale_mm, np.empty(len(paths.points))
    xy, force_n = np.empty(path.shape, np.float32), np.empty(len(path), np.float32)
    _lead(path, paths.first, beyond, along, wobble, style.wobble * width, 4 * width, xy)
    _press(
        along,
        paths.pressure,
        paths.leg,
        paths.first,
        firmness,
        swell,
        style.swell,
        5 * width,
        taper * width,
        TURN_DIP,
        tip.area_mm2 * style.press,
        force_n,
    )
    bounds = paths.first.tolist()
    return [Stroke(xy[a:b], force_n[a:b], crayon, tip, note) for a, b in pairwise(bounds)]


def within(strokes: list[Stroke], sheet_mm: tuple[float, float]) -> list[Stroke]:
    """Strokes held back where they leave a sheet by more than its own size, which a drawing's file
    forbids.

    Only a thread of a sheet is so narrow that the hand slips that far.
    """
    size = np.array(sheet_mm)
    low, high = np.round(-size, 3).astype(np.float32), np.round(2 * size, 3).astype(np.float32)
    if not strokes or _all_within(np.concatenate([s.path_mm for s in strokes]), low, high):
        return strokes
    return [
        s if _all_within(s.path_mm, low, high) else replace(s, path_mm=s.path_mm.clip(low, high))
        for s in strokes
    ]


def _all_within(points: Floats, low: Floats, high: Floats) -> bool:
    return bool(((low <= points) & (points <= high)).all())


class Slow(NamedTuple):
    """Noise of about unit variance along each path, smooth over a length of 1: each walks through
    one table.
    """

    table: NDArray[np.float64]
    begin: NDArray[np.int64]  # by path


@inner_kernel
def _noise(slow, s, along):  # type: ignore[no-untyped-def]
    """Slow noise of path s at a length along it."""
    low = int(along)
    at, part = slow.begin[s] + low, along - low
    return (
        slow.table[at % slow.table.size] * (1 - part)
        + slow.table[(at + 1) % slow.table.size] * part
    )


@lean_kernel
def _lead(path, first, beyond, along, wobble, aside, wave, xy):  # type: ignore[no-untyped-def]
    """Where the hand leads the crayon: path (n, 2) in mm and the length `along` it (n,), both
    written to; xy (n, 2).

    Each path goes on beyond its beginning and its end by so many mm, `beyond` (2, paths), and
    swerves to its side by the noise `wobble` times `aside` mm, smooth over a length of `wave` mm.
    """
    for s in range(first.size - 1):
        a, b = first[s], first[s + 1] - 1
        inner = min(2, b - a)
        for end, near, far in ((a, a + inner, beyond[0, s]), (b, b - inner, beyond[1, s])):
            dx, dy = path[end, 0] - path[near, 0], path[end, 1] - path[near, 1]
            norm = max(np.sqrt(dx * dx + dy * dy), 1e-9)
            path[end, 0] += dx / norm * far
            path[end, 1] += dy / norm * far
        walked = 0.0
        for i in range(a, b + 1):
            j, k = max(i - 1, a), min(i + 1, b)
            walked += np.sqrt((path[i, 0] - path[j, 0]) ** 2 + (path[i, 1] - path[j, 1]) ** 2)
            along[i] = walked
            tx, ty = path[k, 0] - path[j, 0], path[k, 1] - path[j, 1]
            swerve = (
                aside * _noise(wobble, s, walked / wave) / max(np.sqrt(tx * tx + ty * ty), 1e-9)
            )
            xy[i, 0] = np.floor((path[i, 0] - ty * swerve) * 1000 + 0.5) / 1000
            xy[i, 1] = np.floor((path[i, 1] + tx * swerve) * 1000 + 0.5) / 1000


@inner_kernel
def _turns(leg, i, j, a, b):  # type: ignore[no-untyped-def]
    """Whether points i and j both belong to the path from a to b, and to different legs."""
    return i >= a and j <= b and leg[i] != leg[j]


@lean_kernel
def _press(along, pressure, leg, first, firmness, swell, swelling, wave, taper, dip, area, force_n):  # type: ignore[no-untyped-def]
    """How hard the hand presses: force_n (n,) in newton.

    The pressure swells slowly, each leg of a zigzag has a `firmness` of its own, the hand gives way
    where one leg turns into the next, and lines begin and end lightly.
    """
    number = -1  # of the leg
    for s in range(first.size - 1):
        a, b = first[s], first[s + 1] - 1
        for i in range(a, b + 1):
            number += i == a or leg[i] != leg[i - 1]
            force = (
                pressure[i] * (1 + swelling * _noise(swell, s, along[i] / wave)) * firmness[number]
            )
            if _turns(leg, i, i + 1, a, b) or _turns(leg, i - 1, i, a, b):
                force *= 1 - dip
            elif _turns(leg, i + 1, i + 2, a, b) or _turns(leg, i - 2, i - 1, a, b):
                force *= 1 - dip / 2
            from_end = min(along[i], along[b] - along[i])
            force *= min(TOUCH + (1 - TOUCH) * from_end / taper, 1.0)
            newton = min(max(force * area, FORCES_N[0]), FORCES_N[1])
            force_n[i] = np.floor(newton * 1000 + 0.5) / 1000
