"""Paper: height fields for the tooth (section 3.2 of the paper, Fig. 1) and a colour.

Every paper is described in mm and um and made at the sheet's resolution. A texture is periodic: one
patch is made by convolution in the frequency domain and laid side by side over large sheets.
"""

import functools
import os
import tomllib
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, fields, replace
from importlib import resources
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stroke_gen.alike import be_plain
from stroke_gen.checks import did_you_mean

from ..images.srgb import light_of

Floats = NDArray[np.float32]

FINE_MM = 0.3  # a pressed paper is smooth below waves of this length ...
SPAN = 18.0  # ... its longest ones are so many grains long ...
# ... and cells of this size see all of its roughness, the standard deviation of which counts as 1
ALL_MM = 0.1
PIT = 1.1  # how many deviations below the mean its pits begin ...
BRINK = 0.4  # ... over how many the surface turns down into them ...
# ... and where it lies, how rough it is and how steep they are, of its depth
LEVEL, ROUGH, STEEP = 0.92, 0.031, 0.564
PATCH = 2048  # cells along one side of the periodic patch, at most


@dataclass(frozen=True)
class Paper:
    """A paper as data. `texture` is pressed, felt, lunar, stipple, or the path of a grey image."""

    name: str
    title: str
    texture: str
    wavelength_mm: float  # grain of the tooth
    depth_um: float  # from the 0.5 to the 99.5 percentile of heights
    # 1: as many peaks as pits; 2 and more: a plateau with pits, as pressed papers have
    pits: float = 1.0
    colour: str = "#fdfcf8"


@functools.cache
def papers() -> dict[str, Paper]:
    """The shipped papers by name."""
    text = resources.files("crayonize").joinpath("data/papers.toml").read_text("utf-8")
    return {name: Paper(name=name, **row) for name, row in tomllib.loads(text).items()}


def load_paper(spec: "str | dict[str, Any] | Paper") -> Paper:
    """A paper from a shipped name, `NAME:COLOUR` (kraft:#204060), a picture file, or a table of its
    fields.
    """
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
    raise ValueError(
        f"paper: {spec!r} is neither a paper nor a picture file{did_you_mean(name, papers())}"
    )


def strange(spec: "str | dict[str, Any]") -> str:
    """The word of a paper that stands for a file, as it is neither a paper nor a texture of ours;
    "" if there is none.
    """
    if not isinstance(spec, dict):
        return "" if spec.partition(":#")[0] in papers() else spec
    texture = spec.get("texture")
    if texture is not None and texture not in _KINDS:
        return str(texture)
    return strange(str(spec.get("name", "drawing")))


def _checked(paper: Paper) -> Paper:
    for key in ("name", "title", "texture", "colour"):
        if not isinstance(getattr(paper, key), str):
            raise ValueError(f"paper.{key}: {getattr(paper, key)!r} is not a text")
    if paper.texture not in _KINDS and not os.path.isfile(paper.texture):
        kinds = ", ".join(_KINDS)
        raise ValueError(
            f"paper.texture: {paper.texture!r} is neither one of {kinds} nor a picture file"
        )
    for key, low, high in (
        ("wavelength_mm", 0.0, 20.0),
        ("depth_um", 0.0, 1000.0),
        ("pits", 0.2, 8.0),
    ):
        value = getattr(paper, key)
        if not isinstance(value, int | float) or not low <= value <= high:
            raise ValueError(f"paper.{key}: {value!r} is not a number from {low:g} to {high:g}")
    colour_linear(paper.colour)
    return paper


def colour_linear(colour: str) -> tuple[float, float, float]:
    """Linear RGB of '#rrggbb'."""
    try:
        return light_of(colour)
    except ValueError as error:
        raise ValueError(f"colour: {error}") from error


