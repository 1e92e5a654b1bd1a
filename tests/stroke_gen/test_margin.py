"""What is left out: the sheet's border and, in a sketch, the far ground; ragged, and never the
subject.
"""

import numpy as np
import pytest

from stroke_gen import margin

SHAPE = (150, 220)
TIP = 5.0


def rng(seed=0):
    return np.random.default_rng(seed)


def disc(radius=35.0, shape=SHAPE):
    """Care of one who sits in the middle."""
    y, x = np.mgrid[: shape[0], : shape[1]]
    return (np.hypot(x - shape[1] / 2, y - shape[0] / 2) < radius).astype(np.float32)


def from_border(shape=SHAPE):
    y, x = np.mgrid[: shape[0], : shape[1]]
    return np.minimum(np.minimum(x, y), np.minimum(shape[1] - 1 - x, shape[0] - 1 - y))


# ---- margin --------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("width", [4.0, 10.0, 20.0])
def test_the_margin_is_as_wide_as_asked_give_or_take_a_tip(width, seed):
    inside = margin.inside(SHAPE, width, TIP, rng(seed))
    off = from_border()
    assert inside.dtype == np.float32 and set(np.unique(inside)) == {0.0, 1.0}
    assert not inside[off < width - 0.5 * TIP].any()
    assert inside[off > width + 1.5 * TIP].all()
    side = (1 - inside[:, 80:140]).sum(0) / 2
    assert side.mean() == pytest.approx(width, abs=0.4 * TIP)


def test_the_margin_is_ragged_and_each_side_has_its_own():
    inside = margin.inside(SHAPE, 10.0, TIP, rng())
    top, bottom = inside[:75, 30:-30].argmax(0), inside[::-1][:75, 30:-30].argmax(0)
    assert top.std() > 0.1 * TIP and np.abs(np.corrcoef(top, bottom)[0, 1]) < 0.6
    assert np.abs(np.diff(top)).max() <= TIP, "as hatching ends, not as noise"


def test_no_margin_leaves_the_whole_sheet():
    assert margin.inside(SHAPE, 0.0, TIP, rng()).all()


@pytest.mark.parametrize("shape", [(2, 2), (2, 640), (640, 2)])
def test_on_a_thread_of_a_sheet(shape):
    for found in (
        margin.inside(shape, 0.4, TIP, rng()),
        margin.faded(disc(1, shape), 0.4, TIP, -50, rng()),
    ):
        assert found.shape == shape and np.isfinite(found).all()


# ---- fading --------------------------------------------------------------------------------------


@pytest.mark.parametrize("fade", [0.1, 0.3, 0.5, 0.7])
@pytest.mark.parametrize("seed", range(2))
def test_the_asked_share_of_the_sheet_is_left_out(fade, seed):
    kept = margin.faded(disc(), fade, TIP, -50.0, rng(seed))
    assert 1 - kept.mean() == pytest.approx(fade, abs=0.02)


@pytest.mark.parametrize("fade", [0.5, 0.9, 1.0])
def test_the_subject_is_never_left_out(fade):
    care = disc(60.0)
    assert margin.faded(care, fade, TIP, -50.0, rng())[care > 0].all()


def test_the_farthest_is_left_out():
    off = np.hypot(*(np.mgrid[: SHAPE[0], : SHAPE[1]] - np.array([75, 110])[:, None, None]))
    kept = margin.faded(disc(), 0.5, TIP, -50.0, rng())
    assert off[kept == 0].mean() > off[kept == 1].mean() + 40
    assert kept[off < 45].mean() > 0.95 and kept[off > 120].mean() < 0.2


def test_without_a_fade_all_is_drawn():
    assert margin.faded(disc(), 0.0, TIP, -50.0, rng()).all()


@pytest.mark.parametrize("wrist_deg", [-50, 0, 90])
def test_it_ends_in_streaks_along_the_wrist(wrist_deg):
    noise = margin._streaks((200, 260), 4.0, wrist_deg, rng(5))
    assert noise.shape == (200, 260) and 0.4 < noise.std() < 1.3
    gy, gx = np.gradient(noise)
    c, s = np.cos(np.deg2rad(wrist_deg)), np.sin(np.deg2rad(wrist_deg))
    assert np.abs(gx * c + gy * s).mean() < 0.4 * np.abs(gy * c - gx * s).mean()


def test_same_seed_same_margin_other_seed_another():
    one, two, other = (margin.inside(SHAPE, 10.0, TIP, rng(seed)) for seed in (1, 1, 2))
    assert (one == two).all() and (one != other).any()
    one, two, other = (margin.faded(disc(), 0.4, TIP, -50.0, rng(seed)) for seed in (1, 1, 2))
    assert (one == two).all() and (one != other).any()
