"""Which crayon, how hard, where: the gain of every crayon over what is on the sheet now.

The gain of hatching crayon k at pressure p is how much nearer the colour comes to the target, less a
price for grain (feather-light black on a light wall is pepper) and for going darker than the target,
which no crayon undoes.
"""

from concurrent.futures import Executor
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from .analysis import Scene, blur
from .colour import TO_LAB, TO_LMS, cube_root, oklab
from .jit import kernel, lean_kernel
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
    pool: Executor  # over whose threads work is spread


_cube_root = kernel(cube_root)


@lean_kernel
def _off(light, lab, a, b, to_lms, to_lab, tone, dark_price, price, off):  # type: ignore[no-untyped-def]
    """What is off (n,) where the lights (3, n) have become a * light + b, against lab (3, n).

    Colours lie in columns and all else in plain variables, so that the compiler can use vectors.
    """
    a0, a1, a2 = a[0], a[1], a[2]
    b0, b1, b2 = b[0], b[1], b[2]
    l0, l1, l2 = to_lms[0, 0], to_lms[0, 1], to_lms[0, 2]
    m0, m1, m2 = to_lms[1, 0], to_lms[1, 1], to_lms[1, 2]
    s0, s1, s2 = to_lms[2, 0], to_lms[2, 1], to_lms[2, 2]
    t0, t1, t2 = to_lab[0, 0], to_lab[0, 1], to_lab[0, 2]
    u0, u1, u2 = to_lab[1, 0], to_lab[1, 1], to_lab[1, 2]
    v0, v1, v2 = to_lab[2, 0], to_lab[2, 1], to_lab[2, 2]
    for i in range(off.size):
        red, green, blue = a0 * light[0, i] + b0, a1 * light[1, i] + b1, a2 * light[2, i] + b2
        long = _cube_root(l0 * red + l1 * green + l2 * blue)
        medium = _cube_root(m0 * red + m1 * green + m2 * blue)
        short = _cube_root(s0 * red + s1 * green + s2 * blue)
        lighter = t0 * long + t1 * medium + t2 * short - lab[0, i]
        redder = u0 * long + u1 * medium + u2 * short - lab[1, i]
        yellower = v0 * long + v1 * medium + v2 * short - lab[2, i]
        error = np.sqrt(tone * lighter * lighter + redder * redder + yellower * yellower)
        off[i] = error + (dark_price * max(np.float32(0), -lighter) + price)


@kernel
def _gain(top, left, current, lab, need, a, b, grain, to_lms, to_lab, tone, dark_price, grain_price, gain, best):  # type: ignore[no-untyped-def]
    """Gain and pressure index (h, w) of a crayon in a window whose corner is (top, left), where `need` (h, w) is set.

    a, b and grain have a row for each pressure.
    """
    number = 0
    for asked in need.flat:
        number += asked != 0
    light, target = np.empty((3, number), np.float32), np.empty((3, number), np.float32)
    i = 0
    for y in range(need.shape[0]):
        for x in range(need.shape[1]):
            if need[y, x]:
                for c in range(3):
                    light[c, i], target[c, i] = current[top + y, left + x, c], lab[top + y, left + x, c]
                i += 1
    now, off = np.empty(number, np.float32), np.empty(number, np.float32)
    most, which = np.full(number, np.float32(-9)), np.zeros(number, np.int8)
    same, nothing, zero = np.ones(3, np.float32), np.zeros(3, np.float32), np.float32(0)
    _off(light, target, same, nothing, to_lms, to_lab, tone, zero, zero, now)
    for p in range(grain.size):
        _off(light, target, a[p], b[p], to_lms, to_lab, tone, dark_price, grain_price * grain[p], off)
        for i in range(number):
            better = now[i] - off[i] > most[i]
            most[i] = now[i] - off[i] if better else most[i]
            which[i] = p if better else which[i]
    i = 0
    for y in range(need.shape[0]):
        for x in range(need.shape[1]):
            if need[y, x]:
                gain[y, x], best[y, x] = most[i], which[i]
                i += 1


def gains(
    current: Floats, lab: Floats, corner: tuple[int, int], need: NDArray[np.uint8],
    swatches: Swatches, k: int, coat: Pass,
) -> tuple[Floats, NDArray[np.int8]]:  # fmt: skip
    """Gain of crayon k at its best pressure, and that pressure's index, in a window where it is needed.

    current: linear colours on the sheet now (h, w, 3); lab: the target in OKLab (h, w, 3); corner: row and column
    of the window's; need: the window, not 0 where the crayon is in question. Elsewhere its gain is UNASKED.
    """
    pressures = max(1, int((swatches.pressures <= coat.hardest).sum()))
    gain, best = np.full(need.shape, UNASKED, np.float32), np.zeros(need.shape, np.int8)
    weights = np.float32(coat.tone), np.float32(coat.dark_price), np.float32(GRAIN_PRICE)
    table = (m[k, :pressures] for m in (swatches.a, swatches.b, swatches.grain))
    _gain(*corner, current, lab, need, *table, TO_LMS, TO_LAB, *weights, gain, best)
    return gain, best


