"""Drawing: every stroke of a crayon drawing in drawing order, and its JSON file.

This is the seam of the program: strokes are planned on one side and rubbed onto paper on the other, and a
Drawing can be saved, loaded, written by hand or made by another program in between. All geometry is in
millimetres on the sheet, x to the right, y down; all forces are in newton.

The file holds one stroke a line:

    {"format": "crayonize drawing", "version": 1, "sheet_mm": [297, 210],
     "paper": "smooth", "palette": "box24", "physics": "metric", "seed": 1,
     "tip": {"kind": "blunt", "width_mm": 2.4}, "force": 1.5,
     "strokes": [
       {"crayon": "red", "path": [[10, 10], [40, 12.5]]},
       {"crayon": "blue", "path": [[5, 5, 0.8], [9, 5, 2.1]], "tip": {"kind": "sharp"}, "note": "line"}]}

`tip` and `force` at the top are what strokes without their own get. A stroke's force is one number or one for
each point; a third number in a point is the force there and wins. physics, seed, tip, force and note may be
left out. Whether paper, palette and crayons exist is for the program that draws to say.
"""

import contextlib
import difflib
import json
import math
import os
import secrets
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any, TextIO, TypeVar

import numpy as np
from numpy.typing import NDArray

FORMAT = "crayonize drawing"
VERSION = 1
TIP_KINDS = ("sharp", "blunt", "rim", "side")
DEFAULT_FORCE_N = 1.5
MAX_FORCE_N = 100.0
MAX_SHEET_MM = 5000.0
MAX_TIP_MM = 200.0
MAX_STROKES = 2_000_000
MAX_POINTS = 50_000_000
MAX_CHARS = 1_500_000_000  # 50 million points, each with a force, at full length
MAX_SEED = 2**63 - 1
MAX_LABEL = 1000

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
_STROKE_KEYS = ("crayon", "path", "force", "tip", "note")
_TIP_KEYS = ("kind", "width_mm", "angle_deg")
_CHUNK = 2**20
_DECIMALS = 3  # a micrometre, a thousandth of a newton
_NO_FORCE = -math.inf  # stands where a point among [x, y, force] points has no force of its own

T = TypeVar("T")


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


@dataclass(frozen=True, eq=False)
class Stroke:
    """One movement of one crayon over the paper; a single point is a dab.

    path_mm: (n, 2) float32, x and y.   force_n: (n,) float32, how hard the crayon is pressed at each point.
    crayon: its name in the palette.   note: what the stroke is for ("fill", "line", "detail", ...).
    """

    path_mm: NDArray[np.float32]
    force_n: NDArray[np.float32]
    crayon: str
    tip: Tip
    note: str = "fill"


@dataclass(frozen=True, eq=False)
class Drawing:
    """A sheet of paper and the strokes on it, first stroke first.

    paper, palette: the name of one, or its content as a JSON object.   physics: the units of the wax model.
    seed: what the paper and every chance in the wax are drawn from.
    """

    width_mm: float
    height_mm: float
    paper: str | dict[str, Any]
    palette: str | dict[str, Any]
    strokes: tuple[Stroke, ...]
    physics: str = "metric"
    seed: int = 0


# ---- reading ---------------------------------------------------------------------------------------------


def load_drawing(source: str | os.PathLike[str] | TextIO) -> Drawing:
    """Read a drawing file, by path or from an open text stream.

    ValueError, one line, naming the file, the stroke (counted from 1) and the field that is wrong.
    """
    if not isinstance(source, str | os.PathLike):
        return _read(source, _printable(str(getattr(source, "name", "drawing"))))
    where = _printable(os.fspath(source))
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
    return drawing_from_json(_parsed("".join(parts), where), where)


def _parsed(text: str, where: str) -> Any:
    try:
        return json.loads(text, object_pairs_hook=_compacted)
    except json.JSONDecodeError as error:
        raise ValueError(f"{where}: line {error.lineno}, column {error.colno}: not JSON ({error.msg})") from error
    except RecursionError as error:
        raise ValueError(f"{where}: nested too deeply to be a drawing") from error
    except _RepeatedKey as error:
        raise ValueError(f"{where}: {error}") from error
    except ValueError as error:
        raise ValueError(f"{where}: a whole number with thousands of digits") from error


class _RepeatedKey(ValueError):
    """The same key twice in one JSON object."""


