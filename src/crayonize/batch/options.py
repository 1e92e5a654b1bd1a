"""What a user may choose for a batch.

No heavy imports: the command line reads the defaults here.
"""

from dataclasses import dataclass

from .job import TIME_LIMIT

EXISTING = ("auto", "skip", "overwrite", "fail")
FORMATS = ("png", "jpg", "webp", "tif")


@dataclass(frozen=True)
class Options:
    """How a batch is run; how its pictures are drawn is said by a Recipe."""

    jobs: int | None = None  # workers; None: as many as there are cores and memory for
    existing: str = "auto"
    name: str = "{stem}"
    format: str = "png"
    shard: tuple[int, int] | None = None  # (2, 8): the second eighth of the photos
    dry_run: bool = False
    json: bool = False
    watch: bool = False
    dask: str | None = None
    time_limit: float = TIME_LIMIT
    quiet: bool = False
