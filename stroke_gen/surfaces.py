"""Surfaces: the photo parted into the few dozen things a person would fill one after the other.

Felzenszwalb's segmentation (IJCV 2004) gives small calm pieces; neighbours are merged, the least
different first, until the differences that are left would matter. Where care is due, merging is
dear. Each surface has one direction of hatching, from which strokes turn only with a clear, large
form.
"""

import cv2
import numpy as np
from numpy.typing import NDArray
from skimage.segmentation import felzenszwalb

from .alike import norm
from .analysis import blur
from .jit import kernel

Floats = NDArray[np.float32]
Labels = NDArray[np.int32]
WEIGHTS = np.array([0.7, 1, 1], np.float32)  # shading parts a surface less than a change of hue
# light and dark of one hue are made of the same crayons
FAMILIAR = np.array([0.35, 1, 1], np.float32)
CARE = 0.8  # how much dearer merging is in the most important places
EDGE = 0.7  # weight of the step along the common border beside that between the means
SUBJECT = 0.15  # OKLab units: what parts the one who is drawn from the ground
LARGE = 100.0  # square tips from which size speaks no more against merging
FAMILY = 0.01  # of the sheet: smaller surfaces join a family more readily
KIND = np.float32(0.3)  # OKLab units between kinds
SHAPE = 0.7  # weight of a surface's own long axis when it chooses its direction, beside ...
FORM = 1.6  # ... that of the structure in it
FOLLOW = 2.2  # tips: forms this large are followed
COARSE = 3  # work cells to a cell of the grid on which directions are found


