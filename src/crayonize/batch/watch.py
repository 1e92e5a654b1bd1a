"""A folder under watch: a photo is drawn once it has stopped growing, and again whenever it has
changed.

By looking, not by notices of the system: these come in the midst of writing, and never from network
disks.
"""

import time
from collections.abc import Callable, Iterable, Iterator

from .existing import Existing
from .job import Found, Job, Outcome
from .plan import Planner
from .scan import Entry

EVERY = 1.0  # s between two looks
SETTLED = 2.0  # s without a change after which a photo is taken for whole

Stamp = tuple[int, str]  # size and version


class Watch:
    """What has been seen of the photos, and since when."""

    def __init__(self, look: Callable[[], Iterable[Entry]], planner: Planner, existing: Existing,
                 tell: Callable[[str, Outcome], None]) -> None:  # fmt: skip
        """look: lists the entries of the folders.   tell: takes what becomes no job."""
        self._look, self._planner, self._existing, self._tell = look, planner, existing, tell
        # photo -> its stamp, when that was first seen
        self._since: dict[str, tuple[Stamp, float]] = {}
        self._taken: dict[str, Stamp] = {}

    def jobs(self, known: Iterable[Found]) -> Iterator[Job | None]:
        """Jobs for ever, None while there is nothing to do.

        known: photos that need not be drawn.
        """
        self._taken = {photo.source: (photo.size, photo.version) for photo in known}
        while True:
            yield from self._settled()
            again = time.monotonic() + EVERY
            while time.monotonic() < again:
                yield None

    def _settled(self) -> Iterator[Job]:
        """Jobs for the photos that have been the same for a while."""
        for photo in self._look():
            if not isinstance(photo, Found):
                continue
            stamp, now = (photo.size, photo.version), time.monotonic()
            if self._taken.get(photo.source) == stamp:
                continue
            before, since = self._since.setdefault(photo.source, (stamp, now))
            if before != stamp:
                self._since[photo.source] = stamp, now
            elif now - since >= SETTLED:
                self._taken[photo.source] = stamp
                yield from self._job(photo)

    def _job(self, photo: Found) -> Iterator[Job]:
        job = self._planner.job(photo)
        if isinstance(job, str):
            self._tell(photo.name, Outcome("failed", f"{job!r} has the place of its picture"))
            return
        settled = self._existing.settle(job)
        if isinstance(settled, Job):
            yield settled
        else:
            self._tell(photo.name, settled)
