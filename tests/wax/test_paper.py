"""Paper: its tooth is the same in mm at any resolution, alike in all directions, and tiles without
a seam.
"""

import cv2
import numpy as np
import pytest

from crayonize.wax import paper

KINDS = ("pressed", "felt", "lunar", "stipple")
NAMES = sorted(paper.papers())


def heights(kind, n=320, cell_mm=0.1, seed=0, wavelength_mm=0.8, pits=1.0):
    sheet = paper.Paper("", "", kind, wavelength_mm, 50.0, pits)
    return paper.tooth(sheet, n, n, cell_mm, seed)


def correlation_mm(field, cell_mm, direction):
    """Distance at which the autocorrelation along a direction (dy, dx) falls to a half."""
    field = field - field.mean()
    spectrum = np.abs(np.fft.rfft2(field)) ** 2
    correlation = np.fft.irfft2(spectrum, s=field.shape) / field.var() / field.size
    steps = np.arange(min(field.shape) // 4)
    line = correlation[direction[0] * steps, direction[1] * steps]
    after = int(np.argmax(line < 0.5))
    part = (line[after - 1] - 0.5) / (line[after - 1] - line[after])
    return (after - 1 + part) * cell_mm * np.hypot(*direction)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("cells_mm", [(0.2, 0.1), (0.1, 0.05)], ids=str)
def test_a_paper_has_the_same_tooth_at_both_resolutions(name, cells_mm):
    described = paper.load_paper(name)
    if described.wavelength_mm < 2.5 * cells_mm[0]:
        pytest.skip("the coarse cells cannot show this grain")
    depths, lengths = [], []
    for cell_mm in cells_mm:
        n = round((40 if described.wavelength_mm > 0.6 else 25) / cell_mm)
        field = paper.tooth(described, n, n, cell_mm, 3)
        assert field.dtype == np.float32 and field.shape == (n, n)
        assert field.min() >= 0 and field.max() <= described.depth_um
        if described.texture == "pressed":  # its fine waves are for fine cells alone
            blur = 0.3 / cell_mm
            field = cv2.GaussianBlur(field, (0, 0), blur)
        depths.append(np.ptp(np.percentile(field, (0.5, 99.5))))
        lengths.append(
            np.mean(
                [correlation_mm(field, cell_mm, way) for way in ((0, 1), (1, 0), (1, 1), (1, -1))]
            )
        )
        assert (
            (field == field.min()) | (field == field.max())
        ).mean() < 0.015 or described.texture == "stipple"
    if described.texture == "pressed":
        assert depths[1] == pytest.approx(depths[0], rel=0.05)
    else:
        assert depths == pytest.approx([described.depth_um] * 2, rel=0.05)
    assert lengths[1] == pytest.approx(lengths[0], rel=0.12)


@pytest.mark.parametrize("kind", KINDS)
def test_grain_grows_with_the_wavelength(kind):
    short, long = (
        np.mean(
            [correlation_mm(heights(kind, wavelength_mm=w, seed=s), 0.1, (0, 1)) for s in range(3)]
        )
        for w in (0.5, 1.0)
    )
    if kind == "pressed":  # of which the waves finer than the grain stay
        assert 1.3 * short < long < 2 * short
    else:
        assert long == pytest.approx(2 * short, rel=0.2)


def test_lunar_is_of_one_arc_as_if_lit_from_one_side():
    """A quarter circle lies along one diagonal: longer that way than across it."""
    with_arc, across = (
        np.mean([correlation_mm(heights("lunar", 640, 0.05, seed), 0.05, way) for seed in range(4)])
        for way in ((1, -1), (1, 1))
    )
    assert with_arc > 1.15 * across


@pytest.mark.parametrize("kind", ["pressed", "felt"])
def test_papers_are_alike_in_all_directions(kind):
    lengths = [
        np.mean([correlation_mm(heights(kind, 640, 0.05, seed), 0.05, way) for seed in range(6)])
        for way in ((0, 1), (1, 2), (1, 1), (2, 1), (1, 0), (2, -1), (1, -1), (1, -2))
    ]
    assert np.ptp(lengths) < 0.15 * np.mean(lengths)
    rises = [np.diff(heights(kind), axis=axis) for axis in (0, 1)]
    for rise in rises:  # up as steep as down
        assert abs((rise**3).mean()) < 0.1 * (rise**2).mean() ** 1.5


@pytest.mark.parametrize("kind", KINDS)
def test_patches_join_without_a_seam(kind, monkeypatch):
    monkeypatch.setattr(paper, "PATCH", 64)
    field = heights(kind, 150, wavelength_mm=0.5)
    np.testing.assert_array_equal(field[:64, :64], field[64:128, 64:128])
    np.testing.assert_array_equal(field[:22, :22], field[128:, 128:])
    for axis in (0, 1):
        steps = np.abs(np.diff(field, axis=axis)).mean(1 - axis)
        seams = steps[[63, 127]].mean()
        period = np.array(
            [np.abs(np.diff(np.roll(field[:64, :64], -k, axis), axis=axis)).mean() for k in (0, 9)]
        )
        assert seams < 1.5 * steps.mean() and period[0] == pytest.approx(period[1], rel=0.1)


def test_dots_keep_their_distance_over_the_seam(monkeypatch):
    monkeypatch.setattr(paper, "PATCH", 64)
    # 18 cells do not divide 64
    field = cv2.GaussianBlur(heights("stipple", 192, wavelength_mm=0.45), (0, 0), 3)
    rows = field.reshape(12, 16, 192).mean(1)  # every second row of dots is shifted by a half
    similar = np.corrcoef(rows)
    assert np.diag(similar, 1).max() < 0 < 0.5 < np.diag(similar, 2).min()
    top = cv2.dilate(field, np.ones((9, 9)))
    dots = np.argwhere(field == top)
    dots = dots[((dots > 8) & (dots < 183)).all(1)]
    gaps = np.hypot(*(dots[:, None] - dots[None]).T) + 1e3 * np.eye(len(dots))
    assert len(dots) > 60
    np.testing.assert_allclose(gaps.min(0), 17, atol=4)


@pytest.mark.parametrize(
    "spot_shape", [(3, 5), (9, 12)], ids=["smaller", "larger than the lattice"]
)
def test_a_spot_is_laid_on_every_point_of_the_lattice_and_wraps_round(spot_shape):
    rng = np.random.default_rng(2)
    noise, spot = rng.random((6, 10), np.float32), rng.random(spot_shape, np.float32)
    laid = sum(
        weight * np.roll(noise, (j - spot.shape[0] // 2, i - spot.shape[1] // 2), (0, 1))
        for (j, i), weight in np.ndenumerate(spot)
    )
    np.testing.assert_allclose(paper._convolve(noise.copy(), spot), laid, rtol=1e-5)


def test_the_seed_alone_decides():
    np.testing.assert_array_equal(heights("felt", 60, seed=4), heights("felt", 60, seed=4))
    assert np.abs(heights("felt", 60, seed=4) - heights("felt", 60, seed=5)).mean() > 1


def test_pits_make_a_plateau_with_pits():
    even, pitted = heights("felt"), heights("felt", pits=3.0)
    assert pitted.mean() > even.mean() + 8
    assert np.percentile(pitted, 50) - np.percentile(pitted, 1) > 1.5 * np.ptp(
        np.percentile(pitted, (50, 99))
    )
    # the same order of heights
    assert (np.diff(pitted.ravel()[np.argsort(even, axis=None)]) >= -1e-3).all()


def test_a_pressed_paper_is_even_with_pits_down_to_the_finest_cells():
    field = heights("pressed", 1024, 0.05, wavelength_mm=0.8)
    low, middle, high = np.percentile(field, (0.5, 50, 99.5))
    assert (low, high) == (pytest.approx(0, abs=4), pytest.approx(50, abs=2))
    assert middle - low > 6 * (high - middle)
    flat = field > middle - 2 * (high - middle)
    assert 0.7 < flat.mean() < 0.9
    number, pits = cv2.connectedComponents((field < 0.6 * middle).astype(np.uint8))
    sizes = np.bincount(pits.ravel())[1:]
    assert number > 200 and np.percentile(sizes, 95) > 8 * np.median(sizes)  # of all sizes


def test_fine_waves_of_a_pressed_paper_are_not_folded_into_coarse_ones():
    """A wave shorter than two cells is left out; felt and scans keep as much height whatever the
    cells.
    """
    power = []
    for cell_mm in (0.3, 0.05):
        fields = [heights("pressed", round(24 / cell_mm), cell_mm, seed) for seed in range(3)]
        spectra = [np.abs(np.fft.rfft2(f - f.mean())) ** 2 / f.size**2 for f in fields]
        wave = np.hypot(
            np.fft.fftfreq(len(fields[0]), cell_mm)[:, None],
            np.fft.rfftfreq(len(fields[0]), cell_mm),
        )
        power.append(
            [np.sum(spectra, 0)[(wave > a) & (wave < b)].sum() for a, b in ((0.3, 0.8), (0.8, 1.4))]
        )
    assert power[0] == pytest.approx(power[1], rel=0.2)


@pytest.mark.parametrize("rows, cols", [(1, 1), (1, 50), (7, 3), (31, 77)])
@pytest.mark.parametrize("kind", KINDS)
def test_small_sheets_have_paper_too(kind, rows, cols):
    field = paper.tooth(paper.Paper("", "", kind, 0.5, 50.0), rows, cols, 0.2, 0)
    assert field.shape == (rows, cols) and np.isfinite(field).all() and field.flags.c_contiguous


# ---- a picture as paper --------------------------------------------------------------------------


@pytest.fixture
def picture(tmp_path):
    """A grey picture, black on the left and white on the right, with a white line near the top."""
    grey = np.tile(np.linspace(0, 255, 64).astype(np.uint8), (32, 1))
    grey[2:4] = 255
    cv2.imwrite(str(tmp_path / "my paper.png"), grey)
    return str(tmp_path / "my paper.png")


@pytest.mark.parametrize("shape", [(32, 64), (64, 128), (16, 32)])
def test_a_picture_is_a_height_field_white_high(picture, shape):
    made = paper.load_paper({"texture": picture, "depth_um": 60})
    field = paper.tooth(made, *shape, 0.1, 0)
    assert field.shape == shape and field.dtype == np.float32
    assert field.min() >= 0 and field.max() == pytest.approx(60, abs=1)
    middle = field[shape[0] // 2]
    assert (np.diff(middle) >= -0.5).all() and middle[0] < 2 and middle[-1] > 55
    line = round(2.5 / 32 * shape[0])
    assert field[line, 0] > 40


def test_a_picture_may_be_named_by_its_path_alone(picture):
    assert paper.load_paper(picture).texture == picture
    assert paper.tooth(paper.load_paper(picture), 20, 40, 0.1, 0).max() > 70


# ---- specs ---------------------------------------------------------------------------------------


def test_a_paper_by_name_by_colour_and_by_table():
    name = NAMES[0]
    assert paper.load_paper(name) == paper.papers()[name]
    assert paper.load_paper(f"{name}:#204060").colour == "#204060"
    changed = paper.load_paper({"name": name, "depth_um": 12.5})
    assert (changed.depth_um, changed.texture) == (12.5, paper.papers()[name].texture)
    assert paper.load_paper(changed) is changed


@pytest.mark.parametrize("name", NAMES)
def test_shipped_papers_are_sound(name):
    made = paper.papers()[name]
    assert paper.load_paper({"name": name}) == made
    assert made.title and made.texture in KINDS


@pytest.mark.parametrize(
    "spec, message",
    [
        ("drawin", "paper: 'drawin' is neither a paper nor a picture file.*drawing"),
        ("", "paper: '' is neither a paper nor"),
        ("drawing:#12", "colour: '#12' is not #rrggbb"),
        ("drawing:#+1+2+3", "colour: '#[+]1[+]2[+]3' is not #rrggbb"),
        ({"depth": 3}, "paper.depth: unknown key.*depth_um"),
        ({"depth_um": "deep"}, "paper.depth_um: 'deep' is not a number from 0 to 1000"),
        ({"depth_um": float("nan")}, "paper.depth_um: nan is not a number"),
        ({"wavelength_mm": -1}, "paper.wavelength_mm: -1 is not a number from 0 to 20"),
        ({"pits": 100}, "paper.pits: 100 is not a number"),
        ({"colour": 5}, "paper.colour: 5 is not a text"),
        ({"colour": "red"}, "colour: 'red' is not #rrggbb"),
        ({"texture": None}, "paper.texture: None is not a text"),
        (
            {"texture": "nowhere.png"},
            "paper.texture: 'nowhere.png' is neither one of pressed, lunar",
        ),
        ({"name": "velvet"}, "paper: 'velvet' is neither"),
        (7, "paper: 7 is neither a name nor a table"),
        (None, "paper: None is neither a name nor a table"),
    ],
    ids=str,
)
def test_a_wrong_paper_is_named_in_one_line(spec, message):
    with pytest.raises(ValueError, match=message) as caught:
        paper.load_paper(spec)
    assert "\n" not in str(caught.value)


def test_colours_are_decoded_as_srgb():
    assert paper.colour_linear("#000000") == (0, 0, 0) and paper.colour_linear("ffffff") == (
        1,
        1,
        1,
    )
    assert paper.colour_linear("#0a80ff") == pytest.approx((0.003035, 0.215861, 1.0), abs=1e-6)
