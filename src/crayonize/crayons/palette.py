"""The box of crayons: each with its name, its colour and its wax.

How they are read: palette_files.py.
"""

from dataclasses import dataclass

from stroke_gen.checks import did_you_mean, quoted

from ..images.srgb import RGB


@dataclass(frozen=True)
class Crayon:
    """One crayon: its name, its colour on white paper (#rrggbb, film of reference thickness) and
    its wax.

    k, s: Kubelka-Munk absorption and scattering per micrometre of wax, for linear R, G, B.
    """

    name: str
    hex: str
    k: RGB
    s: RGB


@dataclass(frozen=True)
class Palette:
    """A box of crayons. film_um: how many micrometres of a crayon on white paper show its `hex`."""

    name: str
    title: str
    source: str
    film_um: float
    crayons: tuple[Crayon, ...]

    def index(self, name: str) -> int:
        """The place of a crayon in the box.

        ValueError with the nearest names if it is not there.
        """
        wanted = plain(name)
        names = [crayon.name for crayon in self.crayons]
        if wanted not in names:
            raise ValueError(
                f"palette {self.name}: no crayon {quoted(name)}{did_you_mean(wanted, names)}"
            )
        return names.index(wanted)


def plain(name: str) -> str:
    """A crayon's name in lower case with single spaces."""
    return " ".join(name.split()).lower()
