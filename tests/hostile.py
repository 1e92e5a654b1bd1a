"""Bad, odd and misnamed picture files, the same ones each time: what a folder of photos may turn
out to hold.

`bad_files` gives name -> (content, what must become of it); `mutations` damages good files at
random. All are made here from a seed, none is taken from elsewhere.
"""

import io
import random
import struct
import zipfile
import zlib
from collections.abc import Iterator
from typing import Any

import numpy as np
from PIL import Image, PngImagePlugin

Files = dict[str, tuple[bytes, str]]

OK, FAILED, EITHER = "ok", "failed", "either"  # either: readers of different versions differ
KINDS = ("cut", "flip", "block", "zero", "splice", "number")


def saved(picture: Image.Image, format_: str, **options: Any) -> bytes:
    """A picture as a file."""
    data = io.BytesIO()
    picture.save(data, format_, **options)
    return data.getvalue()


def noise(mode: str = "RGB", size: tuple[int, int] = (40, 30), seed: int = 0) -> Image.Image:
    """A picture of noise."""
    pixels = np.random.default_rng(seed).integers(0, 256, (size[1], size[0], 4), dtype=np.uint8)
    return Image.fromarray(pixels, "RGBA").convert(mode)


def good_files() -> dict[str, bytes]:
    """Whole pictures of all formats we read."""
    picture = noise()
    return {
        "a.jpg": saved(picture, "JPEG", quality=80),
        "progressive.jpg": saved(picture, "JPEG", progressive=True),
        "cmyk.jpg": saved(picture.convert("CMYK"), "JPEG"),
        "a.png": saved(picture, "PNG"),
        "palette.png": saved(picture.quantize(16), "PNG"),
        "a.webp": saved(picture, "WEBP", quality=60),
        "lossless.webp": saved(picture, "WEBP", lossless=True),
        "a.tif": saved(picture, "TIFF"),
        "lzw.tif": saved(picture, "TIFF", compression="tiff_lzw"),
        "a.avif": saved(picture, "AVIF"),
    }


def bad_files() -> Files:
    """At least 120 files that are broken, bombs, odd, or not what they are called."""
    files: Files = {}
    for group in (
        _impostors(),
        _cut_short(),
        _png_lies(),
        _sizes(),
        _jpeg_lies(),
        _tiff_lies(),
        _odd_but_whole(),
    ):
        files |= group
    return files


