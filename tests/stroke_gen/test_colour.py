"""OKLab for decisions, against published values and cbrt."""

import numpy as np
import pytest

from stroke_gen.colour import CHROMA, cube_root, from_oklab, oklab
from stroke_gen.jit import kernel

PUBLISHED = {  # L, a, b of the sRGB primaries and white, from CSS Color 4
    (1, 1, 1): (1.0, 0.0, 0.0),
    (1, 0, 0): (0.62796, 0.22486, 0.12585),
    (0, 1, 0): (0.86644, -0.23389, 0.17950),
    (0, 0, 1): (0.45201, -0.03246, -0.31153),
    (0, 1, 1): (0.90540, -0.14944, -0.03940),
    (0, 0, 0): (0.0, 0.0, 0.0),
}

_cube_root = kernel(cube_root)


@kernel
def _roots(x, out):
    for i in range(x.size):
        out[i] = _cube_root(x[i])


@pytest.mark.parametrize("rgb, lab", PUBLISHED.items(), ids=str)
def test_published_values(rgb, lab):
    ours = oklab(np.array(rgb, np.float32)) / [1, CHROMA, CHROMA]
    assert np.allclose(ours, lab, atol=2e-4)


def test_there_and_back():
    light = np.random.default_rng(0).random((4000, 3)).astype(np.float32)
    assert np.abs(from_oklab(oklab(light)) - light).max() < 1e-4
    lab = oklab(light)
    assert np.abs(oklab(from_oklab(lab)) - lab).max() < 1e-3


def test_out_of_gamut_is_clipped():
    wild = np.random.default_rng(1).uniform(-2, 2, (2000, 3)).astype(np.float32)
    light = from_oklab(wild)
    assert light.dtype == np.float32 and light.min() >= 0 and light.max() <= 1
    assert np.isfinite(oklab(np.array([-0.1, 0.0, 2.0], np.float32))).all()


def test_chroma_counts_double():
    grey, warm = oklab(np.array([[0.5, 0.5, 0.5], [0.55, 0.5, 0.45]], np.float32))
    plain = (warm - grey) / [1, CHROMA, CHROMA]
    assert np.hypot(*(warm - grey)[1:]) == pytest.approx(2 * np.hypot(*plain[1:]))
    assert np.abs(grey[1:]).max() < 1e-4


def test_cube_root_of_kernels():
    x = np.concatenate([np.logspace(-7, 0, 20001), np.linspace(1e-7, 1, 20001)]).astype(np.float32)
    out = np.empty_like(x)
    _roots(x, out)
    assert np.abs(out - np.cbrt(x)).max() < 1e-4
    nothing = np.array([0.0, 1e-9, -0.3], np.float32)
    _roots(nothing, out)
    assert (out[:3] == 0).all()
