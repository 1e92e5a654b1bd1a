"""Strokes onto a sheet: from a Drawing's millimetres to the wax kernels, on all threads.

Wear carries on within a stroke cell by cell. From stroke to stroke it carries on as a plan: the volume
that a stroke rubs off follows from its force and length (rate * force / lambda, see `worn_per_newton_mm`),
so each stroke's tip is known before any is drawn, and strokes on different tiles can be drawn side by
side. A tip worn flat is turned or sharpened: the next stroke gets a fresh mask.
"""

import functools
import threading
import tomllib
from collections.abc import Callable, Sequence
from importlib import resources
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stroke_gen.drawing import Stroke, Tip
from stroke_gen.jit import lean_kernel

from ..crayons.palette import Palette
from . import queue as schedule
from . import tip
from .contact import _rub, window
from .sheet import Physics, Sheet

STEP = 0.14  # of the tip's width, between two contacts: below the wavelength of the bumps
SHARPEN_UM = 36.0  # mean height lost before a tip is turned or sharpened
WEAR_LEVELS = 3  # from fresh to worn
FACES = 3  # different sets of bumps
HEADINGS = 9  # directions in which the bumps are drawn out, over half a turn

Progress = Callable[[int, int], None]
Drawn = Callable[[int], None]
Watch = Callable[[NDArray[np.float32], NDArray[np.int64], NDArray[np.float32]], Drawn]


@functools.cache
def physics(name: str) -> Physics:
    """The constants of a physics preset."""
    table = tomllib.loads(resources.files("crayonize").joinpath("data/physics.toml").read_text("utf-8"))
    if name not in table:
        raise ValueError(f"physics: {name!r} is none of {', '.join(table)}")
    return Physics(**table[name])


class Box:
    """The crayons in hand: how far each tip is worn, which face of it touches, how much wax it gave."""

    def __init__(self, palette: Palette, constants: Physics, cell_mm: float, seed: int = 0) -> None:
        self.palette, self.constants, self.cell_mm, self.seed = palette, constants, cell_mm, seed
        self.reach = constants.reach(cell_mm)
        self.worn_um: dict[tuple[str, Tip], float] = {}
        self.given_mm3: dict[str, float] = {}
        self._index: dict[tuple[Tip, int, int], int] = {}
        self.masks: list[NDArray[np.float32]] = []  # of fresh tips

    def take(
        self, strokes: Sequence[Stroke], newton_mm: NDArray[np.float64], heading: NDArray[np.int64]
    ) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
        """Which of `masks` draws each stroke along one of HEADINGS, and how many um of it are worn off.

        The wear goes on by force times length.
        """
        taken, worn_um = np.empty(len(strokes), np.int64), np.empty(len(strokes), np.float32)
        mine_of: dict[tuple[str, Tip], list[int]] = {}
        for i, stroke in enumerate(strokes):
            mine_of.setdefault((stroke.crayon, stroke.tip), []).append(i)
        for (crayon, shape), mine in mine_of.items():
            per_newton_mm = worn_per_newton_mm(self.constants) / (0.785 * shape.width_mm**2)
            so_far = self.worn_um.get((crayon, shape), 0.0)
            worn = np.add.accumulate(np.append(so_far, per_newton_mm * newton_mm[mine]))
            self.worn_um[crayon, shape] = float(worn[-1])
            face, rest = np.divmod(worn[:-1], SHARPEN_UM)
            worn_um[mine] = np.floor(rest / SHARPEN_UM * WEAR_LEVELS) / WEAR_LEVELS * SHARPEN_UM
            look = (face.astype(np.int64) + len(crayon)) % FACES * HEADINGS + heading[mine]
            kinds, which = np.unique(look, return_inverse=True)
            taken[mine] = np.array([self._number(shape, *divmod(kind, HEADINGS)) for kind in kinds.tolist()])[which]
        return taken, worn_um

    def _number(self, shape: Tip, face: int, heading: int) -> int:
        key = (shape, face, heading)
        if key not in self._index:
            rng = np.random.default_rng([self.seed, 11, face])
            turned, edge = tip.mask(shape, self.cell_mm, rng, np.pi * heading / HEADINGS), self.reach
            mask = np.full((len(turned) + 2 * edge, len(turned) + 2 * edge), tip.ABSENT)
            mask[edge:-edge, edge:-edge] = turned
            self._index[key] = len(self.masks)
            self.masks.append(mask)
        return self._index[key]

    def stacked(self) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
        """All masks as rows of one array, and the side of each."""
        sides = np.array([m.shape[0] for m in self.masks], np.int64)
        rows = np.full((len(sides), int(sides.max()) ** 2), tip.ABSENT, np.float32)
        for row, m in zip(rows, self.masks, strict=True):
            row[: m.size] = m.ravel()
        return rows, sides


