"""The conductor of a batch: plan, lock, draw, account."""

import os
import signal
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, replace
from pathlib import Path
from types import FrameType
from typing import Any

from . import lock, memory
from .crew import Crew, CrewError
from .job import Job, Outcome, Recipe
from .journal import Journal
from .names import check_template
from .options import Options
from .output import OutputFolder
from .plan import Plan, Planner, check_apart, entries, sources
from .report import Report, ReportError


def run(inputs: Sequence[str], output: str, options: Options, recipe: Recipe, *,
        render: str | None = None, memory_limit: int | None = None) -> int:  # fmt: skip
    """Draw all photos of folders or a list into a folder; returns the exit code.

    render: "module:function" in place of `api.sketch`, for tests.   memory_limit: bytes for all workers, in
    place of what the machine has. ValueError for what the caller can mend before anything is done; OSError if
    the output folder cannot be used. 0 all done, 1 stopped, 3 some failed, 4 another run holds the folder,
    128 + n stopped by signal n.
    """
    fields = _fields(recipe)
    check_template(options.name, fields)
    paths = sources(inputs)
    planner = Planner(output, options.name, f".{options.format}", fields, options.shard)
    plan = planner.plan(entries(paths))
    check_apart(paths, output, plan.jobs)
    report = Report(options.json, options.quiet)
    folder = OutputFolder(output, options.shard, recipe.digest(options.format))
    if options.dry_run:
        return _tell(plan, folder.journal(), options.existing, report)
    try:
        with folder.held():
            return _draw(plan, folder, options, recipe, report, render, memory_limit)
    except ReportError as error:
        report.say(f"stopped: the report cannot be written ({error})")
        return 1
    except lock.Busy:
        report.say(f"another run is at work in {output!r}; wait for its end, or choose another folder")
        return 4


def _fields(recipe: Recipe) -> dict[str, str]:
    """What a template for names may tell of the settings."""
    settings = asdict(recipe.settings)
    return {field: Path(str(settings[field])).stem for field in ("palette", "paper", "style", "seed")}


def _tell(plan: Plan, journal: Journal, existing: str, report: Report) -> int:
    """What would be done."""
    to_do = _settle(plan, journal, existing)
    _report_others(plan, report)
    for job in to_do:
        report.file(job.photo.name, Outcome("not_run"), job.out)
        report.say(f"{job.photo.name} -> {job.target}", always=False)
    report.end(0, elsewhere=plan.elsewhere)
    return 0


def _settle(plan: Plan, journal: Journal, existing: str) -> list[Job]:
    """Sort out what need not be drawn; ValueError if pictures are there that must not be."""
    to_do, there = [], []
    for job in plan.jobs:
        size = _size(job.target)
        if size is None or existing == "overwrite":
            to_do.append(job)
        elif existing == "skip" or (existing == "auto" and journal.is_done(job, size)):
            plan.others.append((job.photo.name, Outcome("skipped", "is there already")))
        elif existing == "fail":
            there.append(job.out)
        else:
            to_do.append(replace(job, strange=not journal.knows(job.out)))
    if there:
        raise ValueError(f"{len(there)} pictures are there already, such as {there[0]!r}; see --existing")
    return to_do


def _size(path: str) -> int | None:
    """Bytes of what stands at a path, None if there is nothing."""
    try:
        return os.lstat(path).st_size
    except OSError:
        return None


def _report_others(plan: Plan, report: Report) -> None:
    for name, outcome in plan.others:
        report.file(name, outcome)


def _draw(plan: Plan, folder: OutputFolder, options: Options, recipe: Recipe, report: Report,
          render: str | None, memory_limit: int | None) -> int:  # fmt: skip
    """Draw what is to be drawn, and account for every file."""
    journal = folder.journal()
    to_do = _settle(plan, journal, options.existing)
    folder.sweep({os.path.dirname(job.target) for job in plan.jobs})
    left = dict.fromkeys(to_do)
    report.expect(len(to_do))
    crew = _crew(options, recipe, folder, len(to_do), render, memory_limit)
    code, reason = 0, ""
    try:
        with _stopped_by_signals(crew) as signals:
            _report_others(plan, report)
            for job, outcome in crew.work(iter(to_do)):
                if outcome.status == "ok":
                    journal.add(job, outcome.bytes)
                del left[job]
                report.file(job.photo.name, outcome, job.out)
                report.moved(failed=outcome.status != "ok")
        if signals:
            code, reason = 128 + signals[0], signal.Signals(signals[0]).name
    except ValueError as error:
        code, reason = 2, str(error)
    except (CrewError, OSError) as error:
        code, reason = 1, str(error)
    finally:
        crew.close()
    for job in left:
        report.file(job.photo.name, Outcome("not_run"), job.out)
    code = code or (3 if report.bad else 0)
    report.end(code, reason, plan.elsewhere)
    return code


def _crew(options: Options, recipe: Recipe, folder: OutputFolder, jobs: int,
          render: str | None, memory_limit: int | None) -> Crew:  # fmt: skip
    """As many workers as are asked for, or as there are cores and memory; none of them idle."""
    available = memory.available_bytes() if memory_limit is None else memory_limit
    cores = memory.cores()
    size = options.jobs or min(cores, memory.workers(available, recipe.settings.size))
    size = max(1, min(size, jobs))
    threads = recipe.settings.threads or max(1, cores // size)
    recipe = replace(recipe, settings=replace(recipe.settings, threads=threads))
    hello: dict[str, Any] = {"recipe": recipe.to_json(), "render": render, "memory": available}
    return Crew(size, hello, options.time_limit, available, folder.clean_up)


@contextmanager
def _stopped_by_signals(crew: Crew) -> Iterator[list[int]]:
    """Let the first signal end the work soon and the second at once; yields the signals that came."""
    came: list[int] = []

    def stop(number: int, _: FrameType | None) -> None:
        came.append(number)
        crew.stop(now=len(came) > 1)

    names = ("SIGINT", "SIGTERM", "SIGHUP")
    before = {}
    with suppress(ValueError):  # not in the main thread: whoever is there will care
        before = {number: signal.signal(number, stop) for name in names if (number := getattr(signal, name, None))}
    try:
        yield came
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
