"""Scheduling: strokes of one level never meet, order is kept, and the work is shared out whole."""

import naive
import numpy as np
import pytest

from crayonize import schedule
from stroke_gen.drawing import Tip


def packed(paths):
    """Points in cells and where each stroke begins."""
    first = np.append(0, np.cumsum([len(p) for p in paths]))
    flat = np.concatenate(paths)
    return np.column_stack([flat, np.ones(len(flat))]).astype(np.float32), first


def random_paths(rng, number, size, far=60):
    return [
        rng.uniform(-0.1, 1.1, 2) * size + np.cumsum(rng.normal(0, far, (rng.integers(1, 5), 2)), 0) - far / 2
        for _ in range(number)
    ]


def test_levels_are_those_of_a_plain_search():
    rng = np.random.default_rng(1)
    points, first = packed(random_paths(rng, 150, 400))
    reach = rng.uniform(2, 30, 150).astype(np.float32)
    level = schedule.levels(points, first, reach, 390, 410)
    widened = reach + schedule.TILE // 2
    assert level.tolist() == naive.levels(points, first, widened, 390, 410, schedule.TILE)
    assert level.max() > 2 and np.bincount(level).max() > 3


@pytest.mark.parametrize("far", [6, 80])
def test_strokes_that_come_close_are_drawn_in_order(far):
    """Every stroke that passes within both reaches of an earlier one has a higher level."""
    rng = np.random.default_rng(2)
    size, number, reach = 250, 90, 5.0
    paths = random_paths(rng, number, size, far)
    level = schedule.levels(*packed(paths), np.full(number, reach, np.float32), size, size)
    dense = []
    for path in paths:
        way = np.append(0, np.cumsum(np.hypot(*np.diff(path, axis=0).T)))
        at = np.linspace(0, way[-1], int(way[-1]) + 2)
        spots = np.column_stack([np.interp(at, way, path[:, c]) for c in range(2)])
        dense.append(spots[((spots >= 0) & (spots < size)).all(1)])
    met = 0
    for later in range(number):
        for earlier in range(later):
            gaps = np.abs(dense[later][:, None] - dense[earlier][None]).max(2)
            if gaps.size and gaps.min() < 2 * reach - 1:
                met += 1
                assert level[later] > level[earlier]
    assert met > 20


def test_strokes_of_one_level_change_disjoint_cells(bench, monkeypatch):
    """Smearing included: each stroke is drawn alone on a coated sheet, and what it changes is compared."""
    rng = np.random.default_rng(3)
    strokes = bench.scribble(rng, 60, 20.0)
    found, search = [], schedule.levels
    monkeypatch.setattr(schedule, "levels", lambda *given: found.append(search(*given)) or found[-1])
    bench.draw(bench.felt(200, 200), strokes)
    level = found[0]
    assert np.bincount(level).max() > 3
    owner = np.full((level.max() + 1, 200 * 200), -1)
    coat = 15 * rng.random(200 * 200).astype(np.float32)
    for number, stroke in enumerate(strokes):
        sheet = bench.felt(200, 200)
        sheet.total[:] = sheet.layer[:, 0] = coat
        sheet.count[:], sheet.crayon[:, 0] = 1, 5
        bench.draw(sheet, [stroke])
        changed = (sheet.total != coat) | (sheet.layer[:, 0] != coat) | (sheet.count != 1)
        assert (owner[level[number], changed] == -1).all()
        owner[level[number], changed] = number


@pytest.mark.parametrize("kind", ["blunt", "side"])
def test_no_cell_beyond_the_reach_is_changed(bench, monkeypatch, kind):
    reaches, search = [], schedule.levels
    monkeypatch.setattr(schedule, "levels", lambda *given: reaches.append(given[2][0]) or search(*given))
    rng = np.random.default_rng(5)
    for _ in range(30):
        sheet = bench.sheet(np.zeros((80, 80)))
        sheet.total[:] = sheet.layer[:, 0] = 20
        sheet.count[:], sheet.crayon[:, 0] = 1, 5
        x, y = rng.uniform(3.5, 4.5, 2)
        bench.draw(sheet, [bench.stroke([[x, y]], 12.0, tip=Tip(kind, 2.0))])
        rows, cols = np.divmod(np.flatnonzero(sheet.total != 20), 80)
        assert max(cols.max() + 1 - 10 * x, 10 * x - cols.min()) <= reaches[-1]
        assert max(rows.max() + 1 - 10 * y, 10 * y - rows.min()) <= reaches[-1]


def test_shares_hold_every_stroke_once_and_about_the_same_work():
    rng = np.random.default_rng(4)
    cost = rng.exponential(1.0, 300)
    members = rng.permutation(300)[:200]
    for threads in (1, 2, 3, 4, 8):
        shares = schedule.shares(members, cost, threads)
        assert sorted(np.concatenate(shares)) == sorted(members)
        work = [cost[share].sum() for share in shares]
        assert len(shares) == threads and max(work) - min(work) < 2 * cost.max()
    assert [s.tolist() for s in schedule.shares(members[:2], cost, 8)] in (
        [[members[0]], [members[1]]],
        [[members[1]], [members[0]]],
    )
    assert schedule.shares(members[:1], cost, 4)[0].tolist() == [members[0]]
