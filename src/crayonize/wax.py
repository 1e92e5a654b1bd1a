"""Wax on a sheet: force balance, smearing and frictional deposition (section 3 of the paper).

A sheet is a height field (the paper's tooth) with a column of wax on each cell: up to four layers of
pure crayons, top last, over one blend into which the lowest layer sinks when a fifth is laid.
Heights are in um; optical properties travel with the wax as an index (pure layers) or as sums of
k*h and s*h (the blend), both linear in height, so moving wax conserves every pigment.

Per cell: paper 4, total 4, count 1, indices 4, layer heights 16, blend 28 = 57 bytes.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stroke_gen.jit import kernel, sum_kernel

LAYERS = 4  # pure layers a cell
BLEND = 7  # height, then k*h and s*h for red, green, blue
THIN_UM = 0.4  # a film thinner than this counts as one with the layer beneath it

Floats = NDArray[np.float32]


@dataclass(frozen=True)
class Physics:
    """Constants of the wax (Table 1), with the paper's grey level read as 1 um; see data/physics.toml."""

    mu_paper: float  # friction of bare paper
    mu_wax: float  # friction of wax
    film_um: float  # film at which half of the way from paper to wax friction is gone
    rate_per_mm: float  # wax rubbed off per mm of path and um of overlap, at friction 1
    push: float  # down force over drag force, Fig. 6; 0: take the stroke's own force in newton
    relief: float  # how steep a height difference of the paper looks to the crayon
    nu: float  # share of the displaced wax that leaves its cell ...
    nu_mm: float  # ... per this length of path
    alpha: float  # flow smear factor, per um
    beta: float  # directional smear factor
    lam: float  # N per um of overlap and mm^2 of contact: .0005 a cell of 0.1 mm
    epsilon_um: float  # accuracy of the force, as a sum of overlaps over cells
    firm: float  # share of the wax's height that holds the crayon up; the rest yields to it (Fig. 4 has all hold: 1)
    heap: float  # share of a cell's wax that counts as out of reach: Fig. 6 rubs on the paper alone (1)
    wear: float  # share of a cell's loss that deepens the cell itself; the rest the whole tip shares

    def constants(self, cell_mm: float) -> Floats:
        """The kernel's arguments for cells of `cell_mm`."""
        relief, nu = self.relief / (1000 * cell_mm), 1 - (1 - self.nu) ** (cell_mm / self.nu_mm)
        values = (self.mu_paper, self.mu_wax, self.film_um, self.rate_per_mm * cell_mm, self.push, relief,
                  nu, self.alpha, self.beta, self.epsilon_um, self.wear, THIN_UM,
                  self.heap, self.firm)  # fmt: skip
        return np.array(values, np.float32)


class Sheet:
    """A sheet of paper and the wax on it. All arrays are flat views over rows x cols cells."""

    def __init__(self, tooth: Floats, cell_mm: float, k: Floats, s: Floats) -> None:
        """`tooth` (rows, cols) um; `k`, `s` (crayons, 3) absorption and scattering per um, linear RGB."""
        self.rows, self.cols = tooth.shape
        self.cell_mm = cell_mm
        self.optics = np.ascontiguousarray(np.concatenate([k, s], 1), np.float32)
        cells = tooth.size
        self.paper = np.ascontiguousarray(tooth, np.float32).ravel()
        self.total = np.zeros(cells, np.float32)
        self.count = np.zeros(cells, np.uint8)
        self.crayon = np.zeros((cells, LAYERS), np.uint8)
        self.layer = np.zeros((cells, LAYERS), np.float32)
        self.blend = np.zeros((cells, BLEND), np.float32)

    def columns(self) -> tuple[Any, ...]:
        """What the kernels take."""
        return self.paper, self.total, self.count, self.crayon, self.layer, self.blend, self.optics

    def film_um(self) -> Floats:
        """Height of the wax (rows, cols) in um."""
        return self.total.reshape(self.rows, self.cols)

    def pigments(self) -> NDArray[np.float64]:
        """Sums of h, k*h and s*h over the sheet (7): what smearing must not change."""
        sums = self.blend.sum(0, dtype=np.float64)
        used = np.arange(LAYERS) < self.count[:, None]
        for index, optics in enumerate(self.optics.astype(np.float64)):
            height = float(self.layer[used & (self.crayon == index)].sum(dtype=np.float64))
            sums[0] += height
            sums[1:] += height * optics
        return sums