def _compacted(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """A JSON object, its path already an array if it is sound: as lists it takes ten times the memory."""
    made = dict(pairs)
    if len(made) < len(pairs):
        twice = Counter(key for key, _ in pairs).most_common(1)[0][0]
        raise _RepeatedKey(f"the key {_shown(twice)} stands twice in one object")
    if "path" in made:
        with contextlib.suppress(ValueError):
            made["path"] = _points(made["path"], "")
    return made


def drawing_from_json(obj: Any, where: str = "drawing") -> Drawing:
    """The drawing a parsed JSON object describes.

    where: what every error message begins with, such as the file name. ValueError as in load_drawing.
    """
    _check_object(obj, _DRAWING_KEYS, where)
    for key in ("format", "version", "sheet_mm", "paper", "palette", "strokes"):
        if key not in obj:
            raise ValueError(f'{where}: "{key}" is missing')
    if obj["format"] != FORMAT:
        raise ValueError(f'{where}: format: {_shown(obj["format"])} is not "{FORMAT}"')
    if obj["version"] != VERSION or isinstance(obj["version"], bool):
        raise ValueError(f"{where}: version: {_shown(obj['version'])} is not {VERSION}, the one this program reads")
    given = _as(list, obj["strokes"], f"{where}: strokes", 'a list like [{"crayon": "red", "path": [[1, 2]]}]')
    _check_count("strokes", len(given), MAX_STROKES, where)
    tip = _tip(obj.get("tip", {}), Tip(), f"{where}: tip")
    force = _number(obj.get("force", DEFAULT_FORCE_N), 0.0, MAX_FORCE_N, "N", f"{where}: force")
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


def _place(where: str, index: int, stroke: Any) -> str:
    crayon = stroke.get("crayon") if isinstance(stroke, dict) else None
    return f"{where}: stroke {index + 1}" + (f" ({_shown(crayon)[1:-1]})" if isinstance(crayon, str) else "")


def _sheet(value: Any, where: str) -> tuple[float, float]:
    if not isinstance(value, list) or len(value) != 2:
        raise ValueError(f"{where}: sheet_mm: {_shown(value)} is not [width, height]")
    width, height = (_number(v, 1.0, MAX_SHEET_MM, "mm", f"{where}: sheet_mm") for v in value)
    return width, height


def _stroke(data: Any, tip: Tip, force: float, where: str) -> Stroke:
    _check_object(data, _STROKE_KEYS, where)
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
        note=data.get("note", "fill"),
    )


def _points(value: Any, where: str) -> NDArray[np.float64]:
    """A path as (n, 2) array, or (n, 3) with the force; its form is checked, its range is not."""
    if isinstance(value, np.ndarray):
        return value
    if not isinstance(value, list) or not value:
        raise ValueError(f"{where}: {_shown(value)} is not a list of points like [[10, 20], [30, 20]]")
    lengths = set(map(len, value)) if set(map(type, value)) == {list} else set()
    if not lengths or not lengths <= {2, 3}:
        i, bad = next((i, p) for i, p in enumerate(value) if not isinstance(p, list) or len(p) not in (2, 3))
        raise ValueError(f"{where}: point {i + 1}: {_shown(bad)} is not [x, y] or [x, y, force]")
    flat = _float64(list(chain.from_iterable(value)))
    if flat is None:
        i, bad = next((i, v) for i, p in enumerate(value) for v in p if not _is_number(v))
        raise ValueError(f"{where}: point {i + 1}: {_shown(bad)} is not a finite number")
    if len(lengths) == 1:
        return flat.reshape(len(value), -1)
    return np.array([p if len(p) == 3 else [*p, _NO_FORCE] for p in value], np.float64)


def _forces(value: Any, count: int, where: str) -> NDArray[np.float64]:
    if not isinstance(value, list):
        return np.full(count, _number(value, 0.0, MAX_FORCE_N, "N", where))
    if len(value) != count:
        raise ValueError(f"{where}: {len(value)} numbers for {count} points, give one number or one for each point")
    forces = _float64(value)
    if forces is None:
        bad = next(v for v in value if not _is_number(v))
        raise ValueError(f"{where}: {_shown(bad)} is not a finite number")
    return forces


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
    _check_object(data, _TIP_KEYS, where)
    tip = Tip(
        kind=data.get("kind", default.kind),
        width_mm=data.get("width_mm", default.width_mm),
        angle_deg=data.get("angle_deg", default.angle_deg),
    )
    _check_tip(tip, where)
    return Tip(tip.kind, float(tip.width_mm), float(tip.angle_deg))


# ---- writing ---------------------------------------------------------------------------------------------


