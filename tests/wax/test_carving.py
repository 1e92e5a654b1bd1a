"""Carving: what sticks to a tip is carried along and saturates the film; grains; local wear."""

import numpy as np
import pytest
from bench_sheet import Bench, pigments
from numpy.typing import NDArray

from crayonize.crayons.palette import Palette
from crayonize.wax import rub, window
from crayonize.wax.box import Box
from crayonize.wax.contact import Held
from crayonize.wax.deposit import SELDOM, lay_ready
from crayonize.wax.grains import _track
from crayonize.wax.physics import physics
from crayonize.wax.rub import table_of
from crayonize.wax.sheet import Sheet

BLACK = 4  # place in the box


@pytest.fixture
def metric(crayons: Palette) -> Bench:
    """The crayon, without grains."""
    return Bench(physics("metric"), crayons).changed(grains_per_cm2=0.0)


def film_of(sheet: Sheet, crayon: int) -> NDArray[np.float64]:
    """Pure wax of one crayon (rows, cols), um."""
    on = (np.arange(sheet.layer.shape[1]) < sheet.used[:, None]) & (sheet.crayon == crayon)
    return (sheet.layer * on).sum(1, dtype=float).reshape(sheet.rows, sheet.cols)


def over_black(bench: Bench, cell_mm: float = 0.1) -> tuple[Sheet, float]:
    """A black block up to 5.8 mm, and yellow drawn over it and 7 mm on; black that left on tips."""
    sheet = bench.felt(round(5 / cell_mm), round(14 / cell_mm), cell_mm)
    ways = np.arange(0.6, 4.6, 0.6)
    bench.draw(sheet, [bench.stroke([[1, y], [5, y]], 10.0, "black") for y in ways])
    box = Box(bench.palette, bench.physics, cell_mm)
    rub.rub(sheet, [bench.stroke([[1.5, y], [13, y]], 10.0, "yellow") for y in (1.3, 3.7)], box)
    return sheet, box.carried_mm3.get("black", 0.0)


# ---- the load ------------------------------------------------------------------------------------


def test_yellow_drawn_over_black_drags_it_along(metric):
    dirty, carried = over_black(metric)
    clean, none = over_black(metric.changed(sticks=0.0))
    beyond = film_of(dirty, BLACK)[:, 65:].sum(0)  # from .7 mm behind the block on
    assert carried > 0.001 and none == 0
    assert beyond.sum() > 20 * film_of(clean, BLACK)[:, 65:].sum()
    assert beyond[:20].sum() > beyond[20:40].sum() > beyond[40:].sum() / 2 > 0


def test_what_is_dragged_along_is_alike_at_any_resolution(metric):
    dragged = []
    for cell_mm in (0.2, 0.1, 0.05):
        sheet, _ = over_black(metric, cell_mm)
        dragged.append(film_of(sheet, BLACK)[:, round(7 / cell_mm) :].sum() * cell_mm**2)
    assert max(dragged) < 2 * min(dragged)


def test_a_tip_starts_each_stroke_clean(metric):
    """A stroke is the same whether or not its crayon was drawn over black before."""
    lines = [metric.stroke([[1, y], [13, y]], 10.0) for y in (1.5, 4.5)]
    sheets = [metric.felt(60, 140), metric.felt(60, 140)]
    metric.draw(sheets[0], [metric.stroke([[1, 1.5], [13, 1.5]], 10.0, "black")])
    for sheet in sheets:
        metric.draw(sheet, lines)
    away = slice(33 * 140, None)
    assert film_of(sheets[0], BLACK)[:33].sum() > 0 == film_of(sheets[0], BLACK)[33:].sum()
    np.testing.assert_array_equal(sheets[0].total[away], sheets[1].total[away])


def test_clumps_come_off_whole(metric):
    """They hold no more wax than else, but some of it stands as high as nothing else does."""
    apart, _ = over_black(metric.changed(clump_um=1e9))
    clumped, _ = over_black(metric.changed(clump_um=0.5, clump_mm=2.0))
    even, lumps = (film_of(sheet, BLACK)[:, 65:] for sheet in (apart, clumped))
    assert lumps.max() > 2 * even.max()
    assert 0.25 < lumps.sum() / even.sum() < 2


@pytest.mark.parametrize("um", [5.0, 40.0])
def test_a_film_saturates(metric, um):
    """After so many coats as much comes off as is given; without it the film grows on and on."""
    heights = {}
    for peel in (metric.physics.peel_um, 1e9):
        bench = metric.changed(peel_um=peel)
        sheet, box, heights[peel] = bench.felt(40, 40), Box(bench.palette, bench.physics, 0.1), []
        for coat in range(200):
            ends = [[0.5, 3.5], [3.5, 0.5]][coat % 2]
            coats = [
                bench.stroke([[ends[0], y], [ends[1], y]], um) for y in (0.8, 1.4, 2, 2.6, 3.2)
            ]
            rub.rub(sheet, coats, box)
            if coat in (99, 199):
                heights[peel].append(sheet.film_um()[12:28, 12:28].mean())
        assert pigments(sheet)[0] * 1e-5 == pytest.approx(box.given_mm3["red"], rel=1e-4)
    kept, grown = heights.values()
    assert kept[1] < 120 and kept[1] < 0.7 * grown[1]
    assert kept[1] - kept[0] < 0.5 * (grown[1] - grown[0])


# ---- grains --------------------------------------------------------------------------------------


