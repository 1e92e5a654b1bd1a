"""Which crayon, how hard, where: the gain of every crayon over what is on the sheet now.

The gain of hatching crayon k at pressure p is how much nearer the colour comes to the target, less a
price for grain (feather-light black on a light wall is pepper) and for going darker than the target,
which no crayon undoes.
"""

from concurrent.futures import ThreadPoolExecutor

import cv2
import numpy as np
from numpy.typing import NDArray

from .analysis import Scene, blur
from .colour import TO_LAB, TO_LMS, oklab
from .jit import kernel
from .params import Pass
from .swatches import Swatches

Floats = NDArray[np.float32]
GRAIN_PRICE = 0.35  # OKLab units per unit of grain
BAND = 32


@kernel
def _cube_root(x):  # type: ignore[no-untyped-def]
    """Cube root for x in 0..1 to 1e-4: a first guess from the float's exponent, two Newton steps."""
    if x < np.float32(1e-7):
        return np.float32(0)
    bits = np.float32(x).view(np.int32)
    y = np.int32(bits // 3 + 709921077).view(np.float32)
    for _ in range(2):
        y = (y + y + x / (y * y)) * np.float32(0.33333334)
    return y


@kernel
def _gain(top, bottom, current, lab, a, b, grain, to_lms, to_lab, tone, dark_price, grain_price, gain, best):  # type: ignore[no-untyped-def]
    """Best gain and pressure index of each crayon on rows top..bottom: gain, best (k, h, w)."""
    crayons, pressures = grain.shape
    for y in range(top, bottom):
        for x in range(current.shape[1]):
            r, g, b0 = current[y, x, 0], current[y, x, 1], current[y, x, 2]
            now = np.float32(0)
            for k in range(-1, crayons):
                top_gain, top_p = np.float32(-9), 0
                for p in range(pressures if k >= 0 else 1):
                    if k >= 0:
                        r1, g1, b1 = a[k, p, 0] * r + b[k, p, 0], a[k, p, 1] * g + b[k, p, 1], a[k, p, 2] * b0 + b[k, p, 2]
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
    current: Floats, lab: Floats, swatches: Swatches, tone: float, dark_price: float, threads: int
) -> tuple[Floats, NDArray[np.int8]]:
    """Gain (k, h, w) of each crayon at its best pressure, and that pressure's index (k, h, w).

    current: linear colours on the sheet now (h, w, 3); lab: the target in OKLab (h, w, 3); tone: weight of lightness.
    """
    h, w = current.shape[:2]
    gain = np.empty((len(swatches.names), h, w), np.float32)
    best = np.empty(gain.shape, np.int8)

    def band(top: int) -> None:
        _gain(top, min(h, top + BAND), current, lab, swatches.a, swatches.b, swatches.grain, TO_LMS, TO_LAB,
              np.float32(tone), np.float32(dark_price), np.float32(GRAIN_PRICE), gain, best)  # fmt: skip

    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(band, range(0, h, BAND)))
    return gain, best


def choose_box(lab: Floats, swatches: Swatches, most: int) -> list[int]:
    """The crayons worth taking out of the box for this picture, at most `most`: greedy, best first.

    Each next crayon is the one that, alone or over one already chosen, brings a sample of the picture's
    colours nearest to what can be drawn.
    """
    sample = lab.reshape(-1, 3)
    sample = sample[:: max(1, len(sample) // 600)]
    paper = oklab(swatches.paper[None])[0]
    error = np.linalg.norm(sample - paper, axis=1)
    single = swatches.over(swatches.paper)  # (k, p, 3)
    price = GRAIN_PRICE * swatches.grain
    chosen: list[int] = []
    cost = np.stack([_nearest(sample, single[k], price[k]) for k in range(len(swatches.names))])
    for _ in range(min(most, len(swatches.names))):
        if chosen:
            last = chosen[-1]
            for k in range(len(swatches.names)):
                over = (swatches.a[k] * single[last][:, None] + swatches.b[k]).reshape(-1, 3)
                under = (swatches.a[last] * single[k][:, None] + swatches.b[last]).reshape(-1, 3)
                both = np.concatenate([over, under])
                cost[k] = np.minimum(cost[k], _nearest(sample, both, np.zeros(len(both), np.float32)) + 0.04)
        gain = [float(np.maximum(error - c, 0).mean()) if k not in chosen else -1.0 for k, c in enumerate(cost)]
        best = int(np.argmax(gain))
        if chosen and gain[best] < 2e-4:
            break
        chosen.append(best)
        error = np.minimum(error, cost[best])
    return sorted(chosen)


def _nearest(sample: Floats, colours: Floats, price: Floats) -> Floats:
    """Of each sample colour (n,), the distance to the nearest of `colours` (m, 3) with its price."""
    distance = np.linalg.norm(sample[:, None] - oklab(colours)[None], axis=2) + price
    return np.asarray(distance.min(1), np.float32)


def plates(gain: Floats, best: NDArray[np.int8], swatches: Swatches, scene: Scene, coat: Pass, cells: float,
           wrist_deg: float, rng: np.random.Generator) -> Floats:  # fmt: skip
    """The pressure (k, h, w) wanted of each crayon, 0 where it is not: one crayon at most in each place.

    Neighbours agree on the crayon over `coat.cohere` tips, with streaks of noise so that crayons of similar
    worth lie side by side; a line goes on while the tip as a whole gains.
    """
    crayons, h, w = gain.shape
    worth = np.empty_like(gain)
    tip_gain = np.empty_like(gain)
    for k in range(crayons):
        tip_gain[k] = blur(gain[k], coat.edge * cells)
        streaks = _streaks(h, w, cells, wrist_deg, rng)
        worth[k] = blur(gain[k], coat.cohere * cells) + coat.interleave * streaks
    chosen = worth.argmax(0)
    wants = np.zeros_like(gain)
    allowed = scene.detail >= coat.detail
    for k in range(crayons):
        here = (chosen == k) & (tip_gain[k] > coat.gain) & allowed
        if here.any():
            pressure = swatches.pressures[best[k]]
            level = np.exp(blur(np.log(pressure), 0.3 * cells))
            wants[k] = np.where(here, level, 0)
    return wants


def _streaks(h: int, w: int, cells: float, wrist_deg: float, rng: np.random.Generator) -> Floats:
    """Noise of unit variance in streaks along the wrist's direction, about one line wide and ten long."""
    angle = np.deg2rad(wrist_deg)
    y, x = np.mgrid[:h, :w].astype(np.float32)
    along = (x * np.cos(angle) + y * np.sin(angle)) / (9 * cells)
    across = (y * np.cos(angle) - x * np.sin(angle)) / (1.3 * cells)
    along, across = along - along.min(), across - across.min()
    noise = rng.standard_normal((int(across.max()) + 3, int(along.max()) + 3)).astype(np.float32)
    return cv2.remap(noise, along.astype(np.float32), across.astype(np.float32), cv2.INTER_LINEAR)
