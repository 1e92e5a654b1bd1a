"""TIFFs of every layout: read right, or refused in one line, never drawn from wrong values."""

import cv2
import numpy as np
import pytest
import tifffile
from made import error_of, noise, saved, srgb_light, stored_for
from PIL import Image

from crayonize.images import pillow, scan
from crayonize.images.read import open_photo, read_linear

GROUND = (0.5, 0.2, 0.1)


def written(tmp_path, values, **options):
    path = tmp_path / "a.tif"
    tifffile.imwrite(path, values, metadata=None, **options)
    return path


def planes(values):
    return np.ascontiguousarray(np.moveaxis(values, 2, 0))


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize(
    "layout", [{}, {"rowsperstrip": 7}, {"tile": (16, 16)}, {"bigtiff": True}, {"predictor": 2}]
)
@pytest.mark.parametrize("compression", [None, "zlib"])
@pytest.mark.parametrize("channels", [3, 4])
def test_planes_of_16_bits(tmp_path, order, layout, compression, channels):
    if "predictor" in layout and compression is None:
        layout = {"rowsperstrip": 5}
    values = noise(50, 37, channels, dtype=np.uint16)
    path = written(tmp_path, planes(values), photometric="rgb", planarconfig="separate",
                   compression=compression, byteorder=order,
                   extrasamples=["unassalpha"] * (channels - 3), **layout)  # fmt: skip
    alpha = values[..., 3:] / 65535 if channels == 4 else 1
    wanted = srgb_light(values[..., :3], 65535) * alpha + np.array(GROUND) * (1 - alpha)
    assert np.abs(read_linear(path, ground=GROUND) - wanted).max() < 1e-5


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("kind", [np.float16, np.float32, np.float64])
@pytest.mark.parametrize("channels", [1, 3])
def test_floats(tmp_path, order, kind, channels):
    values = noise(20, 30, channels) / 255
    stored = values.astype(kind) if channels == 3 else values[..., 0].astype(kind)
    path = written(tmp_path, stored, byteorder=order,
                   photometric="rgb" if channels == 3 else "minisblack")  # fmt: skip
    assert np.abs(read_linear(path) - srgb_light(values, 1)).max() < 2e-3


@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
@pytest.mark.parametrize("alpha", ["unassalpha", "assocalpha", "unspecified"])
@pytest.mark.parametrize("config", ["contig", "separate"])
@pytest.mark.parametrize("colours", [1, 3])
def test_alpha_of_every_kind(tmp_path, kind, alpha, config, colours):
    full = np.iinfo(kind).max
    values = noise(20, 30, colours + 1, dtype=kind)
    values[..., -1] |= full // 2 + 1
    share = values[..., -1:] / full
    shown = values[..., :-1]
    stored = values.copy()
    if alpha == "assocalpha":
        stored[..., :-1] = np.rint(shown * share)
    path = written(
        tmp_path, planes(stored) if config == "separate" else stored, planarconfig=config,
        photometric="rgb" if colours == 3 else "minisblack", extrasamples=[alpha],
    )  # fmt: skip
    share = 1 if alpha == "unspecified" else share
    wanted = srgb_light(shown, full) * share + np.array(GROUND) * (1 - share)
    assert np.abs(read_linear(path, ground=GROUND) - wanted).max() < (0.02 if full < 256 else 1e-4)


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("predictor", [1, 2])
def test_lzw_is_unpacked(tmp_path, order, predictor):
    values = noise(40, 30, 3, dtype=np.uint16)
    path = tmp_path / "a.tif"
    cv2.imwrite(str(path), values[..., ::-1], [cv2.IMWRITE_TIFF_COMPRESSION, 5,
                                               cv2.IMWRITE_TIFF_PREDICTOR, predictor])  # fmt: skip
    with tifffile.TiffFile(path) as tiff:
        assert tiff.pages[0].compression == 5 and tiff.pages[0].predictor == predictor
    assert np.abs(read_linear(path) - srgb_light(values, 65535)).max() < 1e-5


def test_integers_reach_white_and_black(tmp_path):
    ramp = np.linspace(0, 1, 120).reshape(8, 15)
    for kind in (np.uint8, np.uint16, np.uint32, np.int8, np.int16, np.int32):
        values = np.rint(ramp * np.iinfo(kind).max).astype(kind)
        light = read_linear(written(tmp_path, values))
        assert np.abs(light - srgb_light(ramp, 1)[..., None]).max() < 0.02, kind


