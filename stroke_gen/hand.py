"""The hand: from ideal paths to strokes with swelling pressure, wobble and overshoot.

Every number a stroke holds is rounded as its file rounds it, so a saved drawing gives the same picture.
"""

import numpy as np
from numpy.typing import NDArray

from .drawing import Stroke, Tip
from .params import Style

Floats = NDArray[np.float32]
TAPER = 0.5  # tips over which a line begins and ends
TURN_DIP = 0.15  # of the pressure lost where a zigzag turns


def stroke(
    path_mm: Floats, leg: NDArray[np.int32], pressure: Floats, crayon: str, tip: Tip, note: str, style: Style,
    rng: np.random.Generator,
) -> Stroke:  # fmt: skip
    """A stroke along `path_mm` (n, 2) with `pressure` (n,) in N/mm^2; `leg` numbers the legs of a zigzag."""
    path = _overshoot(path_mm, style.overshoot * tip.width_mm * abs(rng.normal()), style.overshoot * tip.width_mm * abs(rng.normal()))
    step = np.append(0, np.hypot(*np.diff(path, axis=0).T))
    along = np.cumsum(step)
    path = path + _wobble(path, along, tip.width_mm, style, rng)
    force = pressure * np.exp(style.force_spread * rng.standard_normal(int(leg.max()) + 1))[leg]
    force = force * (1 + style.swell * _slow_noise(along, 5 * tip.width_mm, rng))
    ends = np.minimum(along, along[-1] - along) / (TAPER * tip.width_mm)
    force = force * np.clip(0.55 + 0.45 * ends, 0, 1) * (1 - TURN_DIP * _turns(leg))
    area = 0.785 * tip.width_mm**2
    newton = np.clip(force * area * style.press, 0.02, 60)
    return Stroke(np.round(path, 3).astype(np.float32), np.round(newton, 3).astype(np.float32), crayon, tip, note)


def _overshoot(path: Floats, before: float, after: float) -> Floats:
    """The path with its two ends moved outwards along its direction."""
    if len(path) < 3:
        return path
    out = path.astype(np.float64).copy()
    for end, near, by in ((0, 2, before), (-1, -3, after)):
        direction = path[end] - path[near]
        norm = float(np.hypot(*direction))
        if norm > 0:
            out[end] += direction / norm * by
    return out.astype(np.float32)


def _wobble(path: Floats, along: NDArray[np.float64], width: float, style: Style, rng: np.random.Generator) -> Floats:
    """Sideways deviation of a hand: smooth noise a few tips long."""
    if len(path) < 3:
        return np.zeros_like(path)
    direction = np.gradient(path, axis=0)
    direction /= np.maximum(np.hypot(direction[:, 0], direction[:, 1]), 1e-6)[:, None]
    sideways = style.wobble * width * _slow_noise(along, 4 * width, rng)
    return np.asarray(np.stack([-direction[:, 1], direction[:, 0]], 1) * sideways[:, None], np.float32)


def _slow_noise(along: NDArray[np.float64], wavelength: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """Noise of unit variance along a path, smooth over `wavelength`."""
    knots = int(along[-1] / wavelength) + 3
    return np.asarray(np.interp(along / wavelength, np.arange(knots), rng.standard_normal(knots)))


def _turns(leg: NDArray[np.int32]) -> NDArray[np.float64]:
    """1 at the points where one leg of a zigzag gives way to the next, fading over two points."""
    turn = np.zeros(len(leg))
    where = np.flatnonzero(np.diff(leg))
    for offset, share in ((-1, 0.5), (0, 1.0), (1, 1.0), (2, 0.5)):
        turn[np.clip(where + offset, 0, len(leg) - 1)] = share
    return turn


def fill_gaps(pressure: Floats) -> Floats:
    """The pressure where a line crosses ground that wants none: from its neighbours along the line."""
    wanted = pressure > 0
    if wanted.all() or not wanted.any():
        return pressure
    at = np.arange(len(pressure))
    return np.interp(at, at[wanted], pressure[wanted]).astype(np.float32)
