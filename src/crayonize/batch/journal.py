"""The journal of an output folder: which picture was made from which photo with which settings.

One JSON line is added after a picture stands whole at its name. A line counts as long as the photo,
the recipe and the size of the picture are still those it tells of, wherever it stands in the file:
so an interrupted run goes on where it was, and a changed photo is drawn anew. A torn line is passed
over.
"""

import errno
import json
import os
from collections.abc import Iterable
from contextlib import suppress
from hashlib import blake2b
from pathlib import Path

from stroke_gen.files import own_file

from .job import Job

MOST_BYTES = 1 << 28  # about a million pictures


class Journal:
    """What is known of earlier runs, and the file that this run adds to."""

    def __init__(self, path: Path, others: Iterable[Path], recipe: str) -> None:
        self._recipe = recipe
        self._known: dict[str, tuple[bytes, int]] = {}  # picture -> key of its making, its size
        for file in (*others, path):
            self._read(file)
        self._file = path

    def _read(self, path: Path) -> None:
        if not os.path.lexists(path):
            return
        with own_file(path, "rb") as file:
            if os.fstat(file.fileno()).st_size > MOST_BYTES:
                raise OSError(errno.EFBIG, "is larger than a journal can be; remove it", str(path))
            for line in file:
                self._take(line)

    def _take(self, line: bytes) -> None:
        """Believe a line, if it is a whole one."""
        with suppress(ValueError, KeyError, TypeError, RecursionError):
            entry = json.loads(line)
            key = _key(entry["in"], entry["size"], entry["version"], entry["recipe"])
            self._known[str(entry["out"])] = key, int(entry["bytes"])

    def knows(self, out: str) -> bool:
        """Whether the picture of this name was made here."""
        return out in self._known

    def is_done(self, job: Job, size: int | None) -> bool:
        """Whether a picture of `size` bytes is what this job would make again."""
        photo = job.photo
        key = _key(photo.place, photo.size, photo.version, self._recipe)
        return size is not None and self._known.get(job.out) == (key, size)

    def add(self, job: Job, size: int) -> None:
        """Note a picture that stands whole. OSError if the disk refuses the line."""
        photo = job.photo
        entry = {
            "in": photo.place,
            "size": photo.size,
            "version": photo.version,
            "recipe": self._recipe,
            "out": job.out,
            "bytes": size,
        }
        line = json.dumps(entry).encode() + b"\n"
        with own_file(self._file, "a+b") as file:
            if file.seek(0, os.SEEK_END):
                file.seek(-1, os.SEEK_END)
                if file.read(1) != b"\n":  # a line torn by a crash
                    line = b"\n" + line
            if file.write(line) != len(line):
                raise OSError(28, "No space left for a whole line", os.fspath(self._file))
        self._known[job.out] = _key(photo.place, photo.size, photo.version, self._recipe), size


def _key(name: str, size: int, version: str, recipe: str) -> bytes:
    text = f"{size} {version} {recipe} {name}"
    return blake2b(text.encode("utf-8", "surrogatepass"), digest_size=16).digest()
