"""The same picture on every processor: the roads that other ones take are closed one by one."""

import os
import subprocess
import sys

import cv2
import numpy as np
import pytest

from stroke_gen.alike import norm, plain_opencv, times

DRAW = """
import hashlib, numpy as np
from crayonize import convert
y, x = np.mgrid[:90, :120] / 120
photo = np.dstack([x, y, .5 + .5 * np.sin(9 * x * y)])
photo[20:60, 30:70] *= .4
print(hashlib.sha256(convert(photo, size=300, seed=5).tobytes()).hexdigest())
"""
OTHERS = {
    "another BLAS": {"OPENBLAS_CORETYPE": "Prescott"},
    "no library of Intel's": {"OPENCV_IPP": "disabled"},
    "narrower vectors": {"OPENCV_CPU_DISABLE": "AVX2,AVX512_SKX"},
    "one thread": {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
}


def drawn(more):
    ran = subprocess.run(
        [sys.executable, "-c", DRAW], env=os.environ | more, capture_output=True, text=True
    )
    assert ran.returncode == 0, ran.stderr
    return ran.stdout


def test_another_processor_draws_the_same_picture():
    usual = drawn({})
    assert len(usual) > 60
    assert {name: drawn(more) for name, more in OTHERS.items()} == dict.fromkeys(OTHERS, usual)


GUIDED = """
import hashlib
import cv2, numpy as np
from stroke_gen.alike import plain_opencv
picture = np.random.default_rng(0).random((60, 80, 3)).astype(np.float32)
for road in {roads}:
    cv2.setUseOptimized(road)
    smooth = cv2.ximgproc.guidedFilter(picture, picture[..., 0].copy(), 4, 1e-3)
print(hashlib.md5(smooth.tobytes()).hexdigest())
"""


def test_what_ran_before_in_a_process_changes_nothing():
    """The guided filter decides once for all how it calculates."""
    sums = {
        subprocess.run(
            [sys.executable, "-c", GUIDED.format(roads=roads)], capture_output=True, text=True
        ).stdout
        for roads in ((False,), (True, False))
    }
    assert len(sums) == 1 and len(sums.pop()) == 33


def test_opencv_is_given_back_as_it_was():
    assert cv2.useOptimized()
    with plain_opencv():
        with plain_opencv():
            assert not cv2.useOptimized()
        assert not cv2.useOptimized()
    assert cv2.useOptimized()
    with pytest.raises(KeyError), plain_opencv():
        raise KeyError
    assert cv2.useOptimized()


def test_times_is_the_matrix_product():
    rng = np.random.default_rng(1)
    vectors, matrix = rng.random((4, 5, 3)), rng.random((2, 3))
    assert np.allclose(times(vectors, matrix), vectors @ matrix.T)
    assert times(vectors.astype(np.float32), matrix.astype(np.float32)).dtype == np.float32
    assert norm(np.array([3.0, 4.0])) == 5
