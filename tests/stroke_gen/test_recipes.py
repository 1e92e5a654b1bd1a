"""Recipes: which crayons a picture gets, from a box whose colours are known."""

from dataclasses import replace

import numpy as np
import pytest
from fake_box import COLOURS, box
from stroke_gen.recipes import Recipes, clash, find, nearest

from stroke_gen import recipes
from stroke_gen.colour import oklab

TABLE = box()
NAMES = TABLE.names


def patches(*colours, size=40):
    """Flat areas of linear colours side by side, in OKLab."""
    return oklab(np.concatenate([np.tile(np.array(c, np.float32), (size, size, 1)) for c in colours], 1))


def swatch(name, pressure=3):
    """The colour of one crayon at one pressure on bare paper."""
    return TABLE.over(TABLE.paper)[NAMES.index(name), pressure]


def found(lab, groups=8, most=9, table=TABLE, seed=0):
    return find(lab, table, groups, most, np.random.default_rng(seed))


def mix(result, colour):
    """Names of base and shade for one colour."""
    g = int(nearest(oklab(np.asarray(colour, np.float32)) * np.array([recipes.TONE, 1, 1]), result.centres))
    return NAMES[result.base[g]], NAMES[result.shade[g]]


def test_groups_of_colour_are_found():
    colours = [swatch(name) for name in ("red", "blue", "yellow", "green", "black")]
    result = found(patches(*colours), groups=12)
    assert len(result.centres) == 5
    expected = oklab(np.array(colours)) * np.array([recipes.TONE, 1, 1])
    assert np.abs(np.sort(result.centres, 0) - np.sort(expected, 0)).max() < 1e-3


@pytest.mark.parametrize("name", COLOURS)
@pytest.mark.parametrize("pressure", [2, 3, 4])
def test_one_crayon_serves_a_colour_that_the_box_holds(name, pressure):
    result = found(patches(swatch(name, pressure)))
    assert len(result.centres) == 1
    assert mix(result, swatch(name, pressure)) == (name, name)


def test_two_crayons_mix_what_the_box_does_not_hold():
    yellow, blue = NAMES.index("yellow"), NAMES.index("blue")
    green = TABLE.over(TABLE.over(TABLE.paper)[yellow, 3])[blue, 1]
    two = TABLE.only([yellow, blue])
    result = found(patches(green), table=two)
    assert (two.names[result.base[0]], two.names[result.shade[0]]) == ("yellow", "blue")


@pytest.mark.parametrize("most", [1, 2, 3, 5, 9])
def test_no_more_crayons_than_asked_for(most):
    noise = np.random.default_rng(1).random((60, 80, 3)).astype(np.float32)
    used = found(oklab(noise), groups=20, most=most).crayons()
    assert 1 <= len(used) <= most
    assert all(0 <= k < len(NAMES) for k in used)


def test_more_crayons_never_fit_worse():
    """Every colour's best swatch among the crayons taken comes nearer with more of them."""
    noise = np.random.default_rng(2).random((60, 80, 3)).astype(np.float32)
    colours = oklab(noise.reshape(-1, 3))
    miss = []
    for most in (1, 3, 6, 9):
        taken = TABLE.only(found(oklab(noise), 20, most).crayons())
        reach = oklab(taken.over(taken.over(taken.paper))).reshape(-1, 3)
        miss.append(np.mean([np.linalg.norm(reach - c, axis=1).min() for c in colours[::40]]))
    assert all(np.diff(miss) <= 0.002)
    assert miss[0] > 2 * miss[-1]


def test_light_lies_under_dark():
    light = TABLE.lightness()
    for seed in range(4):
        noise = np.random.default_rng(seed).random((60, 80, 3)).astype(np.float32)
        result = found(oklab(noise), groups=20, seed=seed)
        assert (light[result.base] >= light[result.shade]).all()


def test_tones_of_one_hue_share_a_recipe():
    """Force gives tone: a red ball needs no more recipes than a few."""
    depth = np.linspace(0.15, 1, 60, dtype=np.float32)[None, :, None]
    red = np.tile(swatch("red") * depth + 0.2 * (depth - 0.15), (40, 1, 1))
    result = found(oklab(red), groups=4)
    assert len(set(zip(result.base.tolist(), result.shade.tolist(), strict=True))) <= 3
    assert "green" not in {NAMES[k] for k in result.crayons()}


def test_grain_is_avoided():
    """Of two crayons of one colour the one with less grain is taken."""
    red = NAMES.index("red")
    twins = TABLE.only([red, red])
    rough = replace(twins, grain=twins.grain * np.array([[3], [1]], np.float32))
    assert found(patches(swatch("red")), table=rough).base.tolist() == [1]
    rough = replace(twins, grain=twins.grain * np.array([[1], [3]], np.float32))
    assert found(patches(swatch("red")), table=rough).base.tolist() == [0]


def test_opposing_hues_clash():
    hue = oklab(np.array([COLOURS[n] for n in ("red", "pink", "green", "black")], np.float32))[:, 1:]
    red, pink, green, black = hue
    assert clash(red, green) > 3 * clash(red, pink)
    assert clash(red, red) == pytest.approx(0, abs=1e-3) and clash(red, black) < 0.05
    assert clash(red, green) == pytest.approx(clash(green, red))


