"""Hatching: legs keep to the field, to their distance and to the ground that wants them, on any
field.
"""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from stroke_gen.hatching import STEP, Hatch, hatch

SIZE = 160
CENTRE = SIZE / 2


def tangent(angle):
    """Unit vectors of an angle in radians (h, w)."""
    return np.dstack([np.cos(angle), np.sin(angle)]).astype(np.float32)


def constant(degrees):
    return tangent(np.full((SIZE, SIZE), np.deg2rad(degrees)))


def fields():
    y, x = np.mgrid[:SIZE, :SIZE].astype(np.float32)
    return {
        "circles": tangent(np.arctan2(x - CENTRE, CENTRE - y)),
        "waves": tangent(0.6 * np.sin(x / 25)),
        "rays": tangent(np.arctan2(y - CENTRE, x - CENTRE)),
    }


def hostile():
    rng = np.random.default_rng(0)
    y, x = np.mgrid[:SIZE, :SIZE].astype(np.float32)
    wedge = np.arctan2(y - CENTRE, x - CENTRE) / 2
    return {
        "random": tangent(rng.uniform(0, np.pi, (SIZE, SIZE))),
        "wedge": tangent(wedge), "trisector": tangent(-wedge), "vortices": tangent(x * y / 40),
        "zero": np.zeros((SIZE, SIZE, 2), np.float32), "checks": tangent((x + y) % 2 * np.pi / 2),
        "not a number": np.full((SIZE, SIZE, 2), np.nan, np.float32),
    }  # fmt: skip


FIELDS, HOSTILE = fields(), hostile()


def how(spacing=3.0, **changes):
    values = {
        "spacing": spacing,
        "shortest": 3 * spacing,
        "reach": 20 * spacing,
        "legs": 10,
        "gap": 0.5 * spacing,
    }
    return Hatch(**{**values, "single": 0.5, **changes})


def full(pressure=0.3, shape=(SIZE, SIZE)):
    return np.full(shape, pressure, np.float32)


def drawn(want, field, settings, seed=0, coherence=None, gaps=1.0):
    coherence = np.zeros_like(want) if coherence is None else coherence
    wider = np.broadcast_to(np.asarray(gaps, np.float32), want.shape).copy()
    return hatch(want, wider, field, coherence, settings, np.random.default_rng(seed))


def stroke_of(paths):
    """The number of the path each point belongs to."""
    return np.repeat(np.arange(len(paths.first) - 1), np.diff(paths.first))


def leg_of(paths):
    """A number for each point's leg, unlike in all paths."""
    return stroke_of(paths) * 1000 + paths.leg


def segments(paths):
    """Middle, direction and length of every piece within a leg."""
    same = np.diff(leg_of(paths)) == 0
    step = np.diff(paths.points, axis=0)[same]
    length = np.hypot(*step.T)
    return (paths.points[:-1] + paths.points[1:])[same] / 2, step / length[:, None], length


def apart(points, others):
    """Distance of each point to the nearest of others."""
    return cKDTree(others).query(points)[0]


def deviation(paths, field):
    """Degrees between each piece of a leg and the field beneath it."""
    middle, direction, _ = segments(paths)
    x, y = middle.astype(int).T
    return np.degrees(np.arccos(np.clip(np.abs((direction * field[y, x]).sum(1)), 0, 1)))


@pytest.mark.parametrize("degrees", range(-90, 90, 30))
def test_legs_run_along_an_even_field(degrees):
    assert deviation(drawn(full(), constant(degrees), how()), constant(degrees)).max() < 0.5


@pytest.mark.parametrize("name", FIELDS)
def test_legs_follow_a_curved_field(name):
    off = deviation(drawn(full(), FIELDS[name], how()), FIELDS[name])
    assert off.mean() < 2.5 and np.percentile(off, 95) < 6


@pytest.mark.parametrize("degrees", range(0, 180, 15))
@pytest.mark.parametrize("spacing", [2.0, 4.0])
def test_as_much_line_as_the_spacing_asks_for_at_every_angle(spacing, degrees):
    """The table of crayons was measured with lines one spacing apart; more of them would be
    darker.
    """
    length = segments(drawn(full(), constant(degrees), how(spacing)))[2].sum()
    assert length * spacing / SIZE**2 == pytest.approx(1, abs=0.12)


@pytest.mark.parametrize("degrees", [0, -50])
def test_wider_gaps_mean_as_much_less_line(degrees):
    length = [
        segments(drawn(full(), constant(degrees), how(), gaps=gaps))[2].sum()
        for gaps in (1.0, 1.5, 2.5)
    ]
    for gaps, some in zip((1.5, 2.5), length[1:], strict=True):
        assert some * gaps / length[0] == pytest.approx(1, abs=0.15)


