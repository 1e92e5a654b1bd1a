"""The conductor of a batch: plan, lock, draw, account; and what Ctrl-C does to it."""

import signal
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path, PurePath
from types import FrameType
from typing import Any

from ..machine import cores
from . import lock, memory
from .cluster import Cluster
from .crew import Crew, CrewError, Workers
from .existing import Existing
from .job import Job, Outcome, Recipe
from .journal import Journal
from .names import check_template
from .options import Options
from .output import OutputFolder
from .plan import Plan, Planner, check_apart, entries, sources
from .remote import RemoteFolder, SendError, is_remote
from .report import Report, ReportError
from .scan import NO_PHOTO
from .watch import Watch


def run(
    inputs: Sequence[str],
    output: str,
    options: Options,
    recipe: Recipe,
    *,
    render: str | None = None,
    memory_limit: int | None = None,
) -> int:
    """Draw all photos of folders or a list into a folder; returns the exit code.

    render: "module:function" in place of `api.sketch`, for tests.   memory_limit: bytes for all
    workers, in place of what the machine has. ValueError for what the caller can mend before
    anything is done, OSError if the output folder cannot be used, ImportError for an extra that is
    missing. 0 all done, 1 stopped, 3 some failed, 4 another run holds the folder, 128 + n stopped
    by signal n.
    """
    fields = _fields(recipe)
    check_template(options.name, fields)
    paths = sources(inputs)
    planner = Planner(output, options.name, f".{options.format}", fields, options.shard)
    plan = planner.plan(entries(paths))
    check_apart(paths, output, plan.jobs)
    report = Report(options.json, options.quiet)
    make_folder = RemoteFolder if is_remote(output) else OutputFolder
    folder = make_folder(output, options.shard, recipe.digest(options.format))
    if not options.watch and (reason := _no_photos(plan)):
        report.others(plan.others)
        report.end(2, reason)
        return 2
    if options.dry_run:
        existing = Existing(options.existing, folder.journal(), folder.size)
        return _tell(plan, existing.settle_all(plan), report)
    try:
        with folder.held():
            existing = Existing(options.existing, folder.journal(), folder.size)
            to_do = existing.settle_all(plan)
            folder.sweep(plan.jobs)
            crew = _workers(options, recipe, folder, len(to_do), render, memory_limit)
            jobs: Iterator[Job | None] = iter(to_do)
            if options.watch:
                done = {job.photo for job in plan.jobs} - {job.photo for job in to_do}
                jobs = Watch(lambda: entries(paths), planner, existing, report.file).jobs(done)
            else:
                report.expect(to_do)
            return _draw(crew, jobs, plan, folder, existing.journal, report)
    except ReportError as error:
        report.say(f"stopped: the report cannot be written ({error})")
        return 1
    except lock.Busy:
        report.say(
            f"another run is at work in {output!r}; wait for its end, or choose another folder"
        )
        return 4


def _fields(recipe: Recipe) -> dict[str, str]:
    """What a template for names may tell of the settings."""
    settings = recipe.settings.plain()
    if isinstance(settings["style"], dict):
        settings["style"] = settings["style"].get("extends", "custom")
    return {
        field: Path(str(settings[field])).stem for field in ("palette", "paper", "style", "seed")
    }


def _no_photos(plan: Plan) -> str:
    """What there is instead, if there is nothing but files of kinds that are not read."""
    ends = {PurePath(name).suffix.lower() or "none" for name, why in plan.others if why == NO_PHOTO}
    if plan.jobs or plan.elsewhere or not ends:
        return ""
    return (
        f"there is no photo here that can be read, only files that end in {', '.join(sorted(ends))}"
        "; JPEG, PNG, WebP, TIFF, AVIF and HEIC are read"
    )


def _tell(plan: Plan, to_do: Sequence[Job], report: Report) -> int:
    """What would be done."""
    report.others(plan.others)
    for job in to_do:
        report.file(job.photo.name, Outcome("not_run"), job.out)
        report.listed(f"{job.photo.name} -> {job.target}")
    report.end(0, elsewhere=plan.elsewhere)
    return 0


def _draw(
    crew: Workers,
    jobs: Iterator[Job | None],
    plan: Plan,
    folder: OutputFolder,
    journal: Journal,
    report: Report,
) -> int:
    """Draw what is to be drawn, and account for every file."""
    code, reason = 0, ""
    try:
        with _stopped_by_signals(crew) as signals:
            report.others(plan.others)
            for job, outcome in crew.work(report.expecting(jobs)):
                if outcome.status == "ok":
                    journal.add(job, outcome.bytes)
                    folder.noted()
                report.done(job, outcome)
        if signals:
            code, reason = 128 + signals[0], signal.Signals(signals[0]).name
        folder.close()
    except ValueError as error:
        code, reason = 2, str(error)
    except (CrewError, SendError, OSError) as error:
        code, reason = 1, str(error)
    finally:
        crew.close()
    report.not_run()
    code = code or (3 if report.bad else 0)
    report.end(code, reason, plan.elsewhere)
    return code


def _workers(options: Options, recipe: Recipe, folder: OutputFolder, jobs: int,
             render: str | None, memory_limit: int | None) -> Workers:  # fmt: skip
    """A cluster, or as many workers here as are asked for, or as there are cores and memory; none
    idle.
    """
    if options.dask:
        return Cluster(options.dask, recipe, render, options.time_limit)
    available = memory.available_bytes() if memory_limit is None else memory_limit
    count = cores.allowed()
    size = options.jobs or min(count, memory.workers(available, recipe.settings.size))
    size = size if options.watch else max(1, min(size, jobs))
    threads = recipe.settings.threads or max(1, count // size)
    recipe = replace(recipe, settings=replace(recipe.settings, threads=threads))
    hello: dict[str, Any] = {"recipe": recipe.to_json(), "render": render, "memory": available}
    return Crew(size, hello, options.time_limit, available, folder.clean_up)


@contextmanager
def _stopped_by_signals(crew: Workers) -> Iterator[list[int]]:
    """Let the first signal end the work soon and the second at once; yields the signals that
    came.
    """
    came: list[int] = []

    def stop(number: int, _: FrameType | None) -> None:
        came.append(number)
        crew.stop(now=len(came) > 1)

    names = ("SIGINT", "SIGTERM", "SIGHUP")
    before = {}
    with suppress(ValueError):  # not in the main thread: whoever is there will care
        before = {
            number: signal.signal(number, stop)
            for name in names
            if (number := getattr(signal, name, None))
        }
    try:
        yield came
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
