"""Faults while a batch is at work: what was done stays whole, the rest is done by the next run."""

import os
import random
import resource
import signal
import subprocess
import time
from pathlib import Path

import pytest
from conftest import Desk, check_whole, needs, photo, tree
from PIL import Image

from crayonize.batch import memory

ROOT = os.name == "posix" and os.geteuid() == 0
PHOTOS = 24


@pytest.mark.parametrize("chance", range(10))
def test_a_killed_worker_costs_nothing(desk: Desk, dice: random.Random, chance: int) -> None:
    run = desk.fill(PHOTOS, 0.02).start()
    run.wait_until(run.begun())
    for round_ in range(1 + chance % 2):
        # the same job twice would be taken for its fault
        run.wait_until(run.begun(1 + 10 * round_))
        time.sleep(dice.random() * 0.15)
        for worker in run.workers()[: 1 + chance // 5]:
            worker.kill()
    assert run.end() == 0, run.said
    assert run.count("ok") == PHOTOS
    assert not list(desk.pictures.rglob("*.part*"))


@pytest.mark.parametrize("chance", range(10))
def test_after_a_killed_parent_the_next_run_does_the_rest(
    desk: Desk, dice: random.Random, chance: int
) -> None:
    run = desk.fill(PHOTOS, 0.02).start()
    run.wait_until(run.begun(chance + 1))
    time.sleep(dice.random() * 0.05)
    run.process.kill()
    run.process.wait()
    run.wait_until(lambda: not run.session(), ended=True)
    check_whole(desk.pictures)
    before = len(list(desk.pictures.rglob("*.png")))
    again = desk.finish(PHOTOS)
    # at most the pictures whose line was not yet written
    assert again.count("skipped") >= before - 2


@pytest.mark.parametrize("chance", range(10))
def test_a_signal_ends_the_run_soon(desk: Desk, dice: random.Random, chance: int) -> None:
    number = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)[chance % 3]
    run = desk.fill(PHOTOS, 0.06 if chance < 7 else 600).start()
    run.wait_until(run.begun() if chance < 7 else lambda: len(run.workers()) == 2)
    time.sleep(dice.random() * 0.2)
    if number == signal.SIGINT:
        os.killpg(run.process.pid, number)
    else:
        run.process.send_signal(number)
    assert run.end() == 128 + number
    assert run.lines[-1]["end"] == "stopped" and run.count("not_run") > 0
    made = len(list(desk.pictures.rglob("*.png")))
    # a worker may be stopped between its picture and its word
    assert made - 2 <= run.count("ok") <= made
    assert not list(desk.pictures.rglob("*.part*"))
    if chance == 0:
        desk.finish(PHOTOS)


def test_a_second_ctrl_c_ends_it_at_once(desk: Desk) -> None:
    photo(desk.photos / "first.png")
    run = desk.fill(4, 600).start("--grace", "600")
    run.wait_until(run.begun())
    os.killpg(run.process.pid, signal.SIGINT)
    time.sleep(0.05)
    os.killpg(run.process.pid, signal.SIGINT)
    assert run.end() == 130


@pytest.mark.parametrize("name", ["hang.png", "spin.png", "stopped"])
def test_a_picture_that_hangs_ends_at_the_time_limit(desk: Desk, name: str) -> None:
    desk.fill(10)
    photo(desk.photos / ("a.600s.png" if name == "stopped" else name))
    run = desk.start("--time-limit", "1.5")
    if name == "stopped":
        run.wait_until(run.begun(5))
        for worker in run.workers():
            worker.suspend()
    assert run.end() == 3
    assert run.count("timeout") >= 1 and run.count("ok") + run.count("timeout") == 11


@pytest.mark.parametrize("name", ["segv", "abort", "exit", "raise", "once", "kill"])
def test_a_crash_costs_one_picture(desk: Desk, name: str) -> None:
    desk.fill(10)
    photo(desk.photos / f"{name}.png")
    if name == "kill":  # dies as often as it is tried
        (desk.photos / "kill.png").rename(desk.photos / "exit-kill.png")
    run = desk.run()
    verdict = {"once": "ok", "raise": "failed", "kill": "died"}.get(name, "died")
    assert run.count("ok") == 10 + (verdict == "ok")
    assert run.status("exit-kill.png" if name == "kill" else f"{name}.png") == verdict
    assert run.process.returncode == (0 if verdict == "ok" else 3)


