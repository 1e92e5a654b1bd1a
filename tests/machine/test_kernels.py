"""The compile cache gives a right kernel or none, whatever has happened to its folder."""

import ast
import errno
import os
import pickle
import subprocess
import sys
import time
from pathlib import Path

import numba
import numpy as np
import pytest

from crayonize.light import optics
from crayonize.machine import folder, kernels

ARGUMENTS = (np.float32(0.8), np.float32(0.3), np.float32(0.4))


@pytest.fixture
def place(tmp_path):
    return tmp_path / "cache" / "kernels"


@pytest.fixture(autouse=True)
def made(place):
    place.parent.mkdir(mode=0o700)


def kernel(place):
    """A small kernel as a new process would meet it."""
    made = numba.njit(nogil=True, error_model="numpy")(optics._over.py_func)
    made._cache = kernels._Kept(made.py_func, place)
    return made


def loads(place):
    """Whether the kernel comes from disk; in any case it must be right."""
    over = kernel(place)
    assert over(*ARGUMENTS) == pytest.approx(optics._over.py_func(*ARGUMENTS), rel=1e-5)
    return over.stats.cache_hits[over.signatures[0]] == 1


def only_file(place):
    (path,) = place.iterdir()
    return path


# ---- kernels -------------------------------------------------------------------------------------


def test_second_process_loads_what_the_first_compiled(place):
    assert not loads(place)
    assert loads(place)
    assert len(list(place.iterdir())) == 1


