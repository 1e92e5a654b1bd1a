"""Tips: their width in mm at any resolution, their kinds, wear, and bumps from the seed alone."""

import numpy as np
import pytest

from crayonize.wax import tip
from stroke_gen.drawing import SIDE_MM, Tip

KINDS = ("sharp", "blunt", "rim", "side")


def made(kind="blunt", width_mm=2.4, cell_mm=0.1, worn_um=0.0, angle_deg=0.0, seed=0):
    return tip.mask(
        Tip(kind, width_mm, angle_deg), cell_mm, np.random.default_rng(seed), 0.0, worn_um
    )


def extent_mm(mask, cell_mm):
    """Height and width of what is present."""
    there = mask < tip.ABSENT
    return [np.ptp(np.flatnonzero(there.any(axis))) * cell_mm + cell_mm for axis in (1, 0)]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("cell_mm", [0.2, 0.1, 0.05])
def test_a_mask_is_a_square_with_a_middle_and_its_lowest_cell_at_0(kind, cell_mm):
    mask = made(kind, cell_mm=cell_mm)
    assert mask.dtype == np.float32 and mask.shape[0] == mask.shape[1] and mask.shape[0] % 2 == 1
    assert mask.min() == 0 and set(np.unique(mask[mask > 1e6])) <= {tip.ABSENT}


@pytest.mark.parametrize("kind", ["sharp", "blunt"])
@pytest.mark.parametrize("width_mm", [1.0, 2.4, 5.0])
def test_a_disc_has_its_width_in_mm_at_both_resolutions(kind, width_mm):
    for cell_mm in (0.2, 0.1, 0.05):
        mask = made(kind, width_mm, cell_mm)
        assert extent_mm(mask, cell_mm) == pytest.approx([width_mm] * 2, abs=1.01 * cell_mm)
        area = (mask < tip.ABSENT).sum() * cell_mm**2
        assert area == pytest.approx(np.pi / 4 * width_mm**2, rel=0.03 + 0.6 * (cell_mm / width_mm))


def test_a_side_is_a_strip_of_its_length_and_breadth():
    for cell_mm in (0.2, 0.1):
        across, along = extent_mm(made("side", 8.0, cell_mm), cell_mm)
        assert along == pytest.approx(8.0, abs=1.01 * cell_mm)
        assert across == pytest.approx(SIDE_MM, abs=1.01 * cell_mm)
        across, along = extent_mm(made("side", 8.0, cell_mm, angle_deg=90), cell_mm)
        assert across == pytest.approx(8.0, abs=1.01 * cell_mm)


def test_a_rim_is_hollow_and_leans_on_the_side_it_is_turned_to():
    for angle, axis, sign in ((0, 1, 1), (90, 0, 1), (180, 1, -1)):
        mask = made("rim", 4.0, angle_deg=angle)
        there = mask < tip.ABSENT
        n = mask.shape[0] // 2
        assert not there[n - 3 : n + 4, n - 3 : n + 4].any()
        low = np.argwhere(there & (mask < 20))[:, axis].mean() - n
        assert low * sign > 5


def test_a_sharp_tip_falls_away_faster_than_a_blunt_one(monkeypatch):
    monkeypatch.setattr(tip, "BUMP_UM", 0.0)
    sharp, blunt = made("sharp"), made("blunt")
    middle = sharp.shape[0] // 2
    for mask in (sharp, blunt):
        assert mask[middle, middle] == 0
        assert (np.diff(mask[middle, middle:][mask[middle, middle:] < tip.ABSENT]) >= 0).all()
    assert np.median(sharp[sharp < tip.ABSENT]) > 3 * np.median(blunt[blunt < tip.ABSENT])


@pytest.mark.parametrize("kind", KINDS)
def test_wear_cuts_the_profile_flat_from_below(kind, monkeypatch):
    """...

    at the level at which what is cut off has the mean height asked for; at `flat_um` nothing is
    left.
    """
    monkeypatch.setattr(tip, "BUMP_UM", 0.0)
    fresh = made(kind)
    there = fresh < tip.ABSENT
    flat = []
    for share in (0.0, 0.2, 0.6, 1.02):
        worn = made(kind, worn_um=share * tip.flat_um(Tip(kind, 2.4)))
        np.testing.assert_array_equal(worn < tip.ABSENT, there)
        level = (fresh - worn)[there].max()
        np.testing.assert_allclose(worn[there], np.maximum(fresh[there] - level, 0), atol=1e-3)
        lost = np.maximum(level - fresh[there], 0).mean()
        if kind in ("sharp", "blunt"):
            assert lost == pytest.approx(
                min(share, 1) * (fresh[there].max() - fresh[there]).mean(), rel=0.15, abs=0.5
            )
        flat.append((worn[there] < 1e-3).sum())
    assert flat == sorted(flat) and flat[2] > flat[0]
    if kind in ("sharp", "blunt"):
        assert flat[-1] == there.sum()


def test_bumps_come_from_the_seed_only():
    once = made(seed=5)
    made(seed=7)
    np.testing.assert_array_equal(once, made(seed=5))
    assert np.abs(once - made(seed=6))[once < tip.ABSENT].max() > 1


def test_bumps_have_their_height_and_wavelength_in_mm(monkeypatch):
    monkeypatch.setattr(tip, "DROPS_UM", dict.fromkeys(KINDS, 0.0))
    spread, slope = [], []
    for cell_mm in (0.1, 0.05):
        masks = [made("blunt", 16.0, cell_mm, seed=seed) for seed in range(4)]
        n = masks[0].shape[0]
        inner = [m[n // 4 : -n // 4, n // 4 : -n // 4] for m in masks]
        spread.append(np.mean([m.std() for m in inner]))
        slope.append(np.mean([np.gradient(m, axis=0).std() / cell_mm for m in inner]))
    assert spread[0] == pytest.approx(spread[1], rel=0.15) and slope[0] == pytest.approx(
        slope[1], rel=0.25
    )
    assert 0.2 * tip.BUMP_UM < spread[0] < tip.BUMP_UM


@pytest.mark.parametrize("kind", KINDS)
def test_a_tip_finer_than_a_cell_still_touches(kind):
    assert made(kind, 0.05, 0.2).min() == 0


@pytest.mark.parametrize(
    "wrong, message",
    [
        (Tip("flat", 2.0), "tip.kind: 'flat' is none of sharp, blunt"),
        (Tip("blunt", 0.0), "tip.width_mm: 0.0 is not between"),
        (Tip("blunt", float("nan")), "tip.width_mm: nan is not between"),
        (Tip("blunt", 1e9), "tip.width_mm: 1000000000.0 is not between"),
    ],
)
def test_a_wrong_tip_is_named(wrong, message):
    with pytest.raises(ValueError, match=message):
        tip.mask(wrong, 0.1, np.random.default_rng(0))
