"""The conductor: photo to strokes. It lists the stages and holds no mathematics of its own."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from . import (
    analysis,
    contours,
    hand,
    hatching,
    margin,
    mixing,
    portrait,
    scene,
    separation,
    touches,
)
from .alike import be_plain
from .analysis import blur
from .drawing import Stroke, Tip
from .mixing import LAYERS
from .params import Pass, Style
from .scene import Scene
from .separation import Plan
from .subject import Subject
from .swatches import Swatches, firmness

Floats = NDArray[np.float32]
CROSS = (0, -1, 1, -2)  # turns of the direction from layer to layer, in `cross`
SPARED = 0.7  # of the pressure, in the whites of eyes and in teeth
SUBJECT = 0.5  # care from which the finer tip is taken
FINEST = 0.35  # usual tips
ACROSS = 45.0  # strokes across a subject at least: a small one takes a finer tip
Draw = Callable[[list[Stroke]], None]
Look = Callable[[tuple[int, int]], Floats]
Stage = Callable[[Floats], list[Stroke]]


def generate(
    photo: Floats,
    subject: Subject,
    sheet_mm: tuple[float, float],
    swatches: Swatches,
    style: Style,
    seed: int,
    *,
    draw: Draw,
    look: Look,
    threads: int,
    focus: Sequence[tuple[float, float, float, float]] = (),
) -> list[Stroke]:
    """Strokes for a photo in linear light (h, w, 3) of a subject (see `subject.see`), in drawing
    order, on a sheet of width and height `sheet_mm`.

    draw(strokes) draws further strokes on the open sheet; look(shape) returns what it shows now, as
    linear light on a grid of `shape`: the generator steps back and looks before each coat.
    """
    rng = np.random.default_rng([seed, 3])
    strokes: list[Stroke] = []
    with ThreadPoolExecutor(threads, initializer=be_plain) as pool:
        filled = swatches.upto(style.hardest)
        seen = scene.read(photo, subject, sheet_mm, filled, style, focus, pool)
        plan = _plan(seen, filled, style, rng, pool)
        tip = style.tip_mm / seen.cell_mm
        inside = margin.inside(seen.label.shape, style.margin_mm / seen.cell_mm, tip, rng)
        inside *= margin.faded(seen.care, style.fade, tip, style.wrist_deg, rng)
        for stage in _stages(plan, swatches, inside, style, rng):
            fresh = hand.within(stage(look(seen.label.shape)), sheet_mm)
            draw(fresh)
            strokes += fresh
    return strokes


def stages(style: Style) -> int:
    """How many times `generate` draws."""
    return (
        sum(LAYERS if coat.kind == "fill" else 1 for coat in style.passes)
        + 2
        + 2 * style.lines_first
    )


def _stages(
    plan: Plan, box: Swatches, inside: Floats, style: Style, rng: np.random.Generator
) -> Iterator[Stage]:
    """The stages in drawing order. box: all crayons; features of faces may take any."""
    seen = plan.scene
    white, features, ovals = portrait.kept(seen.subject, seen.label.shape)

    def lines(now: Floats) -> list[Stroke]:
        return contours.outlines(plan, now, inside * (1 - ovals), style, rng)

    firm = replace(plan, swatches=box.only(plan.crayons))  # features are pressed as they ask

    def faces(now: Floats) -> list[Stroke]:
        return portrait.draw(seen.subject, seen.natural, inside, box, seen.cell_mm, style, rng)

    if style.lines_first:
        yield faces
        yield lines
    for coat in style.passes:
        if coat.kind == "touch":
            yield partial(
                _touch, firm, inside=inside * (1 - features), coat=coat, style=style, rng=rng
            )
            continue
        for turn in range(LAYERS) if coat.kind == "fill" else (None,):
            some = inside * (1 - np.float32(SPARED) * white)
            yield partial(_fill, plan, inside=some, coat=coat, turn=turn, style=style, rng=rng)
    yield faces
    yield lines


def _plan(
    seen: Scene, swatches: Swatches, style: Style, rng: np.random.Generator, pool: Executor
) -> Plan:
    """Take crayons out of the box."""
    mixtures = mixing.find(seen, swatches, style.crayons, rng)
    chosen = mixtures.crayons()
    return Plan(seen, chosen, swatches.only(chosen), mixtures.alone(), pool)


def _fill(
    plan: Plan,
    now: Floats,
    inside: Floats,
    coat: Pass,
    turn: int | None,
    style: Style,
    rng: np.random.Generator,
) -> list[Stroke]:
    """One layer of the mixtures, or all once more, light to dark: wide in the ground, finer where
    care is due.
    """
    seen = plan.scene
    wide = coat.tip * style.tip_mm / seen.cell_mm
    wants = separation.plates(plan, blur(now, 0.5 * wide), turn, coat.dark_price)
    tangent = analysis.turned(
        seen.tangent, np.float32(CROSS[turn] * coat.cross if turn is not None else coat.angle)
    )
    gaps = (1 + style.open * (1 - seen.care)).astype(np.float32)
    careful = seen.care > SUBJECT
    extent_mm = seen.cell_mm * float(np.sqrt(np.count_nonzero(careful)))
    fine = min(coat.fine, max(FINEST, extent_mm / (ACROSS * style.tip_mm)))
    parts = []
    for k in sorted(wants, key=lambda k: -plan.swatches.lightness()[k]):
        for factor, where in ((coat.tip, ~careful), (fine, careful)):
            want = np.where(where, wants[k] * inside, 0).astype(np.float32)
            if want.any():
                parts.append((k, factor, want))
    return _hatched(plan, parts, tangent, gaps, coat, style, rng)


def _touch(
    plan: Plan, now: Floats, inside: Floats, coat: Pass, style: Style, rng: np.random.Generator
) -> list[Stroke]:
    """What is still missing and has a shape of its own, crayon by crayon, light to dark."""
    seen = plan.scene
    cells = coat.tip * style.tip_mm / seen.cell_mm
    wants = touches.wanted(plan, blur(now, 0.5 * cells), coat, cells)
    order = sorted(wants, key=lambda k: -plan.swatches.lightness()[k])
    parts = [(k, coat.tip, wants[k] * inside) for k in order]
    return _hatched(plan, parts, seen.tangent, np.ones_like(seen.care), coat, style, rng)


def _hatched(
    plan: Plan,
    parts: list[tuple[int, float, Floats]],
    tangent: Floats,
    gaps: Floats,
    coat: Pass,
    style: Style,
    rng: np.random.Generator,
) -> list[Stroke]:
    """Hatching of (crayon, tip in usual tips, pressure (h, w)), in that order."""
    seen, names = plan.scene, plan.swatches.names
    jobs = list(zip(parts, rng.spawn(len(parts)), strict=True))

    def drawn(job: tuple[tuple[int, float, Floats], np.random.Generator]) -> list[Stroke]:
        (k, factor, want), own = job
        # as the file rounds it
        tip = Tip("sharp" if coat.sharp else "blunt", round(factor * style.tip_mm, 3))
        cells = tip.width_mm / seen.cell_mm
        hold = replace(style, press=style.press * coat.press * firmness(tip.width_mm))
        how = hatching.Hatch(
            coat.spacing * cells,
            coat.shortest * cells,
            coat.reach * cells,
            coat.legs,
            coat.gap * cells,
            coat.single,
        )
        paths = hatching.hatch(want, gaps, tangent, seen.coherence, how, own)
        return hand.draw(paths, seen.cell_mm, names[k], tip, coat.name, hold, own)

    return [stroke for strokes in plan.pool.map(drawn, jobs) for stroke in strokes]
