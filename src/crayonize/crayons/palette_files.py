"""Palettes from files and words: the shipped ones, a user's own JSON, GIMP or text file, or a list
of colours.

No numpy here: the command line lists palettes without waiting for it.
"""

import itertools
import json
import os
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from stroke_gen import checks, files
from stroke_gen.checks import did_you_mean, of_kind, printable, quoted, shown

from ..images.srgb import is_hex
from .palette import Crayon, Palette, plain
from .pigment import colour_crayon, default_hiding, layer_crayon

MAX_CRAYONS = 254
MAX_FILE_BYTES = 1_000_000

_DATA = Path(__file__).parents[1] / "data" / "palettes"
_DEFAULT_FILM_UM = 15.0
_MAX_NAME = 60

_PALETTE_KEYS = ("name", "title", "source", "film_um", "layer_films", "crayons")
_COLOUR_KEYS = ("name", "hex", "hiding")
_LAYER_KEYS = ("name", "rgb", "t", "s", "table2")


def palette_names() -> list[tuple[str, str, int]]:
    """The shipped palettes as (name, title, number of crayons), in order of name and number."""
    listed = []
    for name in _shipped():
        data = json.loads((_DATA / f"{name}.json").read_text(encoding="utf-8"))
        listed.append((name, str(data["title"]), len(data["crayons"])))
    return listed


def load_palette(source: "str | os.PathLike[str] | dict[str, Any] | Palette") -> Palette:
    """A palette by the name of a shipped one, from a user's file, from a list of colours or from an
    object.

    source: a shipped name ("box24"); a path ending in .json (the format of the shipped ones), .gpl
    (GIMP), .txt or .hex (one #rrggbb a line, a name after it if you like, comments begin with "#
    "); a list "#ff0000,#00ff00 grass" or "#ff0000 #00ff00"; the content of a palette .json as a
    dict; a Palette, handed back as it is.

    Crayon names are put in lower case with single spaces; a colour without a name is called by its
    #rrggbb. A colour without hiding gets one from its lightness and chroma, see `default_hiding`.
    As no wax is perfectly black or white, its linear channels are kept within 0.005 to 0.985 (about
    #101010 to #fdfdfd).

    ValueError, one line, naming the file and the line or JSON path, what is wrong and what would be
    right.
    """
    if isinstance(source, Palette):
        return source
    if isinstance(source, dict):
        return _from_object(source, "palette", "custom")
    if isinstance(source, os.PathLike):
        return _from_file(Path(source), printable(os.fspath(source)))
    text = of_kind(str, source, "palette", "a name, a file, a list of colours or an object")
    if text in _shipped():
        return _from_file(_DATA / f"{text}.json", text)
    if text.lstrip().startswith("#"):
        return _from_list(text)
    return _from_file(Path(text), printable(text))


def is_file(source: str) -> bool:
    """Whether a word stands for a file: neither a shipped palette nor a list of colours."""
    return source not in _shipped() and not source.lstrip().startswith("#")


def told(source: str | dict[str, Any]) -> str | dict[str, Any]:
    """What a drawing says of its palette, so that it can be drawn elsewhere: in place of a file its
    content.
    """
    if isinstance(source, dict) or not is_file(source):
        return source
    palette = load_palette(source)
    path, where = Path(source), printable(source)
    if path.suffix.lower() == ".json":
        content: dict[str, Any] = checks.parsed_json(_text_of(path, where), where, "palette")
        return {"name": palette.name, **content}
    crayons = [{"name": crayon.name, "hex": crayon.hex} for crayon in palette.crayons]
    return {"name": palette.name, "crayons": crayons}


# ---- reading -------------------------------------------------------------------------------------


def _shipped() -> list[str]:
    def by_number(name: str) -> tuple[str, int]:
        word = name.rstrip("0123456789")
        return word, int(name[len(word) :] or 0)

    return sorted((path.stem for path in _DATA.glob("*.json")), key=by_number)


def _from_file(path: Path, where: str) -> Palette:
    readers: dict[str, Callable[[str, str, str], Palette]] = {
        ".json": _from_json_text,
        ".gpl": _from_gimp_text,
        ".txt": _from_hex_text,
        ".hex": _from_hex_text,
    }
    reader = readers.get(path.suffix.lower())
    if reader is None:
        if not path.exists():
            near = did_you_mean(path.name, _shipped())
            raise ValueError(
                f"palette {quoted(where, 200)}: neither a shipped palette nor a file{near}"
            )
        raise ValueError(f"{where}: a palette file ends in .json, .gpl, .txt or .hex")
    return reader(_text_of(path, where), where, printable(path.stem))


