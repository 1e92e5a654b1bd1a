"""Files in and out: read within limits, and written so that a name stands for a whole file or
none.
"""

import errno
import functools
import hashlib
import os
import secrets
import socket
import stat
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Literal

# A file that is not yet whole is called PART, process number, machine, chance, ".part".
PART = ".crayonize-"
_parts: set[Path] = set()  # being written now
_STALE = 3600.0  # s after which one of another machine is taken for left behind


@contextmanager
def whole_file(path: str | os.PathLike[str], durable: bool = True) -> Iterator[Path]:
    """A path in the same folder and with the same suffix to write to; it takes the name `path` at
    the end.

    After any fault the old file stands and nothing else is left; a link is replaced, never written
    through.
    durable: file and name are on the disk before this ends, so that no loss of power takes them
    back. ValueError if the folder does not exist or `path` stands for a folder or device, OSError
    naming `path` if the disk refuses.
    """
    target = Path(os.fsdecode(path))
    check_target(target)
    name = f"{PART}{os.getpid()}-{_machine()}-{secrets.token_hex(4)}.part{target.suffix}"
    part = target.with_name(name)
    _parts.add(part)
    try:
        try:
            yield part
            if durable:
                _sync(part, os.O_RDWR)
            os.replace(part, target)
            if durable and os.name != "nt":  # there a folder cannot be opened
                _sync(target.parent, os.O_RDONLY)
        except BaseException:
            with suppress(OSError):
                part.unlink(missing_ok=True)
            raise
    except OSError as error:
        raise OSError(error.errno, error.strerror or str(error), os.fspath(target)) from error
    finally:
        _parts.discard(part)


def drop_parts() -> None:
    """Remove all that this process has half written, at its sudden end."""
    for part in list(_parts):
        with suppress(OSError):
            part.unlink()


def sweep(folder: str | os.PathLike[str], pid: int | None = None) -> None:
    """Remove what killed processes left half written in a folder; the living keep theirs.

    pid: only what this process left, which is known to be dead.
    """
    with suppress(OSError), os.scandir(folder) as listing:
        for entry in listing:
            words = entry.name.removeprefix(PART).split("-")
            if entry.name.startswith(PART) and ".part" in entry.name and words[0].isdigit():
                owner = int(words[0])
                with suppress(OSError):
                    if owner == pid if pid is not None else _is_left(entry, owner, words[1]):
                        os.unlink(entry.path)


def _is_left(entry: os.DirEntry[str], owner: int, machine: str) -> bool:
    if machine == _machine() and os.name != "nt":
        return not is_alive(owner)
    return time.time() - entry.stat(follow_symlinks=False).st_mtime > _STALE


def is_alive(pid: int) -> bool:
    """Whether a process of this machine is there, and not one that is dead but still listed."""
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except OSError:  # somebody else's
        return True
    with suppress(OSError, IndexError):
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    return True


@functools.cache
def _machine() -> str:
    """Names what process numbers belong to: the machine since its start, or a container on it."""
    told = socket.gethostname()
    with suppress(OSError):
        told += Path("/proc/sys/kernel/random/boot_id").read_text() + os.readlink(
            "/proc/self/ns/pid"
        )
    return hashlib.sha256(told.encode()).hexdigest()[:8]


def _sync(path: Path, flags: int) -> None:
    """Have a file, or the names in a folder, on the disk; some network disks know no such thing for
    folders.
    """
    handle = os.open(path, flags)
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno != errno.EINVAL:
            raise
    finally:
        os.close(handle)


def check_target(path: str | os.PathLike[str]) -> None:
    """Refuse, before any work is done, what os.replace would fail on or destroy: folders, devices,
    pipes.
    """
    target = Path(os.fsdecode(path))
    if not target.parent.is_dir():
        raise ValueError(
            f"{str(target)!r}: the folder {str(target.parent)!r} does not exist; create it first"
        )
    if os.path.lexists(target):
        mode = os.lstat(target).st_mode
        if not (stat.S_ISREG(mode) or stat.S_ISLNK(mode)):
            raise ValueError(
                f"{str(target)!r}: stands for a folder or device; give the name of a file"
            )


@contextmanager
def own_file(path: str | os.PathLike[str], mode: Literal["rb", "a+b"]) -> Iterator[IO[bytes]]:
    """A file that we keep beside other people's, to be read, or made if need be and added to.

    OSError naming it if it is anything else: through a link we would write into a photo, a pipe
    would wait for ever, a device has no end.
    """
    name = os.fspath(path)
    flags = os.O_RDONLY if mode == "rb" else os.O_RDWR | os.O_CREAT | os.O_APPEND
    for more in ("O_NOFOLLOW", "O_NONBLOCK", "O_CLOEXEC", "O_BINARY"):
        flags |= getattr(os, more, 0)
    if os.path.islink(path):
        raise OSError(errno.ELOOP, "is a link; remove it", name)
    handle = os.open(path, flags, 0o666)
    found = os.fstat(handle)
    if not stat.S_ISREG(found.st_mode) or found.st_nlink > 1:
        os.close(handle)
        raise OSError(errno.EINVAL, "is no plain file of our own; remove it", name)
    with open(handle, mode, buffering=0 if mode == "a+b" else -1) as file:
        yield file


def read_bytes(path: str | os.PathLike[str], most: int, what: str) -> bytes:
    """All of an ordinary file of at most `most` bytes; a pipe or device is refused before it can
    block.

    ValueError, without the name before it, for anything else. what: the kind of file, for the
        message.
    """
    if "\0" in os.fsdecode(path):
        raise ValueError("cannot be read (a null byte in the name)")
    try:
        if not stat.S_ISREG(os.stat(path).st_mode):
            raise ValueError("is no ordinary file")
        with open(path, "rb") as file:
            data = file.read(most + 1)
    except OSError as error:
        raise ValueError(f"cannot be read ({error.strerror})") from error
    if len(data) > most:
        raise ValueError(f"larger than {most // 1_000_000} MB, the most {what} may have")
    return data
