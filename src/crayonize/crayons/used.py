"""Which crayons a drawing uses, light to dark: the order in which they are laid out, in layers and
on pages.
"""

from stroke_gen.drawing import Drawing, Stroke

from ..images.srgb import luminance
from .palette import Crayon, Palette


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
