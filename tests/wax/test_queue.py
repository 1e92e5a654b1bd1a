"""Scheduling: strokes of one level never meet, order is kept, and the work is shared out whole."""

import threading
import time

import naive
import numpy as np
import pytest

from crayonize.wax import queue as schedule
from stroke_gen.drawing import Tip
from stroke_gen.jit import lean_kernel


def packed(paths):
    """Points in cells and where each stroke begins."""
    first = np.append(0, np.cumsum([len(p) for p in paths]))
    flat = np.concatenate(paths)
    return np.column_stack([flat, np.ones(len(flat))]).astype(np.float32), first


def random_paths(rng, number, size, far=60):
    return [
        rng.uniform(-0.1, 1.1, 2) * size
        + np.cumsum(rng.normal(0, far, (rng.integers(1, 5), 2)), 0)
        - far / 2
        for _ in range(number)
    ]


def levels(order):
    """One more than the highest level among those a stroke waits for, from the graph alone."""
    level = np.zeros(len(order.waits), int)
    waits = order.waits.copy()
    for s in range(len(level)):
        assert waits[s] == 0  # all it waits for come before it
        for heir in order.heirs[order.first[s] : order.first[s + 1]]:
            level[heir] = max(level[heir], level[s] + 1)
            waits[heir] -= 1
    return level


def test_levels_are_those_of_a_plain_search():
    rng = np.random.default_rng(1)
    points, first = packed(random_paths(rng, 150, 400))
    reach = rng.uniform(2, 30, 150).astype(np.float32)
    level = levels(schedule.order(points, first, reach, 390, 410))
    widened = reach + schedule.TILE // 2
    assert level.tolist() == naive.levels(points, first, widened, 390, 410, schedule.TILE)
    assert level.max() > 2 and np.bincount(level).max() > 3


@pytest.mark.parametrize("far", [6, 80])
def test_strokes_that_come_close_are_drawn_in_order(far):
    """Every stroke that passes within both reaches of an earlier one has a higher level."""
    rng = np.random.default_rng(2)
    size, number, reach = 250, 90, 5.0
    paths = random_paths(rng, number, size, far)
    level = levels(schedule.order(*packed(paths), np.full(number, reach, np.float32), size, size))
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


