"""Reading the photo: directions, tones and sizes that are known beforehand."""

from typing import get_type_hints

import cv2
import numpy as np
import pytest
from fake_box import PAPER, box

from stroke_gen import analysis
from stroke_gen.colour import from_oklab, oklab
from stroke_gen.params import Style, load_style, style_names


def angles(tangent):
    """Direction in degrees, 0 to 180."""
    return np.degrees(np.arctan2(tangent[..., 1], tangent[..., 0])) % 180


def apart(degrees, other):
    """The angle between directions, 0 to 90."""
    return np.abs((degrees - other + 90) % 180 - 90)


def clouds(seed=0, shape=(90, 120)):
    """A smooth random picture in linear light."""
    noise = np.random.default_rng(seed).random((*shape, 3)).astype(np.float32)
    smooth = cv2.GaussianBlur(noise, (0, 0), 4)
    return (smooth - smooth.min()) / (smooth.max() - smooth.min())


def test_turned_field():
    tangent = np.tile(np.array([np.cos(0.5), np.sin(0.5)], np.float32), (40, 60, 1))
    expected = angles(tangent) + 14
    assert apart(angles(analysis.turned(tangent, np.float32(14))), expected).max() < 0.01
    each = np.linspace(-40, 40, tangent[..., 0].size, dtype=np.float32).reshape(tangent.shape[:2])
    assert apart(angles(analysis.turned(tangent, each)), angles(tangent) + each).max() < 0.01


@pytest.mark.parametrize("sigma", [0.5, 3.0, 20.0])
def test_blur_keeps_flat_pictures_and_the_mean(sigma):
    assert np.allclose(analysis.blur(np.full((20, 30, 3), 0.4, np.float32), sigma), 0.4, atol=1e-6)
    picture = clouds(1, (200, 300))
    assert abs(analysis.blur(picture, sigma).mean() - picture.mean()) < 0.01


def test_blur_has_the_given_sigma():
    spot = np.zeros((101, 101), np.float32)
    spot[50, 50] = 1
    y, _ = np.mgrid[:101, :101] - 50
    assert np.sqrt((analysis.blur(spot, 6) * y * y).sum()) == pytest.approx(6, rel=0.02)


def test_far_sight_does_not_depend_on_the_size_of_the_picture():
    small = clouds(2, (150, 200))
    large = cv2.resize(small, (400, 300), interpolation=cv2.INTER_LINEAR)
    again = cv2.resize(analysis.far(large), (200, 150), interpolation=cv2.INTER_AREA)
    assert np.abs(again - analysis.far(small)).max() < 0.02


def test_far_sight_averages_light_not_codes():
    checks = np.indices((100, 100)).sum(0) % 2 * np.ones((3, 1, 1))
    seen = from_oklab(analysis.far(np.moveaxis(checks, 0, 2).astype(np.float32)))
    assert np.allclose(seen[30:70, 30:70], 0.5, atol=0.03)


def test_fit_averages_light():
    picture = np.random.default_rng(3).random((90, 120, 3)).astype(np.float32)
    assert np.allclose(
        analysis.fit(picture, (30, 40)), picture.reshape(30, 3, 40, 3, 3).mean((1, 3)), atol=1e-5
    )
    assert analysis.fit(picture[:2, :2], (40, 50)).shape == (40, 50, 3)


@pytest.mark.parametrize("size", [(297, 210), (210, 297), (297, 1), (1, 297), (5000, 3)])
def test_work_grid_is_as_long_for_every_sheet(size):
    rows, cols = analysis.work_shape(*size)
    assert max(rows, cols) == analysis.WORK_LONG and min(rows, cols) >= 2


# ---- tone ----------------------------------------------------------------------------------------


TIP = 6.0  # cells
HIGHEST_LIFT = get_type_hints(Style, include_extras=True)["lift"].__metadata__[1]
STYLES = {**{name: load_style(name) for name in style_names()}, "lifted": Style(lift=HIGHEST_LIFT)}


def ramp(low=0.0, high=1.0):
    grey = np.linspace(low, high, 500, dtype=np.float32)
    return oklab(np.repeat(grey[None, :, None], 3, 2))


