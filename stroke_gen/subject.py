"""Who or what the picture is of: faces, the subject's mask, skin and hair, and care for each place.

All maps are float32 (h, w), 0..1, on the work grid; landmarks are in its cells. Left and right are
the picture's.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from . import networks
from .alike import norm
from .colour import oklab
from .jit import lean_kernel
from .saliency import saliency

Floats = NDArray[Any]
Focus = tuple[float, float, float, float]  # x, y, width, height in fractions of the picture
SEARCH_SIDE = 2 * networks.DETECTOR_SIDE  # pixels of the picture in which faces are sought
CLOSE_SIDE = 2 * networks.MESH_SIDE  # and of a patch with one face

UNSURE = 0.7  # how surely the subject is what stands out
SUBJECT_CARE = 0.75
EDGE = 2e-4  # variance of OKLab from which the guided filter takes an edge for one
NEAR = 0.04  # long sides over which care fades out round the subject
MANY = 12  # cells that make a sample

# Landmarks along the parts of a face; pairs are (left, right), from the outer end to the inner.
UPPER_LID = (
    (33, 246, 161, 160, 159, 158, 157, 173, 133),
    (263, 466, 388, 387, 386, 385, 384, 398, 362),
)
LOWER_LID = (
    (33, 7, 163, 144, 145, 153, 154, 155, 133),
    (263, 249, 390, 373, 374, 380, 381, 382, 362),
)
BROW_TOP = (70, 63, 105, 66, 107), (300, 293, 334, 296, 336)
BROW_BOTTOM = (46, 53, 52, 65, 55), (276, 283, 282, 295, 285)
LIP_TOP = (61, 185, 40, 39, 37, 0, 267, 269, 270, 409, 291)
LIP_BOTTOM = (61, 146, 91, 181, 84, 17, 314, 405, 321, 375, 291)
MOUTH_TOP = (78, 191, 80, 81, 82, 13, 312, 311, 310, 415, 308)
MOUTH_BOTTOM = (78, 95, 88, 178, 87, 14, 317, 402, 318, 324, 308)
OVAL = (10, 338, 297, 332, 284, 251, 389, 356, 454, 323, 361, 288, 397, 365, 379, 378, 400, 377,
        152, 148, 176, 149, 150, 136, 172, 58, 132, 93, 234, 127, 162, 21, 54, 103, 67,
        109)  # fmt: skip
CROWN, CHIN = 10, 152


@dataclass(frozen=True, eq=False)
class Face:
    """A face: MediaPipe's landmarks (468, 2), x and y in cells, and the detector's score."""

    landmarks: Floats
    score: float

    def path(self, chain: Sequence[int]) -> Floats:
        """The landmarks (n, 2) along a part of the face."""
        return self.landmarks[list(chain)]

    @property
    def eye_width(self) -> float:
        """Width in cells of the eye that shows more."""
        return max(
            norm(self.landmarks[lid[0]] - self.landmarks[lid[-1]])
            for lid in UPPER_LID
        )

    @property
    def height(self) -> float:
        """From the hair to the chin, in cells."""
        return norm(self.landmarks[CROWN] - self.landmarks[CHIN])

    @property
    def down(self) -> Floats:
        """Unit vector from forehead to chin."""
        return (self.landmarks[CHIN] - self.landmarks[CROWN]) / np.float32(max(self.height, 1e-6))


@dataclass(frozen=True, eq=False)
class Subject:
    """What is drawn with care: faces, largest first, and a soft mask (h, w) of all of it."""

    faces: tuple[Face, ...]
    mask: Floats


def see(photo: Floats, shape: tuple[int, int], mask: Floats | None = None) -> Subject:
    """Find faces and subject in a photo.

    photo: linear light RGB (h, w, 3), as large as it comes: small faces need it.   shape: rows and
    columns of the work grid.   mask: the subject (h, w), 0..1, of any size, if the user drew it;
    zeros mean that there is none. Faces outside it are not drawn as such.
    """
    small = _picture(photo, SEARCH_SIDE / max(photo.shape))
    found = []
    for box in networks.boxes(small) if networks.available() else []:
        face = _face(photo, small.shape[1] / photo.shape[1], box, shape)
        found += [face] if face else []
    if mask is None:
        mask = _standing_out(photo, small, found, shape)
    else:
        mask = np.clip(_sized(np.asarray(mask, np.float32), shape), 0, 1)
        found = [face for face in found if (_oval(face, shape) * (mask - 0.5)).sum() > 0]
    return Subject(tuple(sorted(found, key=lambda face: -face.height)), mask)


def _standing_out(
    photo: Floats, small: NDArray[np.uint8], faces: Sequence[Face], shape: tuple[int, int]
) -> Floats:
    """The mask of people; where no face is, of all that is unlike the borders too."""
    lab = oklab(_sized(photo, (max(1, shape[0] // 2), max(1, shape[1] // 2))))
    mask = np.zeros(lab.shape[:2], np.float32)
    if networks.available():
        mask = _along_edges(networks.people(small), lab, 0.008)
    if not faces:
        mask = np.maximum(mask, UNSURE * _along_edges(saliency(lab), lab, 0.01))
    mask = _sized(mask, shape)
    for face in faces:
        mask = np.maximum(mask, _oval(face, shape))
    return mask


def _picture(linear: Floats, scale: float) -> NDArray[np.uint8]:
    """A picture as people look at it, sRGB, resized."""
    size = max(1, round(linear.shape[1] * scale)), max(1, round(linear.shape[0] * scale))
    x = np.clip(
        cv2.resize(linear, size, interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR),
        0,
        1,
    )
    return np.round(
        255 * np.where(x < 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)
    ).astype(np.uint8)


def _sized(level: Floats, shape: tuple[int, int]) -> Floats:
    shrink = level.shape[0] * level.shape[1] > shape[0] * shape[1]
    return cv2.resize(
        level, shape[::-1], interpolation=cv2.INTER_AREA if shrink else cv2.INTER_LINEAR
    )


def _face(photo: Floats, scale: float, box: networks.Box, shape: tuple[int, int]) -> Face | None:
    """The face in a box of the picture `scale` times as large as the photo, looked at closely."""
    low, high, eyes = (p / scale for p in (box.low, box.high, box.eyes))
    reach = networks.AROUND * float((high - low).max())
    corner = np.maximum(0, (low + high) / 2 - reach).astype(int)
    end = np.ceil((low + high) / 2 + reach).astype(int)
    patch = photo[corner[1] : end[1], corner[0] : end[0]]
    near = CLOSE_SIDE / max(patch.shape)
    near_box = networks.Box(box.score, *((p - corner) * near for p in (low, high, eyes)))
    points = networks.mesh(_picture(patch, near), near_box)
    if points is None:
        return None
    cells = np.array([shape[1] / photo.shape[1], shape[0] / photo.shape[0]])
    return Face(((points / near + corner) * cells).astype(np.float32), box.score)


def polygons(paths: Sequence[Floats], shape: tuple[int, int]) -> Floats:
    """Filled polygons (h, w) that do not overlap, their rims anti-aliased; points in cells."""
    out = np.zeros(shape, np.uint8)
    cv2.fillPoly(
        out, [np.round((path - 0.5) * 16).astype(np.int32) for path in paths], 255, cv2.LINE_AA, 4
    )
    return out / np.float32(255)


def _oval(face: Face, shape: tuple[int, int], larger: float = 1.0, up: float = 0.0) -> Floats:
    """A face's oval, enlarged about its middle, and moved up by a part of the face's height."""
    oval = face.path(OVAL)
    middle = oval.mean(0)
    return polygons([middle + larger * (oval - middle) - up * face.height * face.down], shape)


def soft(level: Floats, sigma: float = 1.0) -> Floats:
    """Gaussian blur, a wide one on coarser cells."""
    shrink = max(1, int(sigma / 2))
    small = _sized(level, (max(1, level.shape[0] // shrink), max(1, level.shape[1] // shrink)))
    blurred = cv2.GaussianBlur(
        small, (0, 0), max(0.5, sigma / shrink), borderType=cv2.BORDER_REPLICATE
    )
    return _sized(blurred, (level.shape[0], level.shape[1]))


def _along_edges(level: Floats, lab: Floats, radius: float) -> Floats:
    """A map that ends where the picture has edges: guided filter, radius in long sides."""
    small = _sized(level, (lab.shape[0], lab.shape[1]))
    cells = max(2, round(radius * max(small.shape)))
    # OpenCV takes the covariance of a guide in 0..1 for singular, and then ignores its edges
    smooth = cv2.ximgproc.guidedFilter(255 * lab, small, cells, 255**2 * EDGE)
    return np.clip(smooth, 0, 1)


def care(subject: Subject, lab: Floats, focus: Sequence[Focus] = ()) -> Floats:
    """How much care each place deserves (h, w): faces and focus 1, the ground little.

    lab: the photo's OKLab on the work grid.   focus: boxes (x, y, width, height) in parts of the
    picture; each stands for the ellipse that fills it, and gives way to edges.
    """
    shape = lab.shape[0], lab.shape[1]
    near = soft(subject.mask, NEAR * max(shape))  # what touches the subject is not quite left alone
    out = np.maximum(SUBJECT_CARE * subject.mask, 0.5 * near)
    rows, cols = (np.arange(n, dtype=np.float32) + np.float32(0.5) for n in shape)
    for x, y, width, height in focus:
        across = (cols / shape[1] - x - width / 2) / max(width / 2, 1e-3)
        along = (rows / shape[0] - y - height / 2) / max(height / 2, 1e-3)
        radius = np.hypot(along[:, None], across)
        size = 0.25 * max(width * shape[1], height * shape[0]) / max(shape)
        kept = _along_edges(_fall(radius), np.ascontiguousarray(lab[::2, ::2]), size)
        out = np.maximum(out, np.maximum(_fall(1.3 * radius), _sized(kept, shape)))
    for face in subject.faces:
        oval = _oval(face, shape, 1.05)
        out = np.maximum(out, np.maximum(oval, soft(_oval(face, shape, 1.2), 0.08 * face.height)))
    return out


def _fall(radius: Floats) -> Floats:
    """1 within most of a unit ellipse, 0 well beyond it."""
    t = np.clip((1.45 - radius) / 0.75, 0, 1)
    return np.asarray(t * t * (3 - 2 * t), np.float32)


def skin(subject: Subject, lab: Floats) -> Floats:
    """Where skin is (h, w).

    Faces without hair, glasses and paint, and what of the body looks alike. Eyes, brows and mouth
    count as skin: that is what they are drawn on.
    """
    shape = lab.shape[0], lab.shape[1]
    out = np.zeros(shape, np.float32)
    for face in subject.faces:
        oval, own = _oval(face, shape), features(face, shape)
        sample = lab[_oval(face, shape, 0.8) * (1 - own) > 0.7]
        like = _alike(lab, sample if len(sample) > MANY else lab[oval > 0.5])
        body = like * like * subject.mask * np.clip(2 - _far(face, shape) / (3 * face.height), 0, 1)
        out = np.maximum(out, np.maximum(oval * np.minimum(1.6 * like + own, 1), body))
    return soft(out)


def hair(subject: Subject, lab: Floats, bare: Floats) -> Floats:
    """Where hair is (h, w): about the heads, on the subject, and alike what frames the forehead.

    bare: where skin is.
    """
    shape = lab.shape[0], lab.shape[1]
    out = np.zeros(shape, np.float32)
    free = subject.mask * (1 - bare)
    for face in subject.faces:
        head = soft(_oval(face, shape, 1.75, 0.25), 0.08 * face.height) * (
            1 - _oval(face, shape, 0.9)
        )
        forehead = _along(face, shape) < (face.path((33, 263)) * face.down).sum(1).mean()
        sample = lab[(_oval(face, shape, 1.3) - _oval(face, shape)) * free * forehead > 0.5]
        if len(sample) > MANY:
            out = np.maximum(out, head * free * _alike(lab, sample) ** 2)
    return soft(out)


def _alike(lab: Floats, sample: Floats) -> Floats:
    """How far colours are those of a sample, in light and in shadow: lightness counts little."""
    level = np.maximum(sample[:, :1], np.float32(0.15))
    seen = np.concatenate([sample[:, :1], sample[:, 1:] / level], 1)
    middle = np.median(seen, 0)
    spread = np.maximum(1.5 * np.median(np.abs(seen - middle), 0), [0.12, 0.03, 0.03]).astype(
        np.float32
    )
    out = np.empty(lab.shape[:2], np.float32)
    _compare(lab, middle, spread, out)
    return out


@lean_kernel
def _compare(lab, middle, spread, out):  # type: ignore[no-untyped-def]
    """How like a surface colours are, in lightness, and in chroma for the light there is."""
    for y in range(out.shape[0]):
        for x in range(out.shape[1]):
            light = max(lab[y, x, 0], np.float32(0.15))
            off = ((lab[y, x, 0] - middle[0]) / spread[0]) ** 2
            for c in range(1, 3):
                off += ((lab[y, x, c] / light - middle[c]) / spread[c]) ** 2
            out[y, x] = np.exp(min(np.float32(0), (np.float32(3) - off) / np.float32(14)))


def _far(face: Face, shape: tuple[int, int]) -> Floats:
    """How far each place is from the middle of a face, in cells."""
    x, y = face.path(OVAL).mean(0) - 0.5
    rows, cols = (np.arange(n, dtype=np.float32) for n in shape)
    return np.hypot((rows - y)[:, None], cols - x)


def _along(face: Face, shape: tuple[int, int]) -> Floats:
    """How far down the face's axis each place lies, in cells; as `landmarks @ down`."""
    rows, cols = (np.arange(n, dtype=np.float32) + np.float32(0.5) for n in shape)
    return rows[:, None] * face.down[1] + cols * face.down[0]


def features(face: Face, shape: tuple[int, int]) -> Floats:
    """Eyes, brows and lips (h, w)."""
    rings = [
        *zip(UPPER_LID, LOWER_LID, strict=True),
        *zip(BROW_TOP, BROW_BOTTOM, strict=True),
        (LIP_TOP, LIP_BOTTOM),
    ]
    return polygons([face.path((*top, *bottom[::-1])) for top, bottom in rings], shape)
