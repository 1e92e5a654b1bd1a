"""A how-to-draw-it sheet: pages on which a child can follow a drawing, outline first, then crayon
by crayon.

The first page shows what it will become and which crayons to take out; each further one the wax to
lay now, in full colour, over what was drawn before, which is pale. Crayons come light to dark, each
once; those that give little come together at the end.
"""

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from stroke_gen.colour import oklab
from stroke_gen.drawing import Drawing, Note, Stroke, Tip
from stroke_gen.files import check_target, whole_file

from .. import pipeline
from ..crayons.palette import Palette, load_palette
from ..crayons.used import by_crayon
from ..images.icc import encode_srgb
from ..images.srgb import light_of
from ..images.write import write_image
from . import legend
from .legend import Lettering, Picture, Used

DPI = 150
A4_MM = (210.0, 297.0)
MARGIN_MM, HEAD_MM, FOOT_MM = 12.0, 26.0, 10.0
PALE = 0.35  # how much is left of what was drawn before
FEW = 0.01  # of all wax: crayons that give less come together at the end
LINES = (Note.LINE, Note.OUTLINE)  # notes of strokes that belong to the outline
PLACE_MM = 1.5  # cells of the map of which crayon lies where
SMALLEST_MM2 = 200.0  # a patch of colour smaller than this gets no outline
PENCIL_TIP, PENCIL_N = Tip("sharp", 1.1), 0.55
# film at which the wax hides about two thirds of the pale drawing below it on a page
SOLID_UM = 3.0

_NEAR = np.ones((3, 3), np.uint8)  # a cell and its neighbours

Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Step:
    """One page: what to draw, with which crayons."""

    title: str
    hint: str
    crayons: tuple[str, ...]
    strokes: tuple[Stroke, ...]


def save_steps(
    drawing: Drawing, out: str | os.PathLike[str], progress: Progress | None = None
) -> list[Path]:
    """Draw the pages of a drawing into `out`: a .pdf, or numbered .png pages; returns the files.

    out: name.pdf; name.png for name-01.png, name-02.png, ...; a folder, made if need be, for
    step-01.png, ... ValueError for a drawing without strokes or a name that cannot be; OSError if
    the disk refuses.
    """
    target = Path(out)
    suffix = target.suffix.lower()
    if suffix not in (".pdf", ".png", ""):
        raise ValueError(
            f"{os.fspath(out)!r}: pages go into a .pdf, into .png files or into a folder"
        )
    if not drawing.strokes:
        raise ValueError("the drawing has no strokes, so there is nothing to show step by step")
    if suffix:
        check_target(target)
    else:
        target.mkdir(exist_ok=True)
        target /= "step.png"
    pages = _pages(drawing, progress)
    if suffix == ".pdf":
        _save_pdf(pages, target)
        return [target]
    files = []
    for number, page in enumerate(pages, 1):
        files.append(target.with_name(f"{target.stem}-{number:02}.png"))
        write_image(files[-1], page, dpi=DPI)
    return files


def _save_pdf(pages: Iterator[Picture], target: Path) -> None:
    from PIL import Image

    first, *rest = (Image.fromarray(page) for page in pages)
    with whole_file(target) as part:
        first.save(
            part,
            "PDF",
            save_all=True,
            append_images=rest,
            resolution=DPI,
            quality=88,
            title=target.stem,
            creationDate=None,
            modDate=None,
        )


def steps_of(drawing: Drawing) -> list[Step]:
    """What to draw after what."""
    steps = []
    palette = load_palette(drawing.palette)
    if outline := outline_of(drawing, palette):
        steps.append(
            Step("the outline", "Draw these lines lightly.", (outline[0].crayon,), tuple(outline))
        )
    layers = by_crayon(drawing, palette)
    amounts = {crayon.name: _amount(strokes) for crayon, strokes in layers}
    few = FEW * sum(amounts.values())
    last: list[tuple[str, list[Stroke]]] = []
    for crayon, strokes in layers:
        if amounts[crayon.name] < few:
            last.append((crayon.name, strokes))
        else:
            steps.append(Step(crayon.name, _hint(strokes), (crayon.name,), tuple(strokes)))
    if len(last) == 1:
        steps.append(Step(last[0][0], "A few small touches.", (last[0][0],), tuple(last[0][1])))
    elif last:
        names = tuple(name for name, _ in last)
        steps.append(
            Step(
                "small touches",
                "A little of each.",
                names,
                tuple(s for _, part in last for s in part),
            )
        )
    return steps


def _amount(strokes: Sequence[Stroke]) -> float:
    """Force times length, N mm: what the wax laid is about proportional to."""
    return sum(float(s.force_n.mean() * (s.tip.width_mm + _length(s))) for s in strokes)


def _length(stroke: Stroke) -> float:
    return float(np.hypot(*np.diff(stroke.path_mm, axis=0).T).sum())


def _hint(strokes: Sequence[Stroke]) -> str:
    """How hard to press, and whether to fill or to draw lines."""
    lengths = np.array([_length(s) + 1 for s in strokes])
    pressure = [float(s.force_n.mean()) / s.tip.area_mm2 for s in strokes]
    press = float(np.average(pressure, weights=lengths))
    how = "lightly" if press < 0.22 else "firmly" if press < 0.55 else "hard"
    lines = lengths[[s.note in LINES for s in strokes]].sum() > lengths.sum() / 2
    return f"Draw these lines and press {how}." if lines else f"Fill these places and press {how}."


# ---- the outline ---------------------------------------------------------------------------------


