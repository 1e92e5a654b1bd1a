"""Surfaces: the photo parted into the few dozen things a person would fill one after the other.

Felzenszwalb's segmentation (IJCV 2004) gives small calm pieces; neighbours are merged, the least
different first, until the differences that are left would matter. Where care is due, merging is dear.
Each surface has one direction of hatching, from which strokes turn only with a clear, large form.
"""

import heapq

import cv2
import numpy as np
from numpy.typing import NDArray
from skimage.segmentation import felzenszwalb

from .analysis import blur, wide_blur

Floats = NDArray[np.float32]
Labels = NDArray[np.int32]
WEIGHTS = np.array([0.7, 1, 1], np.float32)  # shading parts a surface less than a change of hue
CARE = 2.0  # how much dearer merging is in the most important places
EDGE = 0.7  # weight of the step along the common border beside that between the means
SUBJECT = 0.15  # OKLab units: what parts the one who is drawn from the ground
SHAPE = 0.7  # weight of a surface's own long axis when it chooses its direction, beside ...
FORM = 1.6  # ... that of the structure in it
FOLLOW = 2.2  # tips: forms this large are followed


def part(lab: Floats, care: Floats, subject: Floats, tip: float, least: float) -> Labels:
    """Labels (h, w) of surfaces, from 0.

    lab: OKLab (h, w, 3); care, subject: 0..1 (h, w); tip: cells; least: OKLab units by which surfaces
    of a hundred square tips must differ to stay apart: smaller ones must differ more.
    """
    h, w = lab.shape[:2]
    half = (max(2, w // 2), max(2, h // 2))
    small, dear, who = (np.asarray(cv2.resize(m, half, interpolation=cv2.INTER_AREA))
                        for m in (blur(lab, 0.3 * tip), care, subject))  # fmt: skip
    scale = 0.5 * tip
    pieces = felzenszwalb(small * WEIGHTS, scale=0.6 * scale**2, sigma=0, min_size=max(4, int(scale**2)))
    label = _merged(pieces.astype(np.int32), small, dear, who, scale, least)
    return _smooth(np.asarray(cv2.resize(label, (w, h), interpolation=cv2.INTER_NEAREST)), 0.35 * tip)


def _merged(label: Labels, lab: Floats, care: Floats, who: Floats, tip: float, least: float) -> Labels:
    """Neighbouring pieces merged, the cheapest pair first, until merging costs more than `least`."""
    flat, count = label.ravel(), int(label.max()) + 1
    size = np.bincount(flat, minlength=count).astype(np.float64)
    features = np.dstack([lab * WEIGHTS, care, SUBJECT * who])
    means = np.stack([np.bincount(flat, c.ravel(), count) / size for c in np.moveaxis(features, 2, 0)], 1)
    near = _borders(label, lab)
    root, version = np.arange(count), np.zeros(count, np.int64)

    def cost(i: int, j: int) -> float:
        length, step = near[i][j]
        off = np.linalg.norm(means[i, [0, 1, 2, 4]] - means[j, [0, 1, 2, 4]]) + EDGE * step / length
        less = min(size[i], size[j]) / (100 * tip * tip)
        dear = 1 + CARE * max(means[i, 3], means[j, 3])
        return float(off * dear * min(less, 1.0) ** 0.5)

    queue = [(cost(i, j), i, j, 0, 0) for i in range(count) for j in near[i] if i < j]
    heapq.heapify(queue)
    while queue:
        price, i, j, vi, vj = heapq.heappop(queue)
        if price > least:
            break
        if version[i] != vi or version[j] != vj or root[i] != i or root[j] != j:
            continue
        both = size[i] + size[j]
        means[i] = (means[i] * size[i] + means[j] * size[j]) / both
        size[i], root[j] = both, i
        version[i] += 1
        for k, (length, step) in near.pop(j).items():
            del near[k][j]
            if k != i:
                old = near[i].get(k, (0.0, 0.0))
                near[i][k] = near[k][i] = (old[0] + length, old[1] + step)
        for k in near[i]:
            a, b = min(i, k), max(i, k)
            heapq.heappush(queue, (cost(a, b), a, b, int(version[a]), int(version[b])))
    while not (root == root[root]).all():
        root = root[root]
    return np.unique(root, return_inverse=True)[1][label].astype(np.int32)


def _borders(label: Labels, lab: Floats) -> dict[int, dict[int, tuple[float, float]]]:
    """For each piece its neighbours, with the length of the common border and the steps across it, added up."""
    count = int(label.max()) + 1
    keys, steps = [], []
    for axis in (0, 1):
        one, other = (label[:-1], label[1:]) if axis == 0 else (label[:, :-1], label[:, 1:])
        at = one != other
        jump = np.linalg.norm(np.diff(lab, axis=axis)[at] * WEIGHTS, axis=1)
        keys.append(np.minimum(one, other)[at].astype(np.int64) * count + np.maximum(one, other)[at])
        steps.append(jump)
    pairs, back = np.unique(np.concatenate(keys), return_inverse=True)
    length, total = np.bincount(back), np.bincount(back, np.concatenate(steps))
    near: dict[int, dict[int, tuple[float, float]]] = {i: {} for i in range(count)}
    for key, n, t in zip(pairs.tolist(), length.tolist(), total.tolist(), strict=True):
        i, j = divmod(key, count)
        near[i][j] = near[j][i] = (float(n), t)
    return near


def _smooth(label: Labels, sigma: float) -> Labels:
    """Borders as smooth as a crayon can follow: neighbours vote over `sigma` cells."""
    most, out = np.full(label.shape, -1, np.float32), label.copy()
    for k in range(int(label.max()) + 1):
        mine = (label == k).astype(np.uint8)
        x, y, w, h = cv2.boundingRect(mine)
        pad = int(3 * sigma) + 1
        box = slice(max(0, y - pad), y + h + pad), slice(max(0, x - pad), x + w + pad)
        votes = blur(mine[box].astype(np.float32), sigma)
        more = votes > most[box]
        out[box][more], most[box][more] = k, votes[more]
    return out


def directions(tensor: Floats, label: Labels, care: Floats, tip: float, wrist_deg: float, wrist: float) -> Floats:
    """Unit vectors (h, w, 2) along which strokes run, x then y.

    tensor: (h, w, 3) cosine and sine of the double angle along the form, times its energy, and that energy.
    A surface has one direction, from the structure in it, its own shape and the wrist; strokes turn from it only
    where a large form is clear, and more readily where care is due.
    """
    field = np.empty((*label.shape, 2), np.float32)
    hand = np.array([np.cos(2 * np.deg2rad(wrist_deg)), np.sin(2 * np.deg2rad(wrist_deg))])
    typical = np.float32(np.median(tensor[..., 2]) + 1e-9)
    pad = int(3 * FOLLOW * tip)
    for k in range(int(label.max()) + 1):
        mine = (label == k).astype(np.uint8)
        x, y, w, h = cv2.boundingRect(mine)
        box = slice(max(0, y - pad), y + h + pad), slice(max(0, x - pad), x + w + pad)
        here = mine[box].astype(np.float32)
        one = _direction(tensor[box], here, hand * wrist, typical, label.size)
        spread = wide_blur(np.dstack([tensor[box] * here[..., None], here]), FOLLOW * tip)
        firm = np.hypot(spread[..., 0], spread[..., 1])
        clear = firm / (spread[..., 2] + 0.5 * typical * spread[..., 3] + 1e-12)
        trust = np.clip((clear - 0.45 + 0.15 * care[box]) / 0.35, 0, 1)[..., None]
        turned = trust * spread[..., :2] / (firm[..., None] + 1e-12) + (1 - trust) * one
        inside = here > 0
        field[box][inside] = turned[inside]
    field = wide_blur(field, 0.8 * tip)
    angle = 0.5 * np.arctan2(field[..., 1], field[..., 0])
    return np.dstack([np.cos(angle), np.sin(angle)]).astype(np.float32)


def _direction(tensor: Floats, here: Floats, hand: Floats, typical: np.float32, sheet: int) -> Floats:
    """The one direction (2,), as a unit vector of the double angle, of the surface that `here` (h, w) marks."""
    inner = cv2.erode(here, np.ones((3, 3), np.uint8), iterations=2)  # its border says less than what it holds
    inner = inner if inner.sum() > 0.3 * here.sum() else here
    total = (tensor * inner[..., None]).sum((0, 1))
    own = total[:2] / (total[2] + typical * inner.sum())
    y, x = np.nonzero(here)
    xx, yy, xy = x.var(), y.var(), ((x - x.mean()) * (y - y.mean())).mean()
    shape = np.array([xx - yy, 2 * xy]) / (xx + yy + 1e-6)
    large = min(1.0, 4 * len(x) / sheet)
    one = FORM * own + SHAPE * shape * (1 - 0.5 * large) + hand
    return np.asarray(one / (np.linalg.norm(one) + 1e-9), np.float32)
