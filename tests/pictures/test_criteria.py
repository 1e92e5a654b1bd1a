"""The figures of criteria.py themselves: on patterns whose answer is known, and once on a
drawing.
"""

import criteria
import cv2
import numpy as np
import pytest

from crayonize.settings import Settings
from stroke_gen import analysis
from stroke_gen.drawing import Stroke, Tip

SHAPE = (120, 160)


def even(degrees):
    angle = np.full(SHAPE, np.deg2rad(degrees))
    return np.dstack([np.cos(angle), np.sin(angle)]).astype(np.float32)


def stripes(degrees):
    """Lightness of stripes that run at an angle."""
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    across = y * np.cos(np.deg2rad(degrees)) - x * np.sin(np.deg2rad(degrees))
    return (50 + 20 * np.sin(across * 1.2)).astype(np.float32)


def line(*points, width=4.0):
    path = np.array(points, np.float32)
    return Stroke(path, np.ones(len(path), np.float32), "red", Tip("blunt", width), "fill")


EVERYWHERE = np.ones(SHAPE, np.bool_)


@pytest.mark.parametrize("degrees", [-50, 0, 30, 90])
def test_alignment_of_stripes(degrees):
    for turn, expected in ((0, 1), (45, 0), (90, -1)):
        found = criteria.alignment(stripes(degrees), even(degrees + turn), 6.0, EVERYWHERE)
        assert found == pytest.approx(expected, abs=0.07)


def test_alignment_of_noise():
    noise = 50 + 10 * np.random.default_rng(0).standard_normal(SHAPE).astype(np.float32)
    assert abs(criteria.alignment(noise, even(-50), 6.0, EVERYWHERE)) < 0.05
    assert criteria.alignment(np.full(SHAPE, 50, np.float32), even(0), 6.0, ~EVERYWHERE) is None


@pytest.mark.parametrize("degrees, expected", [(0, 1), (45, 0), (90, -1), (30, 0.5)])
def test_strokes_against_a_field(degrees, expected):
    strokes = [line((10, 20), (20, 20), (50, 20))] * 2
    laid = criteria.Hatching(np.ones(SHAPE), even(degrees), np.zeros(6, np.int32), strokes)
    assert criteria.followed([(laid, laid.tangent)], 1.0) == pytest.approx(expected, abs=1e-3)
    assert criteria.followed([], 1.0) is None


def test_plain_ground():
    light = np.full(SHAPE, 60, np.float32)
    light[:, 100:] = 30
    plain = criteria.plain_ground(light, 3.0)
    assert plain[:, :80].all() and plain[:, 120:].all() and not plain[:, 98:102].any()


def test_bands_are_as_wide_as_the_tip():
    (band,) = criteria.bands([line((10, 30), (90, 30), width=8)], SHAPE, 0.5)
    assert band[:, 100].sum() == pytest.approx(16, abs=2) and band[60, 25:175].all()


def test_distances():
    area = np.zeros(SHAPE, np.bool_)
    area[:, :50] = True
    beyond = criteria.distance(area)
    assert criteria.furthest(np.array([[10.0, 10.0], [59.5, 60.0]]), beyond) == pytest.approx(
        10, abs=0.6
    )
    assert criteria.furthest(np.array([[10.0, 10.0]]), beyond) == 0


def test_turning():
    corner = line((0, 0), (10, 0), (10, 10))
    laid = criteria.Hatching(np.ones(SHAPE), even(0), np.zeros(3, np.int32), [corner])
    assert criteria.turning(laid, 1.0).max() == pytest.approx(90, abs=1)
    laid.leg = np.array([0, 0, 1], np.int32)
    assert criteria.turning(laid, 1.0).max() < 1, "turns between legs do not count"


@pytest.fixture(scope="module")
def row():
    """The figures of a red disc on white."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(analysis, "WORK_LONG", 260)
        photo = np.tile(np.array([0.94, 0.94, 0.92], np.float32), (240, 320, 1))
        cv2.circle(photo, (160, 120), 90, (0.3, 0.03, 0.03), -1)
        return criteria.measure(photo, Settings(size=480, sheet_mm=120.0))


def test_bare_paper_is_left(row):
    assert row["reserve"] > 0.99


def test_figures_of_a_drawing(row):
    assert row["follow"] > 0.9 and row["form"] <= row["follow"] + 0.05 and row["hatch"] > 0.05
    assert row["covered"] > 0.9 and row["wax"] > 0.5
    assert row["spilt"] < 0.3 and row["sharp"] < 0.01 and row["layers"] >= 1
    assert row["strokes"][0] > 50 and row["crayons"] >= 1
