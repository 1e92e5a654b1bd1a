"""The words of the command line, and what each may be."""

import argparse
import os
import tomllib
from collections.abc import Sequence
from typing import Any, NoReturn

from stroke_gen.checks import did_you_mean, printable

from .. import __version__
from ..images import metadata, page
from ..settings import MEDIA, Settings
from . import folders

_COMMANDS_HELP = """\
other commands:
  crayonize draw DRAWING OUT        draw saved, hand-made or other programs' strokes (.json, .svg)
  crayonize steps DRAWING OUT.pdf   pages that show how to draw it, step by step
  crayonize palettes|styles|papers  list what there is
  crayonize warmup                  compile everything for this machine now
  crayonize bench                   measure how fast it is on this machine
"""


class Parser(argparse.ArgumentParser):
    """argparse, complaining in our way: by a ValueError of one line that names the nearest
    option.
    """

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
        actions = self._option_string_actions
        known = [option for option in actions if option.startswith("--")]
        words, names = _parted(words)
        named = [word.partition("=")[0] for word in words]
        for name in named:
            if name.startswith("--") and name not in known:
                raise ValueError(f"unknown option {printable(name)}{did_you_mean(name, known)}")
        options, rest = self.parse_known_intermixed_args([*words, *names])
        if rest:
            what = "is no option" if rest[0].startswith("-") else "is one too many"
            raise ValueError(f"{printable(rest[0])} {what}; see {self.prog} --help")
        _check_effects({actions[name].dest for name in named if name in actions}, options)
        return options


def _parted(words: Sequence[str]) -> tuple[list[str], list[str]]:
    """The words before `--`, and those behind it, which are names of files and look it."""
    at = words.index("--") if "--" in words else len(words)
    names = (f"./{name}" if name.startswith("-") else name for name in words[at + 1 :])
    return list(words[:at]), list(names)


_ONLY_WITH = {"seconds": "timelapse", "show_tip": "timelapse"}
_NOT_WITH = {"size": ("print", "dpi"), "sheet_mm": ("print",)}  # what settles it instead


def _check_effects(given: set[str], options: argparse.Namespace) -> None:
    """ValueError for an option that has been given and would change nothing."""
    for name, needed in _ONLY_WITH.items():
        if name in given and getattr(options, needed) is None:
            raise ValueError(f"{_option(name)} changes nothing without --{needed}")
    for name, others in _NOT_WITH.items():
        for other in others:
            if name in given and other in given:
                raise ValueError(f"{_option(name)} changes nothing: --{other} settles it")


def _option(dest: str) -> str:
    return "--sheet" if dest == "sheet_mm" else f"--{dest.replace('_', '-')}"


def photo_parser() -> Parser:
    parser = Parser("crayonize", "Draw a photo with wax crayons, stroke by stroke.", _COMMANDS_HELP)
    parser.add_argument("photo", metavar="PHOTO", help="JPEG, PNG, WebP, TIFF or AVIF")
    add = parser.add_argument
    add("out", metavar="OUT", nargs="?", help="PNG, JPEG, WebP or TIFF; else PHOTO.crayon.png")
    add("more", metavar="PHOTO", nargs="*", help=argparse.SUPPRESS)
    add(
        "--palette",
        default=Settings.palette,
        help="of `crayonize palettes`, a file, or #rrggbb,... (%(default)s)",
    )
    add(
        "--style",
        default=Settings.style,
        help="of `crayonize styles`, or a .toml file (%(default)s)",
    )
    add(
        "--paper",
        default=Settings.paper,
        help="of `crayonize papers`, or a picture of one (%(default)s)",
    )
    add(
        "--force",
        default=Settings.force,
        help="light, normal, heavy or a factor, 0.1 to 5 (%(default)s)",
    )
    add(
        "--medium",
        dest="physics",
        type=_medium,
        default="crayon",
        help="what is drawn with: crayon, oil-pastel or pencil (%(default)s)",
    )
    add("--set", dest="knobs", type=_knob, action="append", default=[], metavar="KEY=VALUE",
        help="a key of the style otherwise: lines=2, fill.legs=5; may be repeated")  # fmt: skip
    add("--age", type=_whole, help="of the one who draws in style child, 3 to 10")
    add("--left-handed", action="store_true", help="hatching leans the other way")
    add(
        "--seed",
        type=_seed,
        default=Settings.seed,
        help="a whole number, or `random` (%(default)s)",
    )
    add("--focus", type=_focus, action="append", default=[], metavar="X,Y,W,H",
        help="a part that deserves care, in fractions of the picture; may be repeated")  # fmt: skip
    add("--subject", default=Settings.subject, metavar="WHO",
        help="what is drawn with most care: auto, none, or a picture of it, white on black (auto)")
    add("--sheet", dest="sheet_mm", type=_sheet, default=Settings.sheet_mm, metavar="SIZE",
        help="long side of the sheet: a5, a4, 180mm; strokes keep their width (a5)")  # fmt: skip
    add("--print", type=str.lower, choices=page.PAGES, help="fill a page of this size")
    add("--dpi", type=_dpi, help="pixels to the inch, in place of --size (300 with --print)")
    add(
        "--metadata",
        choices=metadata.CHOICES,
        default="safe",
        help="what the photo tells of itself: safe keeps title, names, date, but no place "
        "(%(default)s)",
    )
    _add_beside(parser)
    _add_size(parser)
    add_talk(parser)
    folders.add_options(parser)
    add("--version", action="version", version=f"crayonize {__version__}")
    return parser


