"""What is told of a batch, and what it costs the foreman."""

import json
import os
import pty
import random
import time
from pathlib import Path

import pytest
from conftest import Desk, photo

from crayonize.batch.job import Found, Job
from crayonize.batch.journal import Journal


def test_a_bar_on_a_terminal(desk: Desk) -> None:
    desk.fill(12, 0.15)
    (desk.photos / "bad.png").write_bytes(b"no picture")
    ours, theirs = pty.openpty()
    run = desk.start(stderr=theirs)
    os.close(theirs)
    shown = b""
    try:
        while part := os.read(ours, 4096):
            shown += part
    except OSError:  # so ends a terminal on Linux
        pass
    finally:
        os.close(ours)
    assert run.end() == 3
    text = shown.decode()
    assert " of 13 done, 1 failed, " in text and " left, " in text and "[#" in text
    assert text.splitlines()[-1].strip().startswith("crayonize: 12 ok, 1 failed; ")


def test_quiet_tells_only_of_failures(desk: Desk) -> None:
    desk.fill(2)
    assert desk.run("-q").said == ""
    (desk.photos / "bad.png").write_bytes(b"no picture")
    desk._before = None
    said = desk.run("-q").said
    assert said.count("\n") == 1 and "bad.png" in said


def test_a_line_for_each_file_and_an_account(desk: Desk) -> None:
    desk.fill(3)
    (desk.photos / "bad.png").write_bytes(b"no picture")
    (desk.photos / ".hidden").write_bytes(b"")
    run = desk.run()
    account = run.account()
    assert account["end"] == "finished" and account["total"] == 5 and account["seconds"] > 0
    good = next(line for line in run.lines if line.get("status") == "ok")
    assert good["bytes"] == (desk.pictures / good["out"]).stat().st_size
    assert {"in", "out", "status", "strokes", "bytes", "seconds"} == set(good)
    bad = next(line for line in run.lines if line.get("status") == "failed")
    assert bad["in"] == "bad.png" and "picture" in bad["error"]


def test_a_worker_that_prints_disturbs_nobody(desk: Desk) -> None:
    desk.fill(3)
    photo(desk.photos / "shout.png")
    run = desk.run()
    assert run.count("ok") == 4 and "shouting" not in run.said


def test_workers_wait_for_memory(desk: Desk) -> None:
    """Two photos that do not fit together are drawn one after the other."""
    from crayonize.batch import memory

    for i in range(6):
        photo(desk.photos / f"p{i}.0.2s.png", i)
    begun = time.monotonic()
    run = desk.run(
        "-j", "2", "--memory", str(int(1.3 * memory.need(memory.decoding("PNG", 384), 64)))
    )
    assert run.count("ok") == 6
    assert time.monotonic() - begun > 6 * 0.2
    assert sum(line["seconds"] for line in run.lines[:-1]) > 6 * 0.2 + 3 * 0.2, "somebody waited"


def test_many_photos_cost_the_foreman_little(desk: Desk) -> None:
    content = photo(desk.base / "a.png").read_bytes()
    for i in range(600):
        (desk.photos / f"{i:03}.png").write_bytes(content if i % 12 else content[:100])
    log = desk.base / "log"
    with open(log, "wb") as stdout:
        run = desk.start(stdout=stdout)
    most = files = 0
    while run.process.poll() is None:
        fields = Path(f"/proc/{run.process.pid}/statm").read_text().split()
        if len(fields) > 1:
            most = max(most, int(fields[1]) * 4096)
        files = max(files, len(os.listdir(f"/proc/{run.process.pid}/fd")))
        time.sleep(0.02)
    assert run.end() == 3
    run.lines = [json.loads(line) for line in log.read_text().splitlines()]
    assert (run.count("ok"), run.count("failed")) == (550, 50)
    assert most < 60 << 20 and files < 32
    assert desk.run().count("skipped") == 550


@pytest.mark.parametrize("seed", range(4))
def test_no_journal_is_too_damaged_to_go_on(tmp_path: Path, seed: int) -> None:
    chance = random.Random(seed)
    job = Job(Found("a", "a", "", 5, "6"), "a", "")
    path = tmp_path / "journal"
    for _ in range(5):
        Journal(path, [], "r").add(job, 10)
    good = path.read_bytes()
    for _ in range(50):
        data = bytearray(good)
        for _ in range(chance.randint(1, 8)):
            at = chance.randrange(len(data))
            data[at : at + chance.choice((0, 1, 9))] = chance.randbytes(chance.choice((0, 1, 5)))
        path.write_bytes(data)
        journal = Journal(path, [], "r")
        journal.add(job, 11)
        assert Journal(path, [], "r").is_done(job, 11)
