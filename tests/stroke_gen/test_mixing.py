"""Mixing: which crayons a surface gets, from a box whose colours are known, and the kernels against
slow twins.
"""

from dataclasses import replace
from itertools import combinations, product
from types import SimpleNamespace

import numpy as np
import pytest
from fake_box import COLOURS, box

from stroke_gen import mixing
from stroke_gen.colour import oklab
from stroke_gen.mixing import LAYERS, Mixtures, chord, clash, find, foreign, greyness
from stroke_gen.swatches import Swatches

TABLE = box()
NAMES = TABLE.names
FULL = np.arange(len(TABLE.pressures) + 1)
SIZE = 30  # cells along the side of a patch


def with_greys():
    """The box with a grey and skin crayons beside the nine."""
    return {
        **COLOURS,
        "grey": (0.25, 0.25, 0.25),
        "peach": (0.8, 0.5, 0.36),
        "tan": (0.45, 0.24, 0.13),
    }


def table_of(*names, colours=None):
    """A box of some crayons."""
    with pytest.MonkeyPatch.context() as patch:
        for name, colour in (colours or with_greys()).items():
            patch.setitem(COLOURS, name, colour)
        table = box()
    return table.only([table.names.index(name) for name in names]) if names else table


def swatch(name, pressure=3, table=TABLE, ground=None):
    """The colour of one crayon at one pressure."""
    return table.over(table.paper if ground is None else ground)[table.names.index(name), pressure]


def scene_of(*colours, skin=(), hair=(), cared=()):
    """Flat patches of linear colours side by side, each a family of its own; `cared` for some."""
    family = np.arange(len(colours), dtype=np.int32).repeat(SIZE)[None].repeat(SIZE, 0)
    lab = oklab(np.array(colours, np.float32))[family]
    maps = {
        name: np.isin(family, chosen).astype(np.float32)
        for name, chosen in (("skin", skin), ("hair", hair), ("care", cared))
    }
    return SimpleNamespace(guide=SimpleNamespace(lab=lab), family=family, **maps)


def found(*colours, table=TABLE, most=9, seed=0, **body):
    """Names of the crayons of each patch."""
    layers = find(scene_of(*colours, **body), table, most, np.random.default_rng(seed)).layers
    return [[table.names[k] for k in row if k >= 0] for row in layers]


# ---- slow twins ----------------------------------------------------------------------------------


def slow_combine(ground, crayons, choice, table):
    """OKLab and price of grain of crayons laid one over the other, `choice` their pressures, 0 for
    none.
    """
    light, dots = np.asarray(ground, float), 0.0
    for k, p in zip(crayons, choice, strict=True):
        if p == 0:
            continue
        dull = float(table.lightness()[k])
        depth = abs(np.sqrt(light @ [0.2126, 0.7152, 0.0722]) - dull) / (1 - min(dull, 0.8))
        dots = dots * table.a[0, k, p - 1].mean() + table.grain[k, p - 1] * min(depth, 1)
        light = table.over(light.astype(np.float32))[k, p - 1].astype(float)
    return oklab(light.astype(np.float32)), mixing.GRAIN_PRICE * dots


@pytest.mark.parametrize("names", [("red",), ("yellow", "blue"), ("white", "pink", "brown"),
                                   ("yellow", "sky", "green", "black")])  # fmt: skip
@pytest.mark.parametrize("ground", [TABLE.paper, (0.9, 0.7, 0.2), (0.1, 0.2, 0.05)])
def test_combine_is_its_slow_twin(names, ground):
    crayons = np.array([NAMES.index(n) for n in names])
    levels = FULL if len(names) < 3 else mixing.few(len(FULL) - 1)[:4]
    choices = list(product(levels, repeat=len(names)))
    colour, price = np.empty((len(choices), 3), np.float32), np.empty(len(choices), np.float32)
    mixing.combine(np.array(ground, np.float32), crayons, levels, mixing.wax(TABLE), colour, price)
    for m, choice in enumerate(choices):
        lab, dear = slow_combine(ground, crayons, choice, TABLE)
        assert np.abs(colour[m] - lab).max() < 1e-3, choice
        assert price[m] == pytest.approx(dear, abs=1e-4), choice


