"""Light through wax: Kubelka-Munk over the layers, bottom up, in linear light (section 4, Fig. 9).

Fig. 9 is read as Kubelka's two-layer formula (1954) on the reflectance r and transmittance t of each
layer, which follow from the sums k*h and s*h (Kubelka 1948). Splitting a layer changes nothing.
A quiet light from the upper left shades the relief of paper and wax.
"""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from stroke_gen.jit import kernel

from .wax import Sheet

LIGHT = 0.007  # change of brightness per 1/100 of slope, before saturation
BAND = 128  # rows rendered by one task


@kernel
def _over(ground, kh, sh):  # type: ignore[no-untyped-def]
    """Reflectance of a layer with absorption kh and scattering sh over a ground; stable for kh, sh -> 0."""
    g = np.sqrt(kh * (kh + np.float32(2) * sh))
    if g < np.float32(1e-3):
        q = np.float32(1)  # limit of g / tanh(g)
        u = np.float32(1)  # limit of g / sinh(g)
    else:
        e = np.exp(-g)
        e2 = e * e
        q = g * (np.float32(1) + e2) / (np.float32(1) - e2)
        u = np.float32(2) * g * e / (np.float32(1) - e2)
    d = np.float32(1) / (kh + sh + q)
    r, t = sh * d, u * d
    return r + t * t * ground / (np.float32(1) - r * ground)


@kernel
def _render(top, bottom, left, right, ground, light, paper, total, count, crayon, layer, blend, optics, out):  # type: ignore[no-untyped-def]
    """Rows top..bottom and columns left..right of the picture into out (rows, cols, 3)."""
    rows, cols = out.shape[:2]
    for y in range(top, bottom):
        for x in range(left, right):
            cell = y * cols + x
            for c in range(3):
                out[y, x, c] = ground[c]
            if blend[cell, 0] > 0:
                for c in range(3):
                    out[y, x, c] = _over(out[y, x, c], blend[cell, 1 + c], blend[cell, 4 + c])
            for j in range(count[cell]):
                h, wax = layer[cell, j], crayon[cell, j]
                for c in range(3):
                    out[y, x, c] = _over(out[y, x, c], h * optics[wax, c], h * optics[wax, 3 + c])
            if light > 0:
                before = cell - (cols if y > 0 else 0) - (1 if x > 0 else 0)
                after = cell + (cols if y < rows - 1 else 0) + (1 if x < cols - 1 else 0)
                fall = (paper[before] - paper[after]) * np.float32(0.35) + total[before] - total[after]
                shade = -fall * light
                shade = np.float32(1) + shade / (np.float32(1) + abs(shade) * np.float32(12))
                for c in range(3):
                    out[y, x, c] = min(np.float32(1), out[y, x, c] * shade)


@kernel
def _render_parts(parts, ground, light, paper, total, count, crayon, layer, blend, optics, out):  # type: ignore[no-untyped-def]
    """Render parts (n, 4), each top, bottom, left, right."""
    for i in range(parts.shape[0]):
        _render(parts[i, 0], parts[i, 1], parts[i, 2], parts[i, 3], ground, light, paper, total, count, crayon, layer,
                blend, optics, out)  # fmt: skip


def render(
    sheet: Sheet, ground: tuple[float, float, float], *, light: bool = True, threads: int = 1
) -> NDArray[np.float32]:
    """The picture of a sheet: linear RGB (rows, cols, 3) over paper of the linear colour `ground`."""
    out = np.empty((sheet.rows, sheet.cols, 3), np.float32)

    def band(top: int) -> None:
        part = np.array([[top, min(top + BAND, sheet.rows), 0, sheet.cols]])
        render_parts(sheet, ground, part, out, light=light)

    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(band, range(0, sheet.rows, BAND)))
    return out


def render_parts(
    sheet: Sheet,
    ground: tuple[float, float, float],
    parts: NDArray[np.int64],
    out: NDArray[np.float32],
    *,
    light: bool = True,
) -> None:
    """Renew parts (n, 4), each top, bottom, left, right in cells, of a picture `out` that `render` gave earlier."""
    strength = np.float32(LIGHT * 0.1 / sheet.cell_mm * 0.5 if light else 0)
    wax = (sheet.total, sheet.count, sheet.crayon, sheet.layer, sheet.blend, sheet.optics)
    _render_parts(parts, np.array(ground, np.float32), strength, sheet.paper, *wax, out)