def coat(bench: Bench, times: int = 1) -> tuple[Sheet, float]:
    """A sheet covered once, and how much wax it took in um times cells."""
    sheet, box = bench.sheet(np.zeros((200, 420))), Box(bench.palette, bench.physics, 0.1)
    given = 0.0
    for _ in range(times):
        lines = [bench.stroke([[1, y], [41, y]], 8.0) for y in np.arange(1, 19.5, 1.5)]
        given += rub.rub(sheet, lines, box)
    return sheet, given


def test_grains_come_out_by_the_area_drawn_over(metric):
    """Counted by the specks that they leave: all that grains give."""
    calm = metric.changed(sticks=0.0, nu=0.0, rate_per_mm=0.0)
    for per_cm2 in (5.0, 20.0):
        gritty = calm.changed(grains_per_cm2=per_cm2, grain_mm=2.0)
        _, specks = coat(gritty)
        breadth = gritty.physics.constants(0.1).track * 1.5
        one = 2 * np.pi * breadth**2 * gritty.physics.speck_um
        came = specks / one / (13 * 40 * 1.6 / 100)
        assert 0.6 * per_cm2 < came < 1.1 * per_cm2  # some are still there when the stroke ends


def test_a_track_is_a_soft_furrow_between_ridges(metric):
    calm = metric.changed(sticks=0.0, nu=0.0, rate_per_mm=0.0, speck_um=0.0)
    bench = calm.changed(grains_per_cm2=8.0, grain_mm=300.0)
    sheet = bench.sheet(np.zeros((60, 420)))
    sheet.total[:], sheet.used[:], sheet.layer[:, 0], sheet.crayon[:, 0] = 20, 1, 20, 2
    bench.draw(sheet, [bench.stroke([[1, 3], [41, 3]], 8.0)])
    across = sheet.film_um()[:, 300:340].mean(1)
    assert pigments(sheet)[0] == pytest.approx(20 * sheet.total.size, rel=1e-5)
    assert across.min() < 15 and across.max() > 21
    assert abs(int(across.argmin()) - 30) < 8  # under the tip


def test_a_track_has_no_hard_edge(metric):
    """What a grain pushes aside falls off with distance as a bell curve does."""
    sheet = metric.sheet(np.zeros((40, 60)))
    sheet.total[:], sheet.used[:], sheet.layer[:, 0], sheet.crayon[:, 0] = 20, 1, 20, 2
    table, held = table_of(sheet, Box(metric.palette, metric.physics, 0.1), True), Held(0, 41, 1, 9)
    one, nothing = np.float32(1), np.float32(0)
    _track(held, table, 30.0, 20.0, 40.0, 20.5, one, nothing, 20.0, 0.5)
    breadth = float(table.constants.track)
    aside = np.arange(-2, 3)
    left = 20 * (1 - 0.5 * np.exp(-0.5 * (aside / breadth) ** 2))
    assert breadth > 1 and sheet.film_um()[18:23, 30] == pytest.approx(left, rel=1e-3)


def test_two_strokes_alike_have_grains_of_their_own(metric):
    """They are scattered by the crayon's strokes so far, and not by the way of a stroke."""
    dry = metric.changed(sticks=0.0, nu=0.0, rate_per_mm=0.0, grains_per_cm2=20.0, slip=0.0)
    sheet = dry.sheet(np.zeros((60, 420)))
    dry.draw(sheet, [dry.stroke([[1, y], [41, y]], 8.0) for y in (1.5, 4.5)])
    first, second = sheet.film_um()[:30], sheet.film_um()[30:]
    assert first.max() > 5 and second.max() > 5
    assert np.abs(first - second).max() > 5


def test_grains_follow_the_strokes_number_in_the_whole_drawing(metric):
    """Drawn at once, or in parts: the same bytes; another crayon's strokes do not count."""
    gritty = metric.changed(grains_per_cm2=20.0)
    lines = [gritty.stroke([[1, y], [13, y]], 8.0, "red") for y in (1.0, 2.0, 3.0)]
    others = [gritty.stroke([[1, 5.8], [13, 5.8]], 8.0, "blue")]
    films = []
    for parts in ([lines + others], [lines[:1], others + lines[1:]]):
        sheet, box = gritty.felt(70, 140), Box(gritty.palette, gritty.physics, 0.1)
        for part in parts:
            rub.rub(sheet, part, box)
        films.append(sheet.film_um().copy())
    np.testing.assert_array_equal(films[0], films[1])


# ---- local wear ----------------------------------------------------------------------------------


def test_wear_takes_neighbours_along(metric):
    """A cell that loses wax lowers those around it, in all by `around` of its loss, evenly less
    with distance; a chequered loss least of all raises what it should level.
    """
    constants = metric.physics.constants(0.1)._replace(wear=np.float32(0), around=np.float32(0.4))
    side, reach = 15, 3
    single, chequered = np.zeros((side, side)), np.indices((side, side)).sum(0) % 2
    single[7, 7] = 1.0
    lowered = []
    for loss in (single, chequered):
        w = window.window(side * side, 3)
        w.hand[window.WORN] = SELDOM - 1
        w.broken[:] = loss.ravel()
        given = lay_ready(w, side, reach, constants)
        assert given > 0
        lowered.append(w.mask.reshape(side, side).astype(float))
    one, many = lowered
    assert one.sum() == pytest.approx(0.4, rel=1e-5)
    assert one[7, 7] > one[7, 8] > one[7, 9] >= 0 and one[7, 8] == one[8, 7] > one[8, 8] > 0
    inner = many[6:9, 6:9]
    assert (inner[chequered[6:9, 6:9] > 0].min()) > inner[chequered[6:9, 6:9] == 0].max()