@pytest.mark.parametrize("limit", [600 << 20, 900 << 20])
def test_a_picture_that_eats_memory_costs_one_picture(desk: Desk, limit: int) -> None:
    desk.fill(6)
    photo(desk.photos / "eat.png")
    run = desk.run("--memory", str(limit))
    assert run.process.returncode == 3
    assert run.status("eat.png") == "failed" and run.count("ok") == 6


@needs(
    ROOT and Path("/sys/fs/cgroup/memory/tasks").exists(), "root and control groups of version 1"
)
def test_the_kernel_ends_a_worker_over_its_memory(desk: Desk) -> None:
    group = Path(f"/sys/fs/cgroup/memory/crayonize-{os.getpid()}")
    group.mkdir()
    try:
        (group / "memory.limit_in_bytes").write_text(str(512 << 20))
        desk.fill(6)
        photo(desk.photos / "eat.png")
        run = desk.start("-j", "1", "--memory", str(8 << 30), preexec_fn=lambda: _join(group))
        assert run.end() == 3, run.said
        assert run.status("eat.png") == "died" and run.count("ok") == 6
    finally:
        time.sleep(0.1)
        group.rmdir()


def _join(group: Path) -> None:
    (group / "cgroup.procs").write_text(str(os.getpid()))


def test_a_photo_larger_than_the_memory_is_refused_before_it_is_opened(desk: Desk) -> None:
    desk.fill(2)
    Image.new("L", (6000, 5000)).save(desk.photos / "large.png")
    run = desk.run("--memory", str(memory.need(memory.decoding("PNG", 29_000_000), 64)))
    assert run.status("large.png") == "failed" and "memory" in run.said
    assert run.count("ok") == 2


# ---- disks ---------------------------------------------------------------------------------------


@needs(ROOT, "root, to mount a small disk")
@pytest.mark.parametrize("size, inodes", [("64k", 0), ("512k", 0), ("16m", 24)])
def test_a_full_disk_stops_the_run(desk: Desk, size: str, inodes: int) -> None:
    """Old pictures stay whole, and the run goes on when there is room."""
    for i in range(60):
        photo(desk.photos / f"{i:02}.png", i, (90, 70))
    desk.pictures.mkdir()
    subprocess.run(
        ["mount", "-t", "tmpfs", "-o", f"size={size},nr_inodes={inodes}", "x", desk.pictures],
        check=True,
    )
    try:
        old = photo(desk.pictures / "keep.png", 3).read_bytes()
        run = desk.run()
        assert run.process.returncode == 1
        assert "No space left" in run.lines[-1]["reason"]
        assert run.count("ok") > 0 and run.count("not_run") > 0
        check_whole(desk.pictures)
        assert (desk.pictures / "keep.png").read_bytes() == old
        assert not list(desk.pictures.rglob("*.part*"))
        subprocess.run(["mount", "-o", "remount,size=32m,nr_inodes=0", desk.pictures], check=True)
        again = desk.run()
        assert again.process.returncode == 0, again.said
        assert again.count("skipped") >= run.count("ok") - 2
        assert again.count("ok") + again.count("skipped") == 60
    finally:
        subprocess.run(["umount", desk.pictures], check=True)


@needs(ROOT, "root, to mount a disk read-only")
def test_a_read_only_disk_is_refused_at_once(desk: Desk) -> None:
    desk.fill(3).pictures.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", "ro", "x", desk.pictures], check=True)
    try:
        run = desk.start()
        assert run.end() == 1
        assert "Read-only" in run.said and "Traceback" not in run.said
    finally:
        subprocess.run(["umount", desk.pictures], check=True)


@needs(ROOT, "root, to give up its rights")
@pytest.mark.parametrize("where", ["folder", "subfolder"])
def test_a_folder_closed_to_us_stops_the_run(desk: Desk, where: str) -> None:
    desk.fill(6)
    closed = desk.pictures if where == "folder" else desk.pictures / "1"
    closed.mkdir(parents=True)
    closed.chmod(0o500)
    run = desk.run(prefix=["setpriv", "--bounding-set=-all", "--inh-caps=-all"])
    closed.chmod(0o700)
    assert run.process.returncode == 1
    assert "Permission denied" in run.said and "Traceback" not in run.said