@pytest.mark.parametrize("low, high", [(0, 1), (0.4, 0.42), (0, 0.08), (0.7, 1), (0, 0), (1, 1)])
@pytest.mark.parametrize("style", STYLES.values(), ids=STYLES)
def test_tones_keep_their_order_and_stay_in_reach(style, low, high):
    table = box()
    light = analysis.tone_map(ramp(low, high), table, style, TIP)[0, :, 0]
    reachable = oklab(table.over(table.paper))[..., 0]
    assert np.isfinite(light).all()
    assert np.diff(light).min() >= -1e-6
    assert reachable.min() - 0.01 <= light.min() and light.max() <= oklab(table.paper)[0] + 0.015


def test_white_becomes_paper_and_black_the_darkest_crayon():
    table = box()
    light = analysis.tone_map(ramp(), table, Style(), TIP)[0, :, 0]
    assert light[-1] == pytest.approx(oklab(table.paper)[0], abs=1e-3)
    assert light[0] == pytest.approx(table.lightness().min(), abs=1e-3)


def test_fog_is_not_stretched():
    lab = ramp(0.4, 0.42)
    assert np.ptp(analysis.tone_map(lab, box(), Style(), TIP)[..., 0]) <= np.ptp(lab[..., 0]) * 1.05


@pytest.mark.parametrize("paper", [(0.012, 0.011, 0.012), (0.45, 0.26, 0.11)])
def test_on_dark_paper_light_crayons_reach_the_lights(paper):
    table = box(np.array(paper, np.float32))
    light = analysis.tone_map(ramp(), table, Style(), TIP)[0, :, 0]
    assert light[-1] == pytest.approx(table.lightness().max(), abs=1e-3)
    assert light[0] <= oklab(table.paper)[0] + 1e-3


def test_a_light_hand_on_dark_paper_leaves_the_darks():
    """Though none of its crayons comes near to white."""
    table = box(np.full(3, 0.012, np.float32))
    for hardest in (0.1, 0.2, 0.4):
        light = analysis.tone_map(ramp(), table.upto(hardest), Style(), TIP)[0, :, 0]
        assert light[0] <= oklab(table.paper)[0] + 0.01 and np.diff(light).min() >= -1e-6


def test_tones_above_the_knee_are_kept_without_lift():
    """Only what lies near the darkest crayon or below it is drawn together."""
    table, lab = box(), ramp()
    light, given = lab[0, :, 0], analysis.tone_map(lab, table, Style(lift=0.0), TIP)[0, :, 0]
    kept = (light > table.lightness().min() + analysis.KNEE) & (light < analysis.WHITE)
    assert kept.sum() > 200 and np.abs(given - light)[kept].max() < 1e-6
    assert (given >= light - 1e-6)[light < table.lightness().min()].all(), (
        "darks are lifted, never sunk"
    )


def even(low, high, shape=(200, 600)):
    """Greys whose OKLab L rises evenly from left to right."""
    lab = np.zeros((*shape, 3), np.float32)
    lab[..., 0] = np.linspace(low, high, shape[1])
    return lab


def test_with_full_lift_tones_lie_on_one_line_from_the_darkest_crayon_to_the_paper():
    table, lab = box(), even(0, 1)
    light, given = (
        m[100, 30:-30, 0] for m in (lab, analysis.tone_map(lab, table, Style(lift=1.0), TIP))
    )
    grey = given < analysis.WHITE
    slope, rest = np.polyfit(light[grey], given[grey], 1)
    assert np.abs(slope * light + rest - given)[grey].max() < 2e-3
    assert rest == pytest.approx(table.lightness().min(), abs=0.01)
    assert 0.98 * slope + rest == pytest.approx(oklab(table.paper)[0], abs=0.01)


def test_lift_is_the_share_of_that_line():
    none, half, all_ = (
        analysis.tone_map(even(0, 1), box(), Style(lift=lift), TIP)[100, :, 0]
        for lift in (0.0, 0.5, 1.0)
    )
    dark = all_ < analysis.WHITE - 0.05
    assert np.abs(half - (none + all_) / 2)[dark].max() < 5e-3
    assert (all_ - none)[100:200].min() > 0.05, "darks are drawn lighter"


