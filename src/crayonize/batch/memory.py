"""How much memory there is, and how much a photo takes."""

import os
from pathlib import Path

_SHARE = 0.7  # of the free memory that a batch uses at most

# Bytes a pixel while a photo is decoded and turned into light, by format, measured on 100 million pixels.
_DECODING = {"JPEG": 4.5, "PNG": 4.5, "TIFF": 8.0, "WEBP": 16.0, "AVIF": 12.0, "HEIF": 12.0}
_BASE = 200 << 20  # a worker with its libraries
_DRAWING = 400  # bytes a pixel of the finished picture, measured


def need(format_: str, pixels: int, size: int) -> int:
    """Bytes a worker takes for a photo, drawn with `size` pixels along the long side."""
    return int(_BASE + _DECODING.get(format_, 16.0) * pixels + _DRAWING * size * size)


def budget() -> int | None:
    """Bytes all workers together may take; None if the system does not tell."""
    known = [value for value in (_free(), *_group_limits()) if value is not None]
    return int(min(known) * _SHARE) if known else None


def _free() -> int | None:
    """Memory that can be had without swapping."""
    try:
        for line in Path("/proc/meminfo").read_text().splitlines():
            if line.startswith("MemAvailable:"):
                return int(line.split()[1]) << 10
    except OSError:
        pass
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") // 2
    except (AttributeError, ValueError, OSError):
        return None


def _group_limits() -> list[int]:
    """Limits of the control groups (containers, batch systems) that we are in, version 1 and 2."""
    try:
        lines = Path("/proc/self/cgroup").read_text().splitlines()
    except OSError:
        return []
    limits = []
    for line in lines:
        _, kinds, path = line.split(":", 2)
        if kinds not in ("", "memory"):
            continue
        root, name = ("/sys/fs/cgroup", "memory.max") if not kinds else (
            "/sys/fs/cgroup/memory", "memory.limit_in_bytes")  # fmt: skip
        for folder in (Path(root + path), Path(root)):
            try:
                limits.append(int((folder / name).read_text()))
                break
            except (OSError, ValueError):  # not there, or "max"
                continue
    return limits


def cores() -> int:
    """Processor cores this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:
        return os.cpu_count() or 1
