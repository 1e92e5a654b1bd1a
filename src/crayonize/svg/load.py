"""Lines other people drew, as a crayon drawing: an SVG file becomes strokes.

Colours become the nearest crayon of the box. A line's width becomes the crayon's tip, within what
crayons can draw (or the force it is pressed with); its opacity lightens the hand. A filled shape is
hatched, its edge drawn first; one as thin as a line is drawn as a line. What a later shape covers
is left out, so that colours that lie under each other in the file do not mix on the paper.
"""

import os
from collections.abc import Callable, Iterator
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from stroke_gen.colour import oklab
from stroke_gen.drawing import MAX_FORCE_N, Drawing, Stroke, Tip

from ..crayons.palette import Palette
from ..crayons.palette_files import load_palette
from ..images.icc import decode_srgb
from ..images.srgb import light_of
from ..wax.paper import load_paper
from . import shapes as svg_shapes
from .elements import read_svg
from .shapes import RGB, Page, Shape

LINE_TIP_MM = (0.6, 8.0)  # sharpened to the whole crayon
OWN_TIP_MM = (0.1, 100.0)  # of files that carry forces, as ours do
FILL_TIP_MM = (0.9, 2.8)
SHARP_MM = 1.2  # a finer tip is a sharpened one
PRESSURE = 0.4  # N/mm^2 under the tip
LINE_FORCE_N = 1.4  # of a line of mean width, if widths are forces
THIN_MM = 1.2  # a filled shape thinner than this is a line
UNEVEN = 0.3  # by which the force of a hatching differs from end to end of its lines
SPACING = 0.7  # of the tip, between two lines of a hatching
SAME = 0.04  # OKLab distance up to which a fill counts as bare paper
GRID_MM = 0.25  # of the map of what covers what
STEP_MM = 0.5  # between points where visibility is asked
MOST_FILLED = 20  # times the sheet's area
# times a row crosses the edge of a shape, in the mean; what is shredded finer is not filled
MOST_CROSSED = 200
MAX_POINTS = 2_000_000
MAX_LENGTH_MM = 3_000_000.0  # of all lines
MARGIN_MM = 10.0  # around the sheet, where a crayon may still reach in

Floats = NDArray[np.float64]


def load_svg(
    path: str | os.PathLike[str],
    *,
    palette: str | dict[str, Any] = "box24",
    paper: str | dict[str, Any] = "drawing",
    physics: str = "metric",
    seed: int = 0,
    sheet_mm: float = 297.0,
    widths: str = "tip",
    say: Callable[[str], None] | None = None,
) -> Drawing:
    """Read an SVG file as a drawing.

    sheet_mm: long side of the sheet if the file gives its size in pixels or not at all. widths:
    what a line's width becomes, "tip" or "force". say: gets one line about what was left out.
    ValueError, one line with the name of the file, for anything that cannot be drawn.
    """
    name = repr(os.fspath(path))
    if widths not in ("tip", "force"):
        raise ValueError(f"widths: {widths!r} is neither tip nor force")
    box = load_palette(palette)
    try:
        page = svg_shapes.page(read_svg(path), sheet_mm)
        left_out = ", ".join(f"{n} <{tag}>" for tag, n in page.left_out.items())
        strokes = list(_strokes(page, _Chooser(box, load_paper(paper).colour), widths))
        if not strokes:
            raise ValueError(
                "no line or shape lies on the sheet" + (f" (only {left_out})" if left_out else "")
            )
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from error
    if say and left_out:
        say(f"{name}: left out {left_out}")
    return Drawing(page.width_mm, page.height_mm, paper, palette, tuple(strokes), physics, seed)


class _Chooser:
    """Finds the crayon for a colour."""

    def __init__(self, palette: Palette, paper: str) -> None:
        self.names = [c.name for c in palette.crayons]
        self.lab = _lab([c.hex for c in palette.crayons])
        self.paper = _lab([paper])[0]

    def crayon(self, colour: RGB) -> str:
        return self.names[int(((self.lab - _lab_of(colour)) ** 2).sum(1).argmin())]

    def is_paper(self, colour: RGB) -> bool:
        return bool(((self.paper - _lab_of(colour)) ** 2).sum() < SAME**2)