@pytest.mark.parametrize("lift", [0.5, 1.0])
def test_what_is_finer_than_a_few_tips_keeps_its_contrast(lift):
    """Stripes a tip wide on a ramp whose own contrast shrinks."""
    lab = even(0, 1)
    stripes = 0.02 * np.sign(np.sin(np.arange(200) * np.pi / TIP + 0.1))[:, None]
    striped = lab.copy()
    striped[..., 0] += stripes
    plain, given = (analysis.tone_map(m, box(), Style(lift=lift), TIP)[..., 0]
                    for m in (lab, striped))  # fmt: skip
    broad = plain[100, 350] - plain[100, 200]
    assert broad < (1 - 0.2 * lift) * (lab[100, 350, 0] - lab[100, 200, 0])
    left = np.median(np.abs(given - plain)[50:-50, 200:350]) / 0.02
    assert left > 0.95, "of the stripes' contrast"


@pytest.mark.parametrize("low, high", [(0.9, 1), (0.99, 0.99), (0.6, 1), (1, 1)])
def test_what_is_light_stays_light(low, high):
    lab = even(low, high)
    given = analysis.tone_map(lab, box(), Style(lift=1.0), TIP)[..., 0]
    assert (given >= np.minimum(lab[..., 0], oklab(PAPER)[0]) - 0.01).all()


def test_what_is_nearly_white_and_grey_becomes_paper_and_what_has_colour_does_not():
    pale = np.tile(np.array([0.95, 0.0, 0.0], np.float32), (1, 2, 1))
    pale[0, 1, 2] = 0.15
    grey, yellow = analysis.tone_map(pale, box(), Style(), TIP)[0, :, 0]
    assert grey > 0.97 > yellow == pytest.approx(0.95, abs=0.001)


def test_a_photo_within_reach_keeps_its_tones():
    lab = ramp(0.1, 0.5)
    assert np.allclose(analysis.tone_map(lab, box(), Style(), TIP)[..., 0], lab[..., 0], atol=1e-6)


def test_hue_is_kept_and_chroma_follows_the_style():
    lab = oklab(clouds(4) * 0.6 + 0.1)
    plain, rich = (analysis.tone_map(lab, box(), Style(chroma=c, skin=0), TIP) for c in (1.0, 1.5))
    assert np.allclose(plain[..., 1:], lab[..., 1:], atol=1e-5)
    assert np.allclose(rich[..., 1:], 1.5 * lab[..., 1:], atol=1e-5)
    skin = analysis.tone_map(lab, box(), Style(skin=1.0), TIP)
    assert (
        np.hypot(*np.moveaxis(skin[..., 1:], 2, 0))
        >= np.hypot(*np.moveaxis(lab[..., 1:], 2, 0)) - 1e-6
    ).all()


# ---- detail --------------------------------------------------------------------------------------


def test_detail_lies_where_small_things_are():
    light = np.full((120, 160, 3), 0.6, np.float32)
    light[20:30:3, 20:30] = 0.05
    level = analysis.detail(oklab(light), 6)
    assert level[25, 25] > 0.5 and level[90, 120] == 0
    assert level.min() >= 0 and level.max() <= 1


def test_a_soft_shade_is_no_detail():
    shade = np.zeros((60, 200, 3), np.float32)
    shade[..., 0] = np.linspace(0.1, 0.9, 200)
    assert analysis.detail(shade, 6).max() < 0.05


def test_calmed_keeps_borders_and_takes_texture_away():
    light = np.full((60, 80, 3), 0.2, np.float32)
    light[:, 40:] = 0.8
    noisy = light + 0.1 * np.random.default_rng(6).standard_normal(light.shape).astype(np.float32)
    calm = analysis.calmed(noisy, 4)
    assert np.abs(calm - light)[:, :38].std() < 0.4 * np.abs(noisy - light)[:, :38].std()
    assert np.abs(analysis.calmed(light, 4) - light).max() < 1e-4


def test_drawn_frame_of_a_scan_is_not_seen():
    light = np.full((200, 300, 3), 0.7, np.float32)
    light[0], light[-1], light[:, 0], light[:, -1] = 0, 0, 0, 0
    assert analysis.unframed(light).min() == pytest.approx(0.7)