def _text_of(path: Path, where: str) -> str:
    try:
        raw = files.read_bytes(path, MAX_FILE_BYTES, "a palette file")
    except ValueError as error:
        raise ValueError(f"{where}: {error}") from error
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        if b"\0" not in raw and path.suffix.lower() != ".json":
            return raw.decode("latin-1")  # as older programs wrote it
        line = raw[: error.start].count(b"\n") + 1
        raise ValueError(f"{where}: line {line}: not UTF-8 text") from error


def _from_json_text(text: str, where: str, stem: str) -> Palette:
    data = of_kind(
        dict, checks.parsed_json(text, where, "palette"), where, 'an object like {"crayons": [...]}'
    )
    return _from_object(data, where, stem)


def _from_object(data: dict[str, Any], where: str, stem: str) -> Palette:
    checks.keys(data, _PALETTE_KEYS, where)
    crayons = of_kind(
        list, data.get("crayons"), f"{where}: crayons", 'a list like [{"hex": "#ff0000"}]'
    )
    _check_count(len(crayons), where)
    film_um = checks.number(data.get("film_um", _DEFAULT_FILM_UM), 0.1, 200.0, f"{where}: film_um")
    layer_um = film_um * checks.number(
        data.get("layer_films", 1.0), 0.1, 10.0, f"{where}: layer_films"
    )
    name = checks.text(data["name"], _MAX_NAME, f"{where}: name") if "name" in data else stem
    made = [
        _crayon(one, film_um, layer_um, f"{where}: crayons[{i}]") for i, one in enumerate(crayons)
    ]
    places = [f"{where}: crayons[{i}].name" for i in range(len(made))]
    return Palette(
        name=name,
        title=checks.text(data["title"], _MAX_NAME, f"{where}: title") if "title" in data else name,
        source=checks.text(data.get("source", ""), 1000, f"{where}: source"),
        film_um=film_um,
        crayons=_all_different(made, places),
    )


def _crayon(given: Any, film_um: float, layer_um: float, where: str) -> Crayon:
    data = of_kind(dict, given, where, 'an object like {"name": "red", "hex": "#ff0000"}')
    by_layer = "hex" not in data and "rgb" in data
    checks.keys(data, _LAYER_KEYS if by_layer else _COLOUR_KEYS, where)
    if by_layer:
        return _layer_crayon(data, film_um, layer_um, where)
    if "hex" not in data:
        raise ValueError(f'{where}: "hex" is missing, give the colour as "#rrggbb"')
    colour = _colour(data["hex"], f"{where}.hex")
    name = _crayon_name(data.get("name", colour), f"{where}.name")
    if "hiding" not in data:
        return colour_crayon(name, colour, default_hiding(colour), film_um)
    return colour_crayon(
        name, colour, checks.number(data["hiding"], 0.01, 0.99, f"{where}.hiding"), film_um
    )


def _layer_crayon(data: dict[str, Any], film_um: float, layer_um: float, where: str) -> Crayon:
    """A crayon as in the 2003 paper: sRGB colour rgb (0..1), transmittance t and reflectance s of a
    layer.
    """
    for key in ("name", "t", "s"):
        if key not in data:
            raise ValueError(
                f"{where}: {quoted(key)} is missing, a crayon with rgb needs name, t and s"
            )
    rgb = data["rgb"]
    if not isinstance(rgb, list) or len(rgb) != 3:
        raise ValueError(f"{where}.rgb: {shown(rgb)} is not a list of three numbers from 0 to 1")
    colour = [checks.number(value, 0.0, 1.0, f"{where}.rgb[{i}]") for i, value in enumerate(rgb)]
    t = checks.number(data["t"], 0.001, 0.999, f"{where}.t")
    s = checks.number(data["s"], 0.001, 0.999, f"{where}.s")
    if t + s >= 1:
        raise ValueError(
            f"{where}: t + s = {t + s:g}, a layer cannot send out more light than it gets (below 1)"
        )
    name = _crayon_name(data["name"], f"{where}.name")
    return layer_crayon(name, colour, t, s, film_um, layer_um)


def _from_gimp_text(text: str, where: str, stem: str) -> Palette:
    """GIMP's palette text: `GIMP Palette`, lines like `Name:` or `Channels: RGBA` and comments
    after `#`, then `R G B name` lines, with A before the name if the channels are RGBA.
    """
    lines = text.splitlines()
    if not lines or lines[0].strip() != "GIMP Palette":
        raise ValueError(f'{where}: line 1: a .gpl file begins with "GIMP Palette"')
    title, found, channels = stem, [], 3
    for number, line in enumerate(lines[1:], start=2):
        line = line.strip()
        if line.startswith("Name:"):
            title = (
                checks.text(
                    line.removeprefix("Name:").strip(), _MAX_NAME, f"{where}: line {number}"
                )
                or stem
            )
        elif re.match(r"Channels:\s*RGBA\b", line):
            channels = 4
        elif line and not re.match(r"#|[A-Za-z]+:", line):
            place = f"{where}: line {number}"
            found.append((place, *_gimp_colour(line, channels, place)))
    return _from_colours(found, where, stem, title)


