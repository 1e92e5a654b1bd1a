"""Which crayon, how hard, where: the gain of every crayon over what is on the sheet now.

The gain of hatching crayon k at pressure p is how much nearer the colour comes to the target, less a
price for grain (feather-light black on a light wall is pepper) and for going darker than the target,
which no crayon undoes.
"""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from .analysis import Scene, blur
from .colour import TO_LAB, TO_LMS, cube_root, oklab
from .jit import kernel
from .params import Pass
from .recipes import CLASH_PRICE, GRAIN_PRICE, TONE, Recipes, clash, nearest
from .swatches import Swatches

Floats = NDArray[np.float32]
STRANGER_PRICE = 0.015  # a free coat keeps to the recipe's crayons unless another gains this much more
RIVAL_SHARE = 0.55  # of the streaks' deviation: above it the rival base is taken
UNASKED = np.float32(-0.05)
SHARP = np.float32(1 / 0.008)  # how quickly a dearer pressure loses its say, per OKLab unit
BAND = 32


@dataclass(frozen=True, eq=False)
class Plan:
    """What stays the same from coat to coat: the scene, the crayons and how the scene's colours are made of them."""

    scene: Scene
    swatches: Swatches
    recipes: Recipes
    group: NDArray[np.int64]  # (h, w) recipe of each place
    threads: int


_cube_root = kernel(cube_root)


@kernel
def _gain(  # type: ignore[no-untyped-def]
    top, bottom, current, lab, need, pressures, a, b, grain, to_lms, to_lab, tone, dark_price, grain_price, gain, best
):
    """Best gain and pressure index of the needed crayons on rows top..bottom: gain, best (k, h, w)."""
    crayons = grain.shape[0]
    for y in range(top, bottom):
        for x in range(current.shape[1]):
            r, g, b0 = current[y, x, 0], current[y, x, 1], current[y, x, 2]
            now = np.float32(0)
            for k in range(-1, crayons):
                if k >= 0 and not (need[y, x] >> np.uint64(k)) & np.uint64(1):
                    continue
                top_gain, top_p = np.float32(-9), 0
                for p in range(pressures if k >= 0 else 1):
                    if k >= 0:
                        r1, g1, b1 = (
                            a[k, p, 0] * r + b[k, p, 0],
                            a[k, p, 1] * g + b[k, p, 1],
                            a[k, p, 2] * b0 + b[k, p, 2],
                        )
                    else:
                        r1, g1, b1 = r, g, b0
                    l0 = _cube_root(to_lms[0, 0] * r1 + to_lms[0, 1] * g1 + to_lms[0, 2] * b1)
                    m0 = _cube_root(to_lms[1, 0] * r1 + to_lms[1, 1] * g1 + to_lms[1, 2] * b1)
                    s0 = _cube_root(to_lms[2, 0] * r1 + to_lms[2, 1] * g1 + to_lms[2, 2] * b1)
                    dl = to_lab[0, 0] * l0 + to_lab[0, 1] * m0 + to_lab[0, 2] * s0 - lab[y, x, 0]
                    da = to_lab[1, 0] * l0 + to_lab[1, 1] * m0 + to_lab[1, 2] * s0 - lab[y, x, 1]
                    db = to_lab[2, 0] * l0 + to_lab[2, 1] * m0 + to_lab[2, 2] * s0 - lab[y, x, 2]
                    error = np.sqrt(tone * dl * dl + da * da + db * db)
                    if k < 0:
                        now = error
                        continue
                    error += dark_price * max(np.float32(0), -dl) + grain_price * grain[k, p]
                    if now - error > top_gain:
                        top_gain, top_p = now - error, p
                if k >= 0:
                    gain[k, y, x] = top_gain
                    best[k, y, x] = top_p


def gains(
    current: Floats, lab: Floats, swatches: Swatches, need: NDArray[np.uint64], coat: Pass, threads: int
) -> tuple[Floats, NDArray[np.int8]]:
    """Gain (k, h, w) of each needed crayon at its best pressure, and that pressure's index (k, h, w).

    current: linear colours on the sheet now (h, w, 3); lab: the target in OKLab (h, w, 3); need (h, w): a bit
    for each crayon in question. A crayon that is not has the gain UNASKED.
    """
    h, w = current.shape[:2]
    pressures = max(1, int((swatches.pressures <= coat.hardest).sum()))
    gain = np.full((len(swatches.names), h, w), UNASKED, np.float32)
    best = np.zeros(gain.shape, np.int8)
    weights = np.float32(coat.tone), np.float32(coat.dark_price), np.float32(GRAIN_PRICE)

    def band(top: int) -> None:
        _gain(top, min(h, top + BAND), current, lab, need, pressures, swatches.a, swatches.b, swatches.grain,
              TO_LMS, TO_LAB, *weights, gain, best)  # fmt: skip

    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(band, range(0, h, BAND)))
    return gain, best


