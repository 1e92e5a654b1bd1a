"""Styles: every knob of the generator, with unit, range, effect and starting value.

A style is a TOML file with these keys; the shipped ones lie in stroke_gen/styles, and `extends =
"artist"` takes from one of them what a file does not say. Lengths are in mm
on the sheet or in widths of the tip ("tips").
"""

import difflib
import functools
import tomllib
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Annotated, Any, get_type_hints

from . import checks, files
from .checks import did_you_mean, of_kind, shown

_FOLDER = Path(__file__).with_name("styles")
_MAX_BYTES = 1_000_000  # of a style's file
_MAX_COATS = 64


@dataclass(frozen=True)
class Pass:
    """One coat of hatching over the whole sheet, after a look at what is there."""

    name: str = "coat"
    # the mixtures in layers; once more; shapes
    kind: Annotated[str, "fill", "add", "touch"] = "fill"
    tip: Annotated[float, 0.2, 4] = 1.0  # width of the tip, in usual tips
    fine: Annotated[float, 0.2, 4] = 0.65  # the same where care is due
    sharp: bool = False  # a sharpened tip
    spacing: Annotated[float, 0.3, 2] = 0.62  # tips between lines; below 0.5 the hatch closes
    shortest: Annotated[float, 0.3, 20] = 2.5  # tips: shorter lines are left out
    reach: Annotated[float, 1, 60] = 20.0  # tips: the longest line without moving the arm
    legs: Annotated[int, 1, 60] = 12  # lines in one zigzag
    # degrees by which the direction turns from layer to layer
    cross: Annotated[float, 0, 90] = 18.0
    angle: Annotated[float, -90, 90] = 0.0  # degrees against the surface's direction
    # factor on its forces: wax takes hold of wax less than of paper
    press: Annotated[float, 0.1, 5] = 1.0
    dark_price: Annotated[float, 0, 4] = 0.3  # reluctance to go darker than the photo
    gap: Annotated[float, 0, 4] = 0.4  # tips of unwanted ground a line may cross
    single: Annotated[float, 0, 1] = 0.75  # coherence from which lines are drawn singly, as hair is
    cohere: Annotated[float, 0, 6] = 0.5  # touch: tips over which neighbours agree on a crayon
    # touch: share of the tip that must gain; small keeps borders crisp
    edge: Annotated[float, 0.1, 2] = 0.35
    hardest: Annotated[float, 0.03, 2] = 2.0  # touch: N/mm^2 at most
    # touch: least gain in colour (OKLab) for which the hand moves
    gain: Annotated[float, 0, 1] = 0.03
    # touch: only where the photo has at least this much detail
    detail: Annotated[float, 0, 1] = 0.1
    tone: Annotated[float, 0, 4] = 1.0  # touch: weight of lightness against colour
    soften: Annotated[float, 0, 4] = 0.3  # touch: tips; the target is looked at this blurred
    least: Annotated[float, 0, 100] = 4.0  # touch: square tips; smaller shapes are left out