@kernel
def _mixed(base, shade, paper, a, b, grain, to_lms, to_lab, grain_price, colour, price):  # type: ignore[no-untyped-def]
    """OKLab (3, choices) and price of one crayon at every pressure, bare and with the other over it.

    Choices are in the order of the base's pressure; returns how many there are.
    """
    pressures = grain.shape[1]
    light = np.empty(3, np.float32)
    number = 0
    for p1 in range(pressures):
        for p2 in range(-1, pressures if base != shade else 0):  # -1: no shade
            dots = grain[base, p1]
            for c in range(3):
                light[c] = a[base, p1, c] * paper[c] + b[base, p1, c]
            if p2 >= 0:
                through = (a[shade, p2, 0] + a[shade, p2, 1] + a[shade, p2, 2]) / 3
                dots = dots * through + np.float32(0.7) * grain[shade, p2]
                for c in range(3):
                    light[c] = a[shade, p2, c] * light[c] + b[shade, p2, c]
            l0 = _cube_root(to_lms[0, 0] * light[0] + to_lms[0, 1] * light[1] + to_lms[0, 2] * light[2])
            m0 = _cube_root(to_lms[1, 0] * light[0] + to_lms[1, 1] * light[1] + to_lms[1, 2] * light[2])
            s0 = _cube_root(to_lms[2, 0] * light[0] + to_lms[2, 1] * light[1] + to_lms[2, 2] * light[2])
            for c in range(3):
                colour[c, number] = to_lab[c, 0] * l0 + to_lab[c, 1] * m0 + to_lab[c, 2] * s0
            price[number] = grain_price * dots
            number += 1
    return number


@kernel
def _base(top, bottom, lab, group, colour, price, choices, log_p, sharp, out):  # type: ignore[no-untyped-def]
    """Softly chosen pressure of the base coat for each cell, by what its recipe's choices give."""
    cost = np.empty(price.shape[1], np.float32)
    for y in range(top, bottom):
        for x in range(lab.shape[1]):
            g = group[y, x]
            number = choices[g]
            l0, a0, b0 = lab[y, x]
            least = np.float32(np.inf)
            for m in range(number):
                dl, da, db = colour[g, 0, m] - l0, colour[g, 1, m] - a0, colour[g, 2, m] - b0
                cost[m] = np.sqrt(dl * dl + da * da + db * db) + price[g, m]
                least = min(least, cost[m])
            each = number // log_p.size
            total, mean = np.float32(0), np.float32(0)
            for m in range(number):
                worse = (cost[m] - least) * sharp
                if worse < 16:  # beyond, no digit of the mean would change
                    weight = np.exp(-worse)
                    total += weight
                    mean += weight * log_p[m // each]
            out[y, x] = np.exp(mean / total)


def base_pressure(plan: Plan, lab: Floats) -> Floats:
    """Pressure (h, w) of the base coat that, with the shade to come, brings each place nearest to its target.

    Choices of nearly equal worth are averaged, so pressure follows tone without steps.
    """
    recipes, swatches = plan.recipes, plan.swatches
    groups, pressures = len(recipes.base), len(swatches.pressures)
    colour = np.empty((groups, 3, pressures * (pressures + 1)), np.float32)
    price, choices = np.empty(colour[:, 0].shape, np.float32), np.empty(groups, np.int64)
    for g in range(groups):
        choices[g] = _mixed(recipes.base[g], recipes.shade[g], swatches.paper, swatches.a, swatches.b, swatches.grain,
                            TO_LMS, TO_LAB, np.float32(GRAIN_PRICE), colour[g], price[g])  # fmt: skip
    out, log_p = np.empty(lab.shape[:2], np.float32), np.log(swatches.pressures)

    def band(top: int) -> None:
        _base(top, min(len(out), top + BAND), lab, plan.group, colour, price, choices, log_p, SHARP, out)

    list(plan.pool.map(band, range(0, len(out), BAND)))
    return out


def plates(
    plan: Plan, current: Floats, aim: Floats, coat: Pass, cells: float, flat: float, streak: Floats
) -> dict[int, Floats]:
    """The pressure (h, w) wanted of each crayon that is wanted at all: one crayon at most in each place.

    The recipe says which crayon a base or shade coat takes; a free coat takes the one of most worth. A line
    goes on while the tip as a whole gains.
    """
    swatches, group = plan.swatches, plan.group
    chosen = _chosen(plan, current, aim, coat, cells, streak)
    careful = (plan.scene.detail >= coat.detail).astype(np.uint8)
    steps = np.log(swatches.pressures)
    level = np.log(np.minimum(base_pressure(plan, aim), coat.hardest)) if coat.kind == "base" else None
    reach = int(np.ceil(2 * coat.edge * cells))
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach + 1, 2 * reach + 1))
    margin = reach + int(4 * max(coat.edge, 0.3) * cells) + 2  # as far as blurs reach

    def plate(k: int) -> Floats | None:
        """One crayon's plate, worked out in the window in which it has been chosen."""
        mine = (chosen == k).astype(np.uint8)
        window = _around(mine & careful, margin)
        near = np.asarray(cv2.dilate(mine[window], disc), np.uint8)
        gain, best = gains(current, aim, (window[0].start, window[1].start), near, swatches, k, coat)
        here = (mine & careful)[window].astype(bool) & (blur(gain, coat.edge * cells) > coat.gain)
        if not here.any():
            return None
        log_p = blur(steps[best] if level is None else level[window], 0.3 * cells)
        if flat > 0:
            log_p = (1 - flat) * log_p + flat * _group_means(log_p, group[window], here)
        want = np.zeros(mine.shape, np.float32)
        want[window] = np.where(here, np.exp(log_p), 0)
        return want

    crayons = np.flatnonzero(np.bincount(chosen[careful > 0])).tolist()
    return {k: want for k, want in zip(crayons, plan.pool.map(plate, crayons), strict=True) if want is not None}