def drawing_to_json(drawing: Drawing) -> dict[str, Any]:
    """The drawing as a JSON object, rounded to 0.001 mm and 0.001 N.

    ValueError if the drawing breaks a rule of the file.
    """
    check_drawing(drawing, "drawing")
    tip = _usual_tip(drawing)
    return {**_header(drawing, tip), "strokes": [_stroke_object(stroke, tip) for stroke in drawing.strokes]}


def save_drawing(drawing: Drawing, path: str | os.PathLike[str]) -> None:
    """Write the drawing, one stroke a line; the same drawing always gives the same bytes.

    The file appears whole or not at all. ValueError if the drawing breaks a rule of the file, OSError naming
    `path` if it cannot be written.
    """
    check_drawing(drawing, "drawing")
    target = Path(path)
    temporary = target.with_name(f".crayonize-{secrets.token_hex(8)}.tmp")
    try:
        try:
            with open(temporary, "x", encoding="ascii", newline="\n") as file:
                file.writelines(_lines(drawing))
                file.flush()
                os.fsync(file.fileno())
            os.replace(temporary, target)
        except BaseException:
            temporary.unlink(missing_ok=True)
            raise
    except OSError as error:
        raise OSError(error.errno, error.strerror, os.fspath(path)) from error


def _lines(drawing: Drawing) -> Iterator[str]:
    tip = _usual_tip(drawing)
    header = ",\n".join(f"{_dumped(key)}: {_dumped(value)}" for key, value in _header(drawing, tip).items())
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
    return {"kind": tip.kind, "width_mm": _rounded(tip.width_mm), "angle_deg": _rounded(tip.angle_deg)}


def _stroke_object(stroke: Stroke, usual_tip: Tip) -> dict[str, Any]:
    forces = _thousandths(stroke.force_n).tolist()
    return {
        **_labels(stroke, usual_tip),
        "force": forces[0] if len(set(forces)) == 1 else forces,
        "path": _thousandths(stroke.path_mm).tolist(),
    }


def _stroke_line(stroke: Stroke, usual_tip: Tip) -> str:
    """The stroke object as text. %.7g writes thousandths up to 9999.999 exactly, in half the time of json."""
    forces = _thousandths(stroke.force_n)
    force = f"{forces[0]:.7g}"
    if (forces != forces[0]).any():
        force = "[" + ",".join(["%.7g"] * len(forces)) % tuple(forces.tolist()) + "]"
    points = _thousandths(stroke.path_mm)
    path = ",".join(["[%.7g,%.7g]"] * len(points)) % tuple(points.ravel().tolist())
    return f'{_dumped(_labels(stroke, usual_tip))[:-1]},"force":{force},"path":[{path}]}}'


def _labels(stroke: Stroke, usual_tip: Tip) -> dict[str, Any]:
    made: dict[str, Any] = {"crayon": stroke.crayon}
    if stroke.note != "fill":
        made["note"] = stroke.note
    if stroke.tip != usual_tip:
        made["tip"] = _tip_object(stroke.tip)
    return made


def _rounded(value: float) -> float:
    return round(float(value), _DECIMALS) + 0.0


def _thousandths(array: NDArray[np.float32]) -> NDArray[np.float64]:
    return array.astype(np.float64).round(_DECIMALS) + 0.0  # no "-0"


def _dumped(value: Any) -> str:
    return json.dumps(value, separators=(",", ":"), sort_keys=isinstance(value, dict))


# ---- checks ----------------------------------------------------------------------------------------------


def check_drawing(drawing: Drawing, where: str) -> None:
    """ValueError naming the field, and the stroke counted from 1, that breaks a rule of the drawing file."""
    width = _number(drawing.width_mm, 1.0, MAX_SHEET_MM, "mm", f"{where}: sheet_mm")
    height = _number(drawing.height_mm, 1.0, MAX_SHEET_MM, "mm", f"{where}: sheet_mm")
    _check_named(drawing.paper, f"{where}: paper")
    _check_named(drawing.palette, f"{where}: palette")
    _check_label(drawing.physics, f"{where}: physics")
    if type(drawing.seed) is not int or not 0 <= drawing.seed <= MAX_SEED:
        raise ValueError(f"{where}: seed: {_shown(drawing.seed)} is not a whole number from 0 to 2^63 - 1")
    _check_count("strokes", len(drawing.strokes), MAX_STROKES, where)
    _check_count("points", sum(len(stroke.path_mm) for stroke in drawing.strokes), MAX_POINTS, where)
    for i, stroke in enumerate(drawing.strokes):
        _check_stroke(stroke, width, height, f"{where}: stroke {i + 1}")


