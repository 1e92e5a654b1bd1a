"""What a user may choose for a drawing. No heavy imports: the command line reads its defaults here."""

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Settings:
    """All choices for drawing a photo, with their defaults."""

    palette: str | dict[str, Any] = "box24"
    paper: str | dict[str, Any] = "drawing"
    style: str = "artist"
    force: str | float = "normal"  # light, normal, heavy, or a factor
    size: int = 1600  # long side of the picture in pixels
    sheet_mm: float = 210.0  # long side of the sheet: A5
    seed: int = 0
    physics: str = "metric"
    threads: int | None = None  # all cores
    preview: bool = False
    age: int | None = None  # of the one who draws, 3 to 10, for style child
    left_handed: bool = False  # hatching from upper left to lower right
    focus: tuple[tuple[float, float, float, float], ...] = ()  # boxes x, y, w, h in fractions of the picture
