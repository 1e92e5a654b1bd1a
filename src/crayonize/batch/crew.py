"""The crew: worker processes that draw, and the foreman here who hands out jobs and outlives every
accident.

Each worker has one job at a time and pipes of its own, so that its death costs that one job and
nobody else's. A reader thread a worker turns all that happens into events in one inbox; only the
foreman acts on them. Time limits are kept here, by killing: nothing inside a worker that hangs
could keep them. A worker asks for memory before it opens a photo and waits until there is enough.

Messages are JSON lines: what a worker that has been taken over by a hostile photo sends is only
ever data.
"""

import contextlib
import json
import os
import queue
import signal
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Protocol

from ..machine import cores
from .job import Job, Outcome
from .memory import SHARE

START_LIMIT = 300.0  # s for a worker to come up: its libraries may lie on a slow disk
GRACE = 1.0  # s that pictures in work may still take after a stop
# for a job whose worker died; a kill comes from outside, by chance twice
RETRIES, RETRIES_IF_KILLED = 1, 2
_KILLED = -9  # exit code of a worker ended by SIGKILL
_STILLBORN = 3  # workers in a row that may die before they are ready
_TICK = 1.0  # s between two looks at an idle source of jobs

Message = dict[str, Any]


class CrewError(Exception):
    """No work is possible: workers do not come up, or no picture can be written."""


class Workers(Protocol):
    """Who does the jobs: a crew of processes here, or a cluster."""

    def work(self, jobs: Iterator[Job | None]) -> Iterator[tuple[Job, Outcome]]:
        """Do the jobs and give what became of each."""

    def stop(self, now: bool = False) -> None:
        """End soon, or now."""

    def close(self) -> None:
        """Send all home."""


@dataclass(eq=False)
class _Hand:
    """One worker process as the foreman sees it."""

    process: subprocess.Popen[bytes]
    deadline: float
    ready: bool = False
    job: Job | None = None
    started: float = 0.0
    holds: int = 0  # bytes of memory it was given

    def send(self, message: Message) -> None:
        """Send a line; if the worker is dead its end of file tells."""
        assert self.process.stdin is not None
        with contextlib.suppress(OSError):
            self.process.stdin.write(json.dumps(message).encode() + b"\n")
            self.process.stdin.flush()


