"""One conversion, cut off or refused at any of its system calls: the old picture, the new one, or
none.
"""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from conftest import HERE, ROOT, needs, photo

pytestmark = needs(shutil.which("strace") is not None, "strace")

ERRORS = [  # call, which of its calls, errors
    ("write", "PNG", ("ENOSPC", "EIO", "EDQUOT")),
    ("fsync", "<PART", ("EIO", "ENOSPC", "EDQUOT")),
    ("rename", "PART", ("EXDEV", "EACCES")),
    ("openat", "PART", ("EACCES", "EMFILE")),
    ("close", "<PART", ("ENOSPC", "EIO")),
    ("mkdir", "pictures", ("EROFS",)),
    ("read", "photo.png", ("EIO",)),
]
CASES = [(call, at, error) for call, at, errors in ERRORS for error in errors]


class Forge:
    """Runs conversions under strace."""

    def __init__(self, base: Path) -> None:
        path = os.pathsep.join(map(str, (ROOT / "src", ROOT, HERE)))
        self.base = base
        self.photo = photo(base / "photos" / "photo.png", 1)
        self.picture = base / "pictures" / "picture.png"
        self._errors = base / "errors"
        with open(self._errors, "wb") as errors:
            self._process = subprocess.Popen(
                [sys.executable, str(HERE / "forge.py")],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                text=True,
                stderr=errors,
                env={**os.environ, "PYTHONPATH": path},
            )

    def convert(self, *words: str) -> tuple[int, str, str]:
        """One conversion with strace told `words`: exit code, verdict, and the trace."""
        assert self._process.stdin and self._process.stdout
        self._errors.write_bytes(b"")
        self._say(f"{self.photo} {self.picture}")
        child, trace = self._process.stdout.readline().strip(), self.base / "trace"
        strace = subprocess.Popen(
            ["strace", "-qq", "-y", "-o", str(trace), "-p", child, *words],
            stderr=subprocess.PIPE,
            text=True,
        )
        tracer = re.compile(rf"TracerPid:\t{strace.pid}\b")
        while not tracer.search(Path(f"/proc/{child}/status").read_text()):
            if strace.poll() is not None:  # the child was killed at once
                assert not strace.returncode, strace.stderr and strace.stderr.read()
                break
        self._say("go")
        code = int(self._process.stdout.readline())
        strace.communicate(timeout=300)
        return code, self._errors.read_text().strip("\0\n"), trace.read_text()

    def _say(self, line: str) -> None:
        assert self._process.stdin
        self._process.stdin.write(line + "\n")
        self._process.stdin.flush()

    def blank(self, old: bytes | None) -> None:
        """An output folder with an old picture, or none at all."""
        shutil.rmtree(self.picture.parent, ignore_errors=True)
        if old:
            self.picture.parent.mkdir()
            self.picture.write_bytes(old)

    def close(self) -> None:
        """End."""
        assert self._process.stdin
        self._process.stdin.close()
        assert self._process.wait(10) == 0


@pytest.fixture
def forge(tmp_path: Path) -> Iterator[Forge]:
    forge = Forge(tmp_path)
    yield forge
    forge.close()


@pytest.mark.parametrize("there", [False, True], ids=["new", "over an old one"])
def test_killed_at_every_system_call(forge: Forge, there: bool) -> None:
    old = photo(forge.base / "old.png", 5).read_bytes() if there else None
    forge.blank(old)
    code, verdict, trace = forge.convert()
    assert (code, verdict) == (0, "ok "), trace
    new, calls = forge.picture.read_bytes(), len(trace.splitlines())
    seen, parts, point = set(), 0, 0
    while True:
        point += 1
        forge.blank(old)
        code, verdict, _ = forge.convert("-e", f"inject=all:signal=KILL:when={point}")
        if code == 0:
            break
        assert code == -9
        now = forge.picture.read_bytes() if forge.picture.exists() else None
        assert now in (old, new), f"call {point}"
        seen.add(now)
        parts += len(list(forge.base.rglob("*.part*")))
    assert point >= min(28, calls - 5) and seen == {old, new} and parts > 0


@pytest.mark.parametrize("call, at, error", CASES, ids=[" ".join((c, e)) for c, _, e in CASES])
@pytest.mark.parametrize("there", [False, True], ids=["new", "over an old one"])
def test_refused_by_the_system(forge: Forge, there: bool, call: str, at: str, error: str) -> None:
    old = photo(forge.base / "old.png", 5).read_bytes() if there else None
    if call == "mkdir" and there:
        pytest.skip("a folder with a picture in it need not be made")
    forge.blank(old)
    *_, trace = forge.convert("-e", f"trace={call}")
    marks = {
        "PNG": "PNG",
        "PART": ".part",
        "<PART": ".part.png>",
        "pictures": "pictures",
        "photo.png": "photo.png",
    }
    lines = [line for line in trace.splitlines() if line.startswith(call)]
    when = 1 + next(i for i, line in enumerate(lines) if marks[at] in line)
    forge.blank(old)
    code, verdict, _ = forge.convert(
        "-e", f"trace={call}", "-e", f"inject={call}:error={error}:when={when}"
    )
    assert code == 0
    assert verdict.startswith("failed cannot be read" if call == "read" else "OutputError"), verdict
    assert call == "read" or str(forge.picture.parent) in verdict, "the message names the path"
    assert (forge.picture.read_bytes() if forge.picture.exists() else None) == old
    assert not list(forge.base.rglob("*.part*"))