def slow_cost(sample, crayons, table, extra=0.0):
    """Mean over colours (3, n) of the least distance and price over all choices of pressures."""
    every = [slow_combine(table.paper, crayons, choice, table)
             for choice in product(range(len(table.pressures) + 1), repeat=len(crayons))
    ]  # fmt: skip
    off = [np.linalg.norm(sample - lab[:, None], axis=0) + price for lab, price in every]
    return float(np.min(off, 0).mean()) + extra


def test_try_is_its_slow_twin():
    rng = np.random.default_rng(1)
    sample = oklab(rng.random((3, 7, 3)).astype(np.float32)).swapaxes(1, 2).copy()
    pairs = np.array([[0, 3], [1, 6], [2, 8], [4, 5], [-1, -1]])
    extra = rng.random((3, len(NAMES))).astype(np.float32) * 0.1
    allowed = np.ones(len(NAMES), np.bool_)
    allowed[5] = False
    cost = np.empty((3, 5), np.float32)
    mixing._try(
        sample,
        np.broadcast_to(pairs, (3, 5, 2)).copy(),
        extra,
        allowed,
        FULL,
        mixing.wax(TABLE),
        cost,
    )
    for g in range(3):
        for q in range(3):
            slow = slow_cost(sample[g], pairs[q], TABLE, extra[g, pairs[q]].sum())
            assert cost[g, q] == pytest.approx(slow, abs=1e-3)
    assert (cost[:, 3:] > 8).all(), "neither crayons left in the box nor half a mixture"


# ---- what is chosen ------------------------------------------------------------------------------


def prices_of(scene, table, seed=0):
    """Samples, and prices of crayons, as `find` takes them for patches that are neither skin nor
    hair.
    """
    sample = mixing._samples(scene.guide.lab, scene.family, np.random.default_rng(seed))
    return sample, mixing.prices(sample, table) + mixing.LAYER_PRICE


@pytest.mark.parametrize("names, pressures", [(("yellow", "blue"), (4, 2)),
                                              (("white", "red"), (3, 2)),
                                              (("sky", "green"), (3, 3))])  # fmt: skip
def test_no_single_crayon_and_no_pair_is_cheaper_than_what_is_found(names, pressures):
    """For a colour that is exactly a mixture's, by brute force over a box of six."""
    table = table_of("white", "yellow", "sky", "red", "green", "blue")
    colour = table.paper
    for name, p in zip(names, pressures, strict=True):
        colour = swatch(name, p - 1, table, colour)
    scene = scene_of(colour)
    sample, extra = prices_of(scene, table)
    layers = find(scene, table, 9, np.random.default_rng(0)).layers[0]
    taken = layers[layers >= 0]
    cost = slow_cost(sample[0], taken, table, extra[0, taken].sum())
    order = np.argsort(-table.lightness())
    for some in [*combinations(order, 1), *combinations(order, 2)]:
        assert cost <= slow_cost(sample[0], some, table, extra[0, list(some)].sum()) + 1e-3, some


@pytest.mark.parametrize("name", [n for n in COLOURS if n != "white"])
@pytest.mark.parametrize("pressure", [3, 4])
def test_one_crayon_serves_a_colour_that_the_box_holds(name, pressure):
    assert found(swatch(name, pressure)) == [[name]]


def test_two_crayons_mix_what_the_box_does_not_hold():
    two = table_of("blue", "yellow")
    olive = swatch("blue", 3, two, swatch("yellow", 4, two))
    assert found(olive, table=two) == [["yellow", "blue"]]


def test_bare_paper_takes_no_dark_crayon():
    assert set(found(TABLE.paper)[0]) <= {"white"}


@pytest.mark.parametrize("seed", range(3))
def test_mixtures_are_laid_lightest_first_and_no_crayon_twice(seed):
    colours = np.random.default_rng(seed).random((12, 3))
    layers = find(scene_of(*colours), TABLE, 9, np.random.default_rng(0)).layers
    light = TABLE.lightness()
    assert layers.shape == (12, LAYERS)
    for row in layers:
        taken = row[row >= 0]
        assert taken.size and (row[: taken.size] == taken).all(), "what is missing comes last"
        assert len(set(taken)) == taken.size and (np.diff(light[taken]) <= 0).all()


