"""The palettes: shipped boxes, users' files, their errors, and the wax a colour stands for."""

import itertools
import json
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from crayonize.crayons.palette import Crayon, Palette
from crayonize.crayons.palette_files import MAX_CRAYONS, load_palette, palette_names
from crayonize.crayons.pigment import default_hiding
from crayonize.crayons.used import with_palette
from crayonize.images.srgb import luminance
from stroke_gen.checks import did_you_mean, quoted
from stroke_gen.drawing import Drawing, Stroke, Tip

DATA = Path(load_palette.__code__.co_filename).parents[1] / "data" / "palettes"
NAMES = [name for name, _, _ in palette_names()]
BOXES = ["box8", "box16", "box24", "box48", "box64"]
BRANDS = """crayola, tickle me, bluetiful, macaroni, granny smith, timberwolf, tumbleweed,
mauvelous, robin, razzmatazz, cerulean, dandelion, purple mountain, inchworm, jazzberry, manatee,
fuzzy wuzzy, outer space, laser lemon, screamin, atomic, pacific blue, wild strawberry, bittersweet,
asparagus, carnation, cadet, wisteria, shamrock, cornflower"""


def linear(value: float) -> float:
    return value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4


def encoded(value: float) -> float:
    return value * 12.92 if value <= 0.0031308 else 1.055 * value ** (1 / 2.4) - 0.055


def channels(colour: str) -> list[float]:
    return [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]


def over(crayon: Crayon, thickness_um: float, ground: float) -> list[float]:
    """A film over a ground by Kubelka's hyperbolic formula, channel by channel, linear light."""
    seen = []
    for k, s in zip(crayon.k, crayon.s, strict=True):
        a = 1 + k / s
        b = math.sqrt(a * a - 1)
        sinh, cosh = math.sinh(b * s * thickness_um), math.cosh(b * s * thickness_um)
        reflectance = sinh / (a * sinh + b * cosh)
        transmittance = b / (a * sinh + b * cosh)
        seen.append(reflectance + transmittance**2 * ground / (1 - reflectance * ground))
    return seen


def shown(crayon: Crayon, thickness_um: float, ground: float) -> list[float]:
    """As `over`, with what the wax's front surface reflects (n = 1.44: 3.25 %)."""
    return [0.0325 + 0.9675 * value for value in over(crayon, thickness_um, ground)]


# ---- shipped palettes ----------------------------------------------------------------------------


def test_listing_names_every_file_with_title_and_size() -> None:
    assert [*BOXES, "earths", "greys", "pastels", "rudolf2003", "skin"] == NAMES
    for name, title, count in palette_names():
        palette = load_palette(name)
        assert (palette.name, palette.title, len(palette.crayons)) == (name, title, count)


@pytest.mark.parametrize("name", NAMES)
def test_every_crayon_is_sound_wax_with_a_plain_name(name: str) -> None:
    palette = load_palette(name)
    assert palette.source.endswith(".") and palette.source.count(". ") == 0  # one sentence
    assert len({crayon.name for crayon in palette.crayons}) == len(palette.crayons)
    for crayon in palette.crayons:
        assert crayon.name == crayon.name.lower().strip()
        assert not [
            brand for brand in BRANDS.replace("\n", " ").split(", ") if brand in crayon.name
        ]
        assert all(math.isfinite(v) and v >= 0 for v in crayon.k + crayon.s)


@pytest.mark.parametrize("name", NAMES)
def test_reference_film_on_white_shows_the_hex(name: str) -> None:
    palette = load_palette(name)
    # less than the front surface reflects no wax can show
    darkest = 255 * encoded(0.0325 + 0.9675 * 0.005)
    for crayon in palette.crayons:
        seen = [255 * encoded(v) for v in shown(crayon, palette.film_um, 1.0)]
        wanted = [max(255 * v, darkest) for v in channels(crayon.hex)]
        assert seen == pytest.approx(wanted, abs=1), crayon.name


