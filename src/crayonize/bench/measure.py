"""What `crayonize bench` measures: each part in a process of its own, each figure the best of a few
runs.

Whole drawings are also set against two yardsticks timed in the same run: the same kernels
uncompiled, on a few short strokes, and OpenCV's oilPainting and stylization on the same photo. Such
ratios hold on other machines too.
"""

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from .. import __version__
from . import parts
from .parts import Figures, seconds_of

SIZES_MP = (1.0, 4.0, 16.0)  # sheets; with --quick without the last
REPEATS = 3
LIVE_SIZES = (1600, 3508)  # A4 as usual, and at 300 dpi


def measure(quick: bool = False, progress: Callable[[str, float], None] | None = None) -> Figures:
    """All figures, as JSON holds them: in seconds, unless their name says otherwise.

    quick: without the largest sheet, the cold start, and repetition.
    """
    sizes, repeats = (SIZES_MP[:-1], 1) if quick else (SIZES_MP, REPEATS)
    with tempfile.TemporaryDirectory() as folder:
        to_do: dict[str, Callable[[], Any]] = {
            "machine": partial(parts.child, "machine"),
            "start": partial(_starts, folder, repeats, cold=not quick),
            "cell_steps_per_second": partial(parts.child, "rubbing", 1000, repeats),
            "sheets": lambda: [],
            **{f"{mp:g} MP": partial(parts.child, "sheet", mp, folder, repeats) for mp in sizes},
            "threads": partial(parts.child, "threads", sizes[1], folder, repeats),
            "live_ms": lambda: {str(size): parts.child("live", size, 200) for size in LIVE_SIZES},
            "yardsticks": partial(_yardsticks, sizes[0], folder, repeats),
        }
        found: Figures = {"crayonize": __version__, "quick": quick}
        for number, (name, part) in enumerate(to_do.items()):
            if progress:
                progress(name.replace("_", " "), number / len(to_do))
            found[name] = part()
    found["sheets"] = [found.pop(f"{mp:g} MP") for mp in sizes]
    found["ratios"] = _ratios(found)
    return found


def _starts(folder: str, repeats: int, cold: bool) -> Figures:
    """Seconds of whole commands as the shell sees them."""
    given, out = Path(folder) / "start.jpg", Path(folder) / "start.png"
    parts.child("photo", str(given), 0.4)

    def command(*words: object, **environment: str) -> float:
        line, with_ours = (
            [sys.executable, "-m", "crayonize", *map(str, words)],
            os.environ | environment,
        )
        return seconds_of(
            partial(subprocess.run, line, env=with_ours, stdout=subprocess.DEVNULL, check=True)
        )

    draw = (given, out, "--size", 800, "-q")
    command(*draw)  # from now on the kernels are kept
    found = {
        "help": min(command("--help") for _ in range(3)),
        "photo_800": min(command(*draw) for _ in range(repeats)),
    }
    if cold:
        found["photo_800_cold"] = command(
            *draw, CRAYONIZE_CACHE=str(Path(folder) / "cache"), CRAYONIZE_NO_CACHE=""
        )
    return found


def _yardsticks(megapixels: float, folder: str, repeats: int) -> Figures:
    """The same strokes by kernels and by plain Python; what OpenCV does with the photo of a
    sheet.
    """
    return {
        "strokes": parts.child("strokes", 3 + repeats),
        "strokes_uncompiled": parts.child("strokes", 1, NUMBA_DISABLE_JIT="1"),
        **parts.child("filters", str(Path(folder) / f"{megapixels:g}.jpg"), repeats),
    }


def _ratios(found: Figures) -> Figures:
    """What was timed in the same run over the kernels, and under the whole of the smallest
    drawing.
    """
    first, beside = found["sheets"][0], found["yardsticks"]
    whole = first["seconds_per_mp"]["all"] * first["cells"] / 1e6
    return {
        "uncompiled_over_kernels": beside["strokes_uncompiled"] / beside["strokes"],
        "whole_over_uncompiled_strokes": whole / beside["strokes_uncompiled"],
        "whole_over_filters": whole / (beside["oil_painting"] + beside["stylization"]),
    }
