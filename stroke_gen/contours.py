"""Outlines: the few lines that matter, in the darkest crayon that fits, with a sharpened edge.

Chains of edge pixels come from OpenCV's EdgeDrawing on the lightness; they are faired, ranked by length,
contrast and detail, and drawn as far as the style's budget of line goes.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from . import hand
from .analysis import Scene, blur
from .colour import oklab
from .drawing import Stroke, Tip
from .params import Style
from .separation import Plan
from .swatches import Swatches

Floats = NDArray[np.float32]
SCALE = 2  # edge pixels per work cell
BUDGET = 7.0  # length of all lines at `lines` = 1, in long sides of the sheet
AREA_WORTH = 3.0  # how much more an area's outline counts than an edge
LONGEST = 40.0  # tips: a longer line is drawn in several strokes


@dataclass(frozen=True, eq=False)
class Line:
    """A faired chain of edge points in work cells with what speaks for drawing it."""

    path: Floats  # (n, 2)
    contrast: Floats  # (n,) difference of lightness between its two sides
    worth: float


def outlines(plan: Plan, now: Floats, style: Style, rng: np.random.Generator) -> list[Stroke]:
    """Outline strokes for a plan whose sheet shows `now` (h, w, 3), light crayons first."""
    scene, box = plan.scene, plan.swatches.only(plan.recipes.crayons())
    if style.lines <= 0:
        return []
    tip = Tip("sharp", round(style.line_tip * style.tip_mm, 3))  # as the drawing's file rounds it
    width = tip.width_mm / scene.cell_mm
    budget = style.lines * BUDGET * max(scene.detail.shape)
    picked = []
    candidates = _lines(scene, width)
    if style.closed:  # edges then only fill in what the areas' outlines leave: eyes, mouths, small things
        candidates = _areas(scene, plan.group, width) + [
            c for c in candidates if _sample(scene.detail, c.path).mean() > 0.45
        ]
    for line in sorted(candidates, key=lambda line: -line.worth):
        budget -= len(line.path)
        if budget < 0:
            break
        picked.append(line)
    chosen = [_crayon(line, scene, now, box, style) for line in picked]
    order = sorted(range(len(picked)), key=lambda i: (-chosen[i][0], i))
    strokes: list[Stroke] = []
    for i in order:
        _, crayon, pressure = chosen[i]
        level = np.clip(picked[i].contrast / 0.25, 0.35, 1.0) * pressure
        path = picked[i].path
        paths = hand.Paths(path, level.astype(np.float32), np.zeros(len(path), np.int32), np.array([0, len(path)]))
        strokes += hand.draw(paths, scene.cell_mm, crayon, tip, "line", style, rng)
    return strokes


def _lines(scene: Scene, width: float) -> list[Line]:
    """Candidate lines of the scene for a tip `width` cells wide."""
    lightness = blur(scene.lab[..., 0], max(0.3 * width, 0.7))
    h, w = lightness.shape
    grey = cv2.resize(
        np.clip(lightness * 255, 0, 255).astype(np.uint8), (w * SCALE, h * SCALE), interpolation=cv2.INTER_CUBIC
    )
    detector = cv2.ximgproc.createEdgeDrawing()
    settings = cv2.ximgproc_EdgeDrawing_Params()  # type: ignore[attr-defined]
    settings.GradientThresholdValue = 14
    settings.AnchorThresholdValue = 0  # a clean step's gradient is as high on two pixels, none of which would stand out
    settings.MinPathLength = max(8, int(3 * width * SCALE))
    detector.setParams(settings)
    detector.detectEdges(grey)
    lines = []
    for chain in detector.getSegments():
        path = (np.asarray(chain, np.float32) + np.float32(0.5)) / np.float32(SCALE)
        for part in np.array_split(path, max(1, int(len(path) / SCALE / (LONGEST * width)))):
            line = _line(_fair(np.asarray(part, np.float32), 1.5 * SCALE), scene, lightness, width)
            if line is not None:
                lines.append(line)
    return lines


def _areas(scene: Scene, group: NDArray[np.int64], width: float) -> list[Line]:
    """Closed lines round the larger areas of one colour."""
    lightness = blur(scene.lab[..., 0], max(0.3 * width, 0.7))
    lines = []
    for g in np.unique(group):
        area = blur((group == g).astype(np.float32), 1.2 * width) > 0.5
        rings, _ = cv2.findContours(area.astype(np.uint8), cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
        for ring in rings:
            path = ring[:, 0].astype(np.float32) + 0.5
            if cv2.contourArea(path) < 20 * width * width:
                continue
            around = np.concatenate([path, path[: max(3, int(2 * width))]])  # the end runs a little past the beginning
            line = _line(_fair(np.repeat(around, SCALE, 0), 1.5 * width * SCALE), scene, lightness, width, AREA_WORTH)
            if line is not None and not _on_border(line.path, group.shape):
                lines.append(line)
    return lines


def _on_border(path: Floats, shape: tuple[int, ...]) -> bool:
    """Whether most of a line runs along the picture's border."""
    x, y = path.T
    off = (x < 3) | (y < 3) | (x > shape[1] - 3) | (y > shape[0] - 3)
    return bool(off.mean() > 0.5)


