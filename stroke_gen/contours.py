"""Outlines: the few lines that matter, in the darkest crayon that fits, with a sharpened edge.

Chains of edge pixels come from OpenCV's EdgeDrawing on the lightness; they are faired, ranked by
length, contrast and detail, and drawn as far as the style's budget of line goes.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from . import hand
from .analysis import blur
from .colour import oklab
from .drawing import Stroke, Tip
from .jit import kernel
from .mixing import BODY_PRICE, SKIN_RAD, foreign
from .params import Style
from .scene import Scene
from .separation import Plan
from .swatches import Swatches, firmness

Floats = NDArray[np.float32]
SCALE = 2  # edge pixels per work cell
BUDGET = 7.0  # length of all lines at `lines` = 1, in long sides of the sheet
DARKER = 0.14  # OKLab L by which a line is darker than what it bounds
LEAST_PRESSURE = 0.38  # N/mm^2: a line that is meant
CURLED = 0.6  # radians a width by which worms along fringes turn: they say nothing
AREA_WORTH = 3.0  # how much more an area's outline counts than an edge
LINE_TAPER = 4.0  # tips over which an outline begins and ends
SMALL = 60.0  # widths across, of a thing in which no lines are drawn
LONGEST = 40.0  # tips: a longer line is drawn in several strokes


@dataclass(frozen=True, eq=False)
class Lines:
    """Faired chains of edge points, one after the other, with what speaks for drawing them."""

    points: Floats  # (n, 2) in work cells
    first: NDArray[np.int64]  # (lines + 1,) where each begins
    contrast: Floats  # (n,) difference of lightness between the two sides
    worth: Floats  # (lines,)

    def only(self, chosen: NDArray[np.int64]) -> "Lines":
        """Some of the lines, in the order given."""
        length = np.diff(self.first)[chosen]
        first = np.append(0, np.cumsum(length))
        at = np.repeat(self.first[chosen] - first[:-1], length) + np.arange(first[-1])
        return Lines(self.points[at], first, self.contrast[at], self.worth[chosen])


def outlines(
    plan: Plan, now: Floats, inside: Floats, style: Style, rng: np.random.Generator
) -> list[Stroke]:
    """Outline strokes for a plan whose sheet shows `now` (h, w, 3), `inside` its margin, light
    crayons first.
    """
    scene, box = plan.scene, plan.swatches
    if style.lines <= 0:
        return []
    tip = Tip("sharp", round(style.line_tip * style.tip_mm, 3))  # as the drawing's file rounds it
    width = tip.width_mm / scene.cell_mm
    lightness = blur(scene.lab[..., 0], max(0.3 * width, 0.7))
    lines = _edges(scene, lightness, width)
    # edges then only fill in what the areas' outlines leave: eyes, mouths, small things
    if style.closed:
        small = _means(_sample(scene.detail, lines.points), lines.first) > 0.45
        lines = _together(
            _areas(scene, scene.label, lightness, width), lines.only(np.flatnonzero(small))
        )
    lines = lines.only(np.flatnonzero(_means(_sample(inside, lines.points), lines.first) > 0.98))
    order = np.argsort(-lines.worth, kind="stable")
    length = np.cumsum(np.diff(lines.first)[order])
    lines = lines.only(order[length <= style.lines * BUDGET * max(scene.detail.shape)])
    crayon, pressure = _crayons(lines, scene, now, box, style)
    strokes: list[Stroke] = []
    for k in sorted(set(crayon.tolist()), key=lambda k: -box.lightness()[k]):
        mine = np.flatnonzero(crayon == k)
        some = lines.only(mine)
        level = np.clip(0.5 + some.contrast / 0.3, 0.5, 1.2) * np.repeat(
            pressure[mine], np.diff(some.first)
        )
        paths = hand.Paths(
            some.points, level.astype(np.float32), np.zeros(len(level), np.int32), some.first
        )
        for _ in range(style.search):
            strokes += hand.draw(
                paths, scene.cell_mm, box.names[k], tip, "line", style, rng, LINE_TAPER
            )
    return strokes


def _edges(scene: Scene, lightness: Floats, width: float) -> Lines:
    """Candidate lines along the scene's edges for a tip `width` cells wide."""
    h, w = lightness.shape
    grey = cv2.resize(
        np.clip(lightness * 255, 0, 255).astype(np.uint8),
        (w * SCALE, h * SCALE),
        interpolation=cv2.INTER_CUBIC,
    )
    detector = cv2.ximgproc.createEdgeDrawing()
    settings = cv2.ximgproc_EdgeDrawing_Params()  # type: ignore[attr-defined]
    settings.GradientThresholdValue = 14
    # a clean step's gradient is as high on two pixels, none of which would stand out
    settings.AnchorThresholdValue = 0
    settings.MinPathLength = max(8, int(6 * width * SCALE))
    detector.setParams(settings)
    detector.detectEdges(grey)
    chains: list[NDArray[Any]] = []
    for chain in map(np.asarray, detector.getSegments()):
        parts = int(len(chain) / SCALE / (LONGEST * width))
        chains += np.array_split(chain, parts) if parts > 1 else [chain]
    points, first = _end_to_end(chains)
    fair = _faired((points + np.float32(0.5)) / np.float32(SCALE), first, 1.5 * SCALE)
    return _lines(fair, scene, lightness, width)


