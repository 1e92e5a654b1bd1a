"""Plates: how hard each crayon is pressed where, the kernel against its slow twin, and what must
never be wanted.
"""

from concurrent.futures import ThreadPoolExecutor
from itertools import product

import cv2
import numpy as np
import pytest
from fake_box import PAPER, PRESSURES, box
from fake_scene import halves, plan_of, scene_of, two_families

from stroke_gen import analysis, mixing, separation
from stroke_gen.colour import oklab
from stroke_gen.mixing import LAYERS, Mixtures
from stroke_gen.separation import Plan, plates, pressed

TABLE = box()
NAMES = TABLE.names
POOLS = {n: ThreadPoolExecutor(n) for n in (1, 2, 4)}
RED, GREEN = (0.5, 0.03, 0.03), (0.03, 0.3, 0.06)


def plan_for(photo, family=None, table=TABLE, threads=2, layers=None):
    """A plan for a photo that is its own work grid; layers: names of crayons of each family instead
    of the best.
    """
    scene = scene_of(photo, family)
    if layers is None:
        return plan_of(scene, POOLS[threads], table)
    rows = [[table.names.index(n) for n in row] + [-1] * (LAYERS - len(row)) for row in layers]
    every = list(range(len(table.names)))
    return Plan(scene, every, table, Mixtures(np.array(rows)), POOLS[threads])


def wanted(plan, now=None, turn=0, dark_price=0.3):
    paper = np.tile(plan.swatches.paper, (*plan.scene.label.shape, 1)) if now is None else now
    return {
        plan.swatches.names[k]: want for k, want in plates(plan, paper, turn, dark_price).items()
    }


def laid(plan, dark_price=0.3):
    """What the sheet shows when all layers have been laid just as wanted."""
    now = np.tile(plan.swatches.paper, (*plan.scene.label.shape, 1)).astype(np.float32)
    for turn in range(LAYERS):
        for k, want in plates(plan, now, turn, dark_price).items():
            drawn = want > 0
            every = plan.swatches.over(now[drawn])[:, k]
            at = np.interp(np.log(want[drawn]), np.log(PRESSURES), np.arange(len(PRESSURES)))
            low = np.minimum(at.astype(int), len(PRESSURES) - 2)
            part, i = (at - low)[:, None], np.arange(len(low))
            now[drawn] = every[i, low] * (1 - part) + every[i, low + 1] * part
    return now


def ramp(low=0.02, high=0.9, shape=(60, 240)):
    grey = np.linspace(high, low, shape[1], dtype=np.float32)
    return np.repeat(grey[None, :, None], 3, 2).repeat(shape[0], 0)


# ---- what is wanted ------------------------------------------------------------------------------


def test_pressure_follows_tone_without_steps():
    """Along a ramp from light to dark the pressure of black rises, and never by a jump."""
    pressure = wanted(plan_for(ramp(), table=TABLE.only([NAMES.index("black")])))["black"][30]
    drawn = pressure[pressure > 0]
    assert drawn.size > 200 and (pressure[-150:] > 0).all()
    step = np.diff(np.log(drawn))
    assert step.min() > -0.01 and step.max() < 0.2
    assert drawn[0] < 0.08 and drawn[-1] > 0.6


@pytest.mark.parametrize("names", [("brown", "black"), ("yellow", "red"), ("sky", "blue", "black")])
def test_layers_together_give_tones_in_order(names):
    plan = plan_for(ramp(0.1, 0.9), layers=[names])
    sheet = laid(plan)
    light, afar = (oklab(seen)[30, :, 0] for seen in (sheet, analysis.far(sheet)))
    # where a darker crayon sets in, the lighter one gives way a little: not to be seen from afar
    assert np.diff(afar).max() < 0.002 and light[5] - light[-5] > 0.25
    apart = len(light) // 12
    assert (light[apart:] <= light[:-apart]).all(), "a twelfth of the ramp darker is darker"


@pytest.mark.parametrize("turn", [*range(LAYERS), None])
def test_nothing_but_white_is_wanted_of_bare_paper(turn):
    photo = halves(PAPER, RED)
    for name, want in wanted(plan_for(photo, two_families(photo)), turn=turn).items():
        assert name == "white" or (want[:, :40] == 0).all()