def _fair(path: Floats, sigma: float) -> Floats:
    """A chain smoothed along itself, its ends kept, and thinned to one point a cell or so."""
    if len(path) < 5:
        return path
    radius = min(int(3 * sigma), len(path) - 1)
    padded = np.concatenate([2 * path[:1] - path[radius:0:-1], path, 2 * path[-1:] - path[-2 : -radius - 2 : -1]])
    weights = np.exp(-0.5 * (np.arange(-radius, radius + 1) / sigma) ** 2)
    weights /= weights.sum()
    smooth = np.stack([np.convolve(padded[:, c], weights, "valid") for c in (0, 1)], 1)
    return smooth[::SCALE].astype(np.float32)


def _line(path: Floats, scene: Scene, lightness: Floats, width: float, factor: float = 1.0) -> Line | None:
    """The chain as a line, if it is long and strong enough to be one."""
    if len(path) < max(3.0, 2.5 * width):
        return None
    sides = [_sample(lightness, path + side * _normal(path) * 0.6 * width) for side in (1, -1)]
    contrast = np.abs(sides[0] - sides[1])
    mean = float(contrast.mean())
    if mean * factor < 0.05:
        return None
    detail = float(_sample(scene.detail, path).mean())
    return Line(path, contrast, factor * mean * len(path) ** 0.5 * (1 + 1.5 * detail))


def _normal(path: Floats) -> Floats:
    tangent = np.gradient(path, axis=0)
    tangent /= np.maximum(np.hypot(tangent[:, 0], tangent[:, 1]), 1e-6)[:, None]
    return np.stack([-tangent[:, 1], tangent[:, 0]], 1).astype(np.float32)


def _sample(image: Floats, path: Floats) -> Floats:
    """Values of a map (h, w) or (h, w, 3) along a path."""
    j = np.clip(path[:, 1].astype(int), 0, image.shape[0] - 1)
    i = np.clip(path[:, 0].astype(int), 0, image.shape[1] - 1)
    return image[j, i]


def _crayon(line: Line, scene: Scene, now: Floats, box: Swatches, style: Style) -> tuple[float, str, float]:
    """Lightness, name and pressure of the crayon that comes nearest to the line's darker side, or darker."""
    width = style.line_tip * style.tip_mm / scene.cell_mm
    sides = [_sample(scene.lab, line.path + side * _normal(line.path) * 0.6 * width).mean(0) for side in (1, -1)]
    aim = min(sides, key=lambda lab: float(lab[0])) - np.array([0.15 if style.closed else 0.05, 0, 0], np.float32)
    ground = _sample(now, line.path).mean(0)
    colours = oklab(box.over(ground))[:, 2:]
    off = np.linalg.norm((colours - aim) * np.array([1, 0.8, 0.8]), axis=2)
    k, p = np.unravel_index(int(off.argmin()), off.shape)
    return float(box.lightness()[k]), box.names[k], float(box.pressures[2 + p]) * style.line_press
