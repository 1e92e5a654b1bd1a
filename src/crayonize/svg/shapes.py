"""What an SVG file draws: its shapes as polylines on the sheet, each with the colours and widths it
ends up with.

Understood: path, line, polyline, polygon, rect, circle, ellipse; g, a, switch, use, symbol and
nested svg; transforms, viewBox, units, presentation attributes, simple style sheets, opacity,
gradients (as their mean colour). Left out: text, pictures, filters, masks, clipping, patterns,
markers, dashes.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from .elements import MAX_DEPTH, Element, declarations, style_rules
from .path import Outline, outlines

MAX_POINTS = 1_000_000
MAX_LINES = 50_000
MAX_USES = 10_000
MM = {"mm": 1.0, "cm": 10.0, "in": 25.4, "pt": 25.4 / 72, "pc": 25.4 / 6, "q": 0.25}
PX_MM = 25.4 / 96
PX_PER = {unit: mm / PX_MM for unit, mm in MM.items()} | {"": 1.0, "px": 1.0}
SMALLEST_MM, LARGEST_MM = 10.0, 2000.0  # long side of a sheet whose size stands in the file

Floats = NDArray[np.float64]
RGB = tuple[float, float, float]

_INHERITED = (
    "fill",
    "stroke",
    "stroke-width",
    "fill-opacity",
    "stroke-opacity",
    "fill-rule",
    "color",
    "visibility",
    "data-crayon",
    "data-tip",
    "data-angle",
    "data-note",
)
_GROUPS = ("g", "a", "switch", "svg", "symbol", "use")
_SHAPES = ("path", "line", "polyline", "polygon", "rect", "circle", "ellipse")
_SIDES = ("x", "y", "width", "height", "rx", "ry", "cx", "cy", "r", "x1", "y1", "x2", "y2")
_NUMBER = re.compile(r"([+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)\s?([a-zA-Z%]*)")
_CALL = re.compile(r"(matrix|translate|scale|rotate|skewX|skewY)\s*\(([^()]*)\)")
_TAKES = {
    "matrix": (6,),
    "translate": (1, 2),
    "scale": (1, 2),
    "rotate": (1, 3),
    "skewX": (1,),
    "skewY": (1,),
}
_HSLA = re.compile(r"hsla?\(\s*([0-9.]+\s*,\s*[0-9.]+%\s*,\s*[0-9.]+%)\s*,\s*([0-9.]+)(%?)\s*\)")
_RGB = re.compile(r"rgba?\(\s*([0-9.]+%?(?:[\s,/]+[0-9.]+%?){2,3})\s*\)")
_PART = re.compile(r"([0-9]+(?:\.[0-9]*)?|\.[0-9]+)(%?)")


@dataclass
class Shape:
    """One shape on the sheet. lines: (n, 2) in mm each; colours are sRGB 0..1, None for none."""

    lines: list[Floats]
    stroke: RGB | None
    width_mm: float
    stroke_opacity: float
    fill: RGB | None
    fill_opacity: float
    even_odd: bool
    data: Mapping[str, str]  # data-force, data-crayon, data-tip, data-angle, data-note


@dataclass
class Page:
    """A sheet and the shapes on it, first to last.

    left_out: how many elements were not understood, by tag.
    """

    width_mm: float
    height_mm: float
    shapes: list[Shape]
    left_out: dict[str, int] = field(default_factory=dict)


def page(root: Element, long_mm: float) -> Page:
    """The shapes of an SVG file. long_mm: long side of the sheet if the file does not say how large
    it is.

    ValueError, without the name of the file before it, for what cannot be drawn.
    """
    fitted = _fit(root, long_mm)
    if fitted is None:  # no size and no viewBox: what is drawn fills the sheet
        loose = _Walk(root, np.eye(3)).shapes
        points = np.concatenate(
            [line for shape in loose for line in shape.lines] or [np.zeros((1, 2))]
        )
        low, high = points.min(0), points.max(0)
        root.attributes["viewBox"] = " ".join(
            map(repr, [*low.tolist(), *np.maximum(high - low, 1e-3).tolist()])
        )
        fitted = _fit(root, long_mm)
        assert fitted
    width, height, matrix = fitted
    walk = _Walk(root, matrix)
    return Page(width, height, walk.shapes, walk.left_out)


# ---- the sheet -----------------------------------------------------------------------------------


def _fit(root: Element, long_mm: float) -> tuple[float, float, Floats] | None:
    """Width and height in mm, and the matrix from user units to mm; None if the file gives no size
    at all.
    """
    box = _view_box(root.attributes.get("viewBox"))
    across, down = _size(root, "width"), _size(root, "height")
    if box is None:
        if not across or not down:
            return None
        box = (0.0, 0.0, across[0] / PX_MM, down[0] / PX_MM)
    wide = across[0] if across and across[1] else None
    high = down[0] if down and down[1] else None
    if wide or high:
        width = wide or (high or 0) * box[2] / box[3]
        height = high or width * box[3] / box[2]
        if not SMALLEST_MM <= max(width, height) <= LARGEST_MM or min(width, height) < 1:
            raise ValueError(f"the sheet is {width:.4g} x {height:.4g} mm; its long side must be "
                             f"{SMALLEST_MM:g} to {LARGEST_MM:g} mm")  # fmt: skip
    else:
        width, height = (long_mm * side / max(box[2:]) for side in box[2:])
        if min(width, height) < 1:
            raise ValueError(f"the sheet is {box[2]:.4g} x {box[3]:.4g}, too narrow to draw on")
    return (
        width,
        height,
        _view_matrix(box, 0, 0, width, height, root.attributes.get("preserveAspectRatio", "")),
    )


def _size(root: Element, name: str) -> tuple[float, bool] | None:
    """Width or height in mm, and whether in a unit of paper; None if absent or relative."""
    text = root.attributes.get(name, "100%")
    if text.strip() == "auto":
        return None
    found = _NUMBER.fullmatch(text.strip())
    unit = found[2].lower() if found else ""
    if found is None or unit not in (*MM, "", "px", "%", "em", "ex", "rem"):
        raise ValueError(f"{name} is {text[:40]!r}; it must be a length like 210mm")
    if unit in ("%", "em", "ex", "rem"):
        return None
    size = float(found[1]) * MM.get(unit, PX_MM)
    if not 0 < size < math.inf:
        raise ValueError(f"{name} is {text[:40]!r}; it must be larger than 0 and finite")
    return size, unit in MM


def _view_box(text: str | None) -> tuple[float, float, float, float] | None:
    if not text or not text.strip():
        return None
    try:
        x, y, width, height = (float(part) for part in text.replace(",", " ").split())
    except ValueError:
        raise ValueError(f"viewBox is {text[:40]!r}; it must be four numbers") from None
    if (
        not all(map(math.isfinite, (x, y, width, height)))
        or not 1e-9 < min(width, height) <= max(width, height) < 1e9
    ):
        raise ValueError(
            f"viewBox is {text[:40]!r}; its sides must be larger than 0 and of a usual size"
        )
    return x, y, width, height


def _view_matrix(
    box: tuple[float, float, float, float],
    x: float,
    y: float,
    width: float,
    height: float,
    aspect: str,
) -> Floats:
    """From the units of a viewBox into a rectangle; as a rule as large as fits, in the middle."""
    sx, sy = width / box[2], height / box[3]
    if not aspect.strip().startswith("none"):
        sx = sy = max(sx, sy) if "slice" in aspect else min(sx, sy)
    shift = [
        0.0 if f"{axis}Min" in aspect else 1.0 if f"{axis}Max" in aspect else 0.5 for axis in "xY"
    ]
    tx = x + shift[0] * (width - sx * box[2]) - sx * box[0]
    ty = y + shift[1] * (height - sy * box[3]) - sy * box[1]
    return np.array([[sx, 0, tx], [0, sy, ty], [0, 0, 1]], np.float64)


# ---- the elements --------------------------------------------------------------------------------


class _Walk:
    """Goes through the elements in drawing order, carrying transforms and styles down."""

    def __init__(self, root: Element, matrix: Floats) -> None:
        self.rules = style_rules(root)
        self.ids: dict[str, Element] = {}
        self.shapes: list[Shape] = []
        self.left_out: dict[str, int] = {}
        self.used = self.points = self.lines = 0
        self._outlines: dict[int, list[Outline]] = {}
        self._name(root)
        style = self._style(
            root, {"fill": "black", "stroke": "none", "stroke-width": "1", "color": "black"}
        )
        for child in root.children:
            self._visit(child, matrix, style, _opacity(style), 1)

    def _name(self, root: Element) -> None:
        waiting = [root]
        while waiting:
            element = waiting.pop()
            waiting += element.children
            if "id" in element.attributes:
                self.ids[element.attributes["id"]] = element

    def _visit(
        self, element: Element, matrix: Floats, above: Mapping[str, str], opacity: float, depth: int
    ) -> None:
        if depth > MAX_DEPTH:
            raise ValueError(
                f"nested deeper than {MAX_DEPTH} elements, or a <use> that leads back to itself"
            )
        if element.tag in ("text", "image", "foreignObject"):
            self.left_out[element.tag] = self.left_out.get(element.tag, 0) + 1
        if element.tag not in _GROUPS + _SHAPES or (
            element.tag == "symbol" and above.get("through") != "use"
        ):
            return
        style = self._style(element, above)
        opacity *= _opacity(style)
        if style.get("display") == "none" or opacity < 0.02:
            return
        matrix = _product(
            matrix, transform(element.attributes.get("transform") or style.get("transform", ""))
        )
        if element.tag in _SHAPES:
            if style.get("visibility") not in ("hidden", "collapse"):
                self._add(element, matrix, style, opacity)
        elif element.tag == "use":
            self.used += 1
            if self.used > MAX_USES:
                raise ValueError(f"more than {MAX_USES:,} <use> to follow")
            x, y = (_length(element.attributes.get(axis, "0")) for axis in "xy")
            target = self.ids.get(element.attributes.get("href", "")[1:])
            if target is not None:
                self._visit(
                    target,
                    _product(matrix, _moved(x, y)),
                    {**style, "through": "use"},
                    opacity,
                    depth + 1,
                )
        else:
            matrix = _product(matrix, _inner(element))
            for child in element.children:
                self._visit(child, matrix, style, opacity, depth + 1)

    def _style(self, element: Element, above: Mapping[str, str]) -> dict[str, str]:
        """The properties of an element: inherited, then its attributes, the style sheet's, its own
        style.
        """
        own = dict(element.attributes)
        names = element.attributes.get("class", "").split()
        selectors = [
            "*",
            element.tag,
            *(f".{n}" for n in names),
            *(f"{element.tag}.{n}" for n in names),
        ]
        for selector in (*selectors, f"#{element.attributes.get('id', '')}"):
            own.update(self.rules.get(selector, {}))
        own.update(declarations(element.attributes.get("style", "")))
        inherited = {key: above[key] for key in _INHERITED if key in above}
        return {**inherited, **{key: value for key, value in own.items() if value != "inherit"}}

    def _add(
        self, element: Element, matrix: Floats, style: Mapping[str, str], opacity: float
    ) -> None:
        stroke, fill = self._colour(style, "stroke"), self._colour(style, "fill")
        width = _length(style.get("stroke-width", "1")) * _scale(matrix)
        stroke = stroke if width > 0 else None
        if element.tag == "line" or (stroke is None and fill is None):
            fill = None
            if stroke is None:
                return
        if not math.isfinite(width):
            raise ValueError(f"<{element.tag}> has a stroke-width beyond all bounds")
        outline = self._outline(element)
        self.lines += len(outline)
        if self.lines > MAX_LINES:
            raise ValueError(f"more than {MAX_LINES:,} lines")
        lines = [part.polyline(matrix) for part in outline]
        self.points += sum(map(len, lines))
        if self.points > MAX_POINTS:
            raise ValueError(f"more than {MAX_POINTS:,} points")
        if not all(np.isfinite(line).all() for line in lines):
            raise ValueError(f"<{element.tag}> has a coordinate beyond all bounds")
        stroke_opacity, fill_opacity = (
            opacity * _alpha(style, name) for name in ("stroke", "fill")
        )
        data = {key: value for key, value in style.items() if key.startswith("data-")}
        if lines:
            self.shapes.append(
                Shape(
                    lines,
                    stroke,
                    width,
                    stroke_opacity,
                    fill if fill_opacity > 0.02 else None,
                    fill_opacity,
                    style.get("fill-rule") == "evenodd",
                    data,
                )
            )

    def _outline(self, element: Element) -> list[Outline]:
        """Subpaths of an element in its own units; kept, as <use> may come back."""
        if id(element) not in self._outlines:
            self._outlines[id(element)] = outlines(_path_data(element))
        return self._outlines[id(element)]

    def _colour(self, style: Mapping[str, str], name: str) -> RGB | None:
        """sRGB of a fill or stroke; of a gradient the mean of its stops."""
        text = style.get(name, "none").strip()
        if text.lower() == "currentcolor":
            text = style.get("color", "black")
        if text.startswith("url("):
            inside, _, otherwise = text[4:].partition(")")
            stops = self._stops(inside.strip("'\" #"))
            found = [c for c in (_rgb(s) for s in stops) if c]
            if found:
                return tuple(np.mean(found, 0).tolist())
            text = otherwise.strip() or "none"
        return _rgb(text)

    def _stops(self, name: str) -> list[str]:
        for _ in range(10):  # a gradient may take its stops from another
            element = self.ids.get(name)
            if element is None:
                break
            styles = (self._style(child, {}) for child in element.children if child.tag == "stop")
            if stops := [style.get("stop-color", "black") for style in styles]:
                return stops
            name = element.attributes.get("href", "")[1:]
        return []


def _inner(element: Element) -> Floats:
    """What a nested svg or symbol does to the units of its children."""
    box = _view_box(element.attributes.get("viewBox")) if element.tag in ("svg", "symbol") else None
    x, y = (
        _length(element.attributes.get(axis, "0")) if element.tag == "svg" else 0.0 for axis in "xy"
    )
    if box is None:
        return _moved(x, y)
    width = _length(element.attributes.get("width", ""), box[2])
    height = _length(element.attributes.get("height", ""), box[3])
    return _view_matrix(box, x, y, width, height, element.attributes.get("preserveAspectRatio", ""))


def _moved(x: float, y: float) -> Floats:
    return np.array([[1, 0, x], [0, 1, y], [0, 0, 1]], np.float64)


def _scale(matrix: Floats) -> float:
    """By how much a matrix enlarges lengths, in the mean over directions."""
    return math.sqrt(abs(float(matrix[0, 0] * matrix[1, 1] - matrix[0, 1] * matrix[1, 0])))


def _product(a: Floats, b: Floats) -> Floats:
    with np.errstate(over="ignore", invalid="ignore"):
        made = np.asarray(a @ b)
    if not np.isfinite(made).all():
        raise ValueError("transforms multiply to numbers beyond all bounds")
    return made


def transform(text: str) -> Floats:
    """The matrix of a transform attribute (SVG 1.1, 7.6)."""
    matrix = np.eye(3)
    rest = _CALL.sub("", text).strip(" ,\t\r\n")
    for name, inside in _CALL.findall(text):
        try:
            v = [float(part) * PX_PER.get(unit, 1.0) for part, unit in _NUMBER.findall(inside)]
            matrix = _product(matrix, _call(name, *v))
        except (TypeError, OverflowError):
            rest = text
    if rest and rest != "none":
        raise ValueError(f"transform is {text[:40]!r}; it cannot be understood")
    return matrix


def _call(name: str, *v: float) -> Floats:
    if len(v) not in _TAKES[name]:
        raise TypeError
    if name == "matrix":
        a, b, c, d, e, f = v
        return np.array([[a, c, e], [b, d, f], [0, 0, 1]], np.float64)
    if name == "translate":
        return _moved(*(*v, 0.0)[:2])
    if name == "scale":
        return np.diag([v[0], (*v, v[0])[1], 1.0])
    angle = math.radians(v[0])
    if name == "rotate":
        x, y = v[1:] or (0.0, 0.0)
        turn = np.array(
            [
                [math.cos(angle), -math.sin(angle), 0],
                [math.sin(angle), math.cos(angle), 0],
                [0, 0, 1],
            ]
        )
        return np.asarray(_moved(x, y) @ turn @ _moved(-x, -y))
    slant = math.tan(angle)
    return np.array(
        [
            [1, slant if name == "skewX" else 0, 0],
            [slant if name == "skewY" else 0, 1, 0],
            [0, 0, 1],
        ]
    )


def _length(text: str, otherwise: float = 0.0) -> float:
    """A length in user units (px); relative ones are not understood and count as `otherwise`."""
    found = _NUMBER.fullmatch(text.strip())
    if not found or found[2] in ("%", "em", "ex"):
        return otherwise
    return float(found[1]) * PX_PER.get(found[2].lower(), 1.0)


def _opacity(style: Mapping[str, str]) -> float:
    return min(max(_length(style.get("opacity", "1"), 1.0), 0.0), 1.0)


def _alpha(style: Mapping[str, str], name: str) -> float:
    """The opacity of a fill or stroke, with that of its colour."""
    own = min(max(_length(style.get(f"{name}-opacity", "1"), 1.0), 0.0), 1.0)
    colour = _rgba(style.get(name, ""))
    return own * (colour[3] if colour else 1.0)


def _rgba(text: str) -> tuple[float, float, float, float] | None:
    """A CSS colour as sRGB and opacity, 0..1; None for none and for what is no colour."""
    from PIL import ImageColor

    text = text.strip().lower()
    if found := _RGB.fullmatch(text):
        full = (255, 255, 255, 1)
        parts = [
            float(n) / (100 if unit else f)
            for f, (n, unit) in zip(full, _PART.findall(found[1]), strict=False)
        ]
        r, g, b, a = (min(part, 1.0) for part in (*parts, 1.0)[:4])
        return r, g, b, a
    if found := _HSLA.fullmatch(text):
        alpha = float(found[2]) / (100 if found[3] else 1)
        r, g, b = (code / 255 for code in ImageColor.getrgb(f"hsl({found[1]})")[:3])
        return r, g, b, min(alpha, 1.0)
    try:
        codes = (*ImageColor.getrgb(text), 255)
    except ValueError:
        return None
    return codes[0] / 255, codes[1] / 255, codes[2] / 255, codes[3] / 255


def _rgb(text: str) -> RGB | None:
    colour = _rgba(text)
    return colour[:3] if colour and colour[3] > 0 else None


# ---- shapes as paths -----------------------------------------------------------------------------


def _path_data(element: Element) -> str:
    """Any shape as path data."""
    given = element.attributes
    if element.tag == "path":
        return given.get("d", "")
    if element.tag in ("polyline", "polygon"):
        return f"M{given.get('points', '')}" + ("Z" if element.tag == "polygon" else "")
    value = {key: _length(given[key]) for key in _SIDES if key in given}
    get = value.get
    if element.tag == "line":
        return f"M{get('x1', 0)},{get('y1', 0)}L{get('x2', 0)},{get('y2', 0)}"
    if element.tag == "rect":
        return _rectangle(
            get("x", 0.0),
            get("y", 0.0),
            get("width", 0.0),
            get("height", 0.0),
            get("rx"),
            get("ry"),
        )
    rx, ry = (get("r", 0.0),) * 2 if element.tag == "circle" else (get("rx", 0.0), get("ry", 0.0))
    if min(rx, ry) <= 0:
        return ""
    x, y = get("cx", 0.0), get("cy", 0.0)
    return f"M{x - rx},{y}A{rx},{ry} 0 0 1 {x + rx},{y}A{rx},{ry} 0 0 1 {x - rx},{y}Z"


def _rectangle(
    x: float, y: float, width: float, height: float, rx: float | None, ry: float | None
) -> str:
    if min(width, height) <= 0:
        return ""
    rx = min(max(rx if rx is not None else ry or 0.0, 0.0), width / 2)
    ry = min(max(ry if ry is not None else rx, 0.0), height / 2)
    if not rx or not ry:
        return f"M{x},{y}h{width}v{height}h{-width}Z"
    turn = f"a{rx},{ry} 0 0 1 "
    return (f"M{x + rx},{y}h{width - 2 * rx}{turn}{rx},{ry}v{height - 2 * ry}{turn}{-rx},{ry}"
            f"h{2 * rx - width}{turn}{-rx},{-ry}v{2 * ry - height}{turn}{rx},{-ry}Z")  # fmt: skip
