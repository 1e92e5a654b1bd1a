"""Reading the photo: directions, tones and sizes that are known beforehand."""

from concurrent.futures import ThreadPoolExecutor
from typing import get_type_hints

import cv2
import numpy as np
import pytest
from fake_box import box

from stroke_gen import analysis
from stroke_gen.colour import from_oklab, oklab
from stroke_gen.params import Style, load_style, style_names

WRIST = np.deg2rad(-50)


def grating(degrees, size=160, period=12.0):
    """Grey stripes that run at an angle (y down), in OKLab."""
    y, x = np.mgrid[:size, :size].astype(np.float32)
    across = y * np.cos(np.deg2rad(degrees)) - x * np.sin(np.deg2rad(degrees))
    grey = 0.5 + 0.4 * np.sin(2 * np.pi * across / period)
    return oklab(np.repeat(grey[..., None], 3, 2).astype(np.float32))


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


@pytest.mark.parametrize("degrees", range(0, 180, 15))
def test_grating_angle_is_recovered_within_a_degree(degrees):
    tangent, coherence = analysis.orientation(grating(degrees), 4, WRIST, wrist=0)
    inner = np.s_[20:-20, 20:-20]
    assert apart(angles(tangent[inner]), degrees).max() < 1
    assert coherence[inner].min() > 0.9


@pytest.mark.parametrize("degrees", range(0, 180, 30))
def test_wrist_pulls_a_grating_towards_itself_but_a_little(degrees):
    tangent, _ = analysis.orientation(grating(degrees), 4, WRIST, wrist=0.3)
    mean = angles(tangent[80, 80])
    assert apart(mean, degrees) < 15
    assert apart(mean, -50) <= apart(degrees, -50) + 0.5


@pytest.mark.parametrize("wrist_deg", [-50, 0, 35, 90])
@pytest.mark.parametrize("light", [0.0, 0.3, 1.0])
def test_flat_picture_takes_the_angle_of_the_wrist(wrist_deg, light):
    flat = oklab(np.full((40, 60, 3), light, np.float32))
    tangent, coherence = analysis.orientation(flat, 4, np.deg2rad(wrist_deg), wrist=0.3)
    assert apart(angles(tangent), wrist_deg).max() < 0.1
    assert coherence.max() < 0.01


def test_without_form_or_wrist_directions_are_still_defined():
    tangent, coherence = analysis.orientation(np.zeros((30, 40, 3), np.float32), 4, WRIST, wrist=0)
    assert np.isfinite(coherence).all()
    assert np.allclose(np.hypot(*np.moveaxis(tangent, 2, 0)), 1, atol=1e-5)


def test_heavy_wrist_overrules_the_form():
    tangent, _ = analysis.orientation(grating(20), 4, WRIST, wrist=100)
    assert apart(angles(tangent), -50).max() < 2


def test_mirrored_picture_has_the_mirrored_field():
    lab = oklab(clouds())
    tangent, coherence = analysis.orientation(lab, 5, WRIST, 0.3)
    mirrored, same = analysis.orientation(np.ascontiguousarray(lab[:, ::-1]), 5, -WRIST, 0.3)
    expected = 180 - angles(tangent[:, ::-1])
    assert np.percentile(apart(angles(mirrored), expected), 99.5) < 0.5
    assert np.abs(same - coherence[:, ::-1]).max() < 0.01


def test_stripes_far_apart_direct_what_lies_between_them():
    """A flat area between two borders follows them, the wrist only helps."""
    light = np.full((120, 120, 3), 0.2, np.float32)
    light[40:80] = 0.7
    tangent, _ = analysis.orientation(oklab(light), 5, WRIST, 0.15)
    assert apart(angles(tangent[60, 20:100]), 0).max() < 20


def test_turned_field():
    tangent, _ = analysis.orientation(grating(30), 4, WRIST, 0)
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
    assert np.allclose(analysis.fit(picture, (30, 40)), picture.reshape(30, 3, 40, 3, 3).mean((1, 3)), atol=1e-5)
    assert analysis.fit(picture[:2, :2], (40, 50)).shape == (40, 50, 3)


@pytest.mark.parametrize("size", [(297, 210), (210, 297), (297, 1), (1, 297), (5000, 3)])
def test_work_grid_is_as_long_for_every_sheet(size):
    rows, cols = analysis.work_shape(*size)
    assert max(rows, cols) == analysis.WORK_LONG and min(rows, cols) >= 2


