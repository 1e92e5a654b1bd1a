"""Faces as children set them down: symbols, at the right places, that change from age to age."""

from collections.abc import Sequence

import numpy as np

from . import eyes, subject
from .alike import norm
from .marks import Floats, Mark, curve, envelope, f32, spiral, unit
from .subject import Face


def symbols(face: Face, lab: Floats, age: int, rng: np.random.Generator) -> list[Mark]:
    """A face as a child of this age sets it down, at the right place and with the face's own mood.

    At three two dots and a line; at five round eyes and a smile; at eight coloured eyes, brows, a
    nose and lips; at ten lids, lashes and nostrils too.
    """
    return _Child(face, lab, age, rng).drawn()


class _Child:
    """One face, and the symbols made of it."""

    def __init__(self, face: Face, lab: Floats, age: int, rng: np.random.Generator) -> None:
        self.face, self.age, self.rng = face, age, rng
        corners = [face.path(lid).mean(0) for lid in subject.UPPER_LID]
        self.right = unit(corners[1] - corners[0])
        self.size = max(face.eye_width, 0.35 * norm(corners[1] - corners[0]))
        self.width = max(
            2.0, float(np.interp(age, [3, 5, 8, 10], [0.3, 0.22, 0.16, 0.12])) * self.size
        )
        self.colour = eyes.seen(face, lab).iris
        self.made: list[Mark] = []

    def add(self, path: Floats, colour: Sequence[float] | Floats, width: float = 1.0) -> None:
        shaky = float(np.interp(self.age, [3, 10], [0.09, 0.015])) * self.size
        line = curve(np.asarray(path, np.float32), 1.0)
        knots = self.rng.standard_normal((max(2, round(2.5 * len(line) / self.size)), 2))
        at = np.linspace(0, len(knots) - 1, len(line))
        line = line + shaky * np.stack(
            [np.interp(at, np.arange(len(knots)), k) for k in knots.T], 1
        )
        press = np.clip(0.8 + 0.1 * self.rng.standard_normal(), 0.6, 1) * envelope(
            len(line), 0.05, 0.1
        )
        self.made.append(Mark(f32(line), f32(press), f32(colour), width * self.width, "symbol"))

    def arc(self, middle: Floats, wide: float, high: float, begin: float, end: float) -> Floats:
        """Part of an ellipse that lies as the face does; in turns, clockwise from the right."""
        angle = 2 * np.pi * np.linspace(begin, end, 16)
        down = f32([-self.right[1], self.right[0]])
        return (
            middle
            + np.outer(wide * np.cos(angle), self.right)
            + np.outer(high * np.sin(angle), down)
        )

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
            self.add(spiral(middle, 0.2 * size, 0.02 * size, 0.6 * self.width), black)
        elif self.age < 8:
            self.add(self.arc(middle, 0.45 * size, 0.42 * size, 0.7, 1.75), black)
            self.add(spiral(middle, 0.15 * size, 0.02 * size, 0.6 * self.width), black)
        else:
            lid = 0.36 if self.age < 10 else 0.3
            self.add(self.arc(middle, 0.55 * size, lid * size, 0.5, 1.0), black)
            self.add(self.arc(middle, 0.55 * size, lid * size, 1.0, 1.5), black, 0.8)
            self.add(spiral(middle, 0.24 * size, 0.1 * size, 0.6 * self.width), self.colour)
            self.add(spiral(middle, 0.1 * size, 0.01, 0.5 * self.width), black)
            brow = self.face.path(subject.BROW_TOP[side])
            self.add(brow + 0.06 * (brow - middle), brown, 1.2)
        if self.age >= 10:
            for turn in (0.56, 0.65, 0.75, 0.85, 0.94):
                lash = self.arc(middle, 1.0, 1.0, turn, turn)[:1] - middle
                root = middle + lash * f32([0.5, 0.35]) * size
                self.add(np.concatenate([root, root + 0.22 * size * lash]), black, 0.6)

    def nose(self) -> None:
        tip, below, brown = self.face.landmarks[4], self.face.landmarks[2], (0.42, 0.12, 0.14)
        if self.age < 5:
            return
        if self.age < 8:
            self.add(spiral(tip, 0.1 * self.size, 0.02 * self.size, 0.6 * self.width), brown)
        elif self.age < 10:
            self.add(
                np.stack([self.face.landmarks[6], tip - 0.15 * self.size * self.right, below]),
                brown,
            )
        else:
            self.add(self.face.path((193, 196, 236)), brown, 0.7)
            self.add(self.arc(below, 0.4 * self.size, 0.16 * self.size, 0.0, 0.5), brown)
            for nostril in (
                self.face.landmarks[[60, 99]].mean(0),
                self.face.landmarks[[290, 328]].mean(0),
            ):
                self.add(spiral(nostril, 0.06 * self.size, 0.01, 0.3 * self.width), brown)

    def mouth(self) -> None:
        red = (0.55, 0.36, 0.18)
        lips = 0.5 * (self.face.path(subject.MOUTH_TOP) + self.face.path(subject.MOUTH_BOTTOM))
        bow = np.sin(np.linspace(0, np.pi, len(lips)))[:, None] * self.face.down
        mood = float(((lips[5] - lips[[0, -1]].mean(0)) * self.face.down).sum() / self.face.height)
        sag = (0.05 + np.clip(mood, -0.03, 0.04)) * self.face.height
        wide = lips.mean(0) + f32([1.15 if self.age < 8 else 1.0]) * (lips - lips.mean(0))
        if self.age < 8:
            self.add(wide + (0.5 if self.age < 5 else 1.0) * sag * bow, red, 1.1)
            return
        self.add(self.face.path(subject.LIP_TOP), red)
        self.add(self.face.path(subject.LIP_BOTTOM) + 0.2 * sag * bow, red)
        self.add(wide + 0.4 * sag * bow, red if self.age < 10 else (0.3, 0.1, 0.05), 0.8)