def test_nothing_is_wanted_where_the_sheet_is_right():
    red = TABLE.over(TABLE.paper)[NAMES.index("red"), 4]
    photo = np.tile(red, (42, 42, 1))
    assert (
        wanted(plan_for(photo), turn=None) and wanted(plan_for(photo), now=photo, turn=None) == {}
    )


def test_a_sheet_that_is_too_light_is_pressed_once_more_and_one_that_is_too_dark_is_not():
    grey = TABLE.over(TABLE.paper)[NAMES.index("black")]
    plan = plan_for(np.tile(grey[2], (42, 42, 1)), layers=[("black",)])
    light, dark = (wanted(plan, np.tile(grey[p], (42, 42, 1)), None) for p in (0, 4))
    assert light["black"].min() > 0 and dark == {}


def test_going_too_dark_has_its_price():
    """Where no pressure is right, a higher price takes the lighter one."""
    photo = np.tile(np.array((0.3, 0.3, 0.3), np.float32), (30, 30, 1))
    plan = plan_for(photo, layers=[("black",)])
    mean = [wanted(plan, dark_price=price)["black"].mean() for price in (0.0, 4.0)]
    assert mean[0] > 1.05 * mean[1] > 0


@pytest.mark.parametrize("turn", [0, None])
def test_dark_things_are_wanted_dark(turn):
    photo = np.full((42, 51, 3), 0.01, np.float32)
    wants = wanted(plan_for(photo, layers=[("black",)]), turn=turn)
    assert wants["black"].min() > 0.6


def test_a_turn_lays_one_crayon_of_each_family_in_the_order_of_its_mixture():
    photo = halves(GREEN, (0.12, 0.03, 0.05))
    plan = plan_for(
        photo, two_families(photo), layers=[("yellow", "blue"), ("pink", "brown", "black")]
    )
    now = np.tile(PAPER, (60, 102, 1))
    for turn, allowed in enumerate([{"yellow", "pink"}, {"blue", "brown"}, {"black"}, set()]):
        assert set(wanted(plan, now, turn)) <= allowed
    assert set(wanted(plan, turn=0)) == {"yellow", "pink"}
    assert {"yellow", "blue"} <= set(wanted(plan, turn=None)), "once more: all of them"


def test_a_layer_leaves_room_for_what_comes_after_it():
    """Under blue, yellow is wanted otherwise than alone."""
    photo = np.tile(
        TABLE.over(TABLE.over(PAPER)[NAMES.index("yellow"), 4])[NAMES.index("blue"), 2], (42, 42, 1)
    )
    alone, under = (
        wanted(plan_for(photo, layers=[row]))["yellow"].mean()
        for row in (("yellow",), ("yellow", "blue"))
    )
    assert abs(np.log(alone / under)) > 0.1
    plan = plan_for(photo, layers=[("yellow", "blue")])
    done, bare = (
        np.linalg.norm(oklab(now) - oklab(photo), axis=2).mean()
        for now in (laid(plan), np.tile(PAPER, (42, 42, 1)))
    )
    assert done < 0.15 * bare, "and so both together come near"


# ---- plates are smooth and crisp as the photo is -------------------------------------------------


def test_plates_are_crisp_at_a_step():
    photo = halves((0.7, 0.7, 0.7), (0.05, 0.05, 0.05))
    row = wanted(plan_for(photo, table=TABLE.only([NAMES.index("black")])))["black"][30]
    assert (
        np.log(row[:49] / row[:30].mean()).std() < 0.1
        and np.log(row[53:] / row[70:].mean()).std() < 0.1
    )
    assert row[53:].min() > 4 * row[:49].max()


def test_plates_are_smooth_where_the_photo_is():
    """Noise fainter than what the guide takes for an edge does not reach the pressure."""
    rng = np.random.default_rng(1)
    photo = (0.3 + 0.006 * rng.standard_normal((60, 102, 1))).astype(np.float32).repeat(3, 2)
    pressure = np.log(wanted(plan_for(photo, layers=[("black",)]))["black"])
    assert np.abs(np.diff(pressure, axis=1)).mean() < 0.02 and np.isfinite(pressure).all()


