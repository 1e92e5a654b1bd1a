"""The Python interface: a photo becomes a drawing, a Drawing becomes a picture.

Importing this module is cheap; what is heavy is loaded by the first call.
"""

from __future__ import annotations

import functools
import json
import logging
import os
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import fields
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, Unpack, overload

from stroke_gen import checks
from stroke_gen.checks import did_you_mean, quoted

from . import __version__
from .machine import kernels, memory
from .settings import Choices, Settings

if TYPE_CHECKING:
    from types import ModuleType

    import numpy as np
    from numpy.typing import NDArray
    from PIL.Image import Exif, Image

    from stroke_gen.drawing import Drawing

    from .images.read import Photo, Source
    from .pipeline import Easel, Onlooker, Progress


Target = str | os.PathLike[str] | BinaryIO  # where a picture goes
MAX_SEED = 2**63 - 1
MAX_SIZE = 20_000  # pixels along the long side
MAX_THREADS = 256
# pixels of the photo's long side that are read: three times what the planner looks at
PHOTO_SIDE = 2048
STROKE_SUFFIXES = (".json", ".svg")
_MM_PER_INCH = 25.4


class _Options(Choices, total=False):
    strokes: str | os.PathLike[str] | None
    timelapse: str | os.PathLike[str] | None
    seconds: float
    show_tip: bool
    legend: bool
    light: bool
    progress: Progress | None


@overload
def convert(
    image: NDArray[Any], out: Target | None = None, **options: Unpack[_Options]
) -> NDArray[np.uint8]: ...
@overload
def convert(image: Image, out: Target | None = None, **options: Unpack[_Options]) -> Image: ...
@overload
def convert(image: bytes, out: Target | None = None, **options: Unpack[_Options]) -> bytes: ...
@overload
def convert(image: BinaryIO, out: None = None, **options: Unpack[_Options]) -> BytesIO: ...
@overload
def convert(
    image: str | os.PathLike[str], out: None = None, **options: Unpack[_Options]
) -> Image: ...
@overload
def convert(
    image: str | os.PathLike[str], out: str | os.PathLike[str], **options: Unpack[_Options]
) -> Path: ...
def convert(
    image: Source | BinaryIO,
    out: Target | None = None,
    *,
    strokes: str | os.PathLike[str] | None = None,
    timelapse: str | os.PathLike[str] | None = None,
    seconds: float = 12.0,
    show_tip: bool = False,
    legend: bool = False,
    light: bool = True,
    progress: Progress | None = None,
    **choices: Unpack[Choices],
) -> Image | NDArray[np.uint8] | Path | bytes | BytesIO:
    """Draw a photo with wax crayons.

    Parameters
    ----------
    image: a path, a Pillow image, an array (h, w), (h, w, 3) or (h, w, 4) of uint8, uint16 or
        sRGB-encoded floats 0..1, or a photo's file as bytes or opened for reading.
    out: where to write the drawing (PNG, JPEG, WebP or TIFF), with settings and seed inside; what
        is open for writing gets a PNG.
    strokes: where to save the strokes: .json, from which `draw` makes the same picture at any
        size, or .svg for other programs.
    timelapse: where to write a film of the drawing (.webp, .gif, .png, .mp4).
    seconds: length of the film, 3 to 600.
    show_tip: with the crayon in the film.
    legend: put the crayons used beside the picture.
    light: shade the relief of paper and wax.
    progress: called with the name of what is being done and the share done, 0..1. Raise an
        exception in it to cancel: nothing is written, and the exception comes out here.
    **choices: any field of `Settings` (palette, paper, style, force, size, seed, ...).

    Returns
    -------
    The same kind as `image`: for an array uint8 sRGB (h, w, 3), for a Pillow image one, for a path
    the path `out`, or a Pillow image if there is no `out`; for bytes or an open file a PNG, as
    bytes or as a BytesIO.

    Raises
    ------
    ValueError: one line, for what the caller can mend.
    TypeError: for an unknown choice.
    OSError: if a file cannot be written.

    Examples
    --------
    >>> import numpy as np
    >>> sky = np.full((40, 60, 3), (120, 170, 230), np.uint8)
    >>> convert(sky, size=90, style="sketch", seed=1).shape
    (60, 90, 3)
    """
    import numpy as np
    from PIL import Image

    settings = settings_of(dict(choices))
    opened = hasattr(image, "read")
    given: Source = image.read() if opened else image  # type: ignore[union-attr,assignment]
    if isinstance(given, bytes) and out is None:
        out = BytesIO()
    check_outputs([image, *settings.files()], out, strokes, timelapse)
    with filming(timelapse, seconds, show_tip, light) as watch:
        drawn = sketch(given, settings, progress, watch)
    picture = finish(*drawn, out, strokes, light=light, settings=settings, legend=legend)
    if isinstance(image, np.ndarray):
        return picture
    if isinstance(given, bytes) and isinstance(out, BytesIO):
        out.seek(0)
        return out if opened else out.getvalue()
    if isinstance(out, str | os.PathLike) and not isinstance(image, Image.Image):
        return Path(out)
    return Image.fromarray(picture)


