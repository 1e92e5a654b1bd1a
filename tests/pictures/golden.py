"""Pictures kept in tests/golden, and how a new one is compared with them.

Another processor or another OpenCV may draw a stroke a little differently, so pictures are compared
as they look from afar, square by square: mean colour, and how strong the grain is. `pytest
--store-golden` stores them anew; look at them before committing. A failure leaves NAME-actual,
NAME-expected and NAME-difference in tests/golden/failed.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

GOLDEN = Path(__file__).parents[1] / "golden"
FAILED = GOLDEN / "failed"
SQUARE = 12  # pixels
MEAN, WORST, GRAIN = 1.0, 14.0, 0.5  # sRGB levels: of all squares, of the worst one, of the grain
EXACT = 0.3  # ... and of all pixels, where no planner had a say

Picture = NDArray[np.uint8]


def compare(name: str, actual: Picture, store: bool, exact: bool = False) -> None:
    """AssertionError if a picture is not as it was; with `store`, keep it as it is now.

    exact: pixel by pixel too, for drawings whose strokes are given.
    """
    path = GOLDEN / f"{name}.png"
    if store:
        Image.fromarray(actual).save(path, optimize=True)
    expected = np.asarray(Image.open(path).convert("RGB"))
    wrong = differences(expected, actual, exact)
    if wrong:
        FAILED.mkdir(exist_ok=True)
        Image.fromarray(actual).save(FAILED / f"{name}-actual.png")
        Image.fromarray(expected).save(FAILED / f"{name}-expected.png")
        if expected.shape == actual.shape:
            apart = 128 + (actual.astype(int) - expected) // 2
            Image.fromarray(apart.astype(np.uint8)).save(FAILED / f"{name}-difference.png")
    assert not wrong, f"{name}: {wrong}; see {FAILED}"


def differences(expected: Picture, actual: Picture, exact: bool = False) -> str:
    """In which way a picture is not as expected; empty if it is."""
    if expected.shape != actual.shape:
        return f"is {actual.shape}, was {expected.shape}"
    every = np.abs(actual.astype(np.int16) - expected).mean()
    if exact and every > EXACT:
        return f"pixels are {every:.2f} levels off in the mean"
    (mean, grain), (mean_before, grain_before) = _seen(actual), _seen(expected)
    apart = np.abs(mean - mean_before)
    if apart.mean() > MEAN:
        return f"colours are {apart.mean():.2f} levels off in the mean"
    if apart.max() > WORST:
        row, col = np.argwhere(apart.max(-1) == apart.max())[0] * SQUARE
        return f"colours are {apart.max():.1f} levels off at row {row}, column {col}"
    if abs(grain.mean() - grain_before.mean()) > GRAIN:
        return f"grain is {grain.mean():.2f} levels, was {grain_before.mean():.2f}"
    return ""


def _seen(picture: Picture) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Mean (rows, cols, 3) and standard deviation (rows, cols, 3) of the squares of a picture."""
    rows, cols = picture.shape[0] // SQUARE, picture.shape[1] // SQUARE
    whole = picture[: rows * SQUARE, : cols * SQUARE].astype(np.float64)
    squares = whole.reshape(rows, SQUARE, cols, SQUARE, 3)
    return squares.mean((1, 3)), squares.std((1, 3))
