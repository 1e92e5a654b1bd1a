"""Files that are nearly whole are drawn, with a warning; those that are cut are refused."""

import struct
import zlib
from io import BytesIO

import numpy as np
import pytest
from made import error_of, file_bytes, noise, placed, png, png_rows, smooth
from PIL import Image

from crayonize.images.icc import encode_srgb
from crayonize.images.read import open_photo, read_linear

PHOTO = smooth(160, 240)


def jpeg(**options):
    return file_bytes(Image.fromarray(PHOTO), "JPEG", quality=90, **options)


def drawn(tmp_path, data, name="a.jpg"):
    """Its sRGB codes, and its warning."""
    with open_photo(placed(tmp_path, data, name)) as photo:
        light = photo.light()
        return encode_srgb(light).astype(int), photo.warning


KINDS = [{}, {"progressive": True}, {"subsampling": "4:4:4"}, {"restart_marker_blocks": 4}]


@pytest.mark.parametrize("options", KINDS)
@pytest.mark.parametrize("lost", [2, 1, 3, 20, "padded"])
def test_a_jpeg_without_its_end_is_drawn(tmp_path, options, lost):
    whole = jpeg(**options)
    data = whole[:-2] + bytes(3000) if lost == "padded" else whole[:-lost]
    picture, warning = drawn(tmp_path, data)
    assert np.abs(picture - PHOTO).mean() < 3
    assert "\n" not in warning
    assert "end" in warning or lost == "padded"  # zeros are as good as an end to some decoders
    assert drawn(tmp_path, whole)[1] == ""


def test_grey_and_ink_jpegs_too(tmp_path):
    for mode in ("L", "CMYK"):
        data = file_bytes(Image.fromarray(PHOTO).convert(mode), "JPEG", quality=90)
        picture, warning = drawn(tmp_path, data[:-2])
        assert warning and np.abs(picture - drawn(tmp_path, data)[0]).mean() < 1


@pytest.mark.parametrize("options", KINDS)
def test_a_jpeg_cut_in_its_middle_is_refused(tmp_path, options):
    data = jpeg(**options)
    for share in (0.2, 0.5, 0.8):
        text = error_of(read_linear, placed(tmp_path, data[: int(share * len(data))], "a.jpg"))
        assert "cut short" in text


def test_a_progressive_jpeg_without_its_last_scans_is_refused(tmp_path):
    data = jpeg(progressive=True)
    for scan in (1, 3, 6):
        at = -1
        for _ in range(scan + 1):
            at = data.index(b"\xff\xda", at + 1)
        assert "cut short" in error_of(read_linear, placed(tmp_path, data[:at], "a.jpg"))


def broken(name, content):
    """A chunk with a wrong check sum."""
    return struct.pack(">I", len(content)) + name + content + struct.pack(">I", zlib.crc32(name))


@pytest.mark.parametrize(
    ("name", "content"),
    [(b"tEXt", b"Comment\0hello"), (b"pHYs", bytes(9)), (b"gAMA", struct.pack(">I", 100000)),
     (b"tRNS", bytes(6)), (b"iCCP", b"p\0\0" + zlib.compress(bytes(200))), (b"zzZz", bytes(70000))],
)  # fmt: skip
@pytest.mark.parametrize("times", [1, 3])
def test_a_png_with_a_wrong_sum_beside_the_picture_is_drawn(tmp_path, name, content, times):
    rows = b"".join(b"\0" + row.tobytes() for row in PHOTO)
    whole = png(240, 160, 8, 2, rows)
    data = whole[:33] + broken(name, content) * times + whole[33:]
    picture, warning = drawn(tmp_path, data, "a.png")
    assert np.array_equal(picture, PHOTO) and "check sum" in warning
    assert drawn(tmp_path, whole, "a.png")[1] == ""


def test_a_png_with_a_wrong_sum_in_its_header_or_table_is_refused(tmp_path):
    rows = b"".join(b"\0" + row.tobytes() for row in PHOTO)
    whole = png(240, 160, 8, 2, rows)
    error_of(read_linear, placed(tmp_path, whole[:29] + bytes(4) + whole[33:], "a.png"))
    table = broken(b"PLTE", bytes(30))
    error_of(read_linear, placed(tmp_path, whole[:33] + table + whole[33:], "a.png"))


def test_deep_png_with_a_wrong_sum(tmp_path):
    values = noise(20, 30, 3, dtype=np.uint16)
    whole = png(30, 20, 16, 2, png_rows(values))
    data = whole[:33] + broken(b"tEXt", b"a\0b") + whole[33:]
    light = read_linear(placed(tmp_path, data, "a.png"))
    assert np.array_equal(light, read_linear(placed(tmp_path, whole, "b.png")))


def test_memory_of_a_phone_jpeg_is_that_of_a_jpeg(tmp_path):
    picture = Image.fromarray(PHOTO)
    two = file_bytes(picture, "MPO", save_all=True, append_images=[picture])
    assert Image.open(BytesIO(two)).format == "MPO"
    with open_photo(placed(tmp_path, two, "a.jpg")) as both, \
            open_photo(placed(tmp_path, jpeg(), "b.jpg")) as one:  # fmt: skip
        assert both.decoding == one.decoding