def draw(
    drawing: Drawing | str | os.PathLike[str],
    size: int = Settings.size,
    *,
    out: str | os.PathLike[str] | None = None,
    threads: int | None = None,
    preview: bool = False,
    light: bool = True,
    progress: Progress | None = None,
) -> NDArray[np.uint8]:
    """The picture of a Drawing, or of a drawing's file.

    Parameters
    ----------
    drawing: a `stroke_gen.drawing.Drawing`, or the path of one as .json, or of lines as .svg.
    size: long side of the picture in pixels, 1 to 20000.
    out: where to write the picture as well.
    threads: at most so many at once; they change nothing in the picture. None: all cores.
    preview: at half the size.
    light, progress: as in `convert`.

    Returns
    -------
    uint8 sRGB (h, w, 3).

    Raises
    ------
    ValueError: one line, naming the stroke and the field that is wrong.
    OSError: if `out` cannot be written.

    Examples
    --------
    >>> from stroke_gen.drawing_file import drawing_from_json
    >>> line = {"crayon": "red", "path": [[10, 10], [90, 50]]}
    >>> house = {"format": "crayonize drawing", "version": 1, "sheet_mm": [100, 60],
    ...          "paper": "smooth", "palette": "box8", "strokes": [line]}
    >>> drawing = drawing_from_json(house)
    >>> draw(drawing, size=200).shape
    (120, 200, 3)
    """
    return finish(*redraw(drawing, size, threads, preview, progress, out=out), out, light=light)


# ---- what the command line shares ----------------------------------------------------------------


def settings_of(choices: dict[str, Any]) -> Settings:
    """Settings from keywords, checked as far as can be done without a photo."""
    known = [field.name for field in fields(Settings)]
    for name in choices:
        if name not in known:
            raise TypeError(f"there is no choice {quoted(name)}{did_you_mean(name, known)}")
    settings = Settings(**{name: _plain(value) for name, value in choices.items()})
    checks.whole(settings.size, 1, MAX_SIZE, "size")
    checks.whole(settings.seed, 0, MAX_SEED, "seed", "2^63 - 1")
    _check_threads(settings.threads)
    for box in settings.focus:
        if len(box) != 4 or not all(0 <= x <= 1 for x in box):
            raise ValueError(
                f"focus: {box!r} is not x, y, w, h as fractions of the picture, from 0 to 1"
            )
    return settings.parsed()


def _plain(value: Any) -> Any:
    """numpy's numbers as Python's, and paths as text, so that they can be told in a file."""
    if isinstance(value, os.PathLike):
        return os.fsdecode(value)
    return value.item() if getattr(value, "shape", None) == () else value


def _check_threads(threads: int | None) -> None:
    if threads is not None:
        checks.whole(threads, 1, MAX_THREADS, "threads")


def check_outputs(
    inputs: list[Any],
    out: Target | None,
    strokes: str | os.PathLike[str] | None = None,
    timelapse: str | os.PathLike[str] | None = None,
) -> None:
    """Before any work: outputs have a format and a folder, and none is an input or another output.

    ValueError for what is wrong with a path, PermissionError for a folder that may not be written
    to.
    """
    from stroke_gen.files import check_target, sweep

    from .images.write import file_format, same_file

    if isinstance(out, str | os.PathLike):
        file_format(out)
    if strokes is not None and Path(strokes).suffix.lower() not in STROKE_SUFFIXES:
        raise ValueError(f"{strokes}: strokes can be saved as {', '.join(STROKE_SUFFIXES)} only")
    taken = [path for path in inputs if isinstance(path, str | os.PathLike)]
    for output in (out, strokes, timelapse):
        if not isinstance(output, str | os.PathLike):
            continue
        for path in taken:
            if same_file(path, output):
                raise ValueError(f"{output}: would be written over {path}; give another name")
        if Path(output).is_dir():
            raise ValueError(f"{output}: is a folder; give the name of a file")
        folder = Path(output).parent
        if not folder.is_dir():
            raise ValueError(f"{output}: the folder {folder} does not exist; create it first")
        if not os.access(folder, os.W_OK | os.X_OK):
            raise PermissionError(13, "its folder may not be written to", os.fspath(output))
        check_target(output)
        sweep(folder)
        taken.append(output)


