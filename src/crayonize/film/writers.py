"""Moving pictures: a stream of frames becomes an animated WebP, GIF or PNG, or an MP4.

The writers pull frames from an iterator, so that only a few are in memory at a time; frames are
left alone once they have been handed over. Every frame but the first and the last stands for 1/FPS
second.
"""

import importlib.util
import os
import shutil
import struct
import subprocess
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImagePalette

from stroke_gen.files import check_target, whole_file

FPS = 10  # a whole number of hundredths of a second, as GIF needs
WEBP_QUALITY = 78
CRF = 20  # quality of MP4: 0 lossless, 51 worst

Frame = NDArray[np.uint8]  # (h, w, 3) sRGB


@dataclass(frozen=True)
class Reel:
    """What a film is made of. palette: up to 256 colours, (n, 3), for formats that need one."""

    width: int
    height: int
    frames: int
    first: int  # how many frames long the first picture stands ...
    last: int  # ... and the last
    palette: Frame

    def lengths(self) -> list[int]:
        """How long each picture stands, in frames."""
        return [self.first, *[1] * (self.frames - 2), self.last]


def check(path: str | os.PathLike[str]) -> None:
    """ValueError, before any work is done, if a film cannot be written to `path`."""
    suffix = Path(path).suffix.lower()
    if suffix not in WRITERS:
        raise ValueError(
            f"{os.fspath(path)!r}: cannot write {suffix or 'without suffix'}; use "
            f"{', '.join(WRITERS)}"
        )
    if suffix == ".mp4" and not importlib.util.find_spec("av") and not shutil.which("ffmpeg"):
        raise ValueError(
            f"{os.fspath(path)!r}: MP4 needs PyAV (pip install av) or ffmpeg on "
            "the PATH; "
            "WebP, GIF and PNG need neither"
        ) from ModuleNotFoundError("av")
    check_target(path)


class Aborted(Exception):
    """To be raised by the frames of a film that is not wanted any more."""


def write(path: str | os.PathLike[str], reel: Reel, frames: Iterator[Frame]) -> None:
    """Write a film of `reel.frames` frames, whole or not at all."""
    with whole_file(path) as part:
        WRITERS[part.suffix.lower()](part, reel, frames)


# ---- WebP and GIF by Pillow ----------------------------------------------------------------------


class _Lazy:
    """Pictures that exist only when looked at, behind the face of one Pillow image with many
    frames.
    """

    def __init__(self, frames: Iterator[Frame], count: int) -> None:
        self._frames, self.n_frames = frames, count
        self._now: Image.Image

    def seek(self, _: int) -> None:
        self._now = Image.fromarray(next(self._frames))

    def __getattr__(self, name: str) -> Any:
        return getattr(self._now, name)