def _lab(colours: list[str]) -> NDArray[np.float32]:
    return oklab(np.array([light_of(colour) for colour in colours], np.float32))


def _lab_of(colour: RGB) -> NDArray[np.float32]:
    return oklab(decode_srgb(np.array(colour, np.float32).reshape(1, 1, 3))[0, 0])


# ---- from shapes to strokes ----------------------------------------------------------------------


def _strokes(page: Page, chooser: _Chooser, widths: str) -> Iterator[Stroke]:
    cover = _cover(page)
    visible = _Visible(cover, np.array([page.width_mm, page.height_mm]))
    filled = points = 0.0
    usual = float(np.median([s.width_mm for s in page.shapes if s.stroke] or [1.0]))
    for number, shape in enumerate(page.shapes, 1):
        visible.number = number
        made: list[Stroke] = []
        if shape.fill and not chooser.is_paper(shape.fill):
            filled += _extent(shape, page)
            if filled > MOST_FILLED:
                raise ValueError(f"planes cover the sheet more than {MOST_FILLED} times")
            made += _filled(shape, number, _named(shape, shape.fill, chooser), visible)
        if shape.stroke:
            made += _drawn(shape, _named(shape, shape.stroke, chooser), visible, widths, usual)
        points += sum(len(s.path_mm) for s in made)
        if points > MAX_POINTS:
            raise ValueError(f"lines and hatchings have more than {MAX_POINTS:,} points")
        yield from made


def _extent(shape: Shape, page: Page) -> float:
    """The area of the box around a shape, as a share of the sheet."""
    sheet = np.array([page.width_mm, page.height_mm])
    low = np.min([line.min(0) for line in shape.lines], 0).clip(0, sheet)
    high = np.max([line.max(0) for line in shape.lines], 0).clip(0, sheet)
    return float((high - low).prod() / sheet.prod())


def _named(shape: Shape, colour: RGB, chooser: _Chooser) -> str:
    """The crayon that the file names, as ours do, or the nearest to a colour."""
    named = shape.data.get("data-crayon", "")
    return named if named in chooser.names else chooser.crayon(colour)


def _drawn(
    shape: Shape, crayon: str, visible: "_Visible", widths: str, usual_mm: float
) -> Iterator[Stroke]:
    """The lines of a shape."""
    own = _own_forces(shape)
    if widths == "force":
        tip = Tip("blunt", 2.4)
        force = LINE_FORCE_N * float(np.clip(shape.width_mm / max(usual_mm, 1e-9), 0.2, 4.0))
    else:
        width = float(np.clip(shape.width_mm, *(OWN_TIP_MM if own is not None else LINE_TIP_MM)))
        tip = Tip(_kind(shape, width), width, _angle(shape))
        force = _force(tip)
    force *= 0.3 + 0.7 * shape.stroke_opacity
    for line in shape.lines:
        line = _dot(line, tip.width_mm) if own is None else line
        if own is not None and len(own) == len(line):
            for path, forces in visible.parts(line, own):
                yield _stroke(path, forces, crayon, tip, shape.data.get("data-note", "line"))
        else:
            for path, forces in visible.parts(
                line, np.full(len(line), own[0] if own is not None else force)
            ):
                yield _stroke(path, forces, crayon, tip, shape.data.get("data-note", "line"))


