"""The box of crayons used, drawn beside or below the drawing: a patch of real wax each, its name,
what it gave.

The panel is a drawing of its own on the same paper, rubbed by the same simulator; only the words
are type.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stroke_gen.drawing import Drawing, Stroke, Tip

from .. import pipeline
from ..crayons.palette import Crayon, Palette
from ..crayons.used import darkness
from ..images.icc import encode_srgb

Picture = NDArray[np.uint8]  # (h, w, 3) sRGB

STICK_MM2 = 50.0  # cross-section of a crayon 8 mm thick
PATCH = (17.0, 8.5)  # a patch of wax: width and height, as all lengths here for a sheet of 297 mm
ENTRY = (47.0, 13.5)  # a patch and its words
MARGIN, TITLE = 7.0, 10.0
PRESSURE = 0.6  # N/mm^2, so that a patch shows the crayon's full colour
TYPE = 3.4  # height of the letters
DARK, PALE = (52, 48, 44), (238, 234, 228)  # ink on light and on dark paper


@dataclass(frozen=True)
class Used:
    """A crayon that was used, and how much of it (mm^3)."""

    crayon: Crayon
    given_mm3: float

    @property
    def amount(self) -> str:
        """How much of a stick that is."""
        length = self.given_mm3 / STICK_MM2
        return (
            f"{length:.0f} mm of the stick"
            if length >= 9.95
            else f"{max(length, 0.1):.1f} mm of the stick"
        )


def used_crayons(palette: Palette, given_mm3: dict[str, float]) -> list[Used]:
    """The crayons that gave any wax, light to dark."""
    used = [Used(c, given_mm3[c.name]) for c in palette.crayons if given_mm3.get(c.name, 0.0) > 0]
    return sorted(used, key=lambda one: darkness(one.crayon))


def with_legend(
    picture: Picture, drawing: Drawing, easel: pipeline.Easel, *, light: bool = True
) -> Picture:
    """The picture of a drawing with the crayons used: below it if it is wide, beside it if it is
    high.
    """
    rows, cols = picture.shape[:2]
    used = used_crayons(easel.box.palette, easel.box.given_mm3)
    unit = max(rows, cols) / 297  # pixels to a "mm" of the layout
    title = _title(used, easel.box.palette)
    if cols >= rows:
        across = max(1, int((cols / unit - 2 * MARGIN) // ENTRY[0]))
        high = round((2 * MARGIN + TITLE + ENTRY[1] * -(-len(used) // across)) * unit)
        return np.concatenate(
            [picture, panel(drawing, used, cols, high, unit, title, across, light=light)]
        )
    down = max(1, int((rows / unit - 2 * MARGIN - TITLE) // ENTRY[1]))
    across = -(-max(1, len(used)) // down)
    wide = round((2 * MARGIN + ENTRY[0] * across) * unit)
    return np.concatenate(
        [picture, panel(drawing, used, wide, rows, unit, title, across, light=light)], 1
    )


def panel(
    drawing: Drawing,
    used: Sequence[Used],
    width: int,
    height: int,
    unit: float,
    title: str,
    across: int,
    *,
    light: bool = True,
) -> Picture:
    """The crayons in rows of `across`, on a piece of the drawing's paper of width x height pixels.

    unit: pixels to a "mm" of the layout.
    """
    cell_mm = _cell_mm(drawing, unit)
    wide = (width / unit - 2 * MARGIN) / across
    top = MARGIN + (TITLE if title else 0)
    places = [
        (MARGIN + (i % across) * wide, top + (i // across) * ENTRY[1]) for i in range(len(used))
    ]
    strokes = [
        patch(x, y, *PATCH, one.crayon.name, unit * cell_mm)
        for (x, y), one in zip(places, used, strict=True)
    ]
    made = scrap(drawing, strokes, width, height, cell_mm, light=light)
    lettering = Lettering(made, unit)
    lettering.write(MARGIN, MARGIN, title, 1.25, width / unit - 2 * MARGIN)
    for (x, y), one in zip(places, used, strict=True):
        lettering.write(x + PATCH[0] + 2.5, y + 0.6, one.crayon.name, room=wide - PATCH[0] - 4)
        lettering.write(x + PATCH[0] + 2.5, y + 4.6, one.amount, 0.75)
    return lettering.picture()


def scrap(
    drawing: Drawing,
    strokes: Sequence[Stroke],
    width: int,
    height: int,
    cell_mm: float,
    *,
    light: bool = True,
) -> Picture:
    """A piece of the drawing's paper, width x height pixels of `cell_mm`, with strokes on it."""
    piece = Drawing(
        width * cell_mm,
        height * cell_mm,
        drawing.paper,
        drawing.palette,
        tuple(strokes),
        drawing.physics,
        drawing.seed,
    )
    return encode_srgb(pipeline.draw(piece, max(width, height)).picture(light))[:height, :width]


