"""Outlines: where they run, how many there are, in which crayon; and that a child closes them."""

from dataclasses import replace

import numpy as np
import pytest
from fake_box import PAPER, FlatSheet, box

from stroke_gen import analysis
from stroke_gen.colour import oklab
from stroke_gen.generate import generate
from stroke_gen.params import Pass, Style, load_style
from stroke_gen.subject import Subject

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
    values = {"wobble": 0.0, "overshoot": 0.0, "swell": 0.0, "force_spread": 0.0, "margin_mm": 0.0,
              "passes": (Pass(),)}  # fmt: skip
    return Style(**{**values, **changes})


def strokes_of(photo, style, seed=0, table=None, mask=None):
    table = table or box()
    sheet = FlatSheet(WIDTH, HEIGHT, table)
    who = Subject(
        (), np.zeros(analysis.work_shape(WIDTH, HEIGHT), np.float32) if mask is None else mask
    )
    return generate(
        photo, who, (WIDTH, HEIGHT), table, style, seed, draw=sheet.draw, look=sheet.look, threads=2
    )


def outlines(photo, style, seed=0, table=None, mask=None):
    return [s for s in strokes_of(photo, style, seed, table, mask) if s.note == "line"]


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
        closing = np.linalg.norm(stroke.path_mm - stroke.path_mm[-1], axis=1)[
            : len(stroke.path_mm) // 4
        ].min()
        assert closing < 1.0, "mm: the end runs past the beginning"


def test_child_draws_outlines_first_and_last():
    notes = [s.note for s in strokes_of(disc(), load_style("child"))]
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
    noise = (
        np.random.default_rng(0).random((30, 40, 3)).astype(np.float32).repeat(8, 0).repeat(8, 1)
    )
    lengths = [
        sum(map(length, outlines(noise, steady(lines=amount)))) for amount in (0.0, 0.2, 0.6)
    ]
    assert lengths[0] == 0 and 0 < lengths[1] < lengths[2]
    assert lengths[1] <= 0.2 * 7 * WIDTH * 1.1


def test_strong_edges_come_first():
    """With little budget the strong disc is drawn, with more the faint one as well."""
    photo = disc((0.1, 0.1, 0.1), (0.6, 0.6, 0.6))
    y, x = np.mgrid[:300, :400] / 2
    photo[np.hypot(x - 165, y - 120) < 20] = (0.35, 0.35, 0.35)
    little, more = (outlines(photo, steady(lines=amount)) for amount in (0.1, 1.0))
    near = [
        [np.linalg.norm(s.path_mm - CENTRE, axis=1).max() < RADIUS + 2 for s in lines]
        for lines in (little, more)
    ]
    assert near[0] and all(near[0])
    assert not all(near[1]) and sum(near[1]) >= len(near[0])


def test_silhouettes_come_first():
    """Of two like discs the one who is drawn has the line, where there is line for one only."""
    y, x = np.mgrid[:300, :400] / 2
    photo = np.full((300, 400, 3), 0.6, np.float32)
    for cx in (50, 150):
        photo[np.hypot(x - cx, y - 75) < 35] = (0.25, 0.25, 0.25)
    cells = analysis.work_shape(WIDTH, HEIGHT)
    x = np.arange(cells[1]) * WIDTH / cells[1]
    for left in (True, False):
        mask = np.tile(np.where((x < 100) == left, 1, 0).astype(np.float32), (cells[0], 1))
        y_, x_ = np.mgrid[: cells[0], : cells[1]] * (WIDTH / cells[1])
        mask *= np.hypot(x_ - (50 if left else 150), y_ - 75) < 35
        lines = outlines(photo, steady(lines=0.12), mask=mask)
        assert lines and all((s.path_mm[:, 0].max() < 100) == left for s in lines)


@pytest.mark.parametrize("radius, inner", [(28, False), (60, True)])
def test_no_line_is_drawn_inside_a_small_subject(radius, inner):
    """Its silhouette has its line all the same."""
    y, x = np.mgrid[:300, :400] / 2
    photo = np.full((300, 400, 3), 0.7, np.float32)
    off = np.hypot(x - CENTRE[0], y - CENTRE[1])
    photo[off < radius] = 0.3
    photo[off < 14] = 0.02
    cells = analysis.work_shape(WIDTH, HEIGHT)
    y, x = np.mgrid[: cells[0], : cells[1]] * (WIDTH / cells[1])
    mask = (np.hypot(x - CENTRE[0], y - CENTRE[1]) < radius).astype(np.float32)
    lines = outlines(photo, steady(), mask=mask)
    far = [np.linalg.norm(s.path_mm - CENTRE, axis=1).mean() for s in lines]
    assert any(abs(d - radius) < 3 for d in far), "the silhouette"
    assert any(d < radius - 8 for d in far) == inner


@pytest.mark.parametrize("hardest", [0.1, 0.2, 0.4])
def test_the_lightest_hand_draws_lines(hardest):
    assert outlines(disc(), steady(hardest=hardest))


@pytest.mark.parametrize("style", ["artist", "sketch", "fine", "solid", "child"])
def test_lines_stay_inside_the_margin(style):
    photo = (
        np.random.default_rng(2).random((6, 8, 3)).astype(np.float32).repeat(40, 0).repeat(40, 1)
    )
    style = replace(
        load_style(style), wobble=0.0, overshoot=0.0, margin_mm=15.0, fade=0.0, search=1
    )
    lines = outlines(photo, style)
    points = np.concatenate([s.path_mm for s in lines])
    outside = (points < 12).any(1) | (points > np.array([WIDTH, HEIGHT]) - 12).any(1)
    assert len(lines) > 5 and outside.mean() < 0.01


def test_a_line_is_darker_than_both_sides_of_it():
    """A border between two middle tones, seen on a sheet where all is drawn."""
    table, photo = box(), disc((0.25, 0.12, 0.06), (0.35, 0.3, 0.25))
    sheet = FlatSheet(WIDTH, HEIGHT, table)
    who = Subject((), np.zeros(analysis.work_shape(WIDTH, HEIGHT), np.float32))
    generate(
        photo, who, (WIDTH, HEIGHT), table, steady(), 0, draw=sheet.draw, look=sheet.look, threads=2
    )
    light = oklab(sheet.light)[..., 0]
    y, x = np.mgrid[: light.shape[0], : light.shape[1]] * (WIDTH / light.shape[1])
    off = np.hypot(x - CENTRE[0], y - CENTRE[1]) - RADIUS
    line, inner, outer = (
        np.median(light[on])
        for on in (np.abs(off) < 0.5, (off < -6) & (off > -15), (off > 6) & (off < 15))
    )
    assert line < inner - 0.04 and line < outer - 0.04


def test_a_line_is_drawn_as_often_as_the_hand_searches():
    once, thrice = (outlines(disc(), steady(search=n)) for n in (1, 3))
    assert len(thrice) == 3 * len(once) > 0
    hands = [outlines(disc(), steady(search=2, wobble=0.2))[i].path_mm for i in (0, len(once))]
    assert not np.array_equal(*hands)


def test_light_lines_before_dark_ones():
    table = box()
    noise = (
        np.random.default_rng(1).random((6, 8, 3)).astype(np.float32).repeat(40, 0).repeat(40, 1)
    )
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