def outline_of(drawing: Drawing, palette: Palette) -> list[Stroke]:
    """Thin grey lines: the drawing's own lines, and where one colour borders on another."""
    grey = _grey(palette)
    lines = [s.path_mm for s in drawing.strokes if s.note in LINES and len(s.path_mm) > 1]
    return [_pencil(path, grey) for path in [*lines, *_borders(drawing, palette)]]


def _grey(palette: Palette) -> str:
    """The crayon nearest to a dark grey."""
    lab = oklab(np.array([light_of(c.hex) for c in palette.crayons], np.float32))
    return palette.crayons[int(((lab - (0.5, 0, 0)) ** 2).sum(1).argmin())].name


def _pencil(path: NDArray[np.float32], crayon: str) -> Stroke:
    return Stroke(path, np.full(len(path), PENCIL_N, np.float32), crayon, PENCIL_TIP, Note.LINE)


def _borders(drawing: Drawing, palette: Palette) -> Iterator[NDArray[np.float32]]:
    """Borders between the places of different crayons, as lines in mm; each border once."""
    places = _places(drawing, palette)
    drawn = np.zeros(places.shape, np.uint8)
    drawn[[0, -1]] = drawn[:, [0, -1]] = 1  # the edge of the sheet is no border
    for index in np.unique(places):
        mask = (places == index).astype(np.uint8)
        for contour in cv2.findContours(mask, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)[0]:
            ring = contour[:, 0]
            if len(ring) * PLACE_MM < 30:
                continue
            known = drawn[ring[:, 1], ring[:, 0]] > 0
            if known.any() and not known.all():  # begin where a known border ends
                turn = int(np.flatnonzero(known)[0])
                ring, known = np.roll(ring, -turn, 0), np.roll(known, -turn)
            smooth = _smoothed((ring + 0.5) * PLACE_MM)
            edges = np.flatnonzero(np.diff(np.concatenate([[1], known.astype(np.int8), [1]])))
            for a, b in edges.reshape(-1, 2):
                if (b - a) * PLACE_MM >= 6:
                    part = smooth[a:b] if known.any() else np.concatenate([smooth, smooth[:1]])
                    yield part.astype(np.float32)
        rim = cv2.morphologyEx(mask, cv2.MORPH_GRADIENT, _NEAR)
        drawn = np.maximum(drawn, cv2.dilate(rim, _NEAR))


def _smoothed(ring: NDArray[np.float64]) -> NDArray[np.float64]:
    """A closed line without the stairs of its cells."""
    weights = np.exp(-0.5 * (np.arange(-4, 5) / 1.6) ** 2)
    long = np.concatenate([ring[-4:], ring, ring[:4]]) if len(ring) > 8 else ring
    smooth = np.stack(
        [np.convolve(long[:, axis], weights / weights.sum(), "valid") for axis in (0, 1)], 1
    )
    return smooth if len(smooth) == len(ring) else ring


def _places(drawing: Drawing, palette: Palette) -> NDArray[np.int32]:
    """Which crayon dominates where, on cells of PLACE_MM; 0 is bare paper.

    Small patches join their surroundings.
    """
    shape = (
        max(2, round(drawing.height_mm / PLACE_MM)),
        max(2, round(drawing.width_mm / PLACE_MM)),
    )
    laid = np.zeros((len(palette.crayons) + 1, *shape), np.float32)
    laid[0] = 0.35
    for stroke in drawing.strokes:
        if stroke.note not in LINES:
            mask = np.zeros(shape, np.uint8)
            points = np.round(stroke.path_mm / PLACE_MM * 16 - 8).astype(np.int32)
            cv2.polylines(
                mask,
                [points],
                False,
                1,
                max(1, round(stroke.tip.width_mm / PLACE_MM)),
                cv2.LINE_8,
                4,
            )
            laid[palette.index(stroke.crayon) + 1] += mask * float(
                stroke.force_n.mean() / stroke.tip.width_mm
            )
    for layer in laid:
        cv2.GaussianBlur(layer, (0, 0), 2.0, dst=layer)
    places = laid.argmax(0).astype(np.int32)
    for index in np.unique(places):
        _, parts, stats, _ = cv2.connectedComponentsWithStats(
            (places == index).astype(np.uint8), connectivity=4
        )
        small = np.flatnonzero(stats[:, cv2.CC_STAT_AREA] * PLACE_MM**2 < SMALLEST_MM2)
        for part in small[small > 0]:
            inside = (parts == part).astype(np.uint8)
            around = places[(cv2.dilate(inside, _NEAR) > 0) & (inside == 0)]
            if around.size:
                places[inside > 0] = np.bincount(around).argmax()
    return places


# ---- the pages -----------------------------------------------------------------------------------


def _pages(drawing: Drawing, progress: Progress | None) -> Iterator[Picture]:
    """All pages, first to last, as sRGB at DPI."""
    steps = steps_of(drawing)
    layout = _Layout(drawing)
    done = pipeline.draw(drawing, layout.size)
    yield layout.first(
        drawing,
        encode_srgb(done.picture()),
        legend.used_crayons(done.box.palette, done.box.given_mm3),
    )
    paper = np.array(done.ground, np.float32)
    under = np.broadcast_to(paper, done.picture().shape)
    for number, step in enumerate(steps, 1):
        if progress:
            progress("steps", number / len(steps))
        fresh = pipeline.easel(drawing, layout.size)
        fresh.draw(step.strokes)
        wax, cover = fresh.picture(), 1 - np.exp(-fresh.sheet.film_um() / SOLID_UM)[..., None]
        pale = paper + PALE * (under - paper)
        yield layout.page(
            drawing, step, number, len(steps), encode_srgb(pale + cover * (wax - pale))
        )
        under = under + cover * (wax - under)


class _Layout:
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