def tooth(paper: Paper, rows: int, cols: int, cell_mm: float, seed: int) -> Floats:
    """Height field (rows, cols) in um of a paper on cells of `cell_mm`."""
    if paper.texture not in _KINDS:
        return _from_picture(paper, rows, cols)
    patch = _patch(paper, (min(PATCH, _even(rows)), min(PATCH, _even(cols))), cell_mm, seed)
    high, wide = patch.shape
    out = np.empty((rows, cols), np.float32)
    for y in range(0, rows, high):
        for x in range(0, cols, wide):
            out[y : y + high, x : x + wide] = patch[: rows - y, : cols - x]
    return out


def _patch(paper: Paper, shape: tuple[int, int], cell_mm: float, seed: int) -> Floats:
    """One period of a texture, as heights in um."""
    rng = np.random.default_rng([seed, 7])
    if paper.texture == "pressed":
        return _pressed(shape, max(paper.wavelength_mm, 0.01), cell_mm, rng) * np.float32(
            paper.depth_um
        )
    wavelength = max(paper.wavelength_mm / cell_mm, 1.0)
    patch = _TEXTURES[paper.texture](shape, wavelength, rng)
    low, high = np.percentile(
        patch[:: max(1, shape[0] // 512), :: max(1, shape[1] // 512)], (0.5, 99.5)
    )
    patch -= low
    patch /= max(high - low, np.float32(1e-12))
    np.clip(patch, 0, 1, out=patch)
    if paper.pits != 1:
        patch = 1 - (1 - patch) ** np.float32(paper.pits)
    return patch * np.float32(paper.depth_um)


def _even(n: int) -> int:
    """The next length that a fast Fourier transform likes."""
    import cv2

    return int(cv2.getOptimalDFTSize(n + n % 2))


def _convolve(noise: Floats, spot: Floats) -> Floats:
    """A lattice of noise, convolved in its place, periodically, with a spot (van Wijk's spot
    noise).
    """
    import cv2

    kernel = np.zeros(noise.shape, np.float32)
    down, along = (np.arange(n) - n // 2 for n in spot.shape)
    # a large spot wraps round
    np.add.at(kernel, (down[:, None] % noise.shape[0], along % noise.shape[1]), spot)
    cv2.mulSpectrums(cv2.dft(noise, noise), cv2.dft(kernel, kernel), 0, noise)
    return np.asarray(cv2.dft(noise, noise, cv2.DFT_INVERSE | cv2.DFT_SCALE), np.float32)


def _lunar(shape: tuple[int, int], wavelength: float, rng: np.random.Generator) -> Floats:
    """The lunar texture: uniform noise convolved with one quarter-circle arc (Fig. 1, left)."""
    spot = _arc(radius=2.2 * wavelength, width=max(0.55 * wavelength, 1.0))
    return _convolve(rng.random(shape, np.float32) - np.float32(0.5), spot)


def _arc(radius: float, width: float) -> Floats:
    """A quarter-circle arc drawn with anti-aliasing, sum 1; radius and width in cells."""
    fine = 4
    n = 2 * int(np.ceil(radius + width)) + 1
    y, x = (np.mgrid[: n * fine, : n * fine] + 0.5) / fine - n / 2
    inside = (np.abs(np.hypot(x, y) - radius) <= width / 2) & (x >= 0) & (y >= 0)
    spot = inside.reshape(n, fine, n, fine).mean((1, 3))
    return (spot / spot.sum()).astype(np.float32)


def _stipple(shape: tuple[int, int], wavelength: float, rng: np.random.Generator) -> Floats:
    """Uniform noise whose amplitude a tiled mask of dots scales (Fig. 1, right)."""
    # whole dots and pairs of rows, so that patches join
    down = 2 * max(round(shape[0] / (8 * wavelength)), 1)
    along = max(round(shape[1] / (4 * wavelength)), 1)
    y, x = (
        (np.arange(shape[0])[:, None] + 0.5) * (down / shape[0]),
        (np.arange(shape[1]) + 0.5) * (along / shape[1]),
    )
    dx, dy = (x + (y // 1 % 2) / 2) % 1 - 0.5, y % 1 - 0.5
    dots = np.clip(1.35 - 2.6 * np.hypot(dx, dy), 0, 1).astype(np.float32)
    return np.asarray(dots * (0.35 + 0.65 * rng.random(shape)), np.float32)


def _felt(shape: tuple[int, int], wavelength: float, rng: np.random.Generator) -> Floats:
    """Drawing paper pressed on a felt: a fine tooth over slow swells (two bands of smooth
    noise).
    """

    def band(noise: Floats, scale: float, share: float) -> Floats:
        smooth = _convolve(noise, _dome(max(scale * wavelength, 0.5)))
        smooth *= np.float32(share) / smooth.std()
        return smooth

    # smooths one band while the next is filled with noise
    with ThreadPoolExecutor(initializer=be_plain) as pool:
        bands = [
            pool.submit(band, rng.standard_normal(shape, np.float32), scale, share)
            for scale, share in ((0.26, 0.8), (0.7, 0.45), (1.9, 0.25))
        ]
    return _sum(bands)


def _pressed(
    shape: tuple[int, int], grain_mm: float, cell_mm: float, rng: np.random.Generator
) -> Floats:
    """Paper pressed smooth: an even surface with pits of all sizes; 0 and 1 are the percentiles 0.5
    and 99.5.

    Waves shorter than the cells can hold are left out, not folded into longer ones; all others have
    the same height on cells of any size.
    """
    down = np.fft.fftfreq(shape[0], cell_mm).astype(np.float32)[:, None]
    along = np.fft.rfftfreq(shape[1], cell_mm).astype(np.float32)
    waves = np.fft.rfft2(rng.standard_normal(shape, np.float32))
    waves *= np.sqrt(_roughness(np.hypot(down, along), grain_mm))
    z = np.asarray(np.fft.irfft2(waves, shape), np.float32)
    f = np.geomspace(0.02 / grain_mm, 0.5 / ALL_MM, 400)
    z /= np.float32(
        cell_mm * np.sqrt(2 * np.pi * np.trapezoid(_roughness(f, grain_mm) * f * f, np.log(f)))
    )
    pit = np.float32(BRINK) * np.logaddexp(
        np.float32(0), (np.float32(-PIT) - z) / np.float32(BRINK)
    )
    return np.asarray(
        np.clip(np.float32(LEVEL) + np.float32(ROUGH) * z - np.float32(STEEP) * pit, 0, 1),
        np.float32,
    )


def _roughness(f: NDArray[Any], grain_mm: float) -> NDArray[Any]:
    """Power of a pressed paper's waves by wave number f in 1/mm.

    Scanned drawing papers fall as f^-1 down to their grain, as f^-2.3 below it, and as f^-4 where
    the press has smoothed them.
    """
    slow = np.maximum(f * grain_mm, 1 / SPAN) ** -1.0
    return np.asarray(
        slow * np.maximum(f * grain_mm, 1) ** -1.3 * np.maximum(f * FINE_MM, 1) ** -1.7
    )


def _sum(parts: "list[Future[Floats]]") -> Floats:
    """The sum of what is being computed, in the place of the first."""
    total = parts[0].result()
    for part in parts[1:]:
        total += part.result()
    return total


def _dome(sigma: float) -> Floats:
    radius = int(np.ceil(3 * sigma))
    y, x = np.mgrid[-radius : radius + 1, -radius : radius + 1]
    spot = np.exp(-(x * x + y * y) / (2 * sigma * sigma))
    return (spot / spot.sum()).astype(np.float32)


_TEXTURES = {"lunar": _lunar, "stipple": _stipple, "felt": _felt}
_KINDS = ("pressed", *_TEXTURES)


def _from_picture(paper: Paper, rows: int, cols: int) -> Floats:
    """A grey picture as a height field, white high, stretched over the sheet."""
    import cv2

    from ..images.read import read_linear

    grey = read_linear(paper.texture).mean(2)
    way = cv2.INTER_AREA if grey.size > rows * cols else cv2.INTER_CUBIC
    fitted = cv2.resize(grey, (cols, rows), interpolation=way)
    return np.ascontiguousarray(np.clip(fitted, 0, 1), np.float32) * np.float32(paper.depth_um)