@pytest.mark.parametrize("name", [name for name in NAMES if name != "rudolf2003"])
def test_reference_film_on_black_shows_the_hiding_or_more(name: str) -> None:
    palette = load_palette(name)
    given = {
        one["name"]: one["hiding"]
        for one in json.loads((DATA / f"{name}.json").read_text())["crayons"]
    }
    for crayon in palette.crayons:
        white, black = over(crayon, palette.film_um, 1.0), over(crayon, palette.film_um, 0.0)
        hides, least = [b / w for w, b in zip(white, black, strict=True)], given[crayon.name]
        assert all(least < hiding < least + 0.5 * (1 - least) for hiding in hides)
        clear = [hiding for hiding, w in zip(hides, white, strict=True) if w < 0.01]
        # a dark channel stays as clear as it was
        assert clear == pytest.approx([least] * len(clear), abs=0.03)


@pytest.mark.parametrize(
    "name, dominant", [("red", 0), ("orange", 0), ("yellow", 0), ("green", 1), ("blue", 2)]
)
def test_thick_wax_keeps_its_colour(name: str, dominant: int) -> None:
    """Scans of heavy red keep .75 to .8 of the paper's red light; hiding alike in all channels left
    .38 at 80 um.
    """
    palette = load_palette("box24")
    crayon = palette.crayons[palette.index(name)]
    thin, thick, endless = (shown(crayon, um, 1.0) for um in (palette.film_um, 45.0, 2000.0))
    assert thick[dominant] > 0.68 * thin[dominant] and endless[dominant] > 0.62 * thin[dominant]
    bright, dark = thick[dominant], min(thick)
    assert bright > 2.2 * dark


def test_yellow_over_blue_is_green() -> None:
    palette = load_palette("box24")
    yellow, blue = (palette.crayons[palette.index(name)] for name in ("yellow", "blue"))
    for um in (4.0, 8.0, 12.0):
        below = over(blue, um, 0.97)
        red, green, blueish = (over(yellow, um, ground)[c] for c, ground in enumerate(below))
        assert green > 1.1 * max(red, blueish)


@pytest.mark.parametrize("name", ["box24", "greys", "pastels", "rudolf2003"])
@pytest.mark.parametrize("paper", [0.9, 0.95, 1.0])
def test_white_on_white_paper_stays_within_two_percent(name: str, paper: float) -> None:
    palette = load_palette(name)
    white = palette.crayons[palette.index("white")]
    assert over(white, palette.film_um, paper) == pytest.approx([paper] * 3, rel=0.02)


@pytest.mark.parametrize("split", [2, 8])
def test_split_film_looks_like_one_film(split: int) -> None:
    crayon = load_palette("box24").crayons[0]
    ground = [0.9, 0.9, 0.9]
    for _ in range(split):
        ground = [over(crayon, 12.0 / split, g)[c] for c, g in enumerate(ground)]
    assert ground == pytest.approx(over(crayon, 12.0, 0.9), rel=1e-12)


def test_default_box_can_draw_a_photo() -> None:
    palette = load_palette("box24")
    needed = (
        "black,white,light grey,grey,dark brown,tan,peach,dark blue,blue green,sky blue,dark green,"
        "yellow green,red,dark red,orange,yellow,violet,pink"
    )
    assert len(palette.crayons) == 24
    assert {crayon.name for crayon in palette.crayons} >= set(needed.split(","))


def test_small_boxes_lie_in_the_larger_ones_and_a_name_means_one_colour() -> None:
    boxes = [{crayon.name: crayon.hex for crayon in load_palette(name).crayons} for name in BOXES]
    for small, large in itertools.pairwise(boxes):
        assert small.items() <= large.items()
    colours: dict[str, str] = {}
    for name in NAMES:
        if name != "rudolf2003":
            for crayon in load_palette(name).crayons:
                assert colours.setdefault(crayon.name, crayon.hex) == crayon.hex


