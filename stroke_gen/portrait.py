"""Faces as a draughtsman sets them down over the modelling: lids, irises, brows, nose, mouth.

Landmarks say where a feature is and what it is called; the photo says how dark, how wide and how far it
goes: every line settles on the darkness near it and is pressed as that darkness asks, so that it fades
where the photo has none. Paths are in cells of the work grid, colours in OKLab with chroma doubled.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from . import subject
from .colour import oklab
from .drawing import Stroke, Tip
from .params import Style
from .subject import Face, Subject
from .swatches import Swatches

Floats = NDArray[np.float32]
FULL, SMALL = 9.0, 6.0  # eye widths in cells: all features; lid, dab and mouth line; below, blots
STEP = 0.6  # cells between points of a path
STRONG = 0.14  # darkness of a face's features against what lies round them
FINEST_MM = 0.5
FIRM = (0.5, 1.0, 1.4, 2.0), (8.0, 5.0, 3.0, 2.0)  # widths in mm, and N/mm2 for their full darkness
WOBBLE = 0.06  # widths
AREAS = "lips", "white"  # drawn at the pressure that gives their colour
WEIGHTS = {"iris": np.float32([0.6, 1.2, 1.2]), "": np.float32([1.2, 1, 1])}  # of L, a, b
FREE = "iris", "pupil", "frame", "symbol"  # in any crayon; other lines in those of skin
RIDGE = 0.045  # darkness of a line that landmarks do not explain
LEAST = 0.1  # pressure below which the hand lifts the crayon
NOSE = (129, 102, 64, 98, 240, 60, 20, 2, 250, 290, 460, 327, 294, 331, 358)
BRIDGE = (122, 196, 236, 198, 129), (351, 419, 456, 420, 358)
JAW = (127, 234, 93, 132, 58, 172, 136, 150, 149, 176, 148, 152, 377, 400, 378, 379, 365, 397, 288, 361,
       323, 454, 356)  # fmt: skip
SMILE = (49, 203, 206, 216), (279, 423, 426, 436)


@dataclass(frozen=True, eq=False)
class Mark:
    """One movement of the crayon that a face asks for.

    path: (n, 2) cells.   pressure: (n,) 0..1.   colour: (3,) OKLab aimed at.   width: of the line, in
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
            replace(self, path=self.path[a:b], pressure=self.pressure[a:b]) for a, b in pieces if b - a > 1
        ]


def draw(
    seen: Subject, lab: Floats, inside: Floats, box: Swatches, cell_mm: float, style: Style,
    rng: np.random.Generator,
) -> list[Stroke]:  # fmt: skip
    """Strokes for all faces, as the style has them.

    lab: the photo's own OKLab (h, w, 3) on the work grid.   inside: where paper may be drawn on (h, w).
    """
    made = []
    for face in seen.faces:
        if style.symbols:
            made += symbols(face, lab, style.symbols, rng)
        else:
            made += marks(face, lab, rng)
    return strokes([piece for mark in made for piece in mark.within(inside)], box, cell_mm, rng)


def marks(face: Face, lab: Floats, rng: np.random.Generator) -> list[Mark]:
    """The marks of a face, in drawing order, from the photo's OKLab (h, w, 3) on the work grid."""
    margin = 0.35 * face.height + 4
    x0, y0 = np.maximum(0, face.landmarks.min(0) - margin).astype(int)
    x1, y1 = (face.landmarks.max(0) + margin).astype(int) + 1
    corner = np.float32([x0, y0])
    near = Face(face.landmarks - corner, face.score)
    made = _Sitter(near, np.ascontiguousarray(lab[y0:y1, x0:x1]), rng).drawn()
    return [replace(mark, path=mark.path + corner) for mark in made]


def kept(seen: Subject, shape: tuple[int, int]) -> tuple[Floats, Floats, Floats]:
    """What is left to portraits (h, w), 0..1: by all wax, by touches, by outlines.

    Whites of eyes and teeth, which marks shade; eyes, brows and mouths; faces.
    """
    empty = np.zeros((3, *shape), np.float32)
    large = [face for face in seen.faces if face.eye_width >= FULL]
    if not large:
        return empty[0], empty[1], empty[2]
    rings = [(top, low) for lids in (zip(subject.UPPER_LID, subject.LOWER_LID, strict=True),) for top, low in lids]
    whites = [face.path((*top, *low[::-1])) for face in large for top, low in rings]
    whites += [
        face.path((*subject.MOUTH_TOP, *subject.MOUTH_BOTTOM[::-1])) for face in large if parted(face)
    ]
    features = np.max([subject.features(face, shape) for face in large], 0)
    ovals = subject.polygons([face.path(subject.OVAL) for face in large], shape)
    return subject.polygons(whites, shape), subject.soft(features), ovals


