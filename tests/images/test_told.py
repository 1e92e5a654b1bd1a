"""Colours told in any way: by code points, by PNG's chunks, by Exif; and profiles that lie."""

import struct
import zlib
from io import BytesIO

import numpy as np
import pytest
from made import (
    ADOBE,
    GAMMA_22,
    P3,
    PARA_SRGB,
    error_of,
    fixed,
    icc,
    placed,
    png,
    rgb_profile,
    saved,
    srgb_light,
)
from PIL import Image

from crayonize.images import boxes, primaries
from crayonize.images.icc import encode_srgb
from crayonize.images.read import read_linear

CODE = (150, 120, 60)
D65 = (0.3127, 0.3290)
SPOTS = {
    "srgb": ((0.64, 0.33), (0.30, 0.60), (0.15, 0.06)),
    "adobe": ((0.64, 0.33), (0.21, 0.71), (0.15, 0.06)),
    "p3": ((0.68, 0.32), (0.265, 0.69), (0.15, 0.06)),
    "2020": ((0.708, 0.292), (0.17, 0.797), (0.131, 0.046)),
}


def shown(spots, light):
    """sRGB codes of light in a space of these primaries and white D65, worked out once more."""

    def matrix(name):
        columns = np.array([[x / y, 1, (1 - x - y) / y] for x, y in SPOTS[name]]).T
        white = np.array([D65[0] / D65[1], 1, (1 - sum(D65)) / D65[1]])
        return columns * np.linalg.solve(columns, white)

    rgb = np.linalg.solve(matrix("srgb"), matrix(spots) @ np.asarray(light)).clip(0, 1)
    return encode_srgb(rgb.astype(np.float32)).astype(int)


def read_code(path):
    return encode_srgb(read_linear(path))[4, 4].astype(int)


def picture(tmp_path, *chunks, code=CODE):
    row = b"\0" + bytes(code) * 9
    return placed(tmp_path, png(9, 9, 8, 2, row * 9, *chunks), "a.png")


def gamma(value):
    return b"gAMA", struct.pack(">I", round(value * 100_000))


def spots(name, white=D65):
    numbers = [round(v * 100_000) for spot in (white, *SPOTS[name]) for v in spot]
    return b"cHRM", struct.pack(">8I", *numbers)


def profile(data):
    return b"iCCP", b"p\0\0" + zlib.compress(data)


@pytest.mark.parametrize("g", [1.0, 0.55556, 0.5, 0.4])
@pytest.mark.parametrize("name", [None, "adobe", "p3"])
def test_gamma_and_primaries_of_png(tmp_path, g, name):
    path = picture(tmp_path, gamma(g), *([spots(name)] if name else []))
    wanted = shown(name or "srgb", (np.array(CODE) / 255) ** (1 / g))
    assert np.abs(read_code(path) - wanted).max() <= 1


def test_writers_of_srgb_put_down_its_nearest_gamma(tmp_path):
    dark = (20, 8, 3)
    for chunks in ([gamma(0.45455)], [gamma(0.45455), spots("srgb")], [spots("srgb")],
                   [(b"sRGB", b"\0"), gamma(1.0)]):  # fmt: skip
        assert read_code(picture(tmp_path, *chunks, code=dark)).tolist() == list(dark)


def test_primaries_that_span_nothing_are_passed_over(tmp_path):
    flat = b"cHRM", struct.pack(">8I", *(31270, 32900) * 4)
    assert read_code(picture(tmp_path, flat)).tolist() == list(CODE)


@pytest.mark.parametrize(("code", "name"), [(1, "srgb"), (9, "2020"), (12, "p3")])
def test_code_points_of_png(tmp_path, code, name):
    path = picture(tmp_path, (b"cICP", bytes([code, 13, 0, 1])), gamma(1.0),
                   profile(rgb_profile(ADOBE, GAMMA_22)))  # fmt: skip
    assert np.abs(read_code(path) - shown(name, srgb_light(CODE))).max() <= 1


def test_code_points_with_a_wrong_sum_do_not_count(tmp_path):
    data = bytearray(picture(tmp_path, (b"cICP", bytes([12, 13, 0, 1]))).read_bytes())
    data[data.index(b"cICP") + 9] ^= 1
    assert read_code(placed(tmp_path, bytes(data), "b.png")).tolist() == list(CODE)