@kernel
def _base(top, bottom, lab, group, base, shade, paper, a, b, grain, log_p, to_lms, to_lab, grain_price, sharp, out):  # type: ignore[no-untyped-def]
    """Softly chosen pressure of the base coat for each cell, looking ahead to the shade over it."""
    pressures = log_p.size
    light = np.empty(3, np.float32)
    cost = np.empty(pressures * (pressures + 1), np.float32)
    for y in range(top, bottom):
        for x in range(lab.shape[1]):
            k1, k2 = base[group[y, x]], shade[group[y, x]]
            number = 0
            for p1 in range(pressures):
                for p2 in range(-1, pressures if k1 != k2 else 0):  # -1: no shade
                    price = grain[k1, p1]
                    for c in range(3):
                        light[c] = a[k1, p1, c] * paper[c] + b[k1, p1, c]
                    if p2 >= 0:
                        price = (
                            price * (a[k2, p2, 0] + a[k2, p2, 1] + a[k2, p2, 2]) / 3 + np.float32(0.7) * grain[k2, p2]
                        )
                        for c in range(3):
                            light[c] = a[k2, p2, c] * light[c] + b[k2, p2, c]
                    l0 = _cube_root(to_lms[0, 0] * light[0] + to_lms[0, 1] * light[1] + to_lms[0, 2] * light[2])
                    m0 = _cube_root(to_lms[1, 0] * light[0] + to_lms[1, 1] * light[1] + to_lms[1, 2] * light[2])
                    s0 = _cube_root(to_lms[2, 0] * light[0] + to_lms[2, 1] * light[1] + to_lms[2, 2] * light[2])
                    error = np.float32(0)
                    for c in range(3):
                        d = to_lab[c, 0] * l0 + to_lab[c, 1] * m0 + to_lab[c, 2] * s0 - lab[y, x, c]
                        error += d * d
                    cost[number] = np.sqrt(error) + grain_price * price
                    number += 1
            least = cost[0]
            for m in range(1, number):
                least = min(least, cost[m])
            each = number // pressures
            total, mean = np.float32(0), np.float32(0)
            for m in range(number):
                weight = np.exp((least - cost[m]) * sharp)
                total += weight
                mean += weight * log_p[m // each]
            out[y, x] = np.exp(mean / total)


def base_pressure(plan: Plan, lab: Floats) -> Floats:
    """Pressure (h, w) of the base coat that, with the shade to come, brings each place nearest to its target.

    Choices of nearly equal worth are averaged, so pressure follows tone without steps.
    """
    out = np.empty(lab.shape[:2], np.float32)
    recipes, swatches = plan.recipes, plan.swatches
    log_p = np.log(swatches.pressures)

    def band(top: int) -> None:
        _base(top, min(len(out), top + BAND), lab, plan.group, recipes.base, recipes.shade, swatches.paper,
              swatches.a, swatches.b, swatches.grain, log_p, TO_LMS, TO_LAB, np.float32(GRAIN_PRICE), SHARP,
              out)  # fmt: skip

    with ThreadPoolExecutor(plan.threads) as pool:
        list(pool.map(band, range(0, len(out), BAND)))
    return out


def plates(
    plan: Plan, current: Floats, aim: Floats, coat: Pass, cells: float, flat: float, streak: Floats
) -> dict[int, Floats]:
    """The pressure (h, w) wanted of each crayon that is wanted at all: one crayon at most in each place.

    The recipe says which crayon a base or shade coat takes; a free coat takes the one of most worth. A line
    goes on while the tip as a whole gains.
    """
    swatches, recipes, group = plan.swatches, plan.recipes, plan.group
    if coat.kind == "base":
        chosen = np.where(streak > RIVAL_SHARE, recipes.rival[group], recipes.base[group])
    elif coat.kind == "shade":
        chosen = recipes.shade[group]
    else:
        chosen = _worthiest(plan, current, aim, coat, cells)
    reach = 2 * int(np.ceil(2 * coat.edge * cells)) + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (reach, reach))
    need = np.zeros(chosen.shape, np.uint64)
    for k in np.unique(chosen):
        need |= cv2.dilate((chosen == k).astype(np.uint8), disc).astype(np.uint64) << np.uint64(k)
    gain, best = gains(current, aim, swatches, need, coat, plan.threads)
    steps = np.log(swatches.pressures)
    level = np.log(np.minimum(base_pressure(plan, aim), coat.hardest)) if coat.kind == "base" else None
    wants = {}
    for k in np.unique(chosen):
        here = (chosen == k) & (plan.scene.detail >= coat.detail) & (blur(gain[k], coat.edge * cells) > coat.gain)
        if here.any():
            log_p = blur(steps[best[k]] if level is None else level, 0.3 * cells)
            if flat > 0:
                log_p = (1 - flat) * log_p + flat * _group_means(log_p, group, here)
            wants[int(k)] = np.where(here, np.exp(log_p), 0).astype(np.float32)
    return wants


