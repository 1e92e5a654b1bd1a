"""Pictures in and out: each file gives the right light or one clear line, and no output is ever
half.
"""

import json
import os
import struct
import subprocess
import sys
import types
import warnings
import zlib
from io import BytesIO
from pathlib import Path

import cv2
import numpy as np
import pytest
from made import (
    ADOBE,
    GAMMA_22,
    P3,
    PARA_SRGB,
    SAMPLED,
    best,
    error_of,
    file_bytes,
    fixed,
    icc,
    noise,
    placed,
    png,
    png_rows,
    rgb_profile,
    saved,
    smooth,
    srgb_light,
    stored_for,
    tiff,
)
from PIL import Image, ImageCms, ImageFile

from crayonize.images import scan as image_scan
from crayonize.images import write as image_write
from crayonize.images.icc import decode_srgb, encode_srgb, light_from_profile
from crayonize.images.read import open_photo, read_linear
from crayonize.images.write import file_format, read_settings, same_file, write_image
from crayonize.machine import memory

SUFFIXES = (".png", ".jpg", ".webp", ".tif")
SETTINGS = {"seed": 7, "palette": "classic 24 – crème", "wobble": 0.25}


# --- the sRGB curve ---


def test_decode_is_the_srgb_curve():
    codes = np.arange(256, dtype=np.uint8)
    assert np.allclose(decode_srgb(codes), srgb_light(codes), atol=1e-7)
    deep = np.arange(65536, dtype=np.uint16)
    assert np.allclose(decode_srgb(deep), srgb_light(deep, 65535), atol=1e-7)
    assert np.allclose(
        decode_srgb(np.array([[0.0, 0.5, 1.0]])), srgb_light([[0, 0.5, 1]], 1), atol=1e-6
    )
    assert decode_srgb(codes).dtype == np.float32


def test_encode_rounds_to_the_nearest_code_everywhere():
    light = np.linspace(-0.1, 1.1, 400_001).astype(np.float32)
    x = np.clip(light.astype(np.float64), 0, 1)
    exact = 255 * np.where(
        x <= 0.04045 / 12.92, 12.92 * x, 1.055 * np.maximum(x, 1e-9) ** (1 / 2.4) - 0.055
    )
    assert np.abs(encode_srgb(light) - exact).max() < 0.5 + 1e-4
    codes = np.arange(256, dtype=np.uint8).reshape(4, 64)
    assert np.array_equal(encode_srgb(decode_srgb(codes)), codes)


def test_encode_is_exact_beside_each_edge():
    edges = srgb_light(np.arange(255) + 0.5).astype(np.float32)
    above, below = (
        np.nextafter(edges, 2).astype(np.float32),
        np.nextafter(edges, -1).astype(np.float32),
    )
    assert np.array_equal(encode_srgb(above), np.arange(1, 256))
    assert np.array_equal(encode_srgb(edges), np.arange(1, 256))
    assert np.array_equal(encode_srgb(below), np.arange(255))


def test_encode_refuses_nan():
    assert "NaN" in error_of(encode_srgb, np.array([0.5, np.nan]))


# --- reading: geometry ---


def test_a_header_tells_size_and_memory(tmp_path, monkeypatch):
    deep = np.zeros((30, 50, 3), np.uint16)
    cv2.imwrite(str(tmp_path / "deep.png"), deep)
    path = saved(tmp_path, noise(30, 50, 3), "a.png")
    monkeypatch.setattr(ImageFile.ImageFile, "load", lambda _: pytest.fail("decoded"))

    def measured(source):
        with open_photo(source) as photo:
            return photo.width, photo.height, photo.decoding

    assert measured(path) == (50, 30, memory.decoding("PNG", 1500))
    assert measured(tmp_path / "deep.png") == (50, 30, memory.decoding("PNG", 1500, deep=True))
    assert measured(deep) == measured(Image.new("RGB", (50, 30))) == (50, 30, 0)
    with pytest.raises(ValueError, match="shape"):
        measured(np.zeros(3))


@pytest.mark.parametrize("suffix", [*SUFFIXES, ".avif"])
def test_all_eight_orientations_come_out_upright(tmp_path, suffix):
    upright = smooth()
    for orientation in range(1, 9):
        exif = Image.Exif()
        exif[274] = orientation
        name = f"{orientation}{suffix}"
        path = saved(tmp_path, stored_for(upright, orientation), name, exif=exif, **best(name))
        light = read_linear(path)
        assert light.shape == (48, 64, 3), orientation
        assert np.abs(encode_srgb(light).astype(int) - upright).mean() < 4, orientation
        assert light.flags.c_contiguous and light.flags.writeable and light.dtype == np.float32


def test_orientation_of_an_open_picture_and_with_reduction(tmp_path):
    exif = Image.Exif()
    exif[274] = 6
    path = saved(tmp_path, stored_for(smooth(), 6), "a.png", exif=exif)
    with Image.open(path) as picture:
        assert np.array_equal(read_linear(picture), read_linear(path))
    assert read_linear(path, max_side=32).shape == (24, 32, 3)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", ["a.jpg", "a.png", "a.webp"])
