"""The one arrow between the packages: crayonize uses stroke_gen, and stroke_gen knows nothing of crayonize."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import stroke_gen

FOLDER = Path(stroke_gen.__file__).parent
MODULES = sorted(path.stem for path in FOLDER.glob("*.py") if path.stem != "__init__")

BLOCKED = """
import importlib, sys

class Guard:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] == "crayonize":
            raise ImportError("crayonize is blocked")

sys.meta_path.insert(0, Guard())
"""


def imports(source):
    """Names of all modules a source imports, wherever in it; relative ones begin with a dot."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        if isinstance(node, ast.ImportFrom):
            yield "." * node.level + (node.module or "")
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name | ast.Attribute):
            called = node.func.id if isinstance(node.func, ast.Name) else node.func.attr
            if called in ("import_module", "__import__"):
                yield from (str(a.value) for a in node.args if isinstance(a, ast.Constant))


def run(code):
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)


@pytest.mark.parametrize("path", sorted(FOLDER.rglob("*.py")), ids=lambda path: path.name)
def test_no_module_imports_the_program(path):
    for name in imports(path.read_text("utf-8")):
        assert name.partition(".")[0] != "crayonize", f"{path.name} imports {name}"
        assert not name.startswith(".."), f"{path.name} reaches out of its package: {name}"


def test_the_check_sees_every_way_to_import():
    lines = ["import crayonize", "from crayonize.wax import Sheet", "def f():\n    import crayonize.wax as w"]
    lines += ["import_module('crayonize')", "importlib.import_module('crayonize.wax')", "__import__('crayonize')"]
    for line in lines:
        assert any(name.startswith("crayonize") for name in imports(line)), line


def test_every_module_loads_with_the_program_blocked():
    script = BLOCKED + f"""
for name in {MODULES!r}:
    importlib.import_module("stroke_gen." + name)
assert not any(name.partition(".")[0] == "crayonize" for name in sys.modules)
print("loaded")"""
    done = run(script)
    assert done.stdout.strip() == "loaded", done.stderr


def test_the_block_blocks():
    assert "crayonize is blocked" in run(BLOCKED + "import crayonize").stderr
