"""Small pictures made on the spot, and what they show."""

import struct
import zlib
from io import BytesIO

import numpy as np
import pytest
from PIL import Image


def srgb_light(code, full=255.0):
    """The sRGB curve, written down once more."""
    x = np.asarray(code, np.float64) / full
    return np.where(x <= 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** 2.4)


def noise(*shape, dtype=np.uint8, seed=1):
    return np.random.default_rng(seed).integers(0, np.iinfo(dtype).max + 1, shape, dtype=dtype)


def smooth(height=48, width=64):
    """A soft colourful picture that lossy formats keep."""
    y, x = np.mgrid[0 : 1 : height * 1j, 0 : 1 : width * 1j]
    return np.stack([200 * x + 20, 180 * y + 40, 120 + 80 * x * y], -1).astype(np.uint8)


def saved(tmp_path, image, name, **options):
    path = tmp_path / name
    (image if isinstance(image, Image.Image) else Image.fromarray(image)).save(path, **options)
    return path


def best(name):
    """Options for Pillow that keep the loss of lossy formats small."""
    return {} if name.endswith((".png", ".tif")) else {"quality": 98}


def file_bytes(image, kind, **options):
    out = BytesIO()
    image.save(out, kind, **options)
    return out.getvalue()


def placed(tmp_path, data, name):
    path = tmp_path / name
    path.write_bytes(data)
    return path


def error_of(call, *args, **options):
    with pytest.raises(ValueError) as caught:
        call(*args, **options)
    text = str(caught.value)
    assert "\n" not in text
    return text


def png(width, height, depth, color_type, rows, *extra):
    """A PNG of raw rows (each led by its filter byte)."""

    def chunk(name, data):
        return (
            struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
        )

    header = struct.pack(">IIBBBBB", width, height, depth, color_type, 0, 0, 0)
    body = b"".join(chunk(*e) for e in extra) + chunk(b"IDAT", zlib.compress(rows))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + body + chunk(b"IEND", b"")


def png_rows(values):
    return b"".join(b"\0" + row.astype(">u2").tobytes() for row in values)


def tiff(values, photometric=1, sample_format=1, bits=None, **more):
    """An uncompressed little-endian TIFF of one strip. more: tag_N=short value."""
    height, width, samples = values.shape
    bits = bits or values.dtype.itemsize * 8
    tags = {
        256: width,
        257: height,
        259: 1,
        262: photometric,
        277: samples,
        278: height,
        279: values.nbytes,
    }
    tags |= {int(k[4:]): v for k, v in more.items()}
    at = 8 + 12 * (len(tags) + 3) + 6  # after the folder: bits, sample formats, pixels
    tags |= {258: bits, 339: sample_format, 273: at + 4 * samples}
    entries = b""
    for tag in sorted(tags):
        if tag in (258, 339) and samples > 2:
            entries += struct.pack(
                "<HHII", tag, 3, samples, at + (0 if tag == 258 else 2 * samples)
            )
        elif tag in (258, 339):
            entries += struct.pack("<HHI", tag, 3, samples) + struct.pack(
                "<HH", tags[tag], tags[tag]
            )
        else:
            entries += struct.pack("<HHII", tag, 4, 1, tags[tag])
    folder = struct.pack("<H", len(tags)) + entries + struct.pack("<I", 0)
    arrays = struct.pack(f"<{2 * samples}H", *[bits] * samples, *[sample_format] * samples)
    return b"II*\0" + struct.pack("<I", 8) + folder + arrays + values.tobytes()


def icc(space, connection, **tags):
    """An ICC profile of raw tags."""
    body, table, at = b"", b"", 132 + 12 * len(tags)
    for name, data in tags.items():
        data += b"\0" * (-len(data) % 4)
        table += struct.pack(">4sII", name.encode(), at + len(body), len(data))
        body += data
    size = at + len(body)
    kind = b"prtr" if space == b"CMYK" else b"mntr"
    header = struct.pack(
        ">I4sI4s4s4s12x4s28x3I",
        size,
        b"test",
        0x02400000,
        kind,
        space,
        connection,
        b"acsp",
        0xF6D6,
        0x10000,
        0xD32D,
    )
    return header.ljust(128, b"\0") + struct.pack(">I", len(tags)) + table + body


def fixed(*values):
    return struct.pack(f">{len(values)}i", *(round(v * 65536) for v in values))


def rgb_profile(primaries, *curves):
    columns = {
        f"{c}XYZ": b"XYZ \0\0\0\0" + fixed(*p) for c, p in zip("rgb", primaries, strict=True)
    }
    return icc(
        b"RGB ",
        b"XYZ ",
        **columns,
        **{f"{c}TRC": t for c, t in zip("rgb", curves * 3, strict=False)},
    )


P3 = ((0.51512, 0.2412, -0.00105), (0.29198, 0.69225, 0.04189), (0.1571, 0.06657, 0.78407))
ADOBE = ((0.60974, 0.31111, 0.01947), (0.20528, 0.62567, 0.06087), (0.14919, 0.06322, 0.74457))
PARA_SRGB = b"para\0\0\0\0\0\3\0\0" + fixed(2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045)
GAMMA_22 = b"curv\0\0\0\0\0\0\0\1" + struct.pack(">H", round(2.19921875 * 256)) + b"\0\0"
SAMPLED = b"curv\0\0\0\0\0\0\1\0" + struct.pack(
    ">256H", *(round(65535 * (i / 255) ** 1.8) for i in range(256))
)


def stored_for(upright, orientation):
    """What a camera stores: orientation names the sides of the scene at which row 0 and column 0
    lie.
    """
    sides = (
        "top left,top right,bottom right,bottom left,left top,right top,right bottom,left bottom"
    )
    rows, columns = sides.split(",")[orientation - 1].split()
    if rows in ("left", "right"):
        upright, swapped = upright.swapaxes(0, 1), True
    else:
        swapped = False
    flip_rows, flip_columns = rows in ("bottom", "right"), columns in ("bottom", "right")
    assert swapped == (columns in ("top", "bottom"))
    return np.ascontiguousarray(upright[:: -1 if flip_rows else 1, :: -1 if flip_columns else 1])
