"""Which crayon where: the kernels against slow twins, and what must never be wanted."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import cv2
import numpy as np
import pytest
from fake_box import PAPER, box

from stroke_gen import analysis, recipes, separation
from stroke_gen.colour import oklab
from stroke_gen.params import Pass
from stroke_gen.separation import Plan, base_pressure, gains, grouped, plates, streaks

TABLE = box()
POOLS = {n: ThreadPoolExecutor(n) for n in (1, 2, 4)}
TIP = 6.0  # cells
KINDS = ["base", "shade", "free"]


def plan_for(photo, table=TABLE, threads=2):
    """A plan for a photo that is its own work grid."""
    h, w = photo.shape[:2]
    lab = oklab(photo)
    field = np.dstack([np.full((h, w), v, np.float32) for v in (0.64, -0.77)])
    zero = np.zeros((h, w), np.float32)
    scene = analysis.Scene(photo, lab, photo, field, zero, zero, 0.4)
    mixes = recipes.find(lab, table, 10, 9, np.random.default_rng(0))
    return Plan(scene, table, mixes, grouped(lab, mixes, 1.0, zero, POOLS[2]), POOLS[threads])


def wanted(photo, coat, flat=0.0, now=None, plan=None):
    plan = plan or plan_for(photo)
    now = np.tile(plan.swatches.paper, (*photo.shape[:2], 1)) if now is None else now
    return plates(plan, now, oklab(photo), coat, TIP, flat, np.zeros(photo.shape[:2], np.float32))


def halves(left, right, shape=(60, 100)):
    photo = np.tile(np.array(left, np.float32), (*shape, 1))
    photo[:, shape[1] // 2 :] = right
    return photo


def slow_gains(current, lab, table, k, coat):
    """What `gains` promises, one formula after the other."""
    usable = [p for p in range(len(table.pressures)) if table.pressures[p] <= coat.hardest] or [0]

    def error(light):
        d = oklab(light.astype(np.float32)).astype(float) - lab
        return np.sqrt(coat.tone * d[..., 0] ** 2 + d[..., 1] ** 2 + d[..., 2] ** 2), d[..., 0]

    before, _ = error(current)
    each = []
    for p in usable:
        after, lighter = error(table.a[k, p] * current + table.b[k, p])
        after += coat.dark_price * np.maximum(0, -lighter) + separation.GRAIN_PRICE * table.grain[k, p]
        each.append(before - after)
    return np.max(each, 0), np.argmax(each, 0)


COATS = [Pass(), Pass(tone=0.3, dark_price=1.0), Pass(hardest=0.4), Pass(hardest=0.03)]


@pytest.mark.parametrize("coat", COATS, ids=["plain", "first", "light", "lightest"])
def test_gains_are_those_of_the_slow_twin(coat):
    rng = np.random.default_rng(1)
    current, target = rng.random((2, 45, 30, 3)).astype(np.float32)
    need = rng.integers(0, 2, (40, 20)).astype(np.uint8)
    window, asked = np.s_[3:43, 7:27], need > 0
    for k in range(len(TABLE.names)):
        gain, best = gains(current, oklab(target), (3, 7), need, TABLE, k, coat)
        slow, slow_best = slow_gains(current[window], oklab(target[window]), TABLE, k, coat)
        assert np.abs(gain - slow)[asked].max() < 1e-3
        assert (best != slow_best)[asked].mean() < 0.01  # ties may fall either way
        assert (gain[~asked] == separation.UNASKED).all() and (best[~asked] == 0).all()


@pytest.mark.parametrize("kind", KINDS)
def test_plates_are_the_same_with_any_number_of_threads(kind):
    photo = cv2.GaussianBlur(np.random.default_rng(2).random((130, 80, 3)).astype(np.float32), (0, 0), 3)
    first, *others = (wanted(photo, Pass(kind=kind), plan=plan_for(photo, threads=n)) for n in POOLS)
    for other in others:
        assert first.keys() == other.keys() and all((first[k] == other[k]).all() for k in first)


def test_a_plate_does_not_depend_on_what_lies_far_away():
    """A crayon's plate is worked out in a window; another one's area makes that window larger."""
    red = TABLE.over(TABLE.paper)[TABLE.names.index("red"), 4]
    photo = np.tile(PAPER, (120, 160, 1)).astype(np.float32)
    photo[30:60, 20:50] = red
    both = photo.copy()
    both[90:110, 110:150] = red
    alone, beside = (wanted(p, Pass(kind="base"), plan=plan_for(both)) for p in (photo, both))
    k = TABLE.names.index("red")
    assert alone[k][:75].any() and (alone[k][:75] == beside[k][:75]).all()


@pytest.mark.parametrize("kind", KINDS)
def test_no_crayon_is_wanted_on_bare_paper(kind):
    photo = halves(PAPER, (0.5, 0.05, 0.05))
    for pressure in wanted(photo, Pass(kind=kind, gain=0.0)).values():
        assert (pressure[:, : 50 - int(TIP)] == 0).all()


@pytest.mark.parametrize("kind", KINDS)
def test_white_paper_wants_nothing_at_all(kind):
    assert wanted(np.tile(PAPER, (40, 40, 1)), Pass(kind=kind, gain=0.0)) == {}


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_is_wanted_where_the_sheet_shows_the_target(kind):
    red = TABLE.over(TABLE.paper)[TABLE.names.index("red"), 4]
    photo = np.tile(red, (40, 40, 1))
    assert wanted(photo, Pass(kind=kind), now=photo) == {}


def test_dark_things_are_wanted_dark():
    photo = np.full((40, 50, 3), 0.01, np.float32)
    for kind in ("base", "shade"):
        ((k, pressure),) = wanted(photo, Pass(kind=kind)).items()
        assert TABLE.names[k] in ("black", "brown") and pressure.min() > 0.5


@pytest.mark.parametrize("kind", KINDS)
def test_each_place_wants_one_crayon_at_most_at_a_pressure_of_the_table(kind):
    photo = cv2.GaussianBlur(np.random.default_rng(3).random((80, 100, 3)).astype(np.float32), (0, 0), 3) * 3 - 1
    wants = wanted(np.clip(photo, 0, 1), Pass(kind=kind))
    pressures = np.stack(list(wants.values()))
    assert (pressures > 0).sum(0).max() == 1
    drawn = pressures[pressures > 0]
    assert drawn.min() >= TABLE.pressures[0] * 0.999 and drawn.max() <= TABLE.pressures[-1] * 1.001


@pytest.mark.parametrize("kind", KINDS)
def test_no_more_than_the_hardest_pressure(kind):
    photo = halves((0.01, 0.01, 0.01), (0.3, 0.02, 0.02))
    wants = wanted(photo, Pass(kind=kind, hardest=0.2))
    assert wants and max(p.max() for p in wants.values()) <= 0.2001


def test_coat_for_details_stays_on_them():
    photo = np.full((40, 60, 3), 0.02, np.float32)
    plan = plan_for(photo)
    detail = np.zeros((40, 60), np.float32)
    detail[10:20, 10:30] = 0.5
    plan = replace(plan, scene=replace(plan.scene, detail=detail))
    (pressure,) = wanted(photo, Pass(detail=0.3), plan=plan).values()
    assert ((pressure > 0) == (detail > 0.3)).all()


def test_flat_gives_one_pressure_to_a_colour():
    ramp = np.linspace(0.02, 0.12, 100, dtype=np.float32)[None, :, None] * np.ones((60, 1, 3), np.float32)
    plan = plan_for(ramp)
    plan = replace(plan, group=np.zeros_like(plan.group))
    (followed,) = wanted(ramp, Pass(kind="base"), flat=0.0, plan=plan).values()
    (flat,) = wanted(ramp, Pass(kind="base"), flat=1.0, plan=plan).values()
    assert np.ptp(followed[followed > 0]) > 0.1
    assert np.ptp(flat[flat > 0]) < 1e-4


def test_pressure_follows_tone_without_steps():
    """Along a ramp the base's pressure rises with darkness, and never by a jump."""
    black = TABLE.only([TABLE.names.index("black")])
    grey = np.linspace(0.9, 0.02, 400, dtype=np.float32)[None, :, None] * np.ones((4, 1, 3), np.float32)
    plan = plan_for(grey, black)
    pressure = base_pressure(plan, oklab(grey))
    assert np.diff(np.log(pressure[0])).min() > -1e-4
    assert np.diff(np.log(pressure[0])).max() < 0.25
    assert pressure[0, 0] < 0.06 and pressure[0, -1] > 0.6


