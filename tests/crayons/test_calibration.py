"""The table of crayons: the line through what was measured, and when a table counts."""

from dataclasses import replace

import numpy as np
import pytest

from crayonize.crayons import calibration
from crayonize.crayons.palette import Palette
from crayonize.crayons.palette_files import load_palette
from crayonize.machine import source
from crayonize.settings import Settings
from crayonize.wax.paper import load_paper
from stroke_gen.swatches import Swatches

BOX, PAPER = load_palette("box8"), load_paper("drawing")


def test_the_lines_that_were_measured_are_found() -> None:
    """after = a before + b, drawn with known a and b, per crayon, pressure and channel."""
    rng = np.random.default_rng(2)
    before = rng.uniform(0.05, 0.95, (4, 6, 3, 3)).astype(np.float32)
    a = rng.uniform(0.1, 0.9, (6, 3, 3)).astype(np.float32)
    b = rng.uniform(0.0, 0.1, (6, 3, 3)).astype(np.float32)
    found_a, found_b = calibration._fit(before, a * before + b)
    for line in (0, 1):  # over paper and over wax
        np.testing.assert_allclose(found_a[line], a.swapaxes(0, 1), atol=2e-3)
        np.testing.assert_allclose(found_b[line], b.swapaxes(0, 1), atol=2e-3)


def test_over_wax_the_line_is_that_of_the_waxed_grounds() -> None:
    """Where bare paper lies off their line, the second line does not care; the first meets it."""
    rng = np.random.default_rng(3)
    before = rng.uniform(0.2, 0.9, (4, 6, 2, 3)).astype(np.float32)
    after = 0.5 * before + 0.1
    after[0] -= 0.05
    a, b = calibration._fit(before, after)
    np.testing.assert_allclose(a[1], 0.5, atol=1e-3)
    np.testing.assert_allclose(b[1], 0.1, atol=1e-3)
    met = a[0].swapaxes(0, 1) * before[0] + b[0].swapaxes(0, 1)
    free = b[0].swapaxes(0, 1) > 0
    assert free.any()
    np.testing.assert_allclose(met[free], after[0][free], atol=1e-5)


def test_a_table_is_one_of_its_crayons_paper_and_physics() -> None:
    less = replace(BOX, crayons=BOX.crayons[:-1])
    keys = {
        calibration._key(BOX, PAPER, "metric"),
        calibration._key(less, PAPER, "metric"),
        calibration._key(BOX, replace(PAPER, depth_um=PAPER.depth_um + 1), "metric"),
        calibration._key(BOX, load_paper("drawing:#204060"), "metric"),
        calibration._key(BOX, PAPER, "rudolf2003"),
    }
    assert len(keys) == 5


@pytest.fixture
def measured(monkeypatch: pytest.MonkeyPatch, tmp_path) -> list[str]:
    """The names of the palettes that are measured, in place of measuring them."""
    names: list[str] = []

    def measure(palette: Palette, *_: object) -> Swatches:
        names.append(palette.name)
        shape = (len(palette.crayons), len(calibration.PRESSURES))
        crayons = tuple(crayon.name for crayon in palette.crayons)
        return Swatches(
            crayons,
            np.array(calibration.PRESSURES, np.float32),
            np.zeros((2, *shape, 3), np.float32),
            np.ones((2, *shape, 3), np.float32),
            np.zeros(shape, np.float32),
            np.ones(3, np.float32),
        )

    monkeypatch.setattr(calibration, "measure", measure)
    monkeypatch.setenv("CRAYONIZE_CACHE", str(tmp_path / "cache"))
    monkeypatch.delenv("CRAYONIZE_NO_CACHE", raising=False)
    return names


def test_a_table_is_measured_once_a_version_of_the_wax(
    measured: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    mine = replace(BOX, name="mine", crayons=BOX.crayons[:3])
    for _ in range(2):
        calibration.swatches(mine, PAPER, "metric", 1)
    assert measured == ["mine"]
    monkeypatch.setattr(source, "of_the_wax", lambda: "another")
    calibration.swatches(mine, PAPER, "metric", 1)
    assert measured == ["mine", "mine"]


def test_shipped_palettes_are_not_measured(measured: list[str]) -> None:
    for name in ("box8", "box24", "skin"):
        calibration.swatches(load_palette(name), load_paper(Settings.paper), Settings.physics, 1)
    assert measured == []


def test_shipped_tables_are_those_of_this_wax() -> None:
    """Measured anew: no crayon gives another colour on paper than the table says.

    Else: run calibration.
    """
    box = replace(load_palette("box8"), crayons=load_palette("box8").crayons[:3])
    shipped = calibration.swatches(load_palette("box8"), PAPER, "metric", 1)
    fresh = calibration.measure(box, PAPER, "metric", 2)
    told = fresh.paper * shipped.a[0, :3] + shipped.b[0, :3]
    seen = fresh.paper * fresh.a[0] + fresh.b[0]
    assert np.abs(told - seen).mean() < 0.01 and np.abs(told - seen).max() < 0.05