@pytest.mark.parametrize("most", [1, 2, 3, 5, 9])
def test_no_more_crayons_than_asked_for(most):
    colours = np.random.default_rng(1).random((20, 3))
    used = find(scene_of(*colours), TABLE, most, np.random.default_rng(0)).crayons()
    assert 1 <= len(used) <= most and all(0 <= k < len(NAMES) for k in used)


def test_of_few_crayons_the_least_missed_are_left():
    """A large red, a large blue and a speck of green: with two crayons the green goes."""
    red, blue, green = (swatch(n, 4) for n in ("red", "blue", "green"))
    used = find(
        scene_of(red, red, red, blue, blue, green), TABLE, 2, np.random.default_rng(0)
    ).crayons()
    assert {NAMES[k] for k in used} == {"red", "blue"}


def test_where_care_is_due_a_surface_has_the_larger_say():
    """Two patches of red ground and one subject of green: with one crayon it is the subject's."""
    red, green = (swatch(n, 4) for n in ("red", "green"))
    for cared, left in (((), "red"), ((2,), "green")):
        scene = scene_of(red, red, green, cared=cared)
        used = find(scene, TABLE, 1, np.random.default_rng(0)).crayons()
        assert [NAMES[k] for k in used] == [left]


def test_pressures_tried_with_four_crayons_go_from_none_to_the_hardest():
    for number in range(1, 9):
        some = mixing.few(number)
        assert some[0] == 0 and some[-1] == number and len(some) == min(number + 1, 5)
        assert np.diff(some).min() > 0


def test_every_tone_of_a_surface_counts():
    """A surface of yellow and blue halves needs both, though its mean colour needs neither."""
    scene = scene_of(swatch("yellow", 4), swatch("blue", 4))
    scene.family = np.zeros_like(scene.family)
    layers = find(scene, TABLE, 9, np.random.default_rng(0)).layers
    assert {"yellow", "blue"} <= {NAMES[k] for k in layers[0] if k >= 0}


def test_grain_is_avoided():
    """Of two crayons of one colour the one with less grain is taken."""
    red = NAMES.index("red")
    twins = TABLE.only([red, red])
    for smooth, factors in ((1, [[3], [1]]), (0, [[1], [3]])):
        rough = replace(twins, grain=twins.grain * np.array(factors, np.float32))
        layers = find(scene_of(swatch("red")), rough, 9, np.random.default_rng(0)).layers
        assert layers[0].tolist() == [smooth, -1, -1, -1]


def test_same_seed_same_mixtures():
    colours = np.random.default_rng(2).random((12, 3))
    one, two = (
        find(scene_of(*colours), TABLE, 6, np.random.default_rng(3)).layers for _ in range(2)
    )
    assert (one == two).all()


def test_the_order_of_the_box_does_not_matter():
    colours = np.random.default_rng(3).random((10, 3))
    other = TABLE.only([4, 0, 8, 2, 6, 1, 7, 3, 5])
    assert found(*colours) == found(*colours, table=other)


# ---- prices --------------------------------------------------------------------------------------


def taken(monkeypatch, name, value, colour, table):
    monkeypatch.setattr(mixing, name, value)
    return set(found(colour, table=table)[0])


def test_a_hue_that_opposes_the_surface_has_its_price(monkeypatch):
    """Red under green fits this olive exactly; whether it is taken is a matter of the price."""
    monkeypatch.setattr(mixing, "HUE_PRICE", 0.0)
    table = table_of("red", "green", "black")
    olive = swatch("green", 4, table, swatch("red", 1, table))
    assert "red" in taken(monkeypatch, "OPPOSED_PRICE", 0.0, olive, table)
    assert "red" not in taken(monkeypatch, "OPPOSED_PRICE", 5.0, olive, table)


def test_another_hue_has_its_price_where_the_box_has_a_crayon_of_the_hue(monkeypatch):
    """Yellow and sky fit this green exactly, as the price of opposed hues lets them."""
    monkeypatch.setattr(mixing, "OPPOSED_PRICE", 0.0)
    monkeypatch.setattr(mixing, "LOUD_PRICE", 0.0)
    fresh = {**with_greys(), "sky": (0.02, 0.6, 0.5), "green": (0.3, 0.7, 0.05)}
    few, more = (table_of("yellow", "sky", *green, colours=fresh) for green in ([], ["green"]))
    mixed = swatch("sky", 3, few, swatch("yellow", 4, few))
    assert taken(monkeypatch, "HUE_PRICE", 0.0, mixed, more) >= {"yellow", "sky"}
    assert taken(monkeypatch, "HUE_PRICE", 5.0, mixed, more) == {"green"}
    assert taken(monkeypatch, "HUE_PRICE", 5.0, mixed, few) == {"yellow", "sky"}


