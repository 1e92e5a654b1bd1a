"""Styles as data: the shipped ones, a user's own, what is wrong with one, forces and ages."""

import inspect
import io
import re
import tokenize
from dataclasses import fields, replace
from itertools import pairwise
from pathlib import Path
from typing import get_type_hints

import pytest

from stroke_gen import params
from stroke_gen.params import (
    FORCES,
    Pass,
    Style,
    load_style,
    style_from,
    style_names,
    with_age,
    with_force,
)

KINDS = (Style, Pass)
KEYS = [(kind, f) for kind in KINDS for f in fields(kind) if f.name != "passes"]
IDS = [f"{kind.__name__}.{f.name}" for kind, f in KEYS]
AGES = range(3, 11)


def limits(kind, name):
    """Lowest and highest value of a key, None if it is no number."""
    hint = get_type_hints(kind, include_extras=True)[name]
    return None if hint in (str, bool) or hint.__origin__ is str else hint.__metadata__


def user_style(tmp_path, text, name="mine.toml"):
    path = tmp_path / name
    path.write_text(text, "utf-8")
    return load_style(str(path))


def complaint(tmp_path, text):
    """The one line a faulty style file is refused with."""
    with pytest.raises(ValueError) as caught:
        user_style(tmp_path, text)
    line = str(caught.value)
    assert "\n" not in line and "mine.toml" in line
    return line


# ---- what is shipped -----------------------------------------------------------------------------


def test_the_five_styles_are_shipped():
    assert {"artist", "child", "fine", "sketch", "solid"} <= set(style_names())


@pytest.mark.parametrize("name", style_names())
def test_shipped_style_is_whole(name):
    style = load_style(name)
    assert style.title == style_names()[name] and style.passes
    assert len({coat.name for coat in style.passes}) == len(style.passes), (
        "coats are told apart by name"
    )
    assert style.passes[0].kind == "fill"
    for part in (style, *style.passes):
        for f in fields(part):
            if f.name != "passes" and (limit := limits(type(part), f.name)):
                assert limit[0] <= getattr(part, f.name) <= limit[1], f.name


@pytest.mark.parametrize("kind, field", KEYS, ids=IDS)
def test_every_number_has_a_range_that_holds_its_default(kind, field):
    if isinstance(field.default, bool | str):
        return
    low, high = limits(kind, field.name)
    assert low < high and low <= field.default <= high
    assert isinstance(field.default, int) == isinstance(low, int) or isinstance(
        field.default, float
    )


@pytest.mark.parametrize("kind", KINDS)
def test_every_key_says_what_it_does(kind):
    """A comment stands behind each key or over it, but for those whose name says all."""
    text = inspect.getsource(kind)
    lines = text.splitlines()
    commented = {
        t.start[0]
        for t in tokenize.generate_tokens(io.StringIO(text).readline)
        if t.type == tokenize.COMMENT
    }
    for f in fields(kind):
        if f.name not in ("title", "name", "passes"):
            number = next(
                i for i, line in enumerate(lines, 1) if line.strip().startswith(f"{f.name}:")
            )
            assert {number - 1, number} & commented, f.name


def test_every_key_is_read_by_the_generator():
    """A key that nothing reads promises what no drawing shows."""
    sources = [
        p.read_text("utf-8")
        for p in Path(params.__file__).parent.glob("*.py")
        if p.name != "params.py"
    ]
    for kind in KINDS:
        for f in fields(kind):
            if f.name not in ("title", "passes"):
                assert any(
                    re.search(rf"\b(style|coat|hold)\.{f.name}\b", text) for text in sources
                ), f.name


# ---- a user's own --------------------------------------------------------------------------------


def test_a_users_style(tmp_path):
    head = 'title = "mine"\ntip_mm = 3\nclosed = true\n'
    style = user_style(tmp_path, head + '[[pass]]\nkind = "touch"\n[[pass]]\nlegs = 4\n')
    assert (style.title, style.tip_mm, style.closed) == ("mine", 3, True)
    assert [coat.kind for coat in style.passes] == ["touch", "fill"] and style.passes[1].legs == 4
    assert style.chroma == Style.chroma


def test_a_shipped_style_copied_by_a_user_is_the_same(tmp_path):
    for name in style_names():
        text = (params._FOLDER / f"{name}.toml").read_text("utf-8")
        assert user_style(tmp_path, text, f"{name}-copy.toml") == load_style(name)


@pytest.mark.parametrize("text, named", [
    ("tip_m = 2.0", ("'tip_m'", "'tip_mm'")),
    ("overshot = 0.2", ("'overshot'", "'overshoot'")),
    ("colour = 2.0", ("'colour'",)),
    ("[[passes]]\nspacing = 1.0", ("'passes'", "'pass'")),
    ("[[pass]]\nspacng = 1.0", ("pass 1", "'spacng'", "'spacing'")),
    ("[[pass]]\n[[pass]]\nHardest = 1.0", ("pass 2", "'Hardest'", "'hardest'")),
    ('tip_mm = "wide"', ("tip_mm", "'wide'", "float")),
    ("tip_mm = true", ("tip_mm", "True", "float")),
    ("closed = 1", ("closed", "1", "bool")),
    ("crayons = 2.5", ("crayons", "2.5", "int")),
    ("title = 3", ("title", "3", "str")),
    ("tip_mm = 0.1", ("tip_mm", "0.1", "0.5", "30")),
    ("crayons = 0", ("crayons", "0", "1", "64")),
    ("chroma = nan", ("chroma", "nan")),
    ("chroma = inf", ("chroma", "inf")),
    ("lift = -0.1", ("lift", "-0.1")),
    ("[[pass]]\ngain = 1.5", ("pass 1", "gain", "1.5")), ('title = "two\\nlines"', ("title",)),
    ('[[pass]]\nkind = "shading"', ("pass 1", "kind", "'shading'", "touch")),
    ('[[pass]]\nname = ""', ("pass 1", "name")),
    ("pass = 3", ("pass",)), ("pass = [1]", ("pass",)), ("tip_mm = ", ("not TOML",)),
], ids=lambda v: v if isinstance(v, str) else "")  # fmt: skip
def test_what_is_wrong_is_named_in_one_line(tmp_path, text, named):
    line = complaint(tmp_path, text)
    assert all(word in line for word in named), line


