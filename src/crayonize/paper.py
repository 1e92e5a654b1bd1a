"""Paper: height fields for the tooth (section 3.2 of the paper, Fig. 1) and a colour.

Every paper is described in mm and um and made at the sheet's resolution. A texture is periodic: one
patch is made by convolution in the frequency domain and laid side by side over large sheets.
"""

import functools
import os
import re
import tomllib
from dataclasses import dataclass, fields, replace
from importlib import resources
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .did_you_mean import did_you_mean

PATCH = 2048  # cells along one side of the periodic patch, at most


@dataclass(frozen=True)
class Paper:
    """A paper as data. `texture` is lunar, stipple, felt, or the path of a grey image."""

    name: str
    title: str
    texture: str
    wavelength_mm: float  # grain of the tooth
    depth_um: float  # from the 0.5 to the 99.5 percentile of heights
    pits: float = 1.0  # 1: as many peaks as pits; 2 and more: a plateau with pits, as pressed papers have
    colour: str = "#fdfcf8"


@functools.cache
def papers() -> dict[str, Paper]:
    """The shipped papers by name."""
    text = resources.files("crayonize").joinpath("data/papers.toml").read_text("utf-8")
    return {name: Paper(name=name, **row) for name, row in tomllib.loads(text).items()}


def load_paper(spec: "str | dict[str, Any] | Paper") -> Paper:
    """A paper from a shipped name, `NAME:COLOUR` (kraft:#204060), a picture file, or a table of its fields."""
    if isinstance(spec, Paper):
        return spec
    if isinstance(spec, dict):
        known = {f.name for f in fields(Paper)}
        for key in spec:
            if key not in known:
                raise ValueError(f"paper.{key}: unknown key{did_you_mean(key, known)}")
        base = load_paper(str(spec.get("name", "drawing")))
        return _checked(replace(base, **spec))
    if not isinstance(spec, str):
        raise ValueError(f"paper: {spec!r} is neither a name nor a table")
    name, _, colour = spec.partition(":#")
    if name in papers():
        base = papers()[name]
        return _checked(replace(base, colour="#" + colour) if colour else base)
    if os.path.isfile(spec):
        return Paper(spec, "a texture of your own", spec, 0.0, 80.0)
    raise ValueError(f"paper: {spec!r} is neither a paper nor a picture file{did_you_mean(name, papers())}")


def _checked(paper: Paper) -> Paper:
    for key in ("name", "title", "texture", "colour"):
        if not isinstance(getattr(paper, key), str):
            raise ValueError(f"paper.{key}: {getattr(paper, key)!r} is not a text")
    if paper.texture not in _TEXTURES and not os.path.isfile(paper.texture):
        kinds = ", ".join(_TEXTURES)
        raise ValueError(f"paper.texture: {paper.texture!r} is neither one of {kinds} nor a picture file")
    for key, low, high in (("wavelength_mm", 0.0, 20.0), ("depth_um", 0.0, 1000.0), ("pits", 0.2, 8.0)):
        value = getattr(paper, key)
        if not isinstance(value, int | float) or not low <= value <= high:
            raise ValueError(f"paper.{key}: {value!r} is not a number from {low:g} to {high:g}")
    colour_linear(paper.colour)
    return paper


def colour_linear(colour: str) -> tuple[float, float, float]:
    """Linear RGB of '#rrggbb'."""
    if not re.fullmatch("#?[0-9a-fA-F]{6}", colour):
        raise ValueError(f"colour: {colour!r} is not #rrggbb")
    digits = colour.removeprefix("#")
    code = [int(digits[i : i + 2], 16) / 255 for i in (0, 2, 4)]
    r, g, b = (c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in code)
    return r, g, b