@dataclass(frozen=True)
class Style:
    """How a person draws."""

    title: str = ""
    tip_mm: Annotated[float, 0.5, 30] = 2.4  # width of the usual tip
    crayons: Annotated[int, 1, 64] = 10  # most crayons taken out of the box
    # OKLab units by which two large surfaces must differ to be two
    merge: Annotated[float, 0.01, 1] = 0.06
    # how much wider the hatching of the ground is than the subject's
    open: Annotated[float, 0, 4] = 0.5
    # share of the sheet that is left out, the farthest from the subject
    fade: Annotated[float, 0, 1] = 0.0
    margin_mm: Annotated[float, 0, 50] = 2.0  # paper left along the sheet's border
    chroma: Annotated[float, 0, 3] = 1.0  # colourfulness asked for
    # 0: tones as they are, the darkest drawn together; 1: all tones spread from paper to crayon
    lift: Annotated[float, 0, 1] = 0.7
    skin: Annotated[float, 0, 3] = 0.45  # more colour for pale warm tones, so that skin stays skin
    # the hand's own direction; -50 runs from lower left to upper right
    wrist_deg: Annotated[float, -90, 90] = -50.0
    wrist: Annotated[float, 0, 100] = 0.3  # how much the wrist counts against the form
    press: Annotated[float, 0.1, 5] = 1.0  # factor on all forces
    hardest: Annotated[float, 0.1, 2] = 2.0  # N/mm^2: the hand fills no harder
    force_spread: Annotated[float, 0, 1] = 0.18  # from line to line
    swell: Annotated[float, 0, 1] = 0.12  # along a line
    wobble: Annotated[float, 0, 1] = 0.05  # tips sideways
    overshoot: Annotated[float, 0, 3] = 0.15  # tips beyond the ends
    lines: Annotated[float, 0, 5] = 1.0  # amount of outline
    search: Annotated[int, 1, 4] = 1  # how many times a line is drawn until it sits
    closed: bool = False  # outlines go round whole areas instead of along edges
    # outlines before the fill, as children draw; drawn once more at the end
    lines_first: bool = False
    # age of the child who sets faces down as symbols; 0: as they look
    symbols: Annotated[int, 0, 10] = 0
    line_tip: Annotated[float, 0.2, 3] = 0.45  # width of the outline's tip, in usual tips
    line_press: Annotated[float, 0.1, 5] = 1.0  # factor on the force of outlines
    passes: tuple[Pass, ...] = (Pass(),)


@functools.cache
def style_names() -> dict[str, str]:
    """The shipped styles by name, with their titles."""
    return {
        p.stem: str(tomllib.loads(p.read_text("utf-8"))["title"])
        for p in sorted(_FOLDER.glob("*.toml"))
    }


def load_style(source: str | dict[str, Any]) -> Style:
    """A shipped style by name, a user's TOML file, or the content of one.

    `extends` names a shipped style whose keys hold where no others are given, in a dict also a
    user's file; `pass` then may be a table of changes by the name of a coat.
    ValueError names the key and the nearest valid one.

    >>> load_style({"extends": "child", "lines": 2.0, "pass": {"fill": {"legs": 5}}}).lines
    2.0
    """
    if isinstance(source, dict):
        return style_from(_extended(source, "style", _table), "style")
    table = _table(source)
    where = source if source in style_names() else str(Path(source))
    return style_from(_extended(table, where, _shipped), where)


def _table(source: str) -> dict[str, Any]:
    """The keys of a shipped style, or of a user's file and of the style that it extends."""
    if source in style_names():
        return _shipped(source)
    path = Path(source)
    if path.suffix != ".toml" or not path.is_file():
        valid = f"{', '.join(style_names())}, or a .toml file"
        near = difflib.get_close_matches(source, style_names(), 1)
        hint = f"did you mean {near[0]!r}?" if near else f"valid: {valid}"
        raise ValueError(f"style: {source!r} is unknown; {hint}")
    try:
        raw = files.read_bytes(path, _MAX_BYTES, "a style")
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
    try:
        table = tomllib.loads(raw.decode("utf-8-sig"))
    except RecursionError:
        raise ValueError(f"{path}: not TOML: nested too deeply") from None
    except ValueError as error:
        raise ValueError(f"{path}: not TOML: {error}") from None
    return _extended(table, str(path), _shipped)


def _shipped(name: str) -> dict[str, Any]:
    """The keys of a shipped style."""
    if name not in style_names():
        near = did_you_mean(name, style_names())
        raise ValueError(f"extends: {shown(name)} is no shipped style{near}")
    return tomllib.loads((_FOLDER / f"{name}.toml").read_text("utf-8"))


def _extended(
    table: dict[str, Any], where: str, read: Callable[[str], dict[str, Any]]
) -> dict[str, Any]:
    """The table with the keys of the style that it extends, if it does."""
    if "extends" not in table:
        return table
    try:
        below = read(of_kind(str, table["extends"], "extends", "the name of a style"))
    except ValueError as error:
        raise ValueError(f"{where}: {error}") from None
    above = {key: value for key, value in table.items() if key != "extends"}
    coats, changes = below.get("pass", []), above.get("pass", {})
    if isinstance(changes, dict):
        checks.keys(changes, [coat["name"] for coat in coats], f"{where}: pass")
        for name, change in changes.items():
            of_kind(dict, change, f"{where}: pass.{name}", "a table of keys")
        above["pass"] = [coat | changes.get(coat["name"], {}) for coat in coats]
    return below | above


