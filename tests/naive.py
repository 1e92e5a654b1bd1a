"""Slow, obvious twins of the wax and light kernels, for tests to compare with.

A sheet here is a dictionary from (row, col) to a `Column` of plain Python numbers; every step goes
over cells one by one, in the order and the words of the paper (Figs. 3, 4, 6 and 7), in double
precision.
"""

import itertools
import math
from dataclasses import dataclass, field

import numpy as np

from crayonize.wax.sheet import Sheet

LAYERS, THIN_UM = 4, 0.4  # as `columns` has them; own copies, so that a change there is noticed

NEIGHBOURS = [(dy, dx) for dy in (-1, 0, 1) for dx in (-1, 0, 1) if (dy, dx) != (0, 0)]


@dataclass
class Column:
    """Paper at the bottom, then a blend of old wax, then pure layers [crayon, um], top last."""

    paper: float
    layers: list[list] = field(default_factory=list)
    # sums of h, k h (rgb), s h (rgb)
    blend: np.ndarray = field(default_factory=lambda: np.zeros(7))

    def wax(self) -> float:
        return float(self.blend[0]) + sum(height for _, height in self.layers)

    def top(self, firm: float = 1.0) -> float:
        return self.paper + firm * self.wax()


def columns_of(sheet: Sheet) -> dict[tuple[int, int], Column]:
    """A sheet as columns."""
    made = {}
    for cell in range(sheet.rows * sheet.cols):
        layers = [
            [int(sheet.crayon[cell, j]), float(sheet.layer[cell, j])]
            for j in range(sheet.used[cell])
        ]
        column = Column(float(sheet.paper[cell]), layers, sheet.blend[cell].astype(float))
        made[divmod(cell, sheet.cols)] = column
    return made


def add(
    column: Column, crayon: int, height: float, optics: np.ndarray, thin: float = THIN_UM
) -> None:
    """Lay wax on a column; below films thinner than `thin` it still finds its own colour.

    From a column too high the thinnest film under `thin` sinks into the blend, or else the lowest.
    """
    for layer in reversed(column.layers):
        if layer[0] == crayon:
            layer[1] += height
            return
        if layer[1] >= thin:
            break
    if len(column.layers) == LAYERS:
        thinnest = min(column.layers, key=lambda layer: layer[1])
        gone = thinnest if thinnest[1] < thin else column.layers[0]
        column.layers = [layer for layer in column.layers if layer is not gone]
        column.blend += gone[1] * np.array([1, *optics[gone[0]]])
    column.layers.append([crayon, height])


def take(column: Column, height: float) -> tuple[list[list], np.ndarray]:
    """Lift the topmost `height` off a column: pure layers, topmost first, and a share of the
    blend.
    """
    lifted = []
    while column.layers and height > 0:
        crayon, there = column.layers[-1]
        part = min(height, there)
        lifted.append([crayon, part])
        height -= part
        if part < there:
            column.layers[-1][1] -= part
        else:
            column.layers.pop()
    share = min(1.0, height / column.blend[0]) if column.blend[0] > 0 else 0.0
    from_blend = share * column.blend
    column.blend = column.blend - from_blend
    return lifted, from_blend


def balance(gaps: list[float], wanted: float) -> float:
    """Height of the tip at which the overlaps sum to `wanted` (Fig. 4), by bisection."""
    low, high = max(gaps) - wanted, max(gaps)
    for _ in range(100):
        middle = (low + high) / 2
        if sum(max(0.0, gap - middle) for gap in gaps) > wanted:
            low = middle
        else:
            high = middle
    return (low + high) / 2


def smear(columns, over, tops, direction, wax, nu, alpha, beta, optics, reach=1, yields=0.0):
    """Fig. 7 for all cells in contact at once; returns what the crayon's own wax adds where.

    Of the share nu that could move pull / (pull + yields) does, pull being the sum of Eq. 4.
    """
    own, others, blends = {}, {}, []
    for (y, x), overlap in over.items():
        standing = min(columns[y, x].wax(), overlap)
        if standing <= 1e-3:
            continue
        weight = {}
        for dy, dx in NEIGHBOURS:
            to = (y + reach * dy, x + reach * dx)
            if to in columns:
                distance = math.hypot(dy, dx)
                cosine = (dx * direction[0] + dy * direction[1]) / distance
                pull = (alpha * (tops[y, x] - tops[to]) + beta * cosine) / distance
                weight[to] = max(0.0, pull)
        if not sum(weight.values()):
            continue
        pull = sum(weight.values())
        moved = nu * standing * pull / (pull + yields)
        lifted, from_blend = take(columns[y, x], moved)
        for to, w in weight.items():
            share = w / sum(weight.values())
            for crayon, height in lifted:
                if crayon == wax:
                    own[to] = own.get(to, 0.0) + share * height
                elif share > 0:
                    arrives = others.setdefault(crayon, {})
                    arrives[to] = arrives.get(to, 0.0) + share * height
            blends.append((to, share * from_blend))
    for crayon, arrives in others.items():
        for to, height in arrives.items():
            add(columns[to], crayon, height, optics)
    for to, part in blends:
        columns[to].blend = columns[to].blend + part
    return own


