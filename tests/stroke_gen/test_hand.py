"""The hand: what it adds to ideal lines has the size the style says, and survives the drawing's
file.
"""

from dataclasses import replace

import numpy as np
import pytest

from stroke_gen import hand
from stroke_gen.drawing import Drawing, Tip
from stroke_gen.drawing_file import load_drawing, save_drawing
from stroke_gen.hand import Paths
from stroke_gen.params import Style, load_style

STEADY = Style(force_spread=0, swell=0, wobble=0, overshoot=0)
TIP = Tip("blunt", 2.0)
AREA = TIP.area_mm2


def lines(number=1, points=101, legs=1, pressure=0.3):
    """Straight level lines of 50 mm, one above the other, in units of 0.5 mm; each leg runs
    back.
    """
    one = np.stack([np.linspace(0, 100, points), np.zeros(points)], 1)
    path = np.concatenate(
        [(one if leg % 2 == 0 else one[::-1]) + [0, 3 * leg] for leg in range(legs)]
    )
    all_ = np.concatenate([path + np.array([20, 20 + 3 * legs * n]) for n in range(number)]).astype(
        np.float32
    )
    leg = np.tile(np.repeat(np.arange(legs), points), number).astype(np.int32)
    return Paths(
        all_, np.full(len(all_), pressure, np.float32), leg, np.arange(number + 1) * points * legs
    )


def drawn(paths, style=STEADY, tip=TIP, seed=0):
    return hand.draw(paths, 0.5, "red", tip, "coat", style, np.random.default_rng(seed))


def test_steady_hand_draws_the_line_itself():
    (stroke,) = drawn(lines())
    assert (stroke.crayon, stroke.tip, stroke.note) == ("red", TIP, "coat")
    assert np.abs(stroke.path_mm - lines().points * 0.5).max() <= 0.0006
    assert stroke.path_mm.dtype == stroke.force_n.dtype == np.float32


def test_force_is_pressure_times_the_area_of_the_tip():
    (stroke,) = drawn(lines(pressure=0.3))
    assert stroke.force_n[50] == pytest.approx(0.3 * AREA, abs=1e-3)
    (harder,) = drawn(lines(pressure=0.3), replace(STEADY, press=1.7))
    assert harder.force_n[50] == pytest.approx(1.7 * stroke.force_n[50], abs=2e-3)


def test_lines_begin_and_end_lightly():
    (stroke,) = drawn(lines())
    force, along = stroke.force_n, stroke.path_mm[:, 0] - 10
    assert 0.2 < force[0] / force[50] < 0.7 and force[-1] == pytest.approx(force[0], rel=0.01)
    inner = (along > hand.HATCH_TAPER * 2.0) & (along < 50 - hand.HATCH_TAPER * 2.0)
    assert np.ptp(force[inner]) < 0.002
    assert (np.diff(force[:3]) >= 0).all() and (np.diff(force[-3:]) <= 0).all()


@pytest.mark.parametrize("taper", [1.0, 3.0, 6.0])
def test_a_line_comes_to_its_full_force_within_its_taper(taper):
    (stroke,) = hand.draw(lines(), 0.5, "red", TIP, "line", STEADY, np.random.default_rng(0), taper)
    force, along = stroke.force_n, stroke.path_mm[:, 0] - 10
    full = np.minimum(along, 50 - along) >= taper * TIP.width_mm
    assert np.ptp(force[full]) < 0.002
    rising = np.diff(force[along < taper * TIP.width_mm])
    assert (rising > 0).all() and np.ptp(rising) < 0.003, "evenly"
    assert np.allclose(force, force[::-1], atol=2e-3)


def test_a_short_line_never_comes_to_its_full_force():
    (short,) = drawn(lines(points=3), tip=Tip("blunt", 40.0))
    (long,) = drawn(lines(points=101), tip=Tip("blunt", 8.0))
    assert short.force_n.max() / 40.0**2 < 0.9 * long.force_n.max() / 8.0**2


def test_pressure_dips_where_a_zigzag_turns():
    (stroke,) = drawn(lines(legs=4))
    middle = stroke.force_n[150]
    assert stroke.force_n[100] == pytest.approx((1 - hand.TURN_DIP) * middle, rel=0.01)
    assert stroke.force_n[101] == stroke.force_n[100] < 0.95 * middle
    assert stroke.force_n[[20, 150, 250]] == pytest.approx([middle] * 3, rel=0.01)


def test_overshoot_is_the_absolute_value_of_a_normal_deviate():
    strokes = drawn(lines(3000, points=5), replace(STEADY, overshoot=0.5))
    ends = np.array([[10 - s.path_mm[0, 0], s.path_mm[-1, 0] - 60] for s in strokes]).ravel()
    sigma = 0.5 * 2.0
    assert ends.min() >= -1e-3, "never inwards"
    assert ends.mean() == pytest.approx(sigma * np.sqrt(2 / np.pi), rel=0.05)
    assert np.sqrt((ends**2).mean()) == pytest.approx(sigma, rel=0.05)
    assert all(np.abs(s.path_mm[1:-1] - s2.path_mm[1:-1]).max() < 0.002
               for s, s2 in zip(strokes, drawn(lines(3000, points=5)), strict=True))  # fmt: skip


