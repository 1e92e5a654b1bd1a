"""Where things are on the pages that show how to draw it, and what is written there."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from stroke_gen.drawing import Drawing, Stroke

from . import legend
from .legend import Lettering, Picture, Used

DPI = 150
A4_MM = (210.0, 297.0)
MARGIN_MM, HEAD_MM, FOOT_MM = 12.0, 26.0, 10.0


@dataclass(frozen=True)
class Step:
    """One page: what to draw, with which crayons."""

    title: str
    hint: str
    crayons: tuple[str, ...]
    strokes: tuple[Stroke, ...]


class Layout:
    """Where things are on an A4 page that lies or stands as the drawing does; mm unless it says
    pixels.
    """

    def __init__(self, drawing: Drawing) -> None:
        self.lying = drawing.width_mm > drawing.height_mm
        self.page_mm = A4_MM[::-1] if self.lying else A4_MM
        self.pixels_mm = DPI / 25.4
        room = (self.page_mm[0] - 2 * MARGIN_MM, self.page_mm[1] - HEAD_MM - FOOT_MM - MARGIN_MM)
        self.drawing_mm = (drawing.width_mm, drawing.height_mm)
        self.scale = min(room[0] / drawing.width_mm, room[1] / drawing.height_mm)
        self.size = max(1, round(max(self.drawing_mm) * self.scale * self.pixels_mm))

    def first(self, drawing: Drawing, picture: Picture, used: Sequence[Used]) -> Picture:
        """The page that says what to take and what it will be."""
        lettering = Lettering(self._blank(), self.pixels_mm)
        lettering.write(MARGIN_MM, MARGIN_MM - 2, "You need", 2.0)
        lettering.write(
            MARGIN_MM, MARGIN_MM + 7, "a sheet of drawing paper, and these crayons:", 1.1
        )
        page = lettering.picture()
        wide = page.shape[1] - 2 * self._px(MARGIN_MM)
        across = max(1, int((wide / self.pixels_mm - 2 * legend.MARGIN) // legend.ENTRY[0]))
        high = self._px(legend.ENTRY[1] * -(-len(used) // across) + 2 * legend.MARGIN - 4)
        box = legend.panel(drawing, used, wide, high, self.pixels_mm, "", across)
        top = self._px(MARGIN_MM + 14)
        self._paste(page, box, self._px(MARGIN_MM), top)
        room = (wide, page.shape[0] - top - high - self._px(MARGIN_MM + 4))
        shrink = min(1.0, room[0] / picture.shape[1], room[1] / picture.shape[0])
        size = (max(1, int(picture.shape[1] * shrink)), max(1, int(picture.shape[0] * shrink)))
        small = cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
        self._paste(
            page,
            np.asarray(small, np.uint8),
            (page.shape[1] - size[0]) // 2,
            top + high + self._px(4),
        )
        return page

    def page(
        self, drawing: Drawing, step: Step, number: int, steps: int, picture: Picture
    ) -> Picture:
        """The page of one step."""
        blank = self._blank()
        lettering = Lettering(blank, self.pixels_mm)
        lettering.number(MARGIN_MM + 8, MARGIN_MM + 3, 8, str(number))
        room = self.page_mm[0] - 2 * MARGIN_MM - 20
        patches = 26.0 * len(step.crayons)
        lettering.write(
            MARGIN_MM + 20, MARGIN_MM - 5, step.title, 2.0, room - min(patches, room / 2)
        )
        words = (
            ", ".join(step.crayons) + ". "
            if len(step.crayons) > 1 or step.title not in step.crayons
            else ""
        )
        words = f"{words[:1].upper()}{words[1:]}{step.hint}"
        lettering.write(MARGIN_MM + 20, MARGIN_MM + 4.5, words, 1.1, room - patches)
        lettering.write(
            self.page_mm[0] / 2, self.page_mm[1] - FOOT_MM, f"{number} of {steps}", 0.9, anchor="mm"
        )
        page = lettering.picture()
        for place, crayon in enumerate(step.crayons[7::-1]):
            left = self._px(self.page_mm[0] - MARGIN_MM - 25 * (place + 1))
            self._paste(page, self._swatch(drawing, crayon), left, self._px(MARGIN_MM - 5))
        self._paste(page, picture, (page.shape[1] - picture.shape[1]) // 2, self._px(HEAD_MM))
        return page

    def _swatch(self, drawing: Drawing, crayon: str) -> Picture:
        """A patch of one crayon on its paper, 24 x 14 mm."""
        patch = legend.patch(2, 2, 20, 10, crayon, 1.0)
        return legend.scrap(drawing, [patch], self._px(24), self._px(14), 1 / self.pixels_mm)

    def _blank(self) -> Picture:
        return np.full((self._px(self.page_mm[1]), self._px(self.page_mm[0]), 3), 255, np.uint8)

    def _px(self, mm: float) -> int:
        return round(mm * self.pixels_mm)

    def _paste(self, page: Picture, part: Picture, left: int, top: int) -> None:
        room = page[top : top + part.shape[0], left : left + part.shape[1]]
        room[:] = part[: room.shape[0], : room.shape[1]]
