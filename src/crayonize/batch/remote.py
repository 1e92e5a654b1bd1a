"""Remote folders: s3:// and whatever else fsspec knows. Photos are fetched and pictures sent one by
one.

What is local is done on a copy in a temporary folder of the worker, under the same limits as
everything. There is no lock on a remote folder; a picture appears there whole or not at all if the
service keeps to that, as object stores do.
"""

import os
import shutil
import tempfile
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import Any

from stroke_gen.files import is_alive

from .job import Found, Job, Outcome
from .journal import Journal
from .output import STATE, OutputFolder
from .scan import NO_PHOTO, Entry, ignored_name, is_picture

_PREFIX = "crayonize-"  # of temporary folders: crayonize-PID-...
_STORES = {
    "s3",
    "s3a",
    "gs",
    "gcs",
    "abfs",
    "abfss",
    "az",
}  # know no folders; to make one would make a bucket
_SAVE_EVERY = 30.0  # s between two copies of the journal to the remote folder
_VERSIONS = (
    "ETag",
    "etag",
    "md5Hash",
    "mtime",
    "LastModified",
    "last_modified",
    "updated",
    "created",
)


class SendError(Exception):
    """A remote folder takes no file."""


def is_remote(path: str) -> bool:
    """Whether a path is the URL of a remote folder, such as s3://bucket/photos."""
    return "://" in path


def file_system(url: str) -> tuple[Any, str]:
    """The fsspec file system of a URL, and the path on it. ImportError names what to install."""
    try:
        import fsspec
    except ImportError as error:
        raise ImportError(f'{url}: remote folders need pip install fsspec') from error
    system, path = fsspec.core.url_to_fs(url)
    return system, str(path)


def scan(url: str) -> Iterator[Entry]:
    """Every file below a remote folder, in the order of their names."""
    system, root = file_system(url)
    root = root.rstrip("/")
    for path, info in sorted(system.find(root, detail=True).items()):
        name = path[len(root) :].lstrip("/") or PurePosixPath(path).name
        if any(ignored_name(part) for part in PurePosixPath(name).parts):
            yield name, Outcome("ignored", "hidden or a system file")
        elif not is_picture(name):
            yield name, NO_PHOTO
        else:
            yield Found(
                name, name, system.unstrip_protocol(path), int(info["size"]), _version(info)
            )


def _version(info: dict[str, Any]) -> str:
    """What changes when a file does: the service's own word for it, or the time of change."""
    return next((str(info[key]) for key in _VERSIONS if info.get(key)), "")


def lie_in_one_another(one: str, other: str) -> bool:
    """Whether one URL names a folder in the other, or both the same."""
    names = [
        f"{system.unstrip_protocol(path).rstrip('/')}/"
        for system, path in map(file_system, (one, other))
    ]
    return names[0].startswith(names[1]) or names[1].startswith(names[0])


@contextmanager
def local_copy(job: Job) -> Iterator[tuple[str, Path]]:
    """A local photo and a local target for a job; what is remote is fetched before and sent after.

    OSError if the photo cannot be fetched, SendError if the picture cannot be sent.
    """
    source, target = job.photo.source, job.target
    if not (is_remote(source) or is_remote(target)):
        yield source, Path(target)
        return
    with tempfile.TemporaryDirectory(prefix=f"{_PREFIX}{os.getpid()}-") as folder:
        photo, picture = source, Path(target)
        if is_remote(source):
            photo = os.path.join(folder, "photo" + PurePosixPath(source).suffix)
            _fetch(source, photo)
        if is_remote(target):
            picture = Path(folder, "picture" + PurePosixPath(target).suffix)
            if job.strange:
                _fetch(target, str(picture))
        yield photo, picture
        if is_remote(target):
            send(str(picture), target)


def _fetch(url: str, path: str) -> None:
    system, name = file_system(url)
    system.get_file(name, path)


def send(path: str, url: str) -> None:
    """Copy a local file to a URL. SendError if that is refused."""
    system, name = file_system(url)
    try:
        if not _STORES & set(
            system.protocol if isinstance(system.protocol, tuple) else (system.protocol,)
        ):
            system.makedirs(str(PurePosixPath(name).parent), exist_ok=True)
        system.put_file(path, name)
    except OSError as error:
        raise SendError(f"{url}: {error.strerror or error}") from error


def remove_copies(pid: int) -> None:
    """Remove the local copies of a killed worker."""
    for folder in Path(tempfile.gettempdir()).glob(f"{_PREFIX}{pid}-*"):
        shutil.rmtree(folder, ignore_errors=True)


class RemoteFolder(OutputFolder):
    """An output folder of which only the journal is also here, to be sent now and then and at the
    end.
    """

    def __init__(self, url: str, shard: tuple[int, int] | None, recipe: str) -> None:
        self._here = tempfile.TemporaryDirectory(prefix=f"{_PREFIX}{os.getpid()}-")
        super().__init__(self._here.name, shard, recipe)
        self._url = url.rstrip("/")
        self._sent = time.monotonic()
        self._sizes: dict[str, int] | None = None

    @contextmanager
    def held(self) -> Iterator[None]:
        """Nobody can hold a remote folder: two runs at once do the same work twice, no more."""
        yield

    def journal(self) -> Journal:
        """The journals as they are there, from now on added to here."""
        self._state.mkdir(parents=True, exist_ok=True)
        system, path = file_system(f"{self._url}/{STATE}")
        for name in system.find(path):
            system.get_file(name, str(self._state / PurePosixPath(name).name))
        return super().journal()

    def size(self, job: Job) -> int | None:
        """Bytes of what stands at a target, by one listing for all."""
        if self._sizes is None:
            system, root = file_system(self._url)
            found = system.find(root, detail=True).items()
            self._sizes = {system.unstrip_protocol(path): int(info["size"]) for path, info in found}
        system, path = file_system(job.target)
        return self._sizes.get(system.unstrip_protocol(path))

    def noted(self) -> None:
        """Send the journal if that was long ago."""
        if time.monotonic() - self._sent > _SAVE_EVERY:
            self.close()

    def close(self) -> None:
        """Send the journal."""
        own = self._own_journal()
        if own.exists():
            send(str(own), f"{self._url}/{STATE}/{own.name}")
        self._sent = time.monotonic()

    def sweep(self, jobs: Iterable[Job]) -> None:
        """Nothing is left behind there; what is left here by killed runs goes."""
        for folder in Path(tempfile.gettempdir()).glob(f"{_PREFIX}*-*"):
            pid = folder.name[len(_PREFIX) :].partition("-")[0]
            if pid.isdigit() and not is_alive(int(pid)):
                shutil.rmtree(folder, ignore_errors=True)

    def clean_up(self, job: Job, pid: int) -> None:
        """Remove what a killed worker left behind here."""
        remove_copies(pid)