def test_bodies_have_their_own_prices_of_hue(monkeypatch):
    """As far as hue goes, skin and hair may be turned; what is foreign to them is priced apart."""
    monkeypatch.setattr(mixing, "BODY_PRICE", np.float32(0))
    monkeypatch.setattr(mixing, "OPPOSED_PRICE", 0.0)
    monkeypatch.setattr(mixing, "LOUD_PRICE", 0.0)
    table = table_of("yellow", "pink", "tan")
    mixed = swatch("pink", 3, table, swatch("yellow", 4, table))
    monkeypatch.setattr(mixing, "HUE_PRICE", 5.0)
    assert found(mixed, table=table) == [["tan"]]
    for body in ("skin", "hair"):
        assert set(found(mixed, table=table, **{body: [0]})[0]) >= {"yellow", "pink"}


def test_a_hue_of_some_of_the_surface_is_its_own(monkeypatch):
    table = table_of("yellow", "blue", "black")
    for some, dear in ((2, True), (10, False)):
        patches = np.array([swatch("yellow", 4)] * (24 - some) + [swatch("blue", 4)] * some)
        sample = oklab(patches).T[None].copy()
        prices = []
        for price in (0.0, 1.0):
            monkeypatch.setattr(mixing, "HUE_PRICE", price)
            prices.append(mixing.prices(sample, table)[0])
        yellow, blue, black = prices[1] - prices[0]
        assert (blue > 0.1) == dear and max(yellow, black) < 0.05


def test_grey_in_a_colour_has_its_price(monkeypatch):
    table = table_of("red", "grey", "black")
    dull = swatch("red", 3, table, swatch("grey", 3, table))
    assert "grey" in taken(monkeypatch, "GREY_PRICE", 0.0, dull, table)
    assert "grey" not in taken(monkeypatch, "GREY_PRICE", 5.0, dull, table)


def test_greys_go_with_stone_at_any_price(monkeypatch):
    table = table_of("brown", "grey")
    assert "grey" in taken(monkeypatch, "GREY_PRICE", 5.0, swatch("grey", 3, table), table)


def test_a_loud_crayon_in_a_quiet_surface_has_its_price(monkeypatch):
    table = table_of("red", "grey")
    rosy = swatch("red", 0, table, swatch("grey", 3, table))
    assert "red" in taken(monkeypatch, "LOUD_PRICE", 0.0, rosy, table)
    assert "red" not in taken(monkeypatch, "LOUD_PRICE", 5.0, rosy, table)


def test_black_in_the_light_has_its_price(monkeypatch):
    table = table_of("black")
    table = replace(table, grain=0 * table.grain)
    sample = mixing._samples(
        oklab(np.full((9, 9, 3), 0.8, np.float32)),
        np.zeros((9, 9), np.int32),
        np.random.default_rng(0),
    )
    assert mixing.prices(sample, table)[0, 0] > 0
    dark = np.zeros_like(sample)
    assert mixing.prices(dark, table)[0, 0] == pytest.approx(0, abs=1e-6)


def test_skin_takes_no_foreign_crayon_where_the_box_has_its_own():
    """Green under red comes nearer to this tan than anything else but costs what is foreign."""
    table = table_of(
        "white", "peach", "tan", "brown", "pink", "red", "green", "blue", "grey", "black"
    )
    rng = np.random.default_rng(4)
    shades = [swatch("tan", p, table, swatch("peach", q, table)) + rng.uniform(-0.04, 0.04, 3)
              for p, q in product((0, 2, 4), (1, 4))]  # fmt: skip
    skins = found(*np.clip(shades, 0, 1), table=table, skin=range(6))
    assert not {k for mixture in skins for k in mixture} & {"green", "blue", "grey", "black"}


