"""The paper's figures and the two hand-written drawings: do they show what the paper's text says of
them?
"""

import importlib.util
import json
import sys
from itertools import pairwise
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from crayonize.crayons.palette_files import load_palette
from crayonize.images.read import read_linear
from crayonize.pipeline import Easel, draw
from stroke_gen.drawing_file import load_drawing

SAMPLES = Path(__file__).parents[2] / "samples"
CELL = 0.2  # mm
DRAWINGS = sorted((SAMPLES / "drawings").glob("*.json"))


@pytest.fixture(scope="module")
def figures() -> ModuleType:
    """samples/paper/figures.py as a module."""
    spec = importlib.util.spec_from_file_location("figures", SAMPLES / "paper" / "figures.py")
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def part(values: np.ndarray, easel: Easel, *box: float) -> np.ndarray:
    """A rectangle of the sheet; left, top, right and bottom in mm."""
    x0, y0, x1, y1 = (round(v / easel.sheet.cell_mm) for v in box)
    return values[y0:y1, x0:x1]


def wax_of(easel: Easel, crayon: str) -> np.ndarray:
    """Height in um of one crayon's wax on every cell, as far as it is pure."""
    sheet = easel.sheet
    used = np.arange(sheet.layer.shape[1]) < sheet.used[:, None]
    height = (sheet.layer * (used & (sheet.crayon == easel.box.palette.index(crayon)))).sum(1)
    return height.reshape(sheet.rows, sheet.cols)


def test_all_figures_are_written(figures, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["figures.py", str(tmp_path / "out"), "--cell", "0.5"])
    figures.main()
    paths = capsys.readouterr().out.split()
    assert [Path(path).name for path in paths] == [
        f"fig{n}.png" for n in ("01", "05", "08", "10", "11")
    ]
    for path in paths:
        assert read_linear(path, None).std() > 0.02, path


def test_fig01_wax_takes_the_texture_of_the_paper(figures):
    """Wax on the stipple paper repeats from dot to dot (1.2 mm), wax on the lunar paper does
    not.
    """
    cell = 0.1  # on larger ones the dots run together
    period = round(1.2 / cell)
    alike = []
    for easel in figures.papers(cell):
        waxed = part(easel.sheet.film_um() > 0.5, easel, 6, 6, 24, 24).astype(float)
        alike.append(np.corrcoef(waxed[:, :-period].ravel(), waxed[:, period:].ravel())[0, 1])
    lunar, stipple = alike
    assert stipple > lunar + 0.3


def test_fig05_more_force_leaves_more_wax(figures):
    easel = figures.forces(CELL)
    rows = [part(easel.sheet.film_um(), easel, 9, 2 + 4 * i, 41, 4 + 4 * i) for i in range(4)]
    film, cover = [row.mean() for row in rows], [(row > 0.5).mean() for row in rows]
    assert all(b > 1.5 * a for a, b in pairwise(film))
    assert all(b > a for a, b in pairwise(cover))
    assert cover[0] < 0.35 and cover[-1] > 0.6


def test_fig08_smearing_carries_wax_into_the_valleys(figures):
    alone, smeared = figures.deposition_and_smearing(CELL)
    tooth = alone.sheet.paper.reshape(alone.sheet.rows, alone.sheet.cols)
    valley = tooth < np.median(tooth)
    before, after = (
        part((easel.sheet.film_um() > 0.5) & valley, easel, 4, 4, 22, 15).mean()
        for easel in (alone, smeared)
    )
    assert after > 1.3 * before


def test_fig10_crayons_show_on_white_and_on_black(figures):
    """Heavy wax takes a third of some channel's light from white paper and doubles one on black;
    light wax less.
    """
    for easel, silent, least in zip(
        figures.crayons(CELL)[:2], ("white", "black"), (0.33, 1.0), strict=True
    ):
        change = np.abs(easel.picture(light=False) / np.array(easel.ground, np.float32) - 1)
        for i, crayon in enumerate(easel.box.palette.crayons):
            left, side = figures.SIDE * i, figures.SIDE
            light, heavy = (
                part(change, easel, left + 3, top + 3, left + side - 3, top + side - 3)
                .mean((0, 1))
                .max()
                for top in (0.0, side)
            )
            if crayon.name != silent:
                assert light < heavy and heavy > least, crayon.name


def test_fig11_a_second_crayon_prefers_bare_paper(figures):
    """Section 5 on the man's shirt: sea green lies where periwinkle left the paper bare."""
    box = (3, 3, 27, 27)
    below, above = (figures.hatch(box, 0.2, crayon, 4.0) for crayon in ("periwinkle", "sea green"))
    alone = figures.drawn("lunar", 30, 30, [above], CELL)
    both = figures.drawn("lunar", 30, 30, [below], CELL)
    film = part(both.sheet.film_um().copy(), both, 5, 5, 25, 25)
    both.draw([above])
    first, second = (
        part(wax_of(easel, "sea green"), easel, 5, 5, 25, 25) for easel in (alone, both)
    )
    assert second[film < 0.3].mean() > first[film < 0.3].mean()
    assert second[film > 4].mean() < 0.8 * first[film > 4].mean()


@pytest.mark.parametrize("path", DRAWINGS, ids=lambda path: path.stem)
def test_sample_drawings_can_be_read_and_drawn(path):
    drawing = load_drawing(path)
    palette = load_palette(drawing.palette)
    assert 50 < len(drawing.strokes) <= 150
    assert {palette.index(stroke.crayon) for stroke in drawing.strokes}
    easel = draw(drawing, 300)
    film = easel.sheet.film_um()
    assert 0.15 < (film > 1).mean() < 0.95
    assert np.isfinite(easel.picture()).all()


@pytest.mark.parametrize("path", DRAWINGS, ids=lambda path: path.stem)
def test_sample_drawings_are_fit_for_reading(path):
    """Numbers have one decimal, every stroke says what it draws."""
    strokes = json.loads(path.read_text("utf-8"))["strokes"]
    assert all(
        round(value, 1) == value
        for stroke in strokes
        for point in stroke["path"]
        for value in point
    )
    assert all(stroke["note"] for stroke in strokes)


def test_colours_stay_visible_on_black_paper():
    """Section 5 on the second picture: scattering shows the crayons' colours on black."""
    easel = draw(load_drawing(SAMPLES / "drawings" / "pyjamas.json"), 300)
    waxed = easel.sheet.film_um() > 5
    picture = easel.picture(light=False)[waxed]
    assert sum(easel.ground) < 0.05
    assert picture.mean() > 4 * np.mean(easel.ground)
    assert np.percentile(picture.max(1) - picture.min(1), 75) > 0.03