@kernel
def _add(cell, wax, height, total, count, crayon, layer, blend, optics, thin):  # type: ignore[no-untyped-def]
    """Lay `height` of pure crayon `wax` on a column; films thinner than `thin` do not part two layers."""
    total[cell] += height
    n = count[cell]
    for j in range(n - 1, -1, -1):
        if crayon[cell, j] == wax:
            layer[cell, j] += height
            return
        if layer[cell, j] >= thin:
            break
    if n == layer.shape[1]:  # the lowest layer is hidden: it sinks into the blend
        low, h = crayon[cell, 0], layer[cell, 0]
        blend[cell, 0] += h
        for c in range(6):
            blend[cell, 1 + c] += h * optics[low, c]
        for j in range(n - 1):
            crayon[cell, j] = crayon[cell, j + 1]
            layer[cell, j] = layer[cell, j + 1]
        n -= 1
    crayon[cell, n] = wax
    layer[cell, n] = height
    count[cell] = n + 1


@sum_kernel
def _force(gap, cells, h):  # type: ignore[no-untyped-def]
    """Sum and number of the overlaps max(0, gap - h): the force of Eq. 2 in units of lambda."""
    total = np.float32(0)
    touching = 0
    for i in range(cells):
        over = gap[i] - h
        total += max(over, np.float32(0))
        touching += over > 0
    return total, touching


@kernel
def _balance(gap, cells, wanted, start, epsilon, near, touch):  # type: ignore[no-untyped-def]
    """Height of the tip at which the overlaps sum to `wanted` (Fig. 4), and its contact cells.

    F(h) = sum max(0, gap - h) is convex and falls with h, so a step of Newton's method lands left of
    the solution and the next ones rise to it without passing: exact after few steps. From there the
    contact only shrinks, so the steps look at the cells in `touch` alone. `start`: the last height.
    Returns h and the number of contact cells; `near` holds their overlaps.
    """
    h = start
    force, touching = _force(gap, cells, h)
    if touching == 0 or force < wanted:
        top = gap[0]
        for i in range(1, cells):
            top = max(top, gap[i])
        low = top - wanted
        h = low if touching == 0 else max(low, h + (force - wanted) / np.float32(touching))
    contacts = 0
    for i in range(cells):
        if gap[i] > h:
            touch[contacts] = i
            near[contacts] = gap[i]
            contacts += 1
    for _ in range(40):
        force, touching = _force(near, contacts, h)
        if abs(force - wanted) <= epsilon or touching == 0:
            break
        h += (force - wanted) / np.float32(touching)
    kept = 0
    for t in range(contacts):
        over = near[t] - h
        if over > 0:
            touch[kept] = touch[t]
            near[kept] = over
            kept += 1
    return h, kept


