"""Light: the Kubelka-Munk laws, the renderer against its twin, and the lamp."""

import naive
import numpy as np
import pytest
from bench_sheet import Bench, old_wax

from crayonize.images.icc import encode_srgb
from crayonize.light import optics
from crayonize.wax.physics import physics

over = optics._over
# what wax of refractive index 1.44 reflects, and the film that does half of it
FRONT, FILM_UM = 0.0325, 0.5


@pytest.fixture
def table(crayons):
    """A bench for pictures, where the physics does not matter."""
    return Bench(physics("metric"), crayons)


def films(table, columns, ground=(1.0, 1.0, 1.0), light=False):
    """Colours of columns given as lists of (crayon, um), bottom up."""
    sheet = table.sheet(np.zeros((1, len(columns))))
    names = [c.name for c in table.palette.crayons]
    for cell, column in enumerate(columns):
        sheet.used[cell] = len(column)
        for j, (crayon, height) in enumerate(column):
            sheet.crayon[cell, j], sheet.layer[cell, j] = names.index(crayon), height
        sheet.total[cell] = sum(height for _, height in column)
    return optics.render(sheet, ground, light=light)[0]


def random_layers(number):
    """Kubelka-Munk layers over six decades, and grounds."""
    rng = np.random.default_rng(1)
    kh, sh = 10 ** rng.uniform(-4, 2, (2, number))
    return np.float32(kh), np.float32(sh), rng.random(number, np.float32)


# ---- one layer -----------------------------------------------------------------------------------


def test_a_layer_is_kubelkas_formula():
    for kh, sh, ground in zip(*random_layers(3000), strict=True):
        assert over(ground, kh, sh) == pytest.approx(naive.over(ground, kh, sh), abs=2e-5)


def test_white_furnace():
    """Wax that absorbs nothing over a white ground returns all the light, at any thickness."""
    for sh in 10.0 ** np.arange(-6, 3.1, 0.5):
        assert over(np.float32(1), np.float32(0), np.float32(sh)) == pytest.approx(1.0, abs=1e-5)
    for kh, sh, ground in zip(*random_layers(3000), strict=True):
        assert 0 <= over(ground, kh, sh) <= 1
        grey = over(ground, np.float32(0), sh)
        assert ground - 1e-6 <= grey <= 1 + 1e-6


def test_a_layer_split_in_two_gives_the_same_colour():
    rng = np.random.default_rng(2)
    for kh, sh, ground in zip(*random_layers(3000), strict=True):
        share = np.float32(rng.random())
        lower = over(ground, share * kh, share * sh)
        assert over(lower, (1 - share) * kh, (1 - share) * sh) == pytest.approx(
            over(ground, kh, sh), abs=2e-5
        )


def test_no_wax_shows_the_ground_and_much_wax_hides_it():
    for kh, sh, ground in zip(*random_layers(300), strict=True):
        assert over(ground, np.float32(0), np.float32(0)) == ground
        assert over(ground, 1e-7 * kh, 1e-7 * sh) == pytest.approx(ground, abs=1e-4)
        ratio = float(kh) / float(sh)
        r_inf = 1 + ratio - np.sqrt(ratio**2 + 2 * ratio)
        much = np.float32(40 / np.sqrt(kh * (kh + 2 * sh)))
        for other in (np.float32(0), ground, np.float32(1)):
            assert over(other, much * kh, much * sh) == pytest.approx(r_inf, rel=1e-3, abs=2e-6)


def test_two_grounds_give_back_absorption_and_scattering():
    """Curtis et al.: what a layer shows over white and over black fixes its k and s."""
    rng = np.random.default_rng(3)
    for kh, sh in rng.uniform(0.1, 1.5, (300, 2)):
        white, black = (float(over(np.float32(g), np.float32(kh), np.float32(sh))) for g in (1, 0))
        a = (white + (black - white + 1) / black) / 2
        b = np.sqrt(a * a - 1)
        found_s = np.arctanh(b * (1 - white) / (b * b - (a - white) * (a - 1))) / b
        assert (found_s, found_s * (a - 1)) == pytest.approx((sh, kh), rel=5e-3)


# ---- columns of wax ------------------------------------------------------------------------------