def mutations(number: int, seed: int = 1) -> Iterator[tuple[str, bytes]]:
    """Good files damaged at random, every kind of damage on every format in turn."""
    chance = random.Random(seed)
    goods = sorted(good_files().items())
    for i in range(number):
        name, content = goods[i % len(goods)]
        kind = KINDS[i // len(goods) % len(KINDS)]
        yield f"{i:06}-{kind}-{name}", _damaged(bytearray(content), kind, chance, goods)


def _damaged(
    data: bytearray, kind: str, chance: random.Random, goods: list[tuple[str, bytes]]
) -> bytes:
    at = chance.randrange(len(data))
    match kind:
        case "cut":
            del data[at:]
        case "flip":
            for _ in range(chance.randint(1, 20)):
                data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
        case "block":
            data[at : at + 64] = chance.randbytes(64)
        case "zero":
            data[at : at + 256] = bytes(min(256, len(data) - at))
        case "splice":
            data[at:] = chance.choice(goods)[1][at:]
        case "number":  # a number in the head becomes an extreme one
            at = chance.randrange(min(len(data), 200))
            value = chance.choice((0, 1, 0x7F, 0x80, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0xFFFFFFFF))
            data[at : at + 4] = struct.pack(chance.choice("<>") + "I", value)
    return bytes(data)


# ---- the groups ----------------------------------------------------------------------------------


def _impostors() -> Files:
    """No pictures of ours at all, under the name of one."""
    pack = io.BytesIO()
    with zipfile.ZipFile(pack, "w") as archive:
        archive.writestr("a.txt", "a" * 1000)
    frames = [Image.new("P", (8, 8), i % 256) for i in range(1000)]
    picture = noise()
    contents = {
        "empty.jpg": b"",
        "one-byte.jpg": b"\xff",
        "two-bytes.jpg": b"\xff\xd8",
        "text.jpg": b"Not a picture.\n",
        "page.png": b"<!DOCTYPE html><html><body>404 Not Found</body></html>",
        "archive.jpg": pack.getvalue(),
        "document.png": b"%PDF-1.7\n1 0 obj\n<<>>\nendobj\n",
        "zeros.png": bytes(5000),
        "ones.tif": b"\xff" * 5000,
        "script.jpg": b"#!/bin/sh\nexit 1\n",
        "drawing.png": b'<svg xmlns="http://www.w3.org/2000/svg"/>',
        "bomb.png": b'<!DOCTYPE l [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;&a;">]><svg>&b;</svg>',
        "postscript.jpg": b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\nshowpage\n",
        "film.gif.png": saved(frames[0], "GIF", save_all=True, append_images=frames[1:]),
        "windows.jpg": saved(picture, "BMP"),
        "icon.png": saved(picture, "ICO"),
        "plain.tif": saved(picture, "PPM"),
        "targa.jpg": saved(picture, "TGA"),
        "photoshop.jpg": b"8BPS\x00\x01" + bytes(20),
        "j2k.jpg": saved(picture, "JPEG2000"),
        "riff.webp": b"RIFF\x24\x00\x00\x00WAVEfmt " + bytes(28),
        "brand.heic": _box(b"ftyp", b"heicmif1") + bytes(40),
        "film.avif": _box(b"ftyp", b"isommp42") + bytes(40),
        "noise.jpg": random.Random(2).randbytes(3000),
    }
    return {f"impostor-{name}": (content, FAILED) for name, content in contents.items()}


def _box(kind: bytes, content: bytes) -> bytes:
    return struct.pack(">I", 8 + len(content)) + kind + content


def _cut_short() -> Files:
    """Seven formats, each cut at ten points."""
    names = ("a.jpg", "progressive.jpg", "a.png", "a.webp", "a.tif", "lzw.tif", "a.avif")
    goods = good_files()
    cut = {
        f"cut-{tenth}-{name}": (goods[name][: int(len(goods[name]) * (tenth + 0.4) / 10)], FAILED)
        for name in names
        for tenth in range(10)
    }
    cut["cut-9-a.jpg"] = cut["cut-9-a.jpg"][0], EITHER  # only its last block is missing
    return cut


def _chunk(kind: bytes, content: bytes, crc: int | None = None) -> bytes:
    sum_ = zlib.crc32(kind + content) if crc is None else crc
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", sum_)


def _png(
    width: int, height: int, body: bytes, head: bytes = b"\x08\x02\x00\x00\x00", more: bytes = b""
) -> bytes:
    header = _chunk(b"IHDR", struct.pack(">II", width, height) + head)
    return b"\x89PNG\r\n\x1a\n" + header + more + _chunk(b"IDAT", body) + _chunk(b"IEND", b"")


def _png_lies() -> Files:
    """PNG files that are wrong in one place each."""
    rows = zlib.compress(b"".join(b"\x00" + bytes(30) for _ in range(10)))
    good = _png(10, 10, rows)
    at = good.index(b"IDAT")
    bomb = zlib.compress(bytes(80_000_000), 9)
    return {
        "png-crc-of-data.png": (
            good[: at + 4 + len(rows)] + b"\0\0\0\0" + good[at + 8 + len(rows) :],
            EITHER,
        ),
        "png-crc-of-header.png": (good[:29] + b"\0\0\0\0" + good[33:], FAILED),
        "png-no-size.png": (_png(0, 0, rows), FAILED),
        "png-no-height.png": (_png(10, 0, rows), FAILED),
        "png-negative.png": (_png(0x80000001, 10, rows), FAILED),
        "png-huge.png": (_png(65535, 65535, rows), FAILED),
        "png-long.png": (_png(0x7FFFFFFF, 1, rows), FAILED),
        "png-wider.png": (_png(4000, 4000, rows), FAILED),
        "png-depth-3.png": (_png(10, 10, rows, b"\x03\x02\x00\x00\x00"), FAILED),
        "png-colour-9.png": (_png(10, 10, rows, b"\x08\x09\x00\x00\x00"), FAILED),
        "png-filter-9.png": (
            _png(10, 10, zlib.compress(b"\x09" + bytes(30) + bytes(31 * 9))),
            EITHER,
        ),
        "png-no-data.png": (good[: at - 4] + good[-12:], FAILED),
        "png-no-palette.png": (
            _png(10, 10, zlib.compress(bytes(110)), b"\x08\x03\x00\x00\x00"),
            EITHER,
        ),
        "png-not-packed.png": (_png(10, 10, bytes(300)), FAILED),
        "png-short-chunk.png": (good[: at - 4] + struct.pack(">I", 0x7FFFFFF0) + good[at:], EITHER),
        "png-text-bomb.png": (_png(10, 10, rows, more=_chunk(b"zTXt", b"a\0\0" + bomb)), EITHER),
        "png-profile-bomb.png": (_png(10, 10, rows, more=_chunk(b"iCCP", b"a\0\0" + bomb)), EITHER),
        "png-strange-profile.png": (
            _png(10, 10, rows, more=_chunk(b"iCCP", b"a\0\0" + zlib.compress(bytes(200)))),
            OK,
        ),
        "png-thousand-chunks.png": (_png(10, 10, rows, more=_chunk(b"tEXt", b"a\0b") * 1000), OK),
        "png-more-behind.png": (good + b"PK\x03\x04" + bytes(100), OK),
    }


def _sizes() -> Files:
    """Very small, very long, and more pixels than it seems."""
    million = 1_000_000
    side = 9434  # 89 million pixels
    packer = zlib.compressobj(9)
    zeros = b"".join(packer.compress(bytes(side + 1)) for _ in range(side)) + packer.flush()
    return {
        "size-1x1.png": (saved(noise(size=(1, 1)), "PNG"), OK),
        "size-1x1.jpg": (saved(noise(size=(1, 1)), "JPEG"), OK),
        "size-1x65535.png": (saved(Image.new("L", (1, 65535)), "PNG"), OK),
        "size-65535x1.png": (saved(Image.new("L", (65535, 1)), "PNG"), OK),
        "size-1x65500.jpg": (saved(Image.new("L", (1, 65500)), "JPEG"), OK),
        "size-89-million.png": (_png(side, side, zeros, b"\x08\x00\x00\x00\x00"), OK),
        "size-too-long.png": (
            _png(2 * million, 1, zlib.compress(bytes(2 * million + 1)), b"\x08\0\0\0\0"),
            FAILED,
        ),
        "size-900-million.png": (_png(30000, 30000, zlib.compress(bytes(1000))), FAILED),
    }


def _jpeg_lies() -> Files:
    """JPEG files that are wrong in one place each."""
    good = saved(noise(), "JPEG", quality=80)
    frame = good.index(b"\xff\xc0")
    scan = good.index(b"\xff\xda")

    def with_size(width: int, height: int) -> bytes:
        return good[: frame + 5] + struct.pack(">HH", height, width) + good[frame + 9 :]

    exif = b"Exif\0\0II*\0\x08\0\0\0\xff\xff" + b"\xff" * 60
    segment = b"\xff\xe1" + struct.pack(">H", len(exif) + 2) + exif
    loop = b"Exif\0\0II*\0\x08\0\0\0\x01\0\x69\x87\x04\0\x01\0\0\0\x08\0\0\0\x08\0\0\0"
    loops = b"\xff\xe1" + struct.pack(">H", len(loop) + 2) + loop
    profile = b"ICC_PROFILE\0\x01\x01" + b"\xff" * 300
    icc = b"\xff\xe2" + struct.pack(">H", len(profile) + 2) + profile
    return {
        "jpeg-no-size.jpg": (with_size(0, 0), FAILED),
        "jpeg-no-height.jpg": (with_size(40, 0), FAILED),
        "jpeg-30000x30000.jpg": (with_size(30000, 30000), FAILED),
        "jpeg-65535x65535.jpg": (with_size(65535, 65535), FAILED),
        "jpeg-larger.jpg": (with_size(400, 300), EITHER),
        "jpeg-arithmetic.jpg": (good[:frame] + b"\xff\xc9" + good[frame + 2 :], EITHER),
        "jpeg-lossless.jpg": (good[:frame] + b"\xff\xc3" + good[frame + 2 :], FAILED),
        "jpeg-12-bit.jpg": (good[: frame + 4] + b"\x0c" + good[frame + 5 :], EITHER),
        "jpeg-no-scan.jpg": (good[:scan] + b"\xff\xd9", FAILED),
        "jpeg-no-tables.jpg": (b"\xff\xd8" + good[frame:], EITHER),
        "jpeg-no-frame.jpg": (b"\xff\xd8" + good[scan:], FAILED),
        "jpeg-exif-of-ones.jpg": (good[:2] + segment + good[2:], OK),
        "jpeg-exif-in-a-circle.jpg": (good[:2] + loops + good[2:], OK),
        "jpeg-profile-of-ones.jpg": (good[:2] + icc + good[2:], OK),
        "jpeg-hundred-segments.jpg": (good[:2] + segment * 100 + good[2:], OK),
        "jpeg-and-archive.jpg": (good + b"PK\x03\x04" + bytes(200), OK),
        "jpeg-and-page.jpg": (good[:2] + b"\xff\xfe\x00\x12<script>1</script>"[:20] + good[2:], OK),
        "jpeg-twice.jpg": (good + good, OK),
    }


def _tiff_lies() -> Files:
    """TIFF files whose directory lies."""

    def tiff(changes: dict[int, tuple[int, int, int]], next_: int = 0) -> bytes:
        tags = {
            256: (4, 1, 8),
            257: (4, 1, 8),
            258: (3, 1, 8),
            259: (3, 1, 1),
            262: (3, 1, 1),
            273: (4, 1, 8),
            277: (3, 1, 1),
            278: (4, 1, 8),
            279: (4, 1, 64),
        } | changes
        rows = b"".join(struct.pack("<HHII", tag, *value) for tag, value in sorted(tags.items()))
        return (
            b"II*\0"
            + struct.pack("<I", 72)
            + bytes(64)
            + struct.pack("<H", len(tags))
            + rows
            + struct.pack("<I", next_)
        )

    lies: dict[str, tuple[dict[int, tuple[int, int, int]], str]] = {
        "no-width": ({256: (4, 1, 0)}, FAILED),
        "four-billion-wide": ({256: (4, 1, 0xFFFFFFFF)}, FAILED),
        "65535x65535": ({256: (4, 1, 65535), 257: (4, 1, 65535)}, FAILED),
        "taller": ({257: (4, 1, 800), 278: (4, 1, 800)}, EITHER),
        "strip-beyond-the-end": ({273: (4, 1, 0x7FFFFFFF)}, FAILED),
        "four-billion-strips": ({273: (4, 0xFFFFFFFF, 8)}, FAILED),
        "strip-of-four-billion": ({279: (4, 1, 0xFFFFFFFF)}, EITHER),
        "no-rows-a-strip": ({278: (4, 1, 0)}, EITHER),
        "200-samples": ({277: (3, 1, 200)}, FAILED),
        "0-bits": ({258: (3, 1, 0)}, FAILED),
        "compression-9999": ({259: (3, 1, 9999)}, FAILED),
        "old-jpeg": ({259: (3, 1, 6)}, FAILED),
        "colours-99": ({262: (3, 1, 99)}, FAILED),
        "type-99": ({256: (99, 1, 8)}, FAILED),
    }
    files = {
        f"tiff-{name}.tif": (tiff(changes), verdict) for name, (changes, verdict) in lies.items()
    }
    return files | {
        "tiff-in-a-circle.tif": (tiff({}, next_=72), OK),
        "tiff-no-directory.tif": (b"II*\0\xff\xff\xff\xff", FAILED),
    }


def _odd_but_whole() -> Files:
    """Rare but right, or a right picture with another's suffix: all of these are drawn."""
    picture = noise()
    grey = np.random.default_rng(3).integers(0, 65536, (30, 40), dtype=np.uint16)
    see_through = PngImagePlugin.PngInfo()
    see_through.add(b"tRNS", b"\0\x10\0\x20\0\x30")
    contents = {
        "grey16.png": saved(Image.fromarray(grey), "PNG"),
        "grey16.tif": saved(Image.fromarray(grey), "TIFF"),
        "float.tif": saved(Image.fromarray((grey / 65535).astype(np.float32)), "TIFF"),
        "bit.png": saved(picture.convert("1"), "PNG"),
        "bit.tif": saved(picture.convert("1"), "TIFF", compression="group4"),
        "la.png": saved(noise("LA"), "PNG"),
        "rgba.webp": saved(noise("RGBA"), "WEBP"),
        "rgba.tif": saved(noise("RGBA"), "TIFF"),
        "palette-see-through.png": saved(
            picture.quantize(8), "PNG", transparency=bytes(range(0, 64, 8))
        ),
        "key.png": saved(picture, "PNG", pnginfo=see_through),
        "cmyk.jpg": saved(picture.convert("CMYK"), "JPEG"),
        "cmyk.tif": saved(picture.convert("CMYK"), "TIFF"),
        "lab.tif": saved(Image.new("LAB", (40, 30)), "TIFF"),
        "restart.jpg": saved(picture, "JPEG", restart_marker_blocks=1),
        "grey.jpg": saved(picture.convert("L"), "JPEG"),
        "film.png": saved(picture, "PNG", save_all=True, append_images=[noise(seed=1)]),
        "film.webp": saved(picture, "WEBP", save_all=True, append_images=[noise(seed=1)]),
        "interlaced.jpg": saved(picture, "PNG"),
        "jpeg.png": saved(picture, "JPEG"),
        "webp.tif": saved(picture, "WEBP"),
    }
    for turn in range(1, 9):
        exif = Image.Exif()
        exif[274] = turn
        contents[f"turn-{turn}.jpg"] = saved(picture, "JPEG", exif=exif)
    exif = Image.Exif()
    exif[274] = 99
    contents["turn-99.jpg"] = saved(picture, "JPEG", exif=exif)
    return {f"odd-{name}": (content, OK) for name, content in contents.items()}
