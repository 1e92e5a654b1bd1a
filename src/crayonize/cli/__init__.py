"""The command `crayonize`: options in, one picture out, errors as one line.

The first word chooses: draw, steps, palettes, styles, papers, warmup or bench; anything else is a photo. Only
here is anything printed: what was asked for on stdout, all else on stderr. `--help` and the listings load
neither numpy nor numba, so imports of anything heavy stand inside functions.

Exit codes: 0 done; 1 stopped (an output cannot be written, an error of ours); 2 the command line, or a file
it names, cannot be used; 3 an extra package is missing; 130 Ctrl-C; 143 terminated.
"""

import argparse
import atexit
import gc
import os
import signal
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from stroke_gen.checks import did_you_mean, printable

from .. import __version__
from ..batch.options import add_options as add_folder_options
from ..images import metadata, page
from ..settings import Settings

if TYPE_CHECKING:
    from stroke_gen.drawing import Drawing

    from ..api import Progress
    from ..pipeline import Easel

_COMMANDS_HELP = """\
other commands:
  crayonize draw DRAWING OUT        draw saved, hand-made or other programs' strokes (.json, .svg)
  crayonize steps DRAWING OUT.pdf   pages that show how to draw it, step by step
  crayonize palettes|styles|papers  list what there is
  crayonize warmup                  compile everything for this machine now
  crayonize bench                   measure how fast it is on this machine
"""


def main(words: Sequence[str] | None = None) -> int:
    """Run the command; returns its exit code."""
    words = list(sys.argv[1:] if words is None else words)
    atexit.register(gc.freeze)  # what is left at the end goes as a whole; to look through it first takes 0.2 s
    with suppress(ValueError):  # not in the main thread
        signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")
    try:
        command = COMMANDS.get(words[0]) if words else None
        code = command(words[1:]) if command else _convert(words)
        sys.stdout.flush()
        return code
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:  # the reader of a listing has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except Exception as error:
        if words.count("-v") + 2 * words.count("-vv") > 1:
            raise
        code, line = _verdict(error)
        print(f"crayonize: {_one_line(line)}", file=sys.stderr)
        return code


def _verdict(error: Exception) -> tuple[int, str]:
    """Exit code and message for an error."""
    if _lacks_package(error):
        return 3, str(error)
    if isinstance(error, ValueError):
        return 2, str(error)
    if isinstance(error, MemoryError):
        return 1, "there is not enough memory; choose a smaller --size"
    if isinstance(error, OSError):
        name = "" if error.filename is None else f"{os.fsdecode(error.filename)}: "
        return 1, f"{name}{error.strerror or error}"
    return 1, f"this should not have happened ({type(error).__name__}: {error}); -v -v shows where"


def _lacks_package(error: BaseException | None) -> bool:
    """Whether an error goes back to a package that is not installed."""
    while error is not None and not isinstance(error, ImportError):
        error = error.__cause__
    return error is not None


def _one_line(text: str) -> str:
    return printable(" ".join(text.split()))


# ---- the commands ----------------------------------------------------------------------------------------


def _convert(words: Sequence[str]) -> int:
    """crayonize PHOTO [OUT]: draw a photo. With folders, or several photos and -o: all of them."""
    options = _convert_parser().read(words)
    begun = time.monotonic()

    from stroke_gen import params

    from .. import api, batch
    from ..crayons.palette import load_palette

    paths = [path for path in (options.photo, options.out, *options.more) if path is not None]
    folders = batch.inputs_and_output(paths, options.output)
    chosen = {f.name: getattr(options, f.name) for f in fields(Settings) if f.name in options}
    settings = api.settings_of(chosen | {"focus": tuple(options.focus)})
    load_palette(settings.palette)
    params.with_force(params.load_style(settings.style), settings.force)
    if folders:
        if options.timelapse or options.legend:
            raise ValueError("--timelapse and --legend are for one photo")
        return batch.run_parsed(*folders, options, settings)

    photo = Path(options.photo)
    out = options.out or options.output or photo.with_name(f"{photo.stem}.crayon.png")
    batch.check_alone(options)
    api.check_outputs([photo, *api.used_files(settings)], out, options.strokes, options.timelapse)
    if options.out is not None:
        _spare_photo(options.out)
    settings = page.fitted_to(settings, options.print, options.dpi, photo)
    with _talk(options) as progress:
        with api.filming(options.timelapse, options.seconds, options.show_tip, options.light) as watch:
            drawing, easel = api.sketch(options.photo, settings, progress, watch)
        kept = metadata.kept_of(photo, options.metadata)
        api.finish(drawing, easel, out, options.strokes, light=options.light, settings=settings, kept=kept,
                   legend=options.legend)  # fmt: skip
    if options.verbose or (options.out is None and not options.quiet):
        _report(out, easel, len(drawing.strokes), drawing.seed, begun)
    return 0


