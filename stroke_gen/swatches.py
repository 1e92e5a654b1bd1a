"""What the crayons give: the generator's whole knowledge of wax, as numbers.

Hatching crayon k at pressure p over ground C shows, seen from afar, about `a * C + b` per channel of
linear light (wax is translucent and covers part of the ground, and both act linearly on the light from
below). The table is measured on the real simulator with real hatching.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .colour import oklab

Floats = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Swatches:
    """Measured hatching of a box of crayons on one paper."""

    names: tuple[str, ...]  # crayons
    pressures: Floats  # (p,) N/mm^2, rising
    a: Floats  # (k, p, 3) how much of the ground's light comes through
    b: Floats  # (k, p, 3) linear light added by the wax
    grain: Floats  # (k, p) standard deviation of OKLab L within a swatch on bare paper
    paper: Floats  # (3,) linear colour of the bare paper

    def over(self, ground: Floats) -> Floats:
        """Colours (..., k, p, 3) of every hatching over grounds (..., 3)."""
        return np.asarray(self.a * ground[..., None, None, :] + self.b, np.float32)

    def lightness(self) -> Floats:
        """OKLab L (k,) of each crayon laid heavily on the bare paper."""
        return oklab(self.over(self.paper))[:, -1, 0]

    def only(self, chosen: list[int]) -> "Swatches":
        """The table of some of the crayons."""
        names = tuple(self.names[i] for i in chosen)
        return Swatches(names, self.pressures, self.a[chosen], self.b[chosen], self.grain[chosen], self.paper)
