"""What each command does: its words read, the work handed to the rooms that do it."""

import argparse
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import nullcontext
from dataclasses import fields
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..images import metadata, page
from ..machine.terminal import tell
from ..settings import Settings
from . import folders
from .bar import report, swatch, talk
from .options import Parser, add_strokes, add_talk, drawing_parser, photo_parser

PHOTO_SUFFIXES = (
    ".jpg", ".jpeg", ".png", ".webp", ".tif", ".tiff", ".avif", ".heic", ".heif", ".gif", ".bmp",
)  # fmt: skip

if TYPE_CHECKING:
    from stroke_gen.drawing import Drawing


def convert(words: Sequence[str]) -> int:
    """crayonize PHOTO [OUT]: draw a photo. With folders, or several photos and -o: all of them."""
    options = photo_parser().read(words)
    begun = time.monotonic()

    from .. import api
    from ..batch.conductor import run

    paths = [path for path in (options.photo, options.out, *options.more) if path is not None]
    several = folders.inputs_and_output(paths, options.output)
    chosen = {f.name: getattr(options, f.name) for f in fields(Settings) if f.name in options}
    chosen |= {"focus": tuple(options.focus), "style": _style(options)}
    settings = api.settings_of(chosen)
    if several:
        if options.timelapse or options.legend:
            raise ValueError("--timelapse and --legend are for one photo")
        if options.strokes:
            raise ValueError("--strokes is for one photo")
        return run(*several, folders.options_of(options), folders.recipe_of(options, settings))

    photo = Path(options.photo)
    _check_photo(photo)
    out = options.out or options.output or photo.with_name(f"{photo.stem}.crayon.png")
    folders.check_alone(options)
    api.check_outputs([photo, *settings.files()], out, options.strokes, options.timelapse)
    if options.out is not None:
        _spare_photo(options.out)
    from ..images.apart import open_apart

    with talk(options) as progress, open_apart(photo) as opened:
        settings = page.fitted(settings, options.print, options.dpi, opened.width, opened.height)
        with api.filming(
            options.timelapse, options.seconds, options.show_tip, options.light
        ) as watch:
            drawing, easel = api.sketch(opened, settings, progress, watch)
        kept = metadata.kept(opened.exif, options.metadata)
        api.finish(
            drawing,
            easel,
            out,
            options.strokes,
            light=options.light,
            settings=settings,
            kept=kept,
            legend=options.legend,
        )
    if not options.quiet:
        beside = (options.strokes, options.timelapse)
        report(out, beside, easel, drawing, begun, verbose=options.verbose > 0)
    return 0


def _style(options: argparse.Namespace) -> str | dict[str, Any]:
    """The style that the command line names, with the keys that it sets."""
    if not options.knobs:
        return str(options.style)
    style: dict[str, Any] = {"extends": options.style}
    for key, value in options.knobs:
        coat, dot, own = key.rpartition(".")
        keys = style.setdefault("pass", {}).setdefault(coat, {}) if dot else style
        keys[own] = value
    return style


def _check_photo(photo: Path) -> None:
    """ValueError with what was probably meant if a photo is none."""
    if photo.suffix.lower() in (".json", ".svg"):
        raise ValueError(f"{photo}: is no photo; to draw its strokes: crayonize draw {photo} OUT")
    if not photo.suffix and not photo.exists():
        near = get_close_matches(str(photo), COMMANDS, 1)
        meant = f'; did you mean the command "{near[0]}"?' if near else ", and no command"
        raise ValueError(f"{photo}: is no file{meant}")


def _check_drawing(path: str, out: str) -> None:
    """ValueError with what was probably meant if a drawing is a photo."""
    if Path(path).suffix.lower() in PHOTO_SUFFIXES:
        raise ValueError(f"{path}: is no drawing; to draw a photo: crayonize {path} {out}")


def _spare_photo(out: str) -> None:
    """ValueError if what is to be written over may be a photo: `crayonize *.jpg` can come to two
    names.
    """
    from ..images.write import holds_other_picture

    if holds_other_picture(out):
        advice = f"to draw it too, name a folder with -o; to replace it, say -o {out}"
        raise ValueError(f"{out}: is a picture that was not drawn here; {advice}")


def _draw(words: Sequence[str]) -> int:
    """crayonize draw DRAWING OUT: render strokes."""
    options = drawing_parser().read(words)
    begun = time.monotonic()

    from .. import api

    api.check_outputs([options.drawing], options.out, options.strokes, options.timelapse)
    _check_drawing(options.drawing, options.out)
    with talk(options) as progress:
        given = _strokes(options)
        with api.filming(
            options.timelapse, options.seconds, options.show_tip, options.light
        ) as watch:
            drawing, easel = api.redraw(
                given, options.size, options.threads, options.preview, progress, watch=watch
            )
        api.finish(
            drawing, easel, options.out, options.strokes, light=options.light, legend=options.legend
        )
    if not options.quiet:
        beside = (options.strokes, options.timelapse)
        report(options.out, beside, easel, drawing, begun, verbose=options.verbose > 0)
    return 0