def _group_means(values: Floats, group: NDArray[np.int64], here: NDArray[np.bool_]) -> Floats:
    """Each place's value replaced by the mean of its group over the places that count."""
    total = np.bincount(group[here], values[here], int(group.max()) + 1)
    count = np.bincount(group[here], minlength=len(total))
    return (total / np.maximum(count, 1))[group].astype(np.float32)


def _worthiest(plan: Plan, current: Floats, aim: Floats, coat: Pass, cells: float) -> NDArray[np.int64]:
    """The crayon (h, w) that gains most, where neighbours agree over `coat.cohere` tips; on a grid half as fine."""
    h, w = aim.shape[:2]
    half = (w // 2, h // 2)
    swatches, recipes = plan.swatches, plan.recipes
    group = cv2.resize(plan.group.astype(np.int16), half, interpolation=cv2.INTER_NEAREST).astype(np.int64)
    used = recipes.crayons()
    need = np.full((half[1], half[0]), sum(1 << k for k in used), np.uint64)
    now, then = (np.asarray(cv2.resize(m, half, interpolation=cv2.INTER_AREA), np.float32) for m in (current, aim))
    gain, _ = gains(now, then, swatches, need, coat, plan.threads)
    worth = np.full(gain.shape, -9, np.float32)
    hues = oklab(swatches.over(swatches.paper))[:, -3, 1:]
    for k in used:
        home = (recipes.base[group] == k) | (recipes.shade[group] == k)
        worth[k] = blur(gain[k], 0.5 * coat.cohere * cells) - np.where(home, 0, STRANGER_PRICE)
        worth[k] -= CLASH_PRICE * clash(hues[k], then[..., 1:])
    return cv2.resize(worth.argmax(0).astype(np.int16), (w, h), interpolation=cv2.INTER_NEAREST).astype(np.int64)


def grouped(lab: Floats, recipes: Recipes, sigma: float, ragged: Floats) -> NDArray[np.int64]:
    """The recipe (h, w) of each place: its nearest group of colours, after neighbours have voted.

    `ragged` (h, w) tilts the votes to and fro in streaks, so that areas meet as hatching does.
    """
    label = nearest(lab * np.array([TONE, 1, 1], np.float32), recipes.centres)
    most, winner = np.full(label.shape, -1, np.float32), np.zeros(label.shape, np.int64)
    for g in range(len(recipes.centres)):
        votes = blur((label == g).astype(np.float32), sigma)
        votes += ragged * (votes > 0.02) * (1 if g % 2 else -1)
        winner[votes > most] = g
        most = np.maximum(most, votes)
    return winner


def streaks(shape: tuple[int, ...], cells: float, wrist_deg: float, rng: np.random.Generator) -> Floats:
    """Noise of unit variance in streaks along the wrist's direction, about one line wide and ten long."""
    angle = np.deg2rad(wrist_deg)
    y, x = np.mgrid[: shape[0], : shape[1]].astype(np.float32)
    along = (x * np.cos(angle) + y * np.sin(angle)) / (9 * cells)
    across = (y * np.cos(angle) - x * np.sin(angle)) / (1.3 * cells)
    along, across = along - along.min(), across - across.min()
    noise = rng.standard_normal((int(across.max()) + 3, int(along.max()) + 3)).astype(np.float32)
    return np.asarray(cv2.remap(noise, along.astype(np.float32), across.astype(np.float32), cv2.INTER_LINEAR))