# ---- tone ------------------------------------------------------------------------------------------------


HIGHEST_LIFT = get_type_hints(Style, include_extras=True)["lift"].__metadata__[1]
STYLES = {**{name: load_style(name) for name in style_names()}, "lifted": Style(lift=HIGHEST_LIFT)}


def ramp(low=0.0, high=1.0):
    grey = np.linspace(low, high, 500, dtype=np.float32)
    return oklab(np.repeat(grey[None, :, None], 3, 2))


@pytest.mark.parametrize("low, high", [(0, 1), (0.4, 0.42), (0, 0.08), (0.7, 1), (0, 0), (1, 1)])
@pytest.mark.parametrize("style", STYLES.values(), ids=STYLES)
def test_tones_keep_their_order_and_stay_in_reach(style, low, high):
    table = box()
    light = analysis.tone_map(ramp(low, high), table, style)[0, :, 0]
    reachable = oklab(table.over(table.paper))[..., 0]
    assert np.isfinite(light).all()
    assert np.diff(light).min() >= -1e-6
    assert reachable.min() - 0.01 <= light.min() and light.max() <= oklab(table.paper)[0] + 0.015


def test_white_becomes_paper_and_black_the_darkest_crayon():
    table = box()
    light = analysis.tone_map(ramp(), table, Style())[0, :, 0]
    assert light[-1] == pytest.approx(oklab(table.paper)[0], abs=1e-3)
    assert light[0] == pytest.approx(table.lightness().min(), abs=1e-3)


def test_fog_is_not_stretched():
    lab = ramp(0.4, 0.42)
    assert np.ptp(analysis.tone_map(lab, box(), Style())[..., 0]) <= np.ptp(lab[..., 0]) * 1.05


@pytest.mark.parametrize("paper", [(0.012, 0.011, 0.012), (0.45, 0.26, 0.11)])
def test_on_dark_paper_light_crayons_reach_the_lights(paper):
    table = box(np.array(paper, np.float32))
    light = analysis.tone_map(ramp(), table, Style())[0, :, 0]
    assert light[-1] == pytest.approx(table.lightness().max(), abs=1e-3)
    assert light[0] <= oklab(table.paper)[0] + 1e-3


def test_hue_is_kept_and_chroma_follows_the_style():
    lab = oklab(clouds(4) * 0.6 + 0.1)
    plain, rich = (analysis.tone_map(lab, box(), Style(chroma=c, skin=0)) for c in (1.0, 1.5))
    assert np.allclose(plain[..., 1:], lab[..., 1:], atol=1e-5)
    assert np.allclose(rich[..., 1:], 1.5 * lab[..., 1:], atol=1e-5)
    skin = analysis.tone_map(lab, box(), Style(skin=1.0))
    assert (np.hypot(*np.moveaxis(skin[..., 1:], 2, 0)) >= np.hypot(*np.moveaxis(lab[..., 1:], 2, 0)) - 1e-6).all()


# ---- detail ----------------------------------------------------------------------------------------------


def test_detail_lies_where_small_things_are_and_in_the_focus():
    light = np.full((120, 160, 3), 0.6, np.float32)
    light[20:30:3, 20:30] = 0.05
    flat_focus = (0.6, 0.5, 0.25, 0.25)
    level = analysis.detail(oklab(light), 6, [])
    assert level[25, 25] > 0.5 and level[90, 120] == 0
    focused = analysis.detail(oklab(light), 6, [flat_focus])
    assert focused[75, 116] > 0.9 and focused[110, 20] < 0.05
    assert level.min() >= 0 and level.max() <= 1


def test_scene_of_a_photo_is_finite_on_every_shape():
    for shape in ((1, 1), (1, 50), (50, 1), (2, 2), (5, 400)):
        photo = np.random.default_rng(5).random((*shape, 3)).astype(np.float32)
        scale = 297 / max(shape)
        scene = analysis.read(photo, shape[1] * scale, shape[0] * scale, box(), Style(), [], ThreadPoolExecutor(2))
        for values in (scene.target, scene.lab, scene.calm, scene.tangent, scene.coherence, scene.detail):
            assert values.dtype == np.float32 and np.isfinite(values).all()
            assert values.shape[:2] == analysis.work_shape(shape[1] * scale, shape[0] * scale)


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
