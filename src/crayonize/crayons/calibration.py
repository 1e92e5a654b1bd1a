"""The stroke generator's table of crayons, measured on the simulator itself.

Every crayon is hatched at six pressures over four grounds (bare paper, and coats of the lightest, a
middle and the darkest crayon); a line per channel through "before, after" gives `a` and `b` of the
table. The tables of the shipped palettes on the default paper are part of the package (`python -m
crayonize.crayons.calibration` measures them anew); others are measured once and kept in the user's
cache folder.
"""

import hashlib
import io
import itertools
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stroke_gen.alike import times
from stroke_gen.drawing import Stroke, Tip
from stroke_gen.swatches import TIP_MM, Swatches

from ..light import optics
from ..machine import cores, folder, kernels, source
from ..settings import Settings
from ..wax import paper, rub
from ..wax.box import Box
from ..wax.physics import physics as physics_of
from ..wax.sheet import Sheet
from .palette import Crayon, Palette
from .palette_files import load_palette, palette_names

PRESSURES = (0.04, 0.1, 0.2, 0.38, 0.62, 0.95)  # N/mm^2
TIP = Tip("blunt", TIP_MM)
SPACING = 0.62  # of the tip's width
PATCH_MM, EDGE_MM = 11.0, 2.5  # a swatch, and what is left out of the mean around it
CELL_MM = 297 / 1600
AT_A_TIME = 32  # crayons on a sheet, which then takes .2 GB
SHIPPED = Path(__file__).parents[1] / "data" / "tables"


def measure(palette: Palette, sheet_paper: paper.Paper, physics: str, threads: int) -> Swatches:
    """Hatch and measure every crayon of a palette on a paper, some at a time on a sheet."""
    all_ = palette.crayons
    strips = [
        _measured(palette, all_[i : i + AT_A_TIME], sheet_paper, physics, threads)
        for i in range(0, len(all_), AT_A_TIME)
    ]
    a, b = (np.concatenate([strip[m] for strip in strips], axis=1) for m in (0, 1))
    grain = np.concatenate([strip[2] for strip in strips])
    names = tuple(crayon.name for crayon in all_)
    base = np.array(paper.colour_linear(sheet_paper.colour), np.float32)
    return Swatches(names, np.array(PRESSURES, np.float32), a, b, grain, base)


