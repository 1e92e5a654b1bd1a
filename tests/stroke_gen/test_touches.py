"""Touches: small dark shapes that the sheet lacks are asked for, tones and specks are not; gains
against a twin.
"""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import cv2
import numpy as np
import pytest
from fake_box import PAPER, box
from fake_scene import TIP, plan_of, scene_of

from stroke_gen import touches
from stroke_gen.colour import oklab
from stroke_gen.params import Pass
from stroke_gen.touches import gains

TABLE = box()
NAMES = TABLE.names
POOLS = {n: ThreadPoolExecutor(n) for n in (1, 2, 4)}
COAT = Pass(kind="touch", tip=0.4, sharp=True, detail=0.1, least=3.0)
CELLS = 0.4 * TIP  # a touch's tip
SHAPE = (120, 150)
GROUND = np.array((0.4, 0.42, 0.4), np.float32)
SPOT = np.s_[50:62, 60:78]


def photo_with(colour=(0.02, 0.02, 0.02), where=SPOT):
    photo = np.tile(GROUND, (*SHAPE, 1))
    photo[where] = colour
    return photo


def wanted(photo, now, coat=COAT, threads=2, **maps):
    maps = {"detail": np.ones(SHAPE, np.float32)} | maps
    plan = plan_of(scene_of(photo, **maps), POOLS[threads])
    return {
        NAMES[k]: want
        for k, want in touches.wanted(plan, now.astype(np.float32), coat, CELLS).items()
    }


# ---- what is asked for ---------------------------------------------------------------------------


def test_a_small_dark_shape_that_the_sheet_lacks_is_asked_for():
    wants = wanted(photo_with(), np.tile(GROUND, (*SHAPE, 1)))
    assert set(wants) <= {"black", "brown"}
    asked = np.sum(list(wants.values()), 0) > 0
    spot = np.zeros(SHAPE, np.bool_)
    spot[SPOT] = True
    assert asked[spot].mean() > 0.85 and not asked[:45].any() and asked.sum() < 1.5 * spot.sum()


@pytest.mark.parametrize("name", ["red", "blue", "green"])
def test_a_coloured_shape_is_asked_for_in_its_crayon(name):
    colour = TABLE.over(GROUND)[NAMES.index(name), 4]
    wants = wanted(photo_with(colour), np.tile(GROUND, (*SHAPE, 1)))
    assert max(wants, key=lambda k: (wants[k] > 0).sum()) == name


def test_a_sheet_that_shows_the_photo_asks_for_nothing():
    assert wanted(photo_with(), photo_with()) == {}


@pytest.mark.parametrize("factor", [0.7, 1.3])
def test_a_sheet_that_is_too_dark_or_too_light_all_over_asks_for_nothing(factor):
    """Touches mend no tones; a shape is sought in the sheet's own."""
    assert wanted(photo_with(GROUND), factor * photo_with(GROUND)) == {}


def test_a_shape_is_asked_for_on_a_sheet_of_other_tones():
    plain = np.sum(list(wanted(photo_with(), np.tile(GROUND, (*SHAPE, 1))).values()), 0) > 0
    other = np.sum(list(wanted(photo_with(), 1.2 * np.tile(GROUND, (*SHAPE, 1))).values()), 0) > 0
    assert (plain & other).sum() > 0.8 * (plain | other).sum()


def test_a_soft_shade_is_not_asked_for():
    shade = np.linspace(0.8, 1.25, SHAPE[1], dtype=np.float32)[None, :, None]
    assert (
        wanted(
            shade * np.tile(GROUND, (*SHAPE, 1)),
            np.tile(GROUND, (*SHAPE, 1)),
            replace(COAT, gain=0.05),
        )
        == {}
    )


@pytest.mark.parametrize("least, asked", [(1.0, True), (200.0, False)])
def test_shapes_smaller_than_the_least_are_left_out(least, asked):
    assert (
        bool(wanted(photo_with(), np.tile(GROUND, (*SHAPE, 1)), replace(COAT, least=least)))
        is asked
    )


def test_every_shape_asked_for_is_as_large_as_the_least():
    rng = np.random.default_rng(0)
    photo = np.tile(GROUND, (*SHAPE, 1))
    for y, x, size in rng.integers((0, 0, 1), (110, 140, 10), (40, 3)):
        photo[y : y + size, x : x + size] *= rng.random()
    wants = wanted(photo, np.tile(GROUND, (*SHAPE, 1)))
    assert wants
    for want in wants.values():
        number, _, stats, _ = cv2.connectedComponentsWithStats(
            (want > 0).astype(np.uint8), connectivity=4
        )
        assert number > 1 and stats[1:, 4].min() >= COAT.least * CELLS**2


