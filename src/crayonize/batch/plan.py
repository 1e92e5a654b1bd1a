"""What is to be done: which photos are meant, and where each picture goes.

Nothing is written here.
"""

import glob
import os
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from . import remote
from .job import Found, Job, Outcome
from .names import Places, clashes_text, folded, picture_name
from .remote import is_remote
from .scan import Entry, found, scan


@dataclass
class Plan:
    """Jobs in order, and what became at once of everything else."""

    jobs: list[Job] = field(default_factory=list)
    others: list[tuple[str, Outcome]] = field(default_factory=list)
    elsewhere: int = 0  # photos of other shards


class Planner:
    """Gives each photo its place; the same names lead to the same places on any machine."""

    def __init__(self, output: str, template: str, suffix: str, fields: dict[str, str],
                 shard: tuple[int, int] | None) -> None:  # fmt: skip
        self._output, self._template, self._suffix, self._fields = output, template, suffix, fields
        self._shard = shard
        self._places = Places()

    def plan(self, entries: Iterator[Entry]) -> Plan:
        """A plan for all entries; ValueError if two pictures would have the same place."""
        plan, clashes = Plan(), []
        for entry in entries:
            if not isinstance(entry, Found):
                plan.others.append(entry)
                continue
            job = self.job(entry)
            if isinstance(job, str):
                clashes.append((job, entry.source, self._out(entry)))
            elif self._is_ours(entry.place):
                plan.jobs.append(job)
            else:
                plan.elsewhere += 1
        if clashes:
            raise ValueError(clashes_text(clashes))
        return plan

    def job(self, photo: Found) -> Job | str:
        """The job for a photo, or the path of the photo that has its place already."""
        out = self._out(photo)
        return self._places.take(out, photo.source) or Job(
            photo, out, os.path.join(self._output, out)
        )

    def _out(self, photo: Found) -> str:
        return picture_name(photo.place, self._template, self._suffix, self._fields)

    def _is_ours(self, place: str) -> bool:
        """Whether a photo belongs to our shard, by its place alone: whatever else comes or goes
        beside it.
        """
        if self._shard is None:
            return True
        part, parts = self._shard
        return zlib.crc32(os.fsencode(place)) % parts == part - 1


def sources(inputs: Sequence[str]) -> list[str]:
    """The folders and files that are meant, each once. What no shell has replaced (*.jpg) is
    replaced here.

    ValueError for what is not there.
    """
    paths: dict[str, str] = {}
    for given in inputs:
        matches = (
            [given] if is_remote(given) or os.path.lexists(given) else sorted(glob.glob(given))
        )
        if not matches:
            raise ValueError(f"{given!r}: there is no such file or folder")
        for path in matches:
            paths.setdefault(path if is_remote(path) else _full(path), path)
    return list(paths.values())


def entries(paths: Sequence[str]) -> Iterator[Entry]:
    """All entries of the sources.

    One folder is mirrored itself; one among several under its own name.
    """
    for path in paths:
        own_name = os.path.basename(_full(path))
        if not (is_remote(path) or os.path.isdir(path)):
            yield _named_file(path, own_name)
            continue
        prefix = "" if len(paths) == 1 else f"{own_name}/"
        for entry in remote.scan(path) if is_remote(path) else scan(path):
            if isinstance(entry, Found):
                yield replace(entry, name=prefix + entry.name, place=prefix + entry.place)
            else:
                yield prefix + entry[0], entry[1]


def _place(path: str) -> str:
    """Where a path lies, itself perhaps a link."""
    return os.path.join(os.path.realpath(os.path.dirname(path)), os.path.basename(path))


def _full(path: str) -> str:
    """A path without dots, its links as they are."""
    return os.path.normpath(Path(path).absolute())


def _named_file(path: str, place: str) -> Entry:
    """A file named on the command line: taken whatever it is called, links followed."""
    try:
        return found(path, place, path, os.stat(path))
    except OSError as error:
        return path, Outcome("failed", f"cannot be opened ({error.strerror})")


def check_apart(paths: Sequence[str], output: str, jobs: Sequence[Job]) -> None:
    """ValueError if pictures would land among the photos, by whatever links, or in the place of
    one.
    """
    if is_remote(output):
        _check_urls_apart(paths, output)
        return
    paths = [path for path in paths if not is_remote(path)]
    folders = [path for path in paths if os.path.isdir(path)]
    files = [path for path in paths if path not in folders]
    photos = {folded(os.path.realpath(path)) for path in files} | {
        folded(_place(path)) for path in files
    }
    for path in folders:
        if _lies_in(output, path) or _lies_in(path, output):
            raise ValueError(
                f"{output!r} and {path!r} lie in one another; photos and pictures need two folders"
            )
    places = {
        target: os.path.realpath(target) for target in {os.path.dirname(job.target) for job in jobs}
    }
    for target in places:
        for path in folders:
            if os.path.lexists(target) and _lies_in(target, path):
                raise ValueError(
                    f"{target!r} leads into {path!r}, where the photos are; remove that link"
                )
    for job in jobs if photos else ():
        place = os.path.join(places[os.path.dirname(job.target)], os.path.basename(job.target))
        if folded(place) in photos:
            raise ValueError(
                f"the picture of {job.photo.name!r} would be written over a photo, {place!r}"
            )


def _check_urls_apart(paths: Sequence[str], output: str) -> None:
    for path in paths:
        if is_remote(path) and remote.lie_in_one_another(path, output):
            raise ValueError(
                f"{output!r} and {path!r} lie in one another; photos and pictures need two folders"
            )


def _lies_in(inner: str, outer: str) -> bool:
    """Whether a path is a folder or lies in it, in any spelling the disk takes for the same."""
    path = os.path.realpath(inner)
    while True:
        try:
            if os.path.samefile(path, outer):
                return True
        except OSError:  # not there yet
            pass
        parent = os.path.dirname(path)
        if parent == path:
            return False
        path = parent