@dataclass
class Crew:
    """Up to `size` workers that all know `hello`: what worker.main wants to hear first."""

    size: int
    hello: Message
    time_limit: float
    memory: int | None = None  # bytes there are; several workers together take only a share of them
    # called for the job of a killed worker
    clean_up: Callable[[Job, int], None] = lambda job, pid: None
    _hands: list[_Hand] = field(default_factory=list)
    _inbox: "queue.SimpleQueue[tuple[_Hand | None, Message | None]]" = field(
        default_factory=queue.SimpleQueue
    )
    _waiting: deque[Job] = field(default_factory=deque)
    # who waits for how many bytes, in order
    _asking: dict[_Hand, int] = field(default_factory=dict)
    _deaths: dict[Job, int] = field(default_factory=dict)
    _stillborn: int = 0
    _stop_at: float | None = None

    def work(self, jobs: Iterator[Job | None]) -> Iterator[tuple[Job, Outcome]]:
        """Do the jobs and give what became of each, as it happens.

        None among the jobs means: no job now, ask again in a second. After stop() no new job is
        begun, and those that are not done by the end of the grace are given no outcome.
        ValueError if the workers refuse the recipe, CrewError if no worker can work at all.
        """
        exhausted = False
        while True:
            exhausted = self._stop_at is not None or not self._take_in(jobs) or exhausted
            busy = [hand for hand in self._hands if hand.job]
            if exhausted and not busy and (not self._waiting or self._stop_at is not None):
                return
            self._assign()
            self._grant()
            yield from self._next_events()
            yield from self._enforce_limits()

    def stop(self, now: bool = False) -> None:
        """End soon, or now; may be called by a signal handler or another thread."""
        self._stop_at = time.monotonic() + (0 if now else GRACE)
        self._inbox.put((None, None))

    def close(self) -> None:
        """Send all workers home."""
        for hand in list(self._hands):
            self._dismiss(hand)

    def _take_in(self, jobs: Iterator[Job | None]) -> bool:
        """Take in as many jobs as there can be workers; False when there are no more."""
        while len(self._waiting) + sum(hand.job is not None for hand in self._hands) < self.size:
            try:
                job = next(jobs)
            except StopIteration:
                return False
            if job is None:
                break
            self._waiting.append(job)
        return True

    def _assign(self) -> None:
        """Give waiting jobs to idle workers, and hire for the rest."""
        if self._stop_at is not None:
            return
        idle = [hand for hand in self._hands if not hand.job]
        for _ in range(len(self._waiting) - len(idle)):
            self._hire()
        for hand in idle:
            if hand.ready and self._waiting:
                hand.job = self._waiting.popleft()
                hand.started = time.monotonic()
                hand.deadline = hand.started + self.time_limit
                hand.send({"job": asdict(hand.job)})

    def _hire(self) -> None:
        """Start a worker; if the system refuses, do with those there are.

        -P: no module is taken from the folder we stand in. A process group of its own: Ctrl-C is
        for us.
        """
        path = os.pathsep.join(str(Path(entry).absolute()) for entry in sys.path if entry)
        try:
            process = subprocess.Popen(
                [sys.executable, "-P", "-m", "crayonize.batch.worker"], process_group=0,
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                env={**os.environ, "PYTHONPATH": path},
            )  # fmt: skip
        except OSError as error:
            if not self._hands:
                raise CrewError(f"no worker can be started ({error.strerror})") from error
            self.size = len(self._hands)
            return
        hand = _Hand(process, time.monotonic() + START_LIMIT)
        self._hands.append(hand)
        hand.send({**self.hello, "parent": os.getpid()})
        try:
            threading.Thread(target=self._listen, args=(hand,), daemon=True).start()
        except RuntimeError as error:
            self._dismiss(hand)
            if not self._hands:
                raise CrewError(cores.NO_MORE) from error
            self.size = len(self._hands)

    def _listen(self, hand: _Hand) -> None:
        """Reader thread: lines into the inbox, None at the end."""
        assert hand.process.stdout is not None
        try:
            with contextlib.suppress(OSError, ValueError, RecursionError):
                for line in hand.process.stdout:
                    self._inbox.put((hand, json.loads(line)))
        finally:
            self._inbox.put((hand, None))

    def _next_events(self) -> Iterator[tuple[Job, Outcome]]:
        """Wait for an event or until something is due, and act on all that has happened."""
        dues = [hand.deadline for hand in self._hands if self._is_timed(hand)]
        if self._stop_at is not None:
            dues.append(self._stop_at)
        wait = min([due - time.monotonic() for due in dues] + [_TICK])
        with contextlib.suppress(queue.Empty):
            event = self._inbox.get(timeout=max(0.0, wait))
            while True:
                yield from self._act(*event)
                event = self._inbox.get_nowait()

    def _is_timed(self, hand: _Hand) -> bool:
        """Whether a worker has something to do by a certain time; waiting for memory is none of its
        fault.
        """
        return (hand.job is not None or not hand.ready) and hand not in self._asking

    def _act(self, hand: _Hand | None, message: Message | None) -> Iterator[tuple[Job, Outcome]]:
        if hand not in self._hands or hand is None:
            return
        match message:
            case {"ready": _}:
                hand.ready = True
                self._stillborn = 0
            case {"refused": str(reason)}:
                raise ValueError(reason)
            case {"broken": str(reason)}:
                raise CrewError(reason)
            case {"asks": int(asks)}:
                self._asking[hand] = asks
            case {"status": "ok" | "failed" as status, "error": str(error), "bytes": int(size),
                  "strokes": int(strokes)} if hand.job:  # fmt: skip
                job, hand.job, hand.holds = hand.job, None, 0
                self._deaths.pop(job, None)
                yield job, Outcome(status, error, time.monotonic() - hand.started, size, strokes)
            case _:  # the end of its pipe, or nonsense
                yield from self._bury(hand)

    def _grant(self) -> None:
        """Give memory to those who ask, first come first served; refuse what there will never
        be.
        """
        for hand, asks in list(self._asking.items()):
            fits = self.memory is None or asks <= self.memory
            given = sum(other.holds for other in self._hands)
            if fits and given and self.memory is not None and given + asks > self.memory * SHARE:
                return  # nobody overtakes, or a large photo would never have its turn
            del self._asking[hand]
            hand.holds = asks if fits else 0
            hand.deadline = time.monotonic() + self.time_limit
            hand.send({"go": fits})

    def _enforce_limits(self) -> Iterator[tuple[Job, Outcome]]:
        """Kill what is over its time."""
        now = time.monotonic()
        if self._stop_at is not None and now >= self._stop_at:
            self._waiting.clear()
            self.close()
            return
        for hand in list(self._hands):
            if not self._is_timed(hand) or now < hand.deadline:
                continue
            if hand.job:
                job = hand.job
                self._dismiss(hand)
                yield (
                    job,
                    Outcome(
                        "timeout",
                        f"not done within {self.time_limit:g} s (--time-limit)",
                        now - hand.started,
                    ),
                )
            else:
                yield from self._bury(hand)

    def _bury(self, hand: _Hand) -> Iterator[tuple[Job, Outcome]]:
        """A worker has died: its job gets another chance, or is given up."""
        job = hand.job
        with contextlib.suppress(subprocess.TimeoutExpired):
            hand.process.wait(0.5)  # its pipe ends a little before it does
        code = self._dismiss(hand)
        if not hand.ready:
            self._stillborn += 1
            if self._stillborn >= _STILLBORN:
                raise CrewError(f"{_STILLBORN} workers in a row did not come up ({_cause(code)})")
        if job is None:
            return
        deaths = self._deaths[job] = self._deaths.get(job, 0) + 1
        if deaths > (RETRIES_IF_KILLED if code == _KILLED else RETRIES):
            del self._deaths[job]
            yield job, Outcome("died", f"{deaths} workers died of it ({_cause(code)})",
                               time.monotonic() - hand.started)  # fmt: skip
        else:
            self._waiting.appendleft(job)

    def _dismiss(self, hand: _Hand) -> int:
        """End a worker, whatever it is doing; its exit code."""
        hand.process.kill()
        code = hand.process.wait()
        self._hands.remove(hand)
        self._asking.pop(hand, None)
        assert hand.process.stdin is not None
        with contextlib.suppress(OSError):
            hand.process.stdin.close()
        if hand.job:
            self.clean_up(hand.job, hand.process.pid)
        return code


def _cause(code: int) -> str:
    """An exit code in words."""
    if code >= 0:
        return f"exit code {code}"
    try:
        name = signal.Signals(-code).name
    except ValueError:
        name = f"signal {-code}"
    return f"{name}, perhaps out of memory" if name == "SIGKILL" else name
