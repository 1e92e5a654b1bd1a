"""Is it a drawing? Measures hatching, paper, borders and strokes of real drawings, a JSON row each.

usage: python tests/pictures/criteria.py [--style STYLE] [--size PIXELS] PHOTO ...

D is the width of the style's usual tip. In brackets what a good drawing of style artist reaches.

follow   strokes against the field their coat was given: mean cos of twice the angle, by length
         (> 0.9)
form     the same against the form of the photo, without the angle between coats (> 0.75)
hatch    what is seen: direction of the lightness finer than D against the form, by energy (>= 0.09)
plain    the same where the photo itself is plain, so that only hatching can have a direction
         (>= 0.09)
kept     plain, over that of all coats but the touches (>= 0.75)
covered  share of the ground that is not to be paper within reach of a stroke (>= 0.85)
wax      share of the same ground with wax on it: the paper's valleys stay bare
reserve  share of what is to be bare paper (L* > 93, chroma < 6), more than D from all else, that
         looks so (>= 0.99); null if there is little of it
frame    wax in the outer 2 D of the sheet over wax inside, where paper is not wanted (>= 0.9)
over     how far wax, but for touches, lies outside the surfaces made of it, in D: median and 95 %
         (<= 0.2, 0.8)
spilt    share of their wax that lies outside (<= 0.04)
slip     how far lines run beyond the ground that wants them, in D: median and 95 % of all strokes
strokes  number, and per megapixel (<= 15000)
length   of hatching strokes in D: median and 95 % (6 to 15, <= 40)
first    the same without touches
travel   length of all strokes in D per megapixel (<= 48000)
crayons  taken from the box
layers   area of all strokes over the area covered
sharp    share of turns within a line of more than 50 degrees on 0.3 D (0)
"""

import argparse
import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

import cv2
import numpy as np
from numpy.typing import NDArray
from skimage.color import rgb2lab

from crayonize.images.read import read_linear
from crayonize.pipeline import Easel, draw, sketch
from crayonize.settings import Settings
from stroke_gen import hand, hatching, separation
from stroke_gen.drawing import Drawing, Stroke
from stroke_gen.params import Style, load_style
from stroke_gen.separation import Plan

Floats = NDArray[np.float32]
Mask = NDArray[np.bool_]
WAX_UM = 0.2  # thinner films are not seen


@dataclass(eq=False)
class Hatching:
    """The lines of one crayon in one coat and the ground they were laid for."""

    want: Floats
    tangent: Floats
    leg: NDArray[np.int32]
    strokes: list[Stroke] = field(default_factory=list)


@dataclass(eq=False)
class Record:
    """What the generator thought while it drew."""

    plan: Plan | None = None
    hatchings: list[Hatching] = field(default_factory=list)


@contextmanager
def recorded() -> Iterator[Record]:
    """Note every coat's plan, wanted ground, field and strokes while a photo is drawn."""
    record, open_ = Record(), dict[int, Hatching]()
    plates, hatch, draw_lines = separation.plates, hatching.hatch, hand.draw

    def noted_plates(plan: Plan, *args: Any) -> Any:
        record.plan = plan
        return plates(plan, *args)

    def noted_hatch(want: Floats, gaps: Floats, tangent: Floats, *args: Any) -> Any:
        paths = hatch(want, gaps, tangent, *args)
        open_[id(paths)] = Hatching(want, tangent, paths.leg)
        record.hatchings.append(open_[id(paths)])
        return paths

    def noted_draw(paths: hand.Paths, *args: Any) -> Any:
        strokes = draw_lines(paths, *args)
        if id(paths) in open_:
            open_.pop(id(paths)).strokes = strokes
        return strokes

    with (
        patch.object(separation, "plates", noted_plates),
        patch.object(hatching, "hatch", noted_hatch),
        patch.object(hand, "draw", noted_draw),
    ):
        yield record


