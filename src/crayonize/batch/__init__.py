"""Folders of photos: each becomes a picture, none is lost, whatever happens on the way."""

import argparse
from collections.abc import Sequence

from ..settings import Settings
from .job import Recipe
from .options import Options, add_options, check_alone, inputs_and_output, options_of
from .run import run

__all__ = [
    "Options",
    "Recipe",
    "add_options",
    "check_alone",
    "inputs_and_output",
    "options_of",
    "run",
    "run_parsed",
]


def run_parsed(inputs: Sequence[str], output: str, parsed: argparse.Namespace, settings: Settings) -> int:
    """`run` with what the command line holds."""
    if parsed.strokes:
        raise ValueError("--strokes is for one photo")
    recipe = Recipe(settings, parsed.light, parsed.metadata, parsed.print, parsed.dpi, parsed.max_pixels,
                    parsed.max_bytes)  # fmt: skip
    return run(inputs, output, options_of(parsed), recipe)
