"""A drawing as SVG: lines for Inkscape, vpype and pen plotters.

One layer per crayon, light to dark, and in each the strokes in drawing order: a plotter is handed
one crayon after the other. All in millimetres. A stroke's force, which SVG has no word for, stands
as `data-force` (one number, or one for each point), its tip as `stroke-width` and `data-tip`. The
order of strokes across crayons is lost; the JSON file keeps it.
"""

import os
from collections.abc import Iterator
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from stroke_gen.drawing import Drawing, Stroke, check_drawing
from stroke_gen.files import whole_file

from ..crayons.palette import Palette
from ..crayons.palette_files import load_palette
from ..crayons.used import by_crayon

DAB_MM = 0.01  # a point is drawn as a line this long: plotters and viewers drop lines of no length


def save_svg(
    drawing: Drawing, path: str | os.PathLike[str], palette: Palette | None = None
) -> None:
    """Write the strokes of a drawing as SVG; the same drawing always gives the same bytes.

    palette: that of the drawing, where it has been read already.
    The file appears whole or not at all. ValueError if the drawing breaks a rule, OSError naming
    `path`.
    """
    check_drawing(drawing, "drawing")
    with whole_file(path) as part, open(part, "x", encoding="utf-8", newline="\n") as file:
        file.writelines(_lines(drawing, palette or load_palette(drawing.palette)))


def _lines(drawing: Drawing, palette: Palette) -> Iterator[str]:
    width, height = f"{drawing.width_mm:.7g}", f"{drawing.height_mm:.7g}"
    yield '<?xml version="1.0" encoding="UTF-8"?>\n'
    yield (
        '<svg xmlns="http://www.w3.org/2000/svg" '
        'xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape" '
        f'version="1.1" width="{width}mm" height="{height}mm" viewBox="0 0 {width} {height}" '
        'fill="none" stroke-linecap="round" stroke-linejoin="round">\n'
    )
    for number, (crayon, strokes) in enumerate(by_crayon(drawing, palette), 1):
        label = quoteattr(f"{number} {crayon.name}")
        yield (
            f'<g inkscape:groupmode="layer" id="layer{number}" inkscape:label={label} '
            f'stroke="{crayon.hex}" '
            f"data-crayon={quoteattr(crayon.name)}>\n"
        )
        for stroke in strokes:
            yield _path(stroke)
        yield "</g>\n"
    yield "</svg>\n"


def _path(stroke: Stroke) -> str:
    tip = f' data-tip="{stroke.tip.kind}"' if stroke.tip.kind != "blunt" else ""
    tip += f' data-angle="{stroke.tip.angle_deg:.4g}"' if stroke.tip.angle_deg else ""
    note = f" data-note={quoteattr(stroke.note)}"
    points = stroke.path_mm.astype(np.float64)
    if len(points) == 1:
        points = np.concatenate([points, points + np.array([DAB_MM, 0])])
    return (
        f'<path stroke-width="{stroke.tip.width_mm:.4g}"{tip}{note} '
        f'data-force="{_forces(stroke.force_n)}" '
        f'd="{_outline(points)}"/>\n'
    )


def _forces(force: NDArray[np.float32]) -> str:
    if (force == force[0]).all():
        return f"{force[0]:.3g}"
    return " ".join(["%.3g"] * len(force)) % tuple(force.tolist())


def _outline(points: NDArray[np.float64]) -> str:
    """Path data of a polyline, in hundredths of a millimetre."""
    rounded = tuple((points.round(2) + 0.0).ravel().tolist())
    return "M" + " ".join(["%.7g,%.7g"] * len(points)) % rounded