def part(lab: Floats, care: Floats, subject: Floats, tip: float, least: float) -> Labels:
    """Labels (h, w) of surfaces, from 0.

    lab: OKLab (h, w, 3); care, subject: 0..1 (h, w); tip: cells; least: OKLab units by which large
    surfaces must differ to stay apart: smaller ones must differ more.
    """
    h, w = lab.shape[:2]
    half = (max(2, w // 2), max(2, h // 2))
    small, dear, who = (
        np.asarray(cv2.resize(m, half, interpolation=cv2.INTER_AREA), np.float32)
        for m in (lab, care, subject)
    )
    scale = 0.5 * tip
    pieces = felzenszwalb(
        small * WEIGHTS, scale=0.6 * scale**2, sigma=0, min_size=max(4, int(scale**2))
    )
    label = _merged(pieces.astype(np.int32), small, dear, who, scale, least)
    return _smooth(
        np.asarray(cv2.resize(label, (w, h), interpolation=cv2.INTER_NEAREST)), 0.35 * tip
    )


def _merged(
    label: Labels, lab: Floats, care: Floats, who: Floats, tip: float, least: float
) -> Labels:
    """Neighbouring pieces merged, the cheapest pair first, until merging costs more than
    `least`.
    """
    means, size = _means(label, np.dstack([lab * WEIGHTS, SUBJECT * who, care]))
    length, step = (
        np.zeros((size.size, size.size), np.float32),
        np.zeros((size.size, size.size), np.float32),
    )
    _borders(label, lab * WEIGHTS, length, step)
    root = np.arange(size.size)
    _merge(
        means,
        size,
        length,
        step,
        np.float32(LARGE * tip * tip),
        np.float32(EDGE),
        np.float32(CARE),
        np.float32(least),
        root,
    )
    return np.unique(root, return_inverse=True)[1][label].astype(np.int32)


def families(label: Labels, lab: Floats, kind: Floats, least: float) -> NDArray[np.int64]:
    """The family (surfaces,), from 0, of each surface: those alike are coloured alike, wherever
    they lie.

    kind: (h, w) differs where colours must not be mixed, as skin and cloth; least: OKLab units
        between families.
    """
    means, size = _means(label, np.dstack([lab * FAMILIAR, KIND * kind, np.zeros_like(kind)]))
    everywhere = np.ones((size.size, size.size), np.float32) - np.eye(size.size, dtype=np.float32)
    root = np.arange(size.size)
    _merge(
        means,
        size,
        everywhere,
        np.zeros_like(everywhere),
        np.float32(FAMILY * label.size),
        np.float32(0),
        np.float32(0),
        np.float32(least),
        root,
    )
    return np.unique(root, return_inverse=True)[1]


def _means(label: Labels, features: Floats) -> tuple[Floats, Floats]:
    """Mean of the features (h, w, n) over each piece (pieces, n), and its size in cells."""
    flat = label.ravel()
    size = np.bincount(flat).astype(np.float32)
    means = [np.bincount(flat, feature.ravel()) / size for feature in np.moveaxis(features, 2, 0)]
    return np.stack(means, 1).astype(np.float32), size


@kernel
def _borders(label, lab, length, step):  # type: ignore[no-untyped-def]
    """Length of the border between each two pieces (n, n), and the steps of colour across it, added
    up.
    """
    h, w = label.shape
    for y in range(h):
        for x in range(w):
            i = label[y, x]
            for dy, dx in ((0, 1), (1, 0)):
                if y + dy < h and x + dx < w and label[y + dy, x + dx] != i:
                    j = label[y + dy, x + dx]
                    square = np.float32(0)
                    for c in range(3):
                        square += (lab[y + dy, x + dx, c] - lab[y, x, c]) ** 2
                    length[i, j] += 1
                    length[j, i] += 1
                    step[i, j] += np.sqrt(square)
                    step[j, i] += np.sqrt(square)


@kernel
def _price(i, j, means, size, length, step, large, edge, care):  # type: ignore[no-untyped-def]
    """What merging two neighbours costs: how they differ, less where one is small, more where care
    is due.
    """
    square = np.float32(0)
    for c in range(4):
        square += (means[i, c] - means[j, c]) ** 2
    off = np.sqrt(square) + edge * step[i, j] / length[i, j]
    dear = 1 + care * max(means[i, 4], means[j, 4])
    return off * dear * np.sqrt(min(min(size[i], size[j]) / large, np.float32(1)))


@kernel
def _merge(means, size, length, step, large, edge, care, least, root):  # type: ignore[no-untyped-def]
    """Merge the cheapest pair until none costs less than `least`; root (n,) is the piece each has
    become part of.
    """
    n = size.size
    best, price = np.full(n, -1), np.full(n, np.float32(np.inf))  # each piece's cheapest neighbour
    stale = np.ones(n, np.bool_)
    while True:
        for i in range(n):
            if stale[i]:
                best[i], price[i], stale[i] = -1, np.inf, False
                if root[i] == i:
                    for j in range(n):
                        if length[i, j] > 0:
                            cost = _price(i, j, means, size, length, step, large, edge, care)
                            if cost < price[i]:
                                best[i], price[i] = j, cost
        i = 0
        for k in range(n):
            if price[k] < price[i]:
                i = k
        if not price[i] < least:
            break
        j = best[i]
        for c in range(means.shape[1]):
            means[i, c] = (means[i, c] * size[i] + means[j, c] * size[j]) / (size[i] + size[j])
        size[i] += size[j]
        root[j], stale[j] = i, True
        for k in range(n):
            if length[j, k] > 0:
                if k != i:
                    length[i, k] += length[j, k]
                    step[i, k] += step[j, k]
                    length[k, i], step[k, i] = length[i, k], step[i, k]
                length[j, k], length[k, j] = 0, 0
            if length[i, k] > 0:
                stale[k] = True
        stale[i] = True
    for i in range(n):
        while root[root[i]] != root[i]:
            root[i] = root[root[i]]


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
    return np.unique(out, return_inverse=True)[1].reshape(out.shape).astype(np.int32)


def directions(
    tensor: Floats, label: Labels, care: Floats, tip: float, wrist_deg: float, wrist: float
) -> Floats:
    """Unit vectors (h, w, 2) along which strokes run, x then y.

    tensor: (h, w, 3) cosine and sine of the double angle along the form, times its energy, and that
    energy. A surface has one direction, from the structure in it, its own shape and the wrist;
    strokes turn from it only where a large form is clear, and more readily where care is due.
    """
    h, w = label.shape
    size, tip = (-(-w // COARSE), -(-h // COARSE)), tip / COARSE
    tensor, care = (
        np.asarray(cv2.resize(m, size, interpolation=cv2.INTER_AREA), np.float32)
        for m in (tensor, care)
    )
    parts = np.asarray(cv2.resize(label, size, interpolation=cv2.INTER_NEAREST_EXACT))
    field = np.zeros((*parts.shape, 2), np.float32)
    hand = wrist * np.array(
        [np.cos(2 * np.deg2rad(wrist_deg)), np.sin(2 * np.deg2rad(wrist_deg))], np.float32
    )
    typical = np.float32(np.median(tensor[..., 2]) + 1e-9)
    pad = int(2.5 * FOLLOW * tip)
    for k in np.flatnonzero(np.bincount(parts.ravel())):
        mine = (parts == k).astype(np.uint8)
        x, y, wide, high = cv2.boundingRect(mine)
        box = slice(max(0, y - pad), y + high + pad), slice(max(0, x - pad), x + wide + pad)
        here = mine[box].astype(np.float32)
        one = _direction(tensor[box], here, hand, typical, parts.size)
        spread = blur(np.dstack([tensor[box] * here[..., None], here]), FOLLOW * tip)
        firm = np.hypot(spread[..., 0], spread[..., 1])
        clear = firm / (spread[..., 2] + 0.5 * typical * spread[..., 3] + 1e-12)
        trust = np.clip((clear - 0.45 + 0.15 * care[box]) / 0.35, 0, 1)[..., None]
        turned = trust * spread[..., :2] / (firm[..., None] + 1e-12) + (1 - trust) * one
        field[box] += here[..., None] * turned
    field = np.asarray(
        cv2.resize(blur(field, 0.8 * tip), (w, h), interpolation=cv2.INTER_LINEAR), np.float32
    )
    angle = 0.5 * np.arctan2(field[..., 1], field[..., 0])
    return np.dstack([np.cos(angle), np.sin(angle)]).astype(np.float32)


def _direction(
    tensor: Floats, here: Floats, hand: Floats, typical: np.float32, sheet: int
) -> Floats:
    """The one direction (2,), as a unit vector of the double angle, of the surface that `here` (h,
    w) marks.
    """
    # Its border says less than what it holds.
    inner = np.asarray(cv2.erode(here, np.ones((3, 3), np.uint8)), np.float32)
    inner = inner if inner.sum() > 0.3 * here.sum() else here
    total = (tensor * inner[..., None]).sum((0, 1))
    own = total[:2] / (total[2] + typical * inner.sum())
    y, x = np.nonzero(here)
    xx, yy, xy = x.var(), y.var(), ((x - x.mean()) * (y - y.mean())).mean()
    shape = np.array([xx - yy, 2 * xy]) / (xx + yy + 1e-6)
    large = min(1.0, 4 * len(x) / sheet)
    one = FORM * own + SHAPE * shape * (1 - 0.5 * large) + hand
    return np.asarray(one / (norm(one) + 1e-9), np.float32)
