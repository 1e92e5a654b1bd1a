"""A folder under watch."""

import json
import os
import select
import signal
import time

from conftest import Batch, Desk, photo, tree


def drawn(run: Batch, name: str) -> str:
    """Wait for the next line about a file; its status."""
    assert run.process.stdout
    while not (mine := [line for line in run.lines if line["in"] == name]):
        assert select.select([run.process.stdout], [], [], 30)[0], f"nothing more is said of {name}"
        run.lines.append(json.loads(run.process.stdout.readline()))
    run.lines.remove(mine[0])
    return str(mine[0]["status"])


def test_photos_are_drawn_when_they_have_stopped_growing(desk: Desk) -> None:
    desk.fill(2).run()
    run = desk.start("--watch", bufsize=0)
    assert drawn(run, "1/p0001.png") == "skipped"
    content = photo(desk.base / "late.png", 5).read_bytes()
    with open(desk.photos / "late.png", "wb") as file:
        for i in range(6):  # 2.5 s of growing, longer than a photo must have been at rest
            file.write(content[i * len(content) // 6 : (i + 1) * len(content) // 6])
            file.flush()
            time.sleep(0.42)
    (desk.photos / "broken.png").write_bytes(content[:200])
    assert (drawn(run, "late.png"), drawn(run, "broken.png")) == ("ok", "failed")
    photo(desk.photos / "broken.png", 6)
    assert drawn(run, "broken.png") == "ok", "mended, it is tried again"
    photo(desk.photos / "late.jpg", 5)
    assert drawn(run, "late.jpg") == "failed", "late.png has its place"
    os.killpg(run.process.pid, signal.SIGINT)
    assert run.process.stdout
    account = json.loads(run.process.stdout.read().splitlines()[-1])
    assert run.process.wait() == 130
    assert account["counts"]["ok"] == 2 and account["end"] == "stopped"
    assert set(tree(desk.pictures)) == {"0/p0000.png", "1/p0001.png", "late.png", "broken.png"}
    desk._before = None