def _measured(
    palette: Palette,
    crayons: Sequence[Crayon],
    sheet_paper: paper.Paper,
    physics: str,
    threads: int,
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
    """Lines a and b (2, k, p, 3) and grain (k, p) of some crayons of a palette."""
    grounds = _grounds(palette)
    rows, cols = len(grounds) * len(PRESSURES), len(crayons)
    shape = (round(rows * PATCH_MM / CELL_MM), round(cols * PATCH_MM / CELL_MM))
    constants = physics_of(physics)
    box = Box(palette, constants, CELL_MM)
    sheet = Sheet(paper.tooth(sheet_paper, *shape, CELL_MM, 0), CELL_MM, *box.optics())
    base = paper.colour_linear(sheet_paper.colour)
    coats = [
        _hatching(row, col, ground[0], ground[1], 0)
        for row in range(rows)
        for col in range(cols)
        if (ground := grounds[row // len(PRESSURES)])
    ]
    rub.rub(sheet, coats, box, threads=threads)
    before, _ = _means(optics.render(sheet, base, light=False, threads=threads), rows, cols)
    top = [
        _hatching(row, col, crayons[col].name, PRESSURES[row % len(PRESSURES)], 1)
        for row in range(rows)
        for col in range(cols)
    ]
    rub.rub(sheet, top, Box(palette, constants, CELL_MM), threads=threads)
    after, grain = _means(optics.render(sheet, base, light=False, threads=threads), rows, cols)
    split = (len(grounds), len(PRESSURES), len(crayons), 3)
    a, b = _fit(before.reshape(split), after.reshape(split))
    return a, b, np.ascontiguousarray(grain.reshape(split[:3])[0].T)


def _grounds(palette: Palette) -> list[tuple[str, float] | None]:
    """Bare paper, and coats of the lightest crayon, a middle one and the darkest."""
    order = sorted(palette.crayons, key=lambda c: sum(c.k) / sum(c.s))
    return [None, *((order[i].name, PRESSURES[3]) for i in (0, len(order) // 2, -1))]


def _hatching(row: int, col: int, crayon: str, pressure: float, turn: int) -> Stroke:
    """A zigzag over one swatch; the second coat lies 25 degrees to the first."""
    gap, half = SPACING * TIP.width_mm, PATCH_MM / 2
    lines = np.arange(-half - 3 * gap, half + 3.01 * gap, gap)
    ends = np.array([[-half, half], [half, -half]])[np.arange(lines.size) % 2].ravel()
    zigzag = np.stack([ends, np.repeat(lines, 2)], 1)
    angle = np.deg2rad(-50 + 25 * turn)
    c, s = np.cos(angle), np.sin(angle)
    turned = times(zigzag, np.array([[c, -s], [s, c]]))
    fine = np.concatenate([np.linspace(p, q, 12) for p, q in itertools.pairwise(turned)])
    inside = fine[(np.abs(fine) <= half - 0.6).all(1)]
    path = (inside + (np.array([col, row]) + 0.5) * PATCH_MM).astype(np.float32)
    force = np.full(len(path), pressure * TIP.area_mm2, np.float32)
    return Stroke(path, force, crayon, TIP)


def _means(
    picture: NDArray[np.float32], rows: int, cols: int
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Mean linear colour (rows, cols, 3) and grain (rows, cols) of the swatches."""
    from stroke_gen.colour import oklab

    mean = np.empty((rows, cols, 3), np.float32)
    grain = np.empty((rows, cols), np.float32)
    for row in range(rows):
        for col in range(cols):
            y0, x0 = row * PATCH_MM + EDGE_MM, col * PATCH_MM + EDGE_MM
            y1, x1 = y0 + PATCH_MM - 2 * EDGE_MM, x0 + PATCH_MM - 2 * EDGE_MM
            part = picture[
                round(y0 / CELL_MM) : round(y1 / CELL_MM), round(x0 / CELL_MM) : round(x1 / CELL_MM)
            ]
            mean[row, col] = part.mean((0, 1))
            grain[row, col] = oklab(part)[..., 0].std()
    return mean, grain


def _fit(
    before: NDArray[np.float32], after: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Lines after = a * before + b per crayon, pressure and channel, from (grounds, p, k, 3): (2,
    k, p, 3) each.

    The first goes exactly through what bare paper gave, the second through the means of the waxed
    grounds.
    """
    x, y = before[1:], after[1:]
    lines = []
    for through_x, through_y in ((before[0], after[0]), (x.mean(0), y.mean(0))):
        dx, dy = x - through_x, y - through_y
        a = np.clip((dx * dy).sum(0) / np.maximum((dx * dx).sum(0), 1e-6), 0, 1)
        lines.append((a, np.maximum(through_y - a * through_x, 0)))
    a, b = (np.stack(m).swapaxes(1, 2) for m in zip(*lines, strict=True))
    return np.ascontiguousarray(a, np.float32), np.ascontiguousarray(b, np.float32)


def swatches(palette: Palette, sheet_paper: paper.Paper, physics: str, threads: int) -> Swatches:
    """The table for a palette, paper and physics: shipped, kept from an earlier run, or measured
    now.

    A kept one counts for the version of the wax that it was measured on; a shipped one is of its
    own version.
    """
    # Files are named by hashes alone: a palette's name is what a stranger's file says.
    key = _key(palette, sheet_paper, physics)
    for shipped in SHIPPED.glob(f"*-{key}.npz"):
        return _unpacked(shipped.read_bytes())
    kept = folder.folder() / f"table-{source.of_the_wax()}-{key}.npz"
    with folder.alone(kept):  # of all that want it now, one measures
        content = folder.read(kept)
        if content is None:
            content = _packed(measure(palette, sheet_paper, physics, threads))
            folder.write(kept, content)
    return _unpacked(content)


def _key(palette: Palette, sheet_paper: paper.Paper, physics: str) -> str:
    """Changes with whatever the measured colours depend on."""
    what = repr(
        (palette.crayons, sheet_paper, physics_of(physics), PRESSURES, TIP, SPACING, CELL_MM)
    )
    return hashlib.sha256(what.encode()).hexdigest()[:12]


def _packed(table: Swatches) -> bytes:
    content = io.BytesIO()
    a, b, grain = (m.astype(np.float16) for m in (table.a, table.b, table.grain))
    names = np.array(table.names)
    np.savez(
        content, names=names, pressures=table.pressures, paper=table.paper, a=a, b=b, grain=grain
    )
    return content.getvalue()


def _unpacked(content: bytes) -> Swatches:
    with np.load(io.BytesIO(content)) as table:
        names = tuple(str(n) for n in table["names"])
        return Swatches(
            names, *(table[f].astype(np.float32) for f in ("pressures", "a", "b", "grain", "paper"))
        )


def ship(target: Path = SHIPPED) -> None:
    """Measure the tables that the package ships: every palette on the default paper."""
    target.mkdir(exist_ok=True)
    for old in target.glob("*.npz"):
        old.unlink()
    for name, *_ in palette_names():
        box, sheet_paper, physics = (
            load_palette(name),
            paper.load_paper(str(Settings.paper)),
            Settings.physics,
        )
        table = _packed(measure(box, sheet_paper, physics, cores.allowed()))
        (target / f"{name}-{_key(box, sheet_paper, physics)}.npz").write_bytes(table)


if __name__ == "__main__":
    kernels.keep_kernels()
    ship()
