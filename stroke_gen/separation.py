"""Separation: how hard each crayon is pressed where, one smooth plate for each.

What a surface's crayons give at all their pressures is compared with the photo; choices of nearly
equal worth are averaged, so that pressure follows tone without steps. The plates are worked out on
a coarse grid and spread along the photo's colours (see guide.py), whatever surfaces they cross.
"""

from concurrent.futures import Executor
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from .jit import kernel
from .mixing import LAYERS, Mixtures, combine, few, wax
from .scene import Scene
from .swatches import Swatches

Floats = NDArray[np.float32]
SHARP = np.float32(1 / 0.012)  # how quickly a dearer choice loses its say, per OKLab unit
# OKLab units: a crayon that makes less difference is pressed less, or not taken
WORTH = np.float32(0.008)
FAINT = 0.45  # of the lightest pressure of the table: below it the hand stays away


@dataclass(frozen=True, eq=False)
class Plan:
    """What stays the same from coat to coat: the scene, and the crayons that make its surfaces."""

    scene: Scene
    crayons: list[int]  # of the box
    swatches: Swatches  # of these crayons
    mixtures: Mixtures
    pool: Executor  # over whose threads work is spread


@kernel
def _soften(cells, aim, ground, same, crayons, pressures, wax, dark_price, sharp, level):  # type: ignore[no-untyped-def]
    """Level (layers, n) of each crayon for the cells (n,): 0 none, 1 the lightest pressure of the
    table, and so on.

    same: whether all cells have the ground of the first.
    """
    count, levels = crayons.size, pressures.size
    total = levels**count
    colour, price = np.empty((total, 3), np.float32), np.empty(total, np.float32)
    cost, mean, without = (
        np.empty(total, np.float32),
        np.empty(count, np.float32),
        np.empty(count, np.float32),
    )
    for i in range(cells.size):
        at = cells[i]
        if i == 0 or not same:
            combine(ground[at], crayons, pressures, wax, colour, price)
        # What each choice costs, and the least that can be had without each of the crayons.
        least = np.float32(np.inf)
        without[:] = np.inf
        for m in range(total):
            dl, da, db = (
                colour[m, 0] - aim[at, 0],
                colour[m, 1] - aim[at, 1],
                colour[m, 2] - aim[at, 2],
            )
            cost[m] = (
                np.sqrt(dl * dl + da * da + db * db)
                + price[m]
                + dark_price * max(np.float32(0), -dl)
            )
            least = min(least, cost[m])
            rest, step = m, total // levels
            for n in range(count):
                if rest < step:  # the first of the pressures, which is none
                    without[n] = min(without[n], cost[m])
                rest %= step
                step = max(step // levels, 1)
        # The mean of the choices that are nearly as good as the best.
        mean[:] = 0
        all_ = np.float32(0)
        for m in range(total):
            worse = (cost[m] - least) * sharp
            if worse < 12:  # beyond, no digit of the mean would change
                weight = np.exp(-worse)
                all_ += weight
                rest, step = m, total // levels
                for n in range(count):
                    mean[n] += weight * pressures[rest // step]
                    rest %= step
                    step = max(step // levels, 1)
        for n in range(count):
            worth = min((without[n] - least) / WORTH, np.float32(1))
            level[n, i] = worth * mean[n] / all_


def plates(plan: Plan, now: Floats, turn: int | None, dark_price: float) -> dict[int, Floats]:
    """Pressure (h, w) wanted of each crayon that is wanted at all.

    now: what the sheet shows, linear (h, w, 3). turn: the layer that comes next, 0 to LAYERS - 1,
    with all that come after it in mind; None when all have been laid, and each may be pressed once
    more.
    """
    scene, swatches = plan.scene, plan.swatches
    guide = scene.guide
    shape = guide.coarse.shape[:2]
    ground = np.asarray(
        cv2.resize(now, shape[::-1], interpolation=cv2.INTER_AREA), np.float32
    ).reshape(-1, 3)
    aim = guide.coarse.reshape(-1, 3)
    label = cv2.resize(scene.family, shape[::-1], interpolation=cv2.INTER_NEAREST_EXACT).ravel()
    full = np.arange(len(swatches.pressures) + 1)
    table = wax(swatches)
    levels = np.zeros((len(swatches.names), label.size), np.float32)
    where = np.argsort(label, kind="stable")
    first = np.searchsorted(label[where], np.arange(len(plan.mixtures.layers) + 1))

    def surface(g: int) -> None:
        layers = plan.mixtures.layers[g]
        left = layers[turn or 0 :]
        left = left[left >= 0]
        if not left.size:
            return
        cells = where[first[g] : first[g + 1]]
        level = np.empty((left.size, cells.size), np.float32)
        many = left.size >= (LAYERS if turn is not None else LAYERS - 1)
        _soften(
            cells,
            aim,
            ground,
            turn == 0,
            left,
            few(len(full) - 1) if many else full,
            table,
            np.float32(dark_price),
            SHARP,
            level,
        )
        for k, own in zip(left[: None if turn is None else 1], level, strict=False):
            levels[k, cells] = own

    list(plan.pool.map(surface, range(len(plan.mixtures.layers))))
    used = [int(k) for k in np.flatnonzero(levels.any(1))]

    def plate(k: int) -> Floats:
        return pressed(guide.spread(levels[k].reshape(shape)), swatches)

    return {k: want for k, want in zip(used, plan.pool.map(plate, used), strict=True) if want.any()}


def pressed(level: Floats, swatches: Swatches) -> Floats:
    """Pressure in N/mm^2 of levels (h, w) of the table, 0 where the hand stays away."""
    steps = np.log(swatches.pressures)
    pressure = np.exp(np.interp(level, np.arange(1, len(steps) + 1), steps))
    return np.where(level < FAINT, 0, pressure).astype(np.float32)
