"""Figures 1, 5, 8, 10 and 11 of "Simulating Wax Crayons", drawn anew with the paper's own
constants.

    python samples/paper/figures.py OUT [--cell MM]

Everything is drawn with the physics `rudolf2003` on cells of 0.1 mm (larger ones are faster).
Figures 1, 5 and 8 are close-ups, enlarged four times.
"""

import argparse
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from crayonize.crayons.palette_files import load_palette
from crayonize.images.icc import encode_srgb
from crayonize.images.write import write_image
from crayonize.machine import kernels
from crayonize.pipeline import Easel, draw, easel
from crayonize.wax.paper import colour_linear, load_paper
from stroke_gen.drawing import Drawing, Stroke, Tip
from stroke_gen.drawing_file import load_drawing

PHYSICS, PALETTE = "rudolf2003", "rudolf2003"
BLACK_PAPER = "lunar:#1c1b1d"
BLUE_PAPER = "lunar:#5a86b8"  # on which white shows as well as black
FORCES_N = (0.13, 0.33, 0.88, 2.2)  # from a breath to a firm hand, on a tip of 2.4 mm
LIGHT, HEAVY = 0.15, 0.9  # N per mm^2 of tip
SIDE = 14.0  # of a swatch, mm
DRAWINGS = Path(__file__).parents[1] / "drawings"

Picture = NDArray[np.uint8]
Point = tuple[float, float]


def main() -> None:
    """Draw all figures into a folder and print their paths."""
    parser = argparse.ArgumentParser(description="Draw the figures of the 2003 paper.")
    parser.add_argument("out", type=Path, metavar="OUT", help="folder for the figures")
    parser.add_argument(
        "--cell", type=float, default=0.1, metavar="MM", help="side of a cell (default: 0.1)"
    )
    options = parser.parse_args()
    kernels.keep_kernels()
    options.out.mkdir(parents=True, exist_ok=True)
    for name, figure in FIGURES.items():
        path = options.out / f"{name}.png"
        write_image(path, figure(options.cell))
        print(path)


# ---- the sheets ----------------------------------------------------------------------------------


def papers(cell: float) -> list[Easel]:
    """Fig. 1: the same scribble on the lunar and on the stipple texture."""
    scribble = hatch((4, 4, 26, 26), 0.3, "blue", 4.0)
    return [drawn(paper, 30, 30, [scribble], cell) for paper in ("lunar", "stipple")]


def forces(cell: float) -> Easel:
    """Fig. 5: four strokes, pressed harder from row to row."""
    rows = [
        line((8, 3 + 4 * i), (42, 3 + 4 * i), force, "blue") for i, force in enumerate(FORCES_N)
    ]
    return drawn("lunar", 45, 18, rows, cell)


def deposition_and_smearing(cell: float) -> list[Easel]:
    """Fig. 8: one crayon across another, first without and then with smearing."""
    strokes = [
        hatch((3, 3, 23, 16), 0.3, "purple", 3.0),
        line((4, 22), (22, 6), 4.0, "orange", 3.4),
    ]
    return [drawn("lunar", 26, 26, strokes, cell, smears) for smears in (False, True)]


def crayons(cell: float) -> list[Easel]:
    """Fig.

    10: every crayon light (first row) and heavy (second row), on white, black and blue paper.
    """
    names = [crayon.name for crayon in load_palette(PALETTE).crayons]
    strokes = [
        hatch(
            (SIDE * i + 2, SIDE * j + 2, SIDE * i + SIDE - 2, SIDE * j + SIDE - 2),
            pressure,
            name,
            3.0,
        )
        for i, name in enumerate(names)
        for j, pressure in enumerate((LIGHT, HEAVY))
    ]
    return [
        drawn(paper, SIDE * len(names), SIDE * 2, strokes, cell)
        for paper in ("lunar", BLACK_PAPER, BLUE_PAPER)
    ]


def drawn(
    paper: str, width: float, height: float, strokes: list[Stroke], cell: float, smears: bool = True
) -> Easel:
    """Strokes on a sheet of `width` by `height` mm."""
    blank = Drawing(width, height, paper, PALETTE, (), PHYSICS, seed=3)
    stand = easel(blank, round(max(width, height) / cell), smears=smears)
    stand.draw(strokes)
    return stand


def line(start: Point, end: Point, force: float, crayon: str, tip: float = 2.4) -> Stroke:
    """A straight stroke."""
    path = np.array([start, end], np.float32)
    return Stroke(path, np.full(2, force, np.float32), crayon, Tip("blunt", tip), "line")