def test_skin_and_hair_are_priced_and_cloth_is_not(monkeypatch):
    table = table_of("sky", "peach")
    pale = swatch("sky", 2, table)
    assert found(pale, table=table) == [["sky"]]
    monkeypatch.setattr(mixing, "BODY_PRICE", np.float32(5))
    assert found(pale, table=table) == [["sky"]]
    for body in ("skin", "hair"):
        assert found(pale, table=table, **{body: [0]}) == [["peach"]]


def test_what_is_foreign_to_skin():
    table = table_of()
    strange = dict(zip(table.names, foreign(table, mixing.SKIN_RAD), strict=True))
    assert all(strange[name] > 0.8 for name in ("green", "blue", "sky", "grey", "black")), strange
    assert (
        all(strange[name] < 0.2 for name in ("peach", "tan", "white")) and strange["brown"] < 0.5
    ), strange
    assert (foreign(table, mixing.HAIR_RAD) <= foreign(table, mixing.SKIN_RAD) + 1e-6).all()


def test_opposing_hues_clash():
    some = np.array([COLOURS[name] for name in ("red", "pink", "green", "black")], np.float32)
    red, pink, green, black = oklab(some)[:, 1:]
    assert clash(red, green) > 3 * clash(red, pink)
    assert clash(red, red) == pytest.approx(0, abs=1e-3) and clash(red, black) < 0.05
    assert clash(red, green) == pytest.approx(clash(green, red))


def test_how_far_apart_two_hues_are_is_their_angle_s_chord():
    angle = np.deg2rad(np.arange(0, 181, 5))
    chords = chord(np.array([0.2, 0.0]), 0.2 * np.stack([np.cos(angle), np.sin(angle)], 1))
    assert np.allclose(chords, 0.4 * np.sin(angle / 2), atol=1e-6)
    assert chord(np.array([0.2, 0.0]), np.zeros(2)) == 0, "grey is of any hue"


def test_near_hues_do_not_clash_and_the_farther_apart_others_are_the_more_they_do():
    angle = np.deg2rad(np.arange(0, 181, 5))
    clashes = clash(np.array([0.2, 0.0]), 0.1 * np.stack([np.cos(angle), np.sin(angle)], 1))
    assert np.abs(clashes[angle < 0.6]).max() < 1e-6
    assert (np.diff(clashes) >= -1e-6).all() and (np.diff(clashes[angle > 1.3]) > 0).all()


def test_black_is_no_grey():
    assert greyness(
        oklab(np.array([[0.25] * 3, COLOURS["black"], COLOURS["red"]], np.float32))
    ) == pytest.approx([1, 0, 0], abs=0.02)


# ---- the box -------------------------------------------------------------------------------------


def test_box_of_only_the_crayons_in_use():
    some = Mixtures(np.array([[4, 7, -1, -1], [2, -1, -1, -1], [7, 2, -1, -1]]))
    assert some.crayons() == [2, 4, 7]
    assert some.alone().layers.tolist() == [[1, 2, -1, -1], [0, -1, -1, -1], [2, 0, -1, -1]]


def test_a_single_crayon_and_a_box_of_a_hundred():
    assert found((0.2, 0.3, 0.5), table=TABLE.only([3])) == [["red"]]
    shades = np.random.default_rng(5).uniform(0.6, 1, (99, 1, 3)).astype(np.float32)
    many = Swatches(
        tuple(map(str, range(99))), TABLE.pressures, np.tile(TABLE.a, (1, 11, 1, 1)),
        np.tile(TABLE.b, (1, 11, 1, 1)) * shades, np.tile(TABLE.grain, (11, 1)), TABLE.paper,
    )  # fmt: skip
    assert (
        1
        <= len(
            {k for row in found((0.5, 0.2, 0.1), (0.1, 0.4, 0.3), table=many, most=3) for k in row}
        )
        <= 3
    )


def test_samples_are_of_each_surface():
    family = np.random.default_rng(6).integers(0, 5, (40, 50)).astype(np.int32)
    lab = np.stack([family.astype(np.float32)] * 3, 2)
    sample = mixing._samples(lab, family, np.random.default_rng(0))
    assert all((sample[g] == g).all() for g in range(5)) and sample.shape == (5, 3, mixing.SAMPLES)