@pytest.mark.parametrize("ground", [(1.0, 1.0, 1.0), (0.02, 0.01, 0.015), (0.9, 0.6, 0.3)])
def test_a_picture_is_its_columns_bottom_up(table, ground):
    rng = np.random.default_rng(4)
    sheet = old_wax(table.sheet(np.zeros((23, 31))), rng)
    picture = optics.render(sheet, ground, light=False)
    assert picture.dtype == np.float32 and picture.shape == (23, 31, 3)
    for at, column in naive.columns_of(sheet).items():
        np.testing.assert_allclose(
            picture[at], naive.colour(column, ground, sheet.optics, FRONT, FILM_UM), atol=2e-5
        )
    np.testing.assert_array_equal(
        picture[sheet.film_um() == 0], np.float32(ground) + 0 * picture[sheet.film_um() == 0]
    )


def test_a_split_film_and_a_sunk_film_look_the_same(table):
    whole, split = films(table, [[("blue", 7.0)], [("blue", 2.5), ("blue", 4.5)]])
    np.testing.assert_allclose(whole, split, atol=1e-5)
    sheet = table.sheet(np.zeros((1, 1)))
    sheet.total[0] = sheet.blend[0, 0] = 7.0
    sheet.blend[0, 1:] = 7.0 * sheet.optics[2]
    np.testing.assert_allclose(
        optics.render(sheet, (1.0, 1.0, 1.0), light=False)[0, 0], whole, atol=1e-5
    )


def test_the_order_of_layers_matters(table):
    yellow_on_blue, blue_on_yellow = films(
        table, [[("blue", 6), ("yellow", 6)], [("yellow", 6), ("blue", 6)]]
    )
    assert np.abs(yellow_on_blue - blue_on_yellow).max() > 0.03
    assert yellow_on_blue[0] > blue_on_yellow[0]  # what lies on top colours more
    for mixed in (yellow_on_blue, blue_on_yellow):
        assert mixed[1] > max(mixed[0], mixed[2])  # green


def test_colours_stay_visible_on_black_paper(table):
    black = (0.01, 0.01, 0.01)
    for crayon, (high, low) in {
        "red": (0, 2),
        "yellow": (0, 2),
        "blue": (2, 0),
        "green": (1, 0),
    }.items():
        thin, usual = films(table, [[(crayon, 3.0)], [(crayon, 12.0)]], black)
        on_white = films(table, [[(crayon, 12.0)]])[0]
        assert usual[high] > thin[high] > 1.5 * black[0]
        for seen in (usual, on_white):
            assert seen[high] > 1.3 * seen[low]
    assert films(table, [[("white", 12.0)]], black)[0].min() > 0.2


def test_more_wax_takes_a_colour_further_from_the_paper(table):
    seen = films(table, [[("red", um)] for um in (0.0, 0.5, 2.0, 8.0, 30.0)])
    assert (np.diff(seen[:, 1]) < 0).all() and (np.diff(seen[:, 2]) < 0).all()


# ---- the lamp ------------------------------------------------------------------------------------


def test_the_lamp_can_be_switched_off(table, monkeypatch):
    monkeypatch.setattr(optics, "FRONT", 0.0)
    rng = np.random.default_rng(5)
    rough = old_wax(table.sheet(40 * rng.random((40, 40))), rng)
    flat = table.sheet(np.zeros((40, 40)))
    for name in ("total", "used", "crayon", "layer", "blend"):
        getattr(flat, name)[:] = getattr(rough, name)
    off = optics.render(rough, (0.7, 0.7, 0.7), light=False)
    np.testing.assert_array_equal(off, optics.render(flat, (0.7, 0.7, 0.7), light=False))
    on = optics.render(rough, (0.7, 0.7, 0.7))
    assert 0.005 < np.abs(on - off).mean() < 0.2 and on.min() >= 0 and on.max() <= 1
    np.testing.assert_allclose(on / on[..., :1], off / off[..., :1], rtol=1e-4)  # the hue stays


@pytest.mark.parametrize("um_a_cell", [0.2, 1.0, 5.0])
def test_a_slope_of_wax_is_lit_by_its_rise_and_bounded(table, um_a_cell, monkeypatch):
    """.7 % brighter for each 1/100 that wax rises away from the lamp, and never more than a
    twelfth.
    """
    monkeypatch.setattr(optics, "FRONT", 0.0)
    y, x = np.mgrid[:9, :9]
    sheet = table.sheet(np.zeros((9, 9)))
    sheet.total[:] = um_a_cell * (x + y).ravel()
    lit = optics.render(sheet, (0.5, 0.5, 0.5))[4, 4, 0] / 0.5 - 1
    rise = 0.007 * 2 * um_a_cell  # along both axes; a cell of .1 mm, so 1 um is 1/100
    assert lit == pytest.approx(rise / (1 + 12 * rise), rel=1e-3)


