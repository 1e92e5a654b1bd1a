"""Folders of photos: each becomes a picture, none is lost, whatever happens on the way.

Importing this is cheap: the command line takes its options from here.
"""

import argparse
from collections.abc import Sequence

from ..settings import Settings
from .job import Recipe
from .options import Options, add_options, check_alone, inputs_and_output, options_of

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


def run(
    inputs: Sequence[str],
    output: str,
    options: Options,
    recipe: Recipe,
    *,
    render: str | None = None,
    memory_limit: int | None = None,
) -> int:
    """Draw all photos of folders or a list into a folder; returns the exit code.

    render: "module:function" in place of `api.sketch`, for tests.   memory_limit: bytes for all workers, in
    place of what the machine has. ValueError for what the caller can mend before anything is done, OSError if
    the output folder cannot be used, ImportError for an extra that is missing. 0 all done, 1 stopped, 3 some
    failed, 4 another run holds the folder, 128 + n stopped by signal n.
    """
    from . import conductor

    return conductor.run(inputs, output, options, recipe, render, memory_limit)


def run_parsed(inputs: Sequence[str], output: str, parsed: argparse.Namespace, settings: Settings) -> int:
    """`run` with what the command line holds."""
    if parsed.strokes:
        raise ValueError("--strokes is for one photo")
    recipe = Recipe(
        settings,
        parsed.light,
        parsed.metadata,
        parsed.print,
        parsed.dpi,
        parsed.max_pixels,
        parsed.max_bytes,
    )
    return run(inputs, output, options_of(parsed), recipe)
