"""Outlines: where they run, how many there are, in which crayon; and that a child closes them."""

from dataclasses import replace

import numpy as np
import pytest
from fake_box import PAPER, FlatSheet, box

from stroke_gen import analysis
from stroke_gen.colour import oklab
from stroke_gen.generate import generate
from stroke_gen.params import Pass, Style, load_style

WIDTH, HEIGHT = 200.0, 150.0
CENTRE, RADIUS = np.array([90.0, 70.0]), 40.0  # mm
RED = (0.5, 0.04, 0.04)


@pytest.fixture(autouse=True)
def coarse(monkeypatch):
    """Half the work grid is enough, and quicker."""
    monkeypatch.setattr(analysis, "WORK_LONG", 320)


def disc(inside=RED, outside=PAPER, scale=2):
    """A disc, in linear light."""
    y, x = np.mgrid[: int(HEIGHT * scale), : int(WIDTH * scale)] / scale
    photo = np.tile(np.array(outside, np.float32), (*x.shape, 1))
    photo[np.hypot(x - CENTRE[0], y - CENTRE[1]) < RADIUS] = inside
    return photo


def steady(**changes):
    """A style that draws outlines with a steady hand over one coat."""
    values = {"wobble": 0.0, "overshoot": 0.0, "swell": 0.0, "force_spread": 0.0, "passes": (Pass(kind="base"),)}
    return Style(**{**values, **changes})


def outlines(photo, style, seed=0, table=None):
    table = table or box()
    sheet = FlatSheet(WIDTH, HEIGHT, table)
    strokes = generate(photo, WIDTH, HEIGHT, table, style, seed, draw=sheet.draw, look=sheet.look, threads=2)
    return [s for s in strokes if s.note == "line"]


def length(stroke):
    return float(np.hypot(*np.diff(stroke.path_mm, axis=0).T).sum())


def round_the_disc(stroke):
    """Degrees that a stroke goes round the disc's centre."""
    angle = np.unwrap(np.arctan2(*(stroke.path_mm - CENTRE).T[::-1]))
    return float(np.degrees(np.abs(angle[-1] - angle[0])))


@pytest.mark.parametrize("closed", [False, True])
def test_outline_lies_on_the_edge(closed):
    lines = outlines(disc(), steady(closed=closed))
    assert lines
    for stroke in lines:
        off = np.linalg.norm(stroke.path_mm - CENTRE, axis=1) - RADIUS
        assert np.abs(off).max() < 2.0 and np.abs(off).mean() < 1.0, "mm"


@pytest.mark.parametrize("place", [160, 201, 240])
@pytest.mark.parametrize("pixels", [320, 400, 640])
def test_clean_straight_edges_are_found(pixels, place):
    """A drawn border, exactly level and exactly between two pixels."""
    photo = np.full((pixels * 3 // 4, pixels, 3), 0.7, np.float32)
    photo[:, place:] = 0.1
    assert sum(map(length, outlines(photo, steady()))) > 0.9 * HEIGHT
    across = np.full((pixels * 3 // 4, pixels, 3), 0.7, np.float32)
    across[place // 2 :] = 0.1
    assert sum(map(length, outlines(across, steady()))) > 0.9 * WIDTH


def test_edges_are_drawn_all_round():
    lines = outlines(disc(), steady())
    assert sum(map(round_the_disc, lines)) > 0.85 * 360
    assert all(s.tip.kind == "sharp" for s in lines)


def test_child_closes_its_outlines():
    style = replace(load_style("child"), wobble=0.0, overshoot=0.0)
    rings = [s for s in outlines(disc(), style) if round_the_disc(s) >= 360]
    assert len(rings) >= 2, "before the fill and once more after it"
    for stroke in rings:
        closing = np.linalg.norm(stroke.path_mm - stroke.path_mm[-1], axis=1)[: len(stroke.path_mm) // 4].min()
        assert closing < 1.0, "mm: the end runs past the beginning"


def test_child_draws_outlines_first_and_last():
    table, style = box(), load_style("child")
    sheet = FlatSheet(WIDTH, HEIGHT, table)
    strokes = generate(disc(), WIDTH, HEIGHT, table, style, 0, draw=sheet.draw, look=sheet.look, threads=2)
    notes = [s.note for s in strokes]
    assert notes[0] == notes[-1] == "line" and set(notes) > {"line"}


def test_outlines_are_darker_than_what_they_surround():
    table = box()
    colours = (0.8, 0.4, 0.4), (0.15, 0.3, 0.5)
    pink_on_blue = disc(*colours)
    for style in (steady(), steady(closed=True)):
        lines = outlines(pink_on_blue, style, table=table)
        lightness = dict(zip(table.names, table.lightness(), strict=True))
        lighter_side = oklab(np.array(colours, np.float32))[:, 0].max()
        assert lines and all(lightness[s.crayon] < lighter_side for s in lines)


def test_outlines_are_coloured():
    """Black is not for everything: a red disc has no black outline."""
    assert {s.crayon for s in outlines(disc(), steady())} <= {"red", "brown"}


@pytest.mark.parametrize("light", [0.97, 0.2])
@pytest.mark.parametrize("closed", [False, True])
def test_flat_pictures_have_no_outlines(light, closed):
    assert outlines(np.full((60, 80, 3), light, np.float32), steady(closed=closed)) == []


def test_more_lines_for_more_budget_and_none_for_none():
    noise = np.random.default_rng(0).random((30, 40, 3)).astype(np.float32).repeat(8, 0).repeat(8, 1)
    lengths = [sum(map(length, outlines(noise, steady(lines=amount)))) for amount in (0.0, 0.2, 0.6)]
    assert lengths[0] == 0 and 0 < lengths[1] < lengths[2]
    assert lengths[1] <= 0.2 * 7 * WIDTH * 1.1


def test_strong_edges_come_first():
    """With little budget the strong disc is drawn, with more the faint one as well."""
    photo = disc((0.1, 0.1, 0.1), (0.6, 0.6, 0.6))
    y, x = np.mgrid[:300, :400] / 2
    photo[np.hypot(x - 165, y - 120) < 20] = (0.35, 0.35, 0.35)
    little, more = (outlines(photo, steady(lines=amount)) for amount in (0.1, 1.0))
    near = [[np.linalg.norm(s.path_mm - CENTRE, axis=1).max() < RADIUS + 2 for s in lines] for lines in (little, more)]
    assert near[0] and all(near[0])
    assert not all(near[1]) and sum(near[1]) >= len(near[0])


def test_light_lines_before_dark_ones():
    table = box()
    noise = np.random.default_rng(1).random((6, 8, 3)).astype(np.float32).repeat(40, 0).repeat(40, 1)
    lines = outlines(noise, steady(), table=table)
    lightness = dict(zip(table.names, table.lightness(), strict=True))
    assert np.diff([lightness[s.crayon] for s in lines]).max() <= 1e-6


def test_a_line_is_pressed_harder_where_the_contrast_is_strong():
    """Along one straight border whose contrast grows from top to bottom."""
    photo = np.full((300, 400, 3), 0.7, np.float32)
    photo[:, 200:] *= np.linspace(0.9, 0.05, 300, dtype=np.float32)[:, None, None]
    lines = outlines(photo, steady(swell=0.0))
    points = np.concatenate([s.path_mm for s in lines])
    force = np.concatenate([s.force_n / s.force_n.max() for s in lines])
    border = np.abs(points[:, 0] - 100) < 3
    upper, lower = border & (points[:, 1] < 60), border & (points[:, 1] > 90) & (points[:, 1] < 140)
    assert lower.any() and (not upper.any() or force[upper].mean() < force[lower].mean())
