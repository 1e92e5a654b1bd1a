"""Which files of a folder are photos: regular files with the suffix of a picture, in a fixed order.

Links are not followed, so nothing is taken twice, no loop is walked and nothing outside the folder
is read.
Every entry is reported: what is no photo comes out as an Outcome with the reason.
"""

import os
import stat
from collections.abc import Iterator
from pathlib import PurePosixPath

from .job import Found, Outcome

SUFFIXES = frozenset((".jpg", ".jpeg", ".jpe", ".jfif", ".png", ".webp", ".tif", ".tiff", ".avif",
                      ".heic", ".heif", ".hif"))  # fmt: skip

_SYSTEM = frozenset(
    ("thumbs.db", "desktop.ini", "__macosx", "@eadir", "$recycle.bin", "system volume information")
)

NO_PHOTO = Outcome("ignored", "no picture, by the end of its name")

Entry = Found | tuple[str, Outcome]  # a photo, or the name of something else and why it is none


def scan(root: str) -> Iterator[Entry]:
    """Every entry below a folder, in the order of the bytes of their names."""
    folders = [""]
    while folders:
        inside = folders.pop()
        try:
            with os.scandir(os.path.join(root, inside)) as listing:
                entries = sorted(listing, key=lambda entry: os.fsencode(entry.name))
        except OSError as error:
            yield (
                inside or ".",
                Outcome("failed", f"the folder cannot be listed ({error.strerror})"),
            )
            continue
        deeper = []
        for entry in entries:
            name = f"{inside}/{entry.name}" if inside else entry.name
            if entry.is_dir(follow_symlinks=False) and not ignored_name(entry.name):
                deeper.append(name)
            else:
                yield _look(entry, name)
        folders += reversed(deeper)


def ignored_name(name: str) -> bool:
    """Whether a name is that of a hidden file or folder, or of one of the system's own."""
    return name.startswith((".", "~$")) or name.lower() in _SYSTEM


def _look(entry: os.DirEntry[str], name: str) -> Entry:
    """What one entry that is no open folder turns out to be."""
    if ignored_name(entry.name):
        return name, Outcome("ignored", "hidden or a system file")
    try:
        status = entry.stat(follow_symlinks=False)
    except OSError as error:
        return name, Outcome("failed", f"cannot be looked at ({error.strerror})")
    if stat.S_ISLNK(status.st_mode):
        return name, Outcome("ignored", "a link; name it on the command line to follow it")
    if not stat.S_ISREG(status.st_mode):
        return name, Outcome("ignored", "no ordinary file")
    if not is_picture(entry.name):
        return name, NO_PHOTO
    return found(name, name, entry.path, status)


def is_picture(name: str) -> bool:
    """Whether a name ends like that of a picture we read; what it holds is seen when it is
    opened.
    """
    return PurePosixPath(name).suffix.lower() in SUFFIXES


def found(name: str, place: str, path: str, status: os.stat_result) -> Found:
    """A local file as found."""
    return Found(name, place, path, status.st_size, str(status.st_mtime_ns))
