"""Light through wax: Kubelka-Munk over the layers, bottom up, in linear light (section 4, Fig. 9).

Fig. 9 is read as Kubelka's two-layer formula (1954) on the reflectance r and transmittance t of
each layer, which follow from the sums k*h and s*h (Kubelka 1948). Splitting a layer changes
nothing. A quiet light from the upper left shades the relief of paper and wax.
"""

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from stroke_gen.jit import kernel

from ..crayons.pigment import FRONT
from ..images.icc import encode_srgb
from ..wax.columns import BLEND, LAYERS
from ..wax.sheet import Sheet
from . import area

Floats = NDArray[np.float32]
Colour = tuple[float, float, float]
T = TypeVar("T")

LIGHT = 0.007  # change of brightness per 1/100 of slope, before saturation: 3 to 6 % over a drawing
FILM_UM = 0.5  # a film so thin has half of its front surface: the rest is in gaps
# how much more the relief shows in what the surface reflects than in what comes through it
GLOSS = 6.0
BAND = 1 << 17  # cells rendered by one task


@kernel
def _over(ground, kh, sh):  # type: ignore[no-untyped-def]
    """Reflectance of a layer with absorption kh and scattering sh over a ground; stable for kh, sh
    -> 0.
    """
    one, two = np.float32(1), np.float32(2)
    g = np.sqrt(kh * (kh + two * sh))
    if g < np.float32(1e-3):
        a, b, d = sh, one, kh + sh + one  # limit: g / tanh(g) and g / sinh(g) are 1
    else:
        e = np.exp(-g)
        e2 = e * e
        m = one - e2
        a, b, d = sh * m, two * g * e, (kh + sh) * m + g * (one + e2)
    # r = a / d, t = b / d, and r + t t ground / (1 - r ground) in one fraction
    left = d - a * ground
    return (a * left + b * b * ground) / (d * left)


class Lamp(NamedTuple):
    """How light falls on a sheet; all float32."""

    slope: np.float32  # change of brightness per um that one cell stands higher than the next
    front: np.float32  # share of the light that the surface of wax reflects
    film: np.float32  # um
    gloss: np.float32


@kernel
def _render(top, bottom, left, right, ground, lamp, columns, cols, first, out):  # type: ignore[no-untyped-def]
    """Rows top..bottom, columns left..right of a sheet `cols` wide into out (n, cols, 3).

    `out` begins at row `first` of the sheet.
    """
    one = np.float32(1)
    paper, total, blend, optics = columns.paper, columns.total, columns.blend, columns.optics
    rows = columns.used.size // cols
    for y in range(top, bottom):
        row = y - first
        for x in range(left, right):
            cell = y * cols + x
            for c in range(3):
                out[row, x, c] = ground[c]
            # Up through the column, blend first.
            if blend[cell * BLEND] > 0:
                for c in range(3):
                    kh, sh = blend[cell * BLEND + 1 + c], blend[cell * BLEND + 4 + c]
                    out[row, x, c] = _over(out[row, x, c], kh, sh)
            for j in range(columns.used[cell]):
                h = columns.layer[cell * LAYERS + j]
                wax = np.int64(columns.crayon[cell * LAYERS + j]) * 6
                for c in range(3):
                    out[row, x, c] = _over(
                        out[row, x, c], h * optics[wax + c], h * optics[wax + 3 + c]
                    )
            # The relief under a lamp from the upper left.
            shade = np.float32(0)
            if lamp.slope > 0:
                before = cell - (cols if y > 0 else 0) - (1 if x > 0 else 0)
                after = cell + (cols if y < rows - 1 else 0) + (1 if x < cols - 1 else 0)
                rise = (
                    (paper[after] - paper[before]) * np.float32(0.35) + total[after] - total[before]
                )
                shade = rise * lamp.slope
                shade /= one + abs(shade) * np.float32(12)
            # What the front surface reflects never went through the wax.
            front = lamp.front * total[cell] / (total[cell] + lamp.film)
            front *= max(one + lamp.gloss * shade, np.float32(0))
            for c in range(3):
                inside = out[row, x, c] * (one + shade)
                out[row, x, c] = min(one, front + (one - front) * inside)


@kernel
def _render_parts(parts, ground, lamp, columns, cols, first, out):  # type: ignore[no-untyped-def]
    """Render parts (n, 4), each top, bottom, left, right."""
    for i in range(parts.shape[0]):
        top, bottom, left, right = parts[i]
        _render(top, bottom, left, right, ground, lamp, columns, cols, first, out)


def render(sheet: Sheet, ground: Colour, *, light: bool = True, threads: int = 1) -> Floats:
    """The picture of a sheet: linear RGB (rows, cols, 3) over paper of the linear colour
    `ground`.
    """
    out = np.empty((sheet.rows, sheet.cols, 3), np.float32)

    def band(top: int, bottom: int) -> None:
        render_parts(sheet, ground, np.array([[top, bottom, 0, sheet.cols]]), out, light=light)

    for _ in _by_bands(sheet, band, threads):
        pass
    return out


def render_srgb(
    sheet: Sheet, ground: Colour, *, light: bool = True, threads: int = 1
) -> NDArray[np.uint8]:
    """As `render`, in sRGB of 8 bits. Only a band of it exists as floats at any time."""
    out = np.empty((sheet.rows, sheet.cols, 3), np.uint8)

    def band(top: int, bottom: int) -> None:
        out[top:bottom] = encode_srgb(_band(sheet, ground, top, bottom, light))

    for _ in _by_bands(sheet, band, threads):
        pass
    return out


def render_reduced(
    sheet: Sheet, ground: Colour, shape: tuple[int, int], *, threads: int = 1
) -> Floats:
    """As `render` without light, on a grid of `shape` no finer than the sheet: area means, linear
    RGB (*shape, 3).
    """
    out = np.zeros((*shape, 3), np.float32)

    def band(top: int, bottom: int) -> Floats:
        return area.narrowed(_band(sheet, ground, top, bottom, False), shape[1])

    for top, rows in _by_bands(sheet, band, threads):
        area.add_rows(out, rows, top, sheet.rows)
    return np.clip(out, 0, 1)


def _by_bands(sheet: Sheet, work: Callable[[int, int], T], threads: int) -> Iterator[tuple[int, T]]:
    """What `work` makes of rows top..bottom, on threads: (top, that) for one band after the
    other.
    """
    step = max(1, BAND // sheet.cols)
    tops = range(0, sheet.rows, step)
    with ThreadPoolExecutor(threads) as pool:
        yield from zip(
            tops, pool.map(lambda top: work(top, min(top + step, sheet.rows)), tops), strict=True
        )


def _band(sheet: Sheet, ground: Colour, top: int, bottom: int, light: bool) -> Floats:
    """Rows top..bottom of the picture."""
    out = np.empty((bottom - top, sheet.cols, 3), np.float32)
    render_parts(
        sheet, ground, np.array([[top, bottom, 0, sheet.cols]]), out, first=top, light=light
    )
    return out


def render_parts(
    sheet: Sheet,
    ground: Colour,
    parts: NDArray[np.int64],
    out: Floats,
    *,
    first: int = 0,
    light: bool = True,
) -> None:
    """Renew parts (n, 4), each top, bottom, left, right in cells, of a picture `out` that begins at
    row `first`.
    """
    slope = LIGHT * 0.1 / sheet.cell_mm * 0.5 if light else 0.0
    lamp = Lamp(*(np.float32(value) for value in (slope, FRONT, FILM_UM, GLOSS)))
    _render_parts(
        parts, np.array(ground, np.float32), lamp, sheet.columns(), sheet.cols, first, out
    )
