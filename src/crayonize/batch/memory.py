"""How much memory a photo takes in a worker, and how much all workers may take together."""

from ..machine.memory import BYTES_PER_CELL, OVERHEAD, available_bytes, decoding

__all__ = ["SHARE", "available_bytes", "need", "workers"]

SHARE = 0.7  # of the memory there is that several workers take together
_USUAL_PHOTO = 24_000_000  # pixels


def need(format_: str, pixels: int, size: int, deep: bool = False) -> int:
    """Bytes a worker takes for a photo drawn with `size` pixels on the long side. deep: colour of 16 bits."""
    return OVERHEAD + decoding(format_, pixels, deep) + BYTES_PER_CELL * size * size


def workers(available: int | None, size: int) -> int:
    """How many workers may draw a usual photo at once."""
    return 512 if available is None else max(1, int(available * SHARE) // need("JPEG", _USUAL_PHOTO, size))