def test_paper_palette_holds_table_2() -> None:
    data = json.loads((DATA / "rudolf2003.json").read_text())
    rows = {one["name"]: one.get("table2", one) for one in data["crayons"]}
    assert len(rows) == 13
    assert [rows["white"][key] for key in ("rgb", "t", "s")] == [[0.8, 0.8, 0.79], 0.55, 0.33]
    assert [rows["brown"][key] for key in ("rgb", "t", "s")] == [[0.8, 0.55, 0.5], 0.3025, 0.15]
    assert sum(row["t"] for row in rows.values()) == pytest.approx(6.1875)
    assert sum(row["s"] for row in rows.values()) == pytest.approx(2.094)


def test_table_2_layer_has_its_transmittance_and_reflectance() -> None:
    palette = load_palette("rudolf2003")
    red, layer_um, tint = palette.crayons[0], 2 * palette.film_um, linear(0.95)
    assert over(red, layer_um, 0.0)[0] == pytest.approx(0.051 * tint)
    r, t = 0.051 * tint, 0.605 * tint
    assert over(red, layer_um, 1.0)[0] == pytest.approx(r + t * t / (1 - r))


def test_listing_and_loading_need_no_numpy() -> None:
    code = (
        "import sys; from crayonize.crayons.palette_files import palette_names, load_palette; "
        "palette_names();"
        "load_palette('box24'); sys.exit(bool({'numpy', 'numba', 'cv2'} & set(sys.modules)))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


# ---- users' palettes -----------------------------------------------------------------------------


def write(folder: Path, name: str, content: str | bytes) -> Path:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def summary(palette: Palette) -> list[tuple[str, str]]:
    return [(crayon.name, crayon.hex) for crayon in palette.crayons]


def test_json_file_and_object_say_the_same(tmp_path: Path) -> None:
    red = {"name": " Deep  RED", "hex": "#AA1122", "hiding": 0.3}
    data = {"title": "Mine", "film_um": 6, "crayons": [red]}
    from_file = load_palette(write(tmp_path, "mine.json", json.dumps(data)))
    assert (from_file.name, from_file.title, from_file.film_um) == ("mine", "Mine", 6.0)
    assert summary(from_file) == [("deep red", "#aa1122")]
    assert load_palette(data).crayons == from_file.crayons
    assert load_palette(from_file) is from_file
    assert from_file.index("Deep Red") == 0


def test_gimp_palette(tmp_path: Path) -> None:
    head = "GIMP Palette\r\nName: Fruit\r\nColumns: 2\r\n# mine\r\n"
    text = head + "255   0 10\tCherry\r\n  0 128 0 Pear skin\r\n1 2 3\tUntitled\r\n"
    palette = load_palette(str(write(tmp_path, "fruit.GPL", text)))
    assert (palette.name, palette.title) == ("fruit", "Fruit")
    assert summary(palette) == [
        ("cherry", "#ff000a"),
        ("pear skin", "#008000"),
        ("#010203", "#010203"),
    ]


@pytest.mark.parametrize("ending", ["txt", "hex"])
def test_list_of_hex_colours(tmp_path: Path, ending: str) -> None:
    text = "\ufeff# my colours\n\n#FF0000 Fire red  # the best\n00ff00\n#\n## end\n"
    palette = load_palette(write(tmp_path, f"list.{ending}", text))
    assert summary(palette) == [("fire red", "#ff0000"), ("#00ff00", "#00ff00")]


def test_comma_list() -> None:
    assert summary(load_palette("#ff0000,#00FF00 grass")) == [
        ("#ff0000", "#ff0000"),
        ("grass", "#00ff00"),
    ]


def test_most_crayons_allowed() -> None:
    assert len(load_palette(",".join(f"#{i:06x}" for i in range(MAX_CRAYONS))).crayons) == 254


def test_hiding_is_guessed_from_lightness_and_chroma() -> None:
    assert default_hiding("#ffffff") == pytest.approx(0.7, abs=1e-3)
    assert default_hiding("#ff0000") == 0.12
    assert default_hiding("#ffc0cb") > default_hiding("#00a050") > default_hiding("#df2a33")
    palette = load_palette("#00a050")
    black, white = (over(palette.crayons[0], palette.film_um, ground) for ground in (0.0, 1.0))
    assert black[0] / white[0] == pytest.approx(default_hiding("#00a050"), abs=0.03)


@pytest.mark.parametrize("colour", ["#000000", "#ffffff", "#ff0000", "#0000ff", "#010000"])
@pytest.mark.parametrize("hiding", [0.01, 0.5, 0.99])
def test_extreme_colours_are_still_wax(colour: str, hiding: float) -> None:
    crayon = load_palette({"crayons": [{"hex": colour, "hiding": hiding}]}).crayons[0]
    assert all(math.isfinite(v) and v >= 0 for v in crayon.k + crayon.s)
    assert all(0 < v < 1 for v in over(crayon, 9.0, 1.0))


# ---- what is wrong, and what would be right ------------------------------------------------------

ONE = '{"crayons": [%s]}'
GIMP = "GIMP Palette\n"
BAD_FILES = [
    ("a.json", "", "a.json: line 1, column 1: not JSON"),
    ("a.json", '{"crayons": [\n  {"hex": "#ff0000",}]}', "a.json: line 2, column"),
    ("a.json", "[1, 2]", 'a.json: a list of 2 is not an object like {"crayons"'),
    ("a.json", "[" * 100_000, "a.json: nested too deeply"),
    ("a.json", ONE % ('{"hex": "#ff0000", "hiding": 1' + "0" * 5000 + "}"), "thousands of digits"),
    ("a.json", ONE % '{"hex": "#ff0000", "hex": "#00ff00"}', 'the key "hex" stands twice'),
    ("a.json", '{"crayon": []}', 'a.json: unknown key "crayon" (did you mean "crayons"?)'),
    ("a.json", "{}", "a.json: crayons: nothing is not a list"),
    ("a.json", '{"crayons": []}', "a.json: 0 crayons, a palette has 1 to 254"),
    ("a.json", ONE % ", ".join(["{}"] * 255), "a.json: 255 crayons, a palette has 1 to 254"),
    ("a.json", ONE % '"red"', 'a.json: crayons[0]: "red" is not an object'),
    ("a.json", ONE % '{"name": "red"}', 'crayons[0]: "hex" is missing'),
    (
        "a.json",
        ONE % '{"hex": "#ff0000"}, {"hex": "#12345"}',
        'crayons[1].hex: "#12345" is not #rrggbb',
    ),
    ("a.json", ONE % '{"hex": 255}', "crayons[0].hex: 255 is not #rrggbb"),
    (
        "a.json",
        ONE % '{"hex": "#ff0000", "hidding": 1}',
        'unknown key "hidding" (did you mean "hiding"?)',
    ),
    (
        "a.json",
        ONE % '{"hex": "#ff0000", "hiding": 1.5}',
        "crayons[0].hiding: 1.5 is not a number from 0.01",
    ),
    ("a.json", ONE % '{"hex": "#ff0000", "hiding": NaN}', "crayons[0].hiding: nan is not a number"),
    (
        "a.json",
        ONE % '{"hex": "#ff0000", "hiding": true}',
        "crayons[0].hiding: true is not a number",
    ),
    (
        "a.json",
        ONE % ('{"hex": "#ff0000", "hiding": 1' + "0" * 400 + "}"),
        "hiding: a huge number is not",
    ),
    ("a.json", ONE % '{"hex": "#ff0000", "name": ""}', "crayons[0].name: the name is empty"),
    (
        "a.json",
        ONE % '{"hex": "#ff0000", "name": "a\\nb"}',
        '"a\\nb" is not text of at most 60 printable',
    ),
    ("a.json", ONE % '{"hex": "#ff0000", "name": "\\ud800"}', '"\\ud800" is not text'),
    (
        "a.json",
        ONE % '{"hex": "#ff0000", "name": "Red"}, {"hex": "#fe0000", "name": "red"}',
        'crayons[1].name: a second crayon "red"',
    ),
    (
        "a.json",
        '{"film_um": 0, "crayons": [{"hex": "#ff0000"}]}',
        "film_um: 0 is not a number from 0.1",
    ),
    ("a.json", '{"film_um": "9", "crayons": [{"hex": "#ff0000"}]}', 'film_um: "9" is not a number'),
    (
        "a.json",
        '{"film_um": true, "crayons": [{"hex": "#ff0000"}]}',
        "film_um: true is not a number",
    ),
    (
        "a.json",
        '{"layer_films": 11, "crayons": [{}]}',
        "layer_films: 11 is not a number from 0.1 to 10",
    ),
    (
        "a.json",
        ONE % '{"name": "red", "rgb": [1, 0], "t": 0.5, "s": 0.1}',
        "rgb: a list of 2 is not a list",
    ),
    (
        "a.json",
        ONE % '{"name": "red", "rgb": [1, 0, 2], "t": 0.5, "s": 0.1}',
        "rgb[2]: 2 is not a number",
    ),
    ("a.json", ONE % '{"name": "red", "rgb": [1, 0, 0], "t": 0.5}', 'crayons[0]: "s" is missing'),
    ("a.json", ONE % '{"name": "red", "rgb": [1, 0, 0], "t": 0.5, "s": 0.6}', "t + s = 1.1"),
    ("a.json", " " * 1_000_001, "a.json: larger than 1 MB"),
    ("a.gpl", "Palette\n1 2 3\n", 'a.gpl: line 1: a .gpl file begins with "GIMP Palette"'),
    ("a.gpl", GIMP + "# none\n", "a.gpl: 0 crayons"),
    (
        "a.gpl",
        GIMP + "1 2 3 a\n1 2 300 b\n",
        'a.gpl: line 3: "1 2 300 b" does not begin with three numbers',
    ),
    ("a.gpl", GIMP + "1 2\n", "a.gpl: line 2"),
    ("a.json", b'{"name": "gr\xfcn"}', "a.json: line 1: not UTF-8"),
    ("a.txt", "#ff0000\n#ff00\n", 'a.txt: line 2: "#ff00" is not #rrggbb'),
    ("a.hex", "ff0000\nred\n", 'a.hex: line 2: "red" is not #rrggbb'),
    ("a.txt", "".join(f"{i:06x}\n" for i in range(255)), "a.txt: 255 crayons"),
    ("a.png", "x", "a.png: a palette file ends in .json, .gpl, .txt or .hex"),
]


@pytest.mark.parametrize(("name", "content", "part"), BAD_FILES)
def test_bad_file_gets_one_clear_line(
    tmp_path: Path, name: str, content: str | bytes, part: str
) -> None:
    path = write(tmp_path, name, content)
    with pytest.raises(ValueError) as caught:
        load_palette(path)
    message = str(caught.value)
    assert part in message
    assert (
        message.startswith(str(path))
        and message.isprintable()
        and len(message) < len(str(path)) + 200
    )


@pytest.mark.parametrize(
    ("source", "part"),
    [
        ("box42", 'palette "box42": neither a shipped palette nor a file (did you mean "box'),
        ("no/such/file.json", "no/such/file.json: cannot be read (No such file or directory)"),
        ("a\0b.json", "a\\x00b.json: cannot be read"),
        ("#ff0000,blue", 'palette list: item 2: "blue" is not #rrggbb'),
        ("#ff0000,", 'palette list: item 2: "" is not #rrggbb'),
        (",".join(f"#{i:06x}" for i in range(300)), "palette list: 300 crayons"),
        ({"crayons": {}}, "palette: crayons: an object is not a list"),
        (7, "palette: 7 is not a name, a file, a list of colours or an object"),
    ],
)
def test_bad_source_gets_one_clear_line(source: object, part: str) -> None:
    with pytest.raises(ValueError) as caught:
        load_palette(source)  # type: ignore[arg-type]
    assert part in str(caught.value)


@pytest.mark.parametrize(
    ("name", "content", "crayons"),
    [
        ("twice.gpl", GIMP + "255 0 0\tTile\n0 0 255\tTile\n255 0 0 again\n",
         [("tile", "#ff0000"), ("tile 2", "#0000ff")]),
        ("aseprite.gpl", "GIMP Palette\nChannels: RGBA\n#\n254  91  89 255 Red\n 57 120 168 255\n",
         [("red", "#fe5b59"), ("#3978a8", "#3978a8")]),
        ("old.gpl", b"GIMP Palette\nName: x\nColumns: 2\n1 2 3 gr\xfcn\n", [("grün", "#010203")]),
        ("paint.txt", ";paint.net Palette File\n;Colors: 2\nFF1a1c2c\nffB13E53\n",
         [("#1a1c2c", "#1a1c2c"), ("#b13e53", "#b13e53")]),
        ("line.txt", "#cc2222 #224488 sea #88aa44\n",
         [("#cc2222", "#cc2222"), ("sea", "#224488"), ("#88aa44", "#88aa44")]),
        ("again.hex", "ff0000\n" * 2, [("#ff0000", "#ff0000")]),
    ],
)  # fmt: skip
def test_public_palettes_are_read(
    tmp_path: Path, name: str, content: str | bytes, crayons: list[tuple[str, str]]
) -> None:
    palette = load_palette(write(tmp_path, name, content))
    assert [(crayon.name, crayon.hex) for crayon in palette.crayons] == crayons


def test_a_list_needs_no_commas() -> None:
    names = [crayon.hex for crayon in load_palette("#cc2222 #224488 sea,#88aa44").crayons]
    assert names == ["#cc2222", "#224488", "#88aa44"]


def test_a_drawing_in_the_crayons_of_another_box() -> None:
    path, force = np.zeros((1, 2), np.float32), np.ones(1, np.float32)
    strokes = tuple(Stroke(path, force, name, Tip()) for name in ("yellow", "black", "red"))
    grey = with_palette(Drawing(100.0, 100.0, "drawing", "box8", strokes), "greys")
    box = {crayon.name: luminance(crayon.hex) for crayon in load_palette("greys").crayons}
    light = [box[s.crayon] for s in grey.strokes]
    assert grey.palette == "greys" and light[0] > light[2] > light[1]
    same = with_palette(Drawing(100.0, 100.0, "drawing", "box8", strokes), "box24")
    assert [s.crayon for s in same.strokes] == ["yellow", "black", "red"]


def test_pipe_is_refused_at_once(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.json")
    with pytest.raises(ValueError, match="is no ordinary file"):
        load_palette(tmp_path / "pipe.json")


def test_unknown_crayon_names_the_nearest() -> None:
    with pytest.raises(
        ValueError, match=r'palette box24: no crayon "dark gren" \(did you mean "dark green"'
    ):
        load_palette("box24").index("dark gren")
    with pytest.raises(ValueError, match=r"no crayon \"xyzzy\" \(valid: red, orange"):
        load_palette("box8").index("xyzzy")


def test_nearest_names() -> None:
    assert did_you_mean("Rde", ["red", "blue"]) == ' (did you mean "red"?)'
    assert did_you_mean("q", ["red", "blue"]) == " (valid: red, blue)"
    assert did_you_mean("q", map(str, range(20))).endswith("11, ...)")
    assert did_you_mean("x" * 1_000_000, ["red"]) == " (valid: red)"
    assert quoted("a\nb") == '"a\\nb"' and len(quoted("x" * 99)) == 62
