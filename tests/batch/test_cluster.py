"""The same folder on a Dask cluster: a scheduler and two workers over TCP, one of them killed on
the way.
"""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest
from conftest import HANGS, HERE, ROOT, Desk, photo

from crayonize.batch import cluster as cluster_module
from crayonize.batch.job import Recipe
from crayonize.settings import Settings

pytest.importorskip("distributed")

PATH = os.pathsep.join(map(str, (ROOT / "src", ROOT, HERE)))


class Cluster:
    """A scheduler and two workers, each in a session of its own."""

    def __init__(self, base: Path) -> None:
        self._base = base
        self._all: list[subprocess.Popen[bytes]] = []
        told = base / "scheduler.json"
        self.scheduler = self._start(
            "scheduler",
            "--host",
            "127.0.0.1",
            "--port",
            "0",
            "--no-dashboard",
            "--scheduler-file",
            str(told),
        )
        end = time.monotonic() + HANGS
        while not told.exists() or not told.read_text():
            assert time.monotonic() < end
            time.sleep(0.05)
        self.address = json.loads(told.read_text())["address"]
        places = [str(base / f"w{i}") for i in range(2)]
        words = ["worker", self.address, "--nthreads", "1", "--no-dashboard", "--host", "127.0.0.1"]
        self.workers = [self._start(*words, "--local-directory", place) for place in places]

    def _start(self, *words: str) -> subprocess.Popen[bytes]:
        process = subprocess.Popen(
            [sys.executable, "-m", "dask", *words],
            env={**os.environ, "PYTHONPATH": PATH},
            start_new_session=True,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        self._all.append(process)
        return process

    def kill(self, process: subprocess.Popen[bytes]) -> None:
        """As a machine that loses its power: all of a session at once."""
        for one in (process.pid, *_session(process.pid)):
            if psutil.pid_exists(one):
                os.kill(one, signal.SIGKILL)
        process.wait()

    def close(self) -> None:
        """Kill all."""
        for process in self._all:
            if process.poll() is None:
                self.kill(process)


def _session(leader: int) -> list[int]:
    found = []
    for pid in psutil.pids():
        try:
            if os.getsid(pid) == leader and pid != leader:
                found.append(pid)
        except OSError:
            continue
    return found


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[Cluster]:
    cluster = Cluster(tmp_path)
    yield cluster
    cluster.close()


def test_a_worker_killed_on_the_way_costs_nothing(desk: Desk, cluster: Cluster) -> None:
    run = desk.fill(40, 0.1).start("--dask", cluster.address)
    run.wait_until(run.begun(6))
    cluster.kill(cluster.workers[0])
    assert run.end() == 0, run.said
    assert run.count("ok") == 40
    again = desk.finish(40)  # at home, the same bytes
    assert again.count("skipped") == 40


def test_bad_files_and_crashes_are_what_they_are_at_home(desk: Desk, cluster: Cluster) -> None:
    desk.fill(6)
    (desk.photos / "text.jpg").write_text("no picture")
    photo(desk.photos / "segv.png")
    photo(desk.photos / "hang.png")
    run = desk.start("--dask", cluster.address, "--time-limit", "3")
    assert run.end() == 3, run.said
    verdicts = [run.status(name) for name in ("text.jpg", "segv.png", "hang.png")]
    assert verdicts == ["failed", "died", "timeout"] and run.count("ok") == 6
    left = [pid for worker in cluster.workers for pid in _session(worker.pid)]
    assert not [
        pid for pid in left if "crayonize.batch.worker" in " ".join(psutil.Process(pid).cmdline())
    ]


def test_a_lost_scheduler_ends_the_run_and_the_next_goes_on(desk: Desk, cluster: Cluster) -> None:
    run = desk.fill(30, 0.1).start("--dask", cluster.address)
    run.wait_until(run.begun(3))
    os.killpg(run.process.pid, signal.SIGINT)
    assert run.end() == 130
    run = desk.start("--dask", cluster.address)
    run.wait_until(run.begun(12))
    cluster.kill(cluster.scheduler)
    assert run.end() == 1
    assert "cluster is lost" in run.said and run.count("not_run") > 0
    for worker in cluster.workers:
        cluster.kill(worker)
    desk.finish(30)


def test_nobody_there(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster_module, "_CONNECTING", 1.0)
    with pytest.raises(OSError):
        cluster_module.Cluster("tcp://127.0.0.1:9", Recipe(Settings()), None, 10)