def hatch(
    box: tuple[float, float, float, float], pressure: float, crayon: str, tip: float
) -> Stroke:
    """A zigzag that fills a box (left, top, right, bottom), pressed at `pressure` N/mm^2 under the
    tip.
    """
    left, top, right, bottom = box
    y = np.arange(top, bottom + 0.01, 0.62 * tip)
    x = np.where(np.arange(y.size) % 2, right, left)
    force = np.full(y.size, pressure * np.pi / 4 * tip**2, np.float32)
    return Stroke(np.stack([x, y], 1).astype(np.float32), force, crayon, Tip("blunt", tip))


# ---- the figures ---------------------------------------------------------------------------------


def fig01(cell: float) -> Picture:
    """Wax on the lunar texture (left) and on the stipple texture (right)."""
    return beside(*(close_up(stand) for stand in papers(cell)))


def fig05(cell: float) -> Picture:
    """Four forces, lightest first."""
    picture = close_up(forces(cell))
    for i, force in enumerate(FORCES_N):
        label(picture, f"{force} N", 0.01, (3.3 + 4 * i) / 18, 0.04)
    return picture


def fig08(cell: float) -> Picture:
    """Deposition alone (left) and with smearing (right)."""
    return beside(*(close_up(stand) for stand in deposition_and_smearing(cell)))


def fig10(cell: float) -> Picture:
    """The thirteen crayons of Table 2 in its order."""
    pictures = [encode_srgb(stand.picture()) for stand in crayons(cell)]
    names = [crayon.name for crayon in load_palette(PALETTE).crayons]
    head = np.full((pictures[0].shape[1] // 40, pictures[0].shape[1], 3), 255, np.uint8)
    for i, name in enumerate(names):
        label(head, f"{i + 1} {name}", (i + 0.15) / len(names), 0.75, 0.3)
    return below(head, *pictures)


def fig11(cell: float) -> Picture:
    """Two drawings: their strokes on the left, the wax on the right."""
    rows = []
    for name in ("house", "pyjamas"):
        drawing = load_drawing(DRAWINGS / f"{name}.json")
        wax = encode_srgb(draw(drawing, round(drawing.height_mm / cell / 1.4)).picture())
        rows.append(beside(strokes_of(drawing, wax.shape[0], wax.shape[1]), wax))
    return below(*rows)


def strokes_of(drawing: Drawing, rows: int, cols: int) -> Picture:
    """The strokes as thin lines in their crayons' colours on the colour of the paper."""
    palette = load_palette(drawing.palette)
    ground = np.array(colour_linear(load_paper(drawing.paper).colour), np.float32)
    picture = np.ascontiguousarray(encode_srgb(np.tile(ground, (rows, cols, 1))))
    for stroke in drawing.strokes:
        crayon = palette.crayons[palette.index(stroke.crayon)]
        colour = encode_srgb(np.array(colour_linear(crayon.hex), np.float32))
        points = np.round(stroke.path_mm * (8 * rows / drawing.height_mm)).astype(np.int32)
        cv2.polylines(
            picture, [points], False, colour.tolist(), max(1, rows // 700), cv2.LINE_AA, shift=3
        )
    return picture


FIGURES = {"fig01": fig01, "fig05": fig05, "fig08": fig08, "fig10": fig10, "fig11": fig11}


def close_up(stand: Easel) -> Picture:
    """The sheet enlarged four times."""
    picture = encode_srgb(stand.picture())
    return np.asarray(
        cv2.resize(picture, None, fx=4, fy=4, interpolation=cv2.INTER_CUBIC), np.uint8
    )


def beside(*pictures: Picture) -> Picture:
    """Pictures from left to right, parted by a white bar."""
    bar = np.full((pictures[0].shape[0], 24, 3), 255, np.uint8)
    return np.concatenate([part for picture in pictures for part in (picture, bar)][:-1], 1)


def below(*pictures: Picture) -> Picture:
    """Pictures from top to bottom, parted by a white bar."""
    bar = np.full((24, pictures[0].shape[1], 3), 255, np.uint8)
    return np.concatenate([part for picture in pictures for part in (picture, bar)][:-1], 0)


def label(picture: Picture, text: str, x: float, y: float, height: float = 0.03) -> None:
    """Write on a picture at fractions of its width and height."""
    size = height * picture.shape[0] / 22
    at = round(x * picture.shape[1]), round(y * picture.shape[0])
    thick = max(1, round(size))
    cv2.putText(picture, text, at, cv2.FONT_HERSHEY_SIMPLEX, size, (60, 60, 60), thick, cv2.LINE_AA)


if __name__ == "__main__":
    main()
