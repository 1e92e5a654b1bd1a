"""Going on: what is drawn again, what is left alone, and what the journal is trusted with."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from conftest import Batch, Desk, photo, tree
from PIL import Image

from crayonize.batch.job import Found, Job, Recipe
from crayonize.batch.journal import Journal
from crayonize.settings import Settings


def times(folder: Path) -> dict[str, int]:
    """When each picture was last written."""
    return {str(path): path.stat().st_mtime_ns for path in folder.rglob("*.png")}


def test_a_second_run_does_nothing(desk: Desk) -> None:
    desk.fill(12).run()
    before = times(desk.pictures)
    again = desk.run()
    assert again.process.returncode == 0 and again.count("skipped") == 12
    assert times(desk.pictures) == before


def test_auto_draws_again_what_has_changed(desk: Desk) -> None:
    desk.fill(6).run()
    changed, touched, new = (desk.photos / "0" / f"p000{i}.png" for i in (0, 3, 9))
    photo(changed, 77)
    os.utime(touched)
    photo(new)
    (desk.pictures / "1" / "p0001.png").unlink()
    (desk.pictures / "2" / "p0002.png").write_bytes(b"cut")
    desk._before = tree(desk.photos)
    again = desk.run()
    drawn = {line["in"] for line in again.lines if line.get("status") == "ok"}
    assert drawn == {"0/p0000.png", "0/p0003.png", "0/p0009.png", "1/p0001.png", "2/p0002.png"}


def test_auto_draws_again_with_other_settings(desk: Desk) -> None:
    desk.fill(4).run()
    assert desk.run("--seed", "7").count("ok") == 4
    assert desk.run("--seed", "7").count("skipped") == 4
    assert desk.run().count("ok") == 4


@pytest.mark.parametrize(
    "existing, code, counts", [("skip", 0, (2, 4)), ("overwrite", 0, (6, 0)), ("fail", 2, None)]
)
def test_existing(desk: Desk, existing: str, code: int, counts: tuple[int, int] | None) -> None:
    desk.fill(6).run()
    for path in list(desk.pictures.rglob("*.png"))[:2]:
        path.unlink()
    before = times(desk.pictures)
    again = desk.run("--existing", existing)
    assert again.process.returncode == code, again.said
    if counts:
        assert (again.count("ok"), again.count("skipped")) == counts
    else:
        assert "is there already" in again.said and times(desk.pictures) == before


def test_what_others_put_there_is_not_overwritten(desk: Desk) -> None:
    """A picture without a line in the journal is drawn anew only if it says that it was made
    here.
    """
    desk.fill(3).run()
    (desk.pictures / ".crayonize" / "journal.jsonl").unlink()
    mine = desk.pictures / "1" / "p0001.png"
    Image.new("RGB", (5, 5)).save(mine)
    before = mine.read_bytes()
    again = desk.run()
    assert again.process.returncode == 3 and again.status("1/p0001.png") == "failed"
    assert again.count("ok") == 2 and mine.read_bytes() == before
    assert "--existing" in again.said
    assert desk.run("--existing", "overwrite").count("ok") == 3


def test_a_damaged_journal_costs_only_its_lines(desk: Desk) -> None:
    desk.fill(8).run()
    path = desk.pictures / ".crayonize" / "journal.jsonl"
    lines = path.read_bytes().split(b"\n")
    lines[1] = b"\xff\xfe garbage"
    lines[2] = b"[" * 100_000
    lines[3] = b'{"out": 3}'
    lines[4] = b"null"
    path.write_bytes(b"\n".join(lines[:-2]) + b"\n" + lines[-2][:30])  # the last line torn
    again = desk.run()
    assert again.process.returncode == 0
    assert (again.count("ok"), again.count("skipped")) == (5, 3)
    assert desk.run().count("skipped") == 8
    assert json.loads(path.read_bytes().split(b"\n")[-2])


@pytest.mark.parametrize("stamp", [0, -(10**9), 2_145_916_800, time.time() + 7200])
def test_odd_dates_are_only_compared(desk: Desk, stamp: float) -> None:
    desk.fill(2)
    for path in desk.photos.rglob("*.png"):
        os.utime(path, (stamp, stamp))
    assert desk.run().count("ok") == 2
    assert desk.run().count("skipped") == 2


def test_order_workers_and_company_change_no_byte(desk: Desk) -> None:
    desk.fill(9).run()
    for number, words in enumerate((["-j", "1"], ["-j", "4"], ["--shard", "1/1"])):
        other = desk.base / f"other{number}"
        assert desk.run(*words, output=other).process.returncode == 0
        assert tree(other) == tree(desk.pictures)
    few = Batch([desk.photos / "1"], desk.base / "few", [], [])
    assert few.end() == 0
    assert tree(desk.base / "few") == tree(desk.pictures / "1")


def test_a_dry_run_writes_nothing(desk: Desk) -> None:
    desk.fill(3)
    first = desk.run("--dry-run")
    assert first.process.returncode == 0 and first.count("not_run") == 3
    assert not desk.pictures.exists()
    listed = subprocess.run(
        [sys.executable, "-m", "crayonize", desk.photos, desk.pictures, "--dry-run"],
        capture_output=True, text=True,
    )  # fmt: skip
    assert len(listed.stdout.splitlines()) == 3 and " -> " in listed.stdout
    assert not desk.pictures.exists()
    desk.run()
    assert desk.run("--dry-run").count("skipped") == 3


def test_recipes_are_told_apart(tmp_path: Path) -> None:
    style = tmp_path / "mine.toml"
    style.write_text("a")
    recipe = Recipe(Settings(style=str(style)))
    first = recipe.digest("png")
    assert first == Recipe(Settings(style=str(style), threads=3)).digest("png")
    assert first != recipe.digest("jpg")
    style.write_text("b")
    assert first != recipe.digest("png")
    assert Recipe.from_json(json.loads(json.dumps(recipe.to_json()))) == recipe


def test_the_journal_keeps_any_name(tmp_path: Path) -> None:
    name = os.fsdecode(b"\xff\n\\x.png")
    job = Job(Found(name, name, "", 5, "6"), name, "")
    journal = Journal(tmp_path / "j", [], "r")
    journal.add(job, 10)
    for again, done in (
        (Journal(tmp_path / "j", [], "r"), True),
        (Journal(tmp_path / "j", [], "other"), False),
    ):
        assert again.knows(name) and again.is_done(job, 10) is done
        assert not again.is_done(job, 11) and not again.is_done(job, None)
