"""The table of crayons: what lies between its two lines, and how a tip's width counts."""

import numpy as np
import pytest
from fake_box import COLOURS, PAPER, box

from stroke_gen.colour import oklab
from stroke_gen.swatches import COVERED, TIP_MM, covered, firmness

TABLE = box()


def test_bare_paper_has_no_wax_and_a_heavy_coat_is_all_wax():
    grounds = np.stack(
        [PAPER, PAPER - COVERED / 2, PAPER - COVERED, np.zeros(3, np.float32)]
    ).astype(np.float32)
    assert covered(grounds, PAPER) == pytest.approx([0, 0.5, 1, 1], abs=1e-5)


@pytest.mark.parametrize("channel", range(3))
def test_wax_is_seen_in_any_channel(channel):
    """Yellow takes the blue light only."""
    ground = PAPER.copy()
    ground[channel] -= 2 * COVERED
    assert covered(ground, PAPER) == 1


def test_wax_is_seen_on_dark_paper_too():
    dark = np.full(3, 0.02, np.float32)
    assert covered(dark, dark) == 0 and covered(dark + 2 * COVERED, dark) == 1


def test_over_paper_and_over_wax_are_the_two_lines_of_the_table():
    wax = np.array(COLOURS["red"], np.float32)
    assert np.allclose(TABLE.over(PAPER), TABLE.a[0] * PAPER + TABLE.b[0], atol=1e-6)
    assert np.allclose(TABLE.over(wax), TABLE.a[1] * wax + TABLE.b[1], atol=1e-6)


def test_between_paper_and_wax_the_colour_goes_from_one_line_to_the_other():
    shades = (PAPER - np.linspace(0, COVERED, 9)[:, None]).astype(np.float32)
    given = TABLE.over(shades)
    low, high = ([TABLE.a[on] * s + TABLE.b[on] for s in shades] for on in (0, 1))
    for between, one, other, part in zip(given, low, high, np.linspace(0, 1, 9), strict=True):
        assert np.allclose(between, one + part * (other - one), atol=1e-5)


def test_grounds_of_any_shape():
    grounds = np.random.default_rng(0).random((4, 5, 3)).astype(np.float32)
    given = TABLE.over(grounds)
    assert given.shape == (4, 5, *TABLE.a.shape[1:]) and given.dtype == np.float32
    assert np.allclose(given[2, 3], TABLE.over(grounds[2, 3]), atol=1e-6)


def test_lightness_orders_the_crayons():
    light = dict(zip(TABLE.names, TABLE.lightness(), strict=True))
    assert light["white"] > light["yellow"] > light["red"] > light["brown"] > light["black"]


def test_the_table_of_some():
    some = TABLE.only([7, 2])
    assert some.names == (TABLE.names[7], TABLE.names[2])
    assert (some.over(PAPER) == TABLE.over(PAPER)[[7, 2]]).all() and (
        some.grain == TABLE.grain[[7, 2]]
    ).all()
    assert (some.lightness() == TABLE.lightness()[[7, 2]]).all()


@pytest.mark.parametrize("hardest, left", [(0.01, 2), (0.1, 2), (0.38, 4), (0.4, 4), (2.0, 6)])
def test_a_hand_that_presses_no_harder_has_the_beginning_of_the_table(hardest, left):
    """And two pressures at least, between which tones can lie."""
    some = TABLE.upto(hardest)
    assert some.names == TABLE.names and (some.paper == TABLE.paper).all()
    assert some.pressures.tolist() == TABLE.pressures[:left].tolist()
    assert (some.over(PAPER) == TABLE.over(PAPER)[:, :left]).all()
    assert (some.grain == TABLE.grain[:, :left]).all()
    assert all(m.flags.c_contiguous for m in (some.a, some.b, some.grain)), "as kernels take them"


def test_masstone_is_the_colour_of_a_firm_hand_however_far_the_table_goes():
    firm = oklab(TABLE.over(PAPER))[:, TABLE.pressures.tolist().index(np.float32(0.38))]
    for hardest in (0.38, 0.62, 2.0):
        assert np.allclose(TABLE.upto(hardest).masstone(), firm, atol=1e-6)
    light = TABLE.upto(0.1)
    assert np.allclose(light.masstone(), oklab(light.over(PAPER))[:, -1], atol=1e-6)


def test_a_finer_tip_is_pressed_harder():
    """By less than its area shrinks: the force still falls."""
    assert firmness(TIP_MM) == pytest.approx(1)
    widths = np.array([0.5, 1.0, 2.0, 4.0, 8.0])
    firm = np.array([firmness(w) for w in widths])
    assert (np.diff(firm) < 0).all() and (np.diff(firm * widths**2) > 0).all()
    assert firmness(1.0) * firmness(TIP_MM * TIP_MM) == pytest.approx(1), (
        "half the width and twice the width undo it"
    )
