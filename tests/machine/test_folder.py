"""The cache folder: where it lies, whom it may belong to, and what happens without one."""

import os
import shutil
import sys
import tempfile
from pathlib import Path

import pytest

from crayonize.machine import cores
from crayonize.machine import folder as cache


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


@pytest.mark.skipif(
    not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root may give a folder away"
)
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


def test_cores_are_those_allowed():
    if not hasattr(os, "sched_setaffinity"):
        pytest.skip("a system that binds no process to cores")
    before = os.sched_getaffinity(0)
    try:
        os.sched_setaffinity(0, {min(before)})
        assert cores.allowed() == 1
    finally:
        os.sched_setaffinity(0, before)
    assert cores.allowed() == len(before)