@needs(Path("/dev/full").exists(), "/dev/full")
def test_a_report_that_cannot_be_written_stops_the_run(desk: Desk) -> None:
    with open("/dev/full", "wb") as full:
        run = desk.fill(4).start(stdout=full)
        assert run.end() == 1
    assert "No space left" in run.said and "Traceback" not in run.said


def test_a_reader_that_goes_away_stops_the_run(desk: Desk) -> None:
    run = desk.fill(20, 0.05).start()
    assert run.process.stdout
    run.process.stdout.readline()
    run.process.stdout.close()
    run.process.stdout = None
    assert run.end() == 1
    assert "Broken pipe" in run.said and "Traceback" not in run.said


@pytest.mark.parametrize("how", [{"stdin": None}, {"stdout": None}, {"stderr": None}], ids=str)
def test_closed_streams_do_not_matter(desk: Desk, how: dict[str, None]) -> None:
    number = {"stdin": 0, "stdout": 1, "stderr": 2}[next(iter(how))]
    run = desk.fill(3).start(preexec_fn=lambda: os.close(number))
    code = run.end()
    assert code == (1 if number == 1 else 0), run.said
    assert number == 1 or len(list(desk.pictures.rglob("*.png"))) == 3


@pytest.mark.parametrize("files", [16, 32])
def test_few_open_files_are_enough_or_refused(desk: Desk, files: int) -> None:
    desk.fill(4)
    run = desk.start(preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (files, files)))
    assert run.end() in (0, 1)
    assert "Traceback" not in run.said
    assert run.process.returncode or run.count("ok") == 4


# ---- several runs --------------------------------------------------------------------------------


@pytest.mark.parametrize("chance", range(3))
def test_a_second_run_on_one_folder_is_refused(
    desk: Desk, dice: random.Random, chance: int
) -> None:
    """The first is at work as long as it likes: one of its photos never ends."""
    photo(desk.photos / "hang.png")
    run = desk.fill(10, 0.1).start()
    run.wait_until(run.begun())
    time.sleep(dice.random() * 0.1)
    assert desk.start().end() == 4 and run.process.poll() is None
    run.wait_until(run.begun(10))
    os.killpg(run.process.pid, signal.SIGINT)
    assert run.end() == 130 and run.count("ok") == 10


def test_a_run_starts_beside_one_that_is_being_killed(desk: Desk) -> None:
    run = desk.fill(10, 0.1).start()
    run.wait_until(run.begun())
    run.process.kill()
    run.process.wait()
    desk.finish(10)


def test_shards_work_side_by_side_and_share_out_every_photo(desk: Desk) -> None:
    desk.fill(30, 0.02)
    runs = [desk.start("-j", "1", "--shard", f"{i}/3") for i in (1, 2, 3)]
    assert [run.end() for run in runs] == [0, 0, 0]
    assert sum(run.count("ok") for run in runs) == 30
    assert all(run.account()["in_other_shards"] + run.count("ok") == 30 for run in runs)
    assert desk.finish(30).count("skipped") == 30


def test_a_run_for_all_waits_for_no_shard(desk: Desk) -> None:
    shard = desk.fill(10, 0.2).start("-j", "1", "--shard", "1/2")
    shard.wait_until(shard.begun())
    assert desk.start().end() == 4
    assert shard.end() == 0


# ---- photos that change while they are looked at -------------------------------------------------


def test_photos_may_go_grow_or_change_on_the_way(desk: Desk) -> None:
    for i in range(8):
        photo(desk.photos / f"p{i}.0.2s.png", i)
    for i, name in enumerate(("go", "grow", "shrink", "swap")):
        photo(desk.photos / f"z-{name}.png", i)
    run = desk.start()
    run.wait_until(run.begun())
    (desk.photos / "z-go.png").unlink()
    with open(desk.photos / "z-grow.png", "ab") as file:
        file.write(b"more")
    data = (desk.photos / "z-shrink.png").read_bytes()
    (desk.photos / "z-shrink.png").write_bytes(data[: len(data) // 2])
    os.replace(photo(desk.base / "other.png", 9), desk.photos / "z-swap.png")
    desk._before = tree(desk.photos)
    assert run.end() == 3
    assert [run.status(f"z-{name}.png") for name in ("go", "grow", "shrink", "swap")] == [
        "failed",
        "ok",
        "failed",
        "ok",
    ]
    again = desk.run()
    assert again.status("z-grow.png") == again.status("z-swap.png") == "ok", (
        "they were noted as they were before"
    )