def ahead(y, x, direction):
    """The cells around the point one cell ahead along the longer axis, and the share of each."""
    longest = max(abs(direction[0]), abs(direction[1]))
    ax, ay = direction[0] / longest, direction[1] / longest
    for j in {math.floor(y + ay), math.ceil(y + ay)}:
        for i in {math.floor(x + ax), math.ceil(x + ax)}:
            yield (j, i), (1 - abs(y + ay - j)) * (1 - abs(x + ax - i))


def height_ahead(tops, y, x, direction) -> tuple[float, float]:
    """Rise of the surface at the point ahead (0 at the sheet's edge), and the way's length."""
    way = 1 / max(abs(direction[0]), abs(direction[1]))
    rise = 0.0
    for to, share in ahead(y, x, direction):
        if to not in tops:
            return 0.0, way
        rise += share * (tops[to] - tops[y, x])
    return rise, way


def deposit(columns, over, tops, before, direction, own, mask, push, rate, c):
    """Fig. 6 for all cells in contact: what breaks off joins `own` and wears `mask`; returns the
    loss.

    before: wax of each cell before it was smeared; a cell's overlap changes by the firm share of
        what came and went.
    """
    film, mu_paper, mu_wax, relief = (float(v) for v in (c.film, c.mu_paper, c.mu_wax, c.relief))
    wear, heap, firm = float(c.wear), float(c.heap), float(c.firm)
    now = {cell: column.wax() + own.get(cell, 0.0) for cell, column in columns.items()}
    lost = 0.0
    for cell, overlap in over.items():
        room = overlap + firm * (now[cell] - before[cell]) - heap * now[cell]
        rise, way = height_ahead(tops, *cell, direction)
        sine = math.sin(math.atan2(relief * rise, way) + math.atan2(push, 1))
        if sine <= 0 or room <= 0:
            continue
        bare = film / (
            film + sum(share * now.get(to, 0.0) for to, share in ahead(*cell, direction))
        )
        mu = bare * mu_paper + (1 - bare) * mu_wax
        given = min(rate * mu * sine, 1.0) * room
        own[cell] = own.get(cell, 0.0) + given
        mask[cell] += wear * given
        lost += given
    return lost


def under_tip(columns, mask, top, left, firm=1.0):
    """Gap between sheet and mask for the present cells of a tip that lie on the sheet."""
    return {
        (top + j, left + i): columns[top + j, left + i].top(firm) - float(mask[j, i])
        for j, i in np.ndindex(mask.shape)
        if mask[j, i] < 1e8 and (top + j, left + i) in columns
    }


def luck(number: int) -> float:
    """0 to 1, as if thrown."""
    word = number * 2654435761 % 2**32
    return (word ^ word >> 15) * 2654435761 % 2**32 // 2**16 / 2**16


def hop(number: int, mean: float, scatter: float) -> int:
    """How many cells wax is pushed at contact `number`."""
    return max(1, math.floor(mean + 0.5 + scatter * (2 * luck(number) - 1)))


def grip(begun, along: float) -> float:
    """How much more than usual the crayon sticks to the paper: straight lines between a throw at
    each length.
    """
    x, y = (math.floor(4 * v) for v in begun)
    stroke, step = 7919 * x + 104729 * y, math.floor(along)
    return 2 * np.interp(along - step, [0, 1], [luck(stroke + step), luck(stroke + step + 1)]) - 1


def contacts(points, stride):
    """Where a stroke touches: x, y, force and direction half a stride from its start and at every
    stride on.
    """
    ways = np.hypot(*np.diff(points[:, :2], axis=0).T)
    walked = np.append(0.0, np.cumsum(ways))
    for along in np.arange(0.5 * stride, walked[-1], stride):
        segment = int(np.searchsorted(walked[1:-1], along, "right"))
        step = points[segment + 1, :2] - points[segment, :2]
        yield (
            [float(np.interp(along, walked, points[:, c])) for c in range(3)],
            step / ways[segment],
        )


