"""The words of the command line that concern folders and lists of photos."""

import argparse
import os
import re
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path, PurePath
from typing import Any

from ..batch.job import MAX_BYTES, TIME_LIMIT, Recipe
from ..batch.options import EXISTING, FORMATS, Options
from ..machine.memory import MAX_PIXELS
from ..settings import Settings


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options that concern folders and lists of photos."""
    group = parser.add_argument_group(
        "folders", "Given a folder, or several photos and -o, all are drawn."
    )
    add = group.add_argument
    add("-o", "--output", metavar="FOLDER", help="where the pictures go; made if need be")
    add(
        "-j",
        "--jobs",
        type=_count,
        metavar="N",
        help="photos drawn at once (as cores and memory allow)",
    )
    add(
        "--existing",
        choices=EXISTING,
        default="auto",
        help="pictures already there: auto draws what has changed, so it goes on after a break "
        "(%(default)s)",
    )
    add("--format", choices=FORMATS, default="png", help="of the pictures (%(default)s)")
    add(
        "--name",
        default="{stem}",
        metavar="TEMPLATE",
        help='name of a picture, such as "{stem}.crayon", of {stem}, {name}, {suffix}, {parent}, '
        "{palette}, "
        "{paper}, {style}, {seed} (%(default)s)",
    )
    add(
        "--shard",
        type=_shard,
        metavar="I/N",
        help="only the I-th of N parts, for runs on several machines",
    )
    add("--dry-run", action="store_true", help="only tell what would be done")
    add(
        "--json",
        action="store_true",
        help="one JSON line a file on stdout, and one at the end that counts them",
    )
    add(
        "--watch",
        action="store_true",
        help="stay, and draw each photo that is put into the folder, until Ctrl-C",
    )
    add("--dask", metavar="URL", help="draw on this Dask cluster, such as tcp://scheduler:8786")
    add(
        "--max-pixels",
        type=_amount,
        default=MAX_PIXELS,
        metavar="N",
        help="refuse larger photos (250M)",
    )
    add(
        "--max-bytes", type=_amount, default=MAX_BYTES, metavar="N", help="refuse larger files (1G)"
    )
    add("--time-limit", type=_seconds, default=TIME_LIMIT, metavar="S",
        help="seconds one photo may take (%(default)g)")  # fmt: skip


def options_of(parsed: argparse.Namespace) -> Options:
    """The options among all that was parsed."""
    known: dict[str, Any] = {
        f.name: getattr(parsed, f.name) for f in fields(Options) if hasattr(parsed, f.name)
    }
    return Options(**known)


def inputs_and_output(paths: Sequence[str], output: str | None) -> tuple[list[str], str] | None:
    """What the names on a command line mean: photos and folders to be drawn into a folder, or None.

    None stands for one photo, with or without the name of its picture. ValueError if no folder for
    the pictures is named where one is needed.
    """
    if output is not None:
        named = len(paths) == 1 and not _is_folder(paths[0]) and not _is_folder(output)
        return None if named and PurePath(output).suffix else (list(paths), output)
    if len(paths) == 1 and not _is_folder(paths[0]):
        return None
    if len(paths) == 2 and not _is_folder(paths[0]) and not _is_folder(paths[1]):
        return None
    if len(paths) == 1:
        raise ValueError(f"{paths[0]!r} is a folder; name another one for its pictures")
    if len(paths) > 2 and not _is_folder(paths[-1]):
        raise ValueError(f"{paths[-1]!r} is no folder; name one for the pictures with -o FOLDER")
    return list(paths[:-1]), paths[-1]


def _is_folder(path: str) -> bool:
    """Whether a path is, or is meant as, a folder."""
    return path.endswith(("/", os.sep)) or "://" in path or Path(path).is_dir()


def recipe_of(parsed: argparse.Namespace, settings: Settings) -> Recipe:
    """How every photo is drawn, of all that was parsed."""
    return Recipe(
        settings,
        parsed.light,
        parsed.metadata,
        parsed.print,
        parsed.dpi,
        parsed.max_pixels,
        parsed.max_bytes,
    )


def check_alone(parsed: argparse.Namespace) -> None:
    """ValueError if one photo alone is given options that only mean something for folders."""
    parser = argparse.ArgumentParser(add_help=False)
    add_options(parser)
    for name, default in vars(parser.parse_args([])).items():
        if name != "output" and getattr(parsed, name) != default:
            raise ValueError(
                f"--{name.replace('_', '-')} is for folders, or several photos and -o FOLDER"
            )


def _count(text: str) -> int:
    if not text.isascii() or not text.isdigit() or not 1 <= int(text) <= 512:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number from 1 to 512")
    return int(text)


def _shard(text: str) -> tuple[int, int]:
    parts = re.fullmatch(r"(\d{1,6})/(\d{1,6})", text, re.ASCII)
    if not parts or not 1 <= int(parts[1]) <= int(parts[2]):
        raise argparse.ArgumentTypeError(f"{text!r} is not I/N with I from 1 to N, such as 2/8")
    return int(parts[1]), int(parts[2])


def _amount(text: str) -> int:
    parts = re.fullmatch(r"(\d{1,15})([kMG]?)", text, re.ASCII)
    if not parts:
        raise argparse.ArgumentTypeError(
            f"{text!r} is not a whole number, or one with k, M or G behind it"
        )
    return int(parts[1]) * {"": 1, "k": 10**3, "M": 10**6, "G": 10**9}[parts[2]]


def _seconds(text: str) -> float:
    try:
        seconds = float(text)
    except ValueError:
        seconds = 0
    if not 0 < seconds <= 1e6:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of seconds above 0")
    return seconds
