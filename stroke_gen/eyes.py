"""What an eye shows: its iris, the darkest disc between the lids, its white and its light."""

from dataclasses import dataclass

import numpy as np

from . import subject
from .alike import norm
from .marks import Floats, f32, sampled, unit
from .subject import Face

AWAY = 0.35  # of the other eye's width: narrower, an eye is turned away
BROWN = 0.9  # hue of brown irises, which differ in lightness
CLOSED = 0.12  # of its width: an eye that is less open is closed


@dataclass(frozen=True, eq=False)
class Eye:
    """An open eye, in cells: its lids, outer corner first, and what lies between them."""

    top: Floats  # (9, 2)
    bottom: Floats  # (9, 2)
    inside: Floats  # (h, w) between the lids
    centre: Floats  # (2,) of the iris
    radius: float
    ring: Floats  # (n, 3) OKLab of the iris
    sclera: Floats  # (n, 3) OKLab of the white
    glint: Floats  # (2,) the lightest place on the iris
    shine: float  # its lightness


@dataclass(frozen=True, eq=False)
class Eyes:
    """The eyes of a face that are open, the colour for their irises, and what their whites show."""

    opened: tuple[Eye, ...]
    iris: Floats
    white: Floats


def seen(face: Face, lab: Floats) -> Eyes:
    """The eyes of a face in the photo's OKLab (h, w, 3); they share their colours."""
    near = subject.soft(lab, 0.02 * face.eye_width)
    opened = tuple(eye for side in (0, 1) if (eye := _eye(face, near, side)))
    ring = np.concatenate([eye.ring for eye in opened] or [np.empty((0, 3))])
    sclera = np.concatenate([eye.sclera for eye in opened] or [np.empty((0, 3))])
    white = np.median(sclera, 0) if len(sclera) > 3 else f32([0.85, 0, 0])
    iris = np.median(ring, 0) if len(ring) > 3 else f32([0.3, 0.03, 0.04])
    return Eyes(opened, _iris_colour(iris, white), white)


def _eye(face: Face, lab: Floats, side: int) -> Eye | None:
    """What an eye shows between its lids; None if it is closed or turned away."""
    top, bottom = (face.path(lid[side]) for lid in (subject.UPPER_LID, subject.LOWER_LID))
    wide = norm(top[0] - top[-1])
    if wide < AWAY * face.eye_width or norm(top[4] - bottom[4]) < CLOSED * wide:
        return None
    ring = np.concatenate([top, bottom[::-1]])
    inside = subject.polygons([ring], (lab.shape[0], lab.shape[1]))
    (x0, y0), (x1, y1) = ring.min(0), ring.max(0)
    step = max(0.5, wide / 40)
    grid = f32(np.mgrid[x0:x1:step, y0:y1:step].reshape(2, -1).T)
    points = grid[sampled(inside, grid) > 0.4]
    if len(points) < 6:
        return None
    colours = sampled(lab, points)
    centre, radius = _disc(points, colours[:, 0], ring, wide)
    far = np.linalg.norm(points - centre, axis=1) / radius
    shine = np.where(far < 0.8, colours[:, 0], -1).argmax()
    iris, sclera = colours[(far > 0.4) & (far < 0.95)], colours[far > 1.2]
    return Eye(
        top, bottom, inside, centre, radius, iris, sclera, points[shine], float(colours[shine, 0])
    )


def _iris_colour(seen: Floats, white: Floats) -> Floats:
    """The colour an iris is drawn in: brown, or from blue to green.

    The white of the eye says what the light is: how bright, and of what tint.
    """
    a, b = seen[1:] - white[1:] * seen[0] / white[0]
    light = 0.85 * min(1.0, float(seen[0] / white[0])) ** 1.5
    if a > 0 or light < 0.3:
        return f32([light, 0.1 * np.cos(BROWN), 0.1 * np.sin(BROWN)])
    return f32([light, a, b])


def _disc(points: Floats, level: Floats, opening: Floats, wide: float) -> tuple[Floats, float]:
    """Centre and radius of the darkest disc in an eye's opening."""
    n = len(opening) // 2
    inner, outer = opening[n - 1], opening[0]
    middle = 0.5 * (opening[4] + opening[-5])
    across = unit(opening[4] - opening[-5])
    shares, lifts = np.meshgrid(np.linspace(-0.22, 0.22, 12), np.linspace(-0.08, 0.1, 5))
    shares, lifts = shares.reshape(-1, 1), lifts.reshape(-1, 1)
    centres = middle + shares * (inner - outer) + lifts * wide * across
    far = np.linalg.norm(points - centres[:, None], axis=2) / wide
    best = (-np.inf, middle, 0.2)
    for radius in (0.18, 0.2, 0.22, 0.24):
        disc, ring = far < radius, (far > 1.1 * radius) & (far < 1.6 * radius)
        means = [(part * level).sum(1) / np.maximum(part.sum(1), 1) for part in (ring, disc)]
        worth = means[0] - means[1] - (0.4 * shares**2 + 2 * lifts**2)[:, 0]
        worth[(disc.sum(1) < 3) | (ring.sum(1) < 3)] = -np.inf
        best = max(
            best, (float(worth.max()), centres[worth.argmax()], radius), key=lambda one: one[0]
        )
    return f32(best[1]), best[2] * wide
