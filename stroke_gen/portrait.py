"""Faces as a draughtsman sets them down over the modelling: lids, irises, brows, nose, mouth.

Landmarks say where a feature is and what it is called; the photo says how dark and how long it is:
every line settles on the darkness near it and is pressed as that darkness asks, so that it fades
where the photo has none.
"""

from collections.abc import Callable
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from . import eyes, marks, subject
from .alike import norm
from .drawing import Stroke
from .eyes import AWAY, Eye
from .marks import STEP, Floats, Mark, curve, envelope, f32, sampled, settled, smooth, spiral, unit
from .params import Style
from .subject import Face, Subject
from .swatches import Swatches
from .symbols import symbols

LARGE, FULL, SMALL = (
    18.0,
    9.0,
    6.0,
)  # eye widths in cells: lashes, teeth; all features; lids and mouth
STRONG = 0.14  # darkness of a face's features against what lies round them
RIDGE = 0.045  # darkness of a line that landmarks do not explain
LEAST = 0.1  # pressure below which the hand lifts the crayon
NOSE = (129, 102, 64, 98, 240, 60, 20, 2, 250, 290, 460, 327, 294, 331, 358)
BRIDGE = (122, 196, 236, 198, 129), (351, 419, 456, 420, 358)
CHEEK = (49, 203, 206, 216), (279, 423, 426, 436)
JAW = (127, 234, 93, 132, 58, 172, 136, 150, 149, 176, 148, 152,
       377, 400, 378, 379, 365, 397, 288, 361, 323, 454, 356)  # fmt: skip


def draw(
    seen: Subject, lab: Floats, inside: Floats, box: Swatches, cell_mm: float, style: Style,
    rng: np.random.Generator,
) -> list[Stroke]:  # fmt: skip
    """Strokes for all faces, as the style has them.

    lab: the photo's own OKLab (h, w, 3) on the work grid.   inside: where one
    may draw (h, w).
    """
    made = []
    for face in seen.faces:
        if style.symbols:
            made += symbols(face, lab, style.symbols, rng)
        else:
            made += features(face, lab, rng)
    return marks.strokes(
        [piece for mark in made for piece in mark.within(inside)], box, cell_mm, rng
    )


def features(face: Face, lab: Floats, rng: np.random.Generator) -> list[Mark]:
    """The marks of a face, in drawing order, from the photo's OKLab (h, w, 3) on the work grid."""
    margin = 0.35 * face.height + 4
    x0, y0 = np.maximum(0, face.landmarks.min(0) - margin).astype(int)
    x1, y1 = (face.landmarks.max(0) + margin).astype(int) + 1
    corner = f32([x0, y0])
    near = Face(face.landmarks - corner, face.score)
    made = _Sitter(near, np.ascontiguousarray(lab[y0:y1, x0:x1]), rng).drawn()
    return [replace(mark, path=mark.path + corner) for mark in made]


def kept(seen: Subject, shape: tuple[int, int]) -> tuple[Floats, Floats, Floats]:
    """What is left to portraits (h, w), 0..1: by most wax, by touches, by outlines.

    Whites of eyes and teeth, which marks shade; eyes, brows and mouths; faces.
    """
    empty = np.zeros((3, *shape), np.float32)
    large = [face for face in seen.faces if face.eye_width >= FULL]
    if not large:
        return empty[0], empty[1], empty[2]
    rings = [
        (top, low)
        for lids in (zip(subject.UPPER_LID, subject.LOWER_LID, strict=True),)
        for top, low in lids
    ]
    whites = [face.path((*top, *low[::-1])) for face in large for top, low in rings]
    whites += [
        face.path((*subject.MOUTH_TOP, *subject.MOUTH_BOTTOM[::-1]))
        for face in large
        if parted(face)
    ]
    features = np.max([subject.features(face, shape) for face in large], 0)
    ovals = subject.polygons([face.path(subject.OVAL) for face in large], shape)
    return subject.polygons(whites, shape), subject.soft(features), ovals