@pytest.mark.parametrize("transfer", [16, 18])
def test_brighter_than_white_is_drawn_in(tmp_path, transfer):
    ramp = np.arange(256, dtype=np.uint8)
    row = b"\0" + np.repeat(ramp, 3).tobytes()
    path = placed(tmp_path, png(256, 1, 8, 2, row, (b"cICP", bytes([9, transfer, 0, 1]))), "h.png")
    codes = encode_srgb(read_linear(path))[0].astype(int)
    assert (np.diff(codes[:, 0]) >= 0).all() and codes[0].max() == 0 and codes[-1].min() > 240
    assert np.abs(codes - codes[:, :1]).max() <= 1  # grey stays grey
    white = {16: 0.58, 18: 0.75}[transfer]  # the signal of diffuse white
    assert 215 <= codes[round(255 * white), 0] <= 240
    assert np.abs(codes[:, 0] - ramp).max() > 25


def test_a_curve_that_nobody_uses_is_refused(tmp_path):
    assert "transfer 9" in error_of(read_linear, picture(tmp_path, (b"cICP", b"\1\x09\0\1")))


def avif(tmp_path, nclx=None, code=CODE):
    path = saved(tmp_path, Image.new("RGB", (24, 16), code), "a.avif", quality=95)
    if nclx:
        data = path.read_bytes()
        at = data.index(b"nclx") + 4
        path.write_bytes(data[:at] + struct.pack(">HH", *nclx) + data[at + 4 :])
    return path


def test_code_points_of_avif(tmp_path):
    assert np.abs(read_code(avif(tmp_path)) - CODE).max() <= 3
    wanted = shown("p3", srgb_light(CODE))
    assert np.abs(read_code(avif(tmp_path, (12, 13))) - wanted).max() <= 4
    for transfer in (16, 18):
        assert np.abs(read_code(avif(tmp_path, (9, transfer))) - CODE).max() > 10


def with_clean_aperture(data, width, height, left, top, w, h):
    """An AVIF with one more property: only a part of it is to be shown."""
    body = struct.pack(">IIIIiIiI", w, 1, h, 1, 2 * left - width + w, 2, 2 * top - height + h, 2)
    box = struct.pack(">I4s", 8 + len(body), b"clap") + body
    ipco, ipma = data.index(b"ipco") - 4, data.index(b"ipma") - 4
    ipco_size, ipma_size = (int.from_bytes(data[at : at + 4]) for at in (ipco, ipma))
    inside, number = ipco + 8, 0
    while inside < ipco + ipco_size:
        number, inside = number + 1, inside + int.from_bytes(data[inside : inside + 4])
    out = bytearray(data)
    assert out[ipma + 12 : ipma + 16] == struct.pack(">I", 1)
    out[ipma + 18] += 1
    out[ipma + ipma_size : ipma + ipma_size] = bytes([0x80 | (number + 1)])
    out[ipco + ipco_size : ipco + ipco_size] = box
    grown = {b"ipma": 1, b"ipco": len(box), b"iprp": len(box) + 1, b"meta": len(box) + 1}
    for name, more in grown.items():
        at = out.index(name) - 4
        out[at : at + 4] = (int.from_bytes(out[at : at + 4]) + more).to_bytes(4)
    start = out.index(struct.pack(">I", data.index(b"mdat") + 4), out.index(b"iloc"))
    out[start : start + 4] = (int.from_bytes(out[start : start + 4]) + len(box) + 1).to_bytes(4)
    return bytes(out)


def test_the_clean_aperture_of_avif(tmp_path):
    values = np.zeros((40, 60, 3), np.uint8)
    values[8:24, 20:52] = (200, 40, 60)
    path = saved(tmp_path, values, "a.avif", quality=98)
    cut = with_clean_aperture(path.read_bytes(), 60, 40, 20, 8, 32, 16)
    light = read_linear(placed(tmp_path, cut, "b.avif"))
    assert light.shape == (16, 32, 3)
    assert np.abs(encode_srgb(light)[2:-2, 2:-2].astype(int) - (200, 40, 60)).max() < 12
    wild = with_clean_aperture(path.read_bytes(), 60, 40, 50, 8, 32, 16)
    assert read_linear(placed(tmp_path, wild, "c.avif")).shape == (40, 60, 3)


def test_avif_without_a_size_is_not_called_heic(tmp_path):
    data = avif(tmp_path).read_bytes().replace(b"ispe", b"free")
    text = error_of(read_linear, placed(tmp_path, data, "a.avif"))
    assert "AVIF" in text and "HEIC" not in text
    assert not boxes.is_avif(BytesIO(b"\0\0\0\x18ftypheic\0\0\0\0mif1heic"))


