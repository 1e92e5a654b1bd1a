"""The outline of a drawing: its own lines, and where one colour borders on another."""

from collections.abc import Iterator

import cv2
import numpy as np
from numpy.typing import NDArray

from stroke_gen.colour import oklab
from stroke_gen.drawing import Drawing, Note, Stroke, Tip

from ..crayons.palette import Palette
from ..images.srgb import light_of

LINES = (Note.LINE, Note.OUTLINE)  # notes of strokes that belong to the outline
PLACE_MM = 1.5  # cells of the map of which crayon lies where
SMALLEST_MM2 = 200.0  # a patch of colour smaller than this gets no outline
PENCIL_TIP, PENCIL_N = Tip("sharp", 1.1), 0.55

_NEAR = np.ones((3, 3), np.uint8)  # a cell and its neighbours


def outline_of(drawing: Drawing, palette: Palette) -> list[Stroke]:
    """Thin grey lines: the drawing's own lines, and where one colour borders on another."""
    grey = _grey(palette)
    lines = [s.path_mm for s in drawing.strokes if s.note in LINES and len(s.path_mm) > 1]
    return [_pencil(path, grey) for path in [*lines, *_borders(drawing, palette)]]


def _grey(palette: Palette) -> str:
    """The crayon nearest to a dark grey."""
    lab = oklab(np.array([light_of(c.hex) for c in palette.crayons], np.float32))
    return palette.crayons[int(((lab - (0.5, 0, 0)) ** 2).sum(1).argmin())].name


def _pencil(path: NDArray[np.float32], crayon: str) -> Stroke:
    return Stroke(path, np.full(len(path), PENCIL_N, np.float32), crayon, PENCIL_TIP, Note.LINE)


def _borders(drawing: Drawing, palette: Palette) -> Iterator[NDArray[np.float32]]:
    """Borders between the places of different crayons, as lines in mm; each border once."""
    places = _places(drawing, palette)
    drawn = np.zeros(places.shape, np.uint8)
    drawn[[0, -1]] = drawn[:, [0, -1]] = 1  # the edge of the sheet is no border
    for index in np.unique(places):
        mask = (places == index).astype(np.uint8)
        for contour in cv2.findContours(mask, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)[0]:
            ring = contour[:, 0]
            if len(ring) * PLACE_MM < 30:
                continue
            known = drawn[ring[:, 1], ring[:, 0]] > 0
            if known.any() and not known.all():  # begin where a known border ends
                turn = int(np.flatnonzero(known)[0])
                ring, known = np.roll(ring, -turn, 0), np.roll(known, -turn)
            smooth = _smoothed((ring + 0.5) * PLACE_MM)
            edges = np.flatnonzero(np.diff(np.concatenate([[1], known.astype(np.int8), [1]])))
            for a, b in edges.reshape(-1, 2):
                if (b - a) * PLACE_MM >= 6:
                    part = smooth[a:b] if known.any() else np.concatenate([smooth, smooth[:1]])
                    yield part.astype(np.float32)
        rim = cv2.morphologyEx(mask, cv2.MORPH_GRADIENT, _NEAR)
        drawn = np.maximum(drawn, cv2.dilate(rim, _NEAR))


def _smoothed(ring: NDArray[np.float64]) -> NDArray[np.float64]:
    """A closed line without the stairs of its cells."""
    weights = np.exp(-0.5 * (np.arange(-4, 5) / 1.6) ** 2)
    long = np.concatenate([ring[-4:], ring, ring[:4]]) if len(ring) > 8 else ring
    smooth = np.stack(
        [np.convolve(long[:, axis], weights / weights.sum(), "valid") for axis in (0, 1)], 1
    )
    return smooth if len(smooth) == len(ring) else ring


def _places(drawing: Drawing, palette: Palette) -> NDArray[np.int32]:
    """Which crayon dominates where, on cells of PLACE_MM; 0 is bare paper.

    Small patches join their surroundings.
    """
    shape = (
        max(2, round(drawing.height_mm / PLACE_MM)),
        max(2, round(drawing.width_mm / PLACE_MM)),
    )
    laid = np.zeros((len(palette.crayons) + 1, *shape), np.float32)
    laid[0] = 0.35
    for stroke in drawing.strokes:
        if stroke.note not in LINES:
            mask = np.zeros(shape, np.uint8)
            points = np.round(stroke.path_mm / PLACE_MM * 16 - 8).astype(np.int32)
            cv2.polylines(
                mask,
                [points],
                False,
                1,
                max(1, round(stroke.tip.width_mm / PLACE_MM)),
                cv2.LINE_8,
                4,
            )
            laid[palette.index(stroke.crayon) + 1] += mask * float(
                stroke.force_n.mean() / stroke.tip.width_mm
            )
    for layer in laid:
        cv2.GaussianBlur(layer, (0, 0), 2.0, dst=layer)
    places = laid.argmax(0).astype(np.int32)
    for index in np.unique(places):
        _, parts, stats, _ = cv2.connectedComponentsWithStats(
            (places == index).astype(np.uint8), connectivity=4
        )
        small = np.flatnonzero(stats[:, cv2.CC_STAT_AREA] * PLACE_MM**2 < SMALLEST_MM2)
        for part in small[small > 0]:
            inside = (parts == part).astype(np.uint8)
            around = places[(cv2.dilate(inside, _NEAR) > 0) & (inside == 0)]
            if around.size:
                places[inside > 0] = np.bincount(around).argmax()
    return places
