"""What a wax is like: the constants of Table 1 and those that it lacks, and how the kernels take
them.
"""

import functools
import tomllib
from dataclasses import dataclass
from importlib import resources
from typing import NamedTuple

import numpy as np

WHOLE = 1.25  # hops of fewer cells than this go to the next cell
FINEST = 0.6  # cells; a track narrower than this could not be drawn
THIN_UM = 0.4  # a thinner film is dust: it counts as one with the layer beneath it, and sinks first


class Constants(NamedTuple):
    """What the kernels take of a `Physics`, for cells of one size; all float32."""

    mu_paper: np.float32
    mu_wax: np.float32
    film: np.float32  # um
    rate: np.float32  # per cell of the way
    push: np.float32
    relief: np.float32  # slope per um from one cell to the next
    nu: np.float32  # per cell of the way
    alpha: np.float32  # per um
    beta: np.float32
    yields: np.float32
    step: np.float32  # from contact to contact, in extents of the tip
    hop: np.float32  # how far smeared wax goes, in cells
    scatter: np.float32  # ... and how far each hop may differ from that, in cells
    slip: np.float32
    slip_cells: np.float32
    most: np.float32  # mean overlap over the tip, um
    epsilon: np.float32  # um
    wear: np.float32
    around: np.float32
    brings: np.float32  # cells on each side that a cell takes along as it wears
    sticks: np.float32
    carve: np.float32  # um
    peel: np.float32  # um
    covers: np.float32  # um
    clump: np.float32  # um
    site: np.float32  # radius of a clump, in cells
    way: np.float32  # from clump to clump, in cells
    grains: np.float32  # that come out for each cell drawn over
    lasts: np.float32  # cells
    track: np.float32  # its deviation, in cells
    speck: np.float32  # um
    lean: np.float32  # um from cell to cell, for a tangent of 1
    thin: np.float32  # um
    heap: np.float32
    firm: np.float32


@dataclass(frozen=True)
class Physics:
    """Constants of the wax (Table 1), with the paper's grey level read as 1 um; see
    data/physics.toml.
    """

    mu_paper: float  # friction of bare paper
    mu_wax: float  # friction of wax
    film_um: float  # film at which half of the way from paper to wax friction is gone
    rate_per_mm: float  # wax rubbed off per mm of path and um of overlap, at friction 1
    push: float  # down force over drag force, Fig. 6; 0: take the stroke's own force in newton
    relief: float  # how steep a height difference of the paper looks to the crayon
    nu: float  # share of the displaced wax that leaves its cell ...
    nu_mm: float  # ... per this length of path
    reach_mm: float  # how far it goes at a time: to the eight neighbours on cells of this size
    alpha: float  # flow smear factor, per um
    beta: float  # directional smear factor
    lam: float  # N per um of overlap and mm^2 of contact: .0005 a cell of 0.1 mm
    bears: float  # N per mm^2 of the tip that wax bears before it yields: no hand presses harder
    epsilon_um: float  # accuracy of the force, as a sum of overlaps over cells
    firm: float  # share of the wax's height that holds the crayon up; the rest yields (1 in Fig. 4)
    # share of a cell's wax that counts as out of reach: Fig. 6 rubs on the paper alone (1)
    heap: float
    yields: float  # sum of pulls at which half of what could move does (0: all, as in a liquid)
    slip: float  # share of the force that comes and goes as the crayon sticks and slips ...
    slip_mm: float  # ... over this length
    step: float  # from one contact to the next, as a share of the tip's extent; 0: cell by cell
    # share of a cell's loss that deepens the tip around it; the rest the whole tip shares
    wear: float
    around: float
    wear_mm: float  # ... as far as this to each side; 0: the cell itself
    sticks: float  # share of thick displaced wax that sticks to the tip ...
    carve_um: float  # ... and of half as much from a film of this height
    peel_um: float  # ... and where it is its own wax, which lies better
    covers_um: float  # load that halves what the crayon gives of its own wax
    clump_um: float  # mean load that comes off as a clump
    clump_mm: float  # way from clump to clump, where there is so much
    site_mm: float  # radius of the place it comes from
    grains_per_cm2: float  # hard grains that come out of the tip, by the area drawn over
    grain_mm: float  # way that they last, on average
    track_mm: float  # deviation across the tracks that they leave
    speck_um: float  # height of the specks where they are lost
    # share of the crayon's slope that its tip has: worn as the hand holds it, it mostly fits
    lean: float
    # how much stronger the wax is coloured than that of crayons, for which palettes are given
    pigment: float
    tip: float  # how broad the tips are that a drawing is planned with, against a crayon's
    usual: float  # mean of mu * sin(S, F) over a drawing, for the plan of wear

    def worn_per_newton_mm(self) -> float:
        """Wax worn off a tip's relief, in um mm^2 per newton and mm of path: rate * mu * sin /
        lambda.
        """
        return self.wear * self.rate_per_mm * self.usual / self.lam

    def hop(self, cell_mm: float) -> tuple[float, float]:
        """How far smeared wax goes, in cells: the mean, and how far each hop may differ from it.

        Hops are whole cells. Where they are two and more they scatter, or they would part the cells
        into lattices.
        """
        cells = self.reach_mm / cell_mm
        if cells < WHOLE:
            return 1.0, 0.0
        return cells, 0.5 if cells < 2 else 1.5

    def reach(self, cell_mm: float) -> int:
        """How many cells smeared wax goes at most."""
        mean, scatter = self.hop(cell_mm)
        return int(np.ceil(mean + scatter - 0.5))

    def constants(self, cell_mm: float) -> Constants:
        """The kernels' arguments for cells of `cell_mm`."""
        hop, scatter = self.hop(cell_mm)
        longer = hop * cell_mm / self.reach_mm  # the fewer hops it takes to be pushed as far
        values = {
            "mu_paper": self.mu_paper,
            "mu_wax": self.mu_wax,
            "film": self.film_um,
            "rate": self.rate_per_mm * cell_mm,
            "push": self.push,
            "relief": self.relief / (1000 * cell_mm),
            "nu": 1 - (1 - self.nu) ** (cell_mm / self.nu_mm / longer),
            "alpha": self.alpha,
            "beta": self.beta,
            "yields": self.yields,
            "step": self.step,
            "hop": hop,
            "scatter": scatter,
            "slip": self.slip,
            "slip_cells": self.slip_mm / cell_mm,
            "most": self.bears / self.lam,
            "epsilon": self.epsilon_um,
            "wear": self.wear,
            "around": self.around,
            "brings": self.wear_mm / cell_mm,
            "sticks": self.sticks,
            "carve": self.carve_um,
            "peel": self.peel_um,
            "covers": self.covers_um,
            "clump": self.clump_um,
            "site": self.site_mm / cell_mm,
            "way": self.clump_mm / cell_mm,
            "grains": self.grains_per_cm2 * cell_mm**2 / 100,
            "lasts": self.grain_mm / cell_mm,
            "track": max(self.track_mm / cell_mm, FINEST),
            "speck": self.speck_um,
            "lean": self.lean * 1000 * cell_mm,
            "thin": THIN_UM,
            "heap": self.heap,
            "firm": self.firm,
        }
        return Constants(**{name: np.float32(value) for name, value in values.items()})


@functools.cache
def physics(name: str) -> Physics:
    """The constants of a physics preset."""
    text = resources.files("crayonize").joinpath("data/physics.toml").read_text("utf-8")
    table = tomllib.loads(text)
    if name not in table:
        raise ValueError(f"physics: {name!r} is none of {', '.join(table)}")
    return Physics(**table[name])
