"""Pages to draw after: the outline first, then each crayon once, light to dark, on A4 with what was
before pale.
"""

import numpy as np
import pytest
from PIL import Image

from crayonize import cli
from crayonize.crayons.palette_files import load_palette
from crayonize.pages import layout
from crayonize.pages.outline import outline_of
from crayonize.pages.steps import save_steps, steps_of
from stroke_gen.drawing import Drawing, Stroke, Tip

WIDTH, HEIGHT = 200.0, 120.0
DPI = 60  # small pages are quick
PAGE = (round(297 * DPI / 25.4), round(210 * DPI / 25.4))


@pytest.fixture(scope="module", autouse=True)
def small_pages():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(layout, "DPI", DPI)
        yield


def fill(left, right, crayon, force=3.0):
    """A plane from left to right, as one zigzag."""
    x = np.repeat(np.arange(left, right, 1.5), 2)
    y = np.tile([5, 55, 55, 5], -(-len(x) // 4))[: len(x)]
    path = WIDTH / 100 * np.stack([x, y], 1)
    return Stroke(
        path.astype(np.float32), np.full(len(x), 4 * force, np.float32), crayon, Tip("blunt", 6.0)
    )


@pytest.fixture(scope="module")
def drawing():
    """A yellow and a blue half, a black line over both and a dab of red; dark crayons first."""
    path = np.array([[20, 60], [180, 70]], np.float32)
    line = Stroke(path, np.ones(2, np.float32), "black", Tip("sharp", 1.0), "line")
    dab = Stroke(
        np.array([[140, 40]], np.float32), np.ones(1, np.float32), "red", Tip("blunt", 2.0)
    )
    return Drawing(
        WIDTH, HEIGHT, "drawing", "box8", (line, fill(50, 95, "blue"), dab, fill(5, 50, "yellow"))
    )


@pytest.fixture(scope="module")
def pages(drawing, tmp_path_factory):
    """All pages as arrays, and the names of their files."""
    folder = tmp_path_factory.mktemp("pages") / "how to"
    files = save_steps(drawing, folder)
    return [np.asarray(Image.open(file).convert("RGB")).astype(int) for file in files], [
        file.name for file in files
    ]


def test_steps_are_the_outline_and_each_crayon_light_to_dark(drawing):
    made = steps_of(drawing)
    assert [step.title for step in made] == ["the outline", "yellow", "blue", "small touches"]
    assert set(made[-1].crayons) == {"red", "black"}
    after_outline = [s for step in made[1:] for s in step.strokes]
    assert sorted(map(id, after_outline)) == sorted(map(id, drawing.strokes))


def test_hints_tell_how_hard_to_press():
    def hint(force):
        return steps_of(Drawing(WIDTH, HEIGHT, "drawing", "box8", (fill(5, 90, "red", force),)))[
            -1
        ].hint

    assert "lightly" in hint(0.8) and "firmly" in hint(3.0) and "hard" in hint(9.0)


def test_outline_holds_the_lines_and_the_border_between_colours(drawing):
    outline = outline_of(drawing, load_palette("box8"))
    assert len({s.crayon for s in outline}) == 1
    assert np.array_equal(outline[0].path_mm, drawing.strokes[0].path_mm)
    points = np.concatenate([s.path_mm for s in outline[1:]])
    border = points[np.abs(points[:, 0] - WIDTH / 2) < 8]
    assert np.ptp(border[:, 1]) > 0.7 * HEIGHT
    inside = (np.abs(points[:, 0] - 54) < 30) & (np.abs(points[:, 1] - 60) < 36)
    assert not inside.any()


def test_pages_are_a4_and_numbered(pages):
    pictures, names = pages
    assert names == [f"step-{i:02}.png" for i in range(1, 6)]
    assert {picture.shape for picture in pictures} == {(PAGE[1], PAGE[0], 3)}


def place(x_mm, y_mm):
    """The pixels of a page around a place of the drawing."""
    room = (297 - 2 * layout.MARGIN_MM, 210 - layout.HEAD_MM - layout.FOOT_MM - layout.MARGIN_MM)
    scale = min(room[0] / 100, room[1] / 60)
    x = (297 - 100 * scale) / 2 + x_mm * scale
    y = layout.HEAD_MM + y_mm * scale
    dot = DPI / 25.4
    return np.s_[
        round((y - 4) * dot) : round((y + 4) * dot), round((x - 4) * dot) : round((x + 4) * dot)
    ]


def saturation(picture, where):
    mean = picture[where].mean((0, 1))
    return mean.max() - mean.min()


def test_new_wax_is_strong_and_old_wax_pale(pages):
    (_, outline, yellow, blue, _), _ = pages
    left, right = place(27, 15), place(72, 45)
    assert saturation(outline, left) < 20 and saturation(yellow, right) < 20
    assert saturation(yellow, left) > 100 and saturation(blue, right) > 70
    assert 20 < saturation(blue, left) < saturation(yellow, left) / 1.7


def test_first_page_shows_the_finished_drawing(pages):
    first = pages[0][0]
    blueish = (first[..., 2] - first[..., 0] > 40).mean()
    yellowish = (first[..., 0] - first[..., 2] > 60).mean()
    assert blueish > 0.05 and yellowish > 0.05


def test_pdf_has_all_pages_and_is_the_same_each_time(drawing, tmp_path):
    (path,) = save_steps(drawing, tmp_path / "a.pdf")
    data = path.read_bytes()
    assert data.startswith(b"%PDF") and data.count(b"/Type /Page\n") == 5
    assert b"841.92" in data or b"841.9" in data or b"842" in data
    save_steps(drawing, tmp_path / "a.pdf")
    assert path.read_bytes() == data and list(tmp_path.iterdir()) == [path]


def test_names_of_png_pages(tmp_path):
    dab = Stroke(
        np.array([[100, 150]], np.float32), np.ones(1, np.float32), "red", Tip("blunt", 2.0), "line"
    )
    high = Drawing(200.0, 280.0, "smooth", "box8", (dab,))
    files = save_steps(high, tmp_path / "fig.png")
    assert [file.name for file in files] == ["fig-01.png", "fig-02.png"]
    assert Image.open(files[0]).size == (PAGE[1], PAGE[0])


def test_what_cannot_be_is_refused(drawing, tmp_path):
    for out, words in (
        (tmp_path / "a.doc", ".pdf"),
        (tmp_path / "none" / "a.pdf", "does not exist"),
    ):
        with pytest.raises(ValueError, match=words):
            save_steps(drawing, out)
    with pytest.raises(ValueError, match="no strokes"):
        save_steps(Drawing(30.0, 50.0, "smooth", "box8", ()), tmp_path / "a.pdf")
    assert list(tmp_path.iterdir()) == []


def test_command_makes_pages_from_lines_of_another_program(tmp_path, capsys):
    shape = (
        '<rect x="10" y="10" width="60" height="30" fill="red"/>'
        '<path stroke="blue" fill="none" d="M0 45H100"/>'
    )
    (tmp_path / "a.svg").write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 50">{shape}</svg>'
    )
    assert (
        cli.main(["steps", str(tmp_path / "a.svg"), str(tmp_path / "a.pdf"), "--palette", "box8"])
        == 0
    )
    assert (tmp_path / "a.pdf").read_bytes().count(b"/Type /Page\n") == 4
    assert cli.main(["steps", str(tmp_path / "a.svg"), str(tmp_path / "a.txt")]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.splitlines()[-1].startswith("crayonize: ") and ".pdf" in err
