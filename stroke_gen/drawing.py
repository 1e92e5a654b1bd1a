"""Drawing: every stroke of a crayon drawing in drawing order, and the limits it keeps to.

This is the seam of the program: strokes are planned on one side and rubbed onto paper on the other,
and a Drawing can be saved, loaded, written by hand or made by another program in between
(drawing_file.py). All geometry is in millimetres on the sheet, x to the right, y down; all forces
are in newton.
"""

import json
import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import checks
from .checks import did_you_mean, shown

TIP_KINDS = ("sharp", "blunt", "rim", "side")
SIDE_MM = 2.6  # breadth of the strip on which a crayon lying on its side touches the paper
MAX_FORCE_N = 100.0
MAX_SHEET_MM = 5000.0
MAX_TIP_MM = 200.0
MAX_TILT_DEG = 80.0
MAX_STROKES = 2_000_000
MAX_POINTS = 50_000_000
MAX_SEED = 2**63 - 1
MAX_LABEL = 1000  # characters of a name


class Note(StrEnum):
    """What a stroke is for, as the generator says it; other programs may write any word."""

    FILL = "fill"  # covers an area
    DETAIL = "detail"  # small strokes over the fill
    LINE = "line"  # drawn for itself: a contour, a line of another program
    OUTLINE = "outline"  # goes round a whole area


@dataclass(frozen=True)
class Tip:
    """The end of the crayon that touches the paper.

    kind: "sharp", "blunt", "rim" (edge of a worn end) or "side" (the crayon laid flat).
    width_mm: diameter of the contact disc; for "side" the length of the side.
    angle_deg: direction of the long axis on the sheet, for "side" and "rim".
    """

    kind: str = "blunt"
    width_mm: float = 2.4
    angle_deg: float = 0.0

    @property
    def area_mm2(self) -> float:
        """Area of paper under the tip: a disc, but for "side" a strip and for "rim" one side of a
        ring.

        >>> round(Tip("side", 30.0).area_mm2, 1)
        78.0
        """
        if self.kind == "side":
            return self.width_mm * min(SIDE_MM, self.width_mm)
        disc = math.pi / 4 * self.width_mm**2
        return RIM_SHARE * disc if self.kind == "rim" else disc


def _beyond(radius: float, x: float) -> float:
    """Area of the part of a disc round the origin that lies to the right of x."""
    return radius**2 * math.acos(x / radius) - x * math.sqrt(radius**2 - x**2)


# The rim, in radii of the disc: outside RIM_INNER, and to the right of RIM_FROM.
RIM_INNER, RIM_FROM = 0.35, -0.3
RIM_SHARE = (_beyond(1.0, RIM_FROM) - _beyond(RIM_INNER, RIM_FROM)) / math.pi  # of the disc


@dataclass(frozen=True, eq=False)
class Stroke:
    """One movement of one crayon over the paper; a single point is a dab.

    path_mm: (n, 2) float32, x and y.   force_n: (n,) float32, how hard the crayon is pressed at
        each point.
    crayon: its name in the palette.   note: what the stroke is for, one of Note or any word.
    tilt_deg: (n, 2) float32, how far the crayon's axis leans from upright at each point, and to
        where on the sheet (0 to the right, 90 down); None: upright.
    """

    path_mm: NDArray[np.float32]
    force_n: NDArray[np.float32]
    crayon: str
    tip: Tip
    note: str = Note.FILL
    tilt_deg: NDArray[np.float32] | None = None


@dataclass(frozen=True, eq=False)
class Drawing:
    """A sheet of paper and the strokes on it, first stroke first.

    paper, palette: the name of one, or its content as a JSON object.   physics: the units of the
        wax model.
    seed: what the paper and every chance in the wax are drawn from.
    """

    width_mm: float
    height_mm: float
    paper: str | dict[str, Any]
    palette: str | dict[str, Any]
    strokes: tuple[Stroke, ...]
    physics: str = "metric"
    seed: int = 0


# ---- the limits ----------------------------------------------------------------------------------


