"""What must be quick loads nothing heavy, and the stroke generator never knows the program that
draws.
"""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import stroke_gen

HEAVY = ("numpy", "numba", "cv2", "PIL", "skimage", "scipy")


def modules_after(code):
    """Names of the packages that a fresh process has loaded after running `code`."""
    names = "{m.partition('.')[0] for m in sys.modules}"
    script = f"import sys\n{code}\nprint('\\n'.join({names}), file=sys.stderr)"
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    return set(run.stderr.split())


@pytest.mark.parametrize("words", [
    ["--help"], ["--version"], ["draw", "--help"], ["warmup", "--help"], ["palettes"],
    ["styles"], ["papers"],
    ["bench", "--help"], ["bench", "--json", "/missing/all.json"],
    ["photo.jpg", "--palete", "box8"], ["photo.jpg", "--seed", "x"],
], ids=" ".join)  # fmt: skip
def test_quick_commands_load_nothing_heavy(words):
    loaded = modules_after(f"""
from crayonize.cli import main
try:
    main({words!r})
except SystemExit:
    pass""")
    assert "crayonize" in loaded
    assert not loaded & set(HEAVY)


def test_importing_the_package_loads_nothing_heavy():
    assert not modules_after(
        "import crayonize; from crayonize import Settings, convert, draw"
    ) & set(HEAVY)


def test_heavy_modules_would_be_noticed():
    assert "numpy" in modules_after("import numpy")


def test_stroke_gen_never_imports_crayonize():
    for path in Path(stroke_gen.__file__).parent.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom):
                names.append(node.module or "")
            assert not any(name.partition(".")[0] == "crayonize" for name in names), path


def test_stroke_gen_works_alone():
    assert "crayonize" not in modules_after(
        "import stroke_gen.generate, stroke_gen.drawing, stroke_gen.params"
    )