def measure(photo: Floats, settings: Settings) -> dict[str, Any]:
    """All figures of one photo."""
    with recorded() as record:
        drawing, easel = sketch(photo, settings)
    style = load_style(settings.style)
    plan = record.plan
    assert plan
    return {
        **directions(record, plan, drawing, easel, style, settings.size),
        **paper(plan, drawing, easel, style),
        **borders(record, plan, style),
        **statistics(record, drawing, easel, style),
    }


# ---- 5: hatching ---------------------------------------------------------------------------------


def directions(
    record: Record, plan: Plan, drawing: Drawing, easel: Easel, style: Style, size: int
) -> dict[str, float | None]:
    scene = plan.scene
    shape = easel.sheet.rows, easel.sheet.cols
    tip = style.tip_mm / easel.sheet.cell_mm
    form = enlarged(scene.tangent, shape)
    calm = plain_ground(enlarged(lightness(scene.target), shape), tip)
    seen = alignment(lightness(easel.picture()), form, tip, calm)
    first = {coat.name for coat in style.passes if coat.kind != "touch"}
    early = replace(drawing, strokes=tuple(s for s in drawing.strokes if s.note in first))
    before = alignment(lightness(draw(early, size).picture()), form, tip, calm)
    return {
        "follow": followed([(h, h.tangent) for h in record.hatchings], scene.cell_mm),
        "form": followed([(h, scene.tangent) for h in record.hatchings], scene.cell_mm),
        "hatch": alignment(lightness(easel.picture()), form, tip, np.ones(shape, np.bool_)),
        "plain": seen,
        "kept": seen / before if seen is not None and before else None,
    }


def followed(pairs: list[tuple[Hatching, Floats]], cell_mm: float) -> float | None:
    """Mean cos of twice the angle between the pieces of legs and a field, by length."""
    total = length = 0.0
    for laid, tangent in pairs:
        if not laid.strokes:
            continue
        path = np.concatenate([s.path_mm for s in laid.strokes]) / cell_mm
        stroke = np.repeat(np.arange(len(laid.strokes)), [len(s.path_mm) for s in laid.strokes])
        same = (np.diff(laid.leg) == 0) & (np.diff(stroke) == 0)
        step, middle = np.diff(path, axis=0)[same], (path[1:] + path[:-1])[same] / 2
        along = np.hypot(*step.T)
        x, y = (np.clip(middle[:, i].astype(int), 0, tangent.shape[1 - i] - 1) for i in (0, 1))
        cosine = (step * tangent[y, x]).sum(1) / np.maximum(along, 1e-9)
        total += float((along * (2 * cosine**2 - 1)).sum())
        length += float(along.sum())
    return total / length if length else None


def alignment(light: Floats, tangent: Floats, tip: float, where: Mask) -> float | None:
    """How well the fine structure of a lightness (h, w) runs along a field: 1 along, 0 anyhow, -1
    across.

    tip: width of the crayon in pixels. The tangent of what is finer than a tip is compared with the
    field by the cosine of twice the angle, weighted by the energy of the gradient.
    """
    fine = cv2.GaussianBlur(light, (0, 0), max(0.1 * tip, 0.5)) - cv2.GaussianBlur(
        light, (0, 0), tip
    )
    gx, gy = (cv2.Scharr(fine, cv2.CV_32F, dx, 1 - dx) for dx in (1, 0))
    c, s = tangent[..., 0], tangent[..., 1]
    cos2, sin2 = c * c - s * s, 2 * c * s
    energy = (gx * gx + gy * gy)[where].sum(dtype=np.float64)
    along = ((gy * gy - gx * gx) * cos2 - 2 * gx * gy * sin2)[where].sum(dtype=np.float64)
    return float(along / energy) if energy > 0 else None


def plain_ground(light: Floats, tip: float) -> Mask:
    """Where a lightness hardly changes within 2 tips."""
    mean = cv2.GaussianBlur(light, (0, 0), 2 * tip)
    spread = cv2.GaussianBlur(light * light, (0, 0), 2 * tip) - mean * mean
    return np.asarray(spread < 2.0**2)


