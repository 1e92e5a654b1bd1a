"""PNG: any reader finds the picture, whatever its size, and the bytes do not depend on the threads."""

import struct
import zlib
from io import BytesIO

import cv2
import numpy as np
import pytest
from PIL import Image, PngImagePlugin

from crayonize import png


@pytest.fixture(scope="module")
def frame():
    """A file of one pixel with a note, a resolution and a profile in it."""
    notes, file = PngImagePlugin.PngInfo(), BytesIO()
    notes.add_itxt("crayonize", "a note")
    Image.new("RGB", (1, 1)).save(file, "PNG", pnginfo=notes, dpi=(300, 300), icc_profile=b"profile")
    return file.getvalue()


def speckled(rows, cols):
    """A picture with slopes, edges and noise."""
    rng = np.random.default_rng(rows + cols)
    y, x = np.mgrid[:rows, :cols]
    slopes = np.dstack([3 * x, 5 * y + x, 200 * (x > y)])
    return (slopes + rng.integers(0, 40, (rows, cols, 3))).astype(np.uint8)


@pytest.mark.parametrize("rows, cols", [(1, 1), (1, 7), (9, 1), (50, 61)])
@pytest.mark.parametrize("band", [1, 400, 1 << 20])
def test_any_reader_finds_the_picture(frame, rows, cols, band, monkeypatch):
    monkeypatch.setattr(png, "BAND", band)
    picture = speckled(rows, cols)
    file = png.with_picture(frame, picture).getvalue()
    np.testing.assert_array_equal(np.asarray(Image.open(BytesIO(file))), picture)
    np.testing.assert_array_equal(cv2.imdecode(np.frombuffer(file, np.uint8), cv2.IMREAD_COLOR)[..., ::-1], picture)


def test_all_else_stays(frame):
    opened = Image.open(BytesIO(png.with_picture(frame, speckled(40, 30)).getvalue()))
    assert (opened.size, opened.mode) == ((30, 40), "RGB")
    assert opened.info["crayonize"] == "a note" and opened.info["icc_profile"] == b"profile"
    assert opened.info["dpi"] == pytest.approx((300, 300), abs=0.01)


def test_checksums_and_stream_are_whole(frame, monkeypatch):
    monkeypatch.setattr(png, "BAND", 1000)
    file, at, stream = png.with_picture(frame, speckled(70, 90)).getvalue(), 8, b""
    while at < len(file):
        size, name = struct.unpack_from(">I4s", file, at)
        body = file[at + 8 : at + 8 + size]
        assert struct.unpack_from(">I", file, at + 8 + size)[0] == zlib.crc32(name + body)
        stream += body * (name == b"IDAT")
        at += 12 + size
    assert len(zlib.decompress(stream)) == 70 * (1 + 3 * 90)  # checks Adler's sum as well


def test_threads_do_not_matter(frame, monkeypatch):
    monkeypatch.setattr(png, "BAND", 2000)
    files = {png.with_picture(frame, speckled(120, 90), threads).getvalue() for threads in (1, 2, 5, None)}
    assert len(files) == 1
