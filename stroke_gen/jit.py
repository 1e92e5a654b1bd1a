"""The one way a kernel is compiled: lazily, at its first call, and without the interpreter lock.

numba's own disk cache is never used, as it does not notice a change in another file: the program
that draws keeps compiled kernels itself, under the source of all files beside them. So a kernel and
the constants it reads stand in one package, as do the kernels that it calls.

Kernels write their sums and minima out as loops: to load one that calls an array's `min` or `mean`,
numba first imports half of itself and scipy, a quarter of a second.
"""

from collections.abc import Callable
from typing import Any

import numba


def kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile `function` at its first call; threads may run it side by side."""
    compiled: Callable[..., Any] = numba.njit(nogil=True, error_model="numpy")(function)
    return compiled


def sum_kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """As `kernel`, for plain sums: the order of additions is the compiler's, so that it can use
    vectors.
    """
    relaxed = {"reassoc", "nsz"}
    compiled: Callable[..., Any] = numba.njit(nogil=True, error_model="numpy", fastmath=relaxed)(
        function
    )
    return compiled


def lean_kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """As `kernel`, for one that makes no arrays: it counts no references.

    Counting the references to each array passed costs more than many a small loop, and threads that
    count those of one array take turns at it.
    """
    return _lean(function)


def inner_kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """As `lean_kernel`, for a small one in an inner loop: it becomes part of the kernels that call
    it.

    Larger ones would take the compiler long, and be no faster.
    """
    return _lean(function, inline="always")


def lean_sum_kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """As `sum_kernel`, and without counting references."""
    return _lean(function, fastmath={"reassoc", "nsz"})


def _lean(function: Callable[..., Any], **options: Any) -> Callable[..., Any]:
    options |= {"nogil": True, "error_model": "numpy", "_nrt": False}
    compiled: Callable[..., Any] = numba.njit(**options)(function)
    return compiled
