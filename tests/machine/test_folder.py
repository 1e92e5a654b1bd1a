"""The compile cache gives a right kernel or none, whatever has happened to its folder."""

import errno
import os
import pickle
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numba
import numpy as np
import pytest

from crayonize.light import optics
from crayonize.machine import folder as cache

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
    made._cache = cache._Kept(made.py_func, place)
    return made


def loads(place):
    """Whether the kernel comes from disk; in any case it must be right."""
    over = kernel(place)
    assert over(*ARGUMENTS) == pytest.approx(optics._over.py_func(*ARGUMENTS), rel=1e-5)
    return over.stats.cache_hits[over.signatures[0]] == 1


def only_file(place):
    (path,) = place.iterdir()
    return path


# ---- kernels ---------------------------------------------------------------------------------------------


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
    cache.write(path, pickle.dumps(("neither", "here", "nor", "there")))


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


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EROFS, errno.EACCES, errno.EDQUOT], ids=errno.errorcode.get)
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
    monkeypatch.setattr(cache, "write", lambda *_: pytest.fail("tried to write"))
    assert loads(place)


def test_change_of_source_is_another_entry(place, monkeypatch):
    loads(place)
    monkeypatch.setattr(cache, "_source_hash", lambda _: "changed")
    assert not loads(place)
    assert len(list(place.iterdir())) == 2


def test_source_hash_covers_the_kernels_called(monkeypatch, tmp_path):
    """A kernel of another file that is called counts as source, its file and what it calls in turn."""
    files = {"one": "from two import double", "two": "from three import once", "three": ""}
    body = "import numba\n@numba.njit\ndef {}(x):\n    return x\n"
    for (name, head), function in zip(files.items(), ("single", "double", "once"), strict=True):
        (tmp_path / f"{name}.py").write_text(f"{head}\n{body.format(function)}")
    monkeypatch.syspath_prepend(tmp_path)
    __import__("one")
    before = cache._source_hash("one")
    with (tmp_path / "three.py").open("a") as file:
        file.write("# changed\n")
    cache._source_hash.cache_clear()
    assert cache._source_hash("one") != before
    for name in files:
        del sys.modules[name]
    cache._source_hash.cache_clear()


def test_few_versions_of_a_kernel_are_kept(place, monkeypatch):
    for version in range(6):
        monkeypatch.setattr(cache, "_source_hash", lambda _, v=version: f"version{v}")
        loads(place)
        os.utime(place, (0, 0))
    names = sorted(path.suffix for path in place.iterdir())
    assert len(names) == cache.KEEP and ".version5" in names


def test_many_processes_start_at_once(tmp_path):
    """All draw the same on an empty cache, and leave it whole."""
    code = (
        "from crayonize.machine import folder as cache; cache.before_kernels();"
        "from crayonize.light import optics; cache.keep_kernels();"
        "import numpy as np; print(optics._over(*[np.float32(x) for x in (0.8, 0.3, 0.4)]))"
    )
    environment = {**os.environ, "CRAYONIZE_CACHE": str(tmp_path / "shared"), "CRAYONIZE_NO_CACHE": ""}
    command, pipe = [sys.executable, "-c", code], subprocess.PIPE
    runs = [subprocess.Popen(command, env=environment, stdout=pipe, stderr=pipe) for _ in range(6)]
    said = {run.communicate() for run in runs}
    assert len(said) == 1 and said.pop()[1] == b""
    entries = list((tmp_path / "shared").glob("kernels-*/*"))
    assert len(entries) == 1 and cache.read(entries[0]) is not None


# ---- the folder ------------------------------------------------------------------------------------------


