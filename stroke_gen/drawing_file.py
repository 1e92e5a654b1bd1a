"""The JSON file of a Drawing: read with every error named, written so that the same drawing gives
the same bytes.

The file holds one stroke a line:

    {"format": "crayonize drawing", "version": 1, "sheet_mm": [297, 210],
     "paper": "smooth", "palette": "box24", "physics": "metric", "seed": 1,
     "tip": {"kind": "blunt", "width_mm": 2.4}, "force": 1.5,
     "strokes": [
       {"crayon": "red", "path": [[10, 10], [40, 12.5]]},
       {"crayon": "blue", "path": [[5, 5, 0.8], [9, 5, 2.1]], "tip": {"kind": "sharp"},
        "note": "line", "tilt": [35, 45]}]}

`tip` and `force` at the top are what strokes without their own get. A stroke's force is one number
or one for each point; a third number in a point is the force there and wins. `tilt` is how far the
crayon leans from upright and to where, in degrees (0 to the right, 90 down), once or for each
point. physics, seed, tip, force, note and tilt may be left out. Whether paper, palette and crayons
exist is for the program that draws to say.
"""

import contextlib
import json
import math
import os
from collections import Counter
from collections.abc import Iterator
from itertools import chain
from typing import Any, TextIO

import numpy as np
from numpy.typing import NDArray

from . import checks
from .checks import is_number, of_kind, printable, shown
from .drawing import (
    MAX_FORCE_N,
    MAX_SHEET_MM,
    MAX_STROKES,
    Drawing,
    Note,
    Stroke,
    Tip,
    check_drawing,
    check_tip,
)
from .files import whole_file

FORMAT = "crayonize drawing"
VERSION = 1
DEFAULT_FORCE_N = 1.5
MAX_CHARS = 1_500_000_000  # 50 million points, each with a force, at full length

_DRAWING_KEYS = (
    "format",
    "version",
    "sheet_mm",
    "paper",
    "palette",
    "physics",
    "seed",
    "tip",
    "force",
    "strokes",
)
_STROKE_KEYS = ("crayon", "path", "force", "tip", "note", "tilt")
_TIP_KEYS = ("kind", "width_mm", "angle_deg")
_CHUNK = 2**20
# of a text that may be a drawing: lists (points) and quotation marks to a stroke, and beside them
_LISTS_EACH, _QUOTES_EACH, _FREE = 5000, 40, 1_000_000
_DECIMALS = 3  # a micrometre, a thousandth of a newton
_NO_FORCE = -math.inf  # stands where a point among [x, y, force] points has no force of its own


# ---- reading -------------------------------------------------------------------------------------


def load_drawing(source: str | os.PathLike[str] | TextIO) -> Drawing:
    """Read a drawing file, by path or from an open text stream.

    ValueError, one line, naming the file, the stroke (counted from 1) and the field that is wrong.
    """
    if not isinstance(source, str | os.PathLike):
        return _read(source, printable(str(getattr(source, "name", "drawing"))))
    where = printable(os.fspath(source))
    try:
        with open(source, encoding="utf-8-sig") as file:
            return _read(file, where)
    except OSError as error:
        raise ValueError(f"{where}: cannot be read ({error.strerror})") from error


def _read(stream: TextIO, where: str) -> Drawing:
    parts, length = [], 0
    try:
        while part := stream.read(_CHUNK):
            parts.append(part)
            length += len(part)
            if length > MAX_CHARS:
                raise ValueError(f"{where}: longer than {MAX_CHARS:,} characters")
    except UnicodeDecodeError as error:
        raise ValueError(f"{where}: not UTF-8 text") from error
    content = "".join(parts)
    _check_likely(content, where)
    return drawing_from_json(checks.parsed_json(content, where, "drawing", _packed), where)


