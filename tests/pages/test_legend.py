"""The legend shows each crayon that was used, as real wax, and leaves the drawing as it is."""

import numpy as np
import pytest

from crayonize import pipeline
from crayonize.crayons.palette_files import load_palette
from crayonize.images.icc import encode_srgb
from crayonize.pages import legend
from crayonize.pages.legend import used_crayons, with_legend
from stroke_gen.drawing import Drawing, Stroke, Tip


def drawing_of(crayons, width, height, paper="drawing"):
    """One stroke of each crayon across the sheet."""
    strokes = []
    for i, crayon in enumerate(crayons):
        path = np.array([[5, 5 + 6 * i], [width - 5, 5 + 6 * i]], np.float32)
        strokes.append(Stroke(path, np.full(2, 3.0, np.float32), crayon, Tip("blunt", 3.0)))
    return Drawing(float(width), float(height), paper, "box8", tuple(strokes))


def made(drawing, size=500):
    """The easel, the picture, and the picture with its legend."""
    easel = pipeline.draw(drawing, size)
    picture = encode_srgb(easel.picture())
    return easel, picture, with_legend(picture, drawing, easel)


def test_crayons_are_those_used_light_to_dark():
    used = used_crayons(
        load_palette("box8"), {"black": 3.0, "yellow": 700.0, "red": 1.0, "blue": 0.0}
    )
    assert [one.crayon.name for one in used] == ["yellow", "red", "black"]
    assert [one.amount for one in used] == [
        "14 mm of the stick",
        "0.1 mm of the stick",
        "0.1 mm of the stick",
    ]


def test_wide_drawing_has_its_legend_below():
    _, picture, whole = made(drawing_of(("red", "blue"), 100, 60))
    assert whole.shape[1] == picture.shape[1] and whole.shape[0] > picture.shape[0]
    assert np.array_equal(whole[: picture.shape[0]], picture)


def test_high_drawing_has_its_legend_beside():
    _, picture, whole = made(drawing_of(("red", "blue"), 60, 100))
    assert whole.shape[0] == picture.shape[0] and whole.shape[1] > picture.shape[1]
    assert np.array_equal(whole[:, : picture.shape[1]], picture)


@pytest.mark.parametrize(
    "crayons", [("red",), ("red", "yellow", "blue", "green", "brown", "black", "orange")]
)
def test_each_crayon_has_a_patch_of_its_colour(crayons):
    drawing = drawing_of(crayons, 100, 60)
    easel, picture, whole = made(drawing)
    panel = whole[picture.shape[0] :].astype(int)
    unit = whole.shape[1] / 297
    used = used_crayons(easel.box.palette, easel.box.given_mm3)
    assert len(used) == len(crayons)
    across = max(1, int((297 - 2 * legend.MARGIN) // legend.ENTRY[0]))
    wide = (297 - 2 * legend.MARGIN) / across
    for i, one in enumerate(used):
        x = legend.MARGIN + (i % across) * wide + legend.PATCH[0] / 2
        y = legend.MARGIN + legend.TITLE + (i // across) * legend.ENTRY[1] + legend.PATCH[1] / 2
        part = panel[
            round((y - 2) * unit) : round((y + 2) * unit),
            round((x - 3) * unit) : round((x + 3) * unit),
        ]
        wanted = [int(one.crayon.hex[c : c + 2], 16) for c in (1, 3, 5)]
        near = np.abs(part.mean((0, 1)) - wanted).max()
        assert near < 70 and near < np.abs(252 - np.array(wanted)).max() / 2, one.crayon.name


def test_ink_is_pale_on_black_card():
    light = drawing_of(("red",), 100, 60)
    dark = drawing_of(("yellow",), 100, 60, "black")
    for drawing, is_pale in ((light, False), (dark, True)):
        _, picture, whole = made(drawing)
        panel = whole[picture.shape[0] :].astype(int)
        paper = np.median(panel)
        title = panel[: panel.shape[0] // 3]
        assert (title.max() - paper > 60) == is_pale and (paper - title.min() > 60) != is_pale


def test_same_drawing_same_legend():
    drawing = drawing_of(("red", "blue"), 100, 60)
    assert np.array_equal(made(drawing)[2], made(drawing)[2])


@pytest.mark.parametrize("size", [8, 40])
def test_small_pictures_have_a_legend_too(size):
    _, picture, whole = made(drawing_of(("red", "blue"), 100, 60), size)
    assert whole.shape[1] == picture.shape[1]
