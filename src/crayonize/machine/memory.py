"""How much memory a drawing takes and how much there is, so that one too large is refused before
any work.
"""

import ctypes
import math
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

# of a photo; more is refused before decoding: 250 million pixels decode into about 1 GB
MAX_PIXELS = 250_000_000
# the sheet 57, its picture 3, which takes 2 (PNG) to 16 (WebP) more on its way into a file
BYTES_PER_CELL = 75
BYTES_PER_FILMED_CELL = 12  # the light on the sheet, which is kept while it is filmed
OVERHEAD = 320_000_000  # the libraries, the reduced photo, the planner's work, the strokes

# Bytes a pixel while a photo is decoded and reduced, measured on 50 million pixels. Colour of 16
# bits is decoded twice.
_DECODING = {"JPEG": 7, "MPO": 7, "PNG": 7, "TIFF": 7, "WEBP": 16, "AVIF": 10, "HEIF": 10}
_DEEP = 18

_BUFFERS = 512 << 20  # address space that threads and allocators reserve without using it
_M_ARENA_MAX = -8  # of glibc's malloc.h


def decoding(format_: str | None, pixels: int, deep: bool = False) -> int:
    """Bytes taken, before there is a sheet, to read a photo.

    deep: colour of 16 bits. No format: it has been read.
    """
    if format_ is None:
        return 0
    return (_DEEP if deep else _DECODING.get(format_, _DEEP)) * pixels


def check_fits(
    rows: int, cols: int, *, photo: int = 0, filmed: bool = False, available: int | None = None
) -> None:
    """ValueError naming the figures if a drawing on a sheet of rows x cols cells does not fit into
    memory.

    photo: bytes that reading the photo takes.   available: bytes, if not what the machine has.
    """
    free = available_bytes() if available is None else available
    if free is None:
        return
    if OVERHEAD + photo > free:
        raise ValueError(f"the photo needs {_figures(OVERHEAD + photo, free)}; reduce it first")
    per_cell = BYTES_PER_CELL + BYTES_PER_FILMED_CELL * filmed
    if OVERHEAD + rows * cols * per_cell > free:
        fitting = int(max(rows, cols) * math.sqrt((free - OVERHEAD) / (rows * cols * per_cell)))
        advice = f"; a size of {fitting} would fit" if fitting >= 16 else ""
        raise ValueError(
            f"size: {cols} x {rows} cells need "
            f"{_figures(OVERHEAD + rows * cols * per_cell, free)}{advice}"
        )


def _figures(needed: int, free: int) -> str:
    return f"{needed / 1e9:.1f} GB of memory, {free / 1e9:.1f} GB are free"


def share_heaps() -> None:
    """Let all threads take memory from two heaps; a system without such a choice is left as it is.

    The C library of Linux has eight heaps a core, and what one thread has given back no other gets:
    a picture on four cores takes 60 MB more, in the same time.
    """
    with suppress(AttributeError, OSError, TypeError):
        ctypes.CDLL(None).mallopt(_M_ARENA_MAX, 2)


def limit_addresses(most: int | None) -> None:
    """Let this process take so many bytes more, that what takes too much ends in a MemoryError and
    not with the machine (Linux).

    To be called after the libraries are loaded: some crash when they are loaded under a limit.
    """
    if most is None or sys.platform != "linux":
        return
    import resource

    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    hard = resource.getrlimit(resource.RLIMIT_AS)[1]
    wanted = used + most + _BUFFERS
    if hard != resource.RLIM_INFINITY:
        wanted = min(wanted, hard)
    resource.setrlimit(resource.RLIMIT_AS, (wanted, hard))


def available_bytes() -> int | None:
    """Memory that may still be taken, by the machine's count and the limits that we are under."""
    return min((*_of_machine(), *_of_process(), *_of_groups()), default=None)


def _of_machine() -> Iterator[int]:
    with suppress(OSError, ValueError, IndexError):
        for line in Path("/proc/meminfo").read_text().splitlines():
            if line.startswith("MemAvailable:"):
                yield int(line.split()[1]) * 1024


def _of_process() -> Iterator[int]:
    """What `ulimit -v` leaves of the addresses."""
    with suppress(ImportError, OSError):  # another system
        import resource

        most = resource.getrlimit(resource.RLIMIT_AS)[0]
        used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        if most != resource.RLIM_INFINITY:
            yield max(0, most - used)


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
        yield max(
            0, limit - used + int(rows.get("total_inactive_file", rows.get("inactive_file", 0)))
        )