def _check_likely(content: str, where: str) -> None:
    """Refuse text that would fill the memory before it turns out to be no drawing: each of its
    values takes thirty times as much as its letters.
    """
    objects = content.count("{")
    checks.count("objects", objects, 2 * MAX_STROKES + 10, where)
    for what, sign, each in (("lists", "[", _LISTS_EACH), ("texts", '"', _QUOTES_EACH)):
        number = content.count(sign)
        if number > _FREE + each * objects:
            raise ValueError(f"{where}: {number:,} {what} in {objects:,} strokes: no drawing")


def _packed(made: dict[str, Any]) -> dict[str, Any]:
    """A JSON object, its path already an array if it is sound: as lists it takes ten times the
    memory.
    """
    if "path" in made:
        with contextlib.suppress(ValueError):
            made["path"] = _points(made["path"], "")
    return made


def drawing_from_json(obj: Any, where: str = "drawing") -> Drawing:
    """The drawing a parsed JSON object describes.

    where: what every error message begins with, such as the file name. ValueError as in
        load_drawing.
    """
    _object(obj, _DRAWING_KEYS, where)
    for key in ("format", "version", "sheet_mm", "paper", "palette", "strokes"):
        if key not in obj:
            raise ValueError(f'{where}: "{key}" is missing')
    if obj["format"] != FORMAT:
        raise ValueError(f'{where}: format: {shown(obj["format"])} is not "{FORMAT}"')
    if obj["version"] != VERSION or isinstance(obj["version"], bool):
        raise ValueError(
            f"{where}: version: {shown(obj['version'])} is not {VERSION}, the one this program "
            "reads"
        )
    given = of_kind(
        list,
        obj["strokes"],
        f"{where}: strokes",
        'a list like [{"crayon": "red", "path": [[1, 2]]}]',
    )
    checks.count("strokes", len(given), MAX_STROKES, where)
    tip = _tip(obj.get("tip", {}), Tip(), f"{where}: tip")
    force = checks.number(
        obj.get("force", DEFAULT_FORCE_N), 0.0, MAX_FORCE_N, f"{where}: force", "N"
    )
    width_mm, height_mm = _sheet(obj["sheet_mm"], where)
    strokes = [_stroke(one, tip, force, _place(where, i, one)) for i, one in enumerate(given)]
    drawing = Drawing(
        width_mm=width_mm,
        height_mm=height_mm,
        paper=obj["paper"],
        palette=obj["palette"],
        strokes=tuple(strokes),
        physics=obj.get("physics", "metric"),
        seed=obj.get("seed", 0),
    )
    check_drawing(drawing, where)
    return drawing


def _object(value: Any, valid: tuple[str, ...], where: str) -> None:
    checks.keys(of_kind(dict, value, where, "an object with " + ", ".join(valid)), valid, where)


def _place(where: str, index: int, stroke: Any) -> str:
    crayon = stroke.get("crayon") if isinstance(stroke, dict) else None
    return f"{where}: stroke {index + 1}" + (
        f" ({shown(crayon)[1:-1]})" if isinstance(crayon, str) else ""
    )


def _sheet(value: Any, where: str) -> tuple[float, float]:
    if not isinstance(value, list) or len(value) != 2:
        raise ValueError(f"{where}: sheet_mm: {shown(value)} is not [width, height]")
    width, height = (checks.number(v, 1.0, MAX_SHEET_MM, f"{where}: sheet_mm", "mm") for v in value)
    return width, height


def _stroke(data: Any, tip: Tip, force: float, where: str) -> Stroke:
    _object(data, _STROKE_KEYS, where)
    for key in ("crayon", "path"):
        if key not in data:
            raise ValueError(f'{where}: "{key}" is missing')
    points = _points(data["path"], f"{where}: path")
    forces = _forces(data.get("force", force), len(points), f"{where}: force")
    if points.shape[1] == 3:
        forces = np.where(points[:, 2] == _NO_FORCE, forces, points[:, 2])
    return Stroke(
        path_mm=_float32(points[:, :2]),
        force_n=_float32(forces),
        crayon=data["crayon"],
        tip=_tip(data["tip"], tip, f"{where}: tip") if "tip" in data else tip,
        note=data.get("note", Note.FILL),
        tilt_deg=_tilt(data["tilt"], len(points), f"{where}: tilt") if "tilt" in data else None,
    )