def _filled(shape: Shape, number: int, crayon: str, visible: "_Visible") -> Iterator[Stroke]:
    """A plane: its edge, then a hatching inside; or, if it is thin, its edge alone."""
    edges = [line for line in shape.lines if len(line) > 2]
    rings = _planes(edges, visible.sheet)
    thick = _thickness(rings)
    thin = thick < THIN_MM
    width = float(np.clip(thick if thin else thick / 4, *FILL_TIP_MM))
    tip = Tip("sharp" if width < SHARP_MM else "blunt", width)
    force = _force(tip) * (0.3 + 0.7 * shape.fill_opacity)
    if shape.stroke is None:
        edge = tip if thin else Tip("sharp", max(FILL_TIP_MM[0], width / 2))
        for ring in edges:
            ring = np.concatenate([ring, ring[:1]])
            for path, forces in visible.parts(
                ring, np.full(len(ring), force * (edge.width_mm / width) ** 2)
            ):
                yield _stroke(path, forces, crayon, edge, "line")
    if not thin:
        rng = np.random.default_rng(number)
        turn = np.deg2rad(-50 + 25 * (number * 0.618 % 1))  # no two neighbours quite alike
        for line in _hatching(rings, SPACING * width, turn, 0.4 * width, shape.even_odd):
            pressed = force * rng.uniform(1 - UNEVEN, 1 + UNEVEN, len(line))
            for path, forces in visible.parts(line, pressed):
                yield _stroke(path, forces, crayon, tip, "fill")


def _stroke(path: Floats, force: Floats, crayon: str, tip: Tip, note: str) -> Stroke:
    forces = np.clip(force, 0, MAX_FORCE_N).astype(np.float32)
    return Stroke(np.ascontiguousarray(path, np.float32), forces, crayon, tip, note[:100])


def _dot(line: Floats, width: float) -> Floats:
    """A line too short to show becomes a small round movement, as a hand makes a dot."""
    if len(line) == 0 or float(np.hypot(*np.ptp(line, 0))) > 0.2 * width:
        return line
    turn = np.linspace(0, 4 * np.pi, 25)[:, None]
    return np.asarray(line.mean(0) + 0.22 * width * np.concatenate([np.cos(turn), np.sin(turn)], 1))


def _force(tip: Tip) -> float:
    return PRESSURE * tip.area_mm2


def _kind(shape: Shape, width: float) -> str:
    named = shape.data.get("data-tip", "")
    return (
        named
        if named in ("sharp", "blunt", "rim", "side")
        else "sharp"
        if width < SHARP_MM
        else "blunt"
    )


def _angle(shape: Shape) -> float:
    try:
        return float(np.clip(float(shape.data.get("data-angle", 0)), -360, 360))
    except ValueError:
        return 0.0


def _own_forces(shape: Shape) -> Floats | None:
    """The forces that our own files carry: one, or one for each point."""
    try:
        forces = np.array(shape.data.get("data-force", "").replace(",", " ").split(), np.float64)
    except ValueError:
        return None
    return forces if forces.size and np.isfinite(forces).all() else None


def _thickness(rings: list[Floats]) -> float:
    """Of a plane inside rings: twice the area over the length of its edge; the width, if it is a
    strip.
    """
    if not rings:
        return 0.0
    low, high = np.min([r.min(0) for r in rings], 0), np.max([r.max(0) for r in rings], 0)
    pixel = max(float((high - low).max()) / 400, 1e-6)
    picture = np.zeros(np.ceil((high - low) / pixel).astype(int)[::-1] + 1, np.uint8)
    cv2.fillPoly(
        picture,
        [np.round((r - low) / pixel * 16).astype(np.int32) for r in rings],
        1,
        cv2.LINE_8,
        4,
    )
    around = sum(float(np.hypot(*(np.roll(r, -1, 0) - r).T).sum()) for r in rings)
    return 2 * int(picture.sum()) * pixel**2 / max(around, 1e-9)


# ---- what is seen --------------------------------------------------------------------------------


def _cover(page: Page) -> NDArray[np.int32]:
    """The number (from 1) of the last opaque shape that covers each place of a grid of GRID_MM."""
    cover = np.zeros(
        (int(page.height_mm / GRID_MM) + 2, int(page.width_mm / GRID_MM) + 2), np.int32
    )
    for number, shape in enumerate(page.shapes, 1):
        if shape.fill is not None and shape.fill_opacity > 0.9:
            rings = _planes(shape.lines, np.array([page.width_mm, page.height_mm]))
            cv2.fillPoly(
                cover,
                [np.round(r / GRID_MM * 16).astype(np.int32) for r in rings],
                number,
                cv2.LINE_8,
                4,
            )
    return cover


