"""The same jobs on a Dask cluster whose machines see the same folders.

The cluster only carries jobs and outcomes. On each machine a crew of one worker draws, so that time
limits, memory limits and crashes are what they are at home; a machine that is lost has its jobs
done by another.
"""

import json
import logging
import os
import queue
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict, replace
from importlib import import_module
from pathlib import Path
from typing import Any

from .crew import GRACE, Crew, CrewError, Message
from .job import Found, Job, Outcome, Recipe
from .memory import available_bytes
from .output import OutputFolder
from .remote import is_remote

_CONNECTING = 10.0  # s
_AHEAD = 2  # jobs sent for each thread of the cluster
_LOST = 60.0  # s without a cluster after which it is given up

_crews: dict[tuple[str, int], Crew] = {}  # on the cluster: recipe and thread -> crew


def draw(hello: Message, time_limit: float, plain: dict[str, Any]) -> dict[str, Any]:
    """On the cluster: do one job. Raises CrewError if no job can be done there."""
    key = json.dumps(hello, sort_keys=True), threading.get_ident()
    if key not in _crews:
        available = available_bytes()
        _crews[key] = Crew(1, {**hello, "memory": available}, time_limit, available, _clean_up)
    job = Job(**{**plain, "photo": Found(**plain["photo"])})
    return next(asdict(outcome) for _, outcome in _crews[key].work(iter([job])))


def _clean_up(job: Job, pid: int) -> None:
    OutputFolder(os.path.dirname(job.target), None, "").clean_up(job, pid)


def send_home() -> None:
    """On the cluster: end all workers."""
    while _crews:
        _crews.popitem()[1].close()


class Cluster:
    """Stands where a Crew stands, and has a cluster do the work."""

    def __init__(self, address: str, recipe: Recipe, render: str | None, time_limit: float) -> None:
        """Connect. ImportError names what to install, OSError if nobody answers."""
        try:
            distributed: Any = import_module("distributed")
        except ImportError as error:
            raise ImportError('--dask needs more: pip install distributed') from error
        for name in (
            "distributed.client",
            "distributed.comm",
            "distributed.batched",
        ):  # what matters is told by us
            logging.getLogger(name).setLevel(logging.CRITICAL)
        self._client = distributed.Client(address, timeout=_CONNECTING, set_as_default=False)
        self._hello: Message = {"recipe": _absolute_files(recipe).to_json(), "render": render}
        self._time_limit = time_limit
        # futures that are done, or None to look up
        self._inbox: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._stop_at: float | None = None
        self._whole = True  # nothing was lost or broken off

    def work(self, jobs: Iterator[Job | None]) -> Iterator[tuple[Job, Outcome]]:
        """Do the jobs and give what became of each; as Crew.work."""
        pending: dict[Any, Job] = {}
        lost_since = None
        exhausted = False
        while True:
            exhausted = self._stop_at is not None or not self._send(jobs, pending) or exhausted
            if (exhausted and not pending) or (
                self._stop_at is not None and time.monotonic() > self._stop_at
            ):
                return
            try:
                future = self._inbox.get(timeout=1.0 if self._stop_at is None else 0.1)
            except queue.Empty:
                lost_since = (
                    None if self._client.status == "running" else lost_since or time.monotonic()
                )
                if self._client.status == "closed" or (
                    lost_since and time.monotonic() - lost_since > _LOST
                ):
                    raise self._lost() from None
                continue
            if future in pending:
                yield pending.pop(future), self._outcome(future)

    def _send(self, jobs: Iterator[Job | None], pending: dict[Any, Job]) -> bool:
        """Send some jobs ahead; False when there are no more."""
        try:
            threads = sum(self._client.nthreads().values())
        except OSError as error:
            raise self._lost() from error
        while len(pending) < _AHEAD * max(1, threads):
            try:
                job = next(jobs)
            except StopIteration:
                return False
            if job is None:
                break
            future = self._client.submit(
                draw, self._hello, self._time_limit, asdict(_absolute(job)), pure=False
            )
            pending[future] = job
            future.add_done_callback(self._inbox.put)
        return True

    def _outcome(self, future: Any) -> Outcome:
        """What became of a job; CrewError if the cluster can do none."""
        try:
            return Outcome(**future.result())
        except import_module("distributed").KilledWorker:
            return Outcome("died", "several machines or workers of the cluster died of it")
        except Exception as error:  # whatever a cluster of another version may raise
            lost = isinstance(error, OSError) or self._client.status != "running"
            raise (
                self._lost() if lost else CrewError(f"the cluster cannot draw: {error}")
            ) from error

    def _lost(self) -> CrewError:
        self._whole = False
        return CrewError("the cluster is lost; run the same again when it is back")

    def stop(self, now: bool = False) -> None:
        """End soon, or now. Pictures in work on the cluster are finished there."""
        self._whole = False
        self._stop_at = time.monotonic() + (0 if now else GRACE)
        self._inbox.put(None)

    def close(self) -> None:
        """Let the cluster go."""
        with suppress(OSError):
            if self._whole:
                self._client.run(send_home)
            self._client.close(timeout=5)


def _absolute_files(recipe: Recipe) -> Recipe:
    """The same recipe for someone who stands in another folder; one thread a job if nothing else is
    said.
    """
    changes: dict[str, Any] = {"threads": recipe.settings.threads or 1}
    for name in ("palette", "paper", "style"):
        value = getattr(recipe.settings, name)
        if isinstance(value, str) and Path(value).is_file():
            changes[name] = str(Path(value).absolute())
    return replace(recipe, settings=replace(recipe.settings, **changes))


def _absolute(job: Job) -> Job:
    """The same job for someone who stands in another folder."""
    source, target = job.photo.source, job.target
    photo = replace(job.photo, source=source if is_remote(source) else str(Path(source).absolute()))
    return replace(
        job, photo=photo, target=target if is_remote(target) else str(Path(target).absolute())
    )
