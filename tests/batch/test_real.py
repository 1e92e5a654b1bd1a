"""Folders drawn with real wax: the same bytes as one by one, and a stop in the midst of the
work.
"""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import HERE, ROOT, check_whole, tree
from PIL import Image

SMALL = ["--print", "a6", "--dpi", "12", "--style", "sketch"]


def crayonize(*words: object, missing: bool = False, **how: Any) -> subprocess.Popen[str]:
    """Start the command; `missing`: as if no extra package were there."""
    path = os.pathsep.join(map(str, (*([HERE / "missing"] if missing else []), ROOT / "src", ROOT)))
    env = {**os.environ, "PYTHONPATH": path}
    return subprocess.Popen(
        [sys.executable, "-m", "crayonize", *map(str, words)],
        env=env,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        **how,
    )


@pytest.fixture(scope="module")
def photos(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three photos of coloured hills, one of them turned by its EXIF tag, and a broken one."""
    folder = tmp_path_factory.mktemp("real") / "photos"
    folder.mkdir()
    y, x = np.mgrid[:120, :160] / 120
    for i in range(3):
        hills = np.stack(
            [0.5 + 0.5 * np.sin(3 * x + i), y, 0.5 + 0.5 * np.cos(5 * x * y + i)], axis=-1
        )
        exif = Image.Exif()
        exif[274] = 6 if i == 2 else 1
        Image.fromarray((hills * 255).astype(np.uint8)).save(folder / f"p{i}.jpg", exif=exif)
    (folder / "broken.jpg").write_bytes((folder / "p0.jpg").read_bytes()[:900])
    return folder


def test_a_folder_gives_the_pictures_that_single_photos_give(photos: Path, tmp_path: Path) -> None:
    run = crayonize(photos, tmp_path / "all", "-j", "2", "--json", *SMALL)
    out, err = run.communicate(timeout=300)
    lines = [json.loads(line) for line in out.splitlines()]
    assert run.returncode == 3, err
    assert lines[-1]["counts"] | {"ok": 3, "failed": 1} == lines[-1]["counts"]
    assert "broken.jpg" in err
    assert all(line["strokes"] > 100 for line in lines[:-1] if line["status"] == "ok")
    alone = crayonize(photos / "p2.jpg", tmp_path / "alone.png", "-q", *SMALL)
    assert alone.communicate(timeout=300)[1] == ""
    assert (tmp_path / "all" / "p2.png").read_bytes() == (tmp_path / "alone.png").read_bytes()
    with Image.open(tmp_path / "alone.png") as picture:
        assert picture.height > picture.width, "upright, as its tag says"
        assert picture.getexif().get(274) is None
        assert picture.info["dpi"] == pytest.approx((12, 12), rel=0.02)
        assert max(picture.size) == round(140 / 25.4 * 12)  # 4:3 on 105 mm
    before = tree(tmp_path / "all")
    again = crayonize(photos, tmp_path / "all", *SMALL)
    err = again.communicate(timeout=300)[1]
    assert "3 skipped" in err and again.returncode == 3
    assert tree(tmp_path / "all") == before


def test_ctrl_c_in_the_midst_of_a_drawing(photos: Path, tmp_path: Path) -> None:
    run = crayonize(
        photos, tmp_path / "out", "-j", "2", "--json", "--size", "2000", start_new_session=True
    )
    time.sleep(4)  # workers are up, and draw for far longer
    os.killpg(run.pid, signal.SIGINT)
    out, err = run.communicate(timeout=300)
    assert run.returncode == 130 and "Traceback" not in err
    assert json.loads(out.splitlines()[-1])["end"] == "stopped"
    assert not list((tmp_path / "out").rglob("*.part*"))
    check_whole(tmp_path / "out")


def test_settings_that_are_none_are_refused_before_any_photo(photos: Path, tmp_path: Path) -> None:
    run = crayonize(photos, tmp_path / "out", "--paper", "no-such-paper")
    _, err = run.communicate(timeout=300)
    assert run.returncode == 2 and "no-such-paper" in err


@pytest.mark.parametrize("package", ["distributed", "fsspec"])
def test_a_missing_extra_names_what_to_install(photos: Path, tmp_path: Path, package: str) -> None:
    words = [photos, tmp_path / "out", "--dask", "tcp://127.0.0.1:9"]
    if package == "fsspec":
        words = ["s3://bucket/photos", tmp_path / "out"]
    run = crayonize(*words, missing=True)
    _, err = run.communicate(timeout=300)
    assert run.returncode == 2 and f"pip install {package}" in err
    assert err.count("\n") == 1
