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

# as the kernels have them; own copies, so that a change there is noticed
LAYERS, THIN_UM, SELDOM = 4, 0.4, 4

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


@dataclass
class Load:
    """Wax of other crayons that sticks to the tip: by crayon, and by cell of what it lies over.

    regained: wax of its own, which is crayon again.
    """

    crayons: dict[int, dict] = field(default_factory=dict)
    regained: float = 0.0

    def height(self, at) -> float:
        return sum(cells.get(at, 0.0) for cells in self.crayons.values())

    def moved(self, dy: int, dx: int) -> "Load":
        """The same load, with the tip elsewhere."""
        return Load(
            {
                crayon: {(y + dy, x + dx): h for (y, x), h in cells.items()}
                for crayon, cells in self.crayons.items()
            },
            self.regained,
        )


def stick(column, at, moved, wax, c, load: Load) -> float:
    """A share of `moved`, the more the thicker the film, off the top layer; returns how much."""
    if not column.layers:
        return 0.0
    crayon, there = column.layers[-1]
    film, half = column.wax(), float(c.peel if crayon == wax else c.carve)
    wanted = float(c.sticks) * film**2 / (film**2 + half**2) * moved
    full = crayon not in load.crayons and len(load.crayons) == LAYERS
    if wanted < 1e-4 or (full and crayon != wax):
        return 0.0
    part = min(wanted, there)
    if crayon == wax:
        load.regained += part
    else:
        cells = load.crayons.setdefault(crayon, {})
        cells[at] = cells.get(at, 0.0) + part
    column.layers[-1][1] -= part
    if part == there:
        column.layers.pop()
    return part


def smear(columns, over, tops, direction, wax, nu, c, optics, reach, own, load):
    """Fig. 7 for all cells in contact at once; adds to `own` what the crayon's own wax adds where.

    Of the share nu that could move pull / (pull + yields) does, pull being the sum of Eq. 4; part
    of it sticks to the tip, to its `load`.
    """
    others, blends = {}, []
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
                pull = (c.alpha * (tops[y, x] - tops[to]) + c.beta * cosine) / distance
                weight[to] = max(0.0, pull)
        if not sum(weight.values()):
            continue
        pull = sum(weight.values())
        moved = nu * standing * pull / (pull + c.yields)
        if c.sticks > 0:
            moved -= stick(columns[y, x], (y, x), moved, wax, c, load)
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
    for to, part in blends:
        columns[to].blend = columns[to].blend + part
    return others


def lay(columns, arriving, optics):
    """Lay wax on its way, by crayon and cell, in order."""
    for crayon, arrives in arriving.items():
        for to, height in arrives.items():
            if height > 0:
                add(columns[to], crayon, height, optics)


def give_back(broken, load: Load, covers: float, arriving) -> None:
    """Where `broken` um break off, load comes with it, as if among `covers` um of own wax."""
    for at in broken:
        height = load.height(at)
        if height <= 0.01:
            continue
        share = min(broken[at] / (height + covers), 1.0)
        for crayon, cells in load.crayons.items():
            part = share * cells.get(at, 0.0)
            if part > 0:
                cells[at] -= part
                to = arriving.setdefault(crayon, {})
                to[at] = to.get(at, 0.0) + part
        broken[at] = max(broken[at] - share * height, 0.0)


def wear_around(mask, lost, share, brings):
    """Lower a mask by `share` of what was lost, spread over the neighbours as a tent."""
    far = math.ceil(brings) - 1
    tent = [1 - abs(k) / brings for k in range(-far, far + 1)]
    spread = np.outer(tent, tent) / sum(tent) ** 2
    for (y, x), height in lost.items():
        for j, i in np.ndindex(spread.shape):
            mask[y + j - far, x + i - far] += share * spread[j, i] * height


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


def break_off(columns, over, tops, before, direction, arriving, push, rate, c):
    """Fig. 6 for all cells in contact: what breaks off where.

    before: wax of each cell before it was smeared; a cell's overlap changes by the firm share of
        what came and went. arriving: wax on its way, by crayon and cell.
    """
    film, mu_paper, mu_wax, relief = (float(v) for v in (c.film, c.mu_paper, c.mu_wax, c.relief))
    heap, firm = float(c.heap), float(c.firm)
    now = {cell: column.wax() for cell, column in columns.items()}
    for arrives in arriving.values():
        for cell, height in arrives.items():
            now[cell] += height
    broken = {}
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
        broken[cell] = min(rate * mu * sine, 1.0) * room
    return broken


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


def grip(own: int, along: float) -> float:
    """How much more than usual stroke `own` sticks to the paper: straight lines between a throw at
    each length.
    """
    step = math.floor(along)
    return 2 * np.interp(along - step, [0, 1], [luck(own + step), luck(own + step + 1)]) - 1


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


def rub(columns, points, mask, wax, smears, constants, per_lambda, optics, number, reach=1):
    """One stroke as in Fig. 3: at each point adjust the height, smear, deposit.

    It knows neither clumps nor grains. number: the stroke's own. Returns the wax given, and what
    left with the tip by crayon.
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
    given, contact, load, lost, at = 0.0, 0, Load(), {}, (0, 0)
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
        load, at = load.moved(top - at[0], left - at[1]), (top, left)
        held = 1 + float(c.slip) * grip(number, n * stride / float(c.slip_cells))
        wanted = force * per_lambda * held * len(gaps) / int((mask < 1e8).sum())
        h = balance(list(gaps.values()), min(wanted, float(c.most) * len(gaps)))
        over = {cell: gap - h for cell, gap in gaps.items() if gap > h}
        tops = {cell: column.top(float(c.firm)) for cell, column in columns.items()}
        before = {cell: column.wax() for cell, column in columns.items()}
        own, others = {}, {}
        if smears:
            nu = 1 - (1 - float(c.nu)) ** stride
            cells = hop(n, float(c.hop), float(c.scatter))
            others = smear(columns, over, tops, direction, wax, nu, c, optics, cells, own, load)
        push, rate = float(c.push) if c.push > 0 else force, float(c.rate) * stride
        arriving = {**others, wax: own}
        broken = break_off(columns, over, tops, before, direction, arriving, push, rate, c)
        give_back(broken, load, float(c.covers), others)
        for cell, height in broken.items():
            own[cell] = own.get(cell, 0.0) + height
            under = cell[0] - top, cell[1] - left
            mask[under] += float(c.wear) * height
            lost[under] = lost.get(under, 0.0) + height
            given += height
        if c.brings > 1 and contact % SELDOM == 0:
            wear_around(mask, lost, float(c.around), float(c.brings))
            lost = {}
        lay(columns, {**others, wax: own}, optics)
    return given - load.regained, {
        crayon: sum(cells.values()) for crayon, cells in load.crayons.items()
    }


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