def filming(
    path: str | os.PathLike[str] | None,
    seconds: float = 12.0,
    show_tip: bool = False,
    light: bool = True,
) -> AbstractContextManager[Onlooker | None]:
    """What `sketch` and `redraw` take as `watch` to film the drawing into `path`; nothing for
    None.
    """
    if path is None:
        return nullcontext()
    workshop()
    from .film.plan import Timelapse

    kernels.keep_kernels()
    return Timelapse(path, seconds, show_tip, light)


def sketch(
    image: Source | Photo,
    settings: Settings,
    progress: Progress | None = None,
    watch: Onlooker | None = None,
) -> tuple[Drawing, Easel]:
    """Plan and draw a photo: its Drawing, and the sheet it was drawn on."""
    from .images.read import open_photo
    from .wax.paper import colour_linear

    with open_photo(image) as photo:
        _check_narrow(photo, settings)
        check_size(photo.width, photo.height, settings.size, settings.preview, photo=photo.decoding,
                   filmed=watch is not None)  # fmt: skip
        light = photo.light(PHOTO_SIDE, colour_linear(settings.ground.colour))
        if photo.warning:
            logging.getLogger("crayonize").warning("%s: %s", photo.name, photo.warning)
    drawn: tuple[Drawing, Easel] = workshop().sketch(light, settings, progress, watch)
    return drawn


def _check_narrow(photo: Photo, settings: Settings) -> None:
    """ValueError for a photo so long that no stroke has room between the margins of its sheet."""
    long, short = max(photo.width, photo.height), min(photo.width, photo.height)
    narrow_mm = settings.sheet_mm * short / long
    if narrow_mm < 2 * settings.hand.margin_mm + settings.hand.tip_mm / 2:
        raise ValueError(
            f"{photo.name}: is {long / short:.0f} times as long as wide, and only {narrow_mm:.1f} "
            "mm wide on its sheet, too narrow for strokes; cut it, or choose a larger sheet_mm"
        )


def redraw(
    drawing: Drawing | str | os.PathLike[str],
    size: int,
    threads: int | None = None,
    preview: bool = False,
    progress: Progress | None = None,
    *,
    out: str | os.PathLike[str] | None = None,
    watch: Onlooker | None = None,
) -> tuple[Drawing, Easel]:
    """Draw a Drawing, or a drawing's file, on a blank sheet of `size` pixels: the Drawing, and the
    sheet.
    """
    from stroke_gen.drawing import Drawing, check_drawing

    size = checks.whole(size, 1, MAX_SIZE, "size")
    _check_threads(threads)
    check_outputs([drawing], out)
    if isinstance(drawing, Drawing):
        check_drawing(drawing, "drawing")
    else:
        drawing = load_strokes(drawing)
    check_size(drawing.width_mm, drawing.height_mm, size, preview, filmed=watch is not None)
    easel: Easel = workshop().draw(
        drawing, size, threads=threads, preview=preview, progress=progress, watch=watch
    )
    return drawing, easel


def load_strokes(
    path: str | os.PathLike[str],
    *,
    palette: str | None = None,
    paper: str | None = None,
    widths: str = "tip",
    say: Callable[[str], None] | None = None,
) -> Drawing:
    """A drawing's file: our .json, or lines of another program as .svg.

    palette, paper: in place of the drawing's own.   widths, say: of an SVG, see svg_in.
    """
    from dataclasses import replace

    from stroke_gen.drawing_file import load_drawing

    from .svg.load import load_svg

    if Path(path).suffix.lower() == ".svg":
        return load_svg(
            path, palette=palette or "box24", paper=paper or "drawing", widths=widths, say=say
        )
    drawing = load_drawing(path)
    _check_no_files(drawing, os.fsdecode(path), palette, paper)
    if palette is not None:
        from .crayons.palette_files import is_file
        from .crayons.used import with_palette

        if isinstance(drawing.palette, str) and is_file(drawing.palette):  # never opened
            drawing = replace(drawing, palette=palette)
        else:
            drawing = with_palette(drawing, palette)
    return replace(drawing, paper=paper or drawing.paper)