def flip(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 0x10
    path.write_bytes(content)


def pickle_of_something_else(path):
    path.unlink()
    folder.write(path, pickle.dumps(("neither", "here", "nor", "there")))


def folder_in_its_place(path):
    path.unlink()
    path.mkdir()


DAMAGE = {
    "cut": lambda path: path.write_bytes(path.read_bytes()[:100]),
    "cut by a byte": lambda path: path.write_bytes(path.read_bytes()[:-1]),
    "empty": lambda path: path.write_bytes(b""),
    "a bit flipped": flip,
    "noise": lambda path: path.write_bytes(os.urandom(5000)),
    "whole but strange": pickle_of_something_else,
    "gone": Path.unlink,
}


@pytest.mark.parametrize("damage", DAMAGE.values(), ids=DAMAGE)
def test_damaged_entry_is_compiled_anew_and_mended(place, damage):
    loads(place)
    damage(only_file(place))
    assert not loads(place)
    assert loads(place)


def test_entry_that_cannot_be_replaced_is_no_error(place):
    loads(place)
    folder_in_its_place(only_file(place))
    assert not loads(place)
    assert not loads(place)


@pytest.mark.parametrize(
    "code", [errno.ENOSPC, errno.EROFS, errno.EACCES, errno.EDQUOT], ids=errno.errorcode.get
)
def test_folder_that_cannot_be_written_is_no_error(place, monkeypatch, code):
    def refuse(*_):
        raise OSError(code, os.strerror(code))

    monkeypatch.setattr(Path, "write_bytes", refuse)
    assert not loads(place)
    assert not list(place.parent.rglob("*.part*"))


def test_full_disk_leaves_no_half_entry(place, monkeypatch):
    def half(self, content):
        with self.open("wb") as file:
            file.write(content[: len(content) // 2])
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", half)
    assert not loads(place)
    assert list(place.iterdir()) == []


def test_read_only_folder_is_read(place, monkeypatch):
    loads(place)
    monkeypatch.setattr(kernels, "write", lambda *_: pytest.fail("tried to write"))
    assert loads(place)


def test_change_of_source_is_another_entry(place, monkeypatch):
    loads(place)
    monkeypatch.setattr(kernels, "_source_hash", lambda _: "changed")
    assert not loads(place)
    assert len(list(place.iterdir())) == 2


def test_source_hash_covers_the_kernels_called(monkeypatch, tmp_path):
    """A kernel of another file that is called counts as source, its file and what it calls in
    turn.
    """
    files = {"one": "from two import double", "two": "from three import once", "three": ""}
    body = "import numba\n@numba.njit\ndef {}(x):\n    return x\n"
    for (name, head), function in zip(files.items(), ("single", "double", "once"), strict=True):
        (tmp_path / f"{name}.py").write_text(f"{head}\n{body.format(function)}")
    monkeypatch.syspath_prepend(tmp_path)
    __import__("one")
    before = kernels._source_hash("one")
    with (tmp_path / "three.py").open("a") as file:
        file.write("# changed\n")
    kernels._source_hash.cache_clear()
    assert kernels._source_hash("one") != before
    for name in files:
        del sys.modules[name]
    kernels._source_hash.cache_clear()


def test_few_versions_of_a_kernel_are_kept(place, monkeypatch):
    for version in range(6):
        monkeypatch.setattr(kernels, "_source_hash", lambda _, v=version: f"version{v}")
        loads(place)
        os.utime(place, (0, 0))
    names = sorted(path.suffix for path in place.iterdir())
    assert len(names) == kernels.KEEP and ".version5" in names


def test_many_processes_start_at_once(tmp_path):
    """All draw the same on an empty cache, and leave it whole."""
    code = (
        "from crayonize.machine import kernels; from crayonize.light import optics; "
        "kernels.keep_kernels();"
        "import numpy as np; print(optics._over(*[np.float32(x) for x in (0.8, 0.3, 0.4)]))"
    )
    environment = {
        **os.environ,
        "CRAYONIZE_CACHE": str(tmp_path / "shared"),
        "CRAYONIZE_NO_CACHE": "",
    }
    command, pipe = [sys.executable, "-c", code], subprocess.PIPE
    runs = [subprocess.Popen(command, env=environment, stdout=pipe, stderr=pipe) for _ in range(6)]
    said = {run.communicate() for run in runs}
    assert len(said) == 1 and said.pop()[1] == b""
    entries = list((tmp_path / "shared").glob("kernels-*/*"))
    assert len(entries) == 1 and folder.read(entries[0]) is not None


def test_old_machines_are_forgotten_but_not_those_in_use(tmp_path):
    for age in range(6):
        old = tmp_path / f"kernels-{age}"
        old.mkdir()
        (old / "entry").write_bytes(b"x")
        when = time.time() - 2 * kernels.IN_USE_S - age
        os.utime(old, (when, when))
    (tmp_path / "kernels-used").mkdir()
    (tmp_path / "table.npz").write_bytes(b"x")
    kernels._clean_up(tmp_path / "kernels-new")
    left = {path.name for path in tmp_path.iterdir()}
    assert left == {"cache", "kernels-used", "kernels-0", "table.npz"}


# ---- a numba with other inner names --------------------------------------------------------------

PRIVATE = ("Dispatcher", "compiler", "cpu_target", "rtsys", "serialize")


@pytest.mark.parametrize("name", PRIVATE)
def test_a_numba_without_one_of_its_inner_names_costs_only_the_cache(name, tmp_path):
    """Hidden from our module alone, in a process where no kernel is loaded before: it computes the
    same.
    """
    code = f"""
import builtins
def without(module, globals=None, locals=None, names=(), level=0, real=builtins.__import__):
    ours = (globals or {{}}).get("__name__") == "crayonize.machine.kernels"
    if ours and {name!r} in (names or ()):
        raise ImportError({name!r})
    return real(module, globals, locals, names, level)
builtins.__import__ = without
from crayonize.machine import kernels
from crayonize.light import optics
kernels.keep_kernels()
import numpy as np
print(float(optics._over(*[np.float32(x) for x in (0.8, 0.3, 0.4)])))
"""
    environment = {**os.environ, "CRAYONIZE_CACHE": str(tmp_path), "CRAYONIZE_NO_CACHE": ""}
    run = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True
    )
    assert run.returncode == 0, run.stderr
    assert float(run.stdout) == pytest.approx(optics._over.py_func(*ARGUMENTS), rel=1e-5)


def test_all_inner_names_that_are_used_are_tried():
    """Another private name of numba in kernels.py has to be added above."""
    tree = ast.parse(Path(kernels.__file__).read_text("utf-8"))
    used = {
        name.name
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom)
        for name in node.names
        if (node.module or "").startswith("numba.")
    }
    assert used == set(PRIVATE)
