"""What is written for readers is true: examples run, help shows the API, the README's map is the
tree.
"""

import doctest
import importlib
import pkgutil
import pydoc
import re
from pathlib import Path

import pytest

import crayonize
import stroke_gen

README = Path(__file__).parents[1] / "README.md"


def modules() -> list[str]:
    """All modules of both packages."""
    return [info.name for package in (crayonize, stroke_gen)
            for info in pkgutil.walk_packages(package.__path__, f"{package.__name__}.")
            if not info.name.endswith("__main__")]  # fmt: skip


@pytest.mark.parametrize("name", modules())
def test_examples_run(name: str) -> None:
    module = importlib.import_module(name)
    assert module.__doc__ and module.__doc__.strip(), "the first lines say what a module is for"
    assert doctest.testmod(module).failed == 0


def test_the_api_has_examples() -> None:
    for name in ("crayonize.api", "crayonize.settings", "stroke_gen.checks"):
        assert doctest.testmod(importlib.import_module(name)).attempted >= 2


def test_help_shows_the_api_and_nothing_else() -> None:
    text = pydoc.render_doc(crayonize, renderer=pydoc.plaintext)
    functions = text[text.index("\nFUNCTIONS") : text.index("\nDATA")]
    assert re.findall(r"^    (\w+)\(", functions, re.M) == ["convert", "draw"]
    assert re.findall(r"^    class (\w+)", text, re.M) == ["Live", "Settings"]
    for name in ("convert", "draw"):
        words = getattr(crayonize, name).__doc__
        assert all(
            f"{part}\n    ---" in words for part in ("Parameters", "Returns", "Raises", "Examples")
        )
    assert [name for name in dir(crayonize) if not name.startswith("__")] == crayonize.__all__


def test_the_map_of_the_readme_is_the_tree() -> None:
    """A line a room: every folder of crayonize with modules stands in the README's map, and no
    other.
    """
    text = README.read_text("utf-8")
    told = set(re.findall(r"^\| `src/crayonize/(\w+)/`", text, re.M)) - {"data"}
    rooms = {info.name for info in pkgutil.iter_modules(crayonize.__path__) if info.ispkg}
    assert told == rooms
