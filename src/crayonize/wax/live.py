"""Drawing by hand: a crayon on an open sheet, segment by segment, and what of the picture each one
changes.

The kernels are those of `rub`, and so is the wax: strokes drawn here, saved, and drawn again come
out the same. One thing `rub` knows that a hand does not tell when it puts the crayon down: which
way the whole stroke goes, along which the tip's grooves lie (`box.HEADINGS`). So the first half
millimetre is waited for, and its way is taken. A stroke that bends later on may have its grooves
turned a little when it is drawn again.
"""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from stroke_gen.drawing import Drawing, Stroke, Tip, check_drawing

from .. import api
from ..images.icc import encode_srgb
from ..light import optics
from ..pipeline import Easel
from ..settings import Settings
from .contact import Held, lift, move, press
from .rub import table_of
from .strokes import in_cells, ways
from .window import window

SETTLE_MM = 0.5  # length from which a stroke's heading is taken
# cells around a tip: one whose light changes with its neighbour's height, one for rounding
MARGIN = 2

Floats = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Change:
    """A part of the picture as it is now: pixels (h, w, 3), uint8 sRGB, from row `top` and column
    `left` on.

    If nothing has changed, h and w are 0.
    """

    top: int
    left: int
    pixels: NDArray[np.uint8]


class Live:
    """A sheet to draw on by hand: `press` a crayon on it, `move` it any number of times, `lift` it.

    Each call changes the wax at once, as `crayonize.draw` would for the whole stroke, and returns
    the part of the picture that it has changed. x and y are in mm on the sheet, force is in newton;
    all numbers are taken to a thousandth, as a drawing's file has them, so that a drawing saved and
    drawn again is the same picture (but for the grooves of strokes that bend, see the module). Made
    for one thread.

    A crayon may be tilted: how far its axis leans from upright, and its azimuth, to where on the
    sheet it leans (0 to the right, 90 down), both in degrees. The tip presses harder on that side,
    until it is worn to lie flat. A stylus that reports its slopes u to the right and v towards the
    hand has the tilt atan(hypot(tan u, tan v)) and the azimuth atan2(tan v, tan u).

    Parameters
    ----------
    drawing: says the sheet, its paper, its crayons and seed; strokes that it has are drawn first.
    size: of the picture's long side in pixels, 1 to 20000.
    light: shade the relief of paper and wax.
    threads: at most so many at once for those first strokes. None: all cores.

    Attributes
    ----------
    light: as above; may be changed at any time, and holds for all that is shown from then on.

    Raises
    ------
    ValueError: one line for a drawing that breaks a limit, an unknown paper or palette, a size out
        of range; in the methods for numbers that no drawing may hold, unknown crayons and calls out
        of order. The sheet is then as it was.
    MemoryError: for a picture that this computer's memory does not hold.

    Examples
    --------
    >>> from stroke_gen.drawing import Drawing
    >>> sheet = Live(Drawing(60, 40, "drawing", "box8", ()), size=120)
    >>> sheet.press(10, 20, 2.0, "red")
    >>> change = sheet.move(50, 20, 2.0)
    >>> change.top, change.left, change.pixels.shape
    (33, 13, (14, 94, 3))
    >>> _ = sheet.lift()
    >>> len(sheet.drawing().strokes)
    1
    """

    def __init__(
        self,
        drawing: Drawing,
        size: int = Settings.size,
        *,
        light: bool = True,
        threads: int | None = None,
    ) -> None:
        """Lay the sheet ready and draw what the drawing has; see the class."""
        _, self.easel = api.redraw(drawing, size, threads)
        self.light = light
        self._drawing, self._strokes = drawing, list(drawing.strokes)
        self._hand: _Hand | None = None
        self._practise()

    def press(
        self,
        x_mm: float,
        y_mm: float,
        force_n: float,
        crayon: str,
        tip: Tip | None = None,
        note: str = "line",
        tilt_deg: float = 0.0,
        azimuth_deg: float = 0.0,
    ) -> None:
        """Put a crayon on the paper. Nothing shows before it is moved or lifted.

        Parameters
        ----------
        x_mm, y_mm: where, up to the sheet's own size beyond its edges.
        force_n: 0 to 100.
        crayon: its name in the palette.
        tip: the end that touches the paper. None: blunt, 2.4 mm.
        note: what the stroke is for, any word.
        tilt_deg, azimuth_deg: 0 to 80 and -360 to 360.

        Raises
        ------
        ValueError: as in the class; and if a crayon is on the paper already.
        """
        if self._hand:
            raise ValueError("press: a crayon is on the paper; lift it first")
        path_mm, force, tilt = _point(x_mm, y_mm, force_n, tilt_deg, azimuth_deg)
        dab = Stroke(path_mm, force, crayon, tip or Tip(), note, tilt)
        self._check(dab, "press")
        self._hand = _Hand(self.easel, dab)

    def move(
        self,
        x_mm: float,
        y_mm: float,
        force_n: float,
        tilt_deg: float = 0.0,
        azimuth_deg: float = 0.0,
    ) -> Change:
        """Draw straight on to a point; force and tilt change evenly on the way.

        Parameters are those of `press`. The first half millimetre of a stroke is waited for: it
        says which way the stroke goes.

        Returns
        -------
        What has changed, maybe nothing.

        Raises
        ------
        ValueError: as in the class; and if no crayon is on the paper.
        """
        hand = self._held("move")
        path_mm, force, tilt = _point(x_mm, y_mm, force_n, tilt_deg, azimuth_deg)
        self._check(replace(hand.dab, path_mm=path_mm, force_n=force, tilt_deg=tilt), "move")
        return self._change(hand, hand.move(path_mm, force, tilt))

    def lift(self) -> Change:
        """End the stroke; one that was too short to leave a mark becomes a dab.

        Returns
        -------
        What has changed, maybe nothing.

        Raises
        ------
        ValueError: if no crayon is on the paper.
        """
        hand = self._held("lift")
        self._hand = None
        cells = hand.lift()
        self._strokes.append(hand.stroke())
        return self._change(hand, cells)

    def picture(self) -> NDArray[np.uint8]:
        """The whole sheet as it is now.

        Returns
        -------
        uint8 sRGB (rows, cols, 3).
        """
        return self.easel.picture_srgb(self.light)

    def drawing(self) -> Drawing:
        """All strokes so far, but for one under way: to be saved, or drawn again.

        Returns
        -------
        The drawing given at first, with these strokes.
        """
        return replace(self._drawing, strokes=tuple(self._strokes))

    def _practise(self) -> None:
        """Draw a line without any force, so that the first real ones need wait neither for kernels
        nor for memory.
        """
        for array in self.easel.sheet.columns():
            array[::1024] += 0  # memory comes page by page, each when it is first written to
        crayon = self.easel.box.palette.crayons[0].name
        path_mm, force, tilt = _point(0, 0, 0)
        hand = _Hand(self.easel, Stroke(path_mm, force, crayon, Tip(), tilt_deg=tilt))
        self._change(hand, hand.move(*_point(1, 0, 0)))
        hand.lift()
        self.easel.box.drawn[crayon] -= 1  # it was none of the drawing's

    def _held(self, what: str) -> "_Hand":
        if not self._hand:
            raise ValueError(f"{what}: no crayon is on the paper; press one first")
        return self._hand

    def _check(self, dab: Stroke, where: str) -> None:
        check_drawing(replace(self._drawing, strokes=(dab,)), where)

    def _change(self, hand: "_Hand", cells: Floats) -> Change:
        """What the tip reached on its way over points (n, 3) in cells."""
        sheet, reach = self.easel.sheet, hand.side // 2 + MARGIN
        top, left, bottom, right = 0, 0, 0, 0
        if len(cells):
            left, top = (
                np.maximum(np.floor(cells[:, :2].min(0) - 0.5) - reach, 0).astype(int).tolist()
            )
            right, bottom = (np.floor(cells[:, :2].max(0) + 0.5) + reach + 1).astype(int).tolist()
            right, bottom = min(right, sheet.cols), min(bottom, sheet.rows)
        if top >= bottom or left >= right:
            return Change(0, 0, np.empty((0, 0, 3), np.uint8))
        band = np.empty((bottom - top, sheet.cols, 3), np.float32)
        part = np.array([[top, bottom, left, right]])
        optics.render_parts(sheet, self.easel.ground, part, band, first=top, light=self.light)
        return Change(top, left, encode_srgb(band[:, left:right]))