def drawing_parser() -> Parser:
    parser = Parser("crayonize draw", "Draw saved or hand-made strokes.")
    parser.add_argument("drawing", metavar="DRAWING", help="a .json or .svg file of strokes")
    parser.add_argument("out", metavar="OUT", help="PNG, JPEG, WebP or TIFF")
    add_strokes(parser)
    _add_beside(parser)
    _add_size(parser)
    add_talk(parser)
    return parser


def add_strokes(parser: Parser) -> None:
    add = parser.add_argument
    add("--palette", help="in place of the drawing's own; for a .svg else box24")
    add("--paper", help="in place of the drawing's own; for a .svg else drawing")
    add(
        "--widths",
        choices=("tip", "force"),
        default="tip",
        help="what line width becomes, of a .svg (%(default)s)",
    )


def _add_beside(parser: Parser) -> None:
    add = parser.add_argument
    add(
        "--strokes",
        metavar="FILE",
        help="save the strokes: .json for `crayonize draw`, .svg for other programs",
    )
    add(
        "--timelapse",
        metavar="FILE",
        help="film the drawing being drawn: .webp, .gif, .png or .mp4",
    )
    add("--seconds", type=float, default=12.0, help="length of the film (%(default)g)")
    add("--show-tip", action="store_true", help="with the crayon in the film")
    add(
        "--legend",
        action="store_true",
        help="put the crayons used, and how much of each, beside the drawing",
    )


def _add_size(parser: Parser) -> None:
    add = parser.add_argument
    add(
        "--size",
        type=_whole,
        default=Settings.size,
        help="long side in pixels, 1 to 20000 (%(default)s)",
    )
    add(
        "--threads",
        type=_whole,
        help="at most so many at once; the picture stays the same (all cores)",
    )
    add("--preview", action="store_true", help="quick: half the size")
    add("--no-light", dest="light", action="store_false", help="no shading of the relief")


def add_talk(parser: Parser) -> None:
    loudness = parser.add_mutually_exclusive_group()
    loudness.add_argument("-q", "--quiet", action="store_true", help="say nothing but errors")
    loudness.add_argument("-v", "--verbose", action="count", default=0, help="tell seed and time")


def _medium(word: str) -> str:
    """The constants of what is drawn with, by the name that a user has for it."""
    if word not in MEDIA:
        raise argparse.ArgumentTypeError(f"{word!r} is no medium{did_you_mean(word, MEDIA)}")
    return MEDIA[word]


def _knob(text: str) -> tuple[str, Any]:
    """A key of a style and its value as TOML has it, or as the word it is."""
    key, equals, value = text.partition("=")
    if not equals or not key:
        raise argparse.ArgumentTypeError(f"{text!r} is not KEY=VALUE, such as lines=2")
    try:
        return key, tomllib.loads(f"value = {value}")["value"]
    except (ValueError, RecursionError):
        return key, value


def _whole(text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number") from None


def _sheet(text: str) -> float:
    """Long side in mm of a sheet given by the name of a page or in mm."""
    name = text.lower()
    if name in page.PAGES:
        return page.PAGES[name][1]
    try:
        sheet_mm = float(name.removesuffix("mm"))
    except ValueError:
        sheet_mm = 0
    if not 10 <= sheet_mm <= 5000:
        raise argparse.ArgumentTypeError(
            f"{text!r} is neither a page ({', '.join(page.PAGES)}) nor 10mm to 5000mm"
        )
    return sheet_mm


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
        raise argparse.ArgumentTypeError(
            f"{text!r} is not x,y,w,h in fractions of the picture"
        ) from None
