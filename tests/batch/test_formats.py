"""Formats, pages and what photos tell of themselves."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from conftest import HERE, Desk, photo
from PIL import Image

from crayonize.images.metadata import kept
from crayonize.images.page import fitted
from crayonize.images.read import open_photo
from crayonize.settings import Settings

EXIF_FOLDER, GPS_FOLDER = 0x8769, 0x8825


def told(path: Path) -> dict[str, Any]:
    """What a photo or picture tells of itself."""
    with Image.open(path) as picture:
        exif = picture.getexif()
        inside, place = exif.get_ifd(EXIF_FOLDER), exif.get_ifd(GPS_FOLDER)
        title = exif.get(40091)
        if isinstance(title, tuple):
            title = bytes(title)
        return {
            "artist": exif.get(315),
            "copyright": exif.get(33432),
            "camera": exif.get(271),
            "turn": exif.get(274),
            "title": title and title.decode("utf-16-le").strip("\0"),
            "date": inside.get(36867) or exif.get(306),
            "place": place,
        }


@pytest.fixture
def memory_photo(desk: Desk) -> Path:
    """A photo with a story, lying on its side."""
    path = photo(desk.photos / "a.jpg")
    exif = Image.Exif()
    exif.update(
        {
            270: "Grandma",
            315: "Me",
            33432: "Mine",
            271: "Camera",
            274: 6,
            256: 999,
            34675: b"no profile",
        }
    )
    exif.get_ifd(EXIF_FOLDER).update(
        {36867: "2020:02:03 04:05:06", 37500: b"maker", 40962: 999, 40961: 65535}
    )
    exif.get_ifd(GPS_FOLDER).update({1: "N", 2: (1.0, 2.0, 3.0)})
    with Image.open(path) as picture:
        picture.load()
    picture.save(path, exif=exif)
    return path


@pytest.mark.parametrize("format_", ["png", "jpg", "webp", "tif"])
@pytest.mark.parametrize("which", ["none", "safe", "all"])
def test_metadata(desk: Desk, memory_photo: Path, which: str, format_: str) -> None:
    run = desk.run("--metadata", which, "--format", format_)
    assert run.process.returncode == 0, run.said
    new = told(desk.pictures / f"a.{format_}")
    safe = {"artist": "Me", "copyright": "Mine", "title": "Grandma", "date": "2020:02:03 04:05:06"}
    assert {key: new[key] for key in safe} == (dict.fromkeys(safe) if which == "none" else safe)
    assert new["camera"] == ("Camera" if which == "all" else None)
    assert bool(new["place"]) == (which == "all" and format_ != "tif")
    assert new["turn"] in (None, 1)
    with Image.open(desk.pictures / f"a.{format_}") as picture:
        assert picture.size == (16, 24), "turned upright"
        assert "sRGB".encode("utf-16-be") in picture.info["icc_profile"]
        assert not {256: 999}.items() & dict(picture.getexif()).items()


def test_damaged_or_endless_metadata_is_left_out(desk: Desk, memory_photo: Path) -> None:
    content = memory_photo.read_bytes()
    at = content.index(b"Exif\0\0")
    for i in range(60):
        damaged = bytearray(content)
        damaged[at + 6 + 2 * i] ^= 0xFF
        (desk.photos / f"d{i}.jpg").write_bytes(damaged)
    exif = Image.Exif()
    exif[315] = "x" * 64_000
    Image.new("RGB", (8, 8)).save(desk.photos / "long.png", exif=exif)
    run = desk.run("--metadata", "all", "--format", "jpg")
    assert run.count("ok") == 62, run.said
    with open_photo(desk.photos / "long.png") as long:
        long.light()
        assert kept(long.exif, "all") is None


@pytest.mark.parametrize(
    "page, dpi, shape, wanted",
    [("a4", 300, (4000, 2000), (297, 3508)), ("a4", None, (3000, 4000), (280, 3307)),
     ("a4", 150, (10, 10), (210, 1240)), ("letter", 300, (4, 3), (279.4, 3300)),
     (None, 100, (3, 2), (297, 1169)), (None, None, (3, 2), (297, 1600))],
)  # fmt: skip
def test_pages(
    page: str | None, dpi: float | None, shape: tuple[int, int], wanted: tuple[float, int]
) -> None:
    settings = fitted(Settings(sheet_mm=297.0), page, dpi, *shape)
    assert (settings.sheet_mm, settings.size) == pytest.approx(wanted)


def test_heic_without_its_package_names_what_to_install(desk: Desk) -> None:
    desk.fill(1)
    (desk.photos / "phone.heic").write_bytes(b"\0\0\0\x18ftypheic\0\0\0\0heicmif1" + bytes(100))
    path = os.pathsep.join(
        map(str, (HERE / "missing", HERE.parents[1] / "src", HERE.parents[1], HERE))
    )
    run = desk.start(env={**os.environ, "PYTHONPATH": path})
    assert run.end() == 3
    assert run.status("phone.heic") == "failed" and run.count("ok") == 1
    assert 'pip install pi-heif' in run.said


def test_limits(desk: Desk) -> None:
    photo(desk.photos / "small.png", size=(10, 10))
    Image.new("L", (2000, 2)).save(desk.photos / "wide.png")
    photo(desk.photos / "heavy.png", size=(60, 60))
    run = desk.run("--max-pixels", "3700", "--max-bytes", "8k")
    assert [run.status(f"{name}.png") for name in ("small", "wide", "heavy")] == [
        "ok",
        "failed",
        "failed",
    ]
    assert "--max-pixels" in run.said and "--max-bytes" in run.said


def test_help_and_planning_load_nothing_heavy(tmp_path: Path) -> None:
    photo(tmp_path / "in" / "a.png")
    code = f"""
import sys
from crayonize.batch.conductor import run
from crayonize.batch.job import Recipe
from crayonize.batch.options import Options
from crayonize.settings import Settings
assert run([{str(tmp_path / "in")!r}], {str(tmp_path / "out")!r},
           Options(quiet=True), Recipe(Settings()),
           render="stand_in:sketch") == 0
assert not {{"numpy", "PIL", "cv2", "numba"}} & {{name.partition(".")[0] for name in sys.modules}}
"""
    path = os.pathsep.join(map(str, (HERE.parents[1] / "src", HERE.parents[1], HERE)))
    subprocess.run([sys.executable, "-c", code], env={**os.environ, "PYTHONPATH": path}, check=True)