def test_base_pressure_is_the_same_with_any_number_of_threads():
    photo = np.random.default_rng(4).random((100, 60, 3)).astype(np.float32)
    results = [base_pressure(plan_for(photo, threads=n), oklab(photo)) for n in POOLS]
    assert (results[0] == results[1]).all() and (results[0] == results[2]).all()


def test_free_coat_takes_the_crayon_that_helps_most():
    """A sheet that is too light where it should be blue wants blue there, and nothing elsewhere."""
    blue = TABLE.over(TABLE.paper)[TABLE.names.index("blue"), 4]
    photo = halves(blue, PAPER)
    wants = wanted(photo, Pass(kind="free"))
    assert [TABLE.names[k] for k in wants] == ["blue"]


def test_neighbours_agree_on_a_recipe():
    photo = halves((0.5, 0.03, 0.03), (0.03, 0.3, 0.06))
    photo[30, 20] = (0.03, 0.3, 0.06)
    lab, zero = oklab(photo), np.zeros(photo.shape[:2], np.float32)
    mixes = recipes.find(lab, TABLE, 6, 9, np.random.default_rng(0))
    assert len(np.unique(grouped(lab, mixes, 0.0, zero, POOLS[2]))) == 2
    group = grouped(lab, mixes, 2.0, zero, POOLS[2])
    assert (group[:, :48] == group[0, 0]).all() and (group[:, 52:] == group[0, 99]).all()
    assert group[0, 0] != group[0, 99]


@pytest.mark.parametrize("wrist_deg", [-50, 0, 90])
def test_streaks_run_along_the_wrist(wrist_deg):
    noise = streaks((200, 260), 4.0, wrist_deg, np.random.default_rng(5))
    assert noise.shape == (200, 260) and 0.4 < noise.std() < 1.3
    gy, gx = np.gradient(noise)
    c, s = np.cos(np.deg2rad(wrist_deg)), np.sin(np.deg2rad(wrist_deg))
    assert np.abs(gx * c + gy * s).mean() < 0.4 * np.abs(gy * c - gx * s).mean()


def test_recipes_change_only_the_coats_that_ask_for_them():
    photo = halves((0.5, 0.03, 0.03), (0.03, 0.05, 0.4))
    plan = plan_for(photo)
    first = {TABLE.names[k] for k in wanted(photo, Pass(kind="base"), plan=plan)}
    assert first == {TABLE.names[k] for k in plan.recipes.base[np.unique(plan.group)]}