@pytest.mark.parametrize("price, taken", [(0.0, True), (1.0, False)])
def test_opposing_hues_have_their_price(monkeypatch, price, taken):
    """Red under green fits this brown exactly; whether it is taken is a matter of the price."""
    monkeypatch.setattr(recipes, "CLASH_PRICE", price)
    red, green, black = (NAMES.index(name) for name in ("red", "green", "black"))
    brown = TABLE.over(TABLE.over(TABLE.paper)[red, 3])[green, 1]
    few = TABLE.only([red, green, black])
    result = found(patches(brown), table=few)
    assert ({few.names[result.base[0]], few.names[result.shade[0]]} == {"red", "green"}) is taken


@pytest.mark.parametrize("price, taken", [(0.0, True), (1.0, False)])
def test_grey_under_a_strong_colour_has_its_price(monkeypatch, price, taken):
    """Grey under red fits this dull red exactly; whether it is taken is a matter of the price."""
    monkeypatch.setattr(recipes, "DULL_PRICE", price)
    monkeypatch.setitem(COLOURS, "grey", (0.25, 0.25, 0.25))
    table = box()
    few = table.only([table.names.index(name) for name in ("red", "grey", "black")])
    dull_red = few.over(few.over(few.paper)[1, 4])[0, 3]
    result = found(patches(dull_red), table=few)
    assert ({few.names[result.base[0]], few.names[result.shade[0]]} == {"grey", "red"}) is taken


def test_greys_go_with_earth_and_stone(monkeypatch):
    """What is not strong may have grey in it at any price."""
    monkeypatch.setattr(recipes, "DULL_PRICE", 1.0)
    monkeypatch.setitem(COLOURS, "grey", (0.25, 0.25, 0.25))
    table = box()
    few = table.only([table.names.index(name) for name in ("brown", "grey")])
    stone = few.over(few.over(few.paper)[1, 3])[0, 1]
    result = found(patches(stone), table=few)
    assert (few.names[result.base[0]], few.names[result.shade[0]]) == ("grey", "brown")


def test_black_is_no_grey():
    greyness = recipes._greyness(oklab(np.array([[0.25] * 3, COLOURS["black"], COLOURS["red"]], np.float32)))
    assert greyness == pytest.approx([1, 0, 0], abs=0.02)


def test_rival_is_nearly_as_good_and_of_like_hue_under_the_same_shade():
    hues = np.array([[0.1, 0.1], [0.12, 0.1], [-0.2, 0.1], [0, 0], [0.1, 0.12]], np.float32)
    pairs = np.array([[0, 3], [1, 3], [2, 3], [4, 2], [3, 3]])
    cost = np.array([[0.1, 0.112, 0.101, 0.1, 0.1]], np.float32)
    base, shade = np.array([0]), np.array([3])
    assert recipes._rivals(cost, pairs, base, shade, hues).tolist() == [1]
    cost[0, 1] = 0.1 + 2 * recipes.RIVAL
    assert recipes._rivals(cost, pairs, base, shade, hues).tolist() == [0]


def test_rivals_of_a_picture_are_of_like_hue():
    noise = np.random.default_rng(3).random((60, 80, 3)).astype(np.float32)
    result = found(oklab(noise), groups=20)
    hues = oklab(TABLE.over(TABLE.paper))[:, -3, 1:]
    assert np.linalg.norm(hues[result.rival] - hues[result.base], axis=1).max() < recipes.RIVAL_HUE
    assert (result.rival[result.rival != result.base] != result.shade[result.rival != result.base]).all()


def test_nearest_is_what_a_search_of_all_gives():
    rng = np.random.default_rng(4)
    colours, centres = rng.random((30, 20, 3)).astype(np.float32), rng.random((7, 3)).astype(np.float32)
    slow = np.linalg.norm(colours[:, :, None] - centres, axis=3).argmin(2)
    assert (nearest(colours, centres) == slow).all()


def test_same_seed_same_recipes():
    noise = oklab(np.random.default_rng(5).random((60, 80, 3)).astype(np.float32))
    one, two, other = found(noise, seed=6), found(noise, seed=6), found(noise, seed=7)
    assert all((getattr(one, f) == getattr(two, f)).all() for f in ("centres", "base", "shade", "rival"))
    assert one.centres.shape != other.centres.shape or (one.centres != other.centres).any()


def test_box_of_only_the_crayons_in_use():
    some = Recipes(np.zeros((3, 3), np.float32), np.array([4, 7, 2]), np.array([7, 7, 4]), np.array([4, 2, 2]))
    assert some.crayons() == [2, 4, 7]
    alone = some.alone()
    assert (alone.base.tolist(), alone.shade.tolist(), alone.rival.tolist()) == ([1, 2, 0], [2, 2, 1], [1, 0, 0])


@pytest.mark.parametrize("shape", [(2, 2), (2, 640), (1, 1)])
def test_tiny_pictures(shape):
    lab = oklab(np.random.default_rng(8).random((*shape, 3)).astype(np.float32))
    assert found(lab, groups=30).crayons()
