"""Path data of SVG as polylines: the path grammar, arcs and Bezier curves, within the limits of a
stranger's file.
"""

import math
import re
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

MAX_SEGMENTS = 300_000
MAX_POINTS = 1_000_000  # of one subpath
STEP_MM = 0.6  # between the points of a curve
MOST_POINTS = 400  # of one curve

Floats = NDArray[np.float64]
Points = list[tuple[float, float]]

_COMMAND = re.compile(r"([MmZzLlHhVvCcSsQqTtAa])([^MmZzLlHhVvCcSsQqTtAa]*)")
_NUMBER = re.compile(r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_BETWEEN = re.compile(r"[\s,]*")
_FLAG = re.compile(r"[01]")
_TAKES = {"M": 2, "L": 2, "H": 1, "V": 1, "C": 6, "S": 4, "Q": 4, "T": 2, "A": 7, "Z": 0}


class Outline:
    """One subpath. ends (n, 2): where each segment ends, the first being the start; for segment i
    the cubic's two inner control points are inner[i] (n, 2, 2), NaN where the segment is
    straight."""

    def __init__(self, start: tuple[float, float]) -> None:
        self.ends: Points = [start]
        self.inner: list[tuple[float, float, float, float]] = [_STRAIGHT]
        self.curved = False

    def line(self, x: float, y: float) -> None:
        self.ends.append((x, y))
        self.inner.append(_STRAIGHT)

    def cubic(self, x1: float, y1: float, x2: float, y2: float, x: float, y: float) -> None:
        self.ends.append((x, y))
        self.inner.append((x1, y1, x2, y2))
        self.curved = True

    def polyline(self, matrix: Floats) -> Floats:
        """The subpath under a transform to mm (3, 3) as points (n, 2), dense where it is curved."""
        turn, shift = matrix[:2, :2].T, matrix[:2, 2]
        with np.errstate(over="ignore", invalid="ignore"):
            points = np.array(self.ends) @ turn + shift
            if self.curved:
                points = _curves(points, np.array(self.inner).reshape(-1, 2, 2) @ turn + shift)
            keep = np.ones(len(points), bool)
            keep[1:] = (np.abs(np.diff(points, axis=0)) > 1e-9).any(1)
        return np.asarray(points[keep])


def _curves(ends: Floats, inner: Floats) -> Floats:
    """Points along straight and curved segments; `ends` (n, 2) and `inner` (n, 2, 2) as in
    Outline.
    """
    control = np.stack([np.roll(ends, 1, 0), inner[:, 0], inner[:, 1], ends], 1)
    length = np.hypot(*np.diff(control, axis=1).transpose(2, 0, 1)).sum(1)
    curved = ~np.isnan(inner[:, 0, 0])
    number = np.where(
        curved, np.clip(np.nan_to_num(length / STEP_MM, posinf=4), 4, MOST_POINTS), 1
    ).astype(int)
    if number.sum() > MAX_POINTS:
        raise ValueError(f"a curve of more than {MAX_POINTS:,} points")
    which = np.repeat(np.arange(len(ends)), number)
    step = np.arange(len(which)) - np.repeat(np.cumsum(number) - number, number) + 1
    t = (step / number[which])[:, None]
    p, u = control[which], 1 - t
    curve = u**3 * p[:, 0] + 3 * u * u * t * p[:, 1] + 3 * u * t * t * p[:, 2] + t**3 * p[:, 3]
    return np.where(curved[which][:, None], curve, p[:, 3])


_STRAIGHT = (math.nan,) * 4


def outlines(data: str) -> list[Outline]:
    """The subpaths of path data. After a fault the rest is left out, as the standard asks."""
    made: list[Outline] = []
    x = y = 0.0
    before, bend = "", (0.0, 0.0)  # the command before, and its last inner control point
    for count, (letter, values) in enumerate(_commands(data)):
        if count >= MAX_SEGMENTS:
            raise ValueError(f"a path of more than {MAX_SEGMENTS:,} segments")
        command = letter.upper()
        if letter.islower():
            values = _absolute(command, values, x, y)
        if command == "M":
            made.append(Outline((values[0], values[1])))
        elif not made:
            break
        elif command == "Z":
            values = made[-1].ends[0]
            made[-1].line(*values)
        elif before == "Z":  # goes on from where the closed one began
            made.append(Outline((x, y)))
        now = made[-1]
        if command == "L":
            now.line(*values)
        elif command in "HV":
            values = (values[0], y) if command == "H" else (x, values[0])
            now.line(*values)
        elif command in "CS":
            near = (2 * x - bend[0], 2 * y - bend[1]) if before in tuple("CS") else (x, y)
            values = values if command == "C" else (*near, *values)
            now.cubic(*values)
            bend = values[2], values[3]
        elif command in "QT":
            near = (2 * x - bend[0], 2 * y - bend[1]) if before in tuple("QT") else (x, y)
            bend = (values[0], values[1]) if command == "Q" else near
            ex, ey = values[-2:]
            now.cubic(
                x + (bend[0] - x) * 2 / 3,
                y + (bend[1] - y) * 2 / 3,
                ex + (bend[0] - ex) * 2 / 3,
                ey + (bend[1] - ey) * 2 / 3,
                ex,
                ey,
            )
        elif command == "A":
            _arc(now, x, y, *values)
        x, y = values[-2:]
        before = command
    return made


def _commands(data: str) -> Iterator[tuple[str, tuple[float, ...]]]:
    """Each command with its numbers; repeated ones one by one, `M 1 2 3 4` as M and L."""
    for found in _COMMAND.finditer(data):
        letter, text = found.groups()
        numbers, whole = _arc_numbers(text) if letter in "Aa" else _numbers(text)
        takes = _TAKES[letter.upper()]
        if not takes:
            yield letter, ()
        for i in range(0, len(numbers) - takes + 1, takes or len(numbers) + 1):
            if takes:
                yield letter, tuple(numbers[i : i + takes])
            letter = {"M": "L", "m": "l"}.get(letter, letter)
        if not whole or (takes and (not numbers or len(numbers) % takes)):
            return


def _numbers(text: str) -> tuple[list[float], bool]:
    """The numbers of a command, and whether there is nothing else."""
    found = _NUMBER.findall(text)
    whole = not _NUMBER.sub("", text).strip(" \t\r\n,") and all(len(f) < 200 for f in found)
    return ([float(f) for f in found], True) if whole else (_leading(text), False)


def _leading(text: str) -> list[float]:
    """The numbers before the first fault."""
    numbers, at = [], 0
    while (found := _NUMBER.match(text, _skip(text, at))) and len(found[0]) < 200:
        numbers.append(float(found[0]))
        at = found.end()
    return numbers


def _arc_numbers(text: str) -> tuple[list[float], bool]:
    """As `_numbers`; the two flags of an arc may stand without anything between them and the next
    number.
    """
    numbers: list[float] = []
    at = _skip(text, 0)
    while at < len(text):
        found = (_FLAG if len(numbers) % 7 in (3, 4) else _NUMBER).match(text, at)
        if not found or len(found[0]) >= 200:
            return numbers, False
        numbers.append(float(found[0]))
        at = _skip(text, found.end())
    return numbers, True


def _skip(text: str, at: int) -> int:
    found = _BETWEEN.match(text, at)
    return found.end() if found else at


def _absolute(command: str, values: tuple[float, ...], x: float, y: float) -> tuple[float, ...]:
    """Relative numbers as absolute ones."""
    if command == "A":
        return (*values[:5], values[5] + x, values[6] + y)
    if command == "V":
        return (values[0] + y,)
    return tuple(value + (y if i % 2 else x) for i, value in enumerate(values))


def _arc(
    path: Outline,
    x0: float,
    y0: float,
    rx: float,
    ry: float,
    turn: float,
    large: float,
    sweep: float,
    x1: float,
    y1: float,
) -> None:
    """An elliptic arc as cubics of at most a quarter turn (SVG 1.1, F.6.5; Bezier arms 4/3
    tan(angle/4)).
    """
    rx, ry = abs(rx), abs(ry)
    if (
        not all(map(math.isfinite, (x0, y0, rx, ry, turn, x1, y1)))
        or min(rx, ry) < 1e-9
        or (x0, y0) == (x1, y1)
    ):
        path.line(x1, y1)
        return
    cos, sin = math.cos(math.radians(turn)), math.sin(math.radians(turn))
    # In units in which the ellipse is a circle of radius 1, the ends are `a` and `b`.
    ax, ay = (cos * x0 + sin * y0) / rx, (cos * y0 - sin * x0) / ry
    bx, by = (cos * x1 + sin * y1) / rx, (cos * y1 - sin * x1) / ry
    half = math.hypot(bx - ax, by - ay) / 2
    if not 1e-9 < half < 1e9:
        path.line(x1, y1)
        return
    grow = max(1.0, half)
    away = (
        math.sqrt(max(0.0, 1 - (half / grow) ** 2))
        * grow
        / (2 * half)
        * (1 if bool(large) != bool(sweep) else -1)
    )
    cx, cy = (ax + bx) / 2 - away * (by - ay), (ay + by) / 2 + away * (bx - ax)
    start = math.atan2(ay - cy, ax - cx)
    angle = (math.atan2(by - cy, bx - cx) - start) % (2 * math.pi)
    angle -= 2 * math.pi if not sweep and angle > 0 else 0
    parts = max(1, math.ceil(abs(angle) / (math.pi / 2) - 1e-6))
    step = angle / parts
    arm = 4 / 3 * math.tan(step / 4)

    def back(u: float, v: float) -> tuple[float, float]:
        u, v = (cx + grow * u) * rx, (cy + grow * v) * ry
        return cos * u - sin * v, sin * u + cos * v

    for i in range(parts):
        p, q = start + i * step, start + (i + 1) * step
        one = back(math.cos(p) - arm * math.sin(p), math.sin(p) + arm * math.cos(p))
        two = back(math.cos(q) + arm * math.sin(q), math.sin(q) - arm * math.cos(q))
        path.cubic(*one, *two, *((x1, y1) if i == parts - 1 else back(math.cos(q), math.sin(q))))
