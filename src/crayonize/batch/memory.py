"""How much memory a photo takes in a worker, and how much all workers may take together."""

from ..machine.memory import BYTES_PER_CELL, OVERHEAD, available_bytes, decoding

__all__ = ["SHARE", "available_bytes", "decoding", "need", "workers"]

SHARE = 0.7  # of the memory there is that several workers take together
_USUAL_PHOTO = 24_000_000  # pixels


def need(photo: int, size: int, preview: bool = False) -> int:
    """Bytes a worker takes for a drawing of `size` pixels a side, and `photo` for reading the
    photo.
    """
    cells = (size // 2 if preview else size) ** 2
    return OVERHEAD + photo + BYTES_PER_CELL * cells


def workers(available: int | None, size: int) -> int:
    """How many workers may draw a usual photo at once."""
    return (
        512
        if available is None
        else max(1, int(available * SHARE) // need(decoding("JPEG", _USUAL_PHOTO), size))
    )