def test_only_where_the_photo_has_detail():
    detail = np.zeros(SHAPE, np.float32)
    detail[:, :69] = 0.5
    wants = wanted(
        photo_with(), np.tile(GROUND, (*SHAPE, 1)), replace(COAT, least=0.5), detail=detail
    )
    asked = np.sum(list(wants.values()), 0) > 0
    assert asked[50:62, 61:66].all()
    assert not asked[:, 69 + 3 * int(CELLS) :].any()


def test_without_detail_nothing_is_asked_for():
    assert (
        wanted(photo_with(), np.tile(GROUND, (*SHAPE, 1)), detail=np.zeros(SHAPE, np.float32)) == {}
    )


def test_a_gain_too_small_is_left():
    faint = photo_with(0.93 * GROUND)
    assert wanted(faint, np.tile(GROUND, (*SHAPE, 1)), replace(COAT, gain=0.5)) == {}


def test_bare_paper_is_left_bare():
    photo = np.tile(PAPER, (*SHAPE, 1))
    assert wanted(photo, photo, replace(COAT, gain=0.0, least=0.0)) == {}


@pytest.mark.parametrize("hardest", [0.1, 0.4])
def test_no_harder_than_the_hardest(hardest):
    wants = wanted(
        photo_with(), np.tile(GROUND, (*SHAPE, 1)), replace(COAT, hardest=hardest, gain=0.0)
    )
    assert wants and max(want.max() for want in wants.values()) <= hardest * 1.001


def test_skin_is_touched_with_nothing_foreign():
    """A bluish shadow in a face is drawn in brown or black or not at all, on cloth in blue."""
    colour = TABLE.over(GROUND)[NAMES.index("blue"), 3]
    now = np.tile(GROUND, (*SHAPE, 1))
    assert "blue" in wanted(photo_with(colour), now)
    assert "blue" not in wanted(photo_with(colour), now, skin=np.ones(SHAPE, np.float32))
    assert "blue" not in wanted(photo_with(colour), now, hair=np.ones(SHAPE, np.float32))


def test_each_place_is_asked_one_crayon():
    photo = (
        np.random.default_rng(1).random((12, 15, 3)).astype(np.float32).repeat(10, 0).repeat(10, 1)
    )
    wants = wanted(photo, np.tile(GROUND, (*SHAPE, 1)))
    hard = [want > 0 for want in wants.values()]
    assert len(hard) > 2 and np.sum(hard, 0).max() == 1


def test_touches_are_the_same_with_any_number_of_threads():
    photo = (
        np.random.default_rng(2).random((12, 15, 3)).astype(np.float32).repeat(10, 0).repeat(10, 1)
    )
    first, *others = (wanted(photo, np.tile(GROUND, (*SHAPE, 1)), threads=n) for n in POOLS)
    for other in others:
        assert (
            first
            and first.keys() == other.keys()
            and all((first[k] == other[k]).all() for k in first)
        )


# ---- gains ---------------------------------------------------------------------------------------


def slow_gains(current, lab, table, k, coat):
    """What `gains` promises, one formula after the other."""
    usable = [p for p in range(len(table.pressures)) if table.pressures[p] <= coat.hardest] or [0]

    def error(light):
        d = oklab(light.astype(np.float32)).astype(float) - lab
        return np.sqrt(coat.tone * d[..., 0] ** 2 + d[..., 1] ** 2 + d[..., 2] ** 2), d[..., 0]

    before, _ = error(current)
    each = []
    for p in usable:
        after, lighter = error(table.a[1, k, p] * current + table.b[1, k, p])
        after += coat.dark_price * np.maximum(0, -lighter) + touches.GRAIN_PRICE * table.grain[k, p]
        each.append(before - after)
    return np.max(each, 0), np.argmax(each, 0)


COATS = [Pass(), Pass(tone=0.3, dark_price=1.0), Pass(hardest=0.4), Pass(hardest=0.03)]


@pytest.mark.parametrize("coat", COATS, ids=["plain", "dark is dear", "light", "lightest"])
def test_gains_are_those_of_the_slow_twin(coat):
    rng = np.random.default_rng(1)
    current, target = rng.random((2, 45, 30, 3)).astype(np.float32)
    need = rng.integers(0, 2, (40, 20)).astype(np.uint8)
    window, asked = np.s_[3:43, 7:27], need > 0
    for k in range(len(NAMES)):
        gain, best = gains(current, oklab(target), (3, 7), need, TABLE, k, coat)
        slow, slow_best = slow_gains(current[window], oklab(target[window]), TABLE, k, coat)
        assert np.abs(gain - slow)[asked].max() < 1e-3
        assert (best != slow_best)[asked].mean() < 0.01  # ties may fall either way
        assert (gain[~asked] == touches.UNASKED).all() and (best[~asked] == 0).all()