def _planes(lines: list[Floats], sheet: Floats) -> list[Floats]:
    """The rings of a filled shape, cut off a little outside the sheet; none if they are shredded
    too finely.
    """
    rings = [_cut(line, sheet) for line in lines if len(line) > 2]
    rings = [ring for ring in rings if len(ring) > 2]
    if not rings:
        return []
    for axis in (0, 1):
        travel = sum(float(np.abs(np.diff(r[:, axis], append=r[0, axis])).sum()) for r in rings)
        extent = max(float(r[:, axis].max()) for r in rings) - min(
            float(r[:, axis].min()) for r in rings
        )
        if travel > MOST_CROSSED * max(extent, 1e-6):
            return []
    return rings


def _cut(ring: Floats, sheet: Floats) -> Floats:
    """A ring cut by four half-planes 1 mm outside the sheet (Sutherland and Hodgman 1974)."""
    for axis, bound, side in (
        (0, -1.0, 1),
        (1, -1.0, 1),
        (0, sheet[0] + 1, -1),
        (1, sheet[1] + 1, -1),
    ):
        over = side * (ring[:, axis] - bound)
        if (over >= 0).all():
            continue
        after, over_after = np.roll(ring, -1, 0), np.roll(over, -1)
        with np.errstate(divide="ignore", invalid="ignore"):
            crossing = ring + (over / (over - over_after))[:, None] * (after - ring)
        pairs = np.stack([ring, crossing], 1).reshape(-1, 2)
        ring = pairs[np.stack([over >= 0, (over >= 0) != (over_after >= 0)], 1).ravel()]
        if len(ring) == 0:
            break
    return ring


class _Visible:
    """Which parts of a line of shape `number` lie on the sheet or near, and under no later
    shape.
    """

    def __init__(self, cover: NDArray[np.int32], sheet: Floats) -> None:
        self.cover, self.sheet, self.number, self.length_mm = cover, sheet, 0, 0.0
        self.low, self.high = np.full(2, -MARGIN_MM), sheet + MARGIN_MM

    def parts(self, line: Floats, force: Floats) -> Iterator[tuple[Floats, Floats]]:
        """Pieces (n, 2) of a line, with the force along them (n,)."""
        if len(line) == 1:
            if self._seen(line)[0]:
                yield line, force
            return
        for piece in self._on_sheet(np.column_stack([line, force])):
            self.length_mm += float(np.hypot(*np.diff(piece[:, :2], axis=0).T).sum())
            if self.length_mm > MAX_LENGTH_MM:
                raise ValueError(
                    f"lines and hatchings are longer than {MAX_LENGTH_MM / 1e6:g} km in all"
                )
            fine = _resampled(piece)
            seen = self._seen(fine[:, :2])
            if seen.all():
                yield piece[:, :2], piece[:, 2]
                continue
            edges = np.flatnonzero(np.diff(np.concatenate([[0], seen.astype(np.int8), [0]])))
            for a, b in edges.reshape(-1, 2):
                if b - a > 1:
                    yield fine[a:b, :2], fine[a:b, 2]

    def _seen(self, points: Floats) -> NDArray[np.bool_]:
        inside = ((points >= self.low) & (points <= self.high)).all(1)
        cell = np.clip(
            np.nan_to_num(points) / GRID_MM, 0, np.array(self.cover.shape)[::-1] - 1
        ).astype(int)
        return np.asarray(inside & (self.cover[cell[:, 1], cell[:, 0]] <= self.number))

    def _on_sheet(self, line: Floats) -> Iterator[Floats]:
        """Pieces of a line (n, 3) inside the sheet: each step is cut by the four edges (Liang and
        Barsky 1984).
        """
        if ((line[:, :2] >= self.low) & (line[:, :2] <= self.high)).all():
            yield line
            return
        start, step = line[:-1], np.diff(line, axis=0)
        with np.errstate(divide="ignore", invalid="ignore"):
            t = np.stack(
                [(self.low - start[:, :2]) / step[:, :2], (self.high - start[:, :2]) / step[:, :2]]
            )
        flat = step[:, :2] == 0
        within = (start[:, :2] >= self.low) & (start[:, :2] <= self.high)
        enter = np.where(flat, np.where(within, 0, 2), t.min(0)).max(1).clip(0)
        leave = np.where(flat, 1, t.max(0)).min(1).clip(max=1)
        piece: list[Floats] = []
        for i in np.flatnonzero(enter < leave):
            a, b = start[i] + enter[i] * step[i], start[i] + leave[i] * step[i]
            if piece and not np.array_equal(piece[-1], a):
                yield np.array(piece)
                piece = []
            piece += [b] if piece else [a, b]
        if piece:
            yield np.array(piece)


