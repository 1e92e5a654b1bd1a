"""What a photo tells of itself, and how much of that goes into its drawing.

Tags of the layout of the file (size, orientation, profile, previews) never go along: they would be
wrong for the drawing. Where the photo was taken is left out unless everything is wanted.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from PIL.Image import Exif

CHOICES = ("none", "safe", "all")

_EXIF_FOLDER, _GPS_FOLDER = 0x8769, 0x8825
_TITLE, _DESCRIPTION, _DATE, _DATE_TAKEN = 40091, 270, 306, 36867
_SAFE = frozenset((_TITLE, 315, 33432))  # title, artist, copyright
_SAFE_INSIDE = frozenset(
    (_DATE_TAKEN, 36880, 36881, 37520, 37521)
)  # when it was taken: date, offset, fractions
_COLOUR_SPACE, _SRGB = 40961, 1
# sizes, strips, tiles, resolution, orientation, software, profile, previews, packets
_LAYOUT = frozenset(
    (
        *range(254, 270),
        *range(273, 285),
        296,
        301,
        305,
        *range(317, 348),
        *range(512, 533),
        700,
        33723,
        34377,
        _EXIF_FOLDER,
        _GPS_FOLDER,
        34675,
        50341,
        37500,
        40961,
        40962,
        40963,
        40965,
    )
)
_LONGEST = 60_000  # bytes, as JPEG holds 64 kB


def kept(old: Exif | None, which: str) -> Exif | None:
    """The tags of a photo that go along: none, safe (title, names, date; no place) or all of
    EXIF.

    None if there are none, or if they are too damaged or too many to be written.
    """
    if which == "none" or old is None:
        return None
    from PIL.Image import Exif

    new = Exif()
    try:
        inside, place = dict(old.get_ifd(_EXIF_FOLDER)), dict(old.get_ifd(_GPS_FOLDER))
        outside = dict(old)
        title = outside.get(_DESCRIPTION)
        if _TITLE not in outside and isinstance(title, str) and title.strip():
            outside[_TITLE] = _text(title).strip().encode("utf-16-le") + b"\0\0"
        wanted, wanted_inside = (None, None) if which == "all" else (_SAFE, _SAFE_INSIDE)
        new.update(_chosen(outside, wanted))
        _add_folder(new, _EXIF_FOLDER, _chosen(inside, wanted_inside))
        _add_folder(new, _GPS_FOLDER, place if which == "all" else {})
        return new if len(new) and len(new.tobytes()) <= _LONGEST else None
    except Exception:
        return None


def flat(exif: Exif) -> Exif:
    """The same without folders, as compressed TIFF cannot be given any; the date becomes that of
    the file.
    """
    date = exif.get_ifd(_EXIF_FOLDER).get(_DATE_TAKEN)
    for folder in (_EXIF_FOLDER, _GPS_FOLDER):
        exif.pop(folder, None)
        exif.get_ifd(folder).clear()
    if date is not None:
        exif[_DATE] = date
    return exif


def _add_folder(exif: Exif, folder: int, tags: dict[int, Any]) -> None:
    """Add tags in a folder of their own.

    The TIFF writer also wants to see the folder among the tags.
    """
    if tags:
        exif.get_ifd(folder).update(tags)
        exif[folder] = 0


def _chosen(tags: dict[int, Any], wanted: frozenset[int] | None) -> dict[int, Any]:
    """The tags that go along, text as UTF-8: the standard says ASCII, and nobody keeps to it."""
    return {
        tag: value if not isinstance(value, str) or value.isascii() else _text(value).encode()
        for tag, value in tags.items()
        if tag not in _LAYOUT and (wanted is None or tag in wanted)
    }


def _text(value: str) -> str:
    """Text as it was meant, of the single bytes that Pillow gives: UTF-8, or else Windows' Latin-1.
    """
    try:
        raw = value.encode("latin-1")
    except UnicodeEncodeError:  # has been read already
        return value
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode("cp1252", "replace")
