"""Six small pictures as they were: whatever no law says, and that nobody meant to change."""

from pathlib import Path

import golden
import numpy as np
import pytest

from crayonize import api, pipeline
from crayonize.pages.legend import with_legend
from stroke_gen.drawing import TIP_KINDS, Drawing, Stroke, Tip
from stroke_gen.drawing_file import load_drawing

SAMPLES = Path(__file__).parents[2] / "samples"


def scribbles(paper: str = "drawing") -> Drawing:
    """Every kind of tip, from light to hard, over each other: the wax and the light alone."""
    strokes = []
    for row, kind in enumerate(TIP_KINDS):
        for col, pressure in enumerate((0.1, 0.4, 1.0)):
            tip = Tip(kind, 9.0 if kind == "side" else 4.0, 90.0)
            x, y = 8 + 30 * col, 10 + 17 * row
            ways = np.arange(12)
            path = np.stack([x + 2 * ways, y + 5 * (ways % 2)], 1).astype(np.float32)
            force = np.full(len(path), pressure * tip.area_mm2, np.float32)
            crayon = ("red", "blue", "green", "yellow")[(row + col) % 4]
            strokes.append(Stroke(path, force, crayon, tip))
    across = np.array([[5, 5], [95, 70]], np.float32)
    strokes.append(Stroke(across, np.full(2, 4, np.float32), "yellow", Tip("blunt", 5.0)))
    return Drawing(100, 75, paper, "box24", tuple(strokes), seed=3)


def photo(style: str, **choices: object) -> golden.Picture:
    """A shipped photo, small, in a style."""
    path = SAMPLES / "photos" / "astronaut.png"
    made = api.sketch(path, api.settings_of({"style": style, "size": 264, "seed": 2} | choices))
    return made[1].picture_srgb()


def legend() -> golden.Picture:
    """A drawing with its crayons beside it."""
    drawing = load_drawing(SAMPLES / "drawings" / "house.json")
    easel = pipeline.draw(drawing, 320)
    return with_legend(easel.picture_srgb(), drawing, easel)


PICTURES = {
    "scribbles": lambda: pipeline.draw(scribbles(), 320).picture_srgb(),
    "kraft": lambda: pipeline.draw(scribbles("kraft"), 320).picture_srgb(light=False),
    "artist": lambda: photo("artist"),
    "child": lambda: photo("child", palette="box16", paper="kraft"),
    "sketch": lambda: photo("sketch", left_handed=True),
    "legend": legend,
}


@pytest.mark.parametrize("name", PICTURES)
def test_golden(name: str, request: pytest.FixtureRequest) -> None:
    store = request.config.getoption("--store-golden")
    golden.compare(name, PICTURES[name](), store, exact=name in ("scribbles", "kraft", "legend"))


def test_the_comparison_can_fail(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Darker, coarser, one square wrong, another size: each is noticed, and shown; noise of a bit
    is not.
    """
    monkeypatch.setattr(golden, "GOLDEN", tmp_path)
    monkeypatch.setattr(golden, "FAILED", tmp_path / "failed")
    rng = np.random.default_rng(1)
    picture = rng.integers(60, 200, (192, 240, 3)).astype(np.uint8)
    golden.compare("one", picture, store=True)
    golden.compare("one", picture + rng.integers(0, 2, picture.shape).astype(np.uint8), store=False)
    smooth = (picture * 0.95 + picture.mean((0, 1)) * 0.05).astype(np.uint8)
    hole = picture.copy()
    hole[12:24, 24:36] = 255
    wrong = {
        "in the mean": picture - 3,
        "grain": smooth,
        "row 12, column 24": hole,
        "was": picture[:-1],
    }
    for words, other in wrong.items():
        with pytest.raises(AssertionError, match=words):
            golden.compare("one", other, store=False)
    other = picture + rng.integers(-1, 2, picture.shape).astype(np.uint8)
    golden.compare("one", other, store=False)
    with pytest.raises(AssertionError, match="pixels"):
        golden.compare("one", other, store=False, exact=True)
    for kind in ("actual", "expected", "difference"):
        assert (tmp_path / "failed" / f"one-{kind}.png").exists()