def _resampled(line: Floats) -> Floats:
    """A line (n, 3) with points at most STEP_MM apart."""
    steps = np.hypot(*np.diff(line[:, :2], axis=0).T)
    parts = np.maximum(np.ceil(steps / STEP_MM).astype(int), 1)
    index = np.repeat(np.arange(len(parts)), parts)
    t = (np.arange(parts.sum()) - np.repeat(np.cumsum(parts) - parts, parts)) / np.repeat(
        parts, parts
    )
    return np.concatenate([line[index] + t[:, None] * (line[index + 1] - line[index]), line[-1:]])


# ---- hatching ------------------------------------------------------------------------------------


def _hatching(
    rings: list[Floats], gap: float, turn: float, inset: float, even_odd: bool
) -> Iterator[Floats]:
    """Zigzags that fill the plane inside rings, lines `gap` apart at an angle of `turn`.

    Each row is cut by the rings; a part of a row goes on with the line that ended nearby in the row
    before.
    """
    axes = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    a = np.concatenate(rings) @ axes.T
    b = np.concatenate([np.roll(ring, -1, 0) for ring in rings]) @ axes.T
    open_lines: list[list[tuple[float, float]]] = []
    for y in np.arange(a[:, 1].min() + gap / 2, a[:, 1].max(), gap):
        still: list[list[tuple[float, float]]] = []
        for ends in _crossed(a, b, float(y), inset, even_odd):
            line = next(
                (o for o in open_lines if min(abs(o[-1][0] - x) for x in ends) < 2 * gap), None
            )
            if line is not None:
                open_lines.remove(line)
            line = line or []
            back = bool(line) and abs(line[-1][0] - ends[1]) < abs(line[-1][0] - ends[0])
            line += [(x, float(y)) for x in (ends[::-1] if back else ends)]
            still.append(line)
        yield from (np.array(line) @ axes for line in open_lines)
        open_lines = still
    yield from (np.array(line) @ axes for line in open_lines)


def _crossed(
    a: Floats, b: Floats, y: float, inset: float, even_odd: bool
) -> list[tuple[float, float]]:
    """Where the row at `y` lies inside the rings whose sides go from `a` to `b`."""
    up, down = (a[:, 1] <= y) & (b[:, 1] > y), (b[:, 1] <= y) & (a[:, 1] > y)
    cut = np.flatnonzero(up | down)
    x = a[cut, 0] + (y - a[cut, 1]) / (b[cut, 1] - a[cut, 1]) * (b[cut, 0] - a[cut, 0])
    order = np.argsort(x, kind="stable")
    wind = np.cumsum(np.where(up[cut[order]], 1, -1))
    inside = np.arange(1, len(cut) + 1) % 2 == 1 if even_odd else wind != 0
    spans: list[tuple[float, float]] = []
    begun: float | None = None
    for at, within in zip(x[order].tolist(), inside.tolist(), strict=True):
        if within and begun is None:
            begun = at
        elif not within and begun is not None:
            if at - begun > 2 * inset:
                spans.append((begun + inset, at - inset))
            begun = None
    return spans
