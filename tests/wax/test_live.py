"""Drawing by hand gives the wax of whole strokes, and tells what it changes."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

import crayonize
from crayonize import api, pipeline
from crayonize.images.icc import decode_srgb
from crayonize.wax import box
from crayonize.wax.live import Live
from stroke_gen.drawing import Drawing, Stroke, Tip
from stroke_gen.drawing_file import load_drawing, save_drawing

SIZE = 240
BLANK = Drawing(60.0, 40.0, "drawing", "box8", ())
TIPS = (Tip("blunt", 3.0), Tip("sharp", 1.4), Tip("side", 9.0, 30.0), Tip("rim", 3.0, -70.0))
CRAYONS = ("red", "yellow", "blue", "black")


@pytest.fixture
def live():
    return Live(BLANK, SIZE)


def draw(live, points, crayon="red", tip=TIPS[0]):
    """A stroke over points (n, 3) in mm and N; returns all changes."""
    live.press(*points[0], crayon, tip)
    return [live.move(*point) for point in points[1:]] + [live.lift()]


def straight(rng):
    """Points on a line, its heading not at the border between two of box's; often over the edge of
    the sheet.
    """
    angle = np.pi / box.HEADINGS * (rng.integers(2 * box.HEADINGS) + rng.uniform(-0.4, 0.4))
    way = np.sort(rng.uniform(0, 20, 6))
    way[0] = 0
    x, y = rng.uniform((-5, -5), (65, 45))
    return np.stack([x + way * np.cos(angle), y + way * np.sin(angle), rng.uniform(0, 4, 6)], 1)


def bent(rng):
    """Points on a way that turns, some of them nearer together than a stroke needs to begin."""
    steps = rng.normal(0, 1, (12, 2)) * rng.choice([0.1, 3], (12, 1))
    return np.column_stack(
        [rng.uniform((0, 0), (60, 40)) + np.cumsum(steps, 0), rng.uniform(0, 4, 12)]
    )


def wax(easel):
    """All that a sheet and the crayons hold."""
    sheet = easel.sheet
    arrays = (sheet.total, sheet.used, sheet.crayon, sheet.layer, sheet.blend)
    used = [
        {key: value for key, value in d.items() if value}
        for d in (easel.box.worn_um, easel.box.given_mm3)
    ]
    return [a.tobytes() for a in arrays], used


@pytest.mark.parametrize("physics", ["metric", "rudolf2003"])
@pytest.mark.parametrize("way", [straight, bent])
def test_segments_joined_are_the_strokes_of_rub(way, physics, monkeypatch):
    if way is bent:
        monkeypatch.setattr(box, "HEADINGS", 1)
    live, rng = (
        Live(Drawing(60.0, 40.0, "drawing", "box8", (), physics), SIZE),
        np.random.default_rng(3),
    )
    for number in range(60):
        draw(live, way(rng), CRAYONS[number % 3], TIPS[number % 4])
    assert len(live.easel.box.masks) > 1 + len(TIPS)  # the tips have worn
    assert wax(live.easel) == wax(pipeline.draw(live.drawing(), SIZE))


def test_a_tilted_crayon_draws_the_same_by_hand_and_from_its_strokes(live, tmp_path):
    rng = np.random.default_rng(8)
    for crayon in CRAYONS:
        points = np.column_stack([straight(rng), rng.uniform((0, -90), (60, 90), (6, 2))])
        points[2:4, 3] = 0  # upright on the way
        live.press(*points[0, :3], crayon, TIPS[0], "line", *points[0, 3:])
        for point in points[1:]:
            live.move(*point)
        live.lift()
    assert wax(live.easel) == wax(pipeline.draw(live.drawing(), SIZE))
    save_drawing(live.drawing(), tmp_path / "d.json")
    again = load_drawing(tmp_path / "d.json")
    assert wax(live.easel) == wax(pipeline.draw(again, SIZE))
    upright = replace(again, strokes=tuple(replace(s, tilt_deg=None) for s in again.strokes))
    assert wax(live.easel) != wax(pipeline.draw(upright, SIZE))


def test_saved_and_drawn_again_it_is_the_same(live, tmp_path):
    rng = np.random.default_rng(4)
    for crayon in CRAYONS:
        draw(live, straight(rng) + 0.0001234, crayon)
    save_drawing(live.drawing(), tmp_path / "mine.json")
    np.testing.assert_array_equal(api.draw(tmp_path / "mine.json", SIZE), live.picture())
    assert len(load_drawing(tmp_path / "mine.json").strokes) == len(CRAYONS)


def test_bent_strokes_drawn_again_look_the_same(live):
    rng = np.random.default_rng(5)
    for number in range(24):
        draw(live, bent(rng), CRAYONS[number % 4], TIPS[number % 4])
    redrawn = pipeline.draw(live.drawing(), SIZE)
    mine, again = (decode_srgb(p) for p in (live.picture(), redrawn.picture_srgb()))
    assert np.abs(mine - again).max() > 0  # the tips' bumps lie differently
    afar = [cv2.blur(picture, (15, 15)) for picture in (mine, again)]
    assert np.abs(afar[0] - afar[1]).mean() < 0.01
    assert np.corrcoef(afar[0].ravel(), afar[1].ravel())[0, 1] > 0.997
    assert live.easel.box.given_mm3 == pytest.approx(redrawn.box.given_mm3, rel=0.03)


@pytest.mark.parametrize("light", [True, False])
def test_changes_are_all_that_changes(light):
    live, rng = Live(BLANK, SIZE, light=light), np.random.default_rng(6)
    shown = live.picture()
    for number in range(24):
        points, tip = bent(rng), TIPS[number % 4]
        points[0, :2] = rng.choice([0, 60]), rng.choice([0, 40])
        live.press(*points[0], CRAYONS[number % 4], tip)
        for act in (*((lambda p=p: live.move(*p)) for p in points[1:]), live.lift):
            change = act()
            high, wide = change.pixels.shape[:2]
            assert change.pixels.dtype == np.uint8
            shown[change.top : change.top + high, change.left : change.left + wide] = change.pixels
            np.testing.assert_array_equal(shown, live.picture())


def test_a_change_is_little_larger_than_the_way(live):
    cell = 60 / SIZE
    (change, _) = draw(live, [(20, 20, 2), (20 + 20 * cell, 20, 2)], tip=Tip("blunt", 24 * cell))
    high, wide = change.pixels.shape[:2]
    assert 24 <= high <= 38 and 44 <= wide <= 58
    assert change.top < 80 < change.top + high and change.left < 80 < change.left + wide - 20


def test_a_stroke_waits_for_its_way_and_then_is_drawn_from_its_beginning(live):
    live.press(20, 20, 3, "red", TIPS[0])
    assert live.move(20.2, 20, 3).pixels.size == 0 and not live.easel.sheet.total.any()
    change = live.move(24, 20, 3)
    assert change.left <= 80 - 6
    assert live.easel.sheet.film_um()[80, 74:100].max() > 0


def test_pressing_alone_is_a_dab(live):
    live.press(30, 20, 3, "red", TIPS[0])
    assert not live.easel.sheet.total.any()
    change = live.lift()
    assert (change.pixels[..., 0] > change.pixels[..., 2] + 40).any()
    (dab,) = live.drawing().strokes
    assert dab.path_mm.tolist() == [[30, 20]] and dab.note == "line"
    assert (
        pipeline.draw(live.drawing(), SIZE).sheet.total.tobytes()
        == live.easel.sheet.total.tobytes()
    )


def test_beside_the_sheet_nothing_changes(live):
    assert all(
        change.pixels.shape == (0, 0, 3) for change in draw(live, [(-20, -20, 3), (-30, 60, 3)])
    )
    assert not live.easel.sheet.total.any() and len(live.drawing().strokes) == 1


def test_strokes_that_are_there_come_first():
    first = Stroke(
        np.array([[5, 5], [50, 30]], np.float32), np.full(2, 3, np.float32), "blue", TIPS[0]
    )
    live = Live(Drawing(60.0, 40.0, "kraft", "box8", (first,), seed=5), SIZE)
    np.testing.assert_array_equal(live.picture(), api.draw(live.drawing(), SIZE))
    draw(live, [(30, 5, 3), (30, 35, 3)], "yellow")
    assert [stroke.crayon for stroke in live.drawing().strokes] == ["blue", "yellow"]
    np.testing.assert_array_equal(live.picture(), api.draw(live.drawing(), SIZE))


def test_a_new_sheet_is_blank_and_no_crayon_is_used(live):
    assert live.drawing().strokes == () and not live.easel.sheet.total.any()
    np.testing.assert_array_equal(live.picture(), api.draw(BLANK, SIZE))
    assert not any(live.easel.box.worn_um.values()) and not any(live.easel.box.given_mm3.values())


# ---- what is refused -----------------------------------------------------------------------------

NAN, INF = float("nan"), float("inf")


@pytest.mark.parametrize("words, press", [
    ("x = nan", (NAN, 1, 1, "red")),
    ("y = inf", (1, INF, 1, "red")),
    ("x = 1000 is not from -60 to 120 mm", (1000, 1, 1, "red")),
    ("x = inf", (1e300, 1, 1, "red")),
    ("force = -1 is not from 0 to 100 N", (1, 1, -1, "red")),
    ("force = nan", (1, 1, NAN, "red")),
    ("no crayon \"rad\" .did you mean \"red\"", (1, 1, 1, "rad")),
    ("kind: \"flat\"", (1, 1, 1, "red", Tip("flat"))),
    ("width_mm", (1, 1, 1, "red", Tip("blunt", NAN))),
])  # fmt: skip
def test_bad_press_is_refused_and_leaves_the_sheet_usable(live, words, press):
    with pytest.raises(ValueError, match=words) as caught:
        live.press(*press)
    assert "\n" not in str(caught.value)
    draw(live, [(10, 10, 2), (20, 10, 2)])
    assert len(live.drawing().strokes) == 1


@pytest.mark.parametrize(
    "point", [(NAN, 1, 1), (1, -INF, 1), (1, 1, -0.001), (1, 1, 101), (1, 81, 1)], ids=str
)
def test_bad_move_is_refused_and_the_stroke_goes_on(live, point):
    live.press(10, 10, 2, "red")
    live.move(20, 10, 2)
    with pytest.raises(ValueError, match=r"move: .* is not from"):
        live.move(*point)
    live.move(30, 10, 2)
    live.lift()
    assert live.drawing().strokes[0].path_mm.tolist() == [[10, 10], [20, 10], [30, 10]]


def test_calls_out_of_order_are_refused(live):
    with pytest.raises(ValueError, match="move: no crayon is on the paper"):
        live.move(1, 1, 1)
    with pytest.raises(ValueError, match="lift: no crayon is on the paper"):
        live.lift()
    live.press(1, 1, 1, "red")
    with pytest.raises(ValueError, match="press: a crayon is on the paper"):
        live.press(1, 1, 1, "red")
    live.lift()
    with pytest.raises(ValueError, match="lift: no crayon"):
        live.lift()


@pytest.mark.parametrize("size", [0, 20001, 1.5])
def test_bad_size_is_refused(size):
    with pytest.raises(ValueError, match="size"):
        Live(BLANK, size)


def test_bad_drawing_is_refused():
    with pytest.raises(ValueError, match="sheet_mm"):
        Live(Drawing(NAN, 40.0, "drawing", "box8", ()), SIZE)


def test_a_tip_too_large_to_draw_with_costs_only_its_stroke(live):
    live.press(10, 10, 2, "red", Tip("blunt", 150.0))
    with pytest.raises(ValueError, match="width_mm"):
        live.move(20, 10, 2)
    with pytest.raises(ValueError, match="width_mm"):
        live.lift()
    draw(live, [(10, 10, 2), (20, 10, 2)])
    assert len(live.drawing().strokes) == 1


def test_it_is_a_public_name():
    assert crayonize.Live is Live
