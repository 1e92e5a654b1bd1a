"""Arithmetic with the same last bits on every processor, for all that decisions hang on.

A stroke that starts elsewhere moves all that come after it, so one bit can make another picture.
OpenCV and BLAS take other roads on other processors (other widths of vectors, fused
multiplications, Intel's own library) and round differently; numpy's own loops and our kernels do
not.
"""

import threading
from collections.abc import Iterator
from contextlib import contextmanager

import cv2
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]

_lock = threading.Lock()
_held = 0  # how many now want OpenCV to be plain
_before = True


@contextmanager
def plain_opencv() -> Iterator[None]:
    """OpenCV with what all processors have; the setting is the process's, and is given back.

    Also a decorator. It costs next to nothing: of all we use only `filter2D` and `dft` are slower.
    """
    global _held, _before
    with _lock:
        if not _held:
            _before = cv2.useOptimized()
        _held += 1
        be_plain()
    try:
        yield
    finally:
        with _lock:
            _held -= 1
            if not _held:
                cv2.setUseOptimized(_before)


def be_plain() -> None:
    """To be called in each further thread: OpenCV knows for each whether it may use Intel's."""
    cv2.setUseOptimized(False)


def times(vectors: NDArray[np.floating], matrix: NDArray[np.floating]) -> NDArray[np.floating]:
    """Each of the vectors (..., n) by a small matrix (m, n): (..., m), without BLAS.

    >>> times(np.array([[1.0, 2.0]]), np.array([[0.0, 1.0], [1.0, 1.0]])).tolist()
    [[2.0, 3.0]]
    """
    out = np.empty((*vectors.shape[:-1], len(matrix)), np.result_type(vectors, matrix))
    for i, row in enumerate(matrix):
        total = vectors[..., 0] * row[0]
        for j in range(1, len(row)):
            total += vectors[..., j] * row[j]
        out[..., i] = total
    return out


def norm(vector: NDArray[np.floating]) -> float:
    """The length of one vector (n,), without BLAS."""
    return float(np.sqrt((vector * vector).sum()))


# The guided filter keeps for good the road that it took first.
with plain_opencv():
    _any = np.zeros((4, 4), np.float32)
    cv2.ximgproc.guidedFilter(_any, _any, 1, 1.0)