def _check_no_files(drawing: Drawing, where: str, palette: str | None, paper: str | None) -> None:
    """ValueError if a drawing names files: it may be a stranger's, and they are ours."""
    from .crayons.palette_files import is_file, palette_names
    from .wax.paper import papers, strange

    box = drawing.palette if isinstance(drawing.palette, str) else ""
    found = {
        "palette": (box if box and is_file(box) else "", [name for name, *_ in palette_names()]),
        "paper": (strange(drawing.paper), list(papers())),
    }
    for what, (word, known) in found.items():
        if word and (palette, paper)[what == "paper"] is None:
            raise ValueError(
                f"{where}: {what}: {quoted(word)} is none of ours{did_you_mean(word, known)}; a "
                f"drawing names no files, give one with --{what}"
            )


def save_steps(
    drawing: Drawing, out: str | os.PathLike[str], progress: Progress | None = None
) -> list[Path]:
    """Pages that show how to draw a Drawing, as a .pdf or .png files; see steps.py."""
    workshop()
    from .pages import steps

    return steps.save_steps(drawing, out, progress)


def check_size(
    width: float, height: float, size: int, preview: bool, *, photo: int = 0, filmed: bool = False
) -> None:
    """ValueError if the sheet for a picture of these proportions does not fit into memory; see
    memory.check_fits.
    """
    cell = max(width, height) / (size / 2 if preview else size)
    memory.check_fits(
        max(1, round(height / cell)), max(1, round(width / cell)), photo=photo, filmed=filmed
    )


def finish(
    drawing: Drawing,
    easel: Easel,
    out: Target | None,
    strokes: str | os.PathLike[str] | None = None,
    *,
    light: bool,
    settings: Settings | None = None,
    kept: Exif | None = None,
    legend: bool = False,
) -> NDArray[np.uint8]:
    """The picture as uint8 sRGB; written to `out` and its strokes to `strokes` if these are given.

    settings: of the photo, to be noted in the picture beside what the drawing itself says.
    kept: tags of the photo that go into the picture, see metadata.py.   legend: with the crayons
        used.
    """
    from stroke_gen.drawing_file import save_drawing

    from .images.write import write_image

    picture = easel.picture_srgb(light)
    if legend:
        from .pages.legend import with_legend

        picture = with_legend(picture, drawing, easel, light=light)
    if out is not None:
        dpi = easel.sheet.cols / drawing.width_mm * _MM_PER_INCH
        told = notes(drawing, settings) | {"light": light, "smears": easel.smears}
        write_image(out, picture, settings=told, dpi=dpi if dpi >= 1 else None, kept=kept)
    if strokes is not None:
        if Path(strokes).suffix.lower() == ".svg":
            from .svg.save import save_svg

            save_svg(drawing, strokes, easel.box.palette)
        else:
            save_drawing(drawing, strokes)
    return picture


def notes(drawing: Drawing, settings: Settings | None = None) -> dict[str, str | int | float]:
    """What is written into a picture: enough to draw it again, and no folder names."""

    def short(value: Any) -> str | int | float:
        if isinstance(value, dict):
            return json.dumps(value) if "extends" in value else str(value.get("name", "custom"))
        if isinstance(value, str):
            return Path(value).name
        return value if isinstance(value, int | float) else repr(value)

    chosen = {name: getattr(drawing, name) for name in ("paper", "palette", "physics", "seed")}
    if settings:  # the number of threads changes nothing in the picture
        chosen |= {
            f.name: getattr(settings, f.name) for f in fields(settings) if f.name != "threads"
        }
    named = {name: short(value) for name, value in chosen.items() if value not in (None, ())}
    return {"crayonize": __version__, **named}


@functools.cache
def workshop() -> ModuleType:
    """The pipeline with all its kernels, these from the compile cache."""
    memory.share_heaps()
    from . import pipeline

    kernels.keep_kernels()
    return pipeline


def warm_up() -> None:
    """Draw a narrow strip in every style, film it, open a live sheet: through all kernels, that
    they are kept.
    """
    import tempfile

    import numpy as np

    from stroke_gen.drawing import Drawing
    from stroke_gen.params import style_names

    from .wax.live import Live

    y, x = np.mgrid[:8, :64] / np.float32(8)
    strip = np.stack([x / 8, y, 0.5 + 0.5 * np.sin(2 * x * y)], axis=-1)
    for style in style_names():
        convert(strip, style=style, size=400, sheet_mm=100.0)
    with tempfile.TemporaryDirectory() as folder:
        film = Path(folder) / "film.png"
        convert(
            strip, size=400, sheet_mm=100.0, preview=True, light=False, timelapse=film, seconds=3
        )
    Live(Drawing(10.0, 10.0, "drawing", "box24", ()), 50)