def _points(value: Any, where: str) -> NDArray[np.float64]:
    """A path as (n, 2) array, or (n, 3) with the force; its form is checked, its range is not."""
    if isinstance(value, np.ndarray):
        return value
    if not isinstance(value, list) or not value:
        raise ValueError(
            f"{where}: {shown(value)} is not a list of points like [[10, 20], [30, 20]]"
        )
    lengths = set(map(len, value)) if set(map(type, value)) == {list} else set()
    if not lengths or not lengths <= {2, 3}:
        i, bad = next(
            (i, p) for i, p in enumerate(value) if not isinstance(p, list) or len(p) not in (2, 3)
        )
        raise ValueError(f"{where}: point {i + 1}: {shown(bad)} is not [x, y] or [x, y, force]")
    flat = _float64(list(chain.from_iterable(value)))
    if flat is None:
        i, bad = next((i, v) for i, p in enumerate(value) for v in p if not is_number(v))
        raise ValueError(f"{where}: point {i + 1}: {shown(bad)} is not a finite number")
    if len(lengths) == 1:
        return flat.reshape(len(value), -1)
    return np.array([p if len(p) == 3 else [*p, _NO_FORCE] for p in value], np.float64)


def _forces(value: Any, count: int, where: str) -> NDArray[np.float64]:
    if not isinstance(value, list):
        return np.full(count, checks.number(value, 0.0, MAX_FORCE_N, where, "N"))
    if len(value) != count:
        raise ValueError(
            f"{where}: {len(value)} numbers for {count} points, give one number or one for each "
            "point"
        )
    forces = _float64(value)
    if forces is None:
        bad = next(v for v in value if not is_number(v))
        raise ValueError(f"{where}: {shown(bad)} is not a finite number")
    return forces


def _tilt(value: Any, count: int, where: str) -> NDArray[np.float32]:
    """Tilt and azimuth (count, 2), from one pair or one for each point."""
    pairs = value if isinstance(value, list) and value and isinstance(value[0], list) else [value]
    for pair in pairs:
        if not isinstance(pair, list) or len(pair) != 2 or not all(map(is_number, pair)):
            raise ValueError(f"{where}: {shown(pair)} is not [tilt, azimuth], in degrees")
    if len(pairs) not in (1, count):
        raise ValueError(
            f"{where}: {len(pairs)} pairs for {count} points, give one or one for each point"
        )
    return _float32(np.broadcast_to(np.array(pairs, np.float64), (count, 2)))


def _float64(values: list[Any]) -> NDArray[np.float64] | None:
    """The numbers as an array; None if one of them is no number or not finite."""
    if not set(map(type, values)) <= {int, float}:
        return None
    try:
        array = np.array(values, np.float64)
    except OverflowError:
        return None
    return array if np.isfinite(array).all() else None


def _float32(array: NDArray[np.float64]) -> NDArray[np.float32]:
    with np.errstate(over="ignore"):  # beyond float32 is beyond any sheet, and refused as such
        return np.ascontiguousarray(array, np.float32)


def _tip(data: Any, default: Tip, where: str) -> Tip:
    _object(data, _TIP_KEYS, where)
    tip = Tip(
        kind=data.get("kind", default.kind),
        width_mm=data.get("width_mm", default.width_mm),
        angle_deg=data.get("angle_deg", default.angle_deg),
    )
    check_tip(tip, where)
    return Tip(tip.kind, float(tip.width_mm), float(tip.angle_deg))


# ---- writing -------------------------------------------------------------------------------------


def drawing_to_json(drawing: Drawing) -> dict[str, Any]:
    """The drawing as a JSON object, rounded to 0.001 mm and 0.001 N.

    ValueError if the drawing breaks a rule of the file.
    """
    check_drawing(drawing, "drawing")
    tip = _usual_tip(drawing)
    return {
        **_header(drawing, tip),
        "strokes": [_stroke_object(stroke, tip) for stroke in drawing.strokes],
    }


