"""The one way to a file: whole or not at all, on the disk when it says so."""

import os
import stat
from pathlib import Path

import pytest

from stroke_gen.files import PART, read_bytes, whole_file


def test_a_fault_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    target = tmp_path / "a.txt"
    target.write_text("old")
    with pytest.raises(RuntimeError), whole_file(target) as part:
        part.write_text("half")
        raise RuntimeError
    assert target.read_text() == "old" and os.listdir(tmp_path) == ["a.txt"]


def test_the_part_lies_beside_the_target_and_names_our_process(tmp_path: Path) -> None:
    with whole_file(tmp_path / "a.webp") as part:
        assert part.parent == tmp_path and part.suffix == ".webp"
        assert part.name.startswith(f"{PART}{os.getpid()}-")
        part.write_bytes(b"new")
    assert (tmp_path / "a.webp").read_bytes() == b"new"


def test_first_the_file_is_on_the_disk_then_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A name on the disk without its content would be a torn picture after a loss of power."""
    seen = []
    fsync, replace = os.fsync, os.replace

    def noted_sync(handle: int) -> None:
        seen.append("folder" if stat.S_ISDIR(os.fstat(handle).st_mode) else "file")
        fsync(handle)

    def noted_replace(*names: Path) -> None:
        seen.append("name")
        replace(*names)

    monkeypatch.setattr(os, "fsync", noted_sync)
    monkeypatch.setattr(os, "replace", noted_replace)
    with whole_file(tmp_path / "a.txt") as part:
        part.write_text("new")
    assert seen == ["file", "name", "folder"]


def test_a_link_is_replaced_and_a_pipe_refused(tmp_path: Path) -> None:
    (tmp_path / "kept").write_text("kept")
    (tmp_path / "link").symlink_to(tmp_path / "kept")
    os.mkfifo(tmp_path / "pipe")
    with whole_file(tmp_path / "link") as part:
        part.write_text("new")
    assert (tmp_path / "kept").read_text() == "kept" and (tmp_path / "link").read_text() == "new"
    with (
        pytest.raises(ValueError, match="stands for a folder or device"),
        whole_file(tmp_path / "pipe"),
    ):
        pass
    with pytest.raises(ValueError, match="is no ordinary file"):
        read_bytes(tmp_path / "pipe", 10, "a file")


def test_no_more_is_read_than_a_file_may_have(tmp_path: Path) -> None:
    (tmp_path / "large").write_bytes(b"x" * 2_000_001)
    with pytest.raises(ValueError, match="larger than 2 MB, the most a list may have"):
        read_bytes(tmp_path / "large", 2_000_000, "a list")
    assert len(read_bytes(tmp_path / "large", 3_000_000, "a list")) == 2_000_001
