"""Which crayons a drawing uses, light to dark: the order in which they are laid out, in layers and
on pages; and which of another box stand for them.
"""

from dataclasses import replace

import numpy as np

from stroke_gen.colour import oklab
from stroke_gen.drawing import Drawing, Stroke

from ..images.srgb import light_of, luminance
from .palette import Crayon, Palette, plain
from .palette_files import load_palette


def with_palette(drawing: Drawing, palette: str) -> Drawing:
    """The drawing in the crayons of another palette: those of the same name, or else those nearest
    in colour (OKLab).
    """
    old, new = load_palette(drawing.palette), load_palette(palette)
    names = [crayon.name for crayon in new.crayons]
    lab, others = (
        oklab(np.array([light_of(crayon.hex) for crayon in box.crayons], np.float32))
        for box in (old, new)
    )
    nearest = np.linalg.norm(lab[:, None] - others, axis=2).argmin(1)
    taken = {
        crayon.name: crayon.name if crayon.name in names else names[at]
        for crayon, at in zip(old.crayons, nearest, strict=True)
    }
    strokes = (replace(s, crayon=taken.get(plain(s.crayon), s.crayon)) for s in drawing.strokes)
    return replace(drawing, palette=palette, strokes=tuple(strokes))


def by_crayon(drawing: Drawing, palette: Palette) -> list[tuple[Crayon, list[Stroke]]]:
    """The crayons that are used, light to dark, each with its strokes in drawing order."""
    strokes: dict[int, list[Stroke]] = {}
    for stroke in drawing.strokes:
        strokes.setdefault(palette.index(stroke.crayon), []).append(stroke)
    used = [(palette.crayons[i], strokes[i]) for i in sorted(strokes)]
    return sorted(used, key=lambda layer: darkness(layer[0]))


def darkness(crayon: Crayon) -> float:
    """What crayons are sorted by, light ones first."""
    return -luminance(crayon.hex)
