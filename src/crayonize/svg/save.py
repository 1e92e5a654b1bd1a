"""A drawing as SVG: lines for Inkscape, vpype and pen plotters.

One layer per crayon, light to dark, and in each the strokes in drawing order: a plotter is handed
one crayon after the other. All in millimetres. A stroke's force, which SVG has no word for, stands
as `data-force` (one number, or one for each point), its tip as `stroke-width` and `data-tip`. The
order of strokes across crayons is lost, and points that a straight line and an even change of force
stand for are left out, so that other programs open it too; the JSON file keeps all.
"""

import os
from collections.abc import Iterator
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from stroke_gen.drawing import Drawing, Stroke, check_drawing
from stroke_gen.files import whole_file
from stroke_gen.jit import kernel

from ..crayons.palette import Palette
from ..crayons.palette_files import load_palette
from ..crayons.used import by_crayon

TOLERANCE_MM = 0.02  # by which a path may be off: a fifth of a fine pen's line
FORCE_TOLERANCE = 0.04  # of a stroke's greatest force
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
    kept = simplified(stroke.path_mm, stroke.force_n)
    points = stroke.path_mm[kept].astype(np.float64)
    if len(points) == 1:
        points = np.concatenate([points, points + np.array([DAB_MM, 0])])
    return (
        f'<path stroke-width="{stroke.tip.width_mm:.4g}"{tip}{note} '
        f'data-force="{_forces(stroke.force_n[kept])}" '
        f'd="{_outline(points)}"/>\n'
    )


def simplified(path_mm: NDArray[np.float32], force_n: NDArray[np.float32]) -> NDArray[np.bool_]:
    """The points (n,) of a path that are needed: between them it is a straight line and its force
    changes evenly, within the tolerances.
    """
    force = force_n * (TOLERANCE_MM / FORCE_TOLERANCE / max(float(force_n.max()), 1e-6))
    kept = np.zeros(len(path_mm), np.bool_)
    _simplify(np.column_stack([path_mm, force]).astype(np.float64), TOLERANCE_MM, kept)
    return kept


@kernel
def _simplify(points, tolerance, kept):  # type: ignore[no-untyped-def]
    """Mark the points (n, 3) to be kept: x, y and force as a length (Douglas and Peucker 1973)."""
    last = len(points) - 1
    kept[0] = kept[last] = True
    parts = [(0, last)]
    while parts:
        a, b = parts.pop()
        wx, wy = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
        square = wx * wx + wy * wy
        worst, at = tolerance, -1
        for i in range(a + 1, b):
            dx, dy = points[i, 0] - points[a, 0], points[i, 1] - points[a, 1]
            share = (dx * wx + dy * wy) / square if square > 0 else 0.0
            share = min(max(share, 0.0), 1.0)
            even = points[a, 2] + share * (points[b, 2] - points[a, 2])
            off = max(np.hypot(dx - share * wx, dy - share * wy), abs(points[i, 2] - even))
            if off > worst:
                worst, at = off, i
        if at >= 0:
            kept[at] = True
            parts.append((a, at))
            parts.append((at, b))


def _forces(force: NDArray[np.float32]) -> str:
    if (force == force[0]).all():
        return f"{force[0]:.3g}"
    return " ".join(["%.3g"] * len(force)) % tuple(force.tolist())


def _outline(points: NDArray[np.float64]) -> str:
    """Path data of a polyline, in hundredths of a millimetre."""
    rounded = tuple((points.round(2) + 0.0).ravel().tolist())
    return "M" + " ".join(["%.7g,%.7g"] * len(points)) % rounded