def test_no_tile_within_reach_of_a_path_is_missed():
    """However near or far apart its points lie: here some lie close together, then comes a jump."""
    rng, size, reach = np.random.default_rng(8), 400, 1.0
    tiles = size // schedule.TILE
    for _ in range(300):
        near, jump = rng.uniform(0.2, 1.1), rng.uniform(6, 20)
        steps = np.tile([near] * 8 + [jump], 4)[:, None] * np.sign(rng.normal(0, 1, 2))
        points, first = packed([rng.uniform(0.3, 0.7, 2) * size + np.cumsum(steps, 0)])
        mark, found = np.full((tiles, tiles), -1, np.int32), np.empty(tiles**2, np.int32)
        wide = np.full(1, reach + schedule.TILE // 2, np.float32)
        number = schedule._touch(points, first, wide, 0, schedule.TILE, mark, found)
        assert len(set(found[:number])) == number == (mark == 0).sum()
        way = np.append(0, np.cumsum(np.hypot(*np.diff(points[:, :2], axis=0).T)))
        at = np.linspace(0, way[-1], int(2 * way[-1]) + 2)
        spots = np.column_stack([np.interp(at, way, points[:, c]) for c in range(2)])
        for corner in ((-1, -1), (-1, 1), (1, -1), (1, 1)):
            x, y = ((spots + reach * np.array(corner)) // schedule.TILE).astype(int).T
            inside = (x >= 0) & (y >= 0) & (x < tiles) & (y < tiles)
            assert (mark[y[inside], x[inside]] == 0).all()


def test_strokes_of_one_level_change_disjoint_cells(bench, monkeypatch):
    """Smearing included: each stroke is drawn alone on a coated sheet, and what it changes is
    compared.
    """
    rng = np.random.default_rng(3)
    strokes = bench.scribble(rng, 60, 20.0)
    found, search = [], schedule.order
    monkeypatch.setattr(schedule, "order", lambda *given: found.append(search(*given)) or found[-1])
    bench.draw(bench.felt(200, 200), strokes)
    level = levels(found[0])
    assert np.bincount(level).max() > 3
    owner = np.full((level.max() + 1, 200 * 200), -1)
    coat = 15 * rng.random(200 * 200).astype(np.float32)
    for number, stroke in enumerate(strokes):
        sheet = bench.felt(200, 200)
        sheet.total[:] = sheet.layer[:, 0] = coat
        sheet.used[:], sheet.crayon[:, 0] = 1, 5
        bench.draw(sheet, [stroke])
        changed = (sheet.total != coat) | (sheet.layer[:, 0] != coat) | (sheet.used != 1)
        assert (owner[level[number], changed] == -1).all()
        owner[level[number], changed] = number


@pytest.mark.parametrize("kind", ["blunt", "side"])
def test_no_cell_beyond_the_reach_is_changed(bench, monkeypatch, kind):
    reaches, search = [], schedule.order
    monkeypatch.setattr(
        schedule, "order", lambda *given: reaches.append(given[2][0]) or search(*given)
    )
    rng = np.random.default_rng(5)
    for _ in range(30):
        sheet = bench.sheet(np.zeros((80, 80)))
        sheet.total[:] = sheet.layer[:, 0] = 20
        sheet.used[:], sheet.crayon[:, 0] = 1, 5
        x, y = rng.uniform(3.5, 4.5, 2)
        bench.draw(sheet, [bench.stroke([[x, y]], 12.0, tip=Tip(kind, 2.0))])
        rows, cols = np.divmod(np.flatnonzero(sheet.total != 20), 80)
        assert max(cols.max() + 1 - 10 * x, 10 * x - cols.min()) <= reaches[-1]
        assert max(rows.max() + 1 - 10 * y, 10 * y - rows.min()) <= reaches[-1]


def one_by_one(see):
    """What `schedule.run` calls, drawing one stroke at a time: `see` it, and no more."""

    def draw(queue, done):
        taken = schedule.take(queue, done)
        if taken >= 0:
            see(taken)
        return taken

    return draw


@pytest.mark.parametrize("threads", [1, 2, 3, 8])
def test_every_stroke_is_drawn_once_and_after_those_it_waits_for(threads):
    rng = np.random.default_rng(4)
    points, first = packed(random_paths(rng, 300, 900))
    order = schedule.order(points, first, np.full(300, 5, np.float32), 900, 900)
    before = [
        {p for p in range(300) if s in order.heirs[order.first[p] : order.first[p + 1]]}
        for s in range(300)
    ]
    lock, done, reported = threading.Lock(), [], []

    def see(stroke):
        with lock:
            assert before[stroke] <= set(done)
            done.append(stroke)

    schedule.run(one_by_one(see), order, threads, reported.append)
    assert sorted(done) == list(range(300))
    assert reported == sorted(reported) and reported[-1] == 300
    assert threads > 1 or done == sorted(done)  # the earliest first


def test_a_failure_in_a_thread_is_raised_and_ends_the_work():
    points, first = packed([np.array([[5.0, 5.0]])] * 50)
    order = schedule.order(points, first, np.full(50, 5, np.float32), 64, 64)
    drawn = []

    def see(stroke):
        drawn.append(stroke)
        if len(drawn) == 3:
            raise RuntimeError("out of wax")

    with pytest.raises(RuntimeError, match="out of wax"):
        schedule.run(one_by_one(see), order, 4)
    assert len(drawn) == 3


def test_being_interrupted_ends_the_work():
    points, first = packed([np.array([[5.0, 5.0]])] * 50)
    order = schedule.order(points, first, np.full(50, 5, np.float32), 64, 64)
    drawn = []

    def see(stroke):
        drawn.append(stroke)
        time.sleep(0.05)

    def progress(done):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        schedule.run(one_by_one(see), order, 4, progress)
    assert len(drawn) < 10


def test_what_is_ready_comes_off_the_heap_in_order():
    rng = np.random.default_rng(6)
    heap, held = np.zeros(64, np.int32), []
    for number in rng.permutation(400):
        if held and (len(held) == 64 or rng.random() < 0.45):
            assert schedule._pop(heap, len(held) - 1) == min(held)
            held.remove(min(held))
        schedule._push(heap, len(held), number)
        held.append(number)


@pytest.mark.parametrize("threads, times", [(4, 400_000), (12, 100_000)])
def test_the_lock_lets_one_thread_in_at_a_time(threads, times):
    """Kernels on many threads count up without ever losing a step."""

    @lean_kernel
    def count(lock, counter, times):
        for _ in range(times):
            while schedule.exchange(lock, 0, 1):
                pass
            counter[0] += 1
            schedule.exchange(lock, 0, 0)

    lock, counter = np.zeros(1, np.int32), np.zeros(1, np.int64)
    count(lock, counter, 1)
    hands = [threading.Thread(target=count, args=(lock, counter, times)) for _ in range(threads)]
    for hand in hands:
        hand.start()
    for hand in hands:
        hand.join()
    assert counter[0] == times * threads + 1
