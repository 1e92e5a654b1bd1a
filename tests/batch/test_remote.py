"""Photos and pictures in remote folders: an S3 server on loopback, a file:// URL, and memory://."""

import os
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from conftest import HERE, ROOT, Batch, photo, tree
from s3_server import Store

from crayonize.batch import remote
from crayonize.batch.conductor import run
from crayonize.batch.job import Found, Recipe
from crayonize.batch.options import Options
from crayonize.settings import Settings

fsspec = pytest.importorskip("fsspec")


def start(source: object, target: object, *words: str, **env: str) -> Batch:
    """Run a batch between URLs to its end."""
    path = os.pathsep.join(map(str, (ROOT / "src", ROOT, HERE)))
    batch = Batch(
        [source], target, ["-j", "2", *words], [], env={**os.environ, "PYTHONPATH": path, **env}
    )  # type: ignore[list-item,arg-type]
    batch.end()
    return batch


@pytest.fixture
def store() -> Iterator[Store]:
    store = Store()
    yield store
    store.shutdown()
    store.server_close()


@pytest.fixture
def login(store: Store) -> dict[str, str]:
    """What a client needs to find the store."""
    return {
        "FSSPEC_S3_ENDPOINT_URL": store.url,
        "AWS_ACCESS_KEY_ID": "a",
        "AWS_SECRET_ACCESS_KEY": "b",
        "AWS_DEFAULT_REGION": "us-east-1",
        "AWS_EC2_METADATA_DISABLED": "true",
    }


@pytest.fixture
def photos(tmp_path: Path) -> Path:
    """A small tree of photos with a bad one."""
    for i in range(6):
        photo(tmp_path / "photos" / str(i % 2) / f"p {i}.png", i)
    (tmp_path / "photos" / "bad.jpg").write_bytes(b"no picture")
    (tmp_path / "photos" / "notes.txt").write_bytes(b"no picture")
    return tmp_path / "photos"


def copies() -> set[str]:
    """Local copies that are there now."""
    return {name for name in os.listdir(tempfile.gettempdir()) if name.startswith("crayonize-")}


def test_from_bucket_to_bucket(
    store: Store, login: dict[str, str], photos: Path, tmp_path: Path
) -> None:
    pytest.importorskip("s3fs")
    before = copies()
    for path in photos.rglob("*.*"):
        store.files[f"photos/in/{path.relative_to(photos)}"] = path.read_bytes()
    first = start("s3://photos/in", "s3://photos/out", **login)
    assert first.process.returncode == 3, first.said
    assert (first.count("ok"), first.count("failed"), first.count("ignored")) == (6, 1, 1)
    start(photos, tmp_path / "home")
    made = {
        name.removeprefix("photos/out/"): content
        for name, content in store.files.items()
        if "/out/" in name
    }
    assert {name for name in made if ".crayonize" not in name} == set(tree(tmp_path / "home"))
    assert all(
        made[name] == (tmp_path / "home" / name).read_bytes() for name in tree(tmp_path / "home")
    )
    again = start("s3://photos/in", "s3://photos/out", **login)
    assert (again.count("skipped"), again.count("failed")) == (6, 1)
    store.files["photos/in/0/p 0.png"] = store.files["photos/in/1/p 1.png"]
    assert start("s3://photos/in", "s3://photos/out", **login).count("ok") == 1
    assert copies() == before, "no local copy is left"


def test_from_home_to_a_bucket_that_is_full(
    store: Store, login: dict[str, str], photos: Path
) -> None:
    pytest.importorskip("s3fs")
    store.full = True
    result = start(photos, "s3://photos/out", **login)
    assert (
        result.process.returncode == 1
        and "s3://photos/out" in result.said
        and "Traceback" not in result.said
    )
    store.full = False
    assert start(photos, "s3://photos/out", **login).count("ok") == 6


def test_file_urls_and_what_others_put_there(photos: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    photo(out / "0" / "p 0.png", 9)
    result = start(f"file://{photos}", f"file://{out}")
    assert (
        result.process.returncode == 3
        and result.status("0/p 0.png") == "failed"
        and result.count("ok") == 5
    )
    assert "not made here" in result.said
    assert start(f"file://{photos}", f"file://{out}", "--existing", "overwrite").count("ok") == 6


def test_folders_in_one_another_are_refused(photos: Path) -> None:
    for target in (f"file://{photos}", f"file://{photos}/new", f"file://{photos.parent}"):
        with pytest.raises(ValueError, match="in one another"):
            run([f"file://{photos}"], target, Options(), Recipe(Settings()))


def test_listing_by_memory() -> None:
    system: Any = fsspec.filesystem("memory")
    for name in ("a.jpg", "b/c.png", "b/.hidden/d.png", "b/e.txt", ".f.png"):
        system.pipe(f"/in/{name}", b"x")
    entries = list(remote.scan("memory://in"))
    assert [entry.name for entry in entries if isinstance(entry, Found)] == ["a.jpg", "b/c.png"]
    assert len(entries) == 5
    assert all(entry.version and entry.size == 1 for entry in entries if isinstance(entry, Found))
    (one,) = remote.scan("memory://in/a.jpg")
    assert isinstance(one, Found) and one.name == "a.jpg"
    system.pipe("/in/a.jpg", b"xy")
    assert list(remote.scan("memory://in"))[1] != entries[1]


def test_a_service_that_is_not_known(photos: Path, tmp_path: Path) -> None:
    result = start("nothing://bucket/in", tmp_path / "out")
    assert (
        result.process.returncode == 2
        and "nothing" in result.said
        and "Traceback" not in result.said
    )
