"""What a user may choose for a drawing, and what the choices mean, parsed once.

No heavy imports: the command line reads its defaults here.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, fields, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from stroke_gen.params import Style

    from .crayons.palette import Palette
    from .wax.paper import Paper

_PARSED = {  # what is kept -> the choices that it comes from
    "box": {"palette"},
    "ground": {"paper"},
    "mask": {"subject"},
    "hand": {"style", "force", "age", "left_handed"},
}


SUBJECTS = "auto", "none"  # words for a subject; anything else is a picture of it
MASK_SIDE = 1000  # pixels of the picture of a subject that are looked at
# What can be drawn with, and its constants in data/physics.toml.
MEDIA = {"crayon": "metric", "oil-pastel": "oil-pastel", "pencil": "pencil"}


class Choices(TypedDict, total=False):
    """The fields of `Settings` as keywords, for type checkers."""

    palette: str | os.PathLike[str] | dict[str, Any]
    paper: str | os.PathLike[str] | dict[str, Any]
    style: str | os.PathLike[str] | dict[str, Any]
    force: str | float
    size: int
    sheet_mm: float
    seed: int
    physics: str
    threads: int | None
    preview: bool
    age: int | None
    left_handed: bool
    focus: tuple[tuple[float, float, float, float], ...]
    subject: str | os.PathLike[str] | NDArray[Any]


@dataclass(frozen=True)
class Settings:
    """All choices for drawing a photo, with their defaults.

    >>> Settings(palette="box8", seed=7).box.title
    'Box of 8'
    """

    palette: str | dict[str, Any] = "box24"  # a shipped name, a file, colours #rrggbb,..., or JSON
    paper: str | dict[str, Any] = "drawing"  # a shipped name, NAME:#rrggbb, a picture, or JSON
    style: str | dict[str, Any] = "artist"  # a shipped name, a .toml file, or its content
    force: str | float = "normal"  # light, normal, heavy, or a factor
    size: int = 1600  # long side of the picture in pixels
    sheet_mm: float = 210.0  # long side of the sheet: A5
    seed: int = 0
    physics: str = "metric"  # the medium: metric is a crayon, or oil-pastel, pencil
    threads: int | None = None  # all cores
    preview: bool = False
    age: int | None = None  # of the one who draws, 3 to 10, for style child
    left_handed: bool = False  # hatching from upper left to lower right
    # boxes x, y, w, h in fractions of the picture
    focus: tuple[tuple[float, float, float, float], ...] = ()
    # auto finds who or what the picture is of, none has no subject, or a picture of it: white on
    # black, of any size, as a file or an array
    subject: str | NDArray[Any] = "auto"

    @cached_property
    def box(self) -> Palette:
        """The palette, read; ValueError if there is none of this name."""
        from .crayons.palette_files import load_palette

        return load_palette(self.palette)

    @cached_property
    def ground(self) -> Paper:
        """The paper, read; ValueError if there is none of this name."""
        from .wax.paper import load_paper

        return load_paper(self.paper)

    @cached_property
    def hand(self) -> Style:
        """The style as this hand has it: its force, its age, left or right."""
        from stroke_gen import params

        style = params.with_force(params.load_style(self.style), self.force)
        if self.age is not None:
            style = params.with_age(style, self.age)
        return replace(style, wrist_deg=-style.wrist_deg) if self.left_handed else style

    @cached_property
    def mask(self) -> NDArray[np.float32] | None:
        """The subject (h, w), 0..1, or (1, 1) zero for none; None if it is to be found.

        ValueError if there is no such picture.
        """
        import numpy as np

        if isinstance(self.subject, str) and self.subject in SUBJECTS:
            return None if self.subject == "auto" else np.zeros((1, 1), np.float32)
        from .images.read import open_photo

        try:
            with open_photo(self.subject) as picture:
                light = picture.light(MASK_SIDE, (0.0, 0.0, 0.0)).mean(-1)
        except ValueError as error:
            raise ValueError(f"subject: {error} of the subject, or auto, or none") from error
        return np.sqrt(light).astype(np.float32)

    def parsed(self) -> Settings:
        """The same, with palette, paper, style and subject read; ValueError for what is not."""
        _ = self.box, self.ground, self.hand, self.mask
        return self

    def changed(self, **changes: Any) -> Settings:
        """The same settings but for some; what has been parsed is not parsed again.

        >>> Settings(size=800).changed(seed=7).size
        800
        """
        new = replace(self, **changes)
        for name, sources in _PARSED.items():
            if name in self.__dict__ and not sources & changes.keys():
                new.__dict__[name] = self.__dict__[name]
        return new

    def files(self) -> list[Path]:
        """Palette, paper, style and subject, where they are given as files."""
        base = self.style.get("extends") if isinstance(self.style, dict) else self.style
        given = (self.palette, self.paper, base, self.subject)
        return [Path(one) for one in given if isinstance(one, str) and Path(one).is_file()]

    def plain(self) -> dict[str, Any]:
        """The choices alone, by name."""
        return {field.name: getattr(self, field.name) for field in fields(self)}
