"""Touches: when all surfaces are laid, the few small places that still want a crayon of their own.

The hand steps back, and takes a sharpened crayon to what has a shape and matters: eyes, lettering,
a button, a highlight. The gain of a crayon is how much nearer the colour comes to the photo, less a
price for grain (feather-light black on a light wall is pepper) and for going darker than the photo,
which no crayon undoes.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from . import analysis
from .analysis import blur
from .colour import TO_LAB, TO_LMS, cube_root, oklab
from .jit import kernel, lean_kernel
from .mixing import BODY_PRICE, GRAIN_PRICE, HAIR_RAD, SKIN_RAD, clash, foreign
from .params import Pass
from .separation import Plan
from .swatches import Swatches

Floats = NDArray[np.float32]
STRANGER_PRICE = 0.02  # what a crayon that the surface has not must gain more
CLASH_PRICE = 0.25  # for a hue that opposes the photo's, times how far
TONES = 6.0  # widths of the touch over which tones are compared
UNASKED = np.float32(-0.05)

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
def _gain(top, left, current, lab, need, a, b, grain, to_lms,  # type: ignore[no-untyped-def]
          to_lab, tone, dark_price, grain_price, gain, best):  # fmt: skip
    """Gain and pressure index (h, w) of a crayon in a window whose corner is (top, left), where
    `need` (h, w) is set.

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
                    light[c, i], target[c, i] = (
                        current[top + y, left + x, c],
                        lab[top + y, left + x, c],
                    )
                i += 1
    now, off = np.empty(number, np.float32), np.empty(number, np.float32)
    most, which = np.full(number, np.float32(-9)), np.zeros(number, np.int8)
    same, nothing, zero = np.ones(3, np.float32), np.zeros(3, np.float32), np.float32(0)
    _off(light, target, same, nothing, to_lms, to_lab, tone, zero, zero, now)
    for p in range(grain.size):
        _off(
            light, target, a[p], b[p], to_lms, to_lab, tone, dark_price, grain_price * grain[p], off
        )
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
    """Gain of crayon k at its best pressure, and that pressure's index, in a window where it is
    needed.

    current: linear colours on the sheet now (h, w, 3); lab: the target in OKLab (h, w, 3); corner:
    row and column of the window's; need: the window, not 0 where the crayon is in question.
    Elsewhere its gain is UNASKED.
    """
    pressures = max(1, int((swatches.pressures <= coat.hardest).sum()))
    gain, best = np.full(need.shape, UNASKED, np.float32), np.zeros(need.shape, np.int8)
    weights = np.float32(coat.tone), np.float32(coat.dark_price), np.float32(GRAIN_PRICE)
    table = (m[k, :pressures] for m in (swatches.a[1], swatches.b[1], swatches.grain))
    _gain(*corner, current, lab, need, *table, TO_LMS, TO_LAB, *weights, gain, best)
    return gain, best


def wanted(plan: Plan, now: Floats, coat: Pass, cells: float) -> dict[int, Floats]:
    """The pressure (h, w) wanted of each crayon that is wanted at all: one crayon at most in each
    place.

    Only shapes are touched up, not tones: the sheet is compared with the photo as it would look in
    the sheet's own tones. now: linear (h, w, 3); cells: width of the tip.
    """
    scene, swatches = plan.scene, plan.swatches
    tones = analysis.wide_blur(now, TONES * cells), analysis.wide_blur(scene.target, TONES * cells)
    aim = oklab(blur(scene.target, coat.soften * 0.5 * cells)) + oklab(tones[0]) - oklab(tones[1])
    need = scene.detail >= coat.detail
    chosen = _worthiest(plan, now, aim, need, coat, cells)
    steps = np.log(swatches.pressures)

    def want(k: int) -> Floats:
        mine = ((chosen == k) & need).astype(np.uint8)
        gain, best = gains(now, aim, (0, 0), mine, swatches, k, coat)
        here = (mine > 0) & (blur(gain, coat.edge * cells) > coat.gain)
        here = _shapes(here, coat.least * cells * cells)
        log_p = blur(np.where(here, steps[best], steps[0]).astype(np.float32), 0.3 * cells)
        return np.where(here, np.exp(log_p), 0).astype(np.float32)

    crayons = np.unique(chosen[need]).tolist()
    return {k: m for k, m in zip(crayons, plan.pool.map(want, crayons), strict=True) if m.any()}


def _shapes(mask: NDArray[np.bool_], least: float) -> NDArray[np.bool_]:
    """The connected parts of a mask that have an area of at least `least` cells."""
    _, label, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=4)
    large = stats[:, cv2.CC_STAT_AREA] >= least
    large[0] = False
    return np.asarray(large[label])


def _worthiest(
    plan: Plan, now: Floats, aim: Floats, need: NDArray[np.bool_], coat: Pass, cells: float
) -> NDArray[np.uint8]:
    """The crayon (h, w) that gains most, where neighbours agree over `coat.cohere` tips."""
    seen, swatches = plan.scene, plan.swatches
    hues = swatches.masstone()[:, 1:]
    own = np.stack([(plan.mixtures.layers == k).any(1) for k in range(len(swatches.names))])
    body = (seen.skin, foreign(swatches, SKIN_RAD)), (seen.hair, foreign(swatches, HAIR_RAD))
    near = cv2.dilate(
        need.astype(np.uint8), np.ones((3, 3), np.uint8), iterations=max(1, int(cells))
    )
    asked = np.asarray(near, np.uint8)

    def worth(k: int) -> Floats:
        gain, _ = gains(now, aim, (0, 0), asked, swatches, k, coat)
        price = np.float32(CLASH_PRICE) * clash(hues[k], aim[..., 1:])
        price += np.where(own[k][seen.family], 0, np.float32(STRANGER_PRICE))
        for where, strange in body:
            price += BODY_PRICE * strange[k] * where
        return blur(gain, 0.5 * coat.cohere * cells) - price

    return (
        np.stack(list(plan.pool.map(worth, range(len(swatches.names))))).argmax(0).astype(np.uint8)
    )
