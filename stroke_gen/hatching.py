"""Hatching: zigzags without lifting the crayon, along the orientation field, where a crayon is
wanted.

A leg follows the field until the crayon is no longer wanted, another line is near, the turn is too
sharp or the hand's reach ends; the next leg starts one spacing beside its end and runs back. Lines
are kept apart by stamping finished legs on a map.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from .hand import Paths
from .jit import kernel, lean_kernel

Floats = NDArray[np.float32]
FINE = 2  # cells of the stamp map per work cell
STEP = 0.6  # work cells between points of a path
TILE = 64  # grid cells, a power of two, after which the jitter of the seeds repeats itself


@dataclass(frozen=True)
class Hatch:
    """How a coat of hatching is laid; lengths in work cells."""

    spacing: float  # between legs
    shortest: float  # a leg
    reach: float  # the longest leg
    legs: int  # most legs in one zigzag
    gap: float  # unwanted ground a leg may cross
    single: float  # coherence from which legs are drawn singly, as hair is


@lean_kernel
def _free(stamp, x, y, fine, below):  # type: ignore[no-untyped-def]
    j, i = int(y * fine), int(x * fine)
    return 0 <= j < stamp.shape[0] and 0 <= i < stamp.shape[1] and stamp[j, i] < below


@lean_kernel
def _leg(x, y, dx, dy, want, tangent, stamp, fine, step, reach, gap, sharpest, out):  # type: ignore[no-untyped-def]
    """Follow the field from (x, y) towards (dx, dy); points into out (n, 2), returns how many."""
    h, w = want.shape
    n, last, missing, walked = 0, 0, np.float32(0), np.float32(0)
    while walked < reach and n < out.shape[0]:
        j, i = int(y), int(x)
        tx, ty = tangent[j, i, 0], tangent[j, i, 1]
        if tx * dx + ty * dy < 0:
            tx, ty = -tx, -ty
        if n > 0 and tx * dx + ty * dy < sharpest:
            break
        # A hand does not turn at once: the direction follows the field with some inertia.
        tx, ty = (
            np.float32(0.35) * tx + np.float32(0.65) * dx,
            np.float32(0.35) * ty + np.float32(0.65) * dy,
        )
        norm = np.sqrt(tx * tx + ty * ty)
        dx, dy = tx / norm, ty / norm
        x, y = x + step * dx, y + step * dy
        if not (0 <= x < w and 0 <= y < h) or not _free(stamp, x, y, fine, 2):
            break
        walked += step
        out[n, 0], out[n, 1] = x, y
        n += 1
        if want[int(y), int(x)] > 0:
            last, missing = n, np.float32(0)
        else:
            missing += step
            if missing > gap:
                break
    return last


@lean_kernel
def _press(stamp, path, n, spacing, gaps, fine):  # type: ignore[no-untyped-def]
    """Stamp discs along a path: 2 where no other line may come, 1 where none may begin.

    Without the second, lines would be squeezed in half-way between two that lie just right.
    """
    h, w = stamp.shape
    for p in range(n):
        own = spacing * gaps[int(path[p, 1]), int(path[p, 0])] * fine
        inner, outer = own * 0.46, own * 0.75
        cx, cy = path[p, 0] * fine - 0.5, path[p, 1] * fine - 0.5
        for j in range(max(0, int(np.ceil(cy - outer))), min(h, int(np.floor(cy + outer)) + 1)):
            half = np.sqrt(outer * outer - (j - cy) ** 2)
            for i in range(max(0, int(np.ceil(cx - half))), min(w, int(np.floor(cx + half)) + 1)):
                stamp[j, i] = max(stamp[j, i], 1)
        for j in range(max(0, int(np.ceil(cy - inner))), min(h, int(np.floor(cy + inner)) + 1)):
            half = np.sqrt(inner * inner - (j - cy) ** 2)
            for i in range(max(0, int(np.ceil(cx - half))), min(w, int(np.floor(cx + half)) + 1)):
                stamp[j, i] = 2


@kernel
def _hatch(want, gaps, tangent, coherence, seeds, luck, spacing,  # type: ignore[no-untyped-def]
           shortest, reach, legs, gap, single, step, fine, stamp, points, first,
           leg_of):  # fmt: skip
    """Zigzags from `seeds` (n, 2) in order.

    Writes points (m, 2), leg_of (m,), first (strokes + 1); returns strokes.
    """
    h, w = want.shape
    forth, back = np.empty((2048, 2), np.float32), np.empty((2048, 2), np.float32)
    used, strokes, dice = 0, 0, 0
    first[0] = 0
    sharpest = np.float32(0.75)
    for s in range(seeds.shape[0]):
        x, y = seeds[s, 0], seeds[s, 1]
        if want[int(y), int(x)] <= 0 or not _free(stamp, x, y, fine, 1):
            continue
        if used + 4096 >= points.shape[0] or strokes + 2 >= first.shape[0]:
            break
        own_reach = reach * (np.float32(0.6) + np.float32(0.8) * luck[dice % luck.size])
        side = np.float32(1) if luck[(dice + 1) % luck.size] < 0.5 else np.float32(-1)
        dice += 2
        most = 1 if coherence[int(y), int(x)] > single else legs
        tx, ty = tangent[int(y), int(x), 0], tangent[int(y), int(x), 1]
        start = used
        for leg in range(most):
            if leg == 0:  # through the seed both ways
                ahead = own_reach * np.float32(0.5)
                behind = ahead
            else:  # one spacing beside the last end: a little further on, then back
                ahead = spacing * np.float32(1.5)
                behind = own_reach * (np.float32(0.85) + np.float32(0.3) * luck[dice % luck.size])
                dice += 1
            n = _leg(x, y, tx, ty, want, tangent, stamp, fine, step, ahead, gap, sharpest, forth)
            m = _leg(x, y, -tx, -ty, want, tangent, stamp, fine, step, behind, gap, sharpest, back)
            if (n + m) * step < shortest or used + n + m + 1 >= points.shape[0]:
                break
            begin = used
            for p in range(n - 1, -1, -1):
                points[used, 0], points[used, 1], leg_of[used] = forth[p, 0], forth[p, 1], leg
                used += 1
            points[used, 0], points[used, 1], leg_of[used] = x, y, leg
            used += 1
            for p in range(m):
                points[used, 0], points[used, 1], leg_of[used] = back[p, 0], back[p, 1], leg
                used += 1
            _press(stamp, points[begin:used], used - begin, spacing, gaps, fine)
            # The next leg begins beside this end, or further back where the crayon is still wanted.
            ex, ey = points[used - 1, 0], points[used - 1, 1]
            q = max(begin, used - 2)
            tx, ty = ex - points[q, 0], ey - points[q, 1]
            norm = np.sqrt(tx * tx + ty * ty)
            if norm <= 0:
                break
            tx, ty = tx / norm, ty / norm
            found = False
            beside = spacing * gaps[int(ey), int(ex)]
            for p in range(used - 1, max(begin, used - 1 - int(np.float32(3) * beside / step)), -1):
                nx, ny = points[p, 0] - side * ty * beside, points[p, 1] + side * tx * beside
                if (
                    0 <= nx < w
                    and 0 <= ny < h
                    and want[int(ny), int(nx)] > 0
                    and _free(stamp, nx, ny, fine, 1)
                ):
                    x, y, found = nx, ny, True
                    break
            side = -side  # the direction has turned about, the side on the sheet has not
            if not found:
                break
        if used > start:
            strokes += 1
            first[strokes] = used
    return strokes


def hatch(
    want: Floats,
    gaps: Floats,
    tangent: Floats,
    coherence: Floats,
    how: Hatch,
    rng: np.random.Generator,
) -> Paths:
    """Zigzags over want > 0, whose values are the pressure; gaps (h, w) widen the spacing; paths in
    work cells.
    """
    h, w = want.shape
    seeds = _seeds(want, how, rng)
    stamp = np.zeros((h * FINE, w * FINE), np.uint8)
    length = float((want > 0).sum()) / how.spacing
    points = np.empty((int(3 * length / STEP) + 20000, 2), np.float32)
    leg_of = np.empty(len(points), np.int32)
    first = np.zeros(len(seeds) + 2, np.int64)
    luck = rng.random(4099, np.float32)
    numbers = [np.float32(v) for v in (how.spacing, how.shortest, how.reach)]
    strokes = _hatch(
        want,
        gaps,
        tangent,
        coherence,
        seeds,
        luck,
        *numbers,
        how.legs,
        np.float32(how.gap),
        np.float32(how.single),
        np.float32(STEP),
        FINE,
        stamp,
        points,
        first,
        leg_of,
    )
    first = first[: strokes + 1]
    points = points[: first[-1]]
    pressure = want[points[:, 1].astype(np.int64), points[:, 0].astype(np.int64)]
    return Paths(points, _carried_over(pressure), leg_of[: first[-1]], first)


def _carried_over(pressure: Floats) -> Floats:
    """Where a line crosses ground that wants none, the pressure it had before (or finds after)."""
    known = np.where(pressure > 0, np.arange(len(pressure)), -1)
    before = np.maximum.accumulate(known)
    if before.size and before[0] < 0:
        before[before < 0] = int(np.argmax(pressure > 0))
    return pressure[before]


@lean_kernel
def _sow(want, left, top, rows, cols, pitch, jitter, block, seeds, rank):  # type: ignore[no-untyped-def]
    """Seeds (n, 2) on a jittered grid where they are wanted, and the rank (n,) of the region each
    lies in.
    """
    h, w = want.shape
    most = jitter.shape[1] - 1
    number = 0
    for i in range(rows):
        for j in range(cols):
            x = min(left + (j + jitter[0, i & most, j & most]) * pitch, w - 1e-3)
            y = min(top + (i + jitter[1, i & most, j & most]) * pitch, h - 1e-3)
            if want[int(y), int(x)] > 0:
                row, col = y // block, x // block
                seeds[number, 0], seeds[number, 1] = x, y
                rank[number] = 2 * w * row + (col if row % 2 == 0 else -col)  # to and fro
                number += 1
    return number


def _seeds(want: Floats, how: Hatch, rng: np.random.Generator) -> Floats:
    """Places to begin, one to a spacing, region by region as a hand moves over the sheet."""
    pitch = max(how.spacing * 0.7, 1.0)
    left, top, width, height = cv2.boundingRect((want > 0).astype(np.uint8))
    rows, cols = int(np.ceil(height / pitch)), int(np.ceil(width / pitch))
    jitter = rng.random((2, TILE, TILE), np.float32)
    seeds, rank = np.empty((rows * cols, 2), np.float32), np.empty(rows * cols)
    number = _sow(want, left, top, rows, cols, pitch, jitter, max(how.reach, 8.0), seeds, rank)
    return seeds[np.argsort(rank[:number] + rng.random(number))]