def test_broken_exif_leaves_the_picture(tmp_path, name):
    for junk in (b"Exif\0\0no such folder", b"Exif\0\0II*\0\xff\xff\xff\xff junk"):
        assert read_linear(saved(tmp_path, smooth(), name, exif=junk)).shape == (48, 64, 3)


def test_area_mean_is_taken_in_linear_light():
    board = (np.indices((64, 96)).sum(0) % 2 * 255).astype(np.uint8)
    half = read_linear(board, max_side=48)
    assert half.shape == (32, 48, 3)
    assert np.allclose(half, 0.5, atol=1e-6)


@pytest.mark.parametrize("size", [(37, 53), (53, 37), (1, 61), (61, 1), (400, 301)])
@pytest.mark.parametrize("side", [1, 7, 20, 36, 60])
def test_area_mean_equals_the_definition(size, side, monkeypatch):
    monkeypatch.setattr("crayonize.images.read._STRIP_PIXELS", 150)  # many strips
    values = noise(*size, 3)
    light = srgb_light(values)
    got = read_linear(values, max_side=side)
    assert max(got.shape[:2]) == min(side, max(size))
    for axis in (0, 1):  # share of each source row in each row of the result
        old, new = size[axis], got.shape[axis]
        edges = np.arange(new + 1) * old / new
        low = np.maximum(edges[:-1, None], np.arange(old))
        shares = np.maximum(np.minimum(edges[1:, None], np.arange(1, old + 1)) - low, 0) * new / old
        light = np.moveaxis(np.tensordot(shares, light, (1, axis)), 0, axis)
    assert np.abs(got - light).max() < 2e-4


@pytest.mark.parametrize("sides", [(1401, 1400), (2001, 2000), (1000, 333), (997, 996)])
def test_white_stays_white_at_every_ratio(sides):
    old, new = sides
    white = read_linear(np.full((3, old), 255, np.uint8), max_side=new)
    assert white.max() <= 1 and white.min() > 1 - 1e-6


def test_white_stays_white_at_every_height():
    for side in range(1, 300, 7):
        white = read_linear(np.full((997, 3), 255, np.uint8), max_side=side)
        assert white.max() <= 1 and white.min() > 1 - 2e-5


def test_never_enlarged_and_aspect_kept():
    assert read_linear(noise(30, 40, 3), max_side=100).shape == (30, 40, 3)
    assert read_linear(noise(300, 400, 3), max_side=100).shape == (75, 100, 3)
    assert read_linear(noise(3, 400, 3), max_side=20).shape == (1, 20, 3)


# --- reading: kinds of pixels ---


def test_arrays_of_each_type():
    grey = noise(5, 6)
    assert np.allclose(read_linear(grey), srgb_light(grey)[..., None], atol=1e-6)
    assert np.allclose(read_linear(grey[..., None]), srgb_light(grey)[..., None], atol=1e-6)
    deep = noise(5, 6, 3, dtype=np.uint16)
    assert np.allclose(read_linear(deep), srgb_light(deep, 65535), atol=1e-6)
    assert np.allclose(read_linear(deep.astype(">u2")), srgb_light(deep, 65535), atol=1e-6)
    for kind in (np.float32, np.float64):
        assert np.allclose(
            read_linear((deep / 65535).astype(kind)), srgb_light(deep, 65535), atol=1e-5
        )
    assert np.allclose(read_linear(deep[::-1, ::2]), srgb_light(deep[::-1, ::2], 65535), atol=1e-6)


def test_array_is_neither_changed_nor_shared():
    values = np.linspace(0, 1, 12, dtype=np.float32).reshape(2, 2, 3)
    before = values.copy()
    read_linear(values)[:] = 0
    assert np.array_equal(values, before)


@pytest.mark.parametrize(
    ("values", "word"),
    [
        (np.full((2, 2, 3), np.nan), "finite"),
        (np.full((2, 2, 3), np.inf, np.float32), "finite"),
        (np.full((2, 2, 3), 255.0), "255"),
        (np.zeros((2, 2, 2), np.uint8), "shape"),
        (np.zeros((0, 5, 3), np.uint8), "empty"),
        (np.zeros(5, np.uint8), "shape"),
        (np.zeros((2, 2), np.int64), "int64"),
    ],
)
def test_arrays_against_the_contract_are_refused(values, word):
    text = error_of(read_linear, values)
    assert text.startswith("array: ") and word in text


def test_bad_arguments_are_named():
    assert "max_side is 0" in error_of(read_linear, noise(2, 2), max_side=0)
    assert "ground" in error_of(read_linear, noise(2, 2), ground=(0.5, 0.5))
    assert "ground" in error_of(read_linear, noise(2, 2), ground=(0.5, 0.5, np.nan))