def worn_per_newton_mm(constants: Physics) -> float:
    """Wax worn off a tip's relief in um mm^2 per newton and mm of path: rate * mu * sin / lambda, at usual means."""
    return constants.wear * constants.rate_per_mm * 0.7 / constants.lam


def rub(
    sheet: Sheet,
    strokes: Sequence[Stroke],
    box: Box,
    *,
    threads: int = 1,
    smears: bool = True,
    progress: Progress | None = None,
    watch: Watch | None = None,
) -> float:
    """Draw strokes on a sheet in order; returns the wax the crayons gave, in um times cells.

    watch: is given the points (n, 3) in cells, where each stroke begins among them, and how far each reaches; what
    it returns is called, in any thread, with the number of the stroke just drawn: then the tiles (of schedule.TILE
    cells) within its reach hold this stroke and all before it, and no later one.
    """
    if not strokes:
        return 0.0
    points, first = _points(strokes, sheet.cell_mm)
    newton_cells, _, heading = _ways(points, first)
    place = {name: box.palette.index(name) for name in {s.crayon for s in strokes}}
    wax_of = np.array([place[s.crayon] for s in strokes], np.int64)
    tip_of, worn_of = box.take(strokes, newton_cells * sheet.cell_mm, heading)
    masks, sides = box.stacked()
    reach = (sides[tip_of] / 2 + 2).astype(np.float32)
    order = schedule.order(points, first, reach, sheet.rows, sheet.cols)
    drawn = watch(points, first, reach) if watch else None
    loss = np.zeros(len(strokes), np.float64)
    around, desk = surroundings(sheet, box, smears), threading.local()

    def draw(queue: schedule.Queue, done: int) -> int:
        if not hasattr(desk, "window"):
            desk.window = window(masks.shape[1], len(sheet.optics))
        last: int = _rub(queue, done, drawn is not None, points, first, wax_of, tip_of, worn_of, masks, sides,
                         box.reach, np.float32(STEP), *around, loss, desk.window)  # fmt: skip
        if drawn and last >= 0:
            drawn(last)
        return last

    def report(done: int) -> None:
        if progress:
            progress(done, len(strokes))

    schedule.run(draw, order, threads, report)
    for stroke, given in zip(strokes, loss * sheet.cell_mm**2 / 1000, strict=True):
        box.given_mm3[stroke.crayon] = box.given_mm3.get(stroke.crayon, 0.0) + float(given)
    return float(loss.sum())


def surroundings(sheet: Sheet, box: Box, smears: bool) -> tuple[Any, ...]:
    """What the kernels take beside strokes and tips: smears, constants, per_lambda, rows, cols, columns."""
    per_lambda = np.float32(1 / (box.constants.lam * sheet.cell_mm**2))
    return smears, box.constants.constants(sheet.cell_mm), per_lambda, sheet.rows, sheet.cols, sheet.columns()


def _points(strokes: Sequence[Stroke], cell_mm: float) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """All points as (x, y in cells, force), and where each stroke begins."""
    first = np.zeros(len(strokes) + 1, np.int64)
    np.cumsum([len(s.path_mm) for s in strokes], out=first[1:])
    points = np.empty((int(first[-1]), 3), np.float32)
    points[:, :2] = np.concatenate([s.path_mm for s in strokes])
    points[:, :2] /= cell_mm
    points[:, 2] = np.concatenate([s.force_n for s in strokes])
    return points, first


def _ways(
    points: NDArray[np.float32], first: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """Of each stroke: force times length (newton cells), length in cells, and its mean direction.

    Directions count alike to and fro, and are given as one of HEADINGS.
    """
    newton_cells, cells, double = np.zeros((3, len(first) - 1))
    _measure(points, first, newton_cells, cells, double)
    return newton_cells, cells, np.round(double / (2 * np.pi) * HEADINGS).astype(np.int64) % HEADINGS


@lean_kernel
def _measure(points, first, newton_cells, cells, double):  # type: ignore[no-untyped-def]
    """Force times length, length, and twice the angle of the mean direction of each stroke."""
    for s in range(newton_cells.size):
        along, across = 0.0, 0.0
        for i in range(first[s], first[s + 1] - 1):
            dx, dy = np.float64(points[i + 1, 0] - points[i, 0]), np.float64(points[i + 1, 1] - points[i, 1])
            step = np.sqrt(dx * dx + dy * dy)
            newton_cells[s] += step * points[i, 2]
            cells[s] += step
            if step > 0:
                along += (dx * dx - dy * dy) / step
                across += 2 * dx * dy / step
        double[s] = np.arctan2(across, along)