def test_a_border_between_families_of_like_colour_does_not_show():
    """Surfaces part what is filled, not how dark it gets."""
    photo = np.full((60, 102, 3), 0.25, np.float32)
    plan = plan_for(photo, two_families(photo), layers=[("black",), ("black",)])
    row = wanted(plan)["black"][30]
    assert np.ptp(np.log(row)) < 0.02


# ---- kernel, threads, pressure -------------------------------------------------------------------


def slow_soften(aim, ground, crayons, levels, table, dark_price):
    """The mean level of each crayon over all choices, each weighted by how little worse it is than
    the best, and less where the best choice without that crayon is hardly worse."""
    choices = np.array(list(product(levels, repeat=len(crayons))))
    colour, price = np.empty((len(choices), 3), np.float32), np.empty(len(choices), np.float32)
    mixing.combine(ground, crayons, levels, mixing.wax(table), colour, price)
    cost = (
        np.linalg.norm(colour - aim, axis=1)
        + price
        + dark_price * np.maximum(0, aim[0] - colour[:, 0])
    )
    weight = np.exp(-(cost - cost.min()) * separation.SHARP)
    without = np.array([cost[choices[:, n] == 0].min() for n in range(len(crayons))])
    worth = np.minimum((without - cost.min()) / separation.WORTH, 1)
    return worth * (weight[:, None] * choices).sum(0) / weight.sum()


@pytest.mark.parametrize("same", [True, False])
@pytest.mark.parametrize("crayons", [[3], [1, 6], [0, 2, 7]])
def test_soften_is_its_slow_twin(crayons, same):
    rng, levels = np.random.default_rng(2), np.arange(len(PRESSURES) + 1)
    aim = oklab(rng.random((20, 3)).astype(np.float32))
    ground = np.tile(PAPER, (20, 1)) if same else rng.random((20, 3)).astype(np.float32)
    cells, crayons = rng.permutation(20)[:9], np.array(crayons)
    level = np.empty((len(crayons), 9), np.float32)
    separation._soften(
        cells,
        aim,
        ground,
        same,
        crayons,
        levels,
        mixing.wax(TABLE),
        np.float32(0.4),
        separation.SHARP,
        level,
    )
    for i, at in enumerate(cells):
        slow = slow_soften(aim[at], ground[at], crayons, levels, TABLE, 0.4)
        assert np.abs(level[:, i] - slow).max() < 5e-3


@pytest.mark.parametrize("turn", [0, 1, None])
def test_plates_are_the_same_with_any_number_of_threads(turn):
    photo = cv2.GaussianBlur(
        np.random.default_rng(2).random((129, 81, 3)).astype(np.float32), (0, 0), 3
    )
    family = np.random.default_rng(3).integers(0, 5, (43, 27)).repeat(3, 0).repeat(3, 1)
    layers = [["yellow", "blue"], ["pink", "green"], ["sky", "brown"], ["white", "red", "black"],
              ["yellow", "sky", "green", "black"]]  # fmt: skip
    first, *others = (
        wanted(plan_for(photo, family, threads=n, layers=layers), turn=turn) for n in POOLS
    )
    for other in others:
        assert (
            first
            and first.keys() == other.keys()
            and all((first[k] == other[k]).all() for k in first)
        )


@pytest.mark.parametrize("turn", [0, 1, 2, 3, None])
def test_pressures_are_those_of_the_table_or_none(turn):
    photo = np.clip(
        cv2.GaussianBlur(np.random.default_rng(3).random((81, 99, 3)), (0, 0), 3) * 3 - 1, 0, 1
    )
    for want in wanted(plan_for(photo), turn=turn).values():
        drawn = want[want > 0]
        assert want.dtype == np.float32 and want.shape == (81, 99) and drawn.size
        assert drawn.min() >= PRESSURES[0] * 0.999 and drawn.max() <= PRESSURES[-1] * 1.001


def test_pressure_of_levels():
    assert np.allclose(pressed(np.arange(1, 7, dtype=np.float32), TABLE), PRESSURES)
    given = pressed(np.linspace(0, 8, 200, dtype=np.float32), TABLE)
    assert (np.diff(given) >= 0).all() and given[0] == 0 and given[-1] == PRESSURES[-1]
    assert given[given > 0].min() == PRESSURES[0]