def _webp(path: Path, reel: Reel, frames: Iterator[Frame]) -> None:
    """Without key frames on the way: a third of the bytes in half the time."""
    first = Image.fromarray(next(frames))
    rest: Any = [_Lazy(frames, reel.frames - 1)]
    durations = [1000 * n // FPS for n in reel.lengths()]
    first.save(
        path,
        "WEBP",
        save_all=True,
        append_images=rest,
        duration=durations,
        loop=0,
        quality=WEBP_QUALITY,
        method=2,
        kmin=0,
        kmax=0,
    )


def _gif(path: Path, reel: Reel, frames: Iterator[Frame]) -> None:
    """One palette for all frames, so that what did not change costs nothing."""
    colours = Image.new("P", (1, 1))
    colours.putpalette(ImagePalette.ImagePalette("RGB", reel.palette[:255].tobytes()))
    pictures = (
        Image.fromarray(f).quantize(palette=colours, dither=Image.Dither.NONE) for f in frames
    )
    durations = [1000 * n // FPS for n in reel.lengths()]
    next(pictures).save(
        path,
        "GIF",
        save_all=True,
        append_images=pictures,
        duration=durations,
        loop=0,
        optimize=True,
    )


# ---- PNG -----------------------------------------------------------------------------------------


def _png(path: Path, reel: Reel, frames: Iterator[Frame]) -> None:
    """An animated PNG, lossless; of each frame only the changed pixels are opaque, in the smallest
    rectangle.

    Pillow would hold all frames, and store the whole rectangle: ten times the bytes for a drawing.
    """
    with open(path, "wb") as file:

        def chunk(kind: bytes, *data: Any) -> None:
            body = kind + b"".join(data)
            file.write(
                struct.pack(">I", len(body) - 4) + body + struct.pack(">I", zlib.crc32(body))
            )

        file.write(b"\x89PNG\r\n\x1a\n")
        chunk(b"IHDR", struct.pack(">IIBBBBB", reel.width, reel.height, 8, 6, 0, 0, 0))
        chunk(b"sRGB", b"\0")
        chunk(b"acTL", struct.pack(">II", reel.frames, 0))
        number, before = 0, None
        for frame, length in zip(frames, reel.lengths(), strict=True):
            pixels = _packed(frame)
            top, left, part = _changed(before, pixels)
            size = (part.shape[1], part.shape[0])
            chunk(
                b"fcTL",
                struct.pack(
                    ">IIIIIHHBB", number, *size, left, top, length, FPS, 0, before is not None
                ),
            )
            # each after the number of its filter, 0
            rows = np.zeros((size[1], 1 + 4 * size[0]), np.uint8)
            rows[:, 1:] = part.view(np.uint8).reshape(size[1], -1)
            data = zlib.compress(rows.tobytes(), 3)
            if before is None:
                chunk(b"IDAT", data)
            else:
                chunk(b"fdAT", struct.pack(">I", number + 1), data)
            number += 1 if before is None else 2
            before = pixels
        chunk(b"IEND")


def _packed(frame: Frame) -> NDArray[np.uint32]:
    """(h, w) of opaque RGBA pixels."""
    rgba = np.full((*frame.shape[:2], 4), 255, np.uint8)
    rgba[..., :3] = frame
    return rgba.view(np.uint32)[..., 0]


def _changed(
    before: NDArray[np.uint32] | None, now: NDArray[np.uint32]
) -> tuple[int, int, NDArray[np.uint32]]:
    """Top, left and pixels of what differs from the frame before; the rest is clear (0)."""
    if before is None:
        return 0, 0, now
    differs = now != before
    rows, cols = np.flatnonzero(differs.any(1)), np.flatnonzero(differs.any(0))
    top, bottom = (int(rows[0]), int(rows[-1]) + 1) if rows.size else (0, 1)
    left, right = (int(cols[0]), int(cols[-1]) + 1) if cols.size else (0, 1)
    return top, left, np.where(differs, now, np.uint32(0))[top:bottom, left:right]


# ---- MP4 -----------------------------------------------------------------------------------------


def _mp4(path: Path, reel: Reel, frames: Iterator[Frame]) -> None:
    """H.264 by PyAV, else by an ffmpeg program; sides are cut to even numbers."""
    width, height = reel.width // 2 * 2, reel.height // 2 * 2
    even = (np.ascontiguousarray(f[:height, :width]) for f in frames)
    repeated = (f for f, n in zip(even, reel.lengths(), strict=True) for _ in range(n))
    write = _mp4_av if importlib.util.find_spec("av") else _mp4_ffmpeg
    write(path, width, height, repeated)


def _mp4_av(path: Path, width: int, height: int, frames: Iterator[Frame]) -> None:
    import av

    with av.open(str(path), "w", format="mp4", options={"movflags": "+faststart"}) as container:
        stream = container.add_stream("libx264", rate=FPS)
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        stream.time_base = Fraction(1, FPS)
        bt709 = "colorprim=bt709:transfer=bt709:colormatrix=bt709"
        stream.options = {"preset": "veryfast", "crf": str(CRF), "x264-params": bt709}
        for number, frame in enumerate(frames):
            picture = av.VideoFrame.from_ndarray(frame, "rgb24").reformat(
                format="yuv420p", dst_colorspace="ITU709"
            )
            picture.pts, picture.time_base = number, Fraction(1, FPS)
            container.mux(stream.encode(picture))
        container.mux(stream.encode(None))


def _mp4_ffmpeg(path: Path, width: int, height: int, frames: Iterator[Frame]) -> None:
    bt709 = ["-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709"]
    command = [
        "ffmpeg",
        "-v",
        "error",
        "-f",
        "rawvideo",
        "-pix_fmt",
        "rgb24",
        "-s",
        f"{width}x{height}",
        "-r",
        str(FPS),
        "-i",
        "pipe:0",
        "-vf",
        "scale=out_color_matrix=bt709",
        "-pix_fmt",
        "yuv420p",
        *bt709,
        "-c:v",
        "libx264",
        "-preset",
        "veryfast",
        "-crf",
        str(CRF),
        "-movflags",
        "+faststart",
        "-f",
        "mp4",
        "-y",
        str(path),
    ]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
    ) as program:
        assert program.stdin and program.stderr
        try:
            for frame in frames:
                program.stdin.write(frame.tobytes())
            program.stdin.close()
        except BrokenPipeError:
            pass  # what it says on its way out is the better message
        except BaseException:
            program.kill()
            raise
        said = program.stderr.read().decode(errors="replace").strip()
    if program.returncode:
        raise OSError(0, f"ffmpeg failed: {said.splitlines()[-1] if said else program.returncode}")


WRITERS: dict[str, Callable[[Path, Reel, Iterator[Frame]], None]] = {
    ".webp": _webp,
    ".gif": _gif,
    ".png": _png,
    ".apng": _png,
    ".mp4": _mp4,
}
