"""The table that `crayonize bench` prints."""

from collections.abc import Iterator

from .parts import STAGES, Figures


def table(found: Figures) -> str:
    """The figures for people to read."""
    return "\n".join(_lines(found))


def _lines(found: Figures) -> Iterator[str]:
    on, starts, rates, sheets = (
        found[name] for name in ("machine", "start", "cell_steps_per_second", "sheets")
    )
    yield f"crayonize {found['crayonize']}; {on['cpu']}, {on['cores']} cores; {on['system']}"
    yield f"Python {on['python']}, numpy {on['numpy']}, numba {on['numba']}, OpenCV {on['cv2']}"
    yield _row("\nwax, one thread", "with smearing", "without")
    yield _row("million cell-steps per second", *(f"{rate / 1e6:.1f}" for rate in rates.values()))
    yield _row("\nseconds per megapixel", *(f"{s['megapixels']:g} MP" for s in sheets))
    for name in (*STAGES, "all"):
        yield _row(name, *(f"{s['seconds_per_mp'][name]:.3f}" for s in sheets))
    yield _row("strokes", *(f"{s['strokes']}" for s in sheets))
    yield _row("peak memory, bytes per cell", *(f"{s['bytes_per_cell']:.0f}" for s in sheets))
    speed_up = found["threads"]["speed_up"]
    yield _row(f"\nthreads, {sheets[1]['megapixels']:g} MP", *speed_up)
    yield _row("simulation, times as fast", *(f"{ratio:.2f}" for ratio in speed_up.values()))
    yield _row("\nseconds from the shell", *(name.replace("_", " ") for name in starts))
    yield _row("", *(f"{seconds:.2f}" for seconds in starts.values()))
    yield _row("\nlive, ms from move to pixels", "min", "median", "max")
    for size, took in found["live_ms"].items():
        yield _row(f"A4, {size} cells", *(f"{ms:.2f}" for ms in took.values()))
    ratios, whole = found["ratios"], f"{sheets[0]['megapixels']:g} MP drawing over"
    yield "\nratios of times in this run"
    yield _row("eight strokes uncompiled over compiled", f"{ratios['uncompiled_over_kernels']:.0f}")
    yield _row(f"{whole} those uncompiled", f"{ratios['whole_over_uncompiled_strokes']:.2f}")
    yield _row(f"{whole} oilPainting + stylization", f"{ratios['whole_over_filters']:.2f}")


def _row(name: str, *values: str) -> str:
    return f"{name:43}" + "".join(f"{value:>15}" for value in values)