def _steps(words: Sequence[str]) -> int:
    """crayonize steps DRAWING OUT: pages to draw it after."""
    parser = Parser(
        "crayonize steps",
        "Make pages that show how to draw it: the outline, then crayon by crayon.",
    )
    parser.add_argument("drawing", metavar="DRAWING", help="a .json or .svg file of strokes")
    parser.add_argument(
        "out", metavar="OUT", help="a .pdf, a .png (pages are numbered), or a folder for .png pages"
    )
    add_strokes(parser)
    add_talk(parser)
    options = parser.read(words)

    from .. import api

    _check_drawing(options.drawing, "OUT")
    with talk(options) as progress:
        api.save_steps(_strokes(options), options.out, progress)
    return 0


def _strokes(options: argparse.Namespace) -> "Drawing":
    """The drawing that the command line names."""
    import logging

    from .. import api

    say = logging.getLogger("crayonize").info
    return api.load_strokes(
        options.drawing,
        palette=options.palette,
        paper=options.paper,
        widths=options.widths,
        say=say,
    )


def _warmup(words: Sequence[str]) -> int:
    """crayonize warmup: fill the compile cache."""
    parser = Parser(
        prog="crayonize warmup", description="Compile everything for this machine, and keep it."
    )
    add_talk(parser)
    options = parser.read(words)
    begun = time.monotonic()

    from .. import api

    with talk(options):
        api.warm_up()
    if not options.quiet:
        tell(f"crayonize: ready after {time.monotonic() - begun:.1f} s\n")
    return 0


def _bench(words: Sequence[str]) -> int:
    """crayonize bench: measure, and print a table."""
    parser = Parser(
        "crayonize bench", "Measure how fast it is on this machine; takes some minutes."
    )
    parser.add_argument(
        "--json",
        metavar="FILE",
        help="write all figures there; - writes them to stdout, and no table",
    )
    parser.add_argument(
        "--quick", action="store_true", help="half a minute: smaller pictures, each measured once"
    )
    add_talk(parser)
    options = parser.read(words)

    import json

    from stroke_gen.files import whole_file

    from ..bench import measure
    from ..bench.table import table

    aside = options.json is not None and options.json != "-"
    with whole_file(options.json) if aside else nullcontext() as part, talk(options) as progress:
        if part:
            part.touch()  # better now than after some minutes
        found = measure.measure(options.quick, progress)
        if part:
            part.write_text(json.dumps(found, indent=1) + "\n", "utf-8")
    print(json.dumps(found, indent=1) if options.json == "-" else table(found))
    return 0


def _palettes(words: Sequence[str]) -> int:
    """crayonize palettes [NAME]: list the boxes of crayons, or the crayons of one."""
    parser = Parser("crayonize palettes", "List the boxes of crayons, for --palette.")
    parser.add_argument("name", metavar="NAME", nargs="?", help="list the crayons of this one")
    name = parser.read(words).name
    from ..crayons.palette_files import load_palette, palette_names

    if name is None:
        return _list((row[0], f"{row[2]:3} crayons  {row[1]}") for row in palette_names())
    palette = load_palette(name)
    print(f"{palette.title}, {len(palette.crayons)} crayons")
    for crayon in palette.crayons:
        print(f"{swatch(crayon.hex)}{crayon.hex}  {crayon.name}")
    return 0


def _styles(words: Sequence[str]) -> int:
    """crayonize styles: list the ways to draw."""
    Parser(prog="crayonize styles", description="List the ways to draw, for --style.").read(words)
    from stroke_gen.params import style_names

    return _list(iter(style_names().items()))


def _papers(words: Sequence[str]) -> int:
    """crayonize papers: list the papers."""
    Parser(prog="crayonize papers", description="List the papers, for --paper.").read(words)
    import tomllib

    text = (Path(__file__).parents[1] / "data" / "papers.toml").read_text("utf-8")
    return _list((name, str(row["title"])) for name, row in tomllib.loads(text).items())


def _list(rows: Iterator[tuple[str, str]]) -> int:
    for name, text in rows:
        print(f"{name:12} {text}")
    return 0


COMMANDS: dict[str, Callable[[Sequence[str]], int]] = {
    "draw": _draw,
    "steps": _steps,
    "palettes": _palettes,
    "styles": _styles,
    "papers": _papers,
    "warmup": _warmup,
    "bench": _bench,
}