@kernel
def _smear(contacts, touch, over, surface, side, home, cols, vx, vy, nu, alpha, beta, wax, thin,  # type: ignore[no-untyped-def]
           inflow, weight, moves, total, count, crayon, layer, blend, optics):  # fmt: skip
    """Push standing wax to the eight neighbours (Eq. 4, Fig. 7); all amounts come from one snapshot.

    Wax of the crayon in hand gathers in `inflow` and is laid with the deposit; other wax is laid after
    all takings, so that none hops twice in a step. Neighbours off the sheet stand infinitely high.
    """
    moved_cell, moved_wax, moved_height, blended = moves
    moved, sunk = 0, False
    directional = weight[8:]
    for k in range(8):
        dy, dx = _neighbour(k)
        directional[k] = beta * (dx * vx + dy * vy) / np.float32(dx * dx + dy * dy)
    for t in range(contacts):
        at = touch[t]
        cell = home + (at // side) * cols + at % side
        standing = min(total[cell], over[t])
        if standing <= np.float32(1e-3):
            continue
        here = surface[at]
        weights = np.float32(0)
        for k in range(8):
            dy, dx = _neighbour(k)
            flow = alpha * (here - surface[at + dy * side + dx])
            if k >= 4:
                flow *= np.float32(0.70710678)
            weight[k] = max(np.float32(0), flow + directional[k])
            weights += weight[k]
        if weights <= 0:
            continue
        left = nu * standing
        over[t] -= left
        total[cell] -= left
        scale = np.float32(1) / weights
        n = count[cell]
        while n > 0 and left > 0:
            part = min(left, layer[cell, n - 1])
            share = part * scale
            if crayon[cell, n - 1] == wax:
                for k in range(8):
                    dy, dx = _neighbour(k)
                    inflow[at + dy * side + dx] += share * weight[k]
            else:
                for k in range(8):
                    if weight[k] > 0:
                        dy, dx = _neighbour(k)
                        moved_cell[moved] = cell + dy * cols + dx
                        moved_wax[moved] = crayon[cell, n - 1]
                        moved_height[moved] = share * weight[k]
                        moved += 1
            left -= part
            layer[cell, n - 1] -= part
            if layer[cell, n - 1] > 0:
                break
            n -= 1
        count[cell] = n
        if n == 0 and left > 0:
            _smear_blend(at, cell, left, side, weight, scale, total, blend, blended)
            sunk = True
    for i in range(moved):
        _add(moved_cell[i], moved_wax[i], moved_height[i], total, count, crayon, layer, blend, optics, thin)
    if sunk:
        for at in range(side * side):
            if blended[at, 0] > 0:
                cell = home + (at // side) * cols + at % side
                total[cell] += blended[at, 0]
                for c in range(7):
                    blend[cell, c] += blended[at, c]
                    blended[at, c] = 0


@kernel
def _smear_blend(at, cell, left, side, weight, scale, total, blend, blended):  # type: ignore[no-untyped-def]
    """Take `left` um from a column that has no pure layer any more; it gathers in `blended` around `at`."""
    held = blend[cell, 0]
    if held <= 0:
        total[cell] = 0
        return
    part = min(np.float32(1), left / held)
    total[cell] += left - part * held
    for c in range(7):
        flow = part * blend[cell, c]
        blend[cell, c] -= flow
        for k in range(8):
            if weight[k] > 0:
                dy, dx = _neighbour(k)
                blended[at + dy * side + dx, c] += flow * weight[k] * scale


@kernel
def _neighbour(k):  # type: ignore[no-untyped-def]
    """(dy, dx) of neighbour k: four along the axes, then four diagonal ones."""
    if k < 4:
        return (k & 1) * (k - 2), (1 - (k & 1)) * (k - 1)
    return ((k >> 1) & 1) * 2 - 1, (k & 1) * 2 - 1


@kernel
def _deposit(contacts, touch, over, surface, side, home, cols, vx, vy, push, rate, film, mu_paper, mu_wax,  # type: ignore[no-untyped-def]
             relief, wear, heap, inflow, mask, total):  # fmt: skip
    """Rub wax off the tip by friction (Eq. 3, Fig. 6).

    The share of the overlap that breaks off (less `heap` of the wax already there) is rate * mu * sin(S, F),
    where S is the surface ahead and F the crayon's force; faces steeper than F get none. What breaks off
    gathers in `inflow`, deepens the mask by `wear` of it, and is returned as the tip's loss.
    """
    longest = max(abs(vx), abs(vy))
    ax, ay = vx / longest, vy / longest  # one cell ahead along the longer axis
    sx, sy = (1 if ax > 0 else -1), (1 if ay > 0 else -1)
    if abs(ax) >= abs(ay):
        ahead, aside, slant = sx, sx + sy * side, abs(ay)
    else:
        ahead, aside, slant = sy * side, sx + sy * side, abs(ax)
    length2 = np.float32(1) + slant * slant
    press, push = 1 / np.sqrt(1 + push * push), push * np.sqrt(length2)
    lost = np.float32(0)
    for t in range(contacts):
        at = touch[t]
        wax_here = total[home + (at // side) * cols + at % side] + inflow[at]
        room = over[t] + inflow[at] - heap * wax_here
        rise = (np.float32(1) - slant) * surface[at + ahead] + slant * surface[at + aside] - surface[at]
        rise = relief * rise if rise < np.float32(1e6) else np.float32(0)
        slope = press * (push + rise) / np.sqrt(length2 + rise * rise)
        if slope <= 0 or room <= 0:
            continue
        bare = film / (film + wax_here)
        given = min(rate * slope * (bare * mu_paper + (np.float32(1) - bare) * mu_wax), np.float32(1)) * room
        inflow[at] += given
        mask[at] += wear * given
        lost += given
    return lost


@kernel
def _look(mask, side, top, left, rows, cols, firm, paper, total, surface, gap):  # type: ignore[no-untyped-def]
    """Surface under the window of the tip and its gap to the mask; off the sheet nothing touches."""
    inside = 0
    for j in range(side):
        y = top + j
        for i in range(side):
            at = j * side + i
            x = left + i
            if 0 <= y < rows and 0 <= x < cols:
                surface[at] = paper[y * cols + x] + firm * total[y * cols + x]
                gap[at] = surface[at] - mask[at]
                inside += mask[at] < np.float32(1e8)
            else:
                surface[at] = np.float32(1e9)
                gap[at] = np.float32(-1e9)
    return inside


@kernel
def _rub(picked, points, first, wax_of, mask_of, masks, sides, step_cells, smears, constants, per_lambda,  # type: ignore[no-untyped-def]
         rows, cols, paper, total, count, crayon, layer, blend, optics, loss):  # fmt: skip
    """Draw the strokes `picked`, one after another (Fig. 3): adjust the height, smear, deposit.

    points (n, 3): x, y in cells, force in N; first (strokes + 1): where each stroke's points begin;
    masks (tips, cells): masks with a border of ABSENT cells, `sides` long; loss (strokes,): wax given.
    """
    largest = masks.shape[1]
    surface, gap = np.empty(largest, np.float32), np.empty(largest, np.float32)
    near, touch = np.empty(largest, np.float32), np.empty(largest, np.int32)
    inflow, mask, weight = np.zeros(largest, np.float32), np.empty(largest, np.float32), np.empty(16, np.float32)
    room = 32 * largest + 64
    blended = np.zeros((largest, blend.shape[1]), np.float32)
    moves = (np.empty(room, np.int64), np.empty(room, np.uint8), np.empty(room, np.float32), blended)
    mu_paper, mu_wax, film, rate_cell = constants[0], constants[1], constants[2], constants[3]
    push, relief, nu_cell, alpha = constants[4], constants[5], constants[6], constants[7]
    beta, epsilon, wear, thin = constants[8], constants[9], constants[10], constants[11]
    heap, firm = constants[12], constants[13]
    for s in picked:
        tip, wax = mask_of[s], wax_of[s]
        side = sides[tip]
        cells = side * side
        present = 0
        for i in range(cells):
            mask[i] = masks[tip, i]
            present += mask[i] < np.float32(1e8)
        a, b = first[s], first[s + 1]
        length = np.float32(0)
        for i in range(a + 1, b):
            length += np.hypot(points[i, 0] - points[i - 1, 0], points[i, 1] - points[i - 1, 1])
        steps = max(1, int(length / max(np.float32(1), step_cells * (side - 2)) + np.float32(0.5)))
        stride = max(length / steps, np.float32(0.04) * (side - 2))  # a dab slides by 1/25 of the tip
        rate = rate_cell * stride
        nu = np.float32(1) - (np.float32(1) - nu_cell) ** stride
        h = np.float32(1e9)  # lifted: from far below, float32 would miss the paper
        given = 0.0
        i, walked, seg = a, np.float32(0), np.float32(0)
        vx, vy = np.float32(1), np.float32(0)
        dither_x, dither_y = 0.5, 0.5
        for n in range(steps):
            along = (n + np.float32(0.5)) * length / steps
            while i + 1 < b:
                dx, dy = points[i + 1, 0] - points[i, 0], points[i + 1, 1] - points[i, 1]
                seg = np.hypot(dx, dy)
                if walked + seg >= along or i + 2 >= b:
                    if seg > 0:
                        vx, vy = dx / seg, dy / seg
                    break
                walked += seg
                i += 1
            t = min(np.float32(1), (along - walked) / seg) if seg > 0 and i + 1 < b else np.float32(0)
            j = min(i + 1, b - 1)
            x = points[i, 0] + t * (points[j, 0] - points[i, 0])
            y = points[i, 1] + t * (points[j, 1] - points[i, 1])
            force = points[i, 2] + t * (points[j, 2] - points[i, 2])
            if force <= 0:
                continue
            # Rounding to whole cells by an even sequence of offsets leaves no stair steps.
            left = int(np.floor(x - 0.5 + dither_x)) - side // 2
            top = int(np.floor(y - 0.5 + dither_y)) - side // 2
            dither_x, dither_y = (dither_x + 0.7548776662) % 1.0, (dither_y + 0.5698402910) % 1.0
            inside = _look(mask, side, top, left, rows, cols, firm, paper, total, surface, gap)
            if inside == 0:
                continue
            wanted = force * per_lambda * np.float32(inside) / np.float32(present)
            h, contacts = _balance(gap, cells, wanted, h, min(epsilon, np.float32(0.01) * wanted), near, touch)
            home = top * cols + left
            if smears:
                _smear(contacts, touch, near, surface, side, home, cols, vx, vy, nu, alpha, beta, wax, thin,
                       inflow, weight, moves, total, count, crayon, layer, blend, optics)  # fmt: skip
            given += _deposit(contacts, touch, near, surface, side, home, cols, vx, vy, push if push > 0 else force,
                              rate, film, mu_paper, mu_wax, relief, wear, heap, inflow, mask, total)  # fmt: skip
            for at in range(cells):
                if inflow[at] > 0:
                    _add(home + (at // side) * cols + at % side, wax, inflow[at],
                         total, count, crayon, layer, blend, optics, thin)  # fmt: skip
                    inflow[at] = 0
        loss[s] = given
