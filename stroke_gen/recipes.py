"""Recipes: which crayon under which for each kind of colour in the photo, as a person mixes skin or sky.

The picture's colours are grouped by hue (lightness counts less: force gives tone), and each group gets one
ordered pair of crayons, light under dark, that serves its whole range of tones at the least cost: distance
seen from afar, grain, and reluctance to take one more crayon out of the box.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .colour import TO_LAB, TO_LMS, cube_root, oklab
from .jit import kernel
from .swatches import Swatches

Floats = NDArray[np.float32]
TONE = 0.45  # weight of lightness when colours are grouped
SAMPLES = 40  # colours by which a group is judged
GRAIN_PRICE = 0.35  # OKLab units per unit of grain
LAYER_PRICE = 0.008  # for the second crayon
CLASH_PRICE = 0.17  # for two crayons of opposing hue (see `clash`): red over green is no brown for skin
DULL_PRICE = 0.02  # for grey with another crayon where the colour is strong: it tones a red hat down, and looks dirty
LIKE = 0.07  # OKLab distance within which groups are alike
AGREEMENT = 0.04  # what sharing both crayons with all groups alike is worth
RIVAL = 0.015  # a base this little dearer lies between the lines of the first ...
RIVAL_HUE = 0.14  # ... if its hue is this near, in a and b


@dataclass(frozen=True, eq=False)
class Recipes:
    """A recipe for each group of colours."""

    centres: Floats  # (groups, 3) OKLab with lightness weighted
    base: NDArray[np.int64]  # (groups,) crayon of the first coat
    shade: NDArray[np.int64]  # (groups,) crayon over it; equal to base where one is enough
    rival: NDArray[np.int64]  # (groups,) a base nearly as good, to lie between; equal to base where none is

    def crayons(self) -> list[int]:
        """All crayons in use, by their place in the box."""
        return sorted({int(k) for k in np.concatenate([self.base, self.shade, self.rival])})

    def alone(self) -> "Recipes":
        """The same for a box that holds no crayons but these."""
        used = self.crayons()
        return Recipes(self.centres, *(np.searchsorted(used, k) for k in (self.base, self.shade, self.rival)))


_cube_root = kernel(cube_root)


@kernel
def _costs(sample, a, b, grain, paper, heavy, pairs, extra, to_lms, to_lab, grain_price, cost):  # type: ignore[no-untyped-def]
    """Mean over samples (groups, 3, n) of the least cost over both pressures of each pair: cost (groups, pairs)."""
    groups, _, n = sample.shape
    least = np.empty(n, np.float32)
    pressures = grain.shape[1]
    colour, price = np.empty((pressures * pressures, 3), np.float32), np.empty(pressures * pressures, np.float32)
    for q in range(pairs.shape[0]):
        k1, k2 = pairs[q]
        number = 0
        for p1 in range(pressures):
            for p2 in range(pressures if k1 != k2 else 1):
                light = np.empty(3, np.float32)
                for c in range(3):
                    light[c] = a[k1, p1, c] * paper[c] + b[k1, p1, c]
                dots = grain[k1, p1]
                if k1 != k2:
                    below = light[0] + light[1] + light[2]
                    white = paper[0] + paper[1] + paper[2]
                    depth = abs(below - heavy[k2]) / max(white - heavy[k2], np.float32(0.1))
                    # The first coat's flecks are covered by the share of ground the second hides.
                    dots = dots * (a[k2, p2, 0] + a[k2, p2, 1] + a[k2, p2, 2]) / 3 + grain[k2, p2] * min(
                        depth, np.float32(1)
                    )
                    for c in range(3):
                        light[c] = a[k2, p2, c] * light[c] + b[k2, p2, c]
                l0 = _cube_root(to_lms[0, 0] * light[0] + to_lms[0, 1] * light[1] + to_lms[0, 2] * light[2])
                m0 = _cube_root(to_lms[1, 0] * light[0] + to_lms[1, 1] * light[1] + to_lms[1, 2] * light[2])
                s0 = _cube_root(to_lms[2, 0] * light[0] + to_lms[2, 1] * light[1] + to_lms[2, 2] * light[2])
                for c in range(3):
                    colour[number, c] = to_lab[c, 0] * l0 + to_lab[c, 1] * m0 + to_lab[c, 2] * s0
                price[number] = grain_price * dots + extra[q]
                number += 1
        for g in range(groups):
            least[:] = 9
            for m in range(number):
                lightness, red, yellow, dear = colour[m, 0], colour[m, 1], colour[m, 2], price[m]
                for i in range(n):
                    dl, da, db = lightness - sample[g, 0, i], red - sample[g, 1, i], yellow - sample[g, 2, i]
                    least[i] = min(least[i], np.sqrt(dl * dl + da * da + db * db) + dear)
            total = np.float32(0)
            for i in range(n):
                total += least[i]
            cost[g, q] = total / n


def find(lab: Floats, swatches: Swatches, groups: int, most: int, rng: np.random.Generator) -> Recipes:
    """Recipes for a picture in OKLab (h, w, 3): at most `groups` of them from at most `most` crayons."""
    flat = lab.reshape(-1, 3)
    flat = flat[rng.permutation(len(flat))[:6000]]
    weighted = flat * np.array([TONE, 1, 1], np.float32)
    centres, label = _group(weighted, groups, rng)
    size = np.bincount(label, minlength=len(centres)).astype(np.float64)
    chosen = np.stack([rng.choice(np.flatnonzero(label == g), SAMPLES) for g in range(len(centres))])
    sample = np.ascontiguousarray(flat[chosen].swapaxes(1, 2))
    light = swatches.lightness()
    count = len(swatches.names)
    pairs = np.array([(i, j) for i in range(count) for j in range(count) if i == j or light[i] > light[j]], np.int64)
    bare = swatches.over(swatches.paper)
    cost = np.empty((len(centres), len(pairs)), np.float32)
    hues = oklab(bare)[:, -3, 1:]
    opposed = clash(hues[pairs[:, 0]], hues[pairs[:, 1]])
    extra = np.where(pairs[:, 0] != pairs[:, 1], LAYER_PRICE + CLASH_PRICE * opposed, 0).astype(np.float32)
    _costs(sample, swatches.a, swatches.b, swatches.grain, swatches.paper, bare[:, -1].sum(1), pairs, extra,
           TO_LMS, TO_LAB, np.float32(GRAIN_PRICE), cost)  # fmt: skip
    cost += DULL_PRICE * np.outer(_strength(centres), _greyness(oklab(bare[:, -1]))[pairs].max(1))
    allowed = _box(cost, pairs, size / size.sum(), count, most)
    cost[:, ~(allowed[pairs[:, 0]] & allowed[pairs[:, 1]])] = 9
    best = _agree(cost, pairs, centres)
    base, shade = pairs[best].T
    return Recipes(centres, base, shade, _rivals(cost, pairs, base, shade, hues))


def clash(one: Floats, other: Floats) -> Floats:
    """How far two hues (..., 2) in a and b oppose each other: 0 where one is neutral or both are alike."""
    dot = one[..., 0] * other[..., 0] + one[..., 1] * other[..., 1]
    squares = (one[..., 0] ** 2 + one[..., 1] ** 2) * (other[..., 0] ** 2 + other[..., 1] ** 2)
    return np.asarray(np.sqrt(np.maximum(np.sqrt(squares) - dot, 0)))


def _strength(colours: Floats) -> Floats:
    """How strong OKLab colours (n, 3) are: 0 for earth and skin, 1 for flowers and toys."""
    return np.clip((np.linalg.norm(colours[:, 1:], axis=1) - 0.12) / 0.1, 0, 1).astype(np.float32)


def _greyness(colours: Floats) -> Floats:
    """How grey OKLab colours (n, 3) are: 1 for a grey, 0 for a hue and for black."""
    chroma = np.linalg.norm(colours[:, 1:], axis=1)
    return (np.exp(-((chroma / 0.06) ** 2)) * np.clip((colours[:, 0] - 0.25) / 0.2, 0, 1)).astype(np.float32)


def _group(colours: Floats, groups: int, rng: np.random.Generator) -> tuple[Floats, NDArray[np.int64]]:
    """k-means with far-apart beginnings: centres (groups, 3) and the label of each colour. Empty groups go."""
    centres = colours[rng.integers(len(colours))][None]
    distance = np.full(len(colours), np.inf)
    for _ in range(groups - 1):
        distance = np.minimum(distance, ((colours - centres[-1]) ** 2).sum(1))
        if distance.max() < 1e-5:
            break
        centres = np.vstack([centres, colours[rng.choice(len(colours), p=distance / distance.sum())]])
    label = nearest(colours, centres)
    for _ in range(12):
        count = np.bincount(label)
        total = np.stack([np.bincount(label, channel) for channel in colours.T], 1)
        centres = (total[count > 0] / count[count > 0, None]).astype(np.float32)
        label = nearest(colours, centres)
    kept_groups = np.unique(label)
    return centres[kept_groups], np.searchsorted(kept_groups, label)


@kernel
def _nearest(colours, centres, best, label):  # type: ignore[no-untyped-def]
    """Centre by centre: label (n,) where its squared distance undercuts `best` (n,)."""
    for g in range(centres.shape[0]):
        c0, c1, c2 = centres[g]
        for i in range(label.size):
            d0, d1, d2 = colours[0, i] - c0, colours[1, i] - c1, colours[2, i] - c2
            distance = d0 * d0 + d1 * d1 + d2 * d2
            closer = distance < best[i]
            best[i] = distance if closer else best[i]
            label[i] = g if closer else label[i]


def nearest(colours: Floats, centres: Floats) -> NDArray[np.int64]:
    """Index of the nearest centre for colours (..., 3)."""
    columns = np.ascontiguousarray(colours.reshape(-1, 3).T, np.float32)
    label = np.zeros(columns.shape[1], np.int64)
    _nearest(columns, centres.astype(np.float32), np.full(label.shape, np.inf, np.float32), label)
    return label.reshape(colours.shape[:-1])


def _box(
    cost: Floats, pairs: NDArray[np.int64], weight: NDArray[np.float64], count: int, most: int
) -> NDArray[np.bool_]:
    """Which crayons to take: starting from all, put back the one least missed until `most` remain in use."""
    allowed = np.ones(count, np.bool_)
    while True:
        usable = allowed[pairs[:, 0]] & allowed[pairs[:, 1]]
        best = np.where(usable, cost, 9).argmin(1)
        used = np.unique(pairs[best])
        if len(used) <= most:
            allowed[:] = False
            allowed[used] = True
            return allowed
        without = []
        for k in used:
            rest = usable & (pairs != k).all(1)
            without.append((np.where(rest, cost, 9).min(1) * weight).sum())
        allowed[used[int(np.argmin(without))]] = False


def _agree(cost: Floats, pairs: NDArray[np.int64], centres: Floats) -> NDArray[np.int64]:
    """The pair of each group, where like groups would rather share crayons than have the very best."""
    best = cost.argmin(1)
    gap = ((centres[:, None] - centres[None]) ** 2).sum(2)
    near = np.exp(-gap / (2 * LIKE**2)) * (1 - np.eye(len(centres)))
    near /= np.maximum(near.sum(1, keepdims=True), 1.0)
    shared = [np.isin(pairs, pairs[q]).mean(1) for q in best]  # how much of each pair every group's own pair has
    for _ in range(4):
        for g in range(len(centres)):
            like = sum((shared[o] * near[g, o] for o in np.flatnonzero(near[g] > 0.02)), np.zeros(len(pairs)))
            best[g] = int((cost[g] - AGREEMENT * like).argmin())
            shared[g] = np.isin(pairs, pairs[best[g]]).mean(1)
    return best


def _rivals(
    cost: Floats, pairs: NDArray[np.int64], base: NDArray[np.int64], shade: NDArray[np.int64], hues: Floats
) -> NDArray[np.int64]:
    """For each group the cheapest other base of like hue under the same shade, if hardly dearer; else the base."""
    rival = base.copy()
    for g in range(len(base)):
        least = cost[g].min()
        like = np.linalg.norm(hues[pairs[:, 0]] - hues[base[g]], axis=1) < RIVAL_HUE
        same = (pairs[:, 1] == shade[g]) & (pairs[:, 0] != base[g]) & (pairs[:, 0] != shade[g]) & like
        others = np.where(same & (cost[g] < least + RIVAL), cost[g], 9)
        if others.min() < 9:
            rival[g] = pairs[others.argmin(), 0]
    return rival