def test_alpha_is_laid_over_the_ground_in_linear_light(tmp_path):
    values = np.dstack([smooth(), noise(48, 64)])
    ground = np.array([0.8, 0.5, 0.2])
    alpha = values[..., 3:] / 255
    wanted = srgb_light(values[..., :3]) * alpha + ground * (1 - alpha)
    for source in (values, saved(tmp_path, values, "a.png"), saved(tmp_path, values, "a.tif")):
        assert np.allclose(read_linear(source, ground=tuple(ground)), wanted, atol=1e-5)
    lossless = saved(tmp_path, values, "a.webp", lossless=True, exact=True)
    assert np.allclose(read_linear(lossless, ground=tuple(ground)), wanted, atol=1e-5)


def test_grey_with_alpha_one_bit_and_palette(tmp_path):
    grey, ground = noise(9, 10), (0.3, 0.6, 0.9)
    la = Image.merge("LA", [Image.fromarray(grey), Image.fromarray(noise(9, 10, seed=2))])
    alpha = np.asarray(la)[..., 1:] / 255
    wanted = srgb_light(grey)[..., None] * alpha + np.array(ground) * (1 - alpha)
    assert np.allclose(read_linear(saved(tmp_path, la, "la.png"), ground=ground), wanted, atol=1e-5)
    bits = Image.fromarray(grey > 99)
    assert np.array_equal(
        read_linear(saved(tmp_path, bits, "1.tif"))[..., 0], (grey > 99).astype(np.float32)
    )
    palette = Image.fromarray(grey % 3, "L").convert("L")
    palette.putpalette([255, 0, 0, 0, 255, 0, 0, 0, 255])
    wanted = np.eye(3)[grey % 3]
    assert np.array_equal(read_linear(saved(tmp_path, palette, "p.png")), wanted)
    half = saved(tmp_path, palette, "t.png", transparency=bytes([255, 128, 0]))
    share = np.array([1, 128 / 255, 0])[grey % 3][..., None]
    assert np.allclose(
        read_linear(half, ground=ground), wanted * share + np.array(ground) * (1 - share), atol=1e-5
    )
    one = saved(tmp_path, palette, "o.png", transparency=1)
    assert np.allclose(read_linear(one, ground=ground)[grey % 3 == 1], ground)


@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize("deep", [False, True])
def test_the_transparent_colour_of_a_png_is_the_ground(tmp_path, channels, deep):
    values = noise(8, 9, channels, dtype=np.uint16)
    stored = values if deep else values >> 8
    rows = (
        png_rows(stored) if deep else b"".join(b"\0" + r.astype(np.uint8).tobytes() for r in stored)
    )
    key = stored[2, 3].astype(">u2").tobytes()
    data = png(9, 8, 16 if deep else 8, 0 if channels == 1 else 2, rows, (b"tRNS", key))
    light = read_linear(placed(tmp_path, data, "k.png"), ground=(0.1, 0.2, 0.3))
    keyed = (stored == stored[2, 3]).all(-1)
    assert np.allclose(light[keyed], (0.1, 0.2, 0.3))
    wanted = np.broadcast_to(srgb_light(stored, 65535 if deep else 255), (8, 9, 3))
    assert np.allclose(light[~keyed], wanted[~keyed], atol=1e-6)


@pytest.mark.parametrize("color_type", [0, 2, 4, 6])
def test_sixteen_bits_of_a_png_are_kept(tmp_path, color_type):
    values = noise(20, 30, {0: 1, 2: 3, 4: 2, 6: 4}[color_type], dtype=np.uint16)
    path = placed(tmp_path, png(30, 20, 16, color_type, png_rows(values)), "deep.png")
    colour = srgb_light(values[..., : 3 if color_type & 2 else 1], 65535)
    alpha = values[..., -1:] / 65535 if color_type & 4 else 1
    assert (
        np.abs(
            read_linear(path, ground=(0.2, 0.4, 0.6))
            - (colour * alpha + np.array([0.2, 0.4, 0.6]) * (1 - alpha))
        ).max()
        < 1e-6
    )


@pytest.mark.parametrize("orientation", range(1, 9))
def test_sixteen_bits_of_a_tiff_are_kept_and_turned_once(tmp_path, orientation):
    upright = noise(20, 30, 3, dtype=np.uint16)
    data = tiff(stored_for(upright, orientation), photometric=2, tag_274=orientation)
    assert (
        np.abs(read_linear(placed(tmp_path, data, "deep.tif")) - srgb_light(upright, 65535)).max()
        < 1e-6
    )


def test_grey_tiffs_of_every_depth(tmp_path):
    ramp = np.linspace(0, 65535, 120).reshape(8, 15, 1)
    wanted = srgb_light(ramp, 65535)

    def light(data):
        return read_linear(placed(tmp_path, data, "g.tif"))[..., :1]

    assert np.allclose(light(tiff(ramp.astype(np.uint16))), wanted, atol=1e-4)
    white_is_zero = 65535 - ramp.astype(np.uint16)
    assert np.allclose(light(tiff(white_is_zero, photometric=0)), wanted, atol=1e-4)
    assert np.allclose(light(tiff(ramp.astype(np.int32), sample_format=2)), wanted, atol=1e-4)
    full = (ramp / 65535 * (2**32 - 1)).astype(np.uint32)
    assert np.allclose(light(tiff(full)), wanted, atol=1e-4)
    for scale in (1, 255, 65535):
        assert np.allclose(
            light(tiff((ramp / 65535 * scale).astype("<f4"), sample_format=3)), wanted, atol=1e-4
        )
    overbright = (ramp / 65535 * 1.5).astype("<f4")
    assert np.allclose(
        light(tiff(overbright, sample_format=3)),
        srgb_light(np.minimum(overbright, 1), 1),
        atol=1e-4,
    )
    for bad in (np.nan, np.inf):
        broken = ramp.astype("<f4")
        broken[3, 3] = bad
        assert "finite" in error_of(light, tiff(broken, sample_format=3))


