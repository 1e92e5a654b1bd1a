"""What is told of a batch: a line a file, a bar that moves, and at the end an account of every
file.

Lines for programs go to stdout as JSON, all else to stderr. Names may hold any bytes: in JSON those
that are no UTF-8 stand as \\xff escapes, and the exact name follows in base64.
"""

import base64
import contextlib
import json
import os
import sys
import time
from collections import Counter
from collections.abc import Iterable, Iterator
from typing import Any

from stroke_gen.checks import printable

from ..machine.terminal import Bar, tell
from .job import STATUSES, Job, Outcome

_BAD = ("failed", "died", "timeout")
_EVERY = 0.1  # s between two states of the bar


class ReportError(Exception):
    """Stdout takes no more lines."""


class Report:
    """Counts every file once and tells what became of it."""

    def __init__(self, as_json: bool, quiet: bool) -> None:
        self._json, self._quiet = as_json, quiet
        self.counts = Counter(dict.fromkeys(STATUSES, 0))
        self._begun = time.monotonic()
        self._left: dict[Job, None] = {}
        self._pace = _Pace(shown=not quiet)

    def expect(self, jobs: Iterable[Job]) -> None:
        """These jobs are going to be done."""
        self._left |= dict.fromkeys(jobs)
        self._pace.total = len(self._left)

    def expecting(self, jobs: Iterator[Job | None]) -> Iterator[Job | None]:
        """The same jobs, those expected that nobody knew before."""
        for job in jobs:
            if job is not None and job not in self._left:
                self._left[job] = None
                self._pace.total += 1
            yield job

    def done(self, job: Job, outcome: Outcome) -> None:
        """Tell what became of a job."""
        del self._left[job]
        self.file(job.photo.name, outcome, job.out)
        self._pace.step(outcome.status != "ok")

    def not_run(self) -> None:
        """Tell of the jobs that were not done."""
        for job in self._left:
            self.file(job.photo.name, Outcome("not_run"), job.out)

    def others(self, others: Iterable[tuple[str, Outcome]]) -> None:
        """Tell of the files that are no jobs."""
        for name, outcome in others:
            self.file(name, outcome)

    def file(self, name: str, outcome: Outcome, out: str | None = None) -> None:
        """Tell of one file. ReportError if that is not possible."""
        self.counts[outcome.status] += 1
        if self._json:
            line: dict[str, Any] = (
                _named("in", name)
                | (_named("out", out) if out else {})
                | {"status": outcome.status}
            )
            if outcome.status == "ok":
                line |= {"strokes": outcome.strokes, "bytes": outcome.bytes}
            if outcome.seconds:
                line["seconds"] = round(outcome.seconds, 3)
            if outcome.error:
                key = "warning" if outcome.status == "ok" else "error"
                line[key] = printable(outcome.error)
            _print(json.dumps(line))
        if outcome.status in _BAD:
            self.say(f"{outcome.status}: {name}: {outcome.error}")
        elif outcome.status == "ok" and outcome.error:
            self.say(f"{name}: {outcome.error}", always=False)

    @property
    def bad(self) -> int:
        """How many files could not be drawn."""
        return sum(self.counts[status] for status in _BAD)

    def say(self, text: str, always: bool = True) -> None:
        """A line for people; if not `always`, not with --quiet."""
        if always or not self._quiet:
            self._pace.bar.clear()
            tell(f"crayonize: {printable(' '.join(text.split()))}\n")

    def listed(self, text: str) -> None:
        """A line of a list on stdout, for people; programs have their JSON there."""
        if not self._json:
            _print(printable(text))

    def end(self, code: int, reason: str = "", elsewhere: int = 0) -> None:
        """The account of all files. reason: why the run was stopped, if it was."""
        seconds = time.monotonic() - self._begun
        if self._json:
            line: dict[str, Any] = {"end": "stopped" if reason else "finished", "exit_code": code}
            line |= {"reason": reason} if reason else {}
            line |= {
                "total": self.counts.total(),
                "counts": dict(self.counts),
                "seconds": round(seconds, 3),
            }
            _print(json.dumps(line | ({"in_other_shards": elsewhere} if elsewhere else {})))
        told = [f"{n} {status.replace('_', ' ')}" for status, n in self.counts.items() if n]
        shards = f"; {elsewhere} in other shards" if elsewhere else ""
        if reason:
            self.say(f"stopped: {reason}")
        self.say(f"{', '.join(told) or 'no files'}{shards}; {_duration(seconds)}", always=False)


def _named(key: str, name: str) -> dict[str, str]:
    """A file's name for JSON."""
    raw = os.fsencode(name)
    try:
        return {key: raw.decode("utf-8")}
    except UnicodeDecodeError:
        shown = raw.decode("utf-8", "backslashreplace")
        return {key: shown, f"{key}_base64": base64.b64encode(raw).decode()}


def _print(line: str) -> None:
    """A line for programs."""
    if sys.stdout is None:
        raise ReportError("stdout is closed")
    try:
        print(line, flush=True)
    except OSError as error:
        # or what is still in its buffer would fail again at the end
        with contextlib.suppress(OSError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise ReportError(error.strerror) from error


class _Pace:
    """`[#####...............] 120 of 480 done, 2 failed, 360 left, 12 min left`, now and then."""

    def __init__(self, shown: bool) -> None:
        self.total = 0
        self.bar = Bar(shown)
        self._begun = self._last = time.monotonic()
        self._done = self._failed = 0

    def step(self, failed: bool) -> None:
        """One more is done."""
        self._done += 1
        self._failed += failed
        now = time.monotonic()
        if now - self._last < _EVERY and self._done < self.total:
            return
        self._last = now
        left = self.total - self._done
        text = f"{self._done} of {self.total} done, {self._failed} failed, {left} left"
        if left:
            text += f", {_duration((now - self._begun) / self._done * left)} left"
        self.bar.show(self._done / max(1, self.total), text)


def _duration(seconds: float) -> str:
    """Like `12 s`, `3 min` or `2 h 10 min`."""
    if seconds < 100:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 100 else f"{minutes // 60} h {minutes % 60} min"
