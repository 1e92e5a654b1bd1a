"""The conductor: photo to strokes. It lists the stages and holds no mathematics of its own."""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from . import analysis, contours, hand, hatching, recipes, separation
from .analysis import Scene
from .colour import oklab
from .drawing import Stroke, Tip
from .params import Pass, Style
from .separation import Plan
from .swatches import Swatches

Floats = NDArray[np.float32]
AGREE = 0.45  # tips over which neighbours agree on a recipe
RAGGED = 0.12  # of all votes: how raggedly one recipe gives way to the next
BOLD = 0.3  # distance from the paper, in OKLab, of the colours of an ordinary picture
FINE_GAIN = 0.02  # the least gain that no pale picture makes smaller
FAR_SIGHT = 1.5  # how much a free coat makes up for colours that are off when seen from afar
Draw = Callable[[list[Stroke]], None]
Look = Callable[[tuple[int, int]], Floats]


def generate(
    photo: Floats, width_mm: float, height_mm: float, swatches: Swatches, style: Style, seed: int, *,
    draw: Draw, look: Look, threads: int, focus: Sequence[tuple[float, float, float, float]] = (),
) -> list[Stroke]:  # fmt: skip
    """Strokes for a photo in linear light (h, w, 3), in drawing order.

    draw(strokes) draws further strokes on the open sheet; look(shape) returns what it shows now, as linear light
    on a grid of `shape`: the generator steps back and looks before each coat.
    """
    rng = np.random.default_rng([seed, 3])
    strokes: list[Stroke] = []
    with ThreadPoolExecutor(threads) as pool:
        scene = analysis.read(photo, width_mm, height_mm, swatches, style, focus, pool)
        plan = _plan(scene, swatches, style, rng, pool)
        boldest = float(np.percentile(np.linalg.norm(scene.lab - oklab(swatches.paper), axis=2), 95))
        stages = [lambda now, coat=coat: _coat(plan, now, _finer(coat, boldest), style, rng) for coat in style.passes]
        lines = [lambda now: contours.outlines(plan, now, style, rng)]
        for stage in lines * style.lines_first + stages + lines:
            fresh = hand.within(stage(look(plan.group.shape)), width_mm, height_mm)
            draw(fresh)
            strokes += fresh
    return strokes


def _plan(scene: Scene, swatches: Swatches, style: Style, rng: np.random.Generator, pool: Executor) -> Plan:
    """Take crayons out of the box, and part the scene into areas with a recipe and directions of their own."""
    calm = oklab(scene.calm)
    mixes = recipes.find(calm, swatches, style.recipes, style.crayons, rng)
    swatches, mixes = swatches.only(mixes.crayons()), mixes.alone()
    tip = style.tip_mm / scene.cell_mm
    ragged = RAGGED * separation.streaks(scene.detail.shape, tip, style.wrist_deg, rng)
    group = separation.grouped(calm, mixes, AGREE * tip, ragged, pool)
    fan = style.fan_deg * rng.standard_normal(len(mixes.base)).astype(np.float32)
    scene = replace(scene, tangent=analysis.turned(scene.tangent, fan[group]))
    return Plan(scene, swatches, mixes, group, pool)


def _finer(coat: Pass, boldest: float) -> Pass:
    """The coat with a smaller least gain where even the boldest colours are near the paper's: fog, snow, high key."""
    return replace(coat, gain=max(min(coat.gain, FINE_GAIN), coat.gain * min(1.0, boldest / BOLD)))


def _coat(plan: Plan, now: Floats, coat: Pass, style: Style, rng: np.random.Generator) -> list[Stroke]:
    """One coat: choose a crayon for every place, then hatch crayon by crayon, light to dark."""
    scene, box = plan.scene, plan.swatches
    width = round(coat.tip * style.tip_mm, 3)  # as the drawing's file rounds it
    tip = Tip("sharp" if coat.sharp else "blunt", width)
    cells = width / scene.cell_mm
    sheet = plan.pool.submit(lambda: analysis.blur(now, 0.5 * cells))
    tangent = plan.pool.submit(lambda: analysis.turned(scene.tangent, np.float32(coat.angle)))
    astray = plan.pool.submit(lambda: scene.afar - analysis.far(now)) if coat.kind == "free" else None
    seen = scene.target if coat.detail > 0 else scene.calm
    aim = oklab(analysis.blur(seen, coat.soften * 0.5 * cells))
    streak = separation.streaks(plan.group.shape, cells, style.wrist_deg, rng)
    if astray:
        aim += np.float32(FAR_SIGHT) * astray.result()
    wants = separation.plates(plan, sheet.result(), aim, coat, cells, style.flat, streak)
    how = hatching.Hatch(
        coat.spacing * cells, coat.shortest * cells, coat.reach * cells, coat.legs, coat.gap * cells, coat.single
    )
    rngs, hold = rng.spawn(len(box.names)), replace(style, press=style.press * coat.press)

    def drawn(k: int) -> list[Stroke]:
        paths = hatching.hatch(wants[k], tangent.result(), scene.coherence, how, rngs[k])
        return hand.draw(paths, scene.cell_mm, box.names[k], tip, coat.name, hold, rngs[k])

    order = sorted(wants, key=lambda k: -box.lightness()[k])
    return [stroke for strokes in plan.pool.map(drawn, order) for stroke in strokes]
