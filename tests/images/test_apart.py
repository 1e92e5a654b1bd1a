"""A photo read in a process of its own: the same light, and whatever the photo does, one line."""

import os
import signal
import sys
import time

import numpy as np
import pytest
from made import noise, saved
from PIL import Image, ImageFile

from crayonize.images import apart, metadata
from crayonize.images.apart import open_apart
from crayonize.images.read import open_photo

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="a child is made on Linux alone")


def children():
    with open(f"/proc/self/task/{os.getpid()}/children") as file:
        return file.read().split()


@pytest.fixture(autouse=True)
def nobody_left():
    before = children()
    yield
    assert children() == before


def test_it_is_the_same_photo(tmp_path):
    exif = Image.Exif()
    exif[315] = "Jürgen".encode()
    path = saved(tmp_path, noise(60, 90, 3), "a.png", exif=exif)
    with open_photo(path) as here, open_apart(path) as there:
        assert (here.width, here.height, here.decoding, here.name) == (
            there.width, there.height, there.decoding, there.name)  # fmt: skip
        assert np.array_equal(here.light(40, (0.1, 0.2, 0.3)), there.light(40, (0.1, 0.2, 0.3)))
        assert here.warning == there.warning == ""
        for which in ("safe", "all"):
            mine, theirs = (dict(metadata.kept(p.exif, which)) for p in (here, there))
            assert mine == theirs and mine[315] == "Jürgen".encode()


def test_a_warning_comes_along(tmp_path):
    path = saved(tmp_path, noise(200, 200, 3), "a.jpg")
    path.write_bytes(path.read_bytes()[:-2])
    with open_apart(path) as photo:
        assert photo.light(100).shape == (100, 100, 3) and "end" in photo.warning


@pytest.mark.parametrize("what", ["nothing there", "text", "cut"])
def test_errors_are_those_of_the_photo(tmp_path, what):
    path = tmp_path / "a.jpg"
    if what == "text":
        path.write_bytes(b"hello")
    elif what == "cut":
        saved(tmp_path, noise(60, 90, 3), "a.jpg")
        path.write_bytes(path.read_bytes()[:2000])
    said = []
    for opener in (open_photo, open_apart):
        with pytest.raises(ValueError) as caught, opener(path) as photo:
            photo.light(50)
        said.append(str(caught.value))
    assert said[0] == said[1] and "\n" not in said[0]


@pytest.mark.parametrize("end", [signal.SIGSEGV, signal.SIGKILL, "exit"])
def test_a_decoder_that_dies_is_named(tmp_path, monkeypatch, end):
    def die(_):
        if end == "exit":
            os._exit(3)
        signal.signal(signal.SIGSEGV, signal.SIG_DFL)
        os.kill(os.getpid(), end)
        time.sleep(60)

    path = saved(tmp_path, noise(60, 90, 3), "a.jpg")
    monkeypatch.setattr(ImageFile.ImageFile, "load", die)
    with pytest.raises(ValueError, match="its decoder died of it") as caught, \
            open_apart(path) as photo:  # fmt: skip
        photo.light(50)
    assert (end.name if end != "exit" else "exit code 3") in str(caught.value)


def test_a_decoder_without_end_is_stopped(tmp_path, monkeypatch):
    path = saved(tmp_path, noise(60, 90, 3), "a.jpg")
    monkeypatch.setattr(apart, "TIME_LIMIT", 0.5)
    monkeypatch.setattr(ImageFile.ImageFile, "load", lambda _: time.sleep(600))
    with pytest.raises(ValueError, match=r"longer than 0\.5 s"), open_apart(path) as photo:
        photo.light(50)


def test_too_little_memory_is_no_fault_of_the_photo(tmp_path, monkeypatch):
    path = saved(tmp_path, noise(60, 90, 3), "a.jpg")

    def fill(_):
        raise MemoryError

    monkeypatch.setattr(ImageFile.ImageFile, "load", fill)
    with pytest.raises(MemoryError), open_apart(path) as photo:
        photo.light(50)
