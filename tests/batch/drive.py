"""Runs a batch as the command does, with the stand-in for the sketcher: drive.py INPUT...

-o OUTPUT ...
"""

import argparse
import sys

from crayonize.batch import crew
from crayonize.batch.conductor import run
from crayonize.batch.job import Recipe
from crayonize.cli import folders
from crayonize.settings import Settings

if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("inputs", nargs="+")
    parser.add_argument("-q", "--quiet", action="store_true")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--metadata", default="safe")
    parser.add_argument("--memory", type=int)
    parser.add_argument("--grace", type=float, default=crew.GRACE)
    parser.add_argument("--render", default="stand_in:sketch")
    folders.add_options(parser)
    words = parser.parse_args()
    crew.GRACE = words.grace
    recipe = Recipe(
        Settings(size=64, seed=words.seed),
        metadata=words.metadata,
        max_pixels=words.max_pixels,
        max_bytes=words.max_bytes,
    )
    try:
        sys.exit(run(words.inputs, words.output, folders.options_of(words), recipe,
                           render=words.render, memory_limit=words.memory))  # fmt: skip
    except (ValueError, OSError) as error:
        print(f"crayonize: {error}", file=sys.stderr)
        sys.exit(2 if isinstance(error, ValueError) else 1)
