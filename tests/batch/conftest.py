"""A folder of small photos, a batch over it in a process of its own, and what must hold after every
fault.
"""

import hashlib
import json
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pytest
from PIL import Image

HERE = Path(__file__).parent
# s after which something is taken to hang for ever: no test says how long anything takes
HANGS = 300.0
ROOT = HERE.parent.parent
_CALM: dict[
    tuple[tuple[str, str], ...], dict[str, str]
] = {}  # photos -> what an undisturbed run makes of them
STATUSES = {"ok", "failed", "died", "timeout", "skipped", "ignored", "not_run"}


def photo(path: Path, seed: int = 0, size: tuple[int, int] = (24, 16)) -> Path:
    """A small photo of noise."""
    path.parent.mkdir(parents=True, exist_ok=True)
    pixels = np.random.default_rng(seed).integers(0, 255, (size[1], size[0], 3), dtype=np.uint8)
    Image.fromarray(pixels).save(path)
    return path


def tree(folder: Path) -> dict[str, str]:
    """Every file below a folder with the hash of what it holds; our own notes left out."""
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
        and not path.is_symlink()
        and ".crayonize" not in path.relative_to(folder).parts
    }


class Batch:
    """One run of the command in its own session, under observation."""

    def __init__(
        self, inputs: list[Path], output: Path, words: list[str], prefix: list[str], **how: Any
    ) -> None:
        path = os.pathsep.join(map(str, (ROOT / "src", ROOT, HERE)))
        self.output = output
        self.process = subprocess.Popen(
            [*prefix, sys.executable, str(HERE / "drive.py"), *map(str, inputs), "-o", str(output),
             "--json", *words],
            **{"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "start_new_session": True,
               "env": {**os.environ, "PYTHONPATH": path}, **how},
        )  # fmt: skip
        self.lines: list[dict[str, Any]] = []
        self.said = ""

    def end(self, limit: float = HANGS) -> int:
        """Wait for the end; the exit code."""
        out, err = self.process.communicate(timeout=limit)
        self.lines = [json.loads(line) for line in (out or b"").decode("utf-8").splitlines()]
        self.said = (err or b"").decode("utf-8", "replace")
        return self.process.returncode

    def session(self) -> list[psutil.Process]:
        """All living processes of the run but its first."""
        found = []
        for process in psutil.process_iter(["pid", "status"]):
            try:
                if os.getsid(process.pid) == self.process.pid and process.pid != self.process.pid:
                    found.append(process)
            except OSError:
                continue
        return [process for process in found if process.info["status"] != psutil.STATUS_ZOMBIE]

    def workers(self) -> list[psutil.Process]:
        """The workers alive now."""
        return self.session()

    def wait_until(self, happened: Callable[[], object], ended: bool = False) -> None:
        """Wait for a state; ended: of a run that is over, else it must go on until then."""
        end = time.monotonic() + HANGS
        while not happened():
            assert time.monotonic() < end, "that never happened"
            assert ended or self.process.poll() is None, "the run is over"
            time.sleep(0.002)

    def begun(self, pictures: int = 1) -> Callable[[], bool]:
        """Whether so many pictures stand in the output folder."""
        return lambda: sum(1 for _ in self.output.rglob("*.png")) >= pictures

    def account(self) -> dict[str, Any]:
        """The last line, after a look at the books: every file told of once, and the sum right."""
        account = self.lines[-1]
        assert "end" in account, self.said
        names = [line.get("in_base64", line["in"]) for line in self.lines[:-1]]
        assert len(names) == len(set(names)) == account["total"]
        counts = dict.fromkeys(STATUSES, 0)
        for line in self.lines[:-1]:
            counts[line["status"]] += 1
        assert counts == account["counts"]
        assert account["exit_code"] == self.process.returncode
        return account

    def count(self, status: str) -> int:
        """How many files came out so."""
        return int(self.account()["counts"][status])

    def status(self, name: str) -> str:
        """What became of one file."""
        return next(line["status"] for line in self.lines if line.get("in") == name)


class Desk:
    """Photos in a folder, an empty folder for pictures, and what must hold for both at the end."""

    def __init__(self, base: Path) -> None:
        self.base, self.photos, self.pictures = base, base / "photos", base / "pictures"
        self.photos.mkdir()
        self._before: dict[str, str] | None = None
        self._runs: list[Batch] = []

    def fill(self, number: int, seconds: float = 0.0) -> "Desk":
        """Put photos into the folder that take so long each."""
        name = f".{seconds}s.png" if seconds else ".png"
        for i in range(number):
            photo(self.photos / f"{i % 3}" / f"p{i:04}{name}", i % 10)
        return self

    def start(
        self, *words: str, prefix: list[str] | None = None, output: Path | None = None, **how: Any
    ) -> Batch:
        """Start a batch with two workers."""
        if self._before is None:
            self._before = tree(self.photos)
        run = Batch(
            [self.photos], output or self.pictures, ["-j", "2", *words], prefix or [], **how
        )
        self._runs.append(run)
        return run

    def run(self, *words: str, **how: Any) -> Batch:
        """Run a batch to its end, with one worker if nothing else is said."""
        run = self.start("-j", "1", *words, **how)
        run.end()
        return run

    def check(self) -> None:
        """Photos untouched, pictures whole, nothing left behind."""
        if self._before is not None:
            assert tree(self.photos) == self._before, "photos have changed"
        for run in self._runs:
            if run.process.poll() is None:
                os.killpg(run.process.pid, signal.SIGKILL)
                run.process.wait()
                raise AssertionError("a run was still going on")
            assert not run.session(), "processes were left behind"
        check_whole(self.pictures)

    def finish(self, total: int) -> Batch:
        """Run once more: then everything is done, as by a run that nothing disturbed."""
        again = self.run()
        assert again.process.returncode == 0, again.said
        assert again.count("ok") + again.count("skipped") == total
        assert not list(self.pictures.rglob("*.part*"))
        photos = tuple(tree(self.photos).items())
        if photos not in _CALM:
            self.run(output=self.base / "calm")
            _CALM[photos] = tree(self.base / "calm")
        assert tree(self.pictures) == _CALM[photos]
        return again


def check_whole(folder: Path) -> None:
    """Every picture below a folder can be decoded."""
    for path in (path for path in folder.rglob("*.png") if path.is_file()):
        with Image.open(path) as picture:
            picture.load()


@pytest.fixture
def desk(tmp_path: Path) -> Iterator[Desk]:
    """A desk, looked over at the end of each test."""
    desk = Desk(tmp_path)
    yield desk
    desk.check()


@pytest.fixture
def dice(request: pytest.FixtureRequest) -> random.Random:
    """Chances that are the same in each run of a test."""
    return random.Random(request.node.name)


def needs(condition: bool, why: str) -> pytest.MarkDecorator:
    """Skip where the machine does not offer what a test injects its fault with."""
    return pytest.mark.skipif(not condition, reason=f"needs {why}")
