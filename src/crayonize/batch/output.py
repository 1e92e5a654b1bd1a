"""The output folder: who holds it, its journals, and the temporary files that a killed worker
left.
"""

import errno
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from stroke_gen import files

from . import lock
from .job import Job
from .journal import Journal

STATE = ".crayonize"  # folder of journals and locks


class OutputFolder:
    """Where pictures go, and what is known about them."""

    def __init__(self, path: str, shard: tuple[int, int] | None, recipe: str) -> None:
        self._state = Path(path) / STATE
        self._shard = shard and f"{shard[0]}-of-{shard[1]}"
        self._recipe = recipe

    @contextmanager
    def held(self) -> Iterator[None]:
        """Make the folder if need be and hold it against other runs; lock.Busy if one is at work
        there.
        """
        self._state.mkdir(parents=True, exist_ok=True)
        self._check()
        with lock.held(self._state, self._shard):
            yield

    def journal(self) -> Journal:
        """The journals of all runs and shards; we add to our own."""
        self._check()
        own = self._own_journal()
        others = (file for file in sorted(self._state.glob("journal*.jsonl")) if file != own)
        return Journal(own, others, self._recipe)

    def _check(self) -> None:
        if self._state.is_symlink():
            raise OSError(errno.ELOOP, "is a link to another folder; remove it", str(self._state))

    def _own_journal(self) -> Path:
        return self._state / (f"journal-{self._shard}.jsonl" if self._shard else "journal.jsonl")

    def size(self, job: Job) -> int | None:
        """Bytes of what stands at a job's target, None if there is nothing."""
        try:
            return os.lstat(job.target).st_size
        except OSError:
            return None

    def sweep(self, jobs: Iterable[Job]) -> None:
        """Remove what killed runs left behind."""
        for folder in {str(self._state.parent), *(os.path.dirname(job.target) for job in jobs)}:
            files.sweep(folder)

    def clean_up(self, job: Job, pid: int) -> None:
        """Remove what a worker left behind that was killed at a job."""
        files.sweep(os.path.dirname(job.target), pid)

    def noted(self) -> None:
        """A line was added to the journal."""

    def close(self) -> None:
        """The work is done."""