def parted(face: Face) -> bool:
    """Whether the lips are open."""
    top, bottom = face.path(subject.MOUTH_TOP), face.path(subject.MOUTH_BOTTOM)
    gap = float(np.linalg.norm(top - bottom, axis=1).max())
    return gap > max(0.1 * float(np.linalg.norm(top[0] - top[-1])), 0.08 * face.eye_width, 1.8)


# ---- lines ---------------------------------------------------------------------------------------


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
    x, y = np.ascontiguousarray(np.asarray(points, np.float32).T - np.float32(0.5))
    got = cv2.remap(image, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(got.reshape(len(points), *image.shape[2:]), np.float32)


def _normals(path: Floats) -> Floats:
    along = np.gradient(path, axis=0)
    return np.stack([-along[:, 1], along[:, 0]], 1) / (np.hypot(*along.T)[:, None] + 1e-6)


def settled(path: Floats, dark: Floats, reach: float) -> Floats:
    """The path moved to the darkest way near it, by at most `reach` cells to either side.

    Dynamic programming over offsets along the normals: darkness less a price for leaving and for turning.
    """
    aside = np.linspace(-reach, reach, 2 * min(10, max(3, round(reach / 0.4))) + 1).astype(np.float32)
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


def _smooth(values: Floats, width: int) -> Floats:
    return cv2.blur(values.reshape(1, -1), (width | 1, 1), borderType=cv2.BORDER_REPLICATE).ravel()


def _taper(n: int, begin: float, end: float) -> Floats:
    """How a line begins and lifts off, over these shares of its length."""
    t = np.linspace(0, 1, n)
    rise = np.clip(t / max(begin, 1e-3), 0, 1) * 0.75 + 0.25
    fall = np.clip((1 - t) / max(end, 1e-3), 0, 1) * 0.9 + 0.1
    return np.minimum(rise, fall).astype(np.float32)


@dataclass(frozen=True, eq=False)
class _Eye:
    """What an open eye shows: lids, where it is open, the iris' disc, colours of iris and white, its light."""

    top: Floats
    bottom: Floats
    inside: Floats
    centre: Floats
    radius: float
    ring: Floats
    white: Floats
    glint: Floats
    glint_light: float


# ---- a face --------------------------------------------------------------------------------------


class _Sitter:
    """One face, the photo round it, and the marks made so far."""

    def __init__(self, face: Face, lab: Floats, rng: np.random.Generator) -> None:
        self.face, self.lab, self.rng = face, lab, rng
        self.eye = face.eye_width
        self.fine = max(1.5, 0.07 * self.eye)  # width of a line
        light = np.ascontiguousarray(lab[..., 0])
        near = cv2.GaussianBlur(light, (0, 0), max(0.5, 0.02 * self.eye))
        far = subject.soft(light, max(2.0, 0.22 * self.eye))
        self.dark = far - near  # how much darker than what lies round it
        self.light, self.light_near = light, near
        self.near = cv2.GaussianBlur(lab, (0, 0), max(0.5, 0.03 * self.eye))
        oval = subject.polygons([face.path(subject.OVAL)], light.shape)
        inside = lab[oval > 0.5] if (oval > 0.5).sum() > 8 else lab.reshape(-1, 3)
        self.skin = np.median(inside[inside[:, 0] >= np.median(inside[:, 0])], 0)
        strong = np.quantile((far - near)[oval > 0.5], 0.97) if (oval > 0.5).any() else STRONG
        self.dark *= np.clip(STRONG / max(float(strong), 1e-3), 0.8, 2.0)  # dim photos as clear as others
        self.made: list[Mark] = []

    def drawn(self) -> list[Mark]:
        if self.eye < SMALL:
            self.blots()
            return self.made
        if self.eye >= FULL:
            self.lips()
            self.nose()
            self.contours()
        self.mouth()
        self.eyes()
        for side in (0, 1):
            self.brow(side)
        if self.eye >= FULL:
            self.traces()
        return self.made

    # -- marks

    def add(self, path: Floats, pressure: Floats, colour: Floats, width: float, role: str) -> None:
        """The pieces of a line between which the hand lifts the crayon."""
        down = np.concatenate([[False], pressure > LEAST, [False]])
        for a, b in np.flatnonzero(np.diff(down.astype(int))).reshape(-1, 2):
            if b - a > 1 and (b - a) * STEP > 0.6 * width:
                piece = np.asarray(path[a:b], np.float32)
                self.made.append(
                    Mark(piece, pressure[a:b].astype(np.float32), np.float32(colour), width, role)
                )

    def line(
        self, points: Floats, role: str, reach: float, floor: float, gain: float,
        width: float = 1.0, ends: tuple[float, float] = (0.2, 0.35), tint: float = 1.0,
        colour: Floats | None = None,
    ) -> Floats:  # fmt: skip
        """A line near points that is pressed by `floor`, and by `gain` times the darkness it finds."""
        path = settled(curve(points), self.dark, max(0.8, reach * self.eye))
        found = _smooth(np.maximum(sampled(self.dark, path), 0), 5)
        pressure = np.clip(floor + gain * found, 0, 1) * _taper(len(path), *ends)
        if colour is None:
            seen = sampled(self.lab, path)
            colour = np.median(seen[seen[:, 0] <= np.median(seen[:, 0])], 0)
            colour = np.float32([min(colour[0] - 0.1, self.skin[0] - 0.18), *(tint * colour[1:])])
        self.add(path, pressure, colour, width * self.fine, role)
        return path

    def loft(
        self, top: Floats, bottom: Floats, role: str, width: float, pressed: Callable[[Floats], Floats],
        colour: Floats, closeness: float = 0.75,
    ) -> None:  # fmt: skip
        """Lines side by side from one curve to another; `pressed` maps points to pressure."""
        gap = closeness * width
        depth = np.linalg.norm(top - bottom, axis=1).max()
        rows = int(depth / gap)
        for i in range(rows):
            t = (i + 0.5 + self.rng.uniform(-0.15, 0.15)) / rows
            path = curve((1 - t) * top + t * bottom)
            path = path[:: 1 if i % 2 else -1]
            self.add(path, pressed(path) * _taper(len(path), 0.1, 0.2), colour, width, role)

    # -- features

    def eyes(self) -> None:
        """Both eyes; they share the colour of what shows of iris and white in either."""
        seen, colour, lit = self.looks()
        for lids in zip(subject.UPPER_LID, subject.LOWER_LID, strict=True):
            top, bottom = (self.face.path(lid) for lid in lids)
            self.lids(top, bottom)
        for one in seen:
            if self.eye >= FULL:
                self.white(one, lit)
            self.iris(one, colour)

    def looks(self) -> tuple[list["_Eye"], Floats, Floats]:
        """The eyes that are open, the colour for their irises, and that of their whites."""
        seen = [one for side in (0, 1) if (one := self.looked_at(side))]
        ring = np.concatenate([one.ring for one in seen] or [np.empty((0, 3))])
        white = np.concatenate([one.white for one in seen] or [np.empty((0, 3))])
        lit = np.median(white, 0) if len(white) > 3 else self.skin
        colour = np.median(ring, 0) if len(ring) > 3 else self.skin * np.float32([0.5, 1, 1])
        return seen, _iris_colour(colour, lit), lit

    def lids(self, top: Floats, bottom: Floats) -> None:
        wide, high = float(np.linalg.norm(top[0] - top[-1])), float(np.linalg.norm(top[4] - bottom[4]))
        if wide < 0.35 * self.eye:  # turned away
            self.line(top, "lid", 0.1, 0.2, 3)
            return
        up = _unit(top[1:-1].mean(0) - bottom[1:-1].mean(0))
        outer = top[0] + 0.1 * (top[0] - top[-1])
        lid = np.concatenate([[outer], top[:-1]]) if self.eye >= FULL else top
        made = self.line(lid, "lid", 0.06, 0.55, 2.2, 1.15, (0.3, 0.3))
        if self.eye >= 18:  # lashes make it the heaviest line of a face
            weight = np.interp(np.linspace(0, 1, len(made)), [0, 0.35, 0.8, 1], [0.4, 1, 0.7, 0])
            shade = np.float32([0.22, *(0.4 * self.skin[1:])])
            weight *= np.interp(self.eye, [18, 40], [0.5, 0.9])
            self.add(made + 0.03 * self.eye * up, weight, shade, self.fine, "lid")
        if self.eye >= FULL:
            self.line(bottom[1:-1], "lower lid", 0.07, 0.0, 3.2, 0.8, (0.2, 0.4))
            fold = top[1:-1] + (0.3 * high + 0.05 * wide) * up
            self.line(fold, "fold", 0.1, 0.0, 3.5, 0.8, (0.35, 0.4))

    def looked_at(self, side: int) -> "_Eye | None":
        """What an eye shows between its lids; None if it is closed or turned away."""
        top, bottom = (self.face.path(lid[side]) for lid in (subject.UPPER_LID, subject.LOWER_LID))
        wide = float(np.linalg.norm(top[0] - top[-1]))
        if wide < 0.35 * self.eye or np.linalg.norm(top[4] - bottom[4]) < 0.12 * wide:
            return None
        ring = np.concatenate([top, bottom[::-1]])
        inside = subject.polygons([ring], self.light.shape)
        low, high = ring.min(0), ring.max(0)
        step = max(0.5, wide / 40)
        grid = np.float32(np.mgrid[low[0] : high[0] : step, low[1] : high[1] : step].reshape(2, -1).T)
        points = grid[sampled(inside, grid) > 0.4]
        if len(points) < 6:
            return None
        centre, radius = _disc(points, sampled(self.light, points), ring, wide)
        far = np.linalg.norm(points - centre, axis=1) / radius
        within = points[far < 0.8]
        lights = sampled(self.light_near, within) if len(within) else np.zeros(1)
        glint = within[lights.argmax()] if len(within) else centre
        iris, white = sampled(self.lab, points[(far > 0.4) & (far < 0.95)]), sampled(self.lab, points[far > 1.2])
        return _Eye(top, bottom, inside, centre, radius, iris, white, glint, float(lights.max()))

    def iris(self, eye: "_Eye", colour: Floats) -> None:
        """Coloured ring, dark pupil, and a light left free."""
        radius, width = eye.radius, min(0.8 * self.fine, 0.7 * eye.radius)
        shines = eye.glint_light > colour[0] + 0.12 and radius > 2.5 * width
        hole = max(0.16 * radius, 0.4 * width) + 0.5 * width if shines else 0

        def spiral(outer: float, inner: float, gap: float, dark: float, tint: Floats) -> None:
            path = _spiral(eye.centre, max(outer * radius - 0.3 * width, 0.1), inner * radius, gap * width)
            free = np.linalg.norm(path - eye.glint, axis=1) >= hole
            self.add(path, dark * (sampled(eye.inside, path) > 0.35) * free, tint, width,
                     "iris" if inner else "pupil")  # fmt: skip

        dark = np.float32([0.2, 0, 0])
        if radius > 1.6 * width:
            spiral(0.95, 0.35, 0.7, 0.5, np.float32([colour[0], 0, 0.02]))  # greyed, as irises are
            spiral(0.95, 0.35, 0.7, 0.55, colour)
            spiral(1.0, 0.95, 1.0, 0.65, colour * np.float32([0.6, 1, 1]))
            spiral(0.45, 0, 0.5, 1.0, dark)
        else:
            spiral(0.75, 0, 0.5, 0.9, dark)

    def white(self, eye: "_Eye", lit: Floats) -> None:
        """The shade on the white of the eye."""
        shown = self.shown_white(float(lit[0]))

        def pressed(path: Floats) -> Floats:
            shade = shown + np.clip((lit[0] + 0.02 - sampled(self.light_near, path)) / 0.4, 0, 0.4)
            free = np.linalg.norm(path - eye.centre, axis=1) > eye.radius
            return np.float32(shade * (sampled(eye.inside, path) > 0.5) * free)

        self.loft(eye.top, eye.bottom, "white", 0.8 * self.fine, pressed, np.float32([0.6, 0, 0.02]), 0.5)

    def shown_white(self, light: float) -> float:
        """How much grey a white of this OKLab lightness gets: a part of what the photo shows."""
        light = max(light, float(self.skin[0]))
        return float(np.clip(0.4 * (0.95 - light) / 0.4, 0, 0.6))

    def brow(self, side: int) -> None:
        """Short hairs that lean outwards, where the photo has them."""
        top, bottom = (self.face.path(b[side])[::-1] for b in (subject.BROW_TOP, subject.BROW_BOTTOM))
        middle = 0.5 * (top + bottom)
        if self.eye < 14:
            self.line(middle, "brow", 0.1, 0.25, 2.5, 1.2, (0.15, 0.5))
            return
        length = float(np.linalg.norm(middle[0] - middle[-1]))
        up = _unit(top.mean(0) - bottom.mean(0)) * np.linalg.norm(top[2] - bottom[2])
        low, high = curve(bottom - 0.3 * up, 0.3), curve(top + 0.25 * up, 0.3)
        dark = subject.soft(self.light, 0.5 * self.eye) - self.light_near
        band = subject.polygons([np.concatenate([low, high[::-1]])], dark.shape) > 0.5
        if not band.any():
            return
        most = float(np.quantile(dark[band], 0.9))
        if most < 0.015:
            return
        seen = self.lab[band & (dark > 0.4 * most)]
        colour = np.float32([np.quantile(seen[:, 0], 0.25), *np.median(seen[:, 1:], 0)])
        width = 0.75 * self.fine
        number = int(length / (0.38 * width))
        u, row = self.rng.uniform(0, 0.95, number), self.rng.uniform(-0.1, 0.65, number)
        lift = 0.75 - 0.65 * u  # upright by the nose, lying down at the temple
        root = _between(low, high, u, row)
        tip = _between(low, high, np.minimum(1.0, u + 0.1 + 0.16 * u), np.minimum(row + lift, 1.05))
        bend = 0.5 * (root + tip) + 0.12 * lift[:, None] * up
        t = np.linspace(0, 1, max(5, int(0.25 * length / STEP)), dtype=np.float32)[:, None, None]
        hairs = ((1 - t) ** 2 * root + 2 * t * (1 - t) * bend + t * t * tip).astype(np.float32)
        found = sampled(dark, hairs.reshape(-1, 2)).reshape(len(t), number)
        level = min(1.0, 0.35 + 4 * most) * np.clip((found / most - 0.15) / 0.6, 0, 1)
        pressure = level * _taper(len(t), 0.2, 0.7)[:, None]
        for i in np.argsort(u):
            self.add(hairs[:, i], pressure[:, i], colour, width, "brow")

    def nose(self) -> None:
        self.line(self.face.path(NOSE), "nose", 0.09, 0.0, 4.5, 0.95, (0.1, 0.1), 1.2)
        for side in BRIDGE:
            self.line(self.face.path(side), "bridge", 0.12, -0.1, 4, 1.1, (0.5, 0.4), 1.2)
        for side in SMILE:
            self.line(self.face.path(side), "cheek", 0.12, -0.08, 3, 1.0, (0.3, 0.5), 1.2)

    def lips(self) -> None:
        face, width = self.face, 0.85 * self.fine
        up, low = face.path(subject.LIP_TOP), face.path(subject.LIP_BOTTOM)
        inner_up, inner_low = face.path(subject.MOUTH_TOP), face.path(subject.MOUTH_BOTTOM)
        bands = (up, inner_up), (inner_low, low)
        band = subject.polygons([np.concatenate([a, b[::-1]]) for a, b in bands], self.light.shape) > 0.5
        if band.sum() < 6:
            return
        colour = _rosy(self.lab[band], self.skin)

        def pressed(path: Floats) -> Floats:
            off = np.linalg.norm(sampled(self.near, path) - self.skin, axis=1)
            return np.float32(np.clip(0.12 + 2.4 * off, 0, 0.85))

        for top, bottom in bands:
            self.loft(top, bottom, "lips", width, pressed, colour)
        deep = colour * np.float32([0.75, 1, 1])
        self.line(inner_up[1:-1] - 0.3 * width * face.down, "lips", 0.02, 0.3, 2, 0.7, (0.2, 0.2), colour=deep)
        self.line(low[2:-2] + 0.1 * self.eye * face.down, "under lip", 0.12, -0.05, 3, 1.1, (0.4, 0.4), 1.2)

    def mouth(self) -> None:
        """The dark between the lips; teeth stay light."""
        top, bottom = self.face.path(subject.MOUTH_TOP), self.face.path(subject.MOUTH_BOTTOM)
        if not parted(self.face):
            self.line(0.5 * (top + bottom), "mouth", 0.07, 0.4, 2.5, 1.0, (0.12, 0.12), 1.1)
            return
        inside = subject.polygons([np.concatenate([top, bottom[::-1]])], self.light.shape) > 0.5
        teeth = float(np.quantile(self.light[inside], 0.85)) if inside.any() else 1.0
        shown = 0.5 * self.shown_white(teeth)

        def cavity(path: Floats) -> Floats:
            return np.float32(np.clip((self.skin[0] - 0.25 - sampled(self.light_near, path)) / 0.15, 0, 1))

        def shade(path: Floats) -> Floats:
            light = sampled(self.light_near, path)
            return np.float32(np.clip(shown + 1.2 * (teeth - light - 0.03), 0, 0.6) * (cavity(path) < 0.2))

        self.loft(top, bottom, "white", 0.9 * self.fine, shade, np.float32([0.72, 0.01, 0.05]), 0.5)
        self.loft(top, bottom, "mouth", 0.9 * self.fine, cavity, np.float32([0.28, 0.08, 0.04]))

    def contours(self) -> None:
        """Cheek and jaw, where the photo has an edge."""
        self.line(self.face.path(JAW), "jaw", 0.2, -0.1, 3, 1.1, (0.1, 0.1), 1.2)

    def traces(self) -> None:
        """What landmarks do not explain: glasses, beards, wrinkles that matter, strands over the forehead."""
        dark = subject.soft(self.light, max(1.5, 0.12 * self.eye)) - self.light_near
        oval = self.face.path(subject.OVAL)
        done = 1 - subject.polygons([oval.mean(0) + 0.92 * (oval - oval.mean(0))], self.light.shape)
        lids = [self.face.path((*a, *b[::-1])) for a, b in zip(subject.UPPER_LID, subject.LOWER_LID, strict=True)]
        lips = [self.face.path((*subject.LIP_TOP, *subject.LIP_BOTTOM[::-1]))]
        taken = (np.maximum(done, subject.polygons(lids + lips, done.shape)) > 0.3).astype(np.uint8)
        for mark in self.made:
            path = [np.round(mark.path).astype(np.int32)]
            cv2.polylines(taken, path, False, 1, max(1, round(3.5 * mark.width)))
        ridge = ((dark > RIDGE) & (taken == 0)).astype(np.uint8)
        for chain in _chains(cv2.ximgproc.thinning(ridge * 255)):
            if len(chain) < 0.5 * self.eye:
                continue
            path = curve(chain[:: max(1, len(chain) // 16)])
            pressure = np.clip(4.5 * _smooth(sampled(dark, path), 5), 0, 0.9) * _taper(len(path), 0.2, 0.3)
            colour = np.median(sampled(self.lab, path), 0) - np.float32([0.1, 0, 0])
            tint = np.linalg.norm(colour[1:] - self.skin[1:] * max(0.5, colour[0] / self.skin[0]))
            self.add(path, pressure, colour, self.fine, "frame" if tint > 0.06 else "trace")

    def blots(self) -> None:
        """Eyes and mouth of a face too small for features."""
        dark = np.float32([max(0.2, self.skin[0] - 0.35), *(0.6 * self.skin[1:])])
        for side in (0, 1):
            top, bottom = (self.face.path(lid[side]) for lid in (subject.UPPER_LID, subject.LOWER_LID))
            if np.linalg.norm(top[0] - top[-1]) > 0.35 * self.eye:
                self.line(0.5 * (top + bottom), "lid", 0.3, 0.8, 2, 1.0, (0.1, 0.1), colour=dark)
        lips = 0.5 * (self.face.path(subject.MOUTH_TOP) + self.face.path(subject.MOUTH_BOTTOM))
        self.line(lips, "mouth", 0.15, 0.3, 2, 1.0, (0.1, 0.1), 1.3)


def _chains(thin: NDArray[np.uint8]) -> list[Floats]:
    """Lines (n, 2) of cells along a thinned picture, each as straight on as it can go."""
    left = set(map(tuple, np.argwhere(thin > 0).tolist()))
    around = [(dy, dx) for dy in (-1, 0, 1) for dx in (-1, 0, 1) if dy or dx]

    def beside(y: int, x: int) -> list[tuple[int, int]]:
        return [(y + dy, x + dx) for dy, dx in around if (y + dy, x + dx) in left]

    chains = []
    for start in sorted(left, key=lambda cell: (len(beside(*cell)) != 1, cell)):
        if start not in left:
            continue
        chain, heading = [start], (0, 0)
        left.discard(start)
        while ways := beside(*chain[-1]):
            y, x = chain[-1]
            step = max(ways, key=lambda w: (w[0] - y) * heading[0] + (w[1] - x) * heading[1])
            back = chain[-min(4, len(chain))]
            heading = step[0] - back[0], step[1] - back[1]
            chain.append(step)
            left.discard(step)
        chains.append(np.float32(chain)[:, ::-1] + np.float32(0.5))
    return chains


def _iris_colour(seen: Floats, white: Floats) -> Floats:
    """The colour an iris is drawn in: brown, or from blue to green.

    The white of the eye says what the light is: how bright, and of what tint.
    """
    a, b = 2 * (seen[1:] - white[1:] * seen[0] / white[0])
    hue, chroma = np.arctan2(b, a), np.hypot(a, b)
    light = 0.85 * min(1.0, float(seen[0] / white[0])) ** 1.5
    if np.cos(hue) > 0 or light < 0.3:
        hue = np.clip(hue, 0.8, 1.2)
    elif chroma > 0.02:
        chroma = max(chroma, 0.1)
    return np.float32([light, chroma * np.cos(hue), chroma * np.sin(hue)])


def _rosy(seen: Floats, skin: Floats) -> Floats:
    """The colour lips (n, 3) are drawn in: their strongest half's, in light that gives skin its usual chroma."""
    chroma = np.hypot(seen[:, 1], seen[:, 2])
    light, a, b = np.median(seen[chroma >= np.median(chroma)], 0)
    hue = np.clip(np.arctan2(b, a), np.deg2rad(12), np.deg2rad(36))
    chroma = 1.15 * np.hypot(a, b) * np.clip(0.12 / np.hypot(*skin[1:]), 1, 1.6)
    return np.float32([light, chroma * np.cos(hue), chroma * np.sin(hue)])


def _unit(v: Floats) -> Floats:
    return np.asarray(v / (np.linalg.norm(v) + 1e-9), np.float32)


def _between(low: Floats, high: Floats, u: Floats, v: Floats) -> Floats:
    """Points (n, 2) of the band between two curves: u along it, v across it."""
    a, b = (c[np.minimum((u * len(c)).astype(int), len(c) - 1)] for c in (low, high))
    return (1 - v[:, None]) * a + v[:, None] * b


def _spiral(centre: Floats, outer: float, inner: float, gap: float) -> Floats:
    """A spiral inwards, a turn a gap, at least once round."""
    turns = max(1.05, (outer - inner) / gap)
    t = np.linspace(0, 1, max(8, int(turns * np.pi * (outer + inner) / STEP)))
    radius, angle = outer + t * (inner - outer), -2.2 + 2 * np.pi * turns * t
    return np.float32(centre + radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], 1))


def _disc(points: Floats, level: Floats, opening: Floats, wide: float) -> tuple[Floats, float]:
    """Centre and radius of the darkest disc in an eye's opening."""
    n = len(opening) // 2
    inner, outer = opening[n - 1], opening[0]
    middle = 0.5 * (opening[4] + opening[-5])
    across = _unit(opening[4] - opening[-5])
    shares, lifts = np.meshgrid(np.linspace(-0.22, 0.22, 12), np.linspace(-0.08, 0.1, 5))
    shares, lifts = shares.reshape(-1, 1), lifts.reshape(-1, 1)
    centres = middle + shares * (inner - outer) + lifts * wide * across
    far = np.linalg.norm(points - centres[:, None], axis=2) / wide
    best = (-np.inf, middle, 0.2)
    for radius in (0.18, 0.2, 0.22):
        disc, ring = far < radius, (far > 1.1 * radius) & (far < 1.6 * radius)
        means = [(part @ level) / np.maximum(part.sum(1), 1) for part in (ring, disc)]
        worth = means[0] - means[1] - (0.4 * shares**2 + 2 * lifts**2)[:, 0]
        worth[(disc.sum(1) < 3) | (ring.sum(1) < 3)] = -np.inf
        best = max(best, (float(worth.max()), centres[worth.argmax()], radius), key=lambda one: one[0])
    return np.float32(best[1]), best[2] * wide


# ---- a child's faces -----------------------------------------------------------------------------


def symbols(face: Face, lab: Floats, age: int, rng: np.random.Generator) -> list[Mark]:
    """A face as a child of this age sets it down, at the right place and with the face's own mood.

    At three two dots and a line; at five round eyes and a smile; at eight eyes with colour, brows, a nose
    and lips; at ten lids, lashes and nostrils too.
    """
    return _Child(face, lab, age, rng).drawn()


class _Child:
    """One face, and the symbols made of it."""

    def __init__(self, face: Face, lab: Floats, age: int, rng: np.random.Generator) -> None:
        self.face, self.age, self.rng = face, age, rng
        corners = [face.path(lid).mean(0) for lid in subject.UPPER_LID]
        self.right = _unit(corners[1] - corners[0])
        self.size = max(face.eye_width, 0.35 * float(np.linalg.norm(corners[1] - corners[0])))
        self.width = max(2.0, float(np.interp(age, [3, 5, 8, 10], [0.3, 0.22, 0.16, 0.12])) * self.size)
        _, self.colour, _ = _Sitter(face, lab, rng).looks()
        self.made: list[Mark] = []

    def add(self, path: Floats, colour: Sequence[float], width: float = 1.0) -> None:
        shaky = float(np.interp(self.age, [3, 10], [0.09, 0.015])) * self.size
        line = curve(np.asarray(path, np.float32), 1.0)
        knots = self.rng.standard_normal((max(2, round(2.5 * len(line) / self.size)), 2))
        at = np.linspace(0, len(knots) - 1, len(line))
        line = line + shaky * np.stack([np.interp(at, np.arange(len(knots)), k) for k in knots.T], 1)
        press = np.clip(0.8 + 0.1 * self.rng.standard_normal(), 0.6, 1) * _taper(len(line), 0.05, 0.1)
        self.made.append(
            Mark(np.float32(line), np.float32(press), np.float32(colour), width * self.width, "symbol")
        )

    def arc(self, middle: Floats, wide: float, high: float, begin: float, end: float) -> Floats:
        """Part of an ellipse that lies as the face does; angles in turns, clockwise from the right."""
        angle = 2 * np.pi * np.linspace(begin, end, 16)
        down = np.float32([-self.right[1], self.right[0]])
        return middle + np.outer(wide * np.cos(angle), self.right) + np.outer(high * np.sin(angle), down)

    def drawn(self) -> list[Mark]:
        for side in (0, 1):
            self.eye(side)
        self.nose()
        self.mouth()
        return self.made

    def eye(self, side: int) -> None:
        black, brown = (0.2, 0, 0), (0.32, 0.07, 0.08)
        top, bottom = (self.face.path(lid[side]) for lid in (subject.UPPER_LID, subject.LOWER_LID))
        middle, size = 0.5 * (top.mean(0) + bottom.mean(0)), self.size
        if self.age < 5:
            self.add(_spiral(middle, 0.2 * size, 0.02 * size, 0.6 * self.width), black)
        elif self.age < 8:
            self.add(self.arc(middle, 0.45 * size, 0.42 * size, 0.7, 1.75), black)
            self.add(_spiral(middle, 0.15 * size, 0.02 * size, 0.6 * self.width), black)
        else:
            lid = 0.36 if self.age < 10 else 0.3
            self.add(self.arc(middle, 0.55 * size, lid * size, 0.5, 1.0), black)
            self.add(self.arc(middle, 0.55 * size, lid * size, 1.0, 1.5), black, 0.8)
            self.add(_spiral(middle, 0.24 * size, 0.1 * size, 0.6 * self.width), self.colour)
            self.add(_spiral(middle, 0.1 * size, 0.01, 0.5 * self.width), black)
            brow = self.face.path(subject.BROW_TOP[side])
            self.add(brow + 0.06 * (brow - middle), brown, 1.2)
        if self.age >= 10:
            for turn in (0.56, 0.65, 0.75, 0.85, 0.94):
                lash = self.arc(middle, 1.0, 1.0, turn, turn)[:1] - middle
                root = middle + lash * np.float32([0.5, 0.35]) * size
                self.add(np.concatenate([root, root + 0.22 * size * lash]), black, 0.6)

    def nose(self) -> None:
        tip, below, brown = self.face.landmarks[4], self.face.landmarks[2], (0.42, 0.12, 0.14)
        if self.age < 5:
            return
        if self.age < 8:
            self.add(_spiral(tip, 0.1 * self.size, 0.02 * self.size, 0.6 * self.width), brown)
        elif self.age < 10:
            self.add(np.stack([self.face.landmarks[6], tip - 0.15 * self.size * self.right, below]), brown)
        else:
            self.add(self.face.path((193, 196, 236)), brown, 0.7)
            self.add(self.arc(below, 0.4 * self.size, 0.16 * self.size, 0.0, 0.5), brown)
            for nostril in (self.face.landmarks[[60, 99]].mean(0), self.face.landmarks[[290, 328]].mean(0)):
                self.add(_spiral(nostril, 0.06 * self.size, 0.01, 0.3 * self.width), brown)

    def mouth(self) -> None:
        red = (0.55, 0.36, 0.18)
        lips = 0.5 * (self.face.path(subject.MOUTH_TOP) + self.face.path(subject.MOUTH_BOTTOM))
        bow = np.sin(np.linspace(0, np.pi, len(lips)))[:, None] * self.face.down
        mood = float(((lips[5] - lips[[0, -1]].mean(0)) @ self.face.down) / self.face.height)
        sag = (0.05 + np.clip(mood, -0.03, 0.04)) * self.face.height
        wide = lips.mean(0) + np.float32([1.15 if self.age < 8 else 1.0]) * (lips - lips.mean(0))
        if self.age < 8:
            self.add(wide + (0.5 if self.age < 5 else 1.0) * sag * bow, red, 1.1)
            return
        self.add(self.face.path(subject.LIP_TOP), red)
        self.add(self.face.path(subject.LIP_BOTTOM) + 0.2 * sag * bow, red)
        self.add(wide + 0.4 * sag * bow, red if self.age < 10 else (0.3, 0.1, 0.05), 0.8)


# ---- from marks to strokes -----------------------------------------------------------------------


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
        # Wax on wax: a fine tip has to be pressed hard to leave a mark, and darkness goes with the root.
        firm = np.interp(width, *FIRM) * (share * mark.pressure) ** 2
        wobble = np.cumsum(rng.standard_normal(mark.path.shape), 0) / np.sqrt(len(mark.path))
        path = np.round((mark.path + WOBBLE * mark.width * wobble) * cell_mm, 3).astype(np.float32)
        force = np.clip(np.round(firm * 0.785 * width**2, 3), 0.02, 60).astype(np.float32)
        out.append(Stroke(path, force, swatches.names[k], Tip("sharp", round(width, 2)), mark.role))
    return out


def _crayon(mark: Mark, table: Floats) -> tuple[int, float]:
    """The crayon (of a table (k, p, 3) of colours) for a mark, and how much of its strength is wanted."""
    off = (((table - mark.colour) * WEIGHTS.get(mark.role, WEIGHTS[""])) ** 2).sum(-1)
    if mark.role not in AREAS:
        off[:, :-1] = np.inf
    if mark.role not in AREAS + FREE:
        light, hue = table[:, -1, 0], np.arctan2(table[:, -1, 2], table[:, -1, 1])
        chroma = np.hypot(table[:, -1, 1], table[:, -1, 2])
        skin = ((hue > 0.7) & (hue < 1.35) & (chroma < 0.22)) | ((chroma < 0.03) & (light < 0.35))
        if skin.any():
            off[~skin] = np.inf
    k, p = np.unravel_index(off.argmin(), off.shape)
    depth = np.linalg.norm(table[k] - table[:, 0].max(0), axis=-1)
    return int(k), float(np.sqrt(depth[p] / depth[-1]))