def test_the_front_surface_reflects_what_does_not_enter(table):
    """Fresnel's 3.25 % at n = 1.44: the darkest wax is L* 21, white stays white, a bare sheet is as
    it was.
    """
    black, bare = films(table, [[("black", 200.0)], []])
    inside = 1 + 0.3 / 0.004 - np.sqrt((0.3 / 0.004) ** 2 + 2 * 0.3 / 0.004)
    assert black[0] == pytest.approx(0.0325 + 0.9675 * inside, rel=0.02)
    assert (bare == 1).all()
    sheet = table.sheet(np.zeros((1, 2)))
    sheet.total[:] = sheet.blend[:, 0] = [1.0, 30.0]
    sheet.blend[:, 4:] = 5.0  # wax that takes no light: a furnace
    np.testing.assert_allclose(optics.render(sheet, (1.0, 1.0, 1.0), light=False), 1, atol=1e-5)


def test_relief_shows_on_black_wax_by_its_gloss(table):
    """What the surface reflects follows the relief more than what comes from within."""
    waves = 10 * np.sin(np.arange(40) / 3)[:, None] + np.zeros(40)
    contrast = []
    for crayon in ("black", "white"):
        sheet = table.sheet(waves)
        sheet.total[:] = sheet.layer[:, 0] = 60.0
        sheet.used[:], sheet.crayon[:, 0] = 1, [c.name for c in table.palette.crayons].index(crayon)
        lit = optics.render(sheet, (0.9, 0.9, 0.9))
        contrast.append(lit.std() / lit.mean())
    assert contrast[0] > 2 * contrast[1] > 0


def test_a_flat_sheet_is_evenly_lit_and_a_slope_is_lit_from_the_upper_left(table):
    grey = (0.5, 0.5, 0.5)
    assert (optics.render(table.sheet(np.full((9, 9), 30.0)), grey) == 0.5).all()
    y, x = np.mgrid[:9, :9]
    for ramp, lighter in ((x + y, True), (-x - y, False), (x - y, None)):
        lit = optics.render(table.sheet(3.0 * ramp), grey)[4, 4, 0]
        if lighter is None:
            assert lit == pytest.approx(0.5, abs=1e-4)
        else:
            assert (lit > 0.505) == lighter and (lit < 0.495) != lighter


def test_relief_looks_the_same_at_both_resolutions(table):
    lit = []
    for cell_mm in (0.2, 0.1):
        n = round(4 / cell_mm)
        x = np.arange(n) * cell_mm
        waves = 20 * np.sin(2 * np.pi * (x[:, None] + x) / 4)
        lit.append(optics.render(table.sheet(waves, cell_mm), (0.5, 0.5, 0.5)).std())
    assert lit[1] == pytest.approx(lit[0], rel=0.15)


@pytest.fixture
def waxed(table):
    """A sheet of 61 x 30 cells with all kinds of wax on it."""
    rng = np.random.default_rng(6)
    return old_wax(table.sheet(40 * rng.random((61, 30))), rng)


def everything(sheet, threads):
    """All that can be made of a sheet: its picture, the same in 8 bits, and reduced."""
    ground = (1.0, 0.9, 0.8)
    return (
        optics.render(sheet, ground, threads=threads),
        optics.render_srgb(sheet, ground, threads=threads),
        optics.render_reduced(sheet, ground, (17, 9), threads=threads),
    )


def test_any_number_of_threads_and_bands_gives_the_same_pictures(waxed, monkeypatch):
    whole = everything(waxed, 1)
    for band in (1, 90, 700):
        monkeypatch.setattr(optics, "BAND", band)
        for threads in (1, 3):
            for one, same in zip(everything(waxed, threads), whole, strict=True):
                np.testing.assert_array_equal(one, same)


def test_eight_bits_are_the_picture_encoded(waxed):
    picture = optics.render(waxed, (1.0, 0.9, 0.8))
    np.testing.assert_array_equal(optics.render_srgb(waxed, (1.0, 0.9, 0.8)), encode_srgb(picture))


def test_the_reduced_picture_is_a_mean_over_areas(waxed):
    picture = optics.render(waxed, (1.0, 0.9, 0.8), light=False).astype(np.float64)
    for rows, cols in ((61, 30), (17, 9), (1, 1)):
        seen = optics.render_reduced(waxed, (1.0, 0.9, 0.8), (rows, cols))
        # each cell of the grid is now 61 x 30 of these
        fine = np.repeat(np.repeat(picture, rows, 0), cols, 1)
        np.testing.assert_allclose(
            seen, fine.reshape(rows, 61, cols, 30, 3).mean((1, 3)), atol=2e-6
        )