def check_drawing(drawing: Drawing, where: str) -> None:
    """ValueError naming the field, and the stroke counted from 1, that breaks a limit of
    drawings.
    """
    width, height = (checks.number(side, 1.0, MAX_SHEET_MM, f"{where}: sheet_mm", "mm")
                     for side in (drawing.width_mm, drawing.height_mm))  # fmt: skip
    _check_named(drawing.paper, f"{where}: paper")
    _check_named(drawing.palette, f"{where}: palette")
    _check_label(drawing.physics, f"{where}: physics")
    checks.whole(drawing.seed, 0, MAX_SEED, f"{where}: seed", "2^63 - 1")
    checks.count("strokes", len(drawing.strokes), MAX_STROKES, where)
    checks.count(
        "points", sum(len(stroke.path_mm) for stroke in drawing.strokes), MAX_POINTS, where
    )
    for i, stroke in enumerate(drawing.strokes):
        _check_stroke(stroke, width, height, f"{where}: stroke {i + 1}")


def check_tip(tip: Tip, where: str) -> None:
    """ValueError naming the field of a tip that breaks a limit."""
    if tip.kind not in TIP_KINDS:
        near = did_you_mean(str(tip.kind), TIP_KINDS)
        raise ValueError(f"{where}: kind: {shown(tip.kind)} is no kind of tip{near}")
    checks.number(tip.width_mm, 0.1, MAX_TIP_MM, f"{where}: width_mm", "mm")
    checks.number(tip.angle_deg, -360.0, 360.0, f"{where}: angle_deg", "degrees")


def _check_stroke(stroke: Stroke, width_mm: float, height_mm: float, where: str) -> None:
    _check_label(stroke.crayon, f"{where}: crayon")
    where = f"{where} ({shown(stroke.crayon)[1:-1]})"
    _check_label(stroke.note, f"{where}: note")
    check_tip(stroke.tip, f"{where}: tip")
    path, force = stroke.path_mm, stroke.force_n
    if path.ndim != 2 or path.shape[1] != 2 or len(path) == 0 or force.shape != (len(path),):
        raise ValueError(
            f"{where}: path {path.shape} and force {force.shape} are not of shapes (n, 2) and (n,)"
        )
    for axis, size in enumerate((width_mm, height_mm)):
        _check_range(
            path[:, axis], -size, 2 * size, 0.002, f"{where}: path", f"{'xy'[axis]} =", "mm"
        )
    _check_range(force, 0.0, MAX_FORCE_N, 0.0, f"{where}: force", "force =", "N")
    tilt = stroke.tilt_deg
    if tilt is None:
        return
    if tilt.shape != (len(path), 2):
        raise ValueError(f"{where}: tilt {tilt.shape} is not of shape ({len(path)}, 2)")
    _check_range(tilt[:, 0], 0.0, MAX_TILT_DEG, 0.0, f"{where}: tilt", "tilt =", "degrees")
    _check_range(tilt[:, 1], -360.0, 360.0, 0.0, f"{where}: tilt", "azimuth =", "degrees")


def _check_range(
    values: NDArray[np.float32],
    low: float,
    high: float,
    slack: float,
    where: str,
    what: str,
    unit: str,
) -> None:
    """slack: what rounding the sheet and the point to thousandths may add."""
    if low - slack <= values.min() and values.max() <= high + slack:
        return
    i = int(np.argmin((values >= low - slack) & (values <= high + slack)))
    raise ValueError(
        f"{where}: point {i + 1}: {what} {values[i]:g} is not from {low:g} to {high:g} {unit}"
    )


def _check_named(value: Any, where: str) -> None:
    if not isinstance(value, dict):
        _check_label(value, where)
        return
    try:
        json.dumps(value, allow_nan=False, sort_keys=True)
    except (TypeError, ValueError, RecursionError) as error:
        raise ValueError(f"{where}: not a JSON object of text and finite numbers") from error


def _check_label(value: Any, where: str) -> None:
    checks.text(value, MAX_LABEL, where, shortest=1)