# ---- 7: paper ------------------------------------------------------------------------------------


def paper(plan: Plan, drawing: Drawing, easel: Easel, style: Style) -> dict[str, float | None]:
    shape = easel.sheet.rows, easel.sheet.cols
    bare = like_paper(enlarged(plan.scene.target, shape))
    wax = easel.sheet.film_um() > WAX_UM
    reached = np.zeros(shape, np.bool_)
    for band in bands(drawing.strokes, shape, easel.sheet.cell_mm):
        reached |= band
    shows_paper = like_paper(easel.picture(light=False))
    clear = distance(~bare) > style.tip_mm / easel.sheet.cell_mm
    rim = np.ones(shape, np.bool_)
    edge = max(1, round(2 * style.tip_mm / easel.sheet.cell_mm))
    rim[edge:-edge, edge:-edge] = False
    inside = share(wax, ~bare & ~rim)
    outside = share(wax, ~bare & rim)
    return {
        "covered": share(reached, ~bare),
        "wax": share(wax, ~bare),
        "reserve": share(shows_paper, clear) if bare.mean() > 0.002 else None,
        "frame": outside / inside if outside is not None and inside else None,
    }


def bands(
    strokes: tuple[Stroke, ...] | list[Stroke], shape: tuple[int, int], cell_mm: float
) -> Iterator[Mask]:
    """The ground under the strokes of each coat and crayon, as wide as their tips."""
    kinds: dict[tuple[str, str, float], list[Stroke]] = {}
    for stroke in strokes:
        kinds.setdefault((stroke.note, stroke.crayon, stroke.tip.width_mm), []).append(stroke)
    for (_, _, width), some in kinds.items():
        mask = np.zeros(shape, np.uint8)
        paths = [np.round((s.path_mm / cell_mm - 0.5) * 16).astype(np.int32) for s in some]
        cv2.polylines(mask, paths, False, 1, max(1, round(width / cell_mm)), cv2.LINE_8, 4)
        yield mask > 0


# ---- 8: borders ----------------------------------------------------------------------------------


def borders(record: Record, plan: Plan, style: Style) -> dict[str, Any]:
    cell_mm = plan.scene.cell_mm
    tip = style.tip_mm / cell_mm
    kinds = {coat.name: coat.kind for coat in style.passes}
    layers = plan.mixtures.layers[plan.scene.family]
    over, slip, laid = [], [], 0
    for hatching_ in record.hatchings:
        if not hatching_.strokes:
            continue
        beyond = distance(hatching_.want > 0)
        slip += [furthest(s.path_mm / cell_mm, beyond) for s in hatching_.strokes]
        if kinds[hatching_.strokes[0].note] != "touch":
            crayon = plan.swatches.names.index(hatching_.strokes[0].crayon)
            area = (layers == crayon).any(2)
            (wax,) = bands(hatching_.strokes, area.shape, cell_mm)
            over.append(distance(area)[wax & ~area])
            laid += int(wax.sum())
    outside = np.concatenate(over) if over else np.zeros(0)
    return {
        "over": percentiles(outside / tip),
        "spilt": outside.size / laid if laid else None,
        "slip": percentiles(np.array(slip) / tip),
    }


def distance(area: Mask) -> Floats:
    """Cells from each place to the nearest of an area; 0 within."""
    return np.asarray(cv2.distanceTransform((~area).astype(np.uint8), cv2.DIST_L2, 5), np.float32)


def furthest(path: Floats, beyond: Floats) -> float:
    """The farthest that a path (n, 2) in cells comes off wanted ground, on the sheet."""
    x, y = (np.clip(path[:, i].astype(int), 0, beyond.shape[1 - i] - 1) for i in (0, 1))
    return float(beyond[y, x].max())


# ---- 9: strokes ----------------------------------------------------------------------------------