def save_drawing(drawing: Drawing, path: str | os.PathLike[str]) -> None:
    """Write the drawing, one stroke a line; the same drawing always gives the same bytes.

    The file appears whole or not at all. ValueError if the drawing breaks a rule of the file,
    OSError naming `path` if it cannot be written.
    """
    check_drawing(drawing, "drawing")
    with whole_file(path) as part, open(part, "x", encoding="ascii", newline="\n") as file:
        file.writelines(_lines(drawing))


def _lines(drawing: Drawing) -> Iterator[str]:
    tip = _usual_tip(drawing)
    header = ",\n".join(
        f"{_dumped(key)}: {_dumped(value)}" for key, value in _header(drawing, tip).items()
    )
    yield f'{{{header},\n"strokes": ['
    for i, stroke in enumerate(drawing.strokes):
        yield (",\n" if i else "\n") + _stroke_line(stroke, tip)
    yield "\n]}\n"


def _usual_tip(drawing: Drawing) -> Tip:
    """The tip most strokes have, so that only the others need to name theirs."""
    counts = Counter(stroke.tip for stroke in drawing.strokes)
    return counts.most_common(1)[0][0] if counts else Tip()


def _header(drawing: Drawing, tip: Tip) -> dict[str, Any]:
    return {
        "format": FORMAT,
        "version": VERSION,
        "sheet_mm": [_rounded(drawing.width_mm), _rounded(drawing.height_mm)],
        "paper": drawing.paper,
        "palette": drawing.palette,
        "physics": drawing.physics,
        "seed": int(drawing.seed),
        "tip": _tip_object(tip),
    }


def _tip_object(tip: Tip) -> dict[str, Any]:
    return {
        "kind": tip.kind,
        "width_mm": _rounded(tip.width_mm),
        "angle_deg": _rounded(tip.angle_deg),
    }


def _stroke_object(stroke: Stroke, usual_tip: Tip) -> dict[str, Any]:
    forces = _thousandths(stroke.force_n).tolist()
    return {
        **_labels(stroke, usual_tip),
        "force": forces[0] if len(set(forces)) == 1 else forces,
        "path": _thousandths(stroke.path_mm).tolist(),
    }


def _stroke_line(stroke: Stroke, usual_tip: Tip) -> str:
    """The stroke object as text.

    %.7g writes thousandths up to 9999.999 exactly, in half the time of json.
    """
    forces = _thousandths(stroke.force_n)
    force = f"{forces[0]:.7g}"
    if (forces != forces[0]).any():
        force = "[" + ",".join(["%.7g"] * len(forces)) % tuple(forces.tolist()) + "]"
    points = _thousandths(stroke.path_mm)
    path = ",".join(["[%.7g,%.7g]"] * len(points)) % tuple(points.ravel().tolist())
    return f'{_dumped(_labels(stroke, usual_tip))[:-1]},"force":{force},"path":[{path}]}}'


def _labels(stroke: Stroke, usual_tip: Tip) -> dict[str, Any]:
    made: dict[str, Any] = {"crayon": stroke.crayon}
    if stroke.note != Note.FILL:
        made["note"] = stroke.note
    if stroke.tip != usual_tip:
        made["tip"] = _tip_object(stroke.tip)
    if stroke.tilt_deg is not None and stroke.tilt_deg[:, 0].any():
        tilt = _thousandths(stroke.tilt_deg)
        made["tilt"] = tilt[0].tolist() if (tilt == tilt[0]).all() else tilt.tolist()
    return made


def _rounded(value: float) -> float:
    return round(float(value), _DECIMALS) + 0.0


def _thousandths(array: NDArray[np.float32]) -> NDArray[np.float64]:
    return array.astype(np.float64).round(_DECIMALS) + 0.0  # no "-0"


def _dumped(value: Any) -> str:
    return json.dumps(value, separators=(",", ":"), sort_keys=isinstance(value, dict))
