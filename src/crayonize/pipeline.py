"""The two conductors: a photo becomes a Drawing, a Drawing becomes a picture."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from stroke_gen import generate as generator
from stroke_gen import subject
from stroke_gen.alike import plain_opencv
from stroke_gen.analysis import fit, work_shape
from stroke_gen.drawing import Drawing, Stroke

from .crayons import calibration
from .crayons.palette import Palette
from .crayons.palette_files import load_palette, told
from .light import optics
from .machine import cores
from .settings import Settings
from .wax import paper, rub
from .wax.box import Box
from .wax.physics import physics
from .wax.sheet import Sheet

Progress = Callable[[str, float], None]  # what is being done, how much of all is done (0..1)


class Onlooker(Protocol):
    """Someone who looks on while a drawing is made."""

    def open(self, easel: "Easel") -> None:
        """A bare sheet is on the easel."""

    def strokes(self, strokes: Sequence[Stroke], share: float) -> rub.Watch | None:
        """Strokes are about to be drawn; `share` of the whole work they are (0..1).

        None: no need to tell of each.
        """


@dataclass
class Easel:
    """An open sheet with its paper and crayons: strokes go on, pictures come off."""

    sheet: Sheet
    box: Box
    ground: tuple[float, float, float]
    threads: int
    smears: bool = True
    watch: Onlooker | None = None

    def draw(
        self, strokes: Sequence[Stroke], progress: rub.Progress | None = None, share: float = 1.0
    ) -> None:
        """Draw strokes, in order, onto what is there; `share` of the whole drawing they are."""
        watch = self.watch.strokes(strokes, share) if self.watch else None
        rub.rub(
            self.sheet,
            strokes,
            self.box,
            threads=self.threads,
            smears=self.smears,
            progress=progress,
            watch=watch,
        )

    def show_to(self, watch: Onlooker | None) -> None:
        """Let someone look on from now."""
        self.watch = watch
        if watch:
            watch.open(self)

    def picture(self, light: bool = True) -> NDArray[np.float32]:
        """The sheet as linear RGB (rows, cols, 3)."""
        return optics.render(self.sheet, self.ground, light=light, threads=self.threads)

    def picture_srgb(self, light: bool = True) -> NDArray[np.uint8]:
        """The sheet as sRGB of 8 bits (rows, cols, 3), which takes a quarter of the memory."""
        return optics.render_srgb(self.sheet, self.ground, light=light, threads=self.threads)

    def seen(self, shape: tuple[int, int]) -> NDArray[np.float32]:
        """The sheet as linear RGB on a grid of `shape`, without light: what the generator sees."""
        if shape[0] > self.sheet.rows or shape[1] > self.sheet.cols:
            return fit(self.picture(light=False), shape)
        return optics.render_reduced(self.sheet, self.ground, shape, threads=self.threads)


@plain_opencv()
def easel(
    drawing: Drawing,
    size: int,
    threads: int | None = None,
    smears: bool = True,
    palette: Palette | None = None,
    ground: paper.Paper | None = None,
) -> Easel:
    """A blank sheet for a drawing, `size` cells along its long side.

    palette, ground: palette and paper of the drawing, where they have been read already.
    """
    palette = palette or load_palette(drawing.palette)
    sheet_paper = ground or paper.load_paper(drawing.paper)
    cell_mm = max(drawing.width_mm, drawing.height_mm) / size
    rows, cols = (
        max(1, round(drawing.height_mm / cell_mm)),
        max(1, round(drawing.width_mm / cell_mm)),
    )
    tooth = paper.tooth(sheet_paper, rows, cols, cell_mm, drawing.seed)
    box = Box(palette, physics(drawing.physics), cell_mm, drawing.seed)
    sheet = Sheet(tooth, cell_mm, *box.optics())
    return Easel(
        sheet, box, paper.colour_linear(sheet_paper.colour), threads or cores.allowed(), smears
    )


@plain_opencv()
def draw(
    drawing: Drawing,
    size: int = Settings.size,
    *,
    threads: int | None = None,
    preview: bool = False,
    progress: Progress | None = None,
    watch: Onlooker | None = None,
) -> Easel:
    """A drawing on paper, `size` cells along the long side; `.picture()` shows it.

    preview: at half the size (section 5 of the paper).
    """
    stand = easel(drawing, max(1, size // 2) if preview else size, threads)
    stand.show_to(watch)
    stand.draw(drawing.strokes, progress and (lambda done, all_: progress("drawing", done / all_)))
    return stand


@plain_opencv()
def sketch(
    photo: NDArray[np.float32],
    settings: Settings,
    progress: Progress | None = None,
    watch: Onlooker | None = None,
) -> tuple[Drawing, Easel]:
    """Plan and draw a photo in linear light (h, w, 3): its Drawing, and the sheet drawn on."""
    long_mm = settings.sheet_mm
    scale = long_mm / max(photo.shape[:2])
    width_mm, height_mm = (max(1.0, round(side * scale, 3)) for side in photo.shape[1::-1])
    who = subject.see(photo, work_shape(width_mm, height_mm), settings.mask)
    # all that is looked at; the large one may go
    photo = fit(photo, work_shape(width_mm, height_mm))
    # a pencil's drawing is planned with finer tips than a crayon's
    style = replace(settings.hand, tip_mm=settings.hand.tip_mm * physics(settings.physics).tip)
    named = settings.paper, told(settings.palette)
    blank = Drawing(width_mm, height_mm, *named, (), settings.physics, settings.seed)
    stand = easel(
        blank,
        max(1, settings.size // 2) if settings.preview else settings.size,
        settings.threads,
        palette=settings.box,
        ground=settings.ground,
    )
    stand.show_to(watch)
    table = calibration.swatches(settings.box, settings.ground, settings.physics, stand.threads)
    stages = generator.stages(style)
    done = 0

    def draw(strokes: list[Stroke]) -> None:
        nonlocal done
        if strokes:
            base, name = done / stages, strokes[0].note
            stand.draw(
                strokes,
                progress and (lambda n, m: progress(name, base + n / m / stages)),
                1 / stages,
            )
        done += 1

    strokes = generator.generate(
        photo, who, (width_mm, height_mm), table, style, settings.seed,
        draw=draw, look=stand.seen, threads=stand.threads, focus=settings.focus,
    )  # fmt: skip
    drawing = Drawing(
        width_mm,
        height_mm,
        settings.paper,
        blank.palette,
        tuple(strokes),
        settings.physics,
        settings.seed,
    )
    return drawing, stand
