"""What a batch is made of: the jobs, the recipe they share, and what became of each."""

import hashlib
import json
from dataclasses import asdict, dataclass
from typing import Any

from ..machine import source
from ..machine.memory import MAX_PIXELS
from ..settings import Settings

STATUSES = ("ok", "failed", "died", "timeout", "skipped", "ignored", "not_run")

MAX_BYTES = 1 << 30
TIME_LIMIT = 1800.0


@dataclass(frozen=True, slots=True)
class Found:
    """A file that was found, and what tells later whether it has changed."""

    name: str  # how it is reported: relative to its folder, or as given on the command line
    place: str  # its place in the tree that is mirrored, parts joined by "/"
    source: str  # where it lies: a path or URL
    size: int  # bytes
    version: str  # time of its last change in ns, or what a remote folder has in its place


@dataclass(frozen=True, slots=True)
class Job:
    """One photo to be drawn."""

    photo: Found
    out: str  # name of the picture relative to the output folder
    target: str  # where the picture goes: a path or URL
    strange: bool = False  # something stands at the target that no journal knows


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of one file."""

    status: str  # one of STATUSES
    error: str = ""  # why, in one line; of one that is ok, a warning
    seconds: float = 0.0
    bytes: int = 0  # size of the picture
    strokes: int = 0


@dataclass(frozen=True)
class Recipe:
    """How every photo of a batch is drawn, and the limits under which it is opened."""

    settings: Settings
    light: bool = True  # shade the relief of paper and wax
    metadata: str = "safe"
    # sheet of paper to fill, such as "a4"; None leaves the sheet of the settings
    page: str | None = None
    dpi: float | None = None
    max_pixels: int = MAX_PIXELS
    max_bytes: int = MAX_BYTES

    def digest(self, suffix: str) -> str:
        """A short name for all that shapes a picture: with the same photo and digest it comes out
        the same.

        A palette, paper or style given as a file counts with its content, and so does the program
        itself: after an upgrade that draws otherwise, a folder is drawn anew.
        """
        shaping = self.settings.plain()
        del shaping["threads"]
        shaping |= {
            "light": self.light,
            "metadata": self.metadata,
            "page": self.page,
            "dpi": self.dpi,
            "suffix": suffix,
            "version": source.of_drawings(),
        }
        files = self.settings.files()
        shaping["files"] = [hashlib.sha256(file.read_bytes()).hexdigest() for file in files]
        return hashlib.sha256(json.dumps(shaping, sort_keys=True).encode()).hexdigest()[:20]

    def to_json(self) -> dict[str, Any]:
        """Plain values, for the way to a worker."""
        return asdict(self)

    @classmethod
    def from_json(cls, plain: dict[str, Any]) -> "Recipe":
        """The recipe again."""
        settings = dict(plain["settings"])
        settings["focus"] = tuple(tuple(box) for box in settings["focus"])
        return cls(**{**plain, "settings": Settings(**settings)})
