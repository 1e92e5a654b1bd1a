"""The parts of the benchmark, each run in a process of its own: `python -m crayonize.bench.parts
PART ARGUMENTS`.

So none finds memory or caches as another has left them. The photo is made here. A cell-step is one
cell under the tip at one contact; tips are 24 cells wide.
"""

import json
import math
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..machine import cores

if TYPE_CHECKING:
    from stroke_gen.drawing import Drawing, Stroke

    from ..pipeline import Easel

CELL_MM = 297 / 1600  # of all sheets: larger pictures are drawn on larger sheets
TIP_CELLS = 24
FORCE_N_MM2 = 0.38  # a firm stroke
STAGES = ("reading", "paper", "planning", "simulation", "looking", "rendering", "writing")

Figures = dict[str, Any]


def machine() -> Figures:
    """What all this runs on."""
    import platform

    import cv2
    import numba
    import numpy as np

    return {
        "cpu": _cpu(),
        "cores": cores.allowed(),
        "system": platform.platform(terse=True),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "numba": numba.__version__,
        "cv2": cv2.__version__,
    }


def photo(path: str, megapixels: float) -> None:
    """Write a picture that has what photos have: a sky, a sun, hills, a meadow, things with edges,
    and grain.
    """
    import cv2
    import numpy as np

    from ..images.write import write_image

    wide, high = _sides(megapixels)
    rng = np.random.default_rng(1)
    y, x = np.mgrid[:high, :wide].astype(np.float32) / np.float32(high)
    picture = np.stack([120 + 100 * y, 170 + 60 * y, 235 - 20 * y], -1)
    picture[np.hypot(x - 1.15, y - 0.22) < 0.1] = 252, 214, 96
    for ground, colour in ((0.48, (96, 112, 150)), (0.6, (70, 110, 70)), (0.74, (128, 150, 52))):
        picture[y > ground + 0.06 * np.sin(5 * x + 30 * ground) + 0.01 * np.sin(31 * x)] = colour
    picture[(np.abs(x - 0.45) < 0.16) & (np.abs(y - 0.7) < 0.1)] = 196, 92, 60
    picture[(np.abs(x - 0.45) < 1.3 * (y - 0.45)) & (y < 0.6)] = 90, 40, 44
    picture[np.hypot(x - 0.95, y - 0.62) < 0.13] = 36, 84, 40
    for cells in (24, 160):  # patches of light and shade, and blades of grass
        patches = rng.normal(0, 1, (cells, 3 * cells // 2)).astype(np.float32)
        picture *= (
            1
            + 0.1
            * y[..., None]
            * cv2.resize(patches, (wide, high), interpolation=cv2.INTER_CUBIC)[..., None]
        )
    picture += rng.normal(0, 3, (high, wide, 1)).astype(np.float32)
    write_image(path, np.clip(picture, 0, 255).astype(np.uint8))


def rubbing(side: int, repeats: int) -> Figures:
    """Cell-steps per second of one thread, with and without smearing, on a sheet of side x side
    cells.
    """
    return {
        # the first one loads the kernels
        name: max(_rubbed(side, smears) for _ in range(repeats + 1))
        for name, smears in (("smearing", True), ("without_smearing", False))
    }


def sheet(megapixels: float, folder: str, repeats: int) -> Figures:
    """Seconds per megapixel of each stage from photo to picture, and the memory a cell takes at
    most.
    """
    from stroke_gen.drawing_file import save_drawing

    given, small = Path(folder) / f"{megapixels:g}.jpg", Path(folder) / "small.jpg"
    for path, mp in ((given, megapixels), (small, 0.01)):
        child("photo", str(path), mp)
    _staged(small, 0.01)  # loads the kernels
    before = _peak_bytes()
    seconds, drawing = _staged(given, megapixels)
    taken = _peak_bytes() - before
    for _ in range(repeats - 1):
        seconds = min(seconds, _staged(given, megapixels)[0], key=lambda took: sum(took.values()))
    save_drawing(drawing, given.with_suffix(".json"))
    cells = math.prod(_sides(megapixels))
    per_mp = {name: 1e6 * s / cells for name, s in seconds.items()}
    return {"megapixels": megapixels, "cells": cells, "strokes": len(drawing.strokes),
            "seconds_per_mp": per_mp | {"all": sum(per_mp.values())},
            "bytes_per_cell": taken / cells}  # fmt: skip


def threads(megapixels: float, folder: str, repeats: int) -> Figures:
    """How much sooner the strokes of `sheet` are drawn by several threads."""
    from stroke_gen.drawing_file import load_drawing

    from .. import api

    drawing = load_drawing(Path(folder) / f"{megapixels:g}.json")
    most = cores.allowed()
    counts = [n for n in (2**i for i in range(10)) if n < most] + [most]

    def drawn(number: int) -> float:
        stand = api.workshop().easel(drawing, _sides(megapixels)[0], number)
        return seconds_of(lambda: stand.draw(drawing.strokes))

    _rubbed(100, True)  # loads the kernels
    seconds = {str(n): min(drawn(n) for _ in range(repeats)) for n in counts}
    return {"seconds": seconds, "speed_up": {n: seconds["1"] / s for n, s in seconds.items()}}


def live(size: int, moves: int) -> Figures:
    """Milliseconds from a move of 20 cells to the pixels it changes, on an A4 sheet."""
    import numpy as np

    from stroke_gen.drawing import Drawing, Tip

    from .. import Live

    hand, cell_mm = Live(Drawing(297.0, 210.0, "drawing", "box24", ()), size), 297 / size
    tip, rng = Tip("blunt", TIP_CELLS * cell_mm), np.random.default_rng(0)
    took = []
    for number in range(moves):
        if number % 10 == 0:
            x, y, way = rng.uniform(80, 217), rng.uniform(60, 150), rng.uniform(0, 2 * math.pi)
            hand.press(x, y, 2.0, ("red", "blue", "yellow")[number // 10 % 3], tip)
        way += rng.normal(0, 0.3)
        x, y = x + 20 * cell_mm * math.cos(way), y + 20 * cell_mm * math.sin(way)
        took.append(1000 * seconds_of(partial(hand.move, x, y, 2.0)))
        if number % 10 == 9:
            hand.lift()
    return {"min": min(took), "median": float(np.median(took)), "max": max(took)}


def strokes(repeats: int) -> float:
    """Seconds for eight short strokes across each other."""
    side, tops = 4 * TIP_CELLS, (30, 40, 50, 60)
    lines = [[(36, top), (60, top)] for top in tops] + [[(top, 36), (top, 60)] for top in tops]

    def drawn() -> float:
        stand = _blank(side)
        return seconds_of(
            partial(stand.draw, [_stroke(line, stand, i) for i, line in enumerate(lines)])
        )

    return min(drawn() for _ in range(repeats))


def filters(path: str, repeats: int) -> Figures:
    """Seconds that OpenCV takes for its two nearest relatives."""
    import cv2

    picture = cv2.cvtColor(cv2.imread(path), cv2.COLOR_BGR2RGB)  # type: ignore[arg-type]
    return {
        "oil_painting": min(
            seconds_of(lambda: cv2.xphoto.oilPainting(picture, 7, 1)) for _ in range(repeats)
        ),
        "stylization": min(seconds_of(lambda: cv2.stylization(picture)) for _ in range(repeats)),
    }


PARTS: dict[str, Callable[..., Any]] = {
    part.__name__: part
    for part in (machine, photo, rubbing, sheet, threads, live, strokes, filters)
}


# ---- what the parts share ------------------------------------------------------------------------


def child(part: str, *given: Any, **environment: str) -> Any:
    """What a part returns, run in a process of its own."""
    command = [sys.executable, "-m", "crayonize.bench.parts", part, json.dumps(given)]
    run = subprocess.run(command, env=os.environ | environment, capture_output=True, text=True)
    if run.returncode:
        raise RuntimeError(f"bench: {part}: {(run.stderr.strip().splitlines() or ['ended'])[-1]}")
    return json.loads(run.stdout)


class _Clock:
    """Where the time from photo to picture goes; an Onlooker, to know one stage from the next."""

    def __init__(self) -> None:
        self.seconds = dict.fromkeys(STAGES, 0.0)
        self._now, self._since = STAGES[0], time.perf_counter()

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Count time as that of a stage; what interrupts another stage is not counted twice."""
        outer = self._now
        self._turn(name)
        yield
        self._turn(outer)

    def open(self, easel: "Easel") -> None:
        """The paper is made; all that is not done by the easel from now on is planning."""
        self._turn("planning")
        for name, stage in (
            ("draw", "simulation"),
            ("seen", "looking"),
            ("picture_srgb", "rendering"),
        ):
            setattr(easel, name, self._timed(stage, getattr(easel, name)))

    def strokes(self, strokes: "Sequence[Stroke]", share: float) -> None:
        """Each stroke does not matter."""

    def _timed(self, stage: str, act: Callable[..., Any]) -> Callable[..., Any]:
        def timed(*given: Any, **options: Any) -> Any:
            with self.stage(stage):
                return act(*given, **options)

        return timed

    def _turn(self, name: str) -> None:
        now = time.perf_counter()
        self.seconds[self._now] += now - self._since
        self._now, self._since = name, now


def _staged(path: Path, megapixels: float) -> "tuple[dict[str, float], Drawing]":
    """Draw a photo: seconds of each stage, and the strokes."""
    from .. import api
    from ..images.read import read_linear
    from ..images.write import write_image
    from ..settings import Settings

    workshop = api.workshop()
    side = _sides(megapixels)[0]
    clock = _Clock()
    given = read_linear(path, api.PHOTO_SIDE)
    with clock.stage("paper"):
        drawing, easel = workshop.sketch(
            given, Settings(size=side, sheet_mm=side * CELL_MM), None, clock
        )
    picture = easel.picture_srgb()
    with clock.stage("writing"):
        write_image(path.with_suffix(".png"), picture)
    return clock.seconds, drawing


def _rubbed(side: int, smears: bool) -> float:
    """Cell-steps per second: two coats of lines, the second across the first."""
    from ..wax import tip

    stand, edge = _blank(side, smears), TIP_CELLS
    ways = range(edge, side - edge + 1, round(0.62 * TIP_CELLS))
    lines = [[(edge, y), (side - edge, y)] for y in ways] + [
        [(x, edge), (x, side - edge)] for x in ways
    ]
    drawn = [_stroke(line, stand, i // len(ways)) for i, line in enumerate(lines)]
    seconds = seconds_of(lambda: stand.draw(drawn))
    mask = stand.box.masks[0]
    stride = max(1, stand.box.constants.step * TIP_CELLS)
    contacts = len(lines) * round((side - 2 * edge) / stride)
    return contacts * int((mask < tip.ABSENT).sum()) / seconds


def _blank(side: int, smears: bool = True) -> "Easel":
    """A blank sheet of side x side cells, drawn on by one thread."""
    from stroke_gen.drawing import Drawing

    from .. import api

    mm = side * CELL_MM
    stand: Easel = api.workshop().easel(Drawing(mm, mm, "drawing", "box24", ()), side, 1, smears)
    return stand


def _stroke(cells: Sequence[tuple[float, float]], stand: "Easel", crayon: int) -> "Stroke":
    """A stroke over points in cells, with one crayon of the box."""
    import numpy as np

    from stroke_gen.drawing import Stroke, Tip

    tip = Tip("blunt", TIP_CELLS * CELL_MM)
    force = np.full(len(cells), FORCE_N_MM2 * math.pi / 4 * tip.width_mm**2, np.float32)
    return Stroke(
        np.array(cells, np.float32) * np.float32(CELL_MM),
        force,
        stand.box.palette.crayons[crayon].name,
        tip,
    )


def seconds_of(act: Callable[[], object]) -> float:
    """How long something takes."""
    begun = time.perf_counter()
    act()
    return time.perf_counter() - begun


def _sides(megapixels: float) -> tuple[int, int]:
    """Width and height in cells of a picture three to two."""
    high = round(math.sqrt(megapixels * 1e6 / 1.5))
    return round(1.5 * high), high


def _cpu() -> str:
    """Model of the processor."""
    import platform

    with suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def _peak_bytes() -> int:
    """The most memory this process has held so far; 0 where the system does not tell."""
    with suppress(OSError):
        for line in Path("/proc/self/status").read_text().splitlines():
            # unlike ru_maxrss it leaves out the process that started this one
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) * 1024
    with suppress(ImportError):
        import resource

        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (
            1 if sys.platform == "darwin" else 1024
        )
    return 0


if __name__ == "__main__":
    print(json.dumps(PARTS[sys.argv[1]](*json.loads(sys.argv[2]))))
