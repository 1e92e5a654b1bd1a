"""How much memory a drawing takes and how much there is, so that one too large is refused before any work."""

import math
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

BYTES_PER_CELL = 84  # the sheet 57; its light, or its picture on the way into a file, 12 to 24
OVERHEAD = 400_000_000  # the libraries, the photo, the planner's work, the strokes


def check_fits(rows: int, cols: int, available: int | None = None) -> None:
    """ValueError naming the figures if a sheet of rows x cols cells does not fit into memory."""
    needed = rows * cols * BYTES_PER_CELL + OVERHEAD
    free = available_bytes() if available is None else available
    if free is None or needed <= free:
        return
    shrink = math.sqrt(max(0, free - OVERHEAD) / (needed - OVERHEAD))
    fitting = int(max(rows, cols) * shrink)
    advice = f"; a size of {fitting} would fit" if fitting >= 16 else ""
    figures = f"{needed / 1e9:.1f} GB of memory, {free / 1e9:.1f} GB are free"
    raise ValueError(f"size: {cols} x {rows} cells need {figures}{advice}")


def available_bytes() -> int | None:
    """Memory that may still be taken, by the machine's count and by the limits of our control groups."""
    return min((*_of_machine(), *_of_groups()), default=None)


def _of_machine() -> Iterator[int]:
    with suppress(OSError, ValueError, IndexError):
        for line in Path("/proc/meminfo").read_text().splitlines():
            if line.startswith("MemAvailable:"):
                yield int(line.split()[1]) * 1024


def _of_groups() -> Iterator[int]:
    """What each control group around this process leaves, version 2 and version 1."""
    with suppress(OSError):
        for line in Path("/proc/self/cgroup").read_text().splitlines():
            _, controllers, group = line.split(":", 2)
            if not controllers:
                base, most, now = Path("/sys/fs/cgroup"), "memory.max", "memory.current"
            elif "memory" in controllers.split(","):
                base = Path("/sys/fs/cgroup/memory")
                most, now = "memory.limit_in_bytes", "memory.usage_in_bytes"
            else:
                continue
            inner = base / group.lstrip("/")
            for folder in (inner, *inner.parents):
                if folder.is_relative_to(base):
                    yield from _left(folder / most, folder / now, folder / "memory.stat")


def _left(most: Path, now: Path, stat: Path) -> Iterator[int]:
    """Limit less use; files held in memory are given up when memory is wanted."""
    with suppress(OSError, ValueError):  # no such file, or "max"
        limit = int(most.read_text())
        used = int(now.read_text())
        rows = dict(line.split() for line in stat.read_text().splitlines())
        yield max(0, limit - used + int(rows.get("total_inactive_file", rows.get("inactive_file", 0))))
