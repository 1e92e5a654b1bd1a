"""Where each picture goes: the tree of the photos mirrored, names by a template, no two at one
place.

Two names that differ only in upper and lower case, or only in how an accented letter is put
together, are one name on many disks. They are taken as one everywhere, so that a batch that works
here works there too.
"""

import string
import unicodedata
from collections.abc import Iterable, Mapping
from pathlib import PurePosixPath

FIELDS = ("stem", "name", "suffix", "parent")

_SHOWN = 5


def check_template(template: str, more: Iterable[str] = ()) -> None:
    """ValueError unless a template for names holds only {fields} we know and stays within its
    folder.
    """
    fields = (*FIELDS, *more)
    try:
        parts = list(string.Formatter().parse(template))
    except ValueError as error:
        raise ValueError(f"--name {template!r}: {error}") from error
    for text, field, spec, conversion in parts:
        if "/" in text or "\\" in text:
            raise ValueError(
                f"--name {template!r}: is a name without folders; the folders are those of the "
                "photos"
            )
        if field is not None and (field not in fields or spec or conversion):
            raise ValueError(
                f"--name {template!r}: knows the fields {', '.join(f'{{{f}}}' for f in fields)}"
            )
    if not {"stem", "name"} & {field for _, field, _, _ in parts}:
        raise ValueError(
            f'--name {template!r}: needs {{stem}} or {{name}}, such as "{{stem}}.crayon"'
        )


def picture_name(name: str, template: str, suffix: str, more: Mapping[str, str]) -> str:
    """The picture's name for a photo's name, both relative to their folders."""
    path = PurePosixPath(name)
    values = {
        "stem": path.stem,
        "name": path.name,
        "suffix": path.suffix[1:],
        "parent": path.parent.name,
        **more,
    }
    return str(path.parent / (template.format_map(values) + suffix))


def folded(name: str) -> str:
    """The form under which equal-looking names are equal."""
    if name.isascii():
        return name.lower()
    return unicodedata.normalize("NFC", unicodedata.normalize("NFC", name).casefold())


class Places:
    """The places given away so far."""

    def __init__(self) -> None:
        self._taken: dict[str, str] = {}  # folded name of a picture -> photo
        self._folders: dict[str, str] = {}  # folded name of a folder of pictures -> a photo in it

    def take(self, out: str, photo: str) -> str | None:
        """Give a photo, named by its path, its place; the photo that is in the way if it is
        taken.
        """
        key = folded(out)
        rival = self._taken.get(key) or self._folders.get(key) or self._in_folders_of(key, photo)
        if rival is not None and rival != photo:
            return rival
        self._taken[key] = photo
        return None

    def _in_folders_of(self, key: str, photo: str) -> str | None:
        """Take the folders that a picture lies in; the photo whose picture is in the way of one."""
        folder = key.rpartition("/")[0]
        while folder and folder not in self._folders:
            if folder in self._taken:
                return self._taken[folder]
            self._folders[folder] = photo
            folder = folder.rpartition("/")[0]
        return None


def clashes_text(clashes: list[tuple[str, str, str]]) -> str:
    """What to tell about (photo, other photo, picture) clashes, and what helps."""
    shown = "; ".join(
        f"{a!r} and {b!r} would both become {out!r}" for a, b, out in clashes[:_SHOWN]
    )
    more = f"; and {len(clashes) - _SHOWN} more" if len(clashes) > _SHOWN else ""
    return f'{shown}{more}: rename one, or keep the suffixes apart with --name "{{name}}"'