def test_twelve_bits_reach_white(tmp_path):
    samples = [0, 1000, 4095, 2048]
    packed = bytes([0, 0x03, 0xE8, 0xFF, 0xF8, 0x00])  # 000 3e8 fff 800
    data = tiff(np.frombuffer(packed, np.uint8).reshape(1, 6, 1), bits=12).replace(
        struct.pack("<HHII", 256, 4, 1, 6), struct.pack("<HHII", 256, 4, 1, 4)
    )
    light = read_linear(placed(tmp_path, data, "12.tif"))
    assert np.allclose(light[0, :, 0], srgb_light(samples, 4095), atol=1e-5)


def test_raw_files_are_named_as_such(tmp_path):
    for tags in ({"tag_50706": 1}, {"tag_254": 1}):
        data = tiff(noise(4, 4, 3), photometric=2, **tags)
        assert "raw" in error_of(read_linear, placed(tmp_path, data, "a.dng"))


@pytest.mark.parametrize("name", ["inverted.jpg", "plain.tif"])
def test_cmyk_with_and_without_adobe_inversion(tmp_path, name):
    inks = np.zeros((16, 48, 4), np.uint8)
    inks[:, :16, 0], inks[:, 16:32, 3], inks[:, 32:] = 255, 128, (0, 255, 255, 0)
    light = read_linear(saved(tmp_path, Image.fromarray(inks, "CMYK"), name))
    assert np.allclose(light[8, 8], (0, 1, 1), atol=0.02)
    assert np.allclose(light[8, 24], srgb_light(127), atol=0.02)
    assert np.allclose(light[8, 40], (1, 0, 0), atol=0.02)


def test_first_frame_of_moving_pictures(tmp_path):
    frames = [Image.fromarray(np.full((8, 8, 3), v, np.uint8)) for v in (200, 10, 90)]
    for name in ("m.png", "m.webp", "m.avif", "m.tif"):
        path = saved(
            tmp_path, frames[0], name, save_all=True, append_images=frames[1:], **best(name)
        )
        assert np.allclose(read_linear(path), srgb_light(200), atol=0.02), name


def test_a_phone_jpeg_with_a_second_picture(tmp_path):
    frames = [Image.fromarray(np.full((8, 8, 3), v, np.uint8)) for v in (200, 10)]
    path = placed(
        tmp_path, file_bytes(frames[0], "MPO", save_all=True, append_images=frames[1:]), "m.jpg"
    )
    assert np.allclose(read_linear(path), srgb_light(200), atol=0.02)


# --- reading: colour profiles ---


@pytest.mark.parametrize("primaries", [P3, ADOBE])
@pytest.mark.parametrize("curve", [PARA_SRGB, GAMMA_22, SAMPLED])
def test_profiles_agree_with_littlecms(tmp_path, primaries, curve):
    profile = rgb_profile(primaries, curve)
    picture = Image.fromarray(noise(20, 30, 3))
    own = ImageCms.ImageCmsProfile(BytesIO(profile))
    relative = ImageCms.Intent.RELATIVE_COLORIMETRIC
    wanted = ImageCms.profileToProfile(picture, own, ImageCms.createProfile("sRGB"), relative)
    got = encode_srgb(read_linear(saved(tmp_path, picture, "p.png", icc_profile=profile)))
    assert np.abs(got.astype(int) - np.asarray(wanted)).max() <= 1
    assert np.abs(got.astype(int) - np.asarray(picture)).max() > 20  # it does matter


@pytest.mark.parametrize("suffix", [*SUFFIXES, ".avif"])
def test_display_p3_red_in_every_format(tmp_path, suffix):
    red = Image.new("RGB", (16, 16), (200, 60, 50))
    path = saved(
        tmp_path, red, f"r{suffix}", icc_profile=rgb_profile(P3, PARA_SRGB), **best(suffix)
    )
    got = encode_srgb(read_linear(path))[8, 8].astype(int)
    assert np.abs(got - (218, 42, 38)).max() <= 4


