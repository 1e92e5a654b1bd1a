"""Surfaces: what is one thing is one surface, what is alike is one family, and where strokes
run.
"""

import cv2
import numpy as np
import pytest

from stroke_gen import analysis, surfaces
from stroke_gen.colour import from_oklab, oklab

SHAPE = (90, 120)
TIP = 5.0
LEAST = 0.06
RED, GREEN, BLUE = (0.5, 0.05, 0.05), (0.06, 0.3, 0.08), (0.05, 0.1, 0.5)
NONE = np.zeros(SHAPE, np.float32)


def flat(*colours, shape=SHAPE):
    """Upright bands of linear colours, in OKLab."""
    bands = [
        np.tile(np.array(c, np.float32), (shape[0], shape[1] // len(colours), 1)) for c in colours
    ]
    return oklab(np.concatenate(bands, 1))


def parted(lab, care=NONE, subject=NONE, least=LEAST):
    return surfaces.part(lab, care, subject, TIP, least)


def agree(one, other):
    """Share of the sheet on which two partings are the same up to names, by the best match of
    each.
    """
    counts = np.zeros((one.max() + 1, other.max() + 1))
    np.add.at(counts, (one.ravel(), other.ravel()), 1)
    return min(counts.max(0).sum(), counts.max(1).sum()) / one.size


# ---- surfaces ------------------------------------------------------------------------------------


def test_a_soft_gradient_does_not_part_a_surface():
    lab = np.tile(np.array([0.6, 0.05, 0.05], np.float32), (*SHAPE, 1))
    lab[:, 60:] = 0.6, -0.1, 0.0
    lab[:, :60, 0] += 0.06 * np.linspace(-1, 1, 60, dtype=np.float32)
    label = parted(lab)
    assert label.max() == 1
    assert (label[:, :58] == label[0, 0]).all() and (label[:, 62:] == label[0, 119]).all()


def test_half_tones_along_a_strong_border_are_no_surface():
    assert parted(flat(RED, BLUE)).max() == 1


def test_a_flat_picture_is_one_surface():
    assert (parted(flat(GREEN)) == 0).all()


@pytest.mark.parametrize("seed", range(3))
def test_labels_are_dense_and_every_border_lies_on_the_sheet(seed):
    noise = (
        np.random.default_rng(seed).random((6, 8, 3)).astype(np.float32).repeat(15, 0).repeat(15, 1)
    )
    label = parted(oklab(noise))
    assert label.shape == SHAPE and label.dtype == np.int32
    assert np.array_equal(np.unique(label), np.arange(label.max() + 1)) and label.max() > 5


def test_more_difference_asked_for_parts_less():
    lab = oklab(
        cv2.GaussianBlur(np.random.default_rng(1).random((*SHAPE, 3)).astype(np.float32), (0, 0), 5)
        * 4
        - 1.5
    )
    number = [parted(lab, least=least).max() + 1 for least in (0.01, 0.05, 0.2, 1.0)]
    assert number == sorted(number, reverse=True) and number[0] > number[2] and number[-1] == 1


def test_merging_is_dearer_where_care_is_due():
    """Two like colours, and the same two again: they stay apart where care is due."""
    one, other = (np.array([L, 0.1, 0.05], np.float32) for L in (0.6, 0.64))
    lab = np.concatenate([np.tile(c, (90, 30, 1)) for c in (one, other) * 2], 1)
    alone = [
        parted(lab[:, :60], np.full((90, 60), care, np.float32), NONE[:, :60]).max()
        for care in (0, 1)
    ]
    assert alone == [0, 1]


def test_the_one_who_is_drawn_is_parted_from_a_ground_of_like_colour():
    lab = flat(GREEN, GREEN)
    lab[:, 60:, 0] += 0.03
    subject = NONE.copy()
    subject[:, 60:] = 1
    assert parted(lab).max() == 0 and parted(lab, subject=subject).max() == 1


def test_specks_are_no_surfaces():
    lab = flat(RED)
    lab[40:43, 60:63] = oklab(np.array(BLUE, np.float32))
    assert parted(lab).max() == 0


@pytest.mark.parametrize(
    "turn", [np.fliplr, np.flipud, lambda m: np.ascontiguousarray(np.swapaxes(m, 0, 1))]
)
def test_a_mirrored_picture_has_mirrored_surfaces(turn):
    noise = (
        np.random.default_rng(2)
        .random((4, 6, 3))
        .astype(np.float32)
        .repeat(24, 0)
        .repeat(20, 1)[:90]
    )
    lab = oklab(noise)
    mirrored = parted(np.ascontiguousarray(turn(lab)), *(np.ascontiguousarray(turn(NONE)),) * 2)
    assert agree(np.ascontiguousarray(turn(parted(lab))), mirrored) > 0.97


@pytest.mark.parametrize("shape", [(2, 2), (2, 640), (640, 2), (3, 5)])
def test_tiny_pictures(shape):
    lab = oklab(np.random.default_rng(3).random((*shape, 3)).astype(np.float32))
    zero = np.zeros(shape, np.float32)
    label = surfaces.part(lab, zero, zero, TIP, LEAST)
    assert label.shape == shape and label.min() == 0
    assert np.isfinite(
        surfaces.directions(np.dstack([lab, lab])[..., :3], label, zero, TIP, -50, 0.3)
    ).all()


def slow_borders(label, lab):
    n = label.max() + 1
    length, step = np.zeros((n, n)), np.zeros((n, n))
    for axis in (0, 1):
        one, other = (np.moveaxis(m, axis, 0) for m in (label, lab))
        off = np.linalg.norm(np.diff(other, axis=0), axis=-1)
        for i, j, d in zip(one[1:].ravel(), one[:-1].ravel(), off.ravel(), strict=True):
            if i != j:
                length[i, j], length[j, i] = length[i, j] + 1, length[j, i] + 1
                step[i, j], step[j, i] = step[i, j] + d, step[j, i] + d
    return length, step


def test_borders_are_those_of_the_slow_twin():
    rng = np.random.default_rng(4)
    label, lab = (
        rng.integers(0, 4, (12, 17)).astype(np.int32),
        rng.random((12, 17, 3)).astype(np.float32),
    )
    length, step = np.zeros((4, 4), np.float32), np.zeros((4, 4), np.float32)
    surfaces._borders(label, lab, length, step)
    expected = slow_borders(label, lab)
    assert (length == expected[0]).all() and np.allclose(step, expected[1], rtol=1e-4)


def slow_merge(means, size, length, step, large, edge, care, least):
    """Merge the cheapest pair, work everything out anew, and so on."""
    means, size = means.astype(float), size.astype(float)
    root = np.arange(len(size))
    while True:
        dearest = (least, -1, -1)
        for i in range(len(size)):
            for j in range(i + 1, len(size)):
                if root[i] == i and root[j] == j and length[i, j] > 0:
                    off = (
                        np.linalg.norm(means[i, :4] - means[j, :4])
                        + edge * step[i, j] / length[i, j]
                    )
                    dear = 1 + care * max(means[i, 4], means[j, 4])
                    price = off * dear * min(min(size[i], size[j]) / large, 1) ** 0.5
                    dearest = min(dearest, (price, i, j))
        _, i, j = dearest
        if i < 0:
            return root
        means[i] = (means[i] * size[i] + means[j] * size[j]) / (size[i] + size[j])
        size[i] += size[j]
        for m in (length, step):
            m[i] += m[j]
            m[:, i] += m[:, j]
            m[i, i] = m[j] = m[:, j] = 0
        root[root == j] = i


@pytest.mark.parametrize("least", [0.05, 0.15, 0.4])
def test_merging_is_that_of_the_slow_twin(least):
    rng = np.random.default_rng(5)
    for _ in range(5):
        label = rng.integers(0, 12, (9, 11)).astype(np.int32)
        label[0, :] = np.arange(11)
        label[1, 0] = 11
        lab = rng.random((9, 11, 3)).astype(np.float32) * 0.4
        means, size = surfaces._means(
            label, np.dstack([lab, rng.random((9, 11, 2)).astype(np.float32)])
        )
        borders = slow_borders(label, lab)
        root = np.arange(12)
        expected = slow_merge(means, size, *(m.copy() for m in borders), 8.0, 0.7, 0.8, least)
        length, step = (m.astype(np.float32) for m in borders)
        numbers = (np.float32(v) for v in (8.0, 0.7, 0.8, least))
        surfaces._merge(means.copy(), size.copy(), length, step, *numbers, root)
        assert (root[:, None] == root[None]).tolist() == (
            expected[:, None] == expected[None]
        ).tolist()


# ---- families ------------------------------------------------------------------------------------


def families(colours, kind=None, least=LEAST):
    """The family of each of some flat surfaces, given in OKLab."""
    label = np.arange(len(colours), dtype=np.int32).repeat(2000).reshape(len(colours) * 20, 100)
    lab = np.array(colours, np.float32)[label]
    kind = np.zeros(len(colours)) if kind is None else np.array(kind)
    return surfaces.families(label, lab, kind.astype(np.float32)[label], least).tolist()


def test_light_and_dark_of_one_hue_join_and_other_hues_do_not():
    light, dark, blue = (0.65, 0.2, 0.1), (0.5, 0.18, 0.1), (0.5, -0.1, -0.25)
    one, two, other = families([light, dark, blue])
    assert one == two != other


def test_surfaces_join_wherever_they_lie():
    red, blue = (0.6, 0.2, 0.1), (0.5, -0.1, -0.25)
    assert families([red, blue, red, blue, red]) == [0, 1, 0, 1, 0]


def test_skin_and_cloth_of_one_colour_do_not_join():
    tan = (0.7, 0.08, 0.1)
    assert len(set(families([tan, tan], [0, 0]))) == 1
    assert len(set(families([tan, tan], [1, 0]))) == 2
    assert len(set(families([tan, tan, tan], [0, 1, 2]))) == 3, "nor skin and hair"


def test_families_are_dense():
    colours = np.random.default_rng(6).random((12, 3)) * [0.8, 0.4, 0.4] - [0, 0.2, 0.2]
    found = families(colours)
    assert sorted(set(found)) == list(range(max(found) + 1)) and len(found) == 12 and max(found) > 2


# ---- directions ----------------------------------------------------------------------------------


def angles(tangent):
    """Direction in degrees, 0 to 180."""
    return np.degrees(np.arctan2(tangent[..., 1], tangent[..., 0])) % 180


def apart(degrees, other):
    """The angle between directions, 0 to 90."""
    return np.abs((degrees - other + 90) % 180 - 90)


def grating(degrees, size=150, period=16.0):
    """Grey stripes that run at an angle (y down), in OKLab."""
    y, x = np.mgrid[:size, :size].astype(np.float32)
    across = y * np.cos(np.deg2rad(degrees)) - x * np.sin(np.deg2rad(degrees))
    grey = 0.5 + 0.4 * np.sin(2 * np.pi * across / period)
    return oklab(np.repeat(grey[..., None], 3, 2).astype(np.float32))


def directed(lab, label=None, wrist_deg=-50.0, wrist=0.3, care=0.0):
    label = np.zeros(lab.shape[:2], np.int32) if label is None else label
    cares = np.full(lab.shape[:2], care, np.float32)
    return surfaces.directions(analysis.structure(lab, TIP), label, cares, TIP, wrist_deg, wrist)


@pytest.mark.parametrize("degrees", range(0, 180, 15))
def test_the_angle_of_a_grating_is_recovered(degrees):
    found = angles(directed(grating(degrees), wrist=0.0))
    assert apart(found[25:-25, 25:-25], degrees).max() < 2


@pytest.mark.parametrize("degrees", range(0, 180, 15))
def test_structure_knows_the_angle_of_a_grating_in_every_cell(degrees):
    tensor = analysis.structure(grating(degrees), TIP)[25:-25, 25:-25]
    assert apart(np.degrees(0.5 * np.arctan2(tensor[..., 1], tensor[..., 0])), degrees).max() < 1
    assert (np.hypot(tensor[..., 0], tensor[..., 1]) / tensor[..., 2]).min() > 0.9


@pytest.mark.parametrize("wrist_deg", [-50, 0, 35, 90])
@pytest.mark.parametrize("light", [0.0, 0.3, 1.0])
def test_a_flat_surface_takes_the_angle_of_the_wrist(wrist_deg, light):
    found = directed(oklab(np.full((60, 60, 3), light, np.float32)), wrist_deg=wrist_deg)
    assert apart(angles(found), wrist_deg).max() < 2


def test_a_long_flat_surface_is_hatched_along_unless_the_wrist_is_heavy():
    label = np.zeros((90, 150), np.int32)
    label[40:52] = 1
    lab = np.zeros((90, 150, 3), np.float32)
    light, heavy = (angles(directed(lab, label, wrist=wrist)[46, 75]) for wrist in (0.05, 50.0))
    assert apart(light, 0) < 10 and apart(heavy, -50) < 2


def test_a_heavy_wrist_overrules_the_form_of_the_whole():
    """In the mean of a surface; a large clear form within it is still followed."""
    weak = oklab((0.5 + 0.02 * (from_oklab(grating(20)) - 0.5)).astype(np.float32))
    label = np.ones((150, 150), np.int32)
    light, heavy = (
        surfaces._direction(
            analysis.structure(weak, TIP),
            label.astype(np.float32),
            np.array([np.cos(np.deg2rad(-100)), np.sin(np.deg2rad(-100))]) * wrist,
            np.float32(1e-9),
            label.size,
        )
        for wrist in (0.0, 100.0)
    )
    assert apart(np.degrees(0.5 * np.arctan2(light[1], light[0])), 20) < 5
    assert apart(np.degrees(0.5 * np.arctan2(heavy[1], heavy[0])), -50) < 2


def test_each_surface_has_its_own_direction():
    lab = np.concatenate([grating(15, 120), grating(100, 120)], 1)
    label = np.zeros((120, 240), np.int32)
    label[:, 120:] = 1
    found = angles(directed(lab, label, wrist=0.0))
    assert apart(found[30:90, 20:90], 15).max() < 8 and apart(found[30:90, 150:220], 100).max() < 8


def test_strokes_follow_a_large_clear_form_and_more_so_where_care_is_due():
    y, x = np.mgrid[:180, :240].astype(np.float32) - 90
    off = np.hypot(x, y)
    grey = np.where(off < 70, 0.5 + 0.4 * np.sin(off / 4), 0.5)
    lab = oklab(np.repeat(grey[..., None], 3, 2).astype(np.float32))
    ring = (off > 35) & (off < 60)
    plain, careful = (
        apart(angles(directed(lab, care=care)), np.degrees(np.arctan2(x, -y)))[ring]
        for care in (0, 1)
    )
    assert (
        np.percentile(careful, 90) < 15
        and careful.mean() < 0.7 * plain.mean()
        and plain.mean() < 35
    )


def test_a_mirrored_picture_has_the_mirrored_field():
    noise = np.random.default_rng(7).random((90, 120, 3)).astype(np.float32)
    lab = oklab(np.clip(cv2.GaussianBlur(noise, (0, 0), 4) * 4 - 1.5, 0, 1))
    found = directed(lab)
    mirrored = directed(np.ascontiguousarray(lab[:, ::-1]), wrist_deg=50.0)
    assert np.percentile(apart(angles(mirrored), 180 - angles(found[:, ::-1])), 95) < 3


def test_directions_have_length_one():
    rng = np.random.default_rng(8)
    label = rng.integers(0, 5, (6, 8)).astype(np.int32).repeat(15, 0).repeat(15, 1)
    found = directed(rng.random((90, 120, 3)).astype(np.float32), label)
    assert found.dtype == np.float32 and np.allclose(
        np.hypot(*np.moveaxis(found, 2, 0)), 1, atol=1e-5
    )