def rub(columns, points, mask, wax, smears, constants, per_lambda, optics, reach=1):
    """One stroke as in Fig. 3: at each point adjust the height, smear, deposit.

    Returns the wax given.
    """
    c = constants
    points, mask = points.astype(float), mask.astype(float)
    side = mask.shape[0]
    there = np.argwhere(mask < 1e8)
    there = there - there.mean(0)
    extent = max(1.0, 4 * np.sqrt((there**2).sum() / 2 / len(there)))  # of a round tip
    stride = max(1.0, float(c.step) * extent)
    touches = list(contacts(points, stride))
    if not touches:
        length = np.hypot(*np.diff(points[:, :2], axis=0).T).sum()
        stride, touches = max(length, 0.04 * extent), [(points[-1].tolist(), (1.0, 0.0))]
    given, contact = 0.0, 0
    for n, ((x, y, force), direction) in enumerate(touches):
        if force <= 0:
            continue
        dither_x, dither_y = (0.5 + contact * 0.7548776662) % 1, (0.5 + contact * 0.5698402910) % 1
        contact += 1
        left, top = (
            math.floor(x - 0.5 + dither_x) - side // 2,
            math.floor(y - 0.5 + dither_y) - side // 2,
        )
        gaps = under_tip(columns, mask, top, left, float(c.firm))
        if not gaps:
            continue
        held = 1 + float(c.slip) * grip(
            np.float32(touches[0][0][:2]) / c.slip_cells, n * stride / float(c.slip_cells)
        )
        wanted = force * per_lambda * held * len(gaps) / int((mask < 1e8).sum())
        h = balance(list(gaps.values()), min(wanted, float(c.most) * len(gaps)))
        over = {cell: gap - h for cell, gap in gaps.items() if gap > h}
        tops = {cell: column.top(float(c.firm)) for cell, column in columns.items()}
        before, own = {cell: column.wax() for cell, column in columns.items()}, {}
        if smears:
            nu = 1 - (1 - float(c.nu)) ** stride
            cells = hop(n, float(c.hop), float(c.scatter))
            own = smear(
                columns,
                over,
                tops,
                direction,
                wax,
                nu,
                c.alpha,
                c.beta,
                optics,
                cells,
                float(c.yields),
            )
        worn = {cell: mask[cell[0] - top, cell[1] - left] for cell in over}
        push, rate = float(c.push) if c.push > 0 else force, float(c.rate) * stride
        given += deposit(columns, over, tops, before, direction, own, worn, push, rate, c)
        for cell, height in worn.items():
            mask[cell[0] - top, cell[1] - left] = height
        for cell, height in own.items():
            if height > 0:
                add(columns[cell], wax, height, optics)
    return given


def over(ground: float, kh: float, sh: float) -> float:
    """Kubelka's layer over a ground, from the textbook form with hyperbolic functions."""
    ground, kh, sh = float(ground), float(kh), float(sh)
    if sh < 1e-12:
        return ground * math.exp(-2 * kh)
    a = 1 + kh / sh
    b = math.sqrt(a * a - 1)
    if b < 1e-9:
        r, t = sh / (1 + sh), 1 / (1 + sh)
    else:
        z = min(b * sh, 300.0)
        c = a * math.sinh(z) + b * math.cosh(z)
        r, t = math.sinh(z) / c, b / c
    return r + t * t * ground / (1 - r * ground)


def colour(
    column: Column, ground, optics: np.ndarray, surface: float = 0.0, film_um: float = 1.0
) -> np.ndarray:
    """Light that comes back from a column: its layers over each other, bottom up, and what its
    surface reflects.
    """
    seen = [float(g) for g in ground]
    layers = [
        column.blend[1:],
        *(height * optics[crayon].astype(float) for crayon, height in column.layers),
    ]
    for layer in layers:
        seen = [over(seen[c], layer[c], layer[3 + c]) for c in range(3)]
    front = surface * column.wax() / (column.wax() + film_um)
    return front + (1 - front) * np.array(seen)


def levels(points, first, reach, rows, cols, tile) -> list[int]:
    """Level of each stroke: one more than the highest earlier stroke that shares a tile with it."""
    done: list[tuple[set, int]] = []
    for s in range(len(first) - 1):
        path = points[first[s] : first[s + 1]].astype(float)[:, :2]
        dense = [path[0]]
        for p, q in itertools.pairwise(path):
            parts = 1 + int(np.abs(q - p).max() / tile)
            dense += [p + (q - p) * (i + 1) / parts for i in range(parts)]
        tiles = set()
        for x, y in dense:
            for ty in range(
                math.floor((y - reach[s]) / tile), math.floor((y + reach[s]) / tile) + 1
            ):
                for tx in range(
                    math.floor((x - reach[s]) / tile), math.floor((x + reach[s]) / tile) + 1
                ):
                    if 0 <= ty < -(-rows // tile) and 0 <= tx < -(-cols // tile):
                        tiles.add((ty, tx))
        done.append(
            (tiles, max((level + 1 for before, level in done if before & tiles), default=0))
        )
    return [level for _, level in done]