def test_every_formula_of_parametric_curves():
    forms = [
        (0, (2.0,), lambda x: x**2),
        (1, (2.0, 1.25, -0.25), lambda x: np.maximum(1.25 * x - 0.25, 0) ** 2),
        (2, (2.0, 0.75, -0.15, 0.25), lambda x: np.maximum(0.75 * x - 0.15, 0) ** 2 + 0.25),
        (3, (2.0, 0.8, 0.2, 0.5, 0.3), lambda x: np.where(x >= 0.3, (0.8 * x + 0.2) ** 2, 0.5 * x)),
        (4, (2, 0.8, 0.1, 0.5, 0.3, 0.1, 0.05),
         lambda x: np.where(x >= 0.3, (0.8 * x + 0.1) ** 2 + 0.1, 0.5 * x + 0.05)),
    ]  # fmt: skip
    x = np.linspace(0, 1, 50)
    for form, values, wanted in forms:
        light = light_from_profile(
            icc(b"GRAY", b"XYZ ", kTRC=struct.pack(">4s4xH2x", b"para", form) + fixed(*values))
        )
        assert light is not None
        assert np.allclose(light.curves[0](x), wanted(x), atol=1e-3), form


def test_deep_pictures_keep_their_depth_under_a_profile(tmp_path):
    values = np.zeros((1, 600, 3), np.uint16)
    values[0, :, :] = np.arange(20000, 20600)[:, None]
    picture = png(
        600,
        1,
        16,
        2,
        png_rows(values),
        (b"iCCP", b"p\0\0" + zlib.compress(rgb_profile(ADOBE, GAMMA_22))),
    )
    light = read_linear(placed(tmp_path, picture, "deep.png"))
    assert len(np.unique(light[..., 1])) > 500
    # the neutral axis stays neutral
    assert np.allclose(light, (values / 65535) ** 2.19921875, atol=2e-4)


def test_grey_profile_and_grey_picture_under_an_rgb_profile(tmp_path):
    grey = noise(6, 7)
    for profile in (icc(b"GRAY", b"XYZ ", kTRC=GAMMA_22), rgb_profile(ADOBE, GAMMA_22)):
        light = read_linear(saved(tmp_path, grey, "g.png", icc_profile=profile))
        assert np.allclose(light, ((grey / 255) ** 2.19921875)[..., None], atol=1e-5)


def lut_profile(space, inputs):
    """A profile of one 8-bit table: the inputs at its corners add up to darkness, with a red cast
    between.
    """
    corners = b""
    for corner in range(2**inputs):
        ink = bin(corner).count("1") / inputs
        ink = 1 - ink if space == b"RGB " else ink
        corners += bytes([round(255 * (1 - 0.8 * ink)), 128 + round(100 * min(ink, 1 - ink)), 128])
    ramp = bytes(range(256))
    unit = fixed(1, 0, 0, 0, 1, 0, 0, 0, 1)
    table = b"mft1\0\0\0\0" + bytes([inputs, 3, 2, 0]) + unit + ramp * inputs + corners + ramp * 3
    return icc(space, b"Lab ", A2B0=table, A2B1=table)


def test_tables_go_before_primaries():
    assert light_from_profile(rgb_profile(P3, PARA_SRGB)) is not None
    tags = {"rXYZ": P3[0], "gXYZ": P3[1], "bXYZ": P3[2]}
    raw = {name: b"XYZ \0\0\0\0" + fixed(*value) for name, value in tags.items()}
    curves = dict.fromkeys(("rTRC", "gTRC", "bTRC"), PARA_SRGB)
    assert light_from_profile(icc(b"RGB ", b"XYZ ", **raw, **curves)) is not None
    assert light_from_profile(icc(b"RGB ", b"XYZ ", **raw, **curves, A2B0=b"mft2")) is None


@pytest.mark.parametrize("mode", ["CMYK", "RGB"])
def test_table_profiles_go_through_littlecms(tmp_path, mode):
    picture = Image.fromarray(noise(6, 7, len(mode)), mode)
    plain = read_linear(saved(tmp_path, picture, "plain.tif"))
    profile = lut_profile(mode.encode().ljust(4), len(mode))
    managed = read_linear(saved(tmp_path, picture, "managed.tif", icc_profile=profile))
    wanted = ImageCms.profileToProfile(
        picture, ImageCms.ImageCmsProfile(BytesIO(profile)), ImageCms.createProfile("sRGB"),
        ImageCms.Intent.RELATIVE_COLORIMETRIC, "RGB", flags=ImageCms.Flags.BLACKPOINTCOMPENSATION,
    )  # fmt: skip
    assert np.array_equal(encode_srgb(managed), np.asarray(wanted))
    assert np.abs(managed - plain).max() > 0.1


def test_alpha_survives_a_table_profile(tmp_path):
    values = np.dstack([np.full((4, 4, 3), 255, np.uint8), np.full((4, 4), 51, np.uint8)])
    path = saved(tmp_path, values, "a.png", icc_profile=lut_profile(b"RGB ", 3))
    assert np.allclose(read_linear(path, ground=(0, 0, 0)), 0.2, atol=0.01)


def test_lab_tiff(tmp_path):
    lab = Image.merge("LAB", [Image.new("L", (4, 4), v) for v in (138, 209, 198)])  # sRGB red
    assert np.allclose(read_linear(lab), (1, 0, 0), atol=0.05)


