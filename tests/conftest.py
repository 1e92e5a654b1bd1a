"""Fixtures: a bench on which strokes are drawn with either physics."""

import signal

import pytest
from bench_sheet import CRAYONS, Bench

from crayonize.crayons.palette import Crayon, Palette
from crayonize.machine import kernels
from crayonize.wax.physics import physics

# a background job is born deaf to it, and so its children
signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_addoption(parser: pytest.Parser) -> None:
    """One flag stores the golden pictures anew, see pictures/golden.py."""
    parser.addoption(
        "--store-golden", action="store_true", help="store the golden pictures as they are now"
    )


def pytest_collection_finish() -> None:
    """All modules with kernels have been imported: take these from the cache, by their source."""
    kernels.keep_kernels()


@pytest.fixture(scope="session")
def crayons() -> Palette:
    """Seven crayons, more than a cell keeps as pure layers."""
    return Palette(
        "test", "", "", 9.0, tuple(Crayon(n, "#000000", k, s) for n, (k, s) in CRAYONS.items())
    )


@pytest.fixture(params=["metric", "rudolf2003"])
def bench(request: pytest.FixtureRequest, crayons: Palette) -> Bench:
    """A bench for each physics preset."""
    return Bench(physics(request.param), crayons)