def statistics(record: Record, drawing: Drawing, easel: Easel, style: Style) -> dict[str, Any]:
    shape = easel.sheet.rows, easel.sheet.cols
    megapixels, tip = shape[0] * shape[1] / 1e6, style.tip_mm
    lengths = [float(np.hypot(*np.diff(s.path_mm, axis=0).T).sum()) / tip for s in drawing.strokes]
    kinds = {coat.name: coat.kind for coat in style.passes}
    hatched = [
        (n, kinds[s.note]) for n, s in zip(lengths, drawing.strokes, strict=True) if s.note in kinds
    ]
    covered, areas = np.zeros(shape, np.bool_), 0
    for band in bands(drawing.strokes, shape, easel.sheet.cell_mm):
        covered |= band
        areas += int(band.sum())
    turns = np.concatenate(
        [np.zeros(1), *(turning(h, 0.3 * tip) for h in record.hatchings if h.strokes)]
    )
    return {
        "strokes": [len(drawing.strokes), round(len(drawing.strokes) / megapixels)],
        "length": percentiles([n for n, _ in hatched]),
        "first": percentiles([n for n, kind in hatched if kind != "touch"]),
        "travel": round(sum(lengths) / megapixels),
        "crayons": len({s.crayon for s in drawing.strokes}),
        "layers": areas / covered.sum() if areas else None,
        "sharp": float((turns > 50).mean()),
    }


def turning(laid: Hatching, over_mm: float) -> NDArray[np.float64]:
    """Degrees by which lines turn from one piece of `over_mm` to the next, within legs."""
    turns, begin = [np.zeros(0)], 0
    for stroke in laid.strokes:
        leg = laid.leg[begin : begin + len(stroke.path_mm)]
        begin += len(leg)
        for part in np.split(stroke.path_mm, np.flatnonzero(np.diff(leg)) + 1):
            along = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(part, axis=0).T))])
            at = np.arange(0, along[-1], over_mm)
            if len(at) > 2:
                even = np.interp(at, along, part[:, 0]) + 1j * np.interp(at, along, part[:, 1])
                step = np.diff(even)
                turns.append(np.abs(np.degrees(np.angle(step[1:] * np.conj(step[:-1])))))
    return np.concatenate(turns)


# ---- pictures ------------------------------------------------------------------------------------


def enlarged(image: Floats, shape: tuple[int, int]) -> Floats:
    return np.asarray(cv2.resize(image, shape[::-1], interpolation=cv2.INTER_LINEAR), np.float32)


def lightness(linear: Floats, colours: bool = False) -> Floats:
    """L* (h, w) of linear light, or all of CIELAB (h, w, 3)."""
    light = np.clip(linear, 0, 1)
    code = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    lab = rgb2lab(code).astype(np.float32)
    return np.ascontiguousarray(lab if colours else lab[..., 0])


def like_paper(linear: Floats) -> Mask:
    """Where linear light looks like bare white paper."""
    lab = lightness(linear, colours=True)
    return np.asarray((lab[..., 0] > 93) & (np.hypot(lab[..., 1], lab[..., 2]) < 6))


def share(mask: Mask, where: Mask) -> float | None:
    return float(mask[where].mean()) if where.any() else None


def percentiles(values: Any) -> list[float] | None:
    """Median and 95 %."""
    return [float(v) for v in np.percentile(values, (50, 95))] if len(values) else None


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("photos", nargs="+", metavar="PHOTO")
    parser.add_argument("--style", default="artist")
    parser.add_argument("--size", type=int, default=1600)
    words = parser.parse_args()
    for name in words.photos:
        row = measure(read_linear(name, words.size), Settings(style=words.style, size=words.size))
        tidy = json.loads(json.dumps(row), parse_float=lambda number: round(float(number), 3))
        print(json.dumps({"photo": Path(name).name, **tidy}), flush=True)


if __name__ == "__main__":
    main()
