"""Files in and out: read within limits, and written so that a name stands for a whole file or
none.
"""

import errno
import os
import secrets
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

PART = ".crayonize-"  # begins the name of a file that is not yet whole; the process number follows


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
    part = target.with_name(f"{PART}{os.getpid()}-{secrets.token_hex(4)}.part{target.suffix}")
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
