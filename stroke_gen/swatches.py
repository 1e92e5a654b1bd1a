"""What the crayons give: the generator's whole knowledge of wax, as numbers.

Hatching crayon k at pressure p over ground C shows, seen from afar, about `a * C + b` per channel
of linear light (wax is translucent and covers part of the ground, and both act linearly on the
light from below). Wax takes less on wax than on paper, so there is one line for bare paper and one
for waxed ground. The table is measured on the real simulator with real hatching.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .colour import oklab

Floats = NDArray[np.float32]
TIP_MM = 2.4  # width of the blunt tip that hatched the swatches
COVERED = 0.3  # linear light by which a ground covered with wax differs from the paper at least
FIRM = 0.38  # N/mm^2: laid well, but not burnished
# a tip n times finer needs n**FINER times the pressure for the same colour: it passes sooner
FINER = 0.75


@dataclass(frozen=True, eq=False)
class Swatches:
    """Measured hatching of a box of crayons on one paper."""

    names: tuple[str, ...]  # crayons
    pressures: Floats  # (p,) N/mm^2, rising
    a: Floats  # (2, k, p, 3) how much of the ground's light comes through: over paper, over wax
    b: Floats  # (2, k, p, 3) linear light added by the wax
    grain: Floats  # (k, p) standard deviation of OKLab L within a swatch on bare paper
    paper: Floats  # (3,) linear colour of the bare paper

    def over(self, ground: Floats) -> Floats:
        """Colours (..., k, p, 3) of every hatching over grounds (..., 3)."""
        waxed = covered(ground, self.paper)[..., None, None, None]
        a = (1 - waxed) * self.a[0] + waxed * self.a[1]
        b = (1 - waxed) * self.b[0] + waxed * self.b[1]
        return np.asarray(a * ground[..., None, None, :] + b, np.float32)

    def lightness(self) -> Floats:
        """OKLab L (k,) of each crayon laid heavily on the bare paper."""
        return oklab(self.over(self.paper))[:, -1, 0]

    def upto(self, hardest: float) -> "Swatches":
        """The table up to `hardest` N/mm^2, the most of a hand; two pressures at least."""
        n = max(2, int((self.pressures <= hardest + 1e-6).sum()))
        return Swatches(
            self.names,
            self.pressures[:n],
            np.ascontiguousarray(self.a[:, :, :n]),
            np.ascontiguousarray(self.b[:, :, :n]),
            np.ascontiguousarray(self.grain[:, :n]),
            self.paper,
        )

    def masstone(self) -> Floats:
        """OKLab (k, 3) of each crayon laid well, but not burnished, on the bare paper."""
        p = min(int(np.searchsorted(self.pressures, FIRM - 1e-6)), len(self.pressures) - 1)
        return oklab(self.over(self.paper))[:, p]

    def only(self, chosen: list[int]) -> "Swatches":
        """The table of some of the crayons."""
        names = tuple(self.names[i] for i in chosen)
        return Swatches(
            names,
            self.pressures,
            self.a[:, chosen],
            self.b[:, chosen],
            self.grain[chosen],
            self.paper,
        )


def covered(ground: Floats, paper: Floats) -> Floats:
    """How far a ground (..., 3) is covered with wax, 0..1, guessed from how far its light is from
    the paper's.
    """
    return np.clip(np.abs(ground - paper).max(-1) / COVERED, 0, 1).astype(np.float32)


def firmness(tip_mm: float) -> float:
    """Factor on the table's pressures for a tip of another width."""
    return float((TIP_MM / tip_mm) ** FINER)
