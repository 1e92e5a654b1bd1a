"""Scenes made by hand: a photo that is its own work grid, every map of it plain unless it is
given.
"""

from concurrent.futures import Executor
from dataclasses import replace

import numpy as np
from fake_box import box

from stroke_gen import mixing
from stroke_gen.colour import oklab
from stroke_gen.guide import Guide
from stroke_gen.scene import Scene
from stroke_gen.separation import Plan
from stroke_gen.subject import Subject
from stroke_gen.swatches import Swatches

TIP = 6.0  # cells to a tip


def scene_of(photo: np.ndarray, family: np.ndarray | None = None, **maps) -> Scene:
    """The scene of a photo (h, w, 3) in linear light; one family unless it is given."""
    h, w = photo.shape[:2]
    photo = photo.astype(np.float32)
    lab, zero = oklab(photo), np.zeros((h, w), np.float32)
    field = np.dstack([np.full((h, w), v, np.float32) for v in (0.64, -0.77)])
    family = np.zeros((h, w), np.int32) if family is None else family.astype(np.int32)
    plain = Scene(
        photo,
        lab,
        lab,
        Guide(lab, 1.4 * TIP),
        family,
        family,
        field,
        zero,
        Subject((), zero),
        zero,
        zero,
        zero,
        zero,
        0.4,
    )
    return replace(plain, **maps)


def plan_of(scene: Scene, pool: Executor, table: Swatches | None = None, most: int = 9) -> Plan:
    """A plan with the crayons that `mixing.find` takes; all of the box stays at hand."""
    table = table or box()
    every = list(range(len(table.names)))
    mixtures = mixing.find(scene, table, most, np.random.default_rng(0))
    return Plan(scene, every, table, mixtures, pool)


def halves(left, right, shape=(60, 102)) -> np.ndarray:
    """A photo of two flat colours, linear light."""
    photo = np.tile(np.array(left, np.float32), (*shape, 1))
    photo[:, shape[1] // 2 :] = right
    return photo


def two_families(photo: np.ndarray) -> np.ndarray:
    """Family 0 on the left and 1 on the right."""
    return (np.arange(photo.shape[1]) >= photo.shape[1] // 2)[None].repeat(len(photo), 0)
