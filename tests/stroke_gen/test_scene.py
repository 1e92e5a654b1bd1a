"""The scene: a photo of any shape becomes maps of one size, all within their ranges."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from fake_box import box

from stroke_gen import analysis, scene
from stroke_gen.colour import from_oklab
from stroke_gen.params import Style
from stroke_gen.subject import Subject


@pytest.fixture(autouse=True)
def coarse(monkeypatch):
    monkeypatch.setattr(analysis, "WORK_LONG", 155)


def seen_of(photo, mask=None, style=None, focus=(), long_mm=72.0):
    scale = long_mm / max(photo.shape)
    width, height = photo.shape[1] * scale, photo.shape[0] * scale
    mask = np.zeros(analysis.work_shape(width, height), np.float32) if mask is None else mask
    with ThreadPoolExecutor(2) as pool:
        return scene.read(
            photo, Subject((), mask), (width, height), box(), style or Style(), focus, pool
        )


@pytest.mark.parametrize("shape", [(1, 1), (1, 50), (50, 1), (2, 2), (5, 400), (90, 120)])
def test_a_photo_of_any_shape_gives_finite_maps_of_the_grid(shape):
    seen = seen_of(np.random.default_rng(5).random((*shape, 3)).astype(np.float32))
    grid = seen.target.shape[:2]
    assert max(grid) == 155
    for name in (
        "target",
        "lab",
        "natural",
        "tangent",
        "coherence",
        "skin",
        "hair",
        "care",
        "detail",
    ):
        values = getattr(seen, name)
        assert (
            values.dtype == np.float32 and np.isfinite(values).all() and values.shape[:2] == grid
        ), name
    for name in ("coherence", "skin", "hair", "care", "detail"):
        assert getattr(seen, name).min() >= -1e-6 and getattr(seen, name).max() <= 1 + 1e-3, name
    assert seen.guide.lab.shape == seen.lab.shape
    assert np.allclose(np.hypot(*np.moveaxis(seen.tangent, 2, 0)), 1, atol=1e-4)


def test_target_and_lab_are_the_same_colours():
    seen = seen_of(np.random.default_rng(6).random((12, 16, 3)).astype(np.float32))
    assert np.abs(from_oklab(seen.lab) - seen.target).max() < 1e-4


def test_a_family_is_made_of_whole_surfaces():
    seen = seen_of(
        np.random.default_rng(7).random((6, 8, 3)).astype(np.float32).repeat(20, 0).repeat(20, 1)
    )
    assert seen.label.max() > 3
    for surface in range(seen.label.max() + 1):
        assert len(np.unique(seen.family[seen.label == surface])) == 1
    assert np.array_equal(np.unique(seen.family), np.arange(seen.family.max() + 1))


def test_colours_are_calmed_in_the_ground_and_kept_where_care_is_due():
    """Texture goes from what a thick crayon aims at, but not from what is drawn with care."""
    photo = 0.5 + 0.08 * np.random.default_rng(8).standard_normal((116, 155, 3)).astype(np.float32)
    mask = np.zeros((116, 155), np.float32)
    mask[:, :70] = 1
    guide = seen_of(np.clip(photo, 0, 1), mask).guide.lab[..., 0]
    assert guide[10:-10, 100:-10].std() < 0.7 * guide[10:-10, 10:50].std()


def test_detail_is_worth_more_where_care_is_due():
    photo = np.full((116, 155, 3), 0.6, np.float32)
    photo[40:60:3, 20:40] = photo[40:60:3, 110:130] = 0.05
    mask = np.zeros((116, 155), np.float32)
    mask[:, :70] = 1
    detail = seen_of(photo, mask).detail
    assert detail[40:60, 20:40].mean() > 1.5 * detail[40:60, 110:130].mean() > 0


def test_focus_is_where_care_is_due():
    photo = np.full((116, 155, 3), 0.6, np.float32)
    care = seen_of(photo, focus=[(0.6, 0.5, 0.25, 0.25)]).care
    assert care[72, 112] > 0.9 and care[10, 10] < 0.1