def _chosen(plan: Plan, current: Floats, aim: Floats, coat: Pass, cells: float, streak: Floats) -> NDArray[np.uint8]:
    """The crayon (h, w) that a coat takes in each place."""
    recipes = plan.recipes
    base, shade, rival = (m.astype(np.uint8)[plan.group] for m in (recipes.base, recipes.shade, recipes.rival))
    if coat.kind == "base":
        return np.where(streak > RIVAL_SHARE, rival, base)
    return shade if coat.kind == "shade" else _worthiest(plan, current, aim, coat, cells)


def _around(mask: NDArray[np.uint8], margin: int) -> tuple[slice, slice]:
    """Rows and columns of the window round all that is marked."""
    left, top, width, height = cv2.boundingRect(mask)
    return slice(max(0, top - margin), top + height + margin), slice(max(0, left - margin), left + width + margin)


def _group_means(values: Floats, group: NDArray[np.int64], here: NDArray[np.bool_]) -> Floats:
    """Each place's value replaced by the mean of its group over the places that count."""
    total = np.bincount(group[here], values[here], int(group.max()) + 1)
    count = np.bincount(group[here], minlength=len(total))
    return (total / np.maximum(count, 1))[group].astype(np.float32)


def _worthiest(plan: Plan, current: Floats, aim: Floats, coat: Pass, cells: float) -> NDArray[np.uint8]:
    """The crayon (h, w) that gains most, where neighbours agree over `coat.cohere` tips; on a grid half as fine."""
    h, w = aim.shape[:2]
    half = (w // 2, h // 2)
    swatches, recipes = plan.swatches, plan.recipes
    group = cv2.resize(plan.group.astype(np.int16), half, interpolation=cv2.INTER_NEAREST)
    base, shade = recipes.base[group], recipes.shade[group]
    now, then = (np.asarray(cv2.resize(m, half, interpolation=cv2.INTER_AREA), np.float32) for m in (current, aim))
    everywhere = np.ones(base.shape, np.uint8)
    hues = oklab(swatches.over(swatches.paper))[:, -3, 1:]

    def worth(k: int) -> Floats:
        gain, _ = gains(now, then, (0, 0), everywhere, swatches, k, coat)
        price = np.float32(CLASH_PRICE) * clash(hues[k], then[..., 1:])
        price += np.where((base == k) | (shade == k), 0, np.float32(STRANGER_PRICE))
        return blur(gain, 0.5 * coat.cohere * cells) - price

    used = recipes.crayons()
    best = np.stack(list(plan.pool.map(worth, used))).argmax(0).astype(np.uint8)
    return np.array(used, np.uint8)[cv2.resize(best, (w, h), interpolation=cv2.INTER_NEAREST)]


def grouped(lab: Floats, recipes: Recipes, sigma: float, ragged: Floats, pool: Executor) -> NDArray[np.int64]:
    """The recipe (h, w) of each place: its nearest group of colours, after neighbours have voted.

    `ragged` (h, w) tilts the votes to and fro in streaks, so that areas meet as hatching does.
    """
    label = nearest(lab * np.array([TONE, 1, 1], np.float32), recipes.centres)

    def votes(g: int) -> Floats:
        given = blur((label == g).astype(np.float32), sigma)
        return given + ragged * (given > 0.02) * np.float32(1 if g % 2 else -1)

    most, winner = np.full(label.shape, -1, np.float32), np.zeros(label.shape, np.int64)
    for g, given in enumerate(pool.map(votes, range(len(recipes.centres)))):
        winner[given > most] = g
        np.maximum(most, given, out=most)
    return winner


def streaks(shape: tuple[int, ...], cells: float, wrist_deg: float, rng: np.random.Generator) -> Floats:
    """Noise of unit variance in streaks along the wrist's direction, about one line wide and ten long."""
    angle = np.deg2rad(wrist_deg)
    y, x = np.ogrid[: shape[0], : shape[1]]
    along = (x * np.cos(angle) + y * np.sin(angle)) / (9 * cells)
    across = (y * np.cos(angle) - x * np.sin(angle)) / (1.3 * cells)
    along, across = along - along.min(), across - across.min()
    noise = rng.standard_normal((int(across.max()) + 3, int(along.max()) + 3)).astype(np.float32)
    return np.asarray(cv2.remap(noise, along.astype(np.float32), across.astype(np.float32), cv2.INTER_LINEAR))
