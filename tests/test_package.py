"""What is installed is whole: data, command, version, and nothing else's name."""

import importlib.metadata
from pathlib import Path

import pytest

import crayonize
import stroke_gen
from crayonize.__main__ import main
from crayonize.crayons.palette_files import load_palette, palette_names
from crayonize.wax.paper import load_paper, papers
from stroke_gen.params import load_style, style_names


def installed():
    """The metadata of the installed package; skips in a checkout that is not installed."""
    try:
        return importlib.metadata.distribution("crayonize")
    except importlib.metadata.PackageNotFoundError:
        pytest.skip("crayonize is not installed here")


def test_all_shipped_data_loads():
    assert len([load_palette(name) for name, _, _ in palette_names()]) >= 10
    assert len([load_paper(name) for name in papers()]) >= 6
    assert load_style("artist")
    assert all(load_style(name) for name in style_names())


def test_every_listing_has_titles():
    assert all(title for _, title, _ in palette_names())
    assert all(paper.title for paper in papers().values())
    assert all(style_names().values())


def test_defaults_are_shipped():
    settings = crayonize.Settings()
    assert settings.palette in [name for name, _, _ in palette_names()]
    assert settings.paper in papers()
    assert settings.style in style_names()


def test_version_is_that_of_the_package():
    assert installed().version == crayonize.__version__


def test_command_is_installed():
    (command,) = installed().entry_points.select(group="console_scripts")
    assert command.name == "crayonize"
    assert command.load() is main


def test_only_our_two_packages_are_installed():
    files = installed().files or []
    packages = {file.parts[0] for file in files if file.suffix == ".py"}
    assert packages <= {"crayonize", "stroke_gen"}


def test_licence_is_installed():
    assert any(Path(str(file)).name == "LICENSE" for file in installed().files or [])


def test_public_names():
    assert set(crayonize.__all__) <= set(dir(crayonize))
    assert callable(crayonize.convert) and callable(crayonize.draw)
    with pytest.raises(AttributeError, match="no attribute 'drew'"):
        _ = crayonize.drew
    assert stroke_gen.__doc__
