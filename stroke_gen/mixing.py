"""Mixing: which crayons, light under dark, make the colours of each surface.

A person takes one to four crayons for a surface and lays each over the whole of it, with a pressure
that follows the tone. For every surface the ordered mixture is sought that serves all of its
colours at the least cost: distance seen from afar, grain, and the price of crayons that a careful
hand leaves in the box (a hue that opposes the surface's, grey in a colour, black in the light). One
box serves all surfaces.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .colour import TO_LAB, TO_LMS, cube_root, oklab
from .jit import inner_kernel, kernel
from .scene import Scene
from .swatches import COVERED, Swatches

Floats = NDArray[np.float32]
Ints = NDArray[np.int64]
LAYERS = 4  # crayons in a mixture at most
SAMPLES = 24  # colours by which a surface is judged
GRAIN_PRICE = 0.25  # OKLab units per unit of grain
LAYER_PRICE = 0.004  # for each further crayon
OPPOSED_PRICE = 0.22  # for a hue that opposes the surface's, times how far (see `clash`)
# for another hue than the surface's, where the box has one of it, times how far (see `chord`)
HUE_PRICE = 0.2
OF_IT = 25  # per cent of a surface that are enough for a hue to be one of its own
GREY_PRICE = 0.45  # for grey in a surface of a hue, times its chroma
LOUD_PRICE = 0.2  # for a crayon of stronger colour than the surface's, times how much stronger
# for a crayon darker than the surface's darkest, times the difference of lightness
DARK_PRICE = 0.2
BODY_PRICE = np.float32(0.3)  # for a crayon foreign to skin or hair
DARK_BODY = 0.46  # OKLab L below which skin and hair are dark
WARM = np.deg2rad(58)  # OKLab hue of both
SKIN_RAD, HAIR_RAD = np.deg2rad(22), np.deg2rad(40)
GROUND_SAY = 0.4  # of the ground in the choice of the box; where care is due, 1 more
BEAM = 3  # mixtures of each length that are tried with one crayon more


class Wax(NamedTuple):
    """What kernels need of the swatches."""

    paper: Floats  # (3,) linear
    covered: np.float32  # how far from the paper's light a waxed ground is
    a: Floats  # (2, crayons, pressures, 3), as in Swatches
    b: Floats
    grain: Floats  # (crayons, pressures)
    dull: Floats  # (crayons,) lightness of each laid heavily
    to_lms: Floats
    to_lab: Floats
    grain_price: np.float32


def wax(swatches: Swatches) -> Wax:
    """The swatches as kernels take them."""
    return Wax(
        swatches.paper,
        np.float32(COVERED),
        swatches.a,
        swatches.b,
        swatches.grain,
        swatches.lightness(),
        TO_LMS,
        TO_LAB,
        np.float32(GRAIN_PRICE),
    )


@dataclass(frozen=True, eq=False)
class Mixtures:
    """The crayons of each surface: (surfaces, LAYERS), by their place in the box, lightest first,
    then -1.
    """

    layers: Ints

    def alone(self) -> "Mixtures":
        """The same for a box that holds no crayons but these."""
        alone = np.searchsorted(self.crayons(), self.layers)
        return Mixtures(np.where(self.layers < 0, -1, alone))

    def crayons(self) -> list[int]:
        """All crayons in use, by their place in the box."""
        return sorted(set(self.layers[self.layers >= 0].tolist()))


_cube_root = kernel(cube_root)


@inner_kernel
def _lab(light, to_lms, to_lab, out):  # type: ignore[no-untyped-def]
    """OKLab of a linear colour."""
    l0 = _cube_root(to_lms[0, 0] * light[0] + to_lms[0, 1] * light[1] + to_lms[0, 2] * light[2])
    m0 = _cube_root(to_lms[1, 0] * light[0] + to_lms[1, 1] * light[1] + to_lms[1, 2] * light[2])
    s0 = _cube_root(to_lms[2, 0] * light[0] + to_lms[2, 1] * light[1] + to_lms[2, 2] * light[2])
    for c in range(3):
        out[c] = to_lab[c, 0] * l0 + to_lab[c, 1] * m0 + to_lab[c, 2] * s0


@kernel
def combine(ground, crayons, pressures, wax, colour, price):  # type: ignore[no-untyped-def]
    """OKLab (choices, 3) and price of grain of every choice of pressures for crayons laid over a
    ground.

    crayons: lightest first; pressures: which of the table's, 0 for none, 1 for its first. Choices
    count the first crayon's pressure slowest.
    """
    a, b, paper = wax.a, wax.b, wax.paper
    count, levels = crayons.size, pressures.size
    total = levels**count
    light = np.empty(3, np.float32)
    for m in range(total):
        rest, dots = m, np.float32(0)
        step = total // levels
        for c in range(3):
            light[c] = ground[c]
        for n in range(count):
            p = pressures[rest // step] - 1
            rest %= step
            step = max(step // levels, 1)
            if p < 0:
                continue
            k = crayons[n]
            off = max(
                max(abs(light[0] - paper[0]), abs(light[1] - paper[1])), abs(light[2] - paper[2])
            )
            waxed = min(off / wax.covered, np.float32(1))
            through = (a[0, k, p, 0] + a[0, k, p, 1] + a[0, k, p, 2]) / 3
            below = (
                np.float32(0.2126) * light[0]
                + np.float32(0.7152) * light[1]
                + np.float32(0.0722) * light[2]
            )
            # Flecks below are covered by as much as the crayon hides; its own show by how far it
            # differs.
            depth = abs(np.sqrt(below) - wax.dull[k]) / (1 - min(wax.dull[k], np.float32(0.8)))
            dots = dots * through + wax.grain[k, p] * min(depth, np.float32(1))
            for c in range(3):
                bare, over = (
                    a[0, k, p, c] * light[c] + b[0, k, p, c],
                    a[1, k, p, c] * light[c] + b[1, k, p, c],
                )
                light[c] = bare + waxed * (over - bare)
        _lab(light, wax.to_lms, wax.to_lab, colour[m])
        price[m] = wax.grain_price * dots


@kernel
def _cost(sample, colour, price, number):  # type: ignore[no-untyped-def]
    """Mean over samples (3, n) of the least distance and price over all choices."""
    n = sample.shape[1]
    total = np.float32(0)
    least = np.full(n, np.float32(9))
    for m in range(number):
        l0, a0, b0, dear = colour[m, 0], colour[m, 1], colour[m, 2], price[m]
        for i in range(n):
            dl, da, db = l0 - sample[0, i], a0 - sample[1, i], b0 - sample[2, i]
            least[i] = min(least[i], np.sqrt(dl * dl + da * da + db * db) + dear)
    for i in range(n):
        total += least[i]
    return total / n


@kernel
def _try(sample, mixtures, extra, allowed, pressures, wax, cost):  # type: ignore[no-untyped-def]
    """cost (surfaces, mixtures) of mixtures (m, n), with the prices `extra` (surfaces, crayons) of
    their crayons.
    """
    length = mixtures.shape[2]
    total = pressures.size**length
    colour, price = np.empty((total, 3), np.float32), np.empty(total, np.float32)
    for g in range(sample.shape[0]):
        for q in range(mixtures.shape[1]):
            crayons = mixtures[g, q]
            dear = np.float32(0)
            usable = True
            for k in crayons:
                usable = usable and k >= 0 and allowed[k]
                dear += extra[g, max(k, 0)]
            if not usable:
                cost[g, q] = 9
                continue
            combine(wax.paper, crayons, pressures, wax, colour, price)
            cost[g, q] = _cost(sample[g], colour, price, total) + dear


def find(seen: Scene, swatches: Swatches, most: int, rng: np.random.Generator) -> Mixtures:
    """A mixture for each family of surfaces, of at most `most` crayons in all."""
    sample = _samples(seen.guide.lab, seen.family, rng)
    say = np.bincount(seen.family.ravel(), (GROUND_SAY + seen.care).ravel()) / seen.care.size
    order = np.argsort(-swatches.lightness(), kind="stable")
    skin, hair = (np.bincount(seen.family.ravel(), m.ravel()) / np.bincount(seen.family.ravel())
                  for m in (seen.skin, seen.hair))  # fmt: skip
    extra = prices(sample, swatches, np.maximum(skin, hair)) + np.float32(LAYER_PRICE)
    body = skin[:, None] * foreign(swatches, SKIN_RAD) + hair[:, None] * foreign(swatches, HAIR_RAD)
    dark = np.clip((DARK_BODY - sample[:, 0].mean(1)) / 0.08, 0, 1)
    extra += BODY_PRICE * body * (1 - np.outer(dark, blackness(swatches)))
    every, table = np.ones(len(order), np.bool_), wax(swatches)

    def tried(mixtures: Ints, allowed: NDArray[np.bool_], pressures: Ints) -> Floats:
        cost = np.empty(mixtures.shape[:2], np.float32)
        _try(sample, mixtures, extra, allowed, pressures, table, cost)
        return cost

    full = np.arange(len(swatches.pressures) + 1)
    single = np.broadcast_to(order[None, :, None], (len(sample), len(order), 1)).copy()
    one = tried(single, every, full)
    number = len(order)
    first, second = np.triu_indices(number, 1)
    pairs = np.stack([order[first], order[second]], 1)
    double = np.broadcast_to(pairs[None], (len(sample), *pairs.shape)).copy()
    two = tried(double, every, full)
    allowed = _box(
        np.hstack([one, two]), [[int(k)] for k in order] + pairs.tolist(), say, number, most
    )
    best = np.full((len(sample), LAYERS), -1, np.int64)
    least = np.full(len(sample), np.inf, np.float32)
    found = [
        (single, np.where(allowed[single[..., 0]], one, 9)),
        (double, np.where(allowed[double].all(2), two, 9)),
    ]
    rank = np.argsort(order)
    for length in range(1, LAYERS + 1):
        if length > 2:
            wider = _extended(*found[-1], np.flatnonzero(allowed), rank)
            if not wider.size:
                break
            found.append((wider, tried(wider, allowed, full if length < 4 else few(len(full) - 1))))
        mixtures, cost = found[length - 1]
        if not cost.size:
            break
        at = cost.argmin(1)
        for g in np.flatnonzero(cost.min(1) < least):
            least[g], best[g] = cost[g, at[g]], -1
            best[g, :length] = mixtures[g, at[g]]
    return Mixtures(best)


def few(number: int) -> Ints:
    """Of no pressure and `number` pressures, those that are tried with four crayons."""
    return np.unique(np.linspace(0, number, 5).round()).astype(np.int64)


def _samples(lab: Floats, label: NDArray[np.int32], rng: np.random.Generator) -> Floats:
    """Colours (surfaces, 3, SAMPLES) of each surface."""
    flat, colours = label.ravel(), lab.reshape(-1, 3)
    where = np.argsort(flat, kind="stable")
    first = np.searchsorted(flat[where], np.arange(int(flat.max()) + 2))
    chosen = np.stack(
        [where[a + (rng.random(SAMPLES) * (b - a)).astype(np.int64)] for a, b in pairwise(first)]
    )
    return np.ascontiguousarray(colours[chosen].swapaxes(1, 2))


def prices(sample: Floats, swatches: Swatches, body: Floats | float = 0.0) -> Floats:
    """What a crayon costs in a surface (surfaces, crayons), beside the distance it leaves.

    body: how far each surface is skin or hair, 0..1, whose hues have a price of their own.
    """
    colours = oklab(swatches.over(swatches.paper))
    hue, heavy = swatches.masstone()[:, 1:], colours[:, -1]
    mean = sample.mean(2)
    chroma = np.linalg.norm(mean[:, 1:], axis=1)
    price = OPPOSED_PRICE * clash(hue[None], mean[:, None, 1:])
    off = chord(hue[None, :, None], sample.swapaxes(1, 2)[:, None, :, 1:])
    turned = HUE_PRICE * held(hue, mean[:, 1:]) * (1 - np.asarray(body))
    price += turned[:, None] * np.percentile(off, OF_IT, axis=2)
    price += GREY_PRICE * np.outer(np.maximum(chroma - 0.025, 0), greyness(heavy))
    loud = np.linalg.norm(hue, axis=1)
    price += LOUD_PRICE * np.maximum(loud[None] - 1.2 * chroma[:, None] - 0.06, 0)
    darkest = np.percentile(sample[:, 0], 10, axis=1)
    price += DARK_PRICE * np.maximum(darkest[:, None] - heavy[None, :, 0] - 0.08, 0)
    return price.astype(np.float32)


def foreign(swatches: Swatches, width_rad: float) -> Floats:
    """How foreign each crayon (crayons,) is to skin or hair: 0 within `width_rad` of their hue, 1
    far from it.
    """
    hue = swatches.masstone()
    chroma = np.linalg.norm(hue[:, 1:], axis=1)
    warm = (hue[:, 1] * np.cos(WARM) + hue[:, 2] * np.sin(WARM)) / (chroma + 1e-6)
    off = np.clip((np.arccos(np.clip(warm, -1, 1)) - width_rad) / 0.5, 0, 1)
    grey = np.clip(1 - chroma / 0.05, 0, 1)
    light = np.clip((hue[:, 0] - 0.85) / 0.1, 0, 1)  # white is at home everywhere
    return np.maximum(off * (1 - grey), grey * (1 - light)).astype(np.float32)


def blackness(swatches: Swatches) -> Floats:
    """How nearly black each crayon (crayons,) is; the darkest skin and hair may take it, lighter
    ones must not.
    """
    heavy = oklab(swatches.over(swatches.paper))[:, -1]
    colourless = np.clip(2 - np.hypot(heavy[:, 1], heavy[:, 2]) / 0.06, 0, 1)
    return (np.clip((0.45 - heavy[:, 0]) / 0.08, 0, 1) * colourless).astype(np.float32)


def clash(one: Floats, other: Floats) -> Floats:
    """How far two hues (..., 2) in a and b oppose each other: 0 where one is neutral or both are
    within 44 degrees.
    """
    dot = one[..., 0] * other[..., 0] + one[..., 1] * other[..., 1]
    both = np.sqrt((one**2).sum(-1) * (other**2).sum(-1))
    return np.asarray(np.sqrt(np.maximum(0.72 * both - dot, 0)))


def chord(one: Floats, other: Floats) -> Floats:
    """How far apart two hues (..., 2) in a and b are, for the chroma both have: 0 for the same."""
    dot = one[..., 0] * other[..., 0] + one[..., 1] * other[..., 1]
    both = np.sqrt((one**2).sum(-1) * (other**2).sum(-1))
    return np.asarray(np.sqrt(np.maximum(2 * (both - dot), 0)))


def held(hues: Floats, wanted: Floats) -> Floats:
    """Whether a box of some hues (k, 2) in a and b holds those that are wanted (n, 2): 1 within 20
    degrees or so, 0 from 45 degrees.
    """
    one, other = (h / (np.linalg.norm(h, axis=1, keepdims=True) + 0.01) for h in (hues, wanted))
    return np.asarray(np.clip(((other @ one.T).max(1) - 0.7) / 0.2, 0, 1), np.float32)


def greyness(colours: Floats) -> Floats:
    """How grey OKLab colours (n, 3) are: 1 for a grey, 0 for a hue and for black."""
    chroma = np.linalg.norm(colours[:, 1:], axis=1)
    return (np.exp(-((chroma / 0.06) ** 2)) * np.clip((colours[:, 0] - 0.25) / 0.2, 0, 1)).astype(
        np.float32
    )


def _box(
    cost: Floats, mixtures: list[list[int]], say: NDArray[np.float64], number: int, most: int
) -> NDArray[np.bool_]:
    """Which crayons to take: starting from all, put back the one least missed until `most` remain
    in use.
    """
    holds = np.zeros((len(mixtures), number), np.bool_)
    for q, mixture in enumerate(mixtures):
        holds[q, mixture] = True
    allowed = np.ones(number, np.bool_)
    while True:
        usable = ~(holds & ~allowed).any(1)
        now = np.where(usable, cost, 9)
        used = np.flatnonzero(holds[now.argmin(1)].any(0))
        if len(used) <= most:
            return np.isin(np.arange(number), used)
        allowed[:] = False
        allowed[used] = True
        missed = [(np.where(holds[:, k], 9, now).min(1) * say).sum() for k in used]
        allowed[used[int(np.argmin(missed))]] = False


def _extended(mixtures: Ints, cost: Floats, crayons: Ints, rank: Ints) -> Ints:
    """The best mixtures of each surface with one crayon more, each lightest first; -1 where that is
    none.
    """
    beam = np.argsort(cost, 1, kind="stable")[:, :BEAM]
    best = np.take_along_axis(mixtures, beam[..., None], 1)
    wider = np.concatenate([
        np.repeat(best[:, :, None], len(crayons), 2),
        np.broadcast_to(crayons[None, None, :, None], (*best.shape[:2], len(crayons), 1)),
    ], 3).reshape(len(mixtures), -1, mixtures.shape[2] + 1)  # fmt: skip
    wider = np.take_along_axis(wider, np.argsort(rank[wider], 2), 2)
    twice = (np.diff(rank[wider], axis=2) == 0).any(2)
    wider[twice] = -1
    return np.ascontiguousarray(wider)