@pytest.mark.parametrize(
    "profile",
    [
        b"junk",
        b"\0" * 200,
        rgb_profile(P3, PARA_SRGB)[:180],
        rgb_profile(P3, b"curv\0\0\0\0\xff\xff\xff\xff"),
        rgb_profile(P3, b"para\0\0\0\0\0\1\0\0" + fixed(2, 0, 1)),
        rgb_profile(P3, b"para\0\0\0\0\0\0\0\0" + fixed(-30000)),
        icc(b"CMYK", b"Lab ", A2B0=b"mft1"),
    ],
)
def test_a_broken_profile_means_srgb(tmp_path, profile):
    assert light_from_profile(profile) is None
    values = noise(5, 6, 3)
    assert np.allclose(
        read_linear(saved(tmp_path, values, "b.png", icc_profile=profile)),
        srgb_light(values),
        atol=1e-6,
    )
    inks = Image.fromarray(noise(6, 7, 4), "CMYK")
    plain, broken = (
        saved(tmp_path, inks, "c.tif"),
        saved(tmp_path, inks, "d.tif", icc_profile=profile),
    )
    assert np.array_equal(read_linear(plain), read_linear(broken))


# --- reading: what is no picture ---


@pytest.mark.filterwarnings("ignore:Corrupt EXIF")
@pytest.mark.parametrize(
    "kind", ["JPEG", "PNG", "WEBP", "TIFF", "AVIF", "deflated TIFF", "deep PNG", "deep TIFF"]
)
def test_cut_files_are_refused(tmp_path, kind):
    picture = Image.fromarray(noise(40, 50, 3))
    deep = noise(40, 50, 3, dtype=np.uint16)
    data = {
        "deflated TIFF": lambda: file_bytes(picture, "TIFF", compression="tiff_deflate"),
        "deep PNG": lambda: png(50, 40, 16, 2, png_rows(deep)),
        "deep TIFF": lambda: tiff(deep, photometric=2),
    }.get(kind, lambda: file_bytes(picture, kind))()
    assert read_linear(placed(tmp_path, data, "whole")).shape == (40, 50, 3)
    for tenth in range(10):
        text = error_of(read_linear, placed(tmp_path, data[: len(data) * tenth // 10], "cut.jpg"))
        assert "cut.jpg" in text


@pytest.mark.filterwarnings("ignore:Corrupt EXIF")
@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"x",
        b"hello, this is text\n" * 50,
        b"<html>" * 90,
        b"PK\3\4" + bytes(99),
        noise(999).tobytes(),
        b"\xff\xd8\xff\xe0",
        b"II*\0" + b"\xff" * 60,
        b"BM" + bytes(90),
        file_bytes(Image.new("RGB", (4, 4)), "GIF"),
        file_bytes(Image.new("RGB", (4, 4)), "BMP"),
        png(0, 5, 8, 2, b""),
        bytes(4) + b"ftypavif" + bytes(60),
    ],
)
def test_what_is_no_picture_is_named_in_one_line(tmp_path, data):
    text = error_of(read_linear, placed(tmp_path, data, "holiday.png"))
    assert "holiday.png" in text and len(text) < 200


def test_damaged_bytes_never_raise_anything_else(tmp_path):
    rng = np.random.default_rng(3)
    picture = Image.fromarray(smooth(24, 24))
    exif = Image.Exif()
    exif[274] = 6
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for kind in ("JPEG", "PNG", "WEBP", "TIFF", "AVIF"):
            whole = file_bytes(picture, kind, exif=exif, icc_profile=rgb_profile(P3, PARA_SRGB))
            for _ in range(60):
                data = bytearray(whole)
                for at in rng.integers(0, len(data), 3):
                    data[at] = rng.integers(256)
                path = placed(tmp_path, bytes(data), "x")
                try:
                    light = read_linear(path, max_side=8)
                    assert np.isfinite(light).all()
                    read_settings(path)
                except ValueError as error:
                    assert "\n" not in str(error)


def test_bombs_are_refused_before_decoding(tmp_path):
    before = Image.MAX_IMAGE_PIXELS
    assert before
    text = error_of(read_linear, placed(tmp_path, png(30000, 30000, 8, 2, b""), "bomb.png"))
    assert "30000 x 30000" in text and "bomb.png" in text
    assert "2000000 x 1" in error_of(
        read_linear, placed(tmp_path, png(2_000_000, 1, 8, 0, b""), "long.png")
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # Pillow's own limit neither warns nor stops below ours
        assert "cut short" in error_of(
            read_linear, placed(tmp_path, png(15000, 15000, 8, 2, b""), "big.png")
        )
    assert before == Image.MAX_IMAGE_PIXELS


def test_the_limit_holds_for_every_source(tmp_path, monkeypatch):
    monkeypatch.setattr(image_scan, "MAX_PIXELS", 99)
    values = noise(10, 10, 3)
    for source in (values, Image.fromarray(values), saved(tmp_path, values, "a.png")):
        assert "10 x 10" in error_of(read_linear, source)


def test_an_empty_file_is_called_empty(tmp_path):
    assert "empty file" in error_of(read_linear, placed(tmp_path, b"", "a.jpg"))


def test_only_ordinary_files_are_opened(tmp_path):
    os.mkfifo(tmp_path / "pipe.jpg")
    (tmp_path / "folder.jpg").mkdir()
    for path in (tmp_path / "pipe.jpg", tmp_path / "folder.jpg", "/dev/zero"):
        assert "no ordinary file" in error_of(read_linear, path)
    assert "No such file" in error_of(read_linear, tmp_path / "absent.jpg")
    odd = error_of(read_linear, os.fsdecode(os.fsencode(tmp_path) + b"/line\nbreak \xff.jpg"))
    assert "\\n" in odd and odd.encode()


def test_names_that_are_no_text_can_be_read(tmp_path):
    path = os.fsencode(tmp_path) + b"/caf\xe9 \xff.png"
    with open(path, "wb") as file:
        file.write(file_bytes(Image.fromarray(noise(4, 5, 3)), "PNG"))
    assert read_linear(os.fsdecode(path)).shape == (4, 5, 3)


class FakeHeic(ImageFile.ImageFile):
    format = "HEIF"

    def _open(self):
        self._size, self._mode, self.tile = (2, 2), "L", [("raw", (0, 0, 2, 2), 12, ("L", 0, 1))]


def test_heic_names_the_extra_and_works_with_it(tmp_path, monkeypatch):
    path = placed(tmp_path, bytes([0, 0, 0, 24]) + b"ftypheic" + b"\xff\xff\0\0", "a.heic")
    monkeypatch.setitem(sys.modules, "pi_heif", None)
    assert "pip install pi-heif" in error_of(read_linear, path)

    def register():
        monkeypatch.setitem(Image.OPEN, "HEIF", (FakeHeic, lambda start: start[4:8] == b"ftyp"))

    monkeypatch.setitem(
        sys.modules, "pi_heif", types.SimpleNamespace(register_heif_opener=register)
    )
    assert np.array_equal(read_linear(path)[..., 0], [[1, 1], [0, 0]])


# --- writing ---


@pytest.mark.parametrize("suffix", [*SUFFIXES, ".JPEG", ".tiff"])
def test_pictures_and_settings_come_back(tmp_path, suffix):
    path = tmp_path / f"out{suffix}"
    write_image(path, smooth(), settings=SETTINGS, dpi=300)
    assert read_settings(path) == SETTINGS
    got = encode_srgb(read_linear(path)).astype(int)
    tolerance = 0 if file_format(path) in ("PNG", "TIFF") else 6
    assert np.abs(got - smooth()).max() <= tolerance
    with Image.open(path) as picture:
        assert picture.info["icc_profile"][12:20] == b"mntrRGB "
        dpi = picture.info.get("dpi") or (picture.getexif()[282], picture.getexif()[283])
        software = picture.info.get("Software") or picture.getexif()[305]
        assert suffix == ".png" or picture.getexif()[296] == 2  # inches
        picture.verify()
    assert np.allclose(np.array(dpi, float), 300, atol=0.1) and software == "crayonize"


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_same_picture_same_bytes(tmp_path, suffix, monkeypatch):
    write_image(tmp_path / f"a{suffix}", noise(20, 20, 3), settings=SETTINGS, dpi=150)
    profile = bytearray(ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes())
    profile[24:36] = bytes(range(12))  # as if written at another time
    monkeypatch.setattr(ImageCms.ImageCmsProfile, "tobytes", lambda _: bytes(profile))
    write_image(
        tmp_path / f"b{suffix}",
        noise(20, 20, 3),
        settings=dict(reversed(SETTINGS.items())),
        dpi=150,
    )
    assert (tmp_path / f"a{suffix}").read_bytes() == (tmp_path / f"b{suffix}").read_bytes()


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_pictures_of_others_have_no_settings(tmp_path, suffix):
    write_image(tmp_path / f"bare{suffix}", smooth())
    assert read_settings(tmp_path / f"bare{suffix}") == {}
    exif = Image.Exif()
    for text in ("On the beach", "[1]", '{"crayonize": 5}', '{"other": {}}', "[" * 9000):
        exif[270] = text
        assert read_settings(saved(tmp_path, smooth(), f"other{suffix}", exif=exif)) == {}


def test_tiff_is_packed_without_loss(tmp_path):
    write_image(tmp_path / "flat.tif", np.full((200, 200, 3), 90, np.uint8))
    assert (tmp_path / "flat.tif").stat().st_size < 5000


def test_jpeg_keeps_the_colour_of_single_pixels(tmp_path):
    stripes = np.array([[(255, 0, 0), (0, 0, 255)] * 16] * 32, np.uint8)
    write_image(tmp_path / "s.jpg", stripes)
    assert np.abs(encode_srgb(read_linear(tmp_path / "s.jpg")).astype(int) - stripes).max() < 30


def test_quality_is_heeded(tmp_path):
    for suffix in (".jpg", ".webp"):
        sizes = []
        for quality in (30, 95):
            write_image(tmp_path / f"q{suffix}", noise(64, 64, 3), quality=quality)
            sizes.append((tmp_path / f"q{suffix}").stat().st_size)
        assert sizes[0] < sizes[1] / 1.5


@pytest.mark.parametrize("fault", ["fsync", "replace"])
@pytest.mark.parametrize("kind", [OSError(28, "No space left on device"), KeyboardInterrupt()])
def test_a_fault_leaves_the_old_file_and_no_other(tmp_path, monkeypatch, fault, kind):
    path = tmp_path / "out.png"
    write_image(path, smooth(), settings=SETTINGS)
    old = path.read_bytes()

    def fail(*_):
        raise kind

    monkeypatch.setattr(image_write.os, fault, fail)
    with pytest.raises(type(kind)) as caught:
        write_image(path, noise(48, 64, 3))
    if isinstance(kind, OSError):
        assert caught.value.errno == 28 and "out.png" in str(caught.value)
    assert path.read_bytes() == old and os.listdir(tmp_path) == ["out.png"]


def test_the_final_name_appears_only_when_all_is_on_disk(tmp_path, monkeypatch):
    seen = []
    real = os.fsync

    def fsync(handle):
        (name,) = os.listdir(tmp_path)
        seen.append((name, os.fstat(handle).st_size))
        real(handle)

    monkeypatch.setattr(os, "fsync", fsync)
    write_image(tmp_path / "out.png", noise(5, 6, 3))
    (part, size), (name, _) = seen
    assert part.startswith(".crayonize-") and ".part" in part
    assert size == (tmp_path / "out.png").stat().st_size
    assert name == "out.png" and os.listdir(tmp_path) == ["out.png"]


def test_output_through_a_link_spares_the_linked_file(tmp_path):
    photo = saved(tmp_path, smooth(), "photo.png")
    old = photo.read_bytes()
    (tmp_path / "soft.png").symlink_to(photo)
    os.link(photo, tmp_path / "hard.png")
    for name in ("soft.png", "hard.png"):
        assert same_file(photo, tmp_path / name)
        write_image(tmp_path / name, noise(4, 4, 3))
        assert photo.read_bytes() == old and not same_file(photo, tmp_path / name)


def test_same_file_by_any_spelling(tmp_path, monkeypatch):
    photo = saved(tmp_path, smooth(), "photo.png")
    monkeypatch.chdir(tmp_path)
    assert same_file("photo.png", photo)
    (tmp_path / "x").mkdir()
    assert same_file(tmp_path / "x" / ".." / "photo.png", str(photo))
    assert same_file("new.png", tmp_path / "new.png") and same_file(tmp_path / "new.png", "new.png")
    assert not same_file("new.png", photo)
    (tmp_path / "other.png").write_bytes(photo.read_bytes())
    assert not same_file("other.png", photo)


def test_modes_follow_the_umask(tmp_path):
    before = os.umask(0o027)
    try:
        write_image(tmp_path / "out.png", smooth())
    finally:
        os.umask(before)
    assert (tmp_path / "out.png").stat().st_mode & 0o777 == 0o640


@pytest.mark.parametrize(
    ("name", "options", "word"),
    [
        ("out.bmp", {}, ".png, .jpg"),
        ("out", {}, ".png, .jpg"),
        ("absent/out.png", {}, "absent"),
        ("folder.png", {}, "folder or device"),
        ("out.png", {"dpi": 0}, "dpi"),
        ("out.png", {"dpi": float("nan")}, "dpi"),
        ("out.jpg", {"quality": 0}, "quality"),
        ("out.png", {"settings": {"a": float("nan")}}, "settings"),
        ("out.png", {"settings": {"a": object()}}, "settings"),
        ("out.jpg", {"settings": {"a": "x" * 70000}}, "JPEG"),
    ],
)
def test_what_cannot_be_written_is_named_and_leaves_nothing(tmp_path, name, options, word):
    (tmp_path / "folder.png").mkdir()
    text = error_of(write_image, tmp_path / name, smooth(), **options)
    assert word in text and Path(name).name in text
    assert os.listdir(tmp_path) == ["folder.png"]


def test_wrong_arrays_and_sizes_are_refused(tmp_path):
    for wrong in (smooth().astype(np.float32), smooth()[..., :1], smooth()[..., 0], smooth()[:0]):
        assert "uint8 (h, w, 3)" in error_of(write_image, tmp_path / "out.png", wrong)
    assert "16383" in error_of(
        write_image, tmp_path / "out.webp", np.zeros((1, 16384, 3), np.uint8)
    )
    assert "65535" in error_of(write_image, tmp_path / "out.jpg", np.zeros((65536, 1, 3), np.uint8))
    write_image(tmp_path / "out.png", smooth()[::-1, ::2])


def test_a_device_is_not_replaced(tmp_path):
    os.mkfifo(tmp_path / "pipe.png")
    assert "device" in error_of(write_image, tmp_path / "pipe.png", smooth())


def test_settings_are_plain_json_in_the_file(tmp_path):
    write_image(tmp_path / "out.png", smooth(), settings=SETTINGS)
    with Image.open(tmp_path / "out.png") as picture:
        assert json.loads(picture.text["crayonize"]) == SETTINGS


def test_importing_is_cheap():
    code = "import sys, crayonize.images.write; print({'numba', 'scipy'} & set(sys.modules))"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "set()"