def tooth(paper: Paper, rows: int, cols: int, cell_mm: float, seed: int) -> NDArray[np.float32]:
    """Height field (rows, cols) in um of a paper on cells of `cell_mm`."""
    if paper.texture not in _TEXTURES:
        return _from_picture(paper, rows, cols)
    shape = (min(PATCH, _even(rows)), min(PATCH, _even(cols)))
    rng = np.random.default_rng([seed, 7])
    wavelength = max(paper.wavelength_mm / cell_mm, 1.0)
    field = _TEXTURES[paper.texture](shape, wavelength, rng)
    low, high = np.percentile(field[:: max(1, shape[0] // 512), :: max(1, shape[1] // 512)], (0.5, 99.5))
    patch = np.clip((field - low) / max(high - low, 1e-12), 0, 1).astype(np.float32)
    patch = (1 - (1 - patch) ** np.float32(paper.pits)) * np.float32(paper.depth_um)
    if patch.shape[0] >= rows and patch.shape[1] >= cols:
        return np.ascontiguousarray(patch[:rows, :cols])
    out = np.empty((rows, cols), np.float32)
    for y in range(0, rows, patch.shape[0]):
        for x in range(0, cols, patch.shape[1]):
            out[y : y + patch.shape[0], x : x + patch.shape[1]] = patch[: rows - y, : cols - x]
    return out


def _even(n: int) -> int:
    """The next length that a fast Fourier transform likes."""
    import cv2

    return int(cv2.getOptimalDFTSize(n + n % 2))


def _convolve(noise: NDArray[np.float32], spot: NDArray[np.float32]) -> NDArray[np.float32]:
    """Periodic convolution of a lattice of noise with a spot (van Wijk's spot noise on a full lattice)."""
    kernel = np.zeros(noise.shape, np.float32)
    n, m = spot.shape
    for j in range(n):  # a spot larger than the lattice wraps round
        for i in range(m):
            kernel[(j - n // 2) % noise.shape[0], (i - m // 2) % noise.shape[1]] += spot[j, i]
    spectrum = np.fft.rfft2(noise) * np.fft.rfft2(kernel)
    return np.asarray(np.fft.irfft2(spectrum, s=noise.shape), np.float32)


def _lunar(shape: tuple[int, int], wavelength: float, rng: np.random.Generator) -> NDArray[np.float32]:
    """The lunar texture: uniform noise convolved with a quarter-circle arc, four ways up for isotropy."""
    field = np.zeros(shape, np.float32)
    spot = _arc(radius=2.2 * wavelength, width=max(0.55 * wavelength, 1.0))
    for turn in range(4):
        noise = rng.random(shape, np.float32) - np.float32(0.5)
        field += _convolve(noise, np.rot90(spot, turn))
    return field


def _arc(radius: float, width: float) -> NDArray[np.float32]:
    """A quarter-circle arc drawn with anti-aliasing, sum 1; radius and width in cells."""
    fine = 4
    n = 2 * int(np.ceil(radius + width)) + 1
    y, x = (np.mgrid[: n * fine, : n * fine] + 0.5) / fine - n / 2
    inside = (np.abs(np.hypot(x, y) - radius) <= width / 2) & (x >= 0) & (y >= 0)
    spot = inside.reshape(n, fine, n, fine).mean((1, 3))
    return (spot / spot.sum()).astype(np.float32)


def _stipple(shape: tuple[int, int], wavelength: float, rng: np.random.Generator) -> NDArray[np.float32]:
    """Uniform noise whose amplitude a tiled mask of dots scales (Fig. 1, right)."""
    down = 2 * max(round(shape[0] / (8 * wavelength)), 1)  # whole dots and pairs of rows, so that patches join
    along = max(round(shape[1] / (4 * wavelength)), 1)
    y, x = np.mgrid[: shape[0], : shape[1]] + 0.5
    y, x = y * (down / shape[0]), x * (along / shape[1])
    dx, dy = (x + (y // 1 % 2) / 2) % 1 - 0.5, y % 1 - 0.5
    dots = np.clip(1.35 - 2.6 * np.hypot(dx, dy), 0, 1)
    return (dots * (0.35 + 0.65 * rng.random(shape))).astype(np.float32)


def _felt(shape: tuple[int, int], wavelength: float, rng: np.random.Generator) -> NDArray[np.float32]:
    """Drawing paper pressed on a felt: a fine tooth over slow swells (two bands of smooth noise)."""
    field = np.zeros(shape, np.float32)
    for scale, share in ((0.26, 0.8), (0.7, 0.45), (1.9, 0.25)):
        noise = rng.standard_normal(shape, np.float32)
        smooth = _convolve(noise, _dome(max(scale * wavelength, 0.5)))
        field += np.float32(share) * smooth / smooth.std()
    return field


def _dome(sigma: float) -> NDArray[np.float32]:
    radius = int(np.ceil(3 * sigma))
    y, x = np.mgrid[-radius : radius + 1, -radius : radius + 1]
    spot = np.exp(-(x * x + y * y) / (2 * sigma * sigma))
    return (spot / spot.sum()).astype(np.float32)


_TEXTURES = {"lunar": _lunar, "stipple": _stipple, "felt": _felt}


def _from_picture(paper: Paper, rows: int, cols: int) -> NDArray[np.float32]:
    """A grey picture as a height field, white high, stretched over the sheet."""
    import cv2

    from .image_read import read_linear

    grey = read_linear(paper.texture).mean(2)
    way = cv2.INTER_AREA if grey.size > rows * cols else cv2.INTER_CUBIC
    fitted = cv2.resize(grey, (cols, rows), interpolation=way)
    return np.ascontiguousarray(np.clip(fitted, 0, 1), np.float32) * np.float32(paper.depth_um)