def patch(x: float, y: float, width: float, height: float, crayon: str, scale: float) -> Stroke:
    """A patch of wax: one slanting zigzag, as a child tries a crayon.

    scale: mm of paper to a mm of the layout.
    """
    tip_mm = 0.28 * height
    lines = np.arange(0, width - tip_mm, 0.4 * tip_mm)
    top = np.arange(len(lines)) % 2 == 0
    slant = 0.25 * height
    span = (width - tip_mm - slant) / max(width - tip_mm, 1e-9)
    xs = lines * span + np.where(top, slant, 0) + tip_mm / 2
    ys = np.where(top, tip_mm / 2, height - tip_mm / 2)
    path = np.stack([x + xs, y + ys], 1) * scale
    tip = Tip("blunt", float(np.clip(tip_mm * scale, 0.3, 20)))
    force = np.full(len(path), PRESSURE * tip.area_mm2, np.float32)
    return Stroke(path.astype(np.float32), force, crayon, tip)


def _cell_mm(drawing: Drawing, unit: float) -> float:
    return max(drawing.width_mm, drawing.height_mm) / (297 * unit)


def _title(used: Sequence[Used], palette: Palette) -> str:
    total = sum(one.given_mm3 for one in used) / 1000
    many = f"{len(used)} of {len(palette.crayons)} crayons" if len(used) != 1 else "One crayon"
    return f"{many}, {total:.1f} ml of wax"


class Lettering:
    """Words on a picture, placed in the layout's mm."""

    def __init__(self, picture: Picture, unit: float) -> None:
        from PIL import Image, ImageDraw

        self._image = Image.fromarray(picture)
        self._draw = ImageDraw.Draw(self._image)
        self._unit = unit
        dark = float(np.median(picture[..., 1])) < 110
        self.ink = PALE if dark else DARK

    def write(
        self,
        x: float,
        y: float,
        text: str,
        size: float = 1.0,
        room: float | None = None,
        anchor: str = "la",
    ) -> None:
        """A line of words with its upper left corner, or its `anchor`, at (x, y); made smaller to
        fit into `room`.
        """
        from PIL import ImageFont

        font = ImageFont.load_default(max(4.0, TYPE * size * self._unit))
        if room is not None and (length := font.getlength(text)) > room * self._unit:
            font = ImageFont.load_default(
                max(4.0, TYPE * size * self._unit * room * self._unit / length)
            )
        self._draw.text((x * self._unit, y * self._unit), text, self.ink, font, anchor)

    def number(self, x: float, y: float, radius: float, text: str) -> None:
        """A number in a ring around (x, y)."""
        box = [(c + s * radius) * self._unit for s in (-1, 1) for c in (x, y)]
        self._draw.ellipse(box, outline=self.ink, width=max(1, round(0.5 * self._unit)))
        self.write(
            x, y, text, 1.1 * radius / TYPE if len(text) < 2 else 0.9 * radius / TYPE, anchor="mm"
        )

    def picture(self) -> Picture:
        """The picture with the words on it."""
        return np.asarray(self._image).copy()
