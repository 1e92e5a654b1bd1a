"""Text in Exif, whatever its bytes were meant as, goes into every format as UTF-8."""

import struct
from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from crayonize.images import metadata
from crayonize.images.read import open_photo
from crayonize.images.write import write_image

ASCII, FOLDER = 2, 0x8769


def directory(tags, at, pointer=None):
    """A folder of a TIFF at an offset; tags: number -> bytes of an ASCII tag."""
    rows, data, n = b"", b"", len(tags) + (pointer is not None)
    for tag in sorted([*tags, *([FOLDER] if pointer is not None else [])]):
        if tag == FOLDER:
            rows += struct.pack("<HHII", tag, 4, 1, pointer)
            continue
        place = at + 6 + 12 * n + len(data)
        rows += struct.pack("<HHII", tag, ASCII, len(tags[tag]), place)
        data += tags[tag]
    return struct.pack("<H", n) + rows + bytes(4) + data


def told(tmp_path, encoding):
    """The Exif of a photo whose text has this encoding."""
    tags = {
        270: "Tromsø, 5 o'clock",
        271: "Caméra",
        315: "Jürgen Ångström",
        33432: "© 2024 Jürgen",
    }
    raw = {tag: text.encode(encoding) + b"\0" for tag, text in tags.items()}
    inside = {36867: b"2024:01:02 03:04:05\0"}
    size = len(directory(raw, 8, 0))
    exif = b"Exif\0\0II*\0" + struct.pack("<I", 8)
    exif += directory(raw, 8, 8 + size) + directory(inside, 8 + size)
    data = BytesIO()
    Image.new("RGB", (16, 16)).save(data, "JPEG", exif=exif)
    (tmp_path / "photo.jpg").write_bytes(data.getvalue())
    with open_photo(tmp_path / "photo.jpg") as photo:
        photo.light()
        return photo.exif


@pytest.mark.parametrize("encoding", ["utf-8", "latin-1", "cp1252"])
@pytest.mark.parametrize("suffix", [".png", ".jpg", ".webp", ".tif"])
@pytest.mark.parametrize("which", ["safe", "all"])
def test_names_and_titles_keep_their_letters(tmp_path, encoding, suffix, which):
    kept = metadata.kept(told(tmp_path, encoding), which)
    out = tmp_path / f"out{suffix}"
    write_image(out, np.zeros((8, 8, 3), np.uint8), settings={"seed": 1}, kept=kept)
    raw = out.read_bytes()
    assert "© 2024 Jürgen".encode() in raw and "Jürgen Ångström".encode() in raw
    assert ("Caméra".encode() in raw) == (which == "all")
    title = bytes(Image.open(out).getexif()[40091]).decode("utf-16-le")
    assert title.rstrip("\0") == "Tromsø, 5 o'clock"


def test_plain_text_stays_text(tmp_path):
    exif = Image.Exif()
    exif[315] = "Anna"
    exif[33432] = "日本"  # read elsewhere, as Unicode
    kept = metadata.kept(exif, "safe")
    assert kept[315] == "Anna" and kept[33432] == "日本".encode()