@pytest.mark.parametrize("kind", [np.int8, np.int16, np.int32])
def test_values_below_zero_are_refused(tmp_path, kind):
    path = written(tmp_path, np.array([[-5, 3], [1, 2]], kind))
    assert "below 0" in error_of(read_linear, path)


def test_no_number_is_refused_in_colour_too(tmp_path):
    values = np.zeros((4, 4, 3), np.float32)
    values[1, 1, 1] = np.nan
    assert "finite" in error_of(read_linear, written(tmp_path, values, photometric="rgb"))


@pytest.mark.parametrize("scale", [1, 257])
def test_colour_maps_of_8_and_16_bits(tmp_path, scale):
    table = noise(3, 256).astype(np.uint16)
    codes = noise(20, 30)
    path = written(tmp_path, codes, photometric="palette", colormap=table * scale)
    wanted = srgb_light(table[:, codes].transpose(1, 2, 0))
    assert np.abs(read_linear(path) - wanted).max() < 1e-5


@pytest.mark.parametrize("orientation", range(1, 9))
def test_every_reader_turns_it_once(tmp_path, orientation):
    upright = noise(20, 30, 3, dtype=np.uint16)
    for values in (upright, upright.astype(np.float32) / 65535, (upright >> 8).astype(np.uint8)):
        path = written(tmp_path, stored_for(values, orientation), photometric="rgb",
                       extratags=[(274, 3, 1, orientation, True)])  # fmt: skip
        assert np.abs(read_linear(path) - srgb_light(upright, 65535)).max() < 0.01


def test_planes_of_ink(tmp_path):
    inks = noise(20, 30, 4)
    plain = read_linear(saved(tmp_path, Image.fromarray(inks, "CMYK"), "b.tif"))
    deep = planes(inks.astype(np.uint16) * 257)
    path = written(tmp_path, deep, photometric="separated", planarconfig="separate")
    assert np.array_equal(read_linear(path), plain)


def test_what_neither_reader_knows_is_named(tmp_path):
    values = noise(16, 16, 3, dtype=np.uint16)
    path = written(tmp_path, planes(values), photometric="rgb", planarconfig="separate")
    data = bytearray(path.read_bytes())
    with tifffile.TiffFile(path) as tiff:
        at = tiff.pages[0].tags[259].valueoffset
    data[at : at + 2] = (50000).to_bytes(2, "little")  # Zstandard
    path.write_bytes(data)
    text = error_of(read_linear, path)
    assert "not read" in text and "compression 50000" in text


@pytest.mark.parametrize("compression", [None, "zlib"])
def test_cut_planes_are_refused(tmp_path, compression):
    values = planes(noise(50, 60, 3, dtype=np.uint16))
    path = written(tmp_path, values, photometric="rgb", planarconfig="separate", rowsperstrip=10,
                   compression=compression)  # fmt: skip
    data = path.read_bytes()
    for tenth in range(1, 10):
        path.write_bytes(data[: len(data) * tenth // 10])
        assert "damaged" in error_of(read_linear, path)


def test_a_header_tells_what_an_array_takes(tmp_path):
    values = planes(noise(50, 60, 3, dtype=np.uint16))
    path = written(tmp_path, values, photometric="rgb", planarconfig="separate")
    with open_photo(path) as photo:
        assert (photo.width, photo.height) == (60, 50)
        assert photo.decoding >= 2 * values.nbytes


def test_pillows_own_limit_holds_nowhere_and_is_given_back(tmp_path, monkeypatch):
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", 100)
    for name in ("a.tif", "a.png", "a.jpg"):
        assert read_linear(saved(tmp_path, noise(40, 50, 3), name)).shape == (40, 50, 3)
    assert Image.MAX_IMAGE_PIXELS == 100


def test_two_readers_that_disagree_are_not_believed(tmp_path, monkeypatch):
    values = noise(20, 30, 3, dtype=np.uint16)
    cv2.imwrite(str(tmp_path / "deep.png"), values)
    for wrong in (values[:, ::-1].copy(), values[:10].copy(), values.astype(np.uint8)):
        monkeypatch.setattr(pillow.cv2, "imdecode", lambda *_, wrong=wrong: wrong)
        assert "differently" in error_of(read_linear, tmp_path / "deep.png")


def test_a_matrix_is_an_array():
    grey = noise(6, 7)
    matrix = grey.view(np.matrix)
    assert np.array_equal(read_linear(matrix), read_linear(grey))
    assert scan.scan_array(matrix).rows(0, 2).shape == (2, 7, 1)