class _Hand:
    """A crayon on the paper, and the stroke it has drawn so far."""

    side = 0  # of the tip's window, in cells, once the heading is known

    def __init__(self, easel: Easel, dab: Stroke) -> None:
        """dab: a stroke of one point, where the crayon is put down."""
        self.easel, self.dab = easel, dab
        self._wax = easel.box.palette.index(dab.crayon)
        self._table = table_of(easel.sheet, easel.box, easel.smears)
        assert dab.tilt_deg is not None
        self._path, self._force, self._tilt = [dab.path_mm], [dab.force_n], [dab.tilt_deg]
        self._drawn = 0  # number of the point up to which the stroke is drawn
        self._given = 0.0  # wax, in um times cells
        # that leaves on the tip, by crayon
        self._carried = np.zeros(len(easel.box.palette.crayons))

    def stroke(self, since: int = 0) -> Stroke:
        """The stroke, or what of it begins with one of its points."""
        path_mm, force, tilt = (
            np.concatenate(points[since:]) for points in (self._path, self._force, self._tilt)
        )
        return replace(self.dab, path_mm=path_mm, force_n=force, tilt_deg=tilt)

    def move(self, path_mm: Floats, force: Floats, tilt: Floats) -> Floats:
        """Go on to a point; returns the points (n, 3) in cells over which it now was drawn, or
        none.
        """
        self._path.append(path_mm)
        self._force.append(force)
        self._tilt.append(tilt)
        if not self.side:
            points, first = in_cells([self.stroke()], self.easel.sheet.cell_mm)
            if ways(points, first)[1][0] * self.easel.sheet.cell_mm < SETTLE_MM:
                return points[:0]
            self._put_down()
        return self._draw()

    def lift(self) -> Floats:
        """End the stroke; returns the points (n, 3) in cells around which it last drew."""
        if not self.side:
            self._put_down()
        points = self._draw()
        self._given += lift(self._desk, self._held, self._table, points[-1], self._carried)
        self._book()
        return points

    def _put_down(self) -> None:
        """Choose the tip for the way the stroke has begun, and press it on the sheet."""
        box, cell_mm = self.easel.box, self.easel.sheet.cell_mm
        stroke = self.stroke()
        *_, self._heading = ways(*in_cells([stroke], cell_mm))
        (number,) = box.take([stroke], np.zeros(1), self._heading)
        mask = box.masks[number]
        self._desk, self.side = window(mask.size, len(box.palette.crayons)), mask.shape[0]
        cols, own = self.easel.sheet.cols, box.own_number(stroke.crayon)
        self._held: Held = press(
            self._desk, mask.ravel(), self._wax, self.side, box.reach, cols, own
        )

    def _draw(self) -> Floats:
        """Draw on to the last point; returns in cells where the way began and all points passed."""
        points, _ = in_cells([self.stroke(self._drawn)], self.easel.sheet.cell_mm)
        for a, b in pairwise(points):
            self._given += move(self._desk, self._held, self._table, a, b)
        self._drawn = len(self._path) - 1
        return points

    def _book(self) -> None:
        """Carry the stroke's wear on, and count its wax, as `rub` does."""
        box, cell_mm, stroke = self.easel.box, self.easel.sheet.cell_mm, self.stroke()
        newton_cells, _, _ = ways(*in_cells([stroke], cell_mm))
        box.take([stroke], newton_cells * cell_mm, self._heading)
        box.book(stroke.crayon, self._given, self._carried)


def _point(
    x_mm: float, y_mm: float, force_n: float, tilt_deg: float = 0.0, azimuth_deg: float = 0.0
) -> tuple[Floats, Floats, Floats]:
    """A point as a path, its force and its tilt, to the thousandth."""
    with np.errstate(over="ignore"):  # beyond float32 is beyond any sheet, and refused as such
        path_mm, force, tilt = (
            np.array(values).round(3).astype(np.float32)
            for values in ([[x_mm, y_mm]], [force_n], [[tilt_deg, azimuth_deg]])
        )
    return path_mm, force, tilt