@pytest.mark.parametrize("wobble", [0.05, 0.2])
def test_wobble_has_its_size_and_is_slow(wobble):
    strokes = drawn(lines(200), replace(STEADY, wobble=wobble))
    ideal = lines(200).points.reshape(200, 101, 2) * 0.5
    aside = np.array([s.path_mm for s in strokes]) - ideal
    assert np.abs(aside[..., 0]).max() < 0.002, "sideways only"
    assert 0.65 * wobble * 2.0 < aside[..., 1].std() < 1.1 * wobble * 2.0
    assert np.abs(np.diff(aside[..., 1], axis=1)).std() < 0.15 * aside[..., 1].std()
    assert np.corrcoef(aside[:, :, 1])[0, 1:].mean() < 0.3, "each line has its own"


def test_swell_has_its_size():
    strokes = drawn(lines(200), replace(STEADY, swell=0.2))
    middle = np.array([s.force_n[10:-10] for s in strokes]) / (0.3 * AREA)
    assert 0.13 < middle.std() < 0.22 and middle.mean() == pytest.approx(1, abs=0.03)


def test_force_spreads_from_leg_to_leg():
    strokes = drawn(lines(500, points=21, legs=3), replace(STEADY, force_spread=0.25))
    middles = np.log([s.force_n[[10, 31, 52]] for s in strokes])
    assert middles.std() == pytest.approx(0.25, rel=0.1)
    assert np.abs(np.corrcoef(middles.T)[0, 1]) < 0.15
    assert all(np.ptp(s.force_n[5:16]) < 0.002 for s in strokes)


def test_dabs_and_nothing():
    dab = Paths(
        np.array([[4, 5]], np.float32),
        np.full(1, 0.4, np.float32),
        np.zeros(1, np.int32),
        np.array([0, 1]),
    )
    (stroke,) = drawn(dab, load_style("child"))
    assert (
        stroke.path_mm.shape == (1, 2)
        and np.isfinite(stroke.force_n).all()
        and stroke.force_n[0] > 0
    )
    nothing = Paths(
        np.empty((0, 2), np.float32),
        np.empty(0, np.float32),
        np.empty(0, np.int32),
        np.zeros(1, np.int64),
    )
    assert drawn(nothing) == []


def test_points_that_coincide_do_no_harm():
    still = replace_points(lines(2, points=9), 7.0)
    strokes = drawn(still, load_style("child"))
    assert all(np.isfinite(s.path_mm).all() and np.isfinite(s.force_n).all() for s in strokes)


def replace_points(paths, value):
    return replace(paths, points=np.full_like(paths.points, value))


def test_on_a_thread_of_a_sheet_the_hand_is_held_back():
    strokes = drawn(lines(50), replace(load_style("child"), wobble=1.0), Tip("blunt", 4.0))
    held = hand.within(strokes, (297.0, 8.0))
    points = np.concatenate([s.path_mm for s in held])
    assert points[:, 1].min() >= -8 and points[:, 1].max() == 16
    assert hand.within(strokes, (297.0, 210.0)) == strokes
    for one, two in zip(strokes, held, strict=True):
        assert (one.force_n == two.force_n).all()


@pytest.mark.parametrize("pressure", [0.0, 1e-6, 50.0])
def test_forces_stay_within_the_limits_of_a_drawing(pressure):
    for stroke in drawn(lines(20, pressure=pressure), load_style("child"), Tip("blunt", 30.0)):
        assert stroke.force_n.min() > 0 and stroke.force_n.max() <= 100


def test_saving_and_loading_changes_nothing(tmp_path):
    strokes = drawn(lines(300, points=37, legs=3), load_style("child"), Tip("blunt", 3.7))
    for stroke in strokes:
        for values in (stroke.path_mm, stroke.force_n):
            assert (values == np.round(values.astype(float), 3).astype(np.float32)).all()
    drawing = Drawing(297.0, 2000.0, "drawing", "box24", tuple(strokes))
    save_drawing(drawing, tmp_path / "d.json")
    for one, two in zip(strokes, load_drawing(tmp_path / "d.json").strokes, strict=True):
        assert (one.path_mm == two.path_mm).all() and (one.force_n == two.force_n).all()
        assert (one.crayon, one.tip, one.note) == (two.crayon, two.tip, two.note)


def test_same_seed_same_hand():
    style = load_style("child")
    one, two, other = (drawn(lines(5), style, seed=seed) for seed in (3, 3, 4))
    assert all(
        (a.path_mm == b.path_mm).all() and (a.force_n == b.force_n).all()
        for a, b in zip(one, two, strict=True)
    )
    assert all((a.path_mm != b.path_mm).any() for a, b in zip(one, other, strict=True))
