"""Files that we keep in a folder of other people's: never through a link, nor what is not ours."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from conftest import Desk

from crayonize.batch.journal import MOST_BYTES
from stroke_gen import files
from stroke_gen.files import PART, own_file, sweep, whole_file


def test_a_link_in_the_place_of_a_state_file_is_refused(desk: Desk) -> None:
    desk.fill(1)
    victim = desk.base / "victim.jpg"
    state = desk.pictures / ".crayonize"
    state.mkdir(parents=True)
    for name in ("journal.jsonl", "lock"):
        for kind in ("link", "hard link", "device", "pipe", "folder"):
            victim.write_bytes(b"a photo")
            path = state / name
            path.unlink(missing_ok=True)  # the lock of the run before
            if kind == "link":
                path.symlink_to(victim)
            elif kind == "hard link":
                os.link(victim, path)
            elif kind == "device":
                path.symlink_to("/dev/full")
            elif kind == "pipe":
                os.mkfifo(path)
            else:
                path.mkdir()
            run = desk.start()
            assert run.end() == 1, (name, kind)
            assert str(path) in run.said and len(run.said.splitlines()) == 1, run.said
            assert victim.read_bytes() == b"a photo"
            path.rmdir() if kind == "folder" else path.unlink()
    assert desk.start().end() == 0


def test_a_state_folder_that_is_a_link_is_refused(desk: Desk) -> None:
    desk.fill(1)
    elsewhere = desk.base / "elsewhere"
    elsewhere.mkdir()
    desk.pictures.mkdir(parents=True)
    (desk.pictures / ".crayonize").symlink_to(elsewhere)
    run = desk.start()
    assert run.end() == 1 and "is a link" in run.said
    assert not list(elsewhere.iterdir())


def test_a_journal_without_end_is_not_read(desk: Desk) -> None:
    desk.fill(1)
    state = desk.pictures / ".crayonize"
    state.mkdir(parents=True)
    with open(state / "journal.jsonl", "wb") as file:
        file.truncate(MOST_BYTES + 1)
    run = desk.start()
    assert run.end() == 1 and "larger than a journal" in run.said


def test_own_files_are_read_and_added_to(tmp_path: Path) -> None:
    with own_file(tmp_path / "a", "a+b") as file:
        file.write(b"one\n")
    with own_file(tmp_path / "a", "a+b") as file:
        file.write(b"two\n")
    with own_file(tmp_path / "a", "rb") as file:
        assert list(file) == [b"one\n", b"two\n"]
    with pytest.raises(FileNotFoundError), own_file(tmp_path / "b", "rb"):
        pass


WRITES = """
import sys, time
from stroke_gen.files import whole_file
with whole_file(sys.argv[1]) as part:
    part.write_bytes(b"half")
    print(part, flush=True)
    time.sleep(600)
"""


def writer(target: Path) -> tuple[subprocess.Popen[str], Path]:
    process = subprocess.Popen(
        [sys.executable, "-c", WRITES, str(target)], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    return process, Path(process.stdout.readline().strip())


def test_a_sweep_spares_the_living(tmp_path: Path) -> None:
    process, part = writer(tmp_path / "film.webp")
    try:
        sweep(tmp_path)
        assert part.exists()
    finally:
        process.kill()
    os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)  # dead, and still listed
    assert part.exists()
    sweep(tmp_path)
    assert not list(tmp_path.iterdir())
    process.wait()


def test_a_sweep_tells_machines_apart(tmp_path: Path) -> None:
    mine = f"{PART}{os.getpid()}-{files._machine()}-00.part.png"
    names = (mine, f"{PART}1-0123abcd-00.part.png", f"{PART}1-0123abcd-01.part.png",
             ".crayonize-notes.txt", "photo.part.png")  # fmt: skip
    for name in names:
        (tmp_path / name).touch()
    long_ago = time.time() - 7200
    os.utime(tmp_path / names[2], (long_ago, long_ago))
    os.utime(tmp_path / mine, (long_ago, long_ago))
    sweep(tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == set(names) - {names[2]}
    sweep(tmp_path, os.getpid())
    assert not (tmp_path / mine).exists()


def test_a_folder_run_spares_a_single_call_and_cleans_up_after_a_dead_one(desk: Desk) -> None:
    desk.fill(1)
    desk.pictures.mkdir(parents=True)
    alive, living = writer(desk.pictures / "film.webp")
    dead, left = writer(desk.pictures / "other.webp")
    dead.kill()
    dead.wait()
    try:
        assert desk.start().end() == 0
        assert living.exists() and not left.exists()
    finally:
        alive.kill()
        alive.wait()


def test_whole_files_still_leave_nothing(tmp_path: Path) -> None:
    with whole_file(tmp_path / "a") as part:
        part.write_bytes(b"x")
    assert [path.name for path in tmp_path.iterdir()] == ["a"]
