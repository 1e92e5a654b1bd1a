"""One run at a time in an output folder, by locks that the system drops when their process ends."""

import errno
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from stroke_gen.files import own_file


class Busy(Exception):
    """Another run holds the folder."""


@contextmanager
def held(folder: Path, shard: str | None = None) -> Iterator[None]:
    """Hold a folder.

    With a shard ("2-of-8") other shards may work beside us, but no run for the whole.
    """
    with own_file(folder / "lock", "a+b") as whole:
        _lock(whole, shared=shard is not None)
        if shard is None:
            yield
            return
        with own_file(folder / f"lock-{shard}", "a+b") as part:
            _lock(part, shared=False)
            yield


def _lock(file: IO[bytes], shared: bool) -> None:
    """Lock or raise Busy; a disk that knows no locks (some network disks) is taken as it is."""
    try:
        if sys.platform == "win32":
            import msvcrt

            if not shared:
                msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(file, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
    except OSError as error:
        if error.errno in (errno.EACCES, errno.EAGAIN, errno.EDEADLK):
            raise Busy from error
        if error.errno not in (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP):
            raise
