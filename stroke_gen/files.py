"""Files that appear whole or not at all: written under a name of our own, then renamed."""

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path


@contextmanager
def whole_file(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A path in the same folder and with the same suffix to write to; it takes the name `path` at the end.

    After any fault the old file stands and nothing else is left. ValueError if the folder does not exist or
    `path` stands for a folder, OSError naming `path` if the disk refuses.
    """
    target = Path(path)
    check_target(target)
    part = target.with_name(f".crayonize-{secrets.token_hex(8)}{target.suffix}")
    try:
        try:
            yield part
            with open(part, "rb+") as file:
                os.fsync(file.fileno())
            os.replace(part, target)
        except BaseException:
            with suppress(OSError):
                part.unlink(missing_ok=True)
            raise
    except OSError as error:
        raise OSError(error.errno, error.strerror or str(error), os.fspath(path)) from error


def check_target(path: str | os.PathLike[str]) -> None:
    """Refuse, before any work is done, a file that cannot be written where `path` says."""
    target = Path(path)
    if not target.parent.is_dir():
        raise ValueError(f"{os.fspath(path)!r}: the folder {str(target.parent)!r} does not exist; create it first")
    if target.exists() and not target.is_file():
        raise ValueError(f"{os.fspath(path)!r}: stands for a folder or device; give the name of a file")
