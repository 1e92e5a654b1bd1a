"""How much memory a photo takes in a worker, and how much all workers may take together."""

import os

from ..memory import BYTES_PER_CELL, OVERHEAD, available_bytes

__all__ = ["SHARE", "available_bytes", "cores", "need", "workers"]

SHARE = 0.7  # of the memory there is that several workers take together
_USUAL_PHOTO = 24_000_000  # pixels

# Bytes a pixel while a photo is decoded and turned into light, by format, measured on 100 million pixels.
_DECODING = {"JPEG": 4.5, "PNG": 4.5, "TIFF": 8.0, "WEBP": 16.0, "AVIF": 12.0, "HEIF": 12.0}


def need(format_: str, pixels: int, size: int) -> int:
    """Bytes a worker takes for a photo, drawn with `size` pixels along the long side."""
    return int(OVERHEAD + _DECODING.get(format_, 16.0) * pixels + BYTES_PER_CELL * size * size)


def workers(available: int | None, size: int) -> int:
    """How many workers may draw a usual photo at once."""
    return 512 if available is None else max(1, int(available * SHARE) // need("JPEG", _USUAL_PHOTO, size))


def cores() -> int:
    """Processor cores this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:
        return os.cpu_count() or 1
