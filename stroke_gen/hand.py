"""The hand: from ideal paths to strokes with swelling pressure, wobble and overshoot.

All strokes of a coat are worked on at once as flat arrays. Every number is rounded as the drawing's file
rounds it, so that a saved drawing gives the same picture.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .drawing import Stroke, Tip
from .params import Style

Floats = NDArray[np.float32]
TAPER = 0.5  # tips over which a line begins and ends
TURN_DIP = 0.15  # share of the pressure lost where a zigzag turns
TABLE = 8192  # random numbers that slow noise walks through


@dataclass(frozen=True, eq=False)
class Paths:
    """Paths of one coat: points (n, 2), pressure in N/mm^2 and leg of the zigzag at each, where each begins."""

    points: Floats
    pressure: Floats
    leg: NDArray[np.int32]
    first: NDArray[np.int64]  # (paths + 1,)


def draw(
    paths: Paths, scale_mm: float, crayon: str, tip: Tip, note: str, style: Style, rng: np.random.Generator
) -> list[Stroke]:
    """Strokes along paths given in units of `scale_mm`."""
    if len(paths.first) < 2:
        return []
    first, last = paths.first[:-1], paths.first[1:] - 1
    owner = np.repeat(np.arange(len(first)), np.diff(paths.first))
    path = paths.points.astype(np.float64) * scale_mm
    _overshoot(path, first, last, style.overshoot * tip.width_mm, rng)
    along, length = _lengths(path, first, last, owner)
    path += (
        _sideways(path, first, last)
        * (style.wobble * tip.width_mm * _slow(along / (4 * tip.width_mm), owner, rng))[:, None]
    )
    force = paths.pressure * (1 + style.swell * _slow(along / (5 * tip.width_mm), owner, rng))
    force *= _legs(paths.leg, first, style.force_spread, rng) * (1 - TURN_DIP * _turns(paths.leg, first, last))
    ends = np.minimum(along, length[owner] - along) / (TAPER * tip.width_mm)
    force *= np.clip(0.55 + 0.45 * ends, 0, 1)
    newton = np.clip(force * 0.785 * tip.width_mm**2 * style.press, 0.02, 60)
    xy, force_n = np.round(path, 3).astype(np.float32), np.round(newton, 3).astype(np.float32)
    return [Stroke(xy[a : b + 1], force_n[a : b + 1], crayon, tip, note) for a, b in zip(first, last, strict=True)]


def within(strokes: list[Stroke], width_mm: float, height_mm: float) -> list[Stroke]:
    """Strokes held back where they leave a sheet by more than its own size, which a drawing's file forbids.

    Only a thread of a sheet is so narrow that the hand slips that far.
    """
    size = np.array([width_mm, height_mm])
    low, high = np.round(-size, 3).astype(np.float32), np.round(2 * size, 3).astype(np.float32)
    if not strokes or _all_within(np.concatenate([s.path_mm for s in strokes]), low, high):
        return strokes
    return [s if _all_within(s.path_mm, low, high) else replace(s, path_mm=s.path_mm.clip(low, high)) for s in strokes]


def _all_within(points: Floats, low: Floats, high: Floats) -> bool:
    return bool(((low <= points) & (points <= high)).all())


def _overshoot(
    path: NDArray[np.float64], first: NDArray[np.int64], last: NDArray[np.int64], by_mm: float, rng: np.random.Generator
) -> None:
    """Move both ends of each path outwards along its direction, by the absolute value of a normal deviate."""
    inner = np.minimum(2, last - first)
    for end, near in ((first, first + inner), (last, last - inner)):
        direction = path[end] - path[near]
        norm = np.maximum(np.hypot(*direction.T), 1e-9)
        path[end] += direction / norm[:, None] * (by_mm * np.abs(rng.standard_normal(len(end))))[:, None]


def _lengths(
    path: NDArray[np.float64], first: NDArray[np.int64], last: NDArray[np.int64], owner: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Length along its path of each point, and of each path."""
    step = np.zeros(len(path))
    step[1:] = np.hypot(*np.diff(path, axis=0).T)
    step[first] = 0
    total = np.cumsum(step)
    along = total - total[first][owner]
    return along, along[last]


def _sideways(path: NDArray[np.float64], first: NDArray[np.int64], last: NDArray[np.int64]) -> NDArray[np.float64]:
    """Unit normal of each path at each of its points."""
    ahead, behind = np.arange(1, len(path) + 1), np.arange(-1, len(path) - 1)
    ahead[last], behind[first] = last, first
    tangent = path[ahead] - path[behind]
    tangent /= np.maximum(np.hypot(*tangent.T), 1e-9)[:, None]
    return np.stack([-tangent[:, 1], tangent[:, 0]], 1)


def _slow(along: NDArray[np.float64], owner: NDArray[np.int64], rng: np.random.Generator) -> NDArray[np.float64]:
    """Noise of about unit variance along each path, smooth over a length of 1."""
    table = rng.standard_normal(TABLE)
    at = rng.integers(TABLE, size=int(owner[-1]) + 1)[owner] + along
    low = at.astype(np.int64)
    part = at - low
    return np.asarray(table[low % TABLE] * (1 - part) + table[(low + 1) % TABLE] * part)


def _legs(
    leg: NDArray[np.int32], first: NDArray[np.int64], spread: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """A factor on the force for each leg, log-normal."""
    begins = np.zeros(len(leg), np.int64)
    begins[1:] = np.diff(leg) != 0
    begins[first] = 1
    number = np.cumsum(begins) - 1
    return np.asarray(np.exp(spread * rng.standard_normal(int(number[-1]) + 1))[number])


def _turns(leg: NDArray[np.int32], first: NDArray[np.int64], last: NDArray[np.int64]) -> NDArray[np.float64]:
    """1 at the points where one leg of a zigzag gives way to the next, fading over two points."""
    changes = np.diff(leg) != 0
    changes[last[:-1]] = False
    where = np.flatnonzero(changes)
    turn = np.zeros(len(leg))
    for offset, share in ((-1, 0.5), (2, 0.5), (0, 1.0), (1, 1.0)):
        turn[np.clip(where + offset, 0, len(leg) - 1)] = share
    return turn