def _spare_photo(out: str) -> None:
    """ValueError if what is to be written over may be a photo: `crayonize *.jpg` can come to two names."""
    from ..images.write import holds_other_picture

    if holds_other_picture(out):
        advice = f"to draw it too, name a folder with -o; to replace it, say -o {out}"
        raise ValueError(f"{out}: is a picture that was not drawn here; {advice}")


def _draw(words: Sequence[str]) -> int:
    """crayonize draw DRAWING OUT: render strokes."""
    options = _draw_parser().read(words)
    begun = time.monotonic()

    from .. import api

    api.check_outputs([options.drawing], options.out, options.strokes, options.timelapse)
    with _talk(options) as progress:
        given = _strokes(options)
        with api.filming(options.timelapse, options.seconds, options.show_tip, options.light) as watch:
            drawing, easel = api.redraw(given, options.size, options.threads, options.preview, progress, watch=watch)
        api.finish(drawing, easel, options.out, options.strokes, light=options.light, legend=options.legend)
    if options.verbose:
        _report(options.out, easel, len(drawing.strokes), drawing.seed, begun)
    return 0


def _steps(words: Sequence[str]) -> int:
    """crayonize steps DRAWING OUT: pages to draw it after."""
    parser = _Parser("crayonize steps", "Make pages that show how to draw it: the outline, then crayon by crayon.")
    parser.add_argument("drawing", metavar="DRAWING", help="a .json or .svg file of strokes")
    parser.add_argument("out", metavar="OUT", help="a .pdf, a .png (pages are numbered), or a folder for .png pages")
    _add_strokes(parser)
    _add_talk(parser)
    options = parser.read(words)

    from .. import api

    with _talk(options) as progress:
        api.save_steps(_strokes(options), options.out, progress)
    return 0


def _strokes(options: argparse.Namespace) -> "Drawing":
    """The drawing that the command line names."""
    import logging

    from .. import api

    say = logging.getLogger("crayonize").info
    return api.load_strokes(
        options.drawing, palette=options.palette, paper=options.paper, widths=options.widths, say=say
    )


def _warmup(words: Sequence[str]) -> int:
    """crayonize warmup: fill the compile cache."""
    parser = _Parser(prog="crayonize warmup", description="Compile everything for this machine, and keep it.")
    _add_talk(parser)
    options = parser.read(words)
    begun = time.monotonic()

    from .. import api

    with _talk(options):
        api.warm_up()
    if not options.quiet:
        print(f"crayonize: ready after {time.monotonic() - begun:.1f} s", file=sys.stderr)
    return 0


def _bench(words: Sequence[str]) -> int:
    """crayonize bench: measure, and print a table."""
    parser = _Parser("crayonize bench", "Measure how fast it is on this machine; takes some minutes.")
    parser.add_argument("--json", metavar="FILE", help="write all figures there; - writes them to stdout, and no table")
    parser.add_argument("--quick", action="store_true", help="half a minute: smaller pictures, each measured once")
    _add_talk(parser)
    options = parser.read(words)

    import json

    from stroke_gen.files import whole_file

    from ..bench import parts as bench

    aside = options.json is not None and options.json != "-"
    with whole_file(options.json) if aside else nullcontext() as part, _talk(options) as progress:
        if part:
            part.touch()  # better now than after some minutes
        found = bench.measure(options.quick, progress)
        if part:
            part.write_text(json.dumps(found, indent=1) + "\n", "utf-8")
    print(json.dumps(found, indent=1) if options.json == "-" else bench.table(found))
    return 0


