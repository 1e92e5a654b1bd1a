"""Which version of the program made something: a short name for the source it depends on.

A version number would have to be thought of with every change of the wax; the source cannot be
forgotten.
"""

import functools
import hashlib
from collections.abc import Iterable
from pathlib import Path

import stroke_gen

_HERE = Path(__file__).parents[1]
_GENERATOR = Path(stroke_gen.__file__).parent


@functools.cache
def of_the_wax() -> str:
    """Of all that says what a crayon leaves on paper, and how that looks."""
    return hash_of(_in(_HERE / "wax", _HERE / "light", _HERE / "crayons"))


@functools.cache
def of_drawings() -> str:
    """Of all that shapes a drawing: the wax, the stroke generator, papers and palettes."""
    rooms = (_HERE / "wax", _HERE / "light", _HERE / "crayons", _HERE / "data", _GENERATOR)
    return hash_of(_in(*rooms))


def hash_of(files: Iterable[Path]) -> str:
    """A short name for the content of files, in whatever order and wherever they lie."""
    hashes = sorted(hashlib.sha256(file.read_bytes()).digest() for file in files)
    return hashlib.sha256(b"".join(hashes)).hexdigest()[:12]


def _in(*rooms: Path) -> list[Path]:
    kinds = (".py", ".toml", ".json")
    return [file for room in rooms for file in room.rglob("*") if file.suffix in kinds]
