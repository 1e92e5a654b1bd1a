"""Marks: the single movements of the crayon that a feature asks for, and the strokes they become.

Paths are in cells of the work grid, colours in OKLab with chroma doubled.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from .alike import norm
from .colour import oklab
from .drawing import Stroke, Tip
from .hand import FORCES_N
from .swatches import Swatches

Floats = NDArray[Any]
STEP = 0.6  # cells between points of a path
FINEST_MM = 0.5  # width of the sharpest tip
FIRM = (0.5, 0.7, 1.4, 2.0), (1.0, 0.75, 0.65, 0.5)  # widths in mm; N/mm2 for full darkness on wax
DEPTH = 1.6  # power of a mark's darkness to which the pressure rises
WOBBLE = 0.06  # widths
AREAS = "lips", "white"  # drawn at the pressure that gives their colour
FREE = "iris", "pupil", "frame", "symbol"  # in any crayon; other lines in those of skin
WEIGHTS = {
    "iris": (0.6, 1.2, 1.2),
    "lips": (0.7, 1.2, 1.2),
}  # of L, a and b by which a crayon is chosen
USUAL = (1.2, 1.0, 1.0)


def f32(values: Any) -> Floats:
    """Numbers as a float32 array."""
    return np.asarray(values, np.float32)


@dataclass(frozen=True, eq=False)
class Mark:
    """One movement of the crayon that a face asks for.

    path: (n, 2) cells.   pressure: (n,) how dark, 0..1.   colour: (3,) OKLab aimed at.   width: in
    cells.   role: what it draws ("lid", "iris", "brow", "nose", "lips", "mouth", ...).
    """

    path: Floats
    pressure: Floats
    colour: Floats
    width: float
    role: str

    def within(self, inside: Floats) -> "list[Mark]":
        """The pieces of the mark that lie where `inside` (h, w) has the paper drawn on."""
        free = np.concatenate([[0], sampled(inside, self.path) > 0.5, [0]])
        pieces = np.flatnonzero(np.diff(free)).reshape(-1, 2)
        return [
            replace(self, path=self.path[a:b], pressure=self.pressure[a:b])
            for a, b in pieces
            if b - a > 1
        ]


def curve(points: Floats, step: float = STEP) -> Floats:
    """A smooth line (n, 2) through points, ends kept, one point a step."""
    p = np.asarray(points, np.float64)
    for _ in range(2 if len(p) > 2 else 0):  # Chaikin's corner cutting
        inner = np.stack([0.75 * p[:-1] + 0.25 * p[1:], 0.25 * p[:-1] + 0.75 * p[1:]], 1)
        p = np.concatenate([p[:1], inner.reshape(-1, 2), p[-1:]])
    walked = np.append(0, np.cumsum(np.hypot(*np.diff(p, axis=0).T)))
    at = np.linspace(0, walked[-1], max(4, int(walked[-1] / step) + 1))
    return np.stack([np.interp(at, walked, p[:, i]) for i in range(2)], 1).astype(np.float32)


def sampled(image: Floats, points: Floats) -> Floats:
    """An image (h, w) or (h, w, c) at points (n, 2)."""
    x, y = np.ascontiguousarray(np.asarray(points, np.float32).T - f32(0.5))
    got = cv2.remap(image, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(got.reshape(len(points), *image.shape[2:]), np.float32)


def _normals(path: Floats) -> Floats:
    along = np.gradient(path, axis=0)
    return np.stack([-along[:, 1], along[:, 0]], 1) / (np.hypot(*along.T)[:, None] + 1e-6)


def settled(path: Floats, dark: Floats, reach: float) -> Floats:
    """The path moved to the darkest way near it, by at most `reach` cells to either side.

    Dynamic programming over offsets along the normals: darkness, less a price for leaving the path
    and for turning.
    """
    aside = np.linspace(-reach, reach, 2 * min(10, max(3, round(reach / 0.4))) + 1).astype(
        np.float32
    )
    path = path[:: max(1, len(path) // 80)]
    ways = path[:, None] + aside[:, None] * _normals(path)[:, None]
    gain = sampled(dark, ways.reshape(-1, 2)).reshape(len(path), -1) - 0.03 * (aside / reach) ** 2
    turn = 0.6 * (np.subtract.outer(aside, aside) / reach) ** 2
    best, came = gain[0], np.zeros(gain.shape, int)
    for i in range(1, len(path)):
        options = best[None] - turn
        came[i] = options.argmax(1)
        best = options.max(1) + gain[i]
    at = np.empty(len(path), int)
    at[-1] = best.argmax()
    for i in range(len(path) - 1, 0, -1):
        at[i - 1] = came[i, at[i]]
    return curve(ways[np.arange(len(path)), at][:: max(1, len(path) // 24)])


def smooth(values: Floats, width: int) -> Floats:
    return cv2.blur(values.reshape(1, -1), (width | 1, 1), borderType=cv2.BORDER_REPLICATE).ravel()


def envelope(n: int, begin: float, end: float) -> Floats:
    """How the pressure of a mark of n points rises and falls away, over these shares of its
    length.
    """
    t = np.linspace(0, 1, n)
    rise = np.clip(t / max(begin, 1e-3), 0, 1) * 0.75 + 0.25
    fall = np.clip((1 - t) / max(end, 1e-3), 0, 1) * 0.9 + 0.1
    return np.minimum(rise, fall).astype(np.float32)


def spiral(centre: Floats, outer: float, inner: float, gap: float) -> Floats:
    """A spiral inwards, a turn a gap, at least once round."""
    turns = max(1.05, (outer - inner) / gap)
    t = np.linspace(0, 1, max(8, int(turns * np.pi * (outer + inner) / STEP)))
    radius, angle = outer + t * (inner - outer), -2.2 + 2 * np.pi * turns * t
    return f32(centre + radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], 1))


def unit(v: Floats) -> Floats:
    return np.asarray(v / (norm(v) + 1e-9), np.float32)


def strokes(
    made: Sequence[Mark], swatches: Swatches, cell_mm: float, rng: np.random.Generator
) -> list[Stroke]:
    """Strokes for marks with a sharp tip, each in the crayon that comes nearest to its colour.

    Lines are drawn in the full colour of a crayon, areas in one that gives theirs at some pressure.
    """
    table = oklab(swatches.over(swatches.paper))
    out = []
    for mark in made:
        k, share = _crayon(mark, table)
        width = max(FINEST_MM, mark.width * cell_mm)
        # a fine tip has to be pressed harder to leave a mark on wax; darkness goes with the root
        firm = np.interp(width, *FIRM) * (share * mark.pressure) ** DEPTH
        wobble = np.cumsum(rng.standard_normal(mark.path.shape), 0) / np.sqrt(len(mark.path))
        path = np.round((mark.path + WOBBLE * mark.width * wobble) * cell_mm, 3).astype(np.float32)
        tip = Tip("sharp", round(width, 2))
        force = np.clip(np.round(firm * tip.area_mm2, 3), *FORCES_N).astype(np.float32)
        out.append(Stroke(path, force, swatches.names[k], tip, mark.role))
    return out


def _crayon(mark: Mark, table: Floats) -> tuple[int, float]:
    """The crayon for a mark, of a table (k, p, 3) of colours, and how much of its strength."""
    off = (((table - mark.colour) * f32(WEIGHTS.get(mark.role, USUAL))) ** 2).sum(-1)
    if mark.role not in AREAS:
        off[:, :-1] = np.inf
    if mark.role not in AREAS + FREE:
        body = _of_skin(table)
        if body.any():
            off[~body] = np.inf
    k, p = np.unravel_index(off.argmin(), off.shape)
    depth = np.linalg.norm(table[k] - table[:, 0].max(0), axis=-1)
    return int(k), float(np.sqrt(depth[p] / depth[-1]))


def _of_skin(table: Floats) -> Floats:
    """The crayons that skin is drawn in: peach to brown, and what is dark and hardly coloured."""
    a, b = np.moveaxis(table[:, table.shape[1] // 2, 1:], -1, 0)
    hue, chroma = np.arctan2(b, a), np.hypot(a, b)
    warm = (hue > 0.6) & (hue < 1.35) & (chroma > 0.06) & (chroma < 0.26)
    return warm | ((chroma < 0.1) & (np.cos(hue) > -0.3) & (table[:, -1, 0] < 0.45))