def _areas(scene: Scene, group: NDArray[np.int32], lightness: Floats, width: float) -> Lines:
    """Closed lines round the larger areas of one colour."""
    chains = []
    for g in np.flatnonzero(np.bincount(group.ravel())):
        area = blur((group == g).astype(np.float32), 1.2 * width) > 0.5
        rings, _ = cv2.findContours(area.astype(np.uint8), cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
        for ring in rings:
            path = ring[:, 0].astype(np.float32) + 0.5
            if cv2.contourArea(path) >= 20 * width * width:
                # the end runs past the beginning
                around = np.concatenate([path, path[: max(3, int(2 * width))]])
                chains.append(np.repeat(around, SCALE, 0))
    fair = _faired(*_end_to_end(chains), 1.5 * width * SCALE)
    lines = _lines(fair, scene, lightness, width, AREA_WORTH)
    x, y = lines.points.T
    off = (x < 3) | (y < 3) | (x > group.shape[1] - 3) | (y > group.shape[0] - 3)
    # not the picture's border
    return lines.only(np.flatnonzero(_means(off.astype(np.float32), lines.first) <= 0.5))


def _together(one: Lines, other: Lines) -> Lines:
    """The lines of both."""
    first = np.append(one.first, one.first[-1] + other.first[1:])
    both = ((getattr(one, name), getattr(other, name)) for name in ("points", "contrast", "worth"))
    points, contrast, worth = map(np.concatenate, both)
    return Lines(points, first, contrast, worth)


def _lines(
    fair: Lines, scene: Scene, lightness: Floats, width: float, factor: float = 1.0
) -> Lines:
    """Those faired chains that are long and strong enough to be lines, with their contrast and
    worth.
    """
    fair = fair.only(np.flatnonzero(np.diff(fair.first) >= max(3.0, 5 * width)))
    aside = np.float32(0.6 * width) * _normals(fair)
    contrast = np.abs(
        _sample(lightness, fair.points + aside) - _sample(lightness, fair.points - aside)
    )
    mean = _means(contrast, fair.first)
    who = scene.subject.mask
    care = _means(_sample(scene.care, fair.points), fair.first)
    rim = _means(
        np.abs(_sample(who, fair.points + 3 * aside) - _sample(who, fair.points - 3 * aside)),
        fair.first,
    )
    mean = mean * np.clip((CURLED - _turning(fair) * width) / 0.3, 0, 1)
    within = _means(_sample(_small(who, SMALL * width), fair.points), fair.first)
    mean = np.where((within > 0.7) & (rim < 0.35), 0, mean)  # strokes tell what is in a small thing
    worth = factor * mean * np.diff(fair.first) ** 0.5 * (0.5 + care + 2 * rim)
    return Lines(fair.points, fair.first, contrast, worth).only(
        np.flatnonzero(mean * factor >= 0.08)
    )


def _small(mask: Floats, least: float) -> Floats:
    """Where a mask (h, w) has parts less than `least` cells across."""
    _, label, stats, _ = cv2.connectedComponentsWithStats((mask > 0.5).astype(np.uint8))
    small = np.sqrt(stats[:, cv2.CC_STAT_AREA]) < least
    small[0] = False
    return small[label].astype(np.float32)


def _end_to_end(chains: Sequence[NDArray[Any]]) -> tuple[Floats, NDArray[np.int64]]:
    """Chains one after the other (n, 2), and where each begins (chains + 1,)."""
    first = np.cumsum([0, *map(len, chains)])
    return np.concatenate([np.empty((0, 2)), *chains]).astype(np.float32), first


def _faired(points: Floats, first: NDArray[np.int64], sigma: float) -> Lines:
    """Chains smoothed along themselves, their ends kept, and thinned to one point a cell or so."""
    smooth, thin = np.empty_like(points), np.empty_like(first)
    _fair(
        points,
        first,
        np.exp(-0.5 * (np.arange(int(3 * sigma) + 1) / sigma) ** 2),
        SCALE,
        smooth,
        thin,
    )
    smooth = smooth[: thin[-1]]
    return Lines(
        smooth, thin, np.zeros(len(smooth), np.float32), np.zeros(len(thin) - 1, np.float32)
    )


@kernel
def _fair(points, first, weights, every, smooth, thin):  # type: ignore[no-untyped-def]
    """Every `every`th point of each chain, smoothed by half a bell of `weights`: smooth (n, 2),
    thin (chains + 1,).

    Beyond its ends a chain goes on as its mirror image about them.
    """
    used = 0
    thin[0] = 0
    for line in range(thin.size - 1):
        begin, end = first[line], first[line + 1] - 1
        for i in range(begin, end + 1, every):
            total, x, y = 0.0, 0.0, 0.0
            for o in range(
                -min(weights.size - 1, end - begin), min(weights.size - 1, end - begin) + 1
            ):
                weight, j = weights[abs(o)], i + o
                total += weight
                if j < begin:
                    x += weight * (2 * points[begin, 0] - points[2 * begin - j, 0])
                    y += weight * (2 * points[begin, 1] - points[2 * begin - j, 1])
                elif j > end:
                    x += weight * (2 * points[end, 0] - points[2 * end - j, 0])
                    y += weight * (2 * points[end, 1] - points[2 * end - j, 1])
                else:
                    x += weight * points[j, 0]
                    y += weight * points[j, 1]
            smooth[used, 0], smooth[used, 1] = x / total, y / total
            used += 1
        thin[line + 1] = used


def _normals(lines: Lines) -> Floats:
    """Unit normal (n, 2) of the lines at each point."""
    ahead, behind = np.arange(len(lines.points)) + 1, np.arange(len(lines.points)) - 1
    ahead[lines.first[1:] - 1] -= 1
    behind[lines.first[:-1]] += 1
    x, y = (lines.points[ahead] - lines.points[behind]).T
    return np.asarray(np.stack([-y, x], 1) / np.maximum(np.hypot(x, y), 1e-6)[:, None], np.float32)


def _turning(lines: Lines) -> Floats:
    """How much each line turns, in radians a cell of its length."""
    normals = _normals(lines)
    ahead = np.minimum(
        np.arange(len(normals)) + 1, np.repeat(lines.first[1:] - 1, np.diff(lines.first))
    )
    turn = np.arccos(np.clip((normals * normals[ahead]).sum(1), -1, 1))
    return _means(turn.astype(np.float32), lines.first)


def _means(values: Floats, first: NDArray[np.int64]) -> Floats:
    """Mean over each line of what is given for its points."""
    count = np.diff(first).astype(np.float32)
    total = np.add.reduceat(values, first[:-1])
    return np.asarray(total / count.reshape(-1, *[1] * (values.ndim - 1)), np.float32)


def _sample(image: Floats, points: Floats) -> Floats:
    """Values of a map (h, w) or (h, w, 3) at points."""
    j = np.clip(points[:, 1].astype(int), 0, image.shape[0] - 1)
    i = np.clip(points[:, 0].astype(int), 0, image.shape[1] - 1)
    return image[j, i]


def _crayons(
    lines: Lines, scene: Scene, now: Floats, box: Swatches, style: Style
) -> tuple[NDArray[np.int64], Floats]:
    """For each line the crayon and pressure that come nearest to its darker side's hue, clearly
    darker than it.
    """
    aside = np.float32(0.8 * style.line_tip * style.tip_mm / scene.cell_mm) * _normals(lines)
    sides = [
        _means(_sample(scene.lab, lines.points + side * aside), lines.first) for side in (1, -1)
    ]
    darker = np.where(sides[0][:, :1] <= sides[1][:, :1], *sides)
    ground = _means(_sample(now, lines.points), lines.first)
    aim = darker.copy()
    aim[:, 0] = np.minimum(darker[:, 0], oklab(ground)[:, 0]) - DARKER
    hardest = box.pressures >= min(LEAST_PRESSURE, box.pressures[-1])  # a light hand's firmest
    colours = oklab(box.over(ground))[:, :, hardest]
    off = np.linalg.norm((colours - aim[:, None, None]) * np.array([1, 1.2, 1.2]), axis=3)
    off += 0.3 * np.maximum(colours[..., 0] - aim[:, None, None, 0] - 0.03, 0)
    skin = _means(_sample(scene.skin, lines.points), lines.first)
    off += BODY_PRICE * skin[:, None, None] * foreign(box, SKIN_RAD)[None, :, None]
    k, p = np.divmod(off.reshape(len(off), math.prod(off.shape[1:])).argmin(1), off.shape[2])
    return k, box.pressures[hardest][p] * np.float32(
        style.line_press * firmness(style.line_tip * style.tip_mm)
    )
