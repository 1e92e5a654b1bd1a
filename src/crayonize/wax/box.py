"""The box of crayons in hand: how far each tip is worn, which face of it touches, how much wax it
gave.

Wear carries on within a stroke cell by cell. From stroke to stroke it carries on as a plan: the
volume that a stroke rubs off follows from its force and length (rate * force / lambda), so each
stroke's tip is known before any is drawn, and strokes on different tiles can be drawn side by side.
A drawing says how wide its tips are, so one worn flat to its full width is turned or sharpened: the
next stroke gets a fresh face.
"""

from collections import Counter
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from stroke_gen.drawing import Stroke, Tip

from ..crayons.palette import Palette
from . import tip
from .physics import Physics

WEAR_LEVELS = 4  # from fresh to flat
FACES = 3  # different sets of bumps
HEADINGS = 9  # directions in which the bumps are drawn out, over half a turn


class Box:
    """The crayons of a palette, on cells of one size."""

    def __init__(self, palette: Palette, constants: Physics, cell_mm: float, seed: int = 0) -> None:
        self.palette, self.constants, self.cell_mm, self.seed = palette, constants, cell_mm, seed
        self.reach = constants.reach(cell_mm)
        self.worn_um: dict[tuple[str, Tip], float] = {}  # mean height lost since the drawing began
        self.given_mm3: dict[str, float] = {}
        self.carried_mm3: dict[str, float] = {}  # by crayon: wax that left the sheet on tips
        # by crayon: how often a tip was turned or sharpened
        self.sharpened: Counter[str] = Counter()
        self.drawn: Counter[str] = Counter()  # by crayon: strokes since the drawing began
        self.masks: list[NDArray[np.float32]] = []
        self._index: dict[tuple[Tip, int, int, int], int] = {}

    def optics(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Absorption and scattering per um of each crayon's wax, (crayons, 3) each, linear RGB."""
        crayons, pigment = self.palette.crayons, np.float32(self.constants.pigment)
        k = np.array([c.k for c in crayons], np.float32) * pigment
        return k, np.array([c.s for c in crayons], np.float32) * pigment

    def take(
        self, strokes: Sequence[Stroke], newton_mm: NDArray[np.float64], heading: NDArray[np.int64]
    ) -> NDArray[np.int64]:
        """Which of `masks` draws each stroke along one of HEADINGS; wear goes on by force times
        length.
        """
        taken = np.empty(len(strokes), np.int64)
        mine_of: dict[tuple[str, Tip], list[int]] = {}
        for i, stroke in enumerate(strokes):
            mine_of.setdefault((stroke.crayon, stroke.tip), []).append(i)
        for (crayon, shape), mine in mine_of.items():
            per_newton_mm = self.constants.worn_per_newton_mm() / shape.area_mm2
            so_far = self.worn_um.get((crayon, shape), 0.0)
            worn = np.add.accumulate(np.append(so_far, per_newton_mm * newton_mm[mine]))
            self.worn_um[crayon, shape] = float(worn[-1])
            flat_um = tip.flat_um(shape)
            turns, rest = np.divmod(worn, flat_um)
            self.sharpened[crayon] += int(turns[-1] - turns[0])
            level = np.minimum(rest[:-1] / flat_um * WEAR_LEVELS, WEAR_LEVELS - 1).astype(np.int64)
            face = (turns[:-1].astype(np.int64) + self.palette.index(crayon)) % FACES
            looks = (face * HEADINGS + heading[mine]) * WEAR_LEVELS + level
            kinds, which = np.unique(looks, return_inverse=True)
            numbers = [self._number(shape, *self._look(kind)) for kind in kinds.tolist()]
            taken[mine] = np.array(numbers)[which]
        return taken

    def own_number(self, crayon: str) -> int:
        """A number for the crayon's next stroke, from which all that happens by chance follows."""
        number = self.drawn[crayon] * 7919 + self.palette.index(crayon) * 104729 * 7919
        self.drawn[crayon] += 1
        return number

    def book(self, crayon: str, given: float, carried: NDArray[np.float64]) -> None:
        """Count the wax a stroke gave, and what left on its tip, by crayon; in um times cells."""
        mm3 = self.cell_mm**2 / 1000
        self.given_mm3[crayon] = self.given_mm3.get(crayon, 0.0) + given * mm3
        for index in np.flatnonzero(carried):
            name = self.palette.crayons[index].name
            self.carried_mm3[name] = self.carried_mm3.get(name, 0.0) + float(carried[index]) * mm3

    @staticmethod
    def _look(kind: int) -> tuple[int, int, int]:
        """Face, heading and level of wear, of the number that `take` makes of them."""
        rest, level = divmod(kind, WEAR_LEVELS)
        return *divmod(rest, HEADINGS), level

    def _number(self, shape: Tip, face: int, heading: int, level: int) -> int:
        """The place in `masks` of a tip, which is made if need be."""
        key = (shape, face, heading, level)
        if key not in self._index:
            rng = np.random.default_rng([self.seed, 11, face])
            worn_um = (level + 0.5) / WEAR_LEVELS * tip.flat_um(shape)
            turned = tip.mask(shape, self.cell_mm, rng, np.pi * heading / HEADINGS, worn_um)
            edge = self.reach
            mask = np.full((len(turned) + 2 * edge, len(turned) + 2 * edge), tip.ABSENT)
            mask[edge:-edge, edge:-edge] = turned
            self._index[key] = len(self.masks)
            self.masks.append(mask)
        return self._index[key]

    def stacked(self) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
        """All masks as rows of one array, and the side of each."""
        sides = np.array([m.shape[0] for m in self.masks], np.int64)
        rows = np.full((len(sides), int(sides.max()) ** 2), tip.ABSENT, np.float32)
        for row, m in zip(rows, self.masks, strict=True):
            row[: m.size] = m.ravel()
        return rows, sides