def _gimp_colour(line: str, channels: int, where: str) -> tuple[str, str]:
    words = line.split(maxsplit=channels)
    if len(words) < channels or not all(
        re.fullmatch("[0-9]{1,3}", word) and int(word) <= 255 for word in words[:3]
    ):
        raise ValueError(f"{where}: {quoted(line)} does not begin with three numbers from 0 to 255")
    name = "".join(words[channels:]).strip()
    name = "" if name.lower() == "untitled" else name
    return "#{:02x}{:02x}{:02x}".format(*map(int, words[:3])), name


def _from_hex_text(text: str, where: str, stem: str) -> Palette:
    found = []
    for number, line in enumerate(text.splitlines(), start=1):
        line, place = line.strip(), f"{where}: line {number}"
        if line and line != "#" and not line.startswith(("# ", "#\t", "##", ";")):
            found += [(place, *_hex_item(item, place)) for item in _items(line)]
    return _from_colours(found, where, stem, stem)


def _from_list(text: str) -> Palette:
    where = "palette list"
    items = [item for part in text.split(",") for item in _items(part.strip())]
    _check_count(len(items), where)
    found = [
        (f"{where}: item {i}", *_hex_item(item, f"{where}: item {i}"))
        for i, item in enumerate(items, 1)
    ]
    return _from_colours(found, where, "custom", "list of colours")


def _items(line: str) -> list[str]:
    """The colours of a line: several may stand in one, each with its #."""
    return re.split(r"\s+(?=#[0-9a-fA-F]{6}(?:\s|$))", line)


def _hex_item(text: str, where: str) -> tuple[str, str]:
    """`#rrggbb`, a name after it if any, and a comment after that (` # ...`); the first # may be
    left out, and aarrggbb is what Paint.NET writes.
    """
    words = text.split(" #", 1)[0].split(maxsplit=1)
    word = words[0] if words else ""
    if re.fullmatch("[0-9a-fA-F]{8}", word):
        word = word[2:]
    if not is_hex(word):
        raise ValueError(f'{where}: {quoted(word)} is not #rrggbb (a comment begins with "# ")')
    return "#" + word[-6:], words[1] if len(words) == 2 else ""


def _from_colours(
    found: Sequence[tuple[str, str, str]], where: str, stem: str, title: str
) -> Palette:
    """A palette of bare colours: (where it stands, #rrggbb, name or "") each.

    A colour that comes again is the same crayon; a name that comes again is numbered.
    """
    crayons: dict[str, Crayon] = {}
    for place, given, name in found:
        colour = given.lower()
        named = _crayon_name(name or colour, place)
        if colour not in crayons:
            named = _numbered(named, {crayon.name for crayon in crayons.values()})
            hiding = default_hiding(colour)
            crayons[colour] = colour_crayon(named, colour, hiding, _DEFAULT_FILM_UM)
    _check_count(len(crayons), where)
    made = tuple(crayons.values())
    return Palette(stem, title, f"colours of {where}", _DEFAULT_FILM_UM, made)


def _numbered(name: str, taken: set[str]) -> str:
    """The name, or the first of `name 2`, `name 3`, ... that is free."""
    tries = itertools.chain([name], (f"{name} {n}" for n in itertools.count(2)))
    return next(one for one in tries if one not in taken)


# ---- checks --------------------------------------------------------------------------------------


def _check_count(count: int, where: str) -> None:
    if not 1 <= count <= MAX_CRAYONS:
        raise ValueError(f"{where}: {count} crayons, a palette has 1 to {MAX_CRAYONS}")


def _all_different(crayons: Sequence[Crayon], places: Sequence[str]) -> tuple[Crayon, ...]:
    seen: set[str] = set()
    for crayon, place in zip(crayons, places, strict=True):
        if crayon.name in seen:
            raise ValueError(
                f"{place}: a second crayon {quoted(crayon.name)}, give each its own name"
            )
        seen.add(crayon.name)
    return tuple(crayons)


def _colour(value: Any, where: str) -> str:
    if not isinstance(value, str) or not value.startswith("#") or not is_hex(value):
        raise ValueError(f"{where}: {shown(value)} is not #rrggbb")
    return value.lower()


def _crayon_name(value: Any, where: str) -> str:
    name = plain(checks.text(value, _MAX_NAME, where))
    if not name:
        raise ValueError(f'{where}: the name is empty, give one like "red"')
    return name