def test_gaps_are_wide_where_they_are_wide():
    """An open ground beside a closed subject, on one sheet."""
    gaps = np.ones((SIZE, SIZE), np.float32)
    gaps[:, SIZE // 2 :] = 2.5
    paths = drawn(full(), constant(90), how(), gaps=gaps)
    middle, _, length = segments(paths)
    left, right = (length[on].sum() for on in (middle[:, 0] < 74, middle[:, 0] > 86))
    assert left / right == pytest.approx(2.5, rel=0.2)
    leg = leg_of(paths)
    open_ = paths.points[:, 0] > 90
    apart_ = [
        apart(paths.points[open_ & (leg == n)], paths.points[leg != n]).min()
        for n in np.unique(leg[open_])
    ]
    assert min(apart_) > 0.35 * 2.5 * 3.0


@pytest.mark.parametrize("gaps", [1.0, 3.0])
def test_no_line_where_nothing_is_wanted(gaps):
    want = full()
    want[:, 60:] = 0
    assert drawn(0 * want, constant(20), how(), gaps=gaps).points.size == 0
    paths = drawn(want, constant(20), how(gap=0.0), gaps=gaps)
    assert paths.points.size and paths.points[:, 0].max() < 60


@pytest.mark.parametrize("name", FIELDS)
def test_as_much_line_on_curved_fields(name):
    length = segments(drawn(full(), FIELDS[name], how()))[2].sum()
    assert length * 3 / SIZE**2 == pytest.approx(1, abs=0.2)


@pytest.mark.parametrize(
    "field", [constant(0), constant(-50), *FIELDS.values()], ids=["0", "-50", *FIELDS]
)
def test_legs_keep_their_distance(field):
    """No leg comes much nearer than half the spacing to another, and the usual distance is the
    spacing.
    """
    spacing = 4.0
    paths = drawn(full(), field, how(spacing))
    leg = leg_of(paths)
    nearest = (
        np.concatenate(
            [apart(paths.points[leg == n], paths.points[leg != n]) for n in np.unique(leg)]
        )
        / spacing
    )
    assert nearest.min() > 0.35
    assert np.percentile(nearest, 5) > 0.45
    assert np.median(nearest) > 0.7


@pytest.mark.parametrize(
    "field", [constant(0), constant(-50), *FIELDS.values()], ids=["0", "-50", *FIELDS]
)
@pytest.mark.parametrize("spacing", [1.0, 2.5, 6.0])
def test_wanted_ground_is_covered(spacing, field):
    want = full()
    y, x = np.mgrid[:SIZE, :SIZE]
    want[np.hypot(x - 60, y - 70) < 25] = 0
    paths = drawn(want, field, how(spacing))
    cells = np.argwhere(want > 0)[:: max(1, int(8 / spacing)), ::-1] + 0.5
    assert (apart(cells, paths.points[:: max(1, int(spacing / 2))]) <= spacing).mean() > 0.9


@pytest.mark.parametrize("gap", [0.0, 2.0, 8.0])
def test_legs_stay_on_wanted_ground_but_for_gaps(gap):
    want = full()
    want[:, 50:53] = 0
    want[:, 90:130] = 0
    paths = drawn(want, constant(10), how(gap=gap))
    x, y = paths.points.astype(int).T
    outside = want[y, x] == 0
    assert not ((x >= 90) & (x < 130)).any()
    assert not outside.any() if gap < 3 else outside.any()
    begins, ends = paths.first[:-1], paths.first[1:] - 1
    assert not outside[begins].any() and not outside[ends].any()


def test_pressure_is_what_is_wanted_and_is_kept_over_gaps():
    want = full(0.2)
    want[:, 80:] = 0.6
    want[:, 50:52] = 0
    paths = drawn(want, constant(0), how(gap=6.0))
    x = paths.points[:, 0]
    assert paths.pressure.min() > 0
    assert np.allclose(paths.pressure[x < 49], 0.2) and np.allclose(paths.pressure[x > 81], 0.6)
    assert np.allclose(paths.pressure[(x > 50) & (x < 52)], 0.2)


@pytest.mark.parametrize("name", [*FIELDS, "wedge", "trisector", "vortices", "checks"])
def test_no_sharp_turn_within_a_leg(name):
    paths = drawn(full(), (FIELDS | HOSTILE)[name], how())
    leg, step = leg_of(paths), np.diff(paths.points, axis=0)
    inside = (leg[2:] == leg[1:-1]) & (leg[1:-1] == leg[:-2])
    cosine = (step[1:] * step[:-1]).sum(1) / np.hypot(*step[1:].T) / np.hypot(*step[:-1].T)
    assert np.degrees(np.arccos(np.clip(cosine[inside], -1, 1))).max(initial=0) < 25


@pytest.mark.parametrize("name", HOSTILE)
@pytest.mark.parametrize("spacing", [0.4, 3.0])
def test_hostile_fields_end_and_give_finite_paths(name, spacing):
    paths = drawn(full(), HOSTILE[name], how(spacing, legs=1000, reach=2000.0))
    assert np.isfinite(paths.points).all() and np.isfinite(paths.pressure).all()
    assert (np.diff(paths.first) > 0).all() and paths.first[-1] == len(paths.points)
    if len(paths.points):
        assert paths.points.min() >= 0 and paths.points.max() < SIZE


@pytest.mark.parametrize("shape", [(1, 1), (2, 2), (1, 200), (200, 1), (3, 7)])
def test_tiny_sheets(shape):
    field = np.tile(np.array([0.6, 0.8], np.float32), (*shape, 1))
    paths = drawn(full(shape=shape), field, how(2.0, shortest=0.5))
    assert np.isfinite(paths.points).all()
    assert drawn(full(0, shape), field, how()).points.size == 0


@pytest.mark.parametrize(
    "place", [(0, 0), (0, SIZE - 1), (SIZE - 1, 0), (SIZE - 1, SIZE - 1), (80, 80)]
)
def test_single_cells_do_no_harm(place):
    want = full(0)
    want[place] = 0.5
    assert np.isfinite(drawn(want, constant(30), how(shortest=0.0)).points).all()


def test_lines_reach_the_border_of_the_sheet():
    paths = drawn(full(), constant(-50), how())
    edge = np.array([[x, y] for x in (0.5, SIZE - 0.5) for y in np.arange(0.5, SIZE)])
    assert (apart(edge, paths.points) < 3).mean() > 0.9
    assert (apart(edge[:, ::-1], paths.points) < 3).mean() > 0.9


def test_zigzags_go_to_and_fro_beside_each_other():
    paths = drawn(full(), constant(-50), how(spacing=4.0, legs=8))
    along = np.array([np.cos(np.deg2rad(-50)), np.sin(np.deg2rad(-50))])
    stroke, leg = stroke_of(paths), leg_of(paths)
    assert paths.leg.max() <= 7 and np.bincount(np.unique(leg) // 1000).max() > 4
    turn = np.flatnonzero((np.diff(leg) != 0) & (np.diff(stroke) == 0))
    assert np.linalg.norm(paths.points[turn + 1] - paths.points[turn], axis=1).max() < 4 * 5
    forward = [
        np.sign((paths.points[leg == n][-1] - paths.points[leg == n][0]) @ along)
        for n in np.unique(leg)
    ]
    same = np.diff(np.unique(leg) // 1000) == 0
    assert (np.diff(forward)[same] != 0).all()


def test_hair_is_drawn_in_single_lines():
    paths = drawn(full(), constant(-50), how(single=0.5), coherence=full(0.9))
    assert (paths.leg == 0).all()


def test_legs_have_the_length_of_a_hand():
    spacing, reach = 3.0, 40.0
    paths = drawn(full(), constant(20), how(spacing, reach=reach, shortest=9.0))
    length = np.bincount(leg_of(paths)) * STEP
    length = length[length > 0]
    assert length.max() <= reach * 1.4 * 1.15 + 2 * spacing + 2
    assert length.min() >= 9.0 - STEP
    assert np.median(length) > 0.5 * reach


def test_large_areas_are_hatched_to_the_end():
    """The buffers suffice: the last rows are as full as the first."""
    shape = (640, 640)
    paths = drawn(
        full(shape=shape), np.tile(np.array([0.6, -0.8], np.float32), (*shape, 1)), how(0.8)
    )
    rows = np.histogram(paths.points[:, 1], 8, (0, 640))[0]
    assert rows.min() > 0.9 * rows.max()


def test_same_seed_same_lines_other_seed_others():
    one, two, other = (drawn(full(), FIELDS["waves"], how(), seed) for seed in (1, 1, 2))
    assert (one.points == two.points).all() and (one.first == two.first).all()
    assert one.points.shape != other.points.shape or (one.points != other.points).any()