def _palettes(words: Sequence[str]) -> int:
    """crayonize palettes: list the boxes of crayons."""
    _Parser(prog="crayonize palettes", description="List the boxes of crayons, for --palette.").read(words)
    from ..crayons.palette import palette_names

    return _list((name, f"{number:3} crayons  {title}") for name, title, number in palette_names())


def _styles(words: Sequence[str]) -> int:
    """crayonize styles: list the ways to draw."""
    _Parser(prog="crayonize styles", description="List the ways to draw, for --style.").read(words)
    from stroke_gen.params import style_names

    return _list(iter(style_names().items()))


def _papers(words: Sequence[str]) -> int:
    """crayonize papers: list the papers."""
    _Parser(prog="crayonize papers", description="List the papers, for --paper.").read(words)
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


# ---- what is said ----------------------------------------------------------------------------------------


@contextmanager
def _talk(options: argparse.Namespace) -> Iterator["Progress"]:
    """The progress line, and our own messages, on stderr; with -q nothing, and warnings only with -v."""
    import logging
    import warnings

    from .bar import Bar

    with Bar(shown=not options.quiet) as bar, warnings.catch_warnings():

        class Messages(logging.Handler):
            def emit(self, record: logging.LogRecord) -> None:
                bar.clear()
                print(f"crayonize: {record.getMessage()}", file=sys.stderr, flush=True)

        log, messages = logging.getLogger("crayonize"), Messages()
        if not options.verbose:
            warnings.simplefilter("ignore")
        if not options.quiet:
            log.addHandler(messages)
            log.setLevel(logging.INFO)
        try:
            yield bar
        finally:
            log.removeHandler(messages)


def _report(out: str | Path, easel: "Easel", strokes: int, seed: int, begun: float) -> None:
    """What was done, for -v and where the name of the output was ours to choose."""
    size = f"{easel.sheet.cols} x {easel.sheet.rows} pixels"
    figures = f"{size}, {strokes} strokes, seed {seed}, {time.monotonic() - begun:.1f} s"
    print(f"crayonize: {printable(os.fspath(out))}: {figures}", file=sys.stderr)


# ---- the options -----------------------------------------------------------------------------------------


class _Parser(argparse.ArgumentParser):
    """argparse, complaining in our way: by a ValueError of one line that names the nearest option."""

    def __init__(self, prog: str, description: str, epilog: str = "") -> None:
        super().__init__(
            prog=prog,
            description=description,
            epilog=epilog,
            allow_abbrev=False,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )

    def error(self, message: str) -> NoReturn:
        raise ValueError(f"{message}; see {self.prog} --help")

    def read(self, words: Sequence[str]) -> argparse.Namespace:
        """The options, in any order with the names of files."""
        known = [option for option in self._option_string_actions if option.startswith("--")]
        for word in words[: words.index("--")] if "--" in words else words:
            name = word.partition("=")[0]
            if name.startswith("--") and name not in known:
                raise ValueError(f"unknown option {printable(name)}{did_you_mean(name, known)}")
        options, rest = self.parse_known_intermixed_args(words)
        if rest:
            what = "is no option" if rest[0].startswith("-") else "is one too many"
            raise ValueError(f"{printable(rest[0])} {what}; see {self.prog} --help")
        return options