def test_a_style_extends_another(tmp_path):
    text = 'extends = "child"\nlines = 2\n[pass.fill]\nlegs = 5\n'
    mine, child = user_style(tmp_path, text), load_style("child")
    coats = tuple(replace(c, legs=5) if c.name == "fill" else c for c in child.passes)
    assert mine == replace(child, lines=2, passes=coats) and mine.passes != child.passes
    above = {"extends": str(tmp_path / "mine.toml"), "lines": 0.5}
    assert load_style(above) == replace(mine, lines=0.5)
    own = user_style(tmp_path, 'extends = "child"\n[[pass]]\nname = "mine"\n')
    assert own == replace(child, passes=(Pass(name="mine"),))


@pytest.mark.parametrize("text, words", [
    ('extends = "chidl"', 'extends: "chidl" is no shipped style (did you mean "child"?)'),
    ("extends = 3", "extends: 3 is not the name of a style"),
    ('extends = "other.toml"', "no shipped style"),
    ('extends = "child"\npass.fil.legs = 3', 'unknown key "fil" (did you mean "fill"?)'),
    ('extends = "child"\npass.fill = 3', "pass.fill: 3 is not a table of keys"),
    ("a=" + "[" * 3000, "nested too deeply"),
    ("lines = 1" + "0" * 5000, "not TOML"),
    ("[[pass]]\n" * 65, "65 coats, at most 64"),
    ("# " + "x" * 1_000_000, "larger than 1 MB"),
])  # fmt: skip
def test_a_style_that_extends_wrongly_or_hurts(tmp_path, text, words):
    with pytest.raises(ValueError, match=re.escape(words)) as error:
        user_style(tmp_path, text)
    assert "mine.toml" in str(error.value) and "\n" not in str(error.value)


def test_a_byte_order_mark_is_no_key(tmp_path):
    (tmp_path / "mine.toml").write_bytes(b"\xef\xbb\xbflines = 2.0\n")
    assert load_style(str(tmp_path / "mine.toml")).lines == 2


def test_a_file_that_is_no_text(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_bytes(b"\xff\xfe\x00title")
    with pytest.raises(ValueError, match=r"mine\.toml: not TOML"):
        load_style(str(path))


@pytest.mark.parametrize("name, hint", [
    ("artits", "'artist'"), ("Child", "'child'"), ("oil", "artist"), ("", "artist"),
    ("none.toml", "none.toml"),
    ("../artist", "artist"), (".", "artist"),
])  # fmt: skip
def test_unknown_styles(name, hint):
    with pytest.raises(ValueError, match="style") as caught:
        load_style(name)
    assert hint in str(caught.value) and "\n" not in str(caught.value)


def test_reading_a_style_leaves_its_table_alone():
    table = {"tip_mm": 2.0, "pass": [{"kind": "add"}]}
    assert style_from(table, "here") == style_from(table, "here")


# ---- force and age -------------------------------------------------------------------------------


def test_forces():
    style = load_style("artist")
    presses = [with_force(style, name).press for name in ("light", "normal", "heavy")]
    assert presses == sorted(presses) and presses[1] == style.press and len(set(presses)) == 3
    assert set(FORCES) == {"light", "normal", "heavy"}
    assert with_force(style, 2).press == with_force(style, "2.0").press == 2 * style.press
    assert replace(with_force(style, 0.3), press=style.press) == style
    assert with_force(load_style("solid"), 2).press == 2 * load_style("solid").press


@pytest.mark.parametrize("force", ["hard", "", 0, -1, 6, "nan", float("nan"), "inf"])
def test_wrong_forces(force):
    with pytest.raises(ValueError, match=r"force: .* light, normal, heavy"):
        with_force(Style(), force)


def test_the_younger_the_wilder():
    ages = [with_age(load_style("child"), age) for age in AGES]

    def falls(values):
        return all(a >= b for a, b in pairwise(values)) and values[0] > values[-1]

    for name in ("tip_mm", "overshoot", "wobble", "force_spread"):
        assert falls([getattr(style, name) for style in ages]), name
    for name in ("crayons", "symbols"):
        assert falls([-getattr(style, name) for style in ages]), name
    for coat in range(len(ages[0].passes)):
        assert falls([style.passes[coat].spacing for style in ages]), "wider gaps"


@pytest.mark.parametrize("age", AGES)
def test_every_age_stays_in_range(age):
    style = with_age(load_style("child"), age)
    for part in (style, *style.passes):
        for f in fields(part):
            if f.name != "passes" and (limit := limits(type(part), f.name)):
                assert limit[0] <= getattr(part, f.name) <= limit[1], f.name


@pytest.mark.parametrize("age", [2, 11, 0, -5, 100])
def test_wrong_ages(age):
    with pytest.raises(ValueError, match=rf"age: {age} is not between 3 and 10"):
        with_age(load_style("child"), age)


def test_only_children_have_an_age():
    with pytest.raises(ValueError, match="age"):
        with_age(load_style("artist"), 5)
