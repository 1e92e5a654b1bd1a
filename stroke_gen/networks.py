"""Three small networks that see faces, the landmarks of a face, and people: MediaPipe's, by OpenCV.

Pictures go in as sRGB, uint8 (h, w, 3); landmarks come out in pixels of the picture. The files lie
in `models`, whose NOTICE says where they are from.
"""

import threading
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from .alike import plain_opencv, times

Floats = NDArray[np.float32]
Picture = NDArray[np.uint8]
MODELS = Path(__file__).with_name("models")
DETECTOR_SIDE, MESH_SIDE, MASK_SIDE = 192, 192, 256  # pixels that the networks take
ANCHORS = 48  # along each side of the detector's picture, a box each
DETECTED = (
    0.33  # least score of a box that is looked at closely: small faces and cut ones score little
)
SURE = 2.0  # least logit of the mesh, which knows better whether there is a face
TWICE = 0.3  # share of the smaller box that two of one face have in common
AROUND = 1.5  # the mesh looks at a square so much larger than the face's box
_LOCK = threading.Lock()  # a network holds the picture it looks at


class Box(NamedTuple):
    """Where a face may be: score 0..1, two corners (2,), middles of the eyes (2, 2)."""

    score: float
    low: Floats
    high: Floats
    eyes: Floats


@cache
def available() -> bool:
    """Whether this OpenCV can load the networks."""
    try:
        for path in MODELS.glob("*.tflite"):
            _network(path.stem)
        return (MODELS / "face_landmark.tflite").exists()
    except cv2.error:
        return False


@cache
@plain_opencv()  # layers keep the road that was open when they were made
def _network(name: str) -> Any:
    # OpenCV 5's new engine loses all outputs but one; OpenCV 4 has only the classic one.
    engine = [cv2.dnn.ENGINE_CLASSIC] if hasattr(cv2.dnn, "ENGINE_CLASSIC") else []
    return cv2.dnn.readNetFromTFLite(str(MODELS / f"{name}.tflite"), *engine)


@plain_opencv()
def _run(name: str, picture: Floats, *outputs: str) -> Sequence[Floats]:
    """The outputs of a network for a picture (side, side, 3).

    On one thread: two take twice the work and no less time over networks so small.
    """
    with _LOCK:
        threads = cv2.getNumThreads()
        cv2.setNumThreads(1)
        try:
            network = _network(name)
            network.setInput(np.ascontiguousarray(picture.transpose(2, 0, 1)[None], np.float32))
            return network.forward(outputs)
        finally:
            cv2.setNumThreads(threads)


def people(picture: Picture) -> Floats:
    """How surely each place shows a person, 0..1 (256, 256), whatever the picture's shape."""
    small = cv2.resize(picture, (MASK_SIDE, MASK_SIDE), interpolation=cv2.INTER_AREA)
    return np.clip(
        _run("selfie_segmentation", small / np.float32(255), "activation_10")[0][0, 0], 0, 1
    )


def boxes(picture: Picture) -> list[Box]:
    """Boxes round faces, surest first, each face once.

    They are seen in the whole picture, and in tiles of half its side that overlap by half.
    """
    found = [box for tile in _tiles(*picture.shape[:2]) for box in _boxes(picture[tile], tile)]
    kept: list[Box] = []
    for box in sorted(found, key=lambda box: -box.score):
        if all(_common(box, other) < TWICE for other in kept):
            kept.append(box)
    return kept


def _tiles(h: int, w: int) -> Iterator[tuple[slice, slice]]:
    for side in (max(h, w), max(h, w) // 2):
        for y in _steps(h, side):
            for x in _steps(w, side):
                yield slice(y, y + side), slice(x, x + side)


def _steps(length: int, side: int) -> list[int]:
    """Where tiles begin that overlap by half at least."""
    over = max(0, length - side)
    return np.linspace(0, over, 1 + -(-2 * over // side)).astype(int).tolist()


def _common(one: Box, other: Box) -> float:
    shared = np.maximum(0, np.minimum(one.high, other.high) - np.maximum(one.low, other.low)).prod()
    return float(shared / min((b.high - b.low).prod() for b in (one, other)))


def _boxes(part: Picture, tile: tuple[slice, slice]) -> list[Box]:
    h, w = part.shape[:2]
    scale = DETECTOR_SIDE / max(h, w)
    size = max(1, round(w * scale)), max(1, round(h * scale))
    canvas = np.zeros((DETECTOR_SIDE, DETECTOR_SIDE, 3), np.float32)
    left, top = ((DETECTOR_SIDE - n) // 2 for n in size)
    shrunk = cv2.resize(part, size, interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR)
    canvas[top : top + size[1], left : left + size[0]] = shrunk
    names = "reshaped_classifier_face_4", "reshaped_regressor_face_4"
    logit, box = _run("face_detection_full_range", canvas / np.float32(127.5) - 1, *names)
    score = 1 / (1 + np.exp(-np.clip(logit.ravel(), -80, 80)))
    at = np.flatnonzero(score >= DETECTED)
    points = box.reshape(-1, 8, 2)[at]  # the middle, the size, six points of the face
    anchor = (np.stack([at % ANCHORS, at // ANCHORS], 1)[:, None] + 0.5) / ANCHORS
    corner = np.array([tile[1].start, tile[0].start])

    def back(p: NDArray[Any]) -> Floats:
        return np.asarray(
            ((p / DETECTOR_SIDE + anchor) * DETECTOR_SIDE - [left, top]) / scale + corner,
            np.float32,
        )

    half = points[:, 1:2] / 2
    low, high, eyes = (
        back(points[:, :1] - half)[:, 0],
        back(points[:, :1] + half)[:, 0],
        back(points[:, 2:4]),
    )
    return [Box(*one) for one in zip(score[at].tolist(), low, high, eyes, strict=True)]


def mesh(picture: Picture, box: Box) -> Floats | None:
    """468 landmarks (468, 2) of the face in a box; None if there is none after all."""
    low, high, eyes, points = box.low, box.high, box.eyes, None
    for look in range(2):  # a second look, straight at where the first one found it
        tilt = np.arctan2(*(eyes[1] - eyes[0])[::-1])
        scale = MESH_SIDE / (AROUND * float((high - low).max()))
        c, s = scale * np.cos(tilt), scale * np.sin(tilt)
        turn = np.array([[c, s], [-s, c]])
        move = MESH_SIDE / 2 - times(low + high, turn) / 2
        seen = cv2.warpAffine(picture, np.hstack([turn, move[:, None]]), (MESH_SIDE, MESH_SIDE))
        logit, found = _run("face_landmark", seen / np.float32(255), "conv2d_31", "conv2d_21")
        if logit.ravel()[0] < SURE * look:
            return None
        # back: the turn the other way round, over the square of its scale
        points = times(found.reshape(468, 3)[:, :2] - move, turn.T) / (c * c + s * s)
        low, high, eyes = (
            points.min(0),
            points.max(0),
            np.stack([points[[33, 133]].mean(0), points[[263, 362]].mean(0)]),
        )
    return np.asarray(points, np.float32)