def _check_stroke(stroke: Stroke, width_mm: float, height_mm: float, where: str) -> None:
    _check_label(stroke.crayon, f"{where}: crayon")
    where = f"{where} ({_shown(stroke.crayon)[1:-1]})"
    _check_label(stroke.note, f"{where}: note")
    _check_tip(stroke.tip, f"{where}: tip")
    path, force = stroke.path_mm, stroke.force_n
    if path.ndim != 2 or path.shape[1] != 2 or len(path) == 0 or force.shape != (len(path),):
        raise ValueError(f"{where}: path {path.shape} and force {force.shape} are not of shapes (n, 2) and (n,)")
    for axis, size in enumerate((width_mm, height_mm)):
        _check_range(path[:, axis], -size, 2 * size, 0.002, f"{where}: path", f"{'xy'[axis]} =", "mm")
    _check_range(force, 0.0, MAX_FORCE_N, 0.0, f"{where}: force", "force =", "N")


def _check_range(
    values: NDArray[np.float32], low: float, high: float, slack: float, where: str, what: str, unit: str
) -> None:
    """slack: what rounding the sheet and the point to thousandths may add."""
    if low - slack <= values.min() and values.max() <= high + slack:
        return
    i = int(np.argmin((values >= low - slack) & (values <= high + slack)))
    raise ValueError(f"{where}: point {i + 1}: {what} {values[i]:g} is not from {low:g} to {high:g} {unit}")


def _check_tip(tip: Tip, where: str) -> None:
    if tip.kind not in TIP_KINDS:
        near = _nearest(str(tip.kind), TIP_KINDS)
        raise ValueError(f"{where}: kind: {_shown(tip.kind)} is no kind of tip{near}")
    _number(tip.width_mm, 0.1, MAX_TIP_MM, "mm", f"{where}: width_mm")
    _number(tip.angle_deg, -360.0, 360.0, "degrees", f"{where}: angle_deg")


def _check_object(value: Any, keys: Sequence[str], where: str) -> None:
    for key in _as(dict, value, where, "an object with " + ", ".join(keys)):
        if key not in keys:
            raise ValueError(f"{where}: unknown key {_shown(key)}{_nearest(key, keys)}")


def _check_named(value: Any, where: str) -> None:
    if not isinstance(value, dict):
        _check_label(value, where)
        return
    try:
        json.dumps(value, allow_nan=False, sort_keys=True)
    except (TypeError, ValueError, RecursionError) as error:
        raise ValueError(f"{where}: not a JSON object of text and finite numbers") from error


def _check_label(value: Any, where: str) -> None:
    if not isinstance(value, str) or not value or len(value) > MAX_LABEL or not value.isprintable():
        raise ValueError(f"{where}: {_shown(value)} is not text of 1 to {MAX_LABEL} printable characters")


def _check_count(what: str, count: int, most: int, where: str) -> None:
    if count > most:
        raise ValueError(f"{where}: {count:,} {what}, a drawing has at most {most:,}")


def _as(kind: type[T], value: Any, where: str, right: str) -> T:
    if isinstance(value, kind):
        return value
    raise ValueError(f"{where}: {_shown(value)} is not {right}")


def _number(value: Any, low: float, high: float, unit: str, where: str) -> float:
    if not _is_number(value) or not low <= value <= high:
        raise ValueError(f"{where}: {_shown(value)} is not a number from {low:g} to {high:g} {unit}")
    return float(value)


def _is_number(value: Any) -> bool:
    """A finite number, Python's or numpy's, and no bool."""
    if isinstance(value, bool) or not isinstance(value, int | float | np.number):
        return False
    return bool(-1e300 < value < 1e300)


def _nearest(name: str, known: Sequence[str]) -> str:
    near = difflib.get_close_matches(name[:60].lower(), list(known), n=1)
    return f', did you mean "{near[0]}"?' if near else f" (valid: {', '.join(known)})"


def _shown(value: Any) -> str:
    """A wrong value as a reader of the message would write it: short, printable, on one line."""
    if isinstance(value, str):
        return '"' + _printable(value if len(value) <= 60 else value[:57] + "...") + '"'
    if isinstance(value, int) and abs(value) > 10**15:
        return "a huge number"
    if isinstance(value, list):
        return f"a list of {len(value)}"
    kinds = {dict: "an object", type(None): "nothing"}
    return kinds.get(type(value)) or str(value).lower()


def _printable(text: str) -> str:
    return text if text.isprintable() else repr(text)[1:-1]