def parted(face: Face) -> bool:
    """Whether the lips are open."""
    top, bottom = face.path(subject.MOUTH_TOP), face.path(subject.MOUTH_BOTTOM)
    gap = float(np.linalg.norm(top - bottom, axis=1).max())
    return gap > max(0.1 * norm(top[0] - top[-1]), 0.08 * face.eye_width, 1.8)


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
        self.dark *= np.clip(
            STRONG / max(float(strong), 1e-3), 0.8, 2.0
        )  # dim photos as clear as others
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
        self.look()
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
                    Mark(piece, pressure[a:b].astype(np.float32), f32(colour), width, role)
                )

    def line(
        self, points: Floats, role: str, reach: float, floor: float, gain: float,
        width: float = 1.0, ends: tuple[float, float] = (0.2, 0.35), tint: float = 1.0,
        colour: Floats | None = None,
    ) -> Floats:  # fmt: skip
        """A line near points, pressed by `floor` and by `gain` times the darkness it finds."""
        path = settled(curve(points), self.dark, max(0.8, reach * self.eye))
        found = smooth(np.maximum(sampled(self.dark, path), 0), 5)
        pressure = np.clip(floor + gain * found, 0, 1) * envelope(len(path), *ends)
        if colour is None:
            seen = sampled(self.lab, path)
            colour = np.median(seen[seen[:, 0] <= np.median(seen[:, 0])], 0)
            colour = f32([min(colour[0] - 0.1, self.skin[0] - 0.18), *(tint * colour[1:])])
        self.add(path, pressure, colour, width * self.fine, role)
        return path

    def loft(
        self, top: Floats, bottom: Floats, role: str, width: float,
        pressed: Callable[[Floats], Floats], colour: Floats, closeness: float = 0.75,
    ) -> None:  # fmt: skip
        """Lines side by side from one curve to another; `pressed` maps points to pressure."""
        gap = closeness * width
        depth = np.linalg.norm(top - bottom, axis=1).max()
        rows = int(depth / gap)
        for i in range(rows):
            t = (i + 0.5 + self.rng.uniform(-0.15, 0.15)) / rows
            path = curve((1 - t) * top + t * bottom)
            path = path[:: 1 if i % 2 else -1]
            self.add(path, pressed(path) * envelope(len(path), 0.1, 0.2), colour, width, role)

    # -- features

    def look(self) -> None:
        """Both eyes; they share the colour of what shows of iris and white in either."""
        both = eyes.seen(self.face, self.lab)
        for lids in zip(subject.UPPER_LID, subject.LOWER_LID, strict=True):
            top, bottom = (self.face.path(lid) for lid in lids)
            self.lids(top, bottom)
        for eye in both.opened:
            if self.eye >= FULL:
                self.white(eye, both.white)
            self.iris(eye, both.iris)

    def lids(self, top: Floats, bottom: Floats) -> None:
        wide, high = (
            norm(top[0] - top[-1]),
            norm(top[4] - bottom[4]),
        )
        if wide < AWAY * self.eye:  # turned away
            self.line(top, "lid", 0.1, 0.2, 3)
            return
        up = unit(top[1:-1].mean(0) - bottom[1:-1].mean(0))
        outer = top[0] + 0.1 * (top[0] - top[-1])
        lid = np.concatenate([[outer], top[:-1]]) if self.eye >= FULL else top
        made = self.line(lid, "lid", 0.06, 0.75, 2.2, 1.15, (0.3, 0.3))
        if self.eye >= LARGE:  # lashes make it the heaviest line of a face
            weight = np.interp(np.linspace(0, 1, len(made)), [0, 0.35, 0.8, 1], [0.4, 1, 0.7, 0])
            shade = f32([0.22, *(0.4 * self.skin[1:])])
            weight *= np.interp(self.eye, [LARGE, 40], [0.6, 0.9])
            self.add(made + 0.03 * self.eye * up, weight, shade, self.fine, "lid")
        if self.eye >= FULL:
            self.line(bottom[1:-1], "lower lid", 0.07, 0.0, 3.2, 0.8, (0.2, 0.4))
            fold = top[1:-1] + (0.3 * high + 0.05 * wide) * up
            self.line(fold, "fold", 0.1, 0.0, 3.5, 0.8, (0.35, 0.4))

    def iris(self, eye: Eye, colour: Floats) -> None:
        """Coloured ring, dark pupil, and a light left free."""
        radius, width = eye.radius, min(0.8 * self.fine, 0.7 * eye.radius)
        shines = eye.shine > colour[0] + 0.12 and radius > 2.5 * width
        hole = max(0.16 * radius, 0.4 * width) + 0.5 * width if shines else 0

        def turn(outer: float, inner: float, gap: float, dark: float, tint: Floats) -> None:
            path = spiral(
                eye.centre, max(outer * radius - 0.3 * width, 0.1), inner * radius, gap * width
            )
            free = np.linalg.norm(path - eye.glint, axis=1) >= hole
            self.add(path, dark * (sampled(eye.inside, path) > 0.35) * free, tint, width,
                     "iris" if inner else "pupil")  # fmt: skip

        dark = f32([0.2, 0, 0])
        if radius > 1.6 * width:
            bright = float(np.interp(colour[0], [0.3, 0.6], [0, 1]))
            base = f32([max(0.4, colour[0]), *colour[1:]])
            turn(0.95, 0.35, 0.5, 0.85 - 0.25 * bright, base)
            if colour[1] < 0:  # grey, with a breath of blue or green
                turn(0.85, 0.4, 1.2, 0.35, base * f32([1, 5, 5]))
            else:
                turn(0.95, 0.35, 0.6, 0.85 * (1 - bright), dark)
            turn(1.0, 0.95, 1.0, 0.65, colour * f32([0.6, 1, 1]))
            turn(0.45, 0, 0.5, 1.0, dark)
        else:
            turn(0.75, 0, 0.5, 0.9, dark)

    def white(self, eye: Eye, lit: Floats) -> None:
        """The shade on the white of the eye."""
        shown = self.shown_white(float(lit[0]))

        def pressed(path: Floats) -> Floats:
            shade = shown + np.clip((lit[0] + 0.02 - sampled(self.light_near, path)) / 0.4, 0, 0.4)
            free = np.linalg.norm(path - eye.centre, axis=1) > eye.radius
            return f32(shade * (sampled(eye.inside, path) > 0.5) * free)

        self.loft(eye.top, eye.bottom, "white", 0.8 * self.fine, pressed, f32([0.6, 0, 0.02]), 0.5)

    def shown_white(self, light: float) -> float:
        """How much grey a white of this OKLab lightness gets: a part of what the photo shows."""
        light = max(light, float(self.skin[0]))
        return float(np.clip(0.4 * (0.95 - light) / 0.4, 0, 0.6))

    def brow(self, side: int) -> None:
        """Short hairs that lean outwards, where the photo has them."""
        top, bottom = (
            self.face.path(b[side])[::-1] for b in (subject.BROW_TOP, subject.BROW_BOTTOM)
        )
        middle = 0.5 * (top + bottom)
        if self.eye < 14:
            self.line(middle, "brow", 0.1, 0.25, 2.5, 1.2, (0.15, 0.5))
            return
        length = norm(middle[0] - middle[-1])
        up = unit(top.mean(0) - bottom.mean(0)) * norm(top[2] - bottom[2])
        low, high = curve(bottom - 0.3 * up, 0.3), curve(top + 0.25 * up, 0.3)
        lid = np.concatenate([bottom, self.face.path(subject.UPPER_LID[side])])
        bare = self.light[subject.polygons([lid], self.light.shape) > 0.5]
        if not len(bare):
            return
        dark = np.quantile(bare, 0.7) - self.light_near  # than the skin between brow and eye
        band = subject.polygons([np.concatenate([low, high[::-1]])], dark.shape) > 0.5
        if not band.any():
            return
        most = float(np.quantile(dark[band], 0.9))
        if most < 0.015:
            return
        seen = self.lab[band & (dark > 0.4 * most)]
        colour = f32([np.quantile(seen[:, 0], 0.25), *np.median(seen[:, 1:], 0)])
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
        level = min(1.0, 0.45 + 4 * most) * np.clip((found / most - 0.15) / 0.6, 0, 1)
        pressure = level * envelope(len(t), 0.2, 0.7)[:, None]
        for i in np.argsort(u):
            self.add(hairs[:, i], pressure[:, i], colour, width, "brow")

    def nose(self) -> None:
        self.line(self.face.path(NOSE), "nose", 0.09, 0.05, 5.5, 1.0, (0.1, 0.1), 1.2)
        for side in BRIDGE:
            self.line(self.face.path(side), "bridge", 0.12, -0.1, 4, 1.1, (0.5, 0.4), 1.2)
        for fold in CHEEK:
            self.line(self.face.path(fold), "cheek", 0.12, -0.08, 3, 1.0, (0.3, 0.5), 1.2)

    def lips(self) -> None:
        face, width = self.face, 0.85 * self.fine
        up, low = face.path(subject.LIP_TOP), face.path(subject.LIP_BOTTOM)
        inner_up, inner_low = face.path(subject.MOUTH_TOP), face.path(subject.MOUTH_BOTTOM)
        bands = (up, inner_up), (inner_low, low)
        band = (
            subject.polygons([np.concatenate([a, b[::-1]]) for a, b in bands], self.light.shape)
            > 0.5
        )
        if band.sum() < 6:
            return
        colour = _rosy(self.lab[band], self.skin)

        def pressed(path: Floats) -> Floats:
            off = np.linalg.norm(sampled(self.near, path) - self.skin, axis=1)
            return f32(np.clip(0.22 + 2.2 * off, 0, 0.85))

        for top, bottom in bands:
            self.loft(top, bottom, "lips", width, pressed, colour)
        deep = colour * f32([0.75, 1, 1])
        self.line(
            inner_up[1:-1] - 0.3 * width * face.down,
            "lips",
            0.02,
            0.3,
            2,
            0.7,
            (0.2, 0.2),
            colour=deep,
        )
        self.line(
            low[2:-2] + 0.1 * self.eye * face.down,
            "under lip",
            0.12,
            -0.05,
            3,
            1.1,
            (0.4, 0.4),
            1.2,
        )

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
            return f32(np.clip((self.skin[0] - 0.25 - sampled(self.light_near, path)) / 0.15, 0, 1))

        def shade(path: Floats) -> Floats:
            light = sampled(self.light_near, path)
            return f32(np.clip(shown + 1.2 * (teeth - light - 0.03), 0, 0.6) * (cavity(path) < 0.2))

        self.loft(top, bottom, "white", 0.9 * self.fine, shade, f32([0.82, 0.0, 0.04]), 0.5)
        if self.eye >= LARGE:
            self.gaps(top, bottom, teeth)
        self.loft(top, bottom, "mouth", 0.9 * self.fine, cavity, f32([0.28, 0.08, 0.04]))

    def gaps(self, top: Floats, bottom: Floats, teeth: float) -> None:
        """Where one tooth ends and the next begins, if the photo shows it."""
        upper, lower = curve(top), curve(bottom)
        at = np.arange(len(upper)) * (len(lower) - 1) // (len(upper) - 1)
        light = sampled(self.light_near, 0.6 * upper + 0.4 * lower[at])
        dip = smooth(light, round(0.25 * self.eye / STEP)) - light
        apart = max(2, round(0.07 * self.eye / STEP))
        for i in range(apart, len(dip) - apart):
            around = dip[i - apart : i + apart + 1]
            if dip[i] == around.max() and dip[i] > 0.012 and light[i] > teeth - 0.2:
                path = curve(np.stack([upper[i], 0.25 * upper[i] + 0.75 * lower[at[i]]]))
                pressure = min(0.4, 0.15 + 6 * float(dip[i])) * envelope(len(path), 0.1, 0.6)
                self.add(path, pressure, f32([0.6, 0, 0.02]), 0.6 * self.fine, "white")

    def contours(self) -> None:
        """Cheek and jaw, where the photo has an edge."""
        self.line(self.face.path(JAW), "jaw", 0.2, -0.1, 3, 1.1, (0.1, 0.1), 1.2)

    def traces(self) -> None:
        """What landmarks do not explain: glasses, beards, deep wrinkles, strands of hair."""
        dark = subject.soft(self.light, max(1.5, 0.12 * self.eye)) - self.light_near
        oval = self.face.path(subject.OVAL)
        done = 1 - subject.polygons([oval.mean(0) + 0.92 * (oval - oval.mean(0))], self.light.shape)
        lids = [
            self.face.path((*a, *b[::-1]))
            for a, b in zip(subject.UPPER_LID, subject.LOWER_LID, strict=True)
        ]
        lips = [self.face.path((*subject.LIP_TOP, *subject.LIP_BOTTOM[::-1]))]
        taken = (np.maximum(done, subject.polygons(lids + lips, done.shape)) > 0.3).astype(np.uint8)
        for mark in self.made:
            line = [np.round(mark.path).astype(np.int32)]
            cv2.polylines(taken, line, False, 1, max(1, round(3.5 * mark.width)))
        ridge = ((dark > RIDGE) & (taken == 0)).astype(np.uint8)
        for chain in _chains(cv2.ximgproc.thinning(ridge * 255)):
            if len(chain) < 0.5 * self.eye:
                continue
            path = curve(chain[:: max(1, len(chain) // 16)])
            pressure = np.clip(4.5 * smooth(sampled(dark, path), 5), 0, 0.9) * envelope(
                len(path), 0.2, 0.3
            )
            colour = np.median(sampled(self.lab, path), 0) - f32([0.1, 0, 0])
            tint = norm(colour[1:] - self.skin[1:] * max(0.5, colour[0] / self.skin[0]))
            self.add(path, pressure, colour, self.fine, "frame" if tint > 0.06 else "trace")

    def blots(self) -> None:
        """Eyes and mouth of a face too small for features."""
        dark = f32([max(0.2, self.skin[0] - 0.35), *(0.6 * self.skin[1:])])
        for side in (0, 1):
            top, bottom = (
                self.face.path(lid[side]) for lid in (subject.UPPER_LID, subject.LOWER_LID)
            )
            if norm(top[0] - top[-1]) > AWAY * self.eye:
                self.line(0.5 * (top + bottom), "lid", 0.3, 0.9, 2, 1.6, (0.1, 0.1), colour=dark)
        lips = 0.5 * (self.face.path(subject.MOUTH_TOP) + self.face.path(subject.MOUTH_BOTTOM))
        self.line(lips, "mouth", 0.15, 0.6, 2, 1.4, (0.1, 0.1), colour=dark)


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
        chains.append(f32(chain)[:, ::-1] + f32(0.5))
    return chains


def _rosy(seen: Floats, skin: Floats) -> Floats:
    """The colour for lips (n, 3): their stronger half's, in the light that skin tells of."""
    chroma = np.hypot(seen[:, 1], seen[:, 2])
    light, a, b = np.median(seen[chroma >= np.median(chroma)], 0)
    hue = np.clip(np.arctan2(b, a), np.deg2rad(12), np.deg2rad(36))
    chroma = 1.15 * np.hypot(a, b) * np.clip(0.12 / np.hypot(*skin[1:]), 1, 1.6)
    chroma = np.maximum(chroma, 0.35 * light)
    return f32([light, chroma * np.cos(hue), chroma * np.sin(hue)])


def _between(low: Floats, high: Floats, u: Floats, v: Floats) -> Floats:
    """Points (n, 2) of the band between two curves: u along it, v across it."""
    a, b = (c[np.minimum((u * len(c)).astype(int), len(c) - 1)] for c in (low, high))
    return (1 - v[:, None]) * a + v[:, None] * b
