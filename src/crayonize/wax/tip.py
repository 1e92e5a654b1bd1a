"""Crayon tips: 2D height masks that touch the paper (section 3.1 of the paper).

A mask holds, on the sheet's cells, the distance in um from the tip's lowest point to its surface;
cells that are no part of the tip hold `ABSENT`. Shapes are given in mm, so a tip looks the same at
every resolution. A little smooth noise stands for the bumps and hollows of real wax: they draw the
long streaks along a stroke.
"""

import functools

import cv2
import numpy as np
from numpy.typing import NDArray

from stroke_gen.drawing import RIM_FROM, RIM_INNER, SIDE_MM, Tip

ABSENT = np.float32(1e9)
BUMP_UM = 10.0  # about a quarter of a drawing paper's tooth
BUMP_MM = 0.75  # wavelength of the bumps across the crayon's way ...
GROOVE = 8.0  # ... and how many times longer they are along it
DROPS_UM = {"sharp": 110.0, "blunt": 32.0, "rim": 60.0, "side": 40.0}  # centre to edge


def mask(
    tip: Tip,
    cell_mm: float,
    rng: np.random.Generator,
    heading_rad: float = 0.0,
    worn_um: float = 0.0,
) -> NDArray[np.float32]:
    """The mask of a tip on a grid of `cell_mm`, with grooves along `heading_rad`, the way it moves.

    worn_um: mean height that has been rubbed off, which cuts its profile flat from below; the bumps
    come anew. Returns (n, n) float32 in um with n odd, the lowest present cell at 0.
    """
    if tip.kind not in DROPS_UM:
        raise ValueError(f"tip.kind: {tip.kind!r} is none of {', '.join(DROPS_UM)}")
    if not 0 < tip.width_mm <= 100:
        raise ValueError(f"tip.width_mm: {tip.width_mm} is not between 0 and 100")
    shape, present = _shape(tip, cell_mm)
    shape = np.maximum(shape - _level(shape[present], worn_um), 0)
    height = shape + BUMP_UM * _bumps(len(shape), _groove(BUMP_MM / cell_mm, heading_rad), rng)
    return np.where(present, height - height[present].min(), ABSENT).astype(np.float32)


@functools.cache
def flat_um(tip: Tip) -> float:
    """Mean height to be rubbed off a fresh tip until it is flat to its full width."""
    shape, present = _shape(tip, tip.width_mm / 64)
    return max(float((shape[present].max() - shape[present]).mean()), 1e-3)


def _level(heights: NDArray[np.float64], mean_um: float) -> float:
    """At which height a tip is cut when a mean of `mean_um` of it is gone."""
    rising = np.sort(heights)
    number = np.arange(1, rising.size + 1)
    lost = number * rising - np.cumsum(rising)  # summed, when cut at each of the heights
    at = int(np.searchsorted(lost, mean_um * rising.size, "right"))
    below = rising[:at]
    return float((mean_um * rising.size + below.sum()) / at) if at else 0.0


@functools.lru_cache(maxsize=8)
def _shape(tip: Tip, cell_mm: float) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Height in um of a tip without bumps, and which cells belong to it."""
    half = max(0.5 * tip.width_mm / cell_mm, 0.75)
    n = 2 * int(np.ceil(half)) + 1
    y, x = (np.mgrid[:n, :n] - n // 2) / half
    angle = np.deg2rad(tip.angle_deg)
    along, across = x * np.cos(angle) + y * np.sin(angle), y * np.cos(angle) - x * np.sin(angle)
    rise, present = _profile(tip, along, across, np.hypot(x, y))
    present[n // 2, n // 2] |= not present.any()  # finer than a cell
    return DROPS_UM[tip.kind] * rise, present


def _profile(
    tip: Tip, along: NDArray[np.float64], across: NDArray[np.float64], radius: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Height over the lowest point as a fraction of the drop, and which cells belong to the tip."""
    if tip.kind == "sharp":
        return radius**2, radius <= 1
    if tip.kind == "blunt":
        return radius**4, radius <= 1
    if tip.kind == "rim":  # the worn back end: one side of a ring touches, the hollow stays above
        return (radius - 0.75) ** 2 * 4 + 0.6 * (1 - along), (radius <= 1) & (
            radius > RIM_INNER
        ) & (along > RIM_FROM)
    breadth = max(SIDE_MM / tip.width_mm, 1e-3)
    return (across / breadth) ** 2, (np.abs(across) <= breadth) & (np.abs(along) <= 1)


@functools.lru_cache(maxsize=16)
def _groove(wavelength: float, heading_rad: float) -> NDArray[np.float32]:
    """What smooths noise to bumps `wavelength` cells across the heading and GROOVE times that along
    it.
    """
    across = max(0.3 * wavelength, 0.4)
    along = GROOVE * across
    reach = int(np.ceil(2.5 * along))
    y, x = np.mgrid[-reach : reach + 1, -reach : reach + 1]
    u = (x * np.cos(heading_rad) + y * np.sin(heading_rad)) / along
    v = (y * np.cos(heading_rad) - x * np.sin(heading_rad)) / across
    return np.asarray(np.exp(-0.5 * (u * u + v * v)), np.float32)


def _bumps(n: int, groove: NDArray[np.float32], rng: np.random.Generator) -> NDArray[np.float64]:
    """Smooth noise (n, n) in [-1, 1]."""
    noise = rng.standard_normal((n, n)).astype(np.float32)
    smooth = cv2.filter2D(noise, -1, groove, borderType=cv2.BORDER_REFLECT)
    return np.clip(smooth / (2 * smooth.std() + 1e-9), -1, 1).astype(np.float64)