def _convert_parser() -> _Parser:
    parser = _Parser("crayonize", "Draw a photo with wax crayons, stroke by stroke.", _COMMANDS_HELP)
    parser.add_argument("photo", metavar="PHOTO", help="JPEG, PNG, WebP, TIFF or AVIF")
    add = parser.add_argument
    add("out", metavar="OUT", nargs="?", help="PNG, JPEG, WebP or TIFF; else PHOTO.crayon.png")
    add("more", metavar="PHOTO", nargs="*", help=argparse.SUPPRESS)
    add("--palette", default=Settings.palette, help="of `crayonize palettes`, a file, or #rrggbb,... (%(default)s)")
    add("--style", default=Settings.style, help="of `crayonize styles`, or a .toml file (%(default)s)")
    add("--paper", default=Settings.paper, help="of `crayonize papers`, or a picture of one (%(default)s)")
    add("--force", default=Settings.force, help="light, normal, heavy or a factor, 0.1 to 5 (%(default)s)")
    add("--age", type=_whole, help="of the one who draws in style child, 3 to 10")
    add("--left-handed", action="store_true", help="hatching leans the other way")
    add("--seed", type=_seed, default=Settings.seed, help="a whole number, or `random` (%(default)s)")
    add("--focus", type=_focus, action="append", default=[], metavar="X,Y,W,H",
        help="a part that deserves care, in fractions of the picture; may be repeated")  # fmt: skip
    add("--print", choices=page.PAGES, help="fill a page of this size")
    add("--dpi", type=_dpi, help="pixels to the inch, in place of --size (300 with --print)")
    add("--metadata", choices=metadata.CHOICES, default="safe",
        help="what the photo tells of itself: safe keeps title, names, date, but no place (%(default)s)")  # fmt: skip
    _add_beside(parser)
    _add_size(parser)
    _add_talk(parser)
    add_folder_options(parser)
    add("--version", action="version", version=f"crayonize {__version__}")
    return parser


def _draw_parser() -> _Parser:
    parser = _Parser("crayonize draw", "Draw saved or hand-made strokes.")
    parser.add_argument("drawing", metavar="DRAWING", help="a .json or .svg file of strokes")
    parser.add_argument("out", metavar="OUT", help="PNG, JPEG, WebP or TIFF")
    _add_strokes(parser)
    _add_beside(parser)
    _add_size(parser)
    _add_talk(parser)
    return parser


def _add_strokes(parser: _Parser) -> None:
    add = parser.add_argument
    add("--palette", help="in place of the drawing's own; for a .svg else box24")
    add("--paper", help="in place of the drawing's own; for a .svg else drawing")
    add("--widths", choices=("tip", "force"), default="tip", help="what line width becomes, of a .svg (%(default)s)")


def _add_beside(parser: _Parser) -> None:
    add = parser.add_argument
    add("--strokes", metavar="FILE", help="save the strokes: .json for `crayonize draw`, .svg for other programs")
    add("--timelapse", metavar="FILE", help="film the drawing being drawn: .webp, .gif, .png or .mp4")
    add("--seconds", type=float, default=12.0, help="length of the film (%(default)g)")
    add("--show-tip", action="store_true", help="with the crayon in the film")
    add("--legend", action="store_true", help="put the crayons used, and how much of each, beside the drawing")


def _add_size(parser: _Parser) -> None:
    add = parser.add_argument
    add("--size", type=_whole, default=Settings.size, help="long side in pixels, 1 to 20000 (%(default)s)")
    add("--threads", type=_whole, help="at most so many at once; the picture stays the same (all cores)")
    add("--preview", action="store_true", help="quick: half the size")
    add("--no-light", dest="light", action="store_false", help="no shading of the relief")


def _add_talk(parser: _Parser) -> None:
    loudness = parser.add_mutually_exclusive_group()
    loudness.add_argument("-q", "--quiet", action="store_true", help="say nothing but errors")
    loudness.add_argument("-v", "--verbose", action="count", default=0, help="tell seed and time")


def _whole(text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number") from None


def _dpi(text: str) -> float:
    try:
        dpi = float(text)
    except ValueError:
        dpi = 0
    if not 1 <= dpi <= 4800:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number from 1 to 4800")
    return dpi


def _seed(text: str) -> int:
    if text == "random":
        return int.from_bytes(os.urandom(4))
    return _whole(text)


def _focus(text: str) -> tuple[float, ...]:
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not x,y,w,h in fractions of the picture") from None