@pytest.fixture
def bare(monkeypatch, tmp_path):
    """No wishes in the environment, and a home and a temporary folder of the test's own."""
    for name in ("CRAYONIZE_CACHE", "CRAYONIZE_NO_CACHE", "XDG_CACHE_HOME", "LOCALAPPDATA"):
        monkeypatch.delenv(name, raising=False)
    home, temporary = tmp_path / "home", tmp_path / "temporary"
    home.mkdir()
    temporary.mkdir()
    monkeypatch.setattr(Path, "home", lambda: home)
    monkeypatch.setattr(tempfile, "tempdir", str(temporary))
    return home


@pytest.mark.skipif(sys.platform in ("win32", "darwin"), reason="other conventions")
def test_folder_is_in_the_home_and_private(bare):
    assert cache.folder() == bare / ".cache" / "crayonize"
    assert cache.folder().stat().st_mode & 0o777 == 0o700


def test_folder_follows_xdg_if_absolute(bare, monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    assert cache.folder() == tmp_path / "xdg" / "crayonize"
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")
    assert cache.folder().is_relative_to(bare)


def test_folder_may_be_named(bare, monkeypatch, tmp_path):
    monkeypatch.setenv("CRAYONIZE_CACHE", str(tmp_path / "named" / "deep"))
    assert cache.folder() == tmp_path / "named" / "deep"


def test_home_that_cannot_be_written_gives_way_to_the_temporary_folder(bare):
    shutil.rmtree(bare)
    bare.write_text("a file, so that no folder can be made in it")
    assert cache.folder().parent == Path(tempfile.gettempdir())


def test_no_home_gives_way_to_the_temporary_folder(bare, monkeypatch):
    def homeless():
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(Path, "home", homeless)
    assert cache.folder().parent == Path(tempfile.gettempdir())


def is_nowhere(path):
    return not path.exists() and not path.parent.exists() and not cache.write(path / "x", b"x")


def test_nothing_writable_is_no_error(bare, monkeypatch):
    shutil.rmtree(bare)
    bare.write_text("")
    monkeypatch.setattr(tempfile, "tempdir", str(bare))
    assert is_nowhere(cache.folder())


def test_cache_can_be_forbidden(bare, monkeypatch):
    monkeypatch.setenv("CRAYONIZE_NO_CACHE", "1")
    assert is_nowhere(cache.folder())


@pytest.mark.skipif(os.name != "posix", reason="mode bits")
@pytest.mark.parametrize("mode", [0o777, 0o770, 0o702])
def test_folder_others_can_write_to_is_not_used(bare, monkeypatch, tmp_path, mode):
    (tmp_path / "open").mkdir()
    (tmp_path / "open").chmod(mode)
    monkeypatch.setenv("CRAYONIZE_CACHE", str(tmp_path / "open"))
    assert is_nowhere(cache.folder())


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root may give a folder away")
def test_folder_of_somebody_else_is_not_used(bare, monkeypatch, tmp_path):
    (tmp_path / "theirs").mkdir(mode=0o700)
    os.chown(tmp_path / "theirs", 12345, -1)
    monkeypatch.setenv("CRAYONIZE_CACHE", str(tmp_path / "theirs"))
    assert is_nowhere(cache.folder())


def test_link_to_a_folder_of_ours_is_followed(bare, monkeypatch, tmp_path):
    (tmp_path / "link").symlink_to(bare)
    bare.chmod(0o700)
    monkeypatch.setenv("CRAYONIZE_CACHE", str(tmp_path / "link"))
    assert cache.folder() == tmp_path / "link"


def test_old_machines_are_forgotten_but_not_those_in_use(tmp_path):
    for age in range(6):
        old = tmp_path / f"kernels-{age}"
        old.mkdir()
        (old / "entry").write_bytes(b"x")
        when = time.time() - 2 * cache.IN_USE_S - age
        os.utime(old, (when, when))
    (tmp_path / "kernels-used").mkdir()
    (tmp_path / "table.npz").write_bytes(b"x")
    cache._clean_up(tmp_path / "kernels-new")
    left = {path.name for path in tmp_path.iterdir()}
    assert left == {"cache", "kernels-used", "kernels-0", "table.npz"}
