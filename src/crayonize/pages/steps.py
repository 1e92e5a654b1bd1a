"""A how-to-draw-it sheet: pages on which a child can follow a drawing, outline first, then crayon
by crayon.

The first page shows what it will become and which crayons to take out; each further one the wax to
lay now, in full colour, over what was drawn before, which is pale. Crayons come light to dark, each
once; those that give little come together at the end.
"""

import os
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from stroke_gen.drawing import Drawing, Stroke
from stroke_gen.files import check_target, whole_file

from .. import pipeline
from ..crayons.palette_files import load_palette
from ..crayons.used import by_crayon
from ..images.icc import encode_srgb
from ..images.write import write_image
from ..pipeline import Progress
from . import layout, legend
from .layout import Layout, Step
from .legend import Picture
from .outline import LINES, outline_of

PALE = 0.35  # how much is left of what was drawn before
FEW = 0.01  # of all wax: crayons that give less come together at the end
# film at which the wax hides about two thirds of the pale drawing below it on a page
SOLID_UM = 3.0


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
        write_image(files[-1], page, dpi=layout.DPI)
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
            resolution=layout.DPI,
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


def _pages(drawing: Drawing, progress: Progress | None) -> Iterator[Picture]:
    """All pages, first to last, as sRGB at DPI."""
    steps = steps_of(drawing)
    sheet = Layout(drawing)
    done = pipeline.draw(drawing, sheet.size)
    yield sheet.first(
        drawing,
        encode_srgb(done.picture()),
        legend.used_crayons(done.box.palette, done.box.given_mm3),
    )
    paper = np.array(done.ground, np.float32)
    under = np.broadcast_to(paper, done.picture().shape)
    for number, step in enumerate(steps, 1):
        if progress:
            progress("steps", number / len(steps))
        fresh = pipeline.easel(drawing, sheet.size)
        fresh.draw(step.strokes)
        wax, cover = fresh.picture(), 1 - np.exp(-fresh.sheet.film_um() / SOLID_UM)[..., None]
        pale = paper + PALE * (under - paper)
        yield sheet.page(
            drawing, step, number, len(steps), encode_srgb(pale + cover * (wax - pale))
        )
        under = under + cover * (wax - under)
