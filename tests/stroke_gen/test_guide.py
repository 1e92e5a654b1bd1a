"""The guide: plates as smooth as the photo and as crisp."""

import cv2
import numpy as np
import pytest

from stroke_gen.guide import COARSE, Guide

SHAPE = (90, 120)


def coarse(values):
    size = -(-values.shape[1] // COARSE), -(-values.shape[0] // COARSE)
    return cv2.resize(values, size, interpolation=cv2.INTER_AREA)


def picture(seed=0, sigma=2.0):
    noise = np.random.default_rng(seed).random((*SHAPE, 3)).astype(np.float32)
    smooth = cv2.GaussianBlur(noise, (0, 0), sigma)
    return (smooth - smooth.mean()) / smooth.std() * 0.2 + 0.5


def step(low=0.2, high=0.8):
    lab = np.zeros((*SHAPE, 3), np.float32)
    lab[..., 0] = low
    lab[:, 60:, 0] = high
    return lab


@pytest.mark.parametrize("seed", range(3))
def test_a_linear_function_of_colour_comes_back(seed):
    """On every cell of the fine grid, though it was known on the coarse one only."""
    lab = picture(seed)
    slope = np.random.default_rng(seed).uniform(-3, 3, 3).astype(np.float32)
    found = Guide(lab, 12.0).spread(coarse(lab) @ slope + np.float32(0.7))
    expected = lab @ slope + 0.7
    off = np.abs(found - expected) / expected.std()
    assert off.mean() < 0.02 and off.max() < 0.1


@pytest.mark.parametrize("radius", [3.0, 12.0, 60.0])
@pytest.mark.parametrize(
    "lab", [picture(), step(), np.zeros((*SHAPE, 3), np.float32)], ids=["picture", "step", "flat"]
)
def test_a_constant_stays_constant(lab, radius):
    guide = Guide(lab, radius)
    assert np.allclose(
        guide.spread(np.full(guide.coarse.shape[:2], 2.5, np.float32)), 2.5, atol=2e-3
    )


def test_values_add_up():
    """What is spread is linear in the values."""
    guide, rng = Guide(picture(), 9.0), np.random.default_rng(1)
    one, other = (rng.random(guide.coarse.shape[:2]).astype(np.float32) for _ in range(2))
    both = guide.spread(2 * one - other)
    assert np.allclose(both, 2 * guide.spread(one) - guide.spread(other), atol=2e-3)


def test_crisp_at_a_step_of_the_photo():
    lab = step()
    found = Guide(lab, 12.0).spread((coarse(lab)[..., 0] > 0.5).astype(np.float32))[45]
    assert found[:59].max() < 0.05 and found[61:].min() > 0.95


def test_smooth_where_the_photo_is_smooth():
    """Noise of the plate goes, and so does a step that the photo has not."""
    flat = np.full((*SHAPE, 3), 0.5, np.float32)
    guide = Guide(flat, 12.0)
    noise = np.random.default_rng(2).random(guide.coarse.shape[:2]).astype(np.float32)
    assert guide.spread(noise).std() < 0.15 * noise.std()
    jump = (
        (np.arange(guide.coarse.shape[1])[None] > 20)
        .astype(np.float32)
        .repeat(len(guide.coarse), 0)
    )
    assert np.abs(np.diff(guide.spread(jump), axis=1)).max() < 0.1


@pytest.mark.parametrize("shape", [(2, 2), (2, 200), (200, 2), (7, 5)])
def test_tiny_grids(shape):
    lab = np.random.default_rng(3).random((*shape, 3)).astype(np.float32)
    guide = Guide(lab, 12.0)
    assert guide.coarse.shape[:2] == tuple(-(-n // COARSE) for n in shape)
    found = guide.spread(guide.coarse[..., 0])
    assert found.shape == shape and np.isfinite(found).all()
