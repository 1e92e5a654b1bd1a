"""The user's cache folder: compiled kernels and measured tables.

Entries are written whole under their final name and begin with a checksum, so that a damaged one
counts as missing, and any number of processes may write at once. Compiled kernels are code: a
folder that somebody else could write to is left alone. Nothing here raises; without a usable folder
nothing is kept.

CRAYONIZE_CACHE names the folder, CRAYONIZE_NO_CACHE=1 goes without.
"""

import contextlib
import hashlib
import os
import secrets
import stat
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from stroke_gen.files import own_file, read_bytes, whole_file

_LARGEST = 1 << 28  # bytes of an entry


def folder() -> Path:
    """The cache folder, made if need be; if none may be used, a path where nothing can be kept."""
    if not os.environ.get("CRAYONIZE_NO_CACHE"):
        for path in _places():
            with contextlib.suppress(OSError):
                path.mkdir(mode=0o700, parents=True, exist_ok=True)
                if _ours(path):
                    return path
    return Path(os.devnull).with_name(f"no-cache-{secrets.token_hex(8)}") / "none"


def _places() -> Iterator[Path]:
    """Where the folder may lie, best first."""
    named = os.environ.get("CRAYONIZE_CACHE")
    if named:
        yield Path(named).absolute()
        return
    xdg = os.environ.get("XDG_CACHE_HOME", "")
    if Path(xdg).is_absolute():
        yield Path(xdg) / "crayonize"
    with contextlib.suppress(RuntimeError):  # no home
        home = Path.home()
        if sys.platform == "win32":
            yield (
                Path(os.environ.get("LOCALAPPDATA") or home / "AppData" / "Local")
                / "crayonize"
                / "cache"
            )
        elif sys.platform == "darwin":
            yield home / "Library" / "Caches" / "crayonize"
        else:
            yield home / ".cache" / "crayonize"
    with contextlib.suppress(OSError):
        user = os.getuid() if hasattr(os, "getuid") else "user"
        yield Path(tempfile.gettempdir()) / f"crayonize-{user}"


def _ours(path: Path) -> bool:
    """Whether only we, or the machine's administrator, can write here."""
    status = path.stat()
    if not stat.S_ISDIR(status.st_mode):
        return False
    return not hasattr(os, "getuid") or (
        status.st_uid in (os.getuid(), 0) and not status.st_mode & 0o022
    )


def read(path: Path) -> bytes | None:
    """An entry as it was written, or None if it is missing or not whole."""
    with contextlib.suppress(OSError, ValueError):
        content = read_bytes(path, _LARGEST, "an entry")
        if hashlib.sha256(content[32:]).digest() == content[:32]:
            return content[32:]
    return None


@contextlib.contextmanager
def alone(path: Path) -> Iterator[None]:
    """Be the only process at work on an entry, where the system and the folder offer that."""
    with contextlib.ExitStack() as held:
        with contextlib.suppress(OSError, ImportError):
            import fcntl

            path.parent.mkdir(mode=0o700, exist_ok=True)
            file = held.enter_context(own_file(path.with_suffix(".lock"), "a+b"))
            fcntl.flock(file, fcntl.LOCK_EX)
        yield


def write(path: Path, content: bytes) -> bool:
    """Keep an entry, whole or not at all; whether it is kept now."""
    try:
        path.parent.mkdir(mode=0o700, exist_ok=True)
        with whole_file(path, durable=False) as part:
            part.write_bytes(hashlib.sha256(content).digest() + content)
    except (OSError, ValueError):
        return False
    return True