@pytest.mark.parametrize("kind", ["jpg", "png", "webp", "tif"])
def test_adobe_rgb_by_exif(tmp_path, kind):
    def exif(space, index):
        tags = Image.Exif()
        tags.get_ifd(0x8769).update({40961: space})
        tags[0x8769] = 0  # or Pillow does not write the folder
        if index:
            tags.get_ifd(0x8769)[0xA005] = {1: index, 2: b"0100"}
        return tags

    wanted = shown("adobe", (np.array(CODE) / 255) ** 2.19921875)
    flat = Image.new("RGB", (16, 16), CODE)
    more = {} if kind in ("png", "tif") else {"quality": 98}
    cases = [((2, None), wanted), ((1, None), CODE), ((65535, None), CODE)]
    if kind != "tif":  # Pillow writes no folder in a folder into a TIFF
        cases += [((65535, "R03"), wanted), ((1, "R98"), CODE)]
    for (space, index), right in cases:
        path = saved(tmp_path, flat, f"a.{kind}", exif=exif(space, index), **more)
        assert np.abs(read_code(path) - right).max() <= 4, (space, index)
    path = saved(tmp_path, flat, f"a.{kind}", exif=exif(2, None),
                 icc_profile=rgb_profile(P3, PARA_SRGB), **more)  # fmt: skip
    assert np.abs(read_code(path) - shown("p3", srgb_light(CODE))).max() <= 4  # the profile first


def test_primaries_by_exif(tmp_path):
    tags = Image.Exif()
    tags[318], tags[319] = D65, tuple(v for spot in SPOTS["adobe"] for v in spot)
    tags.get_ifd(0x8769).update({40961: 65535, 42240: 2.2})
    path = saved(tmp_path, Image.new("RGB", (16, 16), CODE), "a.jpg", exif=tags, quality=98)
    assert np.abs(read_code(path) - shown("adobe", (np.array(CODE) / 255) ** 2.2)).max() <= 4


ABSURD = ((0.1, 40.0, 0.2), P3[1], P3[2])
FALLING = b"curv\0\0\0\0\0\0\0\2" + struct.pack(">2H", 65535, 0)
SHORT = b"curv\0\0\0\0\0\0\0\2" + struct.pack(">2H", 0, 9000)


@pytest.mark.parametrize("data", [
    rgb_profile(ABSURD, PARA_SRGB), rgb_profile(P3, FALLING), rgb_profile(P3, SHORT),
    rgb_profile((P3[1], P3[1], P3[2]), PARA_SRGB), icc(b"GRAY", b"XYZ ", kTRC=GAMMA_22),
])  # fmt: skip
def test_a_profile_that_cannot_be_meant_is_passed_over(tmp_path, data):
    assert read_code(picture(tmp_path, profile(data))).tolist() == list(CODE)
    wanted = shown("p3", srgb_light(CODE))
    path = saved(tmp_path, Image.new("RGB", (16, 16), CODE), "a.tif", icc_profile=data)
    assert read_code(path).tolist() == list(CODE)
    coded = picture(tmp_path, profile(data), (b"cICP", bytes([12, 13, 0, 1])))
    assert np.abs(read_code(coded) - wanted).max() <= 1


def test_tables_that_lead_nowhere_are_passed_over(tmp_path):
    ramp, unit = bytes(range(256)), fixed(1, 0, 0, 0, 1, 0, 0, 0, 1)
    for corners in (bytes([128] * 24), bytes([255 - 30 * bin(i).count("1") for i in range(8)
                                              for _ in range(3)])):  # fmt: skip
        table = b"mft1\0\0\0\0" + bytes([3, 3, 2, 0]) + unit + ramp * 3 + corners + ramp * 3
        data = icc(b"RGB ", b"Lab ", A2B0=table)
        assert read_code(picture(tmp_path, profile(data))).tolist() == list(CODE)


def test_another_white_becomes_white():
    d50 = (0.3457, 0.3585)
    light = primaries.of_chromaticities(d50, ((0.7347, 0.2653), (0.1596, 0.8404), (0.0366, 0.0001)))
    assert np.allclose(light.matrix.sum(1), 1, atol=2e-3)


@pytest.mark.parametrize("depth", [1, 2, 4, 8])
def test_the_transparent_grey_of_every_depth(tmp_path, depth):
    ground, most = (0.5, 0.2, 0.1), 2**depth - 1
    for key, other in ((most, 0), (0, most), (most // 3, most)):
        codes = [key] * 8 + [other] * 8
        bits = "".join(f"{code:0{depth}b}" for code in codes)
        row = b"\0" + int(bits, 2).to_bytes(len(bits) // 8)
        data = png(16, 2, depth, 0, row * 2, (b"tRNS", key.to_bytes(2)))
        light = read_linear(placed(tmp_path, data, "k.png"), ground=ground)
        assert np.allclose(light[:, :8], ground), (depth, key)
        if key != other:
            assert np.allclose(light[:, 8:], srgb_light(other, most)), (depth, key)