def style_from(table: dict[str, Any], where: str) -> Style:
    """A style from its table; `where` begins the error line."""
    table = dict(table)
    passes = table.pop("pass", [])
    if not isinstance(passes, list) or not all(isinstance(row, dict) for row in passes):
        raise ValueError(f"{where}: pass: write each coat as a [[pass]] table")
    checks.count("coats", len(passes), _MAX_COATS, where)
    values = _checked(table, Style, where)
    coats = tuple(
        Pass(**_checked(row, Pass, f"{where}: pass {i + 1}")) for i, row in enumerate(passes)
    )
    return Style(**values, passes=coats)


def _checked(table: dict[str, Any], kind: type, where: str) -> dict[str, Any]:
    """The table if every key is known, of the right type and in range."""
    known = {f.name: f for f in fields(kind) if f.name != "passes"}
    hints = get_type_hints(kind, include_extras=True)
    ranges = {
        name: hint.__metadata__ for name, hint in hints.items() if hasattr(hint, "__metadata__")
    }
    for key, value in table.items():
        if key not in known:
            near = difflib.get_close_matches(key, [*known, "pass"], 1, 0.4)
            raise ValueError(
                f"{where}: unknown key {key!r}" + (f"; did you mean {near[0]!r}?" if near else "")
            )
        default = known[key].default
        right = isinstance(value, type(default)) or (
            isinstance(default, float) and type(value) is int
        )
        if not right or (isinstance(value, bool) and not isinstance(default, bool)):
            raise ValueError(f"{where}: {key} = {value!r} is not a {type(default).__name__}")
        if isinstance(value, str):
            if not value or not value.isprintable():
                raise ValueError(f"{where}: {key} = {value!r} is not a line of text")
            if key in ranges and value not in ranges[key]:
                raise ValueError(
                    f"{where}: {key} = {value!r} is not one of {', '.join(ranges[key])}"
                )
        elif key in ranges and not ranges[key][0] <= value <= ranges[key][1]:
            raise ValueError(
                f"{where}: {key} = {value!r} is not between {ranges[key][0]:g} and "
                f"{ranges[key][1]:g}"
            )
    return table


FORCES = {"light": 0.5, "normal": 1.0, "heavy": 1.7}


def with_force(style: Style, force: str | float) -> Style:
    """The style pressed lighter or heavier: a name of FORCES or a factor from 0.1 to 5."""
    factor = FORCES.get(force) if isinstance(force, str) else force
    if factor is None:
        try:
            factor = float(force)
        except ValueError:
            factor = 0.0
    if not 0.1 <= factor <= 5:
        raise ValueError(
            f"force: {force!r} is neither {', '.join(FORCES)} nor a number from 0.1 to 5"
        )
    return replace(style, press=style.press * factor)


def with_age(style: Style, age: int) -> Style:
    """The style as drawn at an age from 3 to 10: the younger, the fatter the crayon, the fewer
    colours, the wider the gaps and the further beyond the border."""
    if not style.lines_first:
        raise ValueError("age: only a style that draws outlines first has an age; use style child")
    if not 3 <= age <= 10:
        raise ValueError(f"age: {age} is not between 3 and 10")
    young = (10 - age) / 7
    passes = tuple(replace(p, spacing=p.spacing * (0.9 + 0.35 * young)) for p in style.passes)
    return replace(
        style,
        passes=passes,
        tip_mm=style.tip_mm * (0.75 + 0.6 * young),
        crayons=round(9 - 4 * young),
        merge=0.12 + 0.05 * young,
        symbols=age,
        overshoot=0.2 + 0.6 * young,
        wobble=0.06 + 0.2 * young,
        force_spread=0.15 + 0.25 * young,
    )
