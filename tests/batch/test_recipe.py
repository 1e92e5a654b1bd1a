"""What makes a picture count as drawn already, and what each worker gets of the machine."""

from dataclasses import fields, replace
from pathlib import Path

import pytest

from crayonize.batch import conductor, memory
from crayonize.batch.job import Recipe
from crayonize.batch.options import Options
from crayonize.batch.output import OutputFolder
from crayonize.machine import cores, source
from crayonize.settings import Settings

OTHER_SETTINGS = {
    "palette": "box8",
    "paper": "kraft",
    "style": "sketch",
    "force": "heavy",
    "size": 9,
    "sheet_mm": 9.0,
    "seed": 9,
    "physics": "rudolf2003",
    "preview": True,
    "age": 5,
    "left_handed": True,
    "focus": ((0.0, 0.0, 1.0, 1.0),),
    "subject": "none",
}
OTHER_RECIPE = {"light": False, "metadata": "all", "page": "a4", "dpi": 100.0}
LIMITS = ("max_pixels", "max_bytes")  # they decide whether a photo is drawn, not how


def test_all_that_shapes_a_picture_is_in_the_digest() -> None:
    plain = Recipe(Settings())
    digests = [plain.digest("png"), plain.digest("jpg")]
    for name, value in OTHER_SETTINGS.items():
        digests.append(
            replace(plain, settings=replace(plain.settings, **{name: value})).digest("png")
        )
    for name, value in OTHER_RECIPE.items():
        digests.append(replace(plain, **{name: value}).digest("png"))
    assert len(set(digests)) == len(digests)


def test_no_choice_is_forgotten_above() -> None:
    """A new field of Settings or Recipe has to be named in this file."""
    of_settings = {field.name for field in fields(Settings)}
    assert of_settings - OTHER_SETTINGS.keys() <= {"threads"}
    assert {field.name for field in fields(Recipe)} == {"settings", *OTHER_RECIPE, *LIMITS}


def test_threads_and_limits_change_nothing() -> None:
    plain = Recipe(Settings())
    same = replace(plain, settings=replace(plain.settings, threads=3), max_pixels=9, max_bytes=9)
    assert same.digest("png") == plain.digest("png")


def test_a_file_counts_with_its_content(tmp_path: Path) -> None:
    mine = tmp_path / "mine.txt"
    mine.write_text("#ff0000")
    recipe = Recipe(Settings(palette=str(mine)))
    before = recipe.digest("png")
    mine.write_text("#00ff00")
    assert recipe.digest("png") != before


def test_another_version_of_the_wax_draws_a_folder_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    before = Recipe(Settings()).digest("png")
    monkeypatch.setattr(source, "of_drawings", lambda: "another")
    assert Recipe(Settings()).digest("png") != before


def test_the_version_is_that_of_all_rooms_that_shape_a_drawing() -> None:
    here, generator = source._HERE, source._GENERATOR
    rooms = (here / "wax", here / "light", here / "crayons", here / "data", generator)
    files = source._in(*rooms)
    assert {"contact.py", "papers.toml", "box24.json", "hand.py", "artist.toml"} <= {
        file.name for file in files
    }
    assert source.of_drawings() == source.hash_of(files) != source.of_the_wax()
    assert source.hash_of(files[1:]) != source.hash_of(files) == source.hash_of(files[::-1])


@pytest.mark.parametrize(("jobs", "threads"), [(1, 8), (2, 4), (3, 2), (8, 1), (20, 1)])
def test_workers_share_the_cores(
    jobs: int, threads: int, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    started = []
    monkeypatch.setattr(cores, "allowed", lambda: 8)
    monkeypatch.setattr(conductor, "Crew", lambda size, hello, *_: started.append((size, hello)))
    folder = OutputFolder(str(tmp_path), None, "")
    conductor._workers(Options(jobs=jobs), Recipe(Settings()), folder, 100, None, None)
    ((size, hello),) = started
    assert size == jobs and hello["recipe"]["settings"]["threads"] == threads


def test_workers_leave_a_share_of_the_memory() -> None:
    one = memory.need(memory.decoding("JPEG", 24_000_000), 1600)
    assert [memory.workers(n * one, 1600) for n in (1, 2, 3, 10, 20)] == [1, 1, 2, 7, 14]
    assert memory.workers(None, 1600) == 512


def test_a_preview_needs_a_quarter_of_the_cells() -> None:
    bare = memory.need(0, 0)
    assert memory.need(0, 2000, preview=True) - bare == (memory.need(0, 2000) - bare) / 4 > 0
