"""Strokes go out as SVG that other programs read, and lines of other programs come in, hostile ones
not at all.
"""

import re
import time
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from crayonize.crayons.palette_files import load_palette
from crayonize.crayons.used import by_crayon
from crayonize.images.srgb import luminance
from crayonize.svg import path as svg_path
from crayonize.svg.load import load_svg
from crayonize.svg.save import FORCE_TOLERANCE, TOLERANCE_MM, save_svg, simplified
from crayonize.svg.shapes import transform
from stroke_gen.drawing import Drawing, Stroke, Tip

HANGS = 60.0  # processor seconds after which a file is taken to keep us for ever
SVG = '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '


def stroke(path, force, crayon, tip, note="fill"):
    path = np.array(path, np.float32)
    return Stroke(path, np.broadcast_to(np.float32(force), len(path)).copy(), crayon, tip, note)


@pytest.fixture(scope="module")
def drawing():
    """Strokes of three crayons in turn, with all there is to a stroke."""
    strokes = (
        stroke(
            [[10, 10], [20, 12.5], [31.25, 9]], [0.5, 1.5, 0.75], "black", Tip("sharp", 0.9), "line"
        ),
        stroke([[5, 5], [60, 40]], 2.0, "yellow", Tip("blunt", 2.4)),
        stroke([[30, 30]], 1.0, "black", Tip("blunt", 2.4), "detail"),
        stroke([[-3, 20], [90, 20]], 1.25, "red", Tip("side", 12.0, 30.0), "shade"),
    )
    return Drawing(80.0, 50.0, "drawing", "box8", strokes)


@pytest.fixture
def saved(drawing, tmp_path):
    save_svg(drawing, tmp_path / "d.svg")
    return tmp_path / "d.svg"


@pytest.fixture
def read(tmp_path):
    """Read SVG text: its head in `head`, its elements in `body`."""

    def read(body, head='viewBox="0 0 100 50"', **options):
        path = tmp_path / "given.svg"
        path.write_text(f"{SVG}{head}>{body}</svg>", encoding="utf-8")
        return load_svg(path, **options)

    return read


def spans(drawing):
    """Left, top, right, bottom in mm over all strokes."""
    points = np.concatenate([s.path_mm for s in drawing.strokes])
    return [*points.min(0).tolist(), *points.max(0).tolist()]


# ---- out -----------------------------------------------------------------------------------------


def test_layers_are_crayons_light_to_dark(drawing, saved):
    root = ET.parse(saved).getroot()
    inkscape = "{http://www.inkscape.org/namespaces/inkscape}"
    groups = root.findall("{http://www.w3.org/2000/svg}g")
    assert [g.get(f"{inkscape}groupmode") for g in groups] == ["layer"] * 3
    assert [g.get(f"{inkscape}label") for g in groups] == ["1 yellow", "2 red", "3 black"]
    lightness = [luminance(g.get("stroke")) for g in groups]
    assert lightness == sorted(lightness, reverse=True)
    layers = by_crayon(drawing, load_palette(drawing.palette))
    assert [len(strokes) for _, strokes in layers] == [len(g) for g in groups] == [1, 1, 2]
    assert (root.get("width"), root.get("height"), root.get("viewBox")) == (
        "80mm",
        "50mm",
        "0 0 80 50",
    )


def test_same_drawing_same_bytes(drawing, saved, tmp_path):
    save_svg(drawing, tmp_path / "again.svg")
    assert (tmp_path / "again.svg").read_bytes() == saved.read_bytes()


def test_file_appears_whole_or_not_at_all(drawing, tmp_path):
    with pytest.raises(ValueError, match="does not exist"):
        save_svg(drawing, tmp_path / "missing" / "d.svg")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("size", ["auto", "2rem", "100%"])
def test_a_size_that_says_nothing_of_paper_is_as_none(read, size):
    line = '<path stroke="red" fill="none" d="M5 5L90 40"/>'
    sized = read(line, head=f'viewBox="0 0 100 50" width="{size}" height="{size}"')
    plain = read(line)
    assert (sized.width_mm, sized.height_mm) == (plain.width_mm, plain.height_mm)


def test_hsla_is_a_colour(read):
    line = '<path stroke="hsla(0, 80%, 50%, 0.9)" fill="none" d="M5 5L90 40"/>'
    assert [s.crayon for s in read(line, palette="box8").strokes] == ["red"]


@pytest.mark.parametrize("word", ["currentColor", "currentcolor"])
def test_the_current_colour_in_any_letters(read, word):
    line = f'<path color="#e02020" stroke="{word}" fill="none" d="M5 5L90 40"/>'
    assert [s.crayon for s in read(line, palette="box8").strokes] == ["red"]


def test_points_are_left_out_within_the_tolerances():
    """A winding path as densely sampled as the generator's: a tenth of it, and nowhere far off."""
    t = np.linspace(0, 6, 2000)
    path = np.stack([20 + 3 * t, 30 + 4 * np.sin(t)], 1).astype(np.float32)
    force = (1 + 0.5 * np.sin(2 * t)).astype(np.float32)
    kept = simplified(path, force)
    assert kept[0] and kept[-1] and kept.sum() < 200
    for before, after, tolerance in (
        (path[:, 0], path[kept, 0], TOLERANCE_MM), (path[:, 1], path[kept, 1], TOLERANCE_MM),
        (force, force[kept], FORCE_TOLERANCE * 1.5),
    ):  # fmt: skip
        assert np.abs(np.interp(t, t[kept], after) - before).max() < 2 * tolerance
    line = np.stack([t, 2 * t], 1).astype(np.float32)
    assert simplified(line, 1 + t.astype(np.float32)).sum() == 2
    assert simplified(line[:1], force[:1]).sum() == 1
    spike = np.where(np.arange(2000) == 700, np.float32(2), np.float32(1))
    assert set(np.flatnonzero(simplified(line, spike))) == {0, 699, 700, 701, 1999}


def test_a_whole_drawing_of_the_generator_comes_in_again(tmp_path):
    """As many points as a photo's drawing has: a few MB, and no limit of our own is in its way."""
    rng = np.random.default_rng(0)
    strokes = []
    for _ in range(5000):
        t = np.linspace(0, 8, 80)
        swing = np.cumsum(rng.normal(0, 0.02, 80))
        path = rng.uniform(10, 190, 2) + np.stack([t, np.cumsum(swing) * 0.1], 1)
        force = 1 + np.cumsum(rng.normal(0, 0.02, 80))
        strokes.append(stroke(path, np.clip(force, 0.1, 3), "red", Tip("blunt", 1.6)))
    drawing = Drawing(210.0, 210.0, "drawing", "box8", tuple(strokes))
    save_svg(drawing, tmp_path / "d.svg")
    assert (tmp_path / "d.svg").stat().st_size < 4_000_000
    assert len(load_svg(tmp_path / "d.svg", palette="box8").strokes) == 5000


def test_what_goes_out_comes_in_again(drawing, saved):
    back = load_svg(saved, palette="box8")
    assert (back.width_mm, back.height_mm) == (80, 50)
    expected = [
        s for _, strokes in by_crayon(drawing, load_palette(drawing.palette)) for s in strokes
    ]
    for a, b in zip(expected, back.strokes, strict=True):
        assert (a.crayon, a.tip, a.note) == (b.crayon, b.tip, b.note)
        if len(a.path_mm) > 1:
            np.testing.assert_allclose(a.path_mm, b.path_mm, atol=0.006)
            np.testing.assert_allclose(a.force_n, b.force_n, rtol=0.01)
        else:
            np.testing.assert_allclose(b.path_mm, a.path_mm.repeat(len(b.path_mm), 0), atol=0.02)


def test_another_library_reads_it(saved):
    svgelements = pytest.importorskip("svgelements")
    paths = [
        e
        for e in svgelements.SVG.parse(saved, ppi=25.4).elements()
        if isinstance(e, svgelements.Path)
    ]
    assert [round(p.stroke_width, 3) for p in paths] == [2.4, 12.0, 0.9, 2.4]
    assert [p.stroke.hex for p in paths] == [p.values["stroke"] for p in paths]
    assert (paths[0].first_point.x, paths[0].first_point.y) == pytest.approx((5, 5), abs=0.01)
    assert paths[2].values["data-force"] == "0.5 1.5 0.75"


def test_vpype_reads_it(saved):
    vpype = pytest.importorskip("vpype")
    document = vpype.read_multilayer_svg(str(saved), 0.1)
    assert sorted(document.layers) == [1, 2, 3]
    assert document.layers[3].property("vp_name") == "3 black"
    mm = vpype.convert_length("1mm")
    assert document.page_size == pytest.approx((80 * mm, 50 * mm))
    assert document.layers[1][0] / mm == pytest.approx(np.array([5 + 5j, 60 + 40j]), abs=0.01)


# ---- in: geometry --------------------------------------------------------------------------------

INK = 'fill="none" stroke="black"'


@pytest.mark.parametrize("body, wanted", [
    (f'<path {INK} d="M10 10L90 40"/>', [10, 10, 90, 40]),
    (f'<path {INK} d="m10,10 80,30"/>', [10, 10, 90, 40]),
    (f'<path {INK} d="M10 10h80v30"/>', [10, 10, 90, 40]),
    (f'<path {INK} d="M10 20C10 0 90 0 90 20"/>', [10, 5, 90, 20]),
    (f'<path {INK} d="M10 20Q30 0 50 20T90 20"/>', [10, 10, 90, 30]),
    (f'<path {INK} d="M20 20a10 10 0 0020 0"/>', [20, 20, 40, 30]),
    (f'<line {INK} x1="10" y1="10" x2="90" y2="40"/>', [10, 10, 90, 40]),
    (f'<polyline {INK} points="10,10 50,40 90,10"/>', [10, 10, 90, 40]),
    (f'<polygon {INK} points="10 10 50 40 90 10"/>', [10, 10, 90, 40]),
    (f'<rect {INK} x="10" y="10" width="80" height="30"/>', [10, 10, 90, 40]),
    (f'<rect {INK} x="10" y="10" width="80" height="30" rx="5"/>', [10, 10, 90, 40]),
    (f'<circle {INK} cx="50" cy="25" r="15"/>', [35, 10, 65, 40]),
    (f'<ellipse {INK} cx="50" cy="25" rx="40" ry="15"/>', [10, 10, 90, 40]),
    (f'<g transform="translate(10 10)"><g transform="scale(2)">'
     f'<path {INK} d="M0 0L40 15"/></g></g>', [10, 10, 90, 40]),
    (f'<path transform="rotate(90 50 25)" {INK} d="M40 25H60"/>', [50, 15, 50, 35]),
    (f'<defs><path id="a" {INK} d="M0 0L80 30"/></defs>'
     '<use href="#a" x="10" y="10"/>', [10, 10, 90, 40]),
    (f'<symbol id="a"><path {INK} d="M0 0L80 30"/></symbol>'
     '<use xlink:href="#a" x="10" y="10"/>', [10, 10, 90, 40]),
    (f'<svg x="10" y="10" width="80" height="30" viewBox="0 0 8 3">'
     f'<path {INK} d="M0 0L8 3"/></svg>', [10, 10, 90, 40]),
    (f'<clipPath><path {INK} d="M0 0L99 9"/></clipPath>'
     f'<path {INK} d="M10 10L90 40"/>', [10, 10, 90, 40]),
    (f'<path {INK} d="M10 10L90 40 nonsense 99"/>', [10, 10, 90, 40]),
], ids=lambda value: re.sub("[^A-Za-z ]+", " ", value)[:30]
   if isinstance(value, str) else "")  # fmt: skip
def test_shapes_come_in(read, body, wanted):
    drawing = read(body, sheet_mm=100.0)
    assert (drawing.width_mm, drawing.height_mm) == (100, 50)
    assert spans(drawing) == pytest.approx(wanted, abs=0.06)


@pytest.mark.parametrize("head, size, scale", [
    ('width="200mm" height="100mm" viewBox="0 0 100 50"', (200, 100), 2),
    ('width="10cm" viewBox="0 0 100 50"', (100, 50), 1),
    ('height="2in" viewBox="0 0 100 50"', (101.6, 50.8), 1.016),
    ('width="24" height="12" viewBox="0 0 100 50"', (297, 148.5), 2.97),
    ('width="100%" viewBox="0 0 100 50"', (297, 148.5), 2.97),
    ('width="100px" height="50px"', (297, 148.5), 2.97),
    ('width="40mm" height="40mm" viewBox="0 0 100 50"', (40, 40), 0.4),
    ('width="40mm" height="40mm" viewBox="0 0 100 50" preserveAspectRatio="none"', (40, 40), None),
])  # fmt: skip
def test_sheet_has_the_size_the_file_says_or_fits_a4(read, head, size, scale):
    drawing = read(f'<path {INK} d="M0 0H100"/>', head)
    assert (drawing.width_mm, drawing.height_mm) == pytest.approx(size)
    left, _, right, _ = spans(drawing)
    assert right - left == pytest.approx(100 * (scale or 0.4))


def test_file_without_any_size_is_fitted_to_what_it_draws(read):
    drawing = read(f'<path {INK} d="M1000 1000L3000 2000"/>', "")
    assert (drawing.width_mm, drawing.height_mm) == pytest.approx((297, 148.5))
    assert spans(drawing) == pytest.approx([0, 0, 297, 148.5], abs=0.1)


def test_lines_are_cut_off_beside_the_sheet(read):
    drawing = read(f'<path {INK} d="M-1e6 25L1e6 25M0 900H90M50 -1000V25"/>', sheet_mm=100.0)
    assert len(drawing.strokes) == 2
    assert spans(drawing) == pytest.approx([-10, -10, 110, 25])


@pytest.mark.parametrize("text", [
    "M1 2 A 5 3 20 0 1 9 9", "M1 2 a 5 3 -40 1 0 3 3", "M0 0 A 1 1 0 0 1 9 0",
    "M0 0a5 5 0 1110 0z m3 3 1 1",
    "M1 1C2 2 3 0 4 1S6 3 7 1Q8 0 9 1T11 1H0V9Z", "M.5.5-1-1e1,2 3",
])  # fmt: skip
def test_paths_are_read_as_another_library_reads_them(text):
    svgelements = pytest.importorskip("svgelements")
    mine = (
        np.concatenate([o.polyline(np.diag([20.0, 20.0, 1])) for o in svg_path.outlines(text)]) / 20
    )
    for segment in svgelements.Path(text):
        if not isinstance(segment, svgelements.Move):
            for t in (0.25, 0.5, 1.0):
                point = segment.point(t)
                gap = np.hypot(*(mine - (point.x, point.y)).T).min()
                assert gap < 0.05 or isinstance(segment, svgelements.Line | svgelements.Close)


def test_transforms_multiply_in_order():
    matrix = transform("translate(10,20) rotate(90) scale(2 3)")
    np.testing.assert_allclose(matrix @ (1, 1, 1), (10 - 3, 20 + 2, 1), atol=1e-12)
    np.testing.assert_allclose(transform("matrix(1 2 3 4 5 6)")[:2], [[1, 3, 5], [2, 4, 6]])
    np.testing.assert_allclose(transform("skewX(45)") @ (0, 1, 1), (1, 1, 1))
    assert np.array_equal(transform(""), np.eye(3))


# ---- in: colours and widths ----------------------------------------------------------------------


@pytest.mark.parametrize("body, crayon", [
    ('<path d="M0 9H9" stroke="#ff0000"/>', "red"),
    ('<path d="M0 9H9" stroke="blue"/>', "blue"),
    ('<path d="M0 9H9" stroke="rgb(250, 250, 0)"/>', "yellow"),
    ('<path d="M0 9H9" style="stroke:#080"/>', "green"),
    ('<style>.a, path {stroke: none} .a {stroke: red}</style><path class="a" d="M0 9H9"/>', "red"),
    ('<style>/* } */ #b {stroke: red !important}</style>'
     '<path id="b" stroke="blue" d="M0 9H9"/>', "red"),
    ('<g stroke="red"><g stroke="inherit"><path d="M0 9H9"/></g></g>', "red"),
    ('<g color="red"><path stroke="currentColor" d="M0 9H9"/></g>', "red"),
    ('<linearGradient id="g"><stop stop-color="red"/><stop stop-color="#d00"/></linearGradient>'
     '<path stroke="url(#g)" d="M0 9H9"/>', "red"),
])  # fmt: skip
def test_colours_become_the_nearest_crayon(read, body, crayon):
    assert {s.crayon for s in read(f'<g fill="none">{body}</g>', palette="box8").strokes} == {
        crayon
    }


@pytest.mark.parametrize("faint", [
    'stroke="rgba(255, 0, 0, 0.5)"', 'stroke="rgba(255, 0, 0, 50%)"', 'stroke="#ff000080"',
    'stroke="red" stroke-opacity="0.5"', 'stroke="red" opacity="0.5"',
])  # fmt: skip
def test_a_faint_line_is_drawn_lightly(read, faint):
    """However its opacity is said, and by its colour too."""
    full, half = read(
        f'<path d="M0 5H9" stroke="red"/><path d="M0 9H9" {faint}/>', palette="box8"
    ).strokes
    assert half.force_n[0] == pytest.approx(full.force_n[0] * 0.65, rel=0.02)


def test_a_plane_of_faint_colour_is_filled_lightly(read):
    box = '<rect x="{}" y="0" width="40" height="40" fill="{}"/>'
    mean = [
        np.mean(
            np.concatenate([s.force_n for s in read(box.format(0, fill), palette="box8").strokes])
        )
        for fill in ("red", "rgba(255,0,0,.5)")
    ]
    assert mean[1] == pytest.approx(0.65 * mean[0], rel=0.05)


def test_only_a_curve_of_the_same_kind_is_continued():
    """T goes on smoothly after Q and T alone, S after C and S: else the control point is the point
    itself.
    """
    (after_c,) = svg_path.outlines("M0 0C0 10 10 10 10 0T20 0")
    (straight,) = svg_path.outlines("M0 0C0 10 10 10 10 0Q10 0 20 0")
    np.testing.assert_allclose(after_c.polyline(np.eye(3)), straight.polyline(np.eye(3)))
    (after_q,) = svg_path.outlines("M0 0Q5 10 10 0S20 10 20 0")
    (bent,) = svg_path.outlines("M0 0Q5 10 10 0C10 0 20 10 20 0")
    np.testing.assert_allclose(after_q.polyline(np.eye(3)), bent.polyline(np.eye(3)))
    (smooth,) = svg_path.outlines("M0 0Q5 10 10 0T20 0")
    (mirrored,) = svg_path.outlines("M0 0Q5 10 10 0Q15 -10 20 0")
    np.testing.assert_allclose(smooth.polyline(np.eye(3)), mirrored.polyline(np.eye(3)))


@pytest.mark.parametrize("body", [
    '<path d="M0 9H9" stroke="red" display="none"/>',
    '<g visibility="hidden"><path d="M0 9H9" stroke="red"/></g>',
    '<path d="M0 9H9" stroke="red" opacity="0"/>',
    '<path d="M0 9H9" stroke="red" stroke-width="0" fill="none"/>',
    '<path d="M0 9H9" stroke="none" fill="none"/>',
    '<symbol><path d="M0 9H9" stroke="red"/></symbol>',
    '<text x="3" y="9">words</text>',
])  # fmt: skip
def test_what_is_not_seen_is_not_drawn(read, body):
    with pytest.raises(ValueError, match="no line or shape"):
        read(body)


def test_width_becomes_the_tip_or_the_force(read):
    body = "".join(f'<path {INK} stroke-width="{w}" d="M0 {9 + w}H90"/>' for w in (0.1, 2, 30))
    tips = [s.tip for s in read(body, sheet_mm=100.0).strokes]
    assert [t.width_mm for t in tips] == [0.6, 2, 8] and [t.kind for t in tips] == [
        "sharp",
        "blunt",
        "blunt",
    ]
    pressed = read(body, sheet_mm=100.0, widths="force").strokes
    forces = [float(s.force_n[0]) for s in pressed]
    assert (
        forces == sorted(forces)
        and forces[0] < forces[1] / 3
        and len({s.tip for s in pressed}) == 1
    )


def test_opacity_lightens_the_hand(read):
    strong, weak = read(
        f'<path {INK} d="M0 9H90"/><g opacity=".5"><path {INK} d="M0 19H90"/></g>'
    ).strokes
    assert 0.5 < weak.force_n[0] / strong.force_n[0] < 0.8


def test_dot_is_drawn_as_a_dot(read):
    (dot,) = read(f'<path {INK} stroke-width="3" d="M50 25h.01"/>', sheet_mm=100.0).strokes
    assert len(dot.path_mm) > 10 and np.hypot(*(dot.path_mm - (50, 25)).T).max() < 1.5


def test_plane_is_hatched_inside_its_edge(read):
    drawing = read(
        '<path fill="red" d="M20 5H80V45H20ZM40 15V35H60V15Z"/>', sheet_mm=100.0, palette="box8"
    )
    fill = [s for s in drawing.strokes if s.note == "fill"]
    points = np.concatenate([s.path_mm for s in fill])
    assert points.min(0).min() > 5 and (points.max(0) < (80, 45)).all()
    middle = np.abs(points - (50, 25))
    assert not ((middle[:, 0] < 9.5) & (middle[:, 1] < 9.5)).any()
    length = sum(float(np.hypot(*np.diff(s.path_mm, axis=0).T).sum()) for s in fill)
    assert 0.8 < length * 0.7 * fill[0].tip.width_mm / (60 * 40 - 20 * 20) < 1.3


def test_thin_plane_is_drawn_as_a_line(read):
    drawing = read('<rect x="10" y="10" width="80" height="1" fill="red"/>', sheet_mm=100.0)
    assert {s.note for s in drawing.strokes} == {"line"}


def test_paper_white_is_left_out_but_covers(read):
    white = '<rect width="100" height="50" fill="#fff"/>'
    bar = '<rect x="40" y="0" width="20" height="50" fill="white"/>'
    drawing = read(f'{white}<path {INK} d="M0 25H100"/>{bar}', sheet_mm=100.0)
    assert [s.path_mm[[0, -1], 0].round().tolist() for s in drawing.strokes] == [[0, 40], [60, 100]]


def test_what_is_left_out_is_told(read):
    said = []
    image = '<image href="data:image/png;base64,AA"/>'
    read(f'<path {INK} d="M0 9H9"/><text>a</text><text>b</text>{image}', say=said.append)
    assert len(said) == 1 and "2 <text>" in said[0] and "1 <image>" in said[0]


# ---- hostile -------------------------------------------------------------------------------------

BOX = f'{SVG}viewBox="0 0 100 100">'
HOSTILE = {
    "entities": (
        f'<!DOCTYPE svg [<!ENTITY a "aa"><!ENTITY b "&a;&a;">]>{BOX}<text>&b;</text></svg>',
        "DOCTYPE",
    ),
    "file entity": (
        f'<!DOCTYPE svg [<!ENTITY x SYSTEM "file:///etc/passwd">]>{BOX}</svg>',
        "DOCTYPE",
    ),
    "style sheet": (f'<?xml-stylesheet href="http://a.b/c.css"?>{BOX}</svg>', "outside"),
    "import": (f"{BOX}<style>@import url(http://a.b/c.css);</style></svg>", "outside"),
    "image": (f'{BOX}<image href="http://a.b/c.png"/></svg>', "outside"),
    "use": (f'{BOX}<use xlink:href="other.svg#a"/></svg>', "outside"),
    "deep": (f"{BOX}{'<g>' * 50_000}", "deeper"),
    "many": (f"{BOX}{'<g/>' * 100_001}</svg>", "100,000 elements"),
    "use of itself": (f'{BOX}<g id="a"><use href="#a"/></g></svg>', "back to itself"),
    "use of uses": (
        f'{BOX}<g id="u0"/>'
        + "".join(
            f'<g id="u{i}">{f"<use href={chr(34)}#u{i - 1}{chr(34)}/>" * 10}</g>'
            for i in range(1, 20)
        )
        + "</svg>",
        "more than 10,000 <use>",
    ),
    "infinite": (f'{BOX}<path {INK} d="M0 0L1e999 5"/></svg>', "beyond"),
    "wide": (f'{BOX}<path {INK} stroke-width="1e999" d="M0 0L9 5"/></svg>', "beyond"),
    "scales": (
        BOX + '<g transform="scale(1e9)">' * 60 + "<path/>" + "</g>" * 60 + "</svg>",
        "beyond",
    ),
    "sheet": (f'{SVG}width="1e300mm" height="1mm"/>', "long side"),
    "no sheet": (f'{SVG}width="0" height="0"/>', "larger than 0"),
    "view": (f'{SVG}viewBox="0 0 nan 9"/>', "viewBox"),
    "transform": (f'{BOX}<path transform="matrix(1)" {INK} d="M0 0L9 9"/></svg>', "transform"),
    "length": (f'{SVG}width="9furlongs"/>', "width"),
    "long path": (f'{BOX}<path {INK} d="M0 0{"L9 9 1 1" * 200_000}"/></svg>', "segments"),
    "arcs": (
        f'{BOX}<path {INK} d="M0 0{"A9 9 0 1 1 50 5 9 9 0 1 1 0 0" * 40_000}"/></svg>',
        "points|segments",
    ),
    "scribble": (
        BOX
        + '<path d="M0 0'
        + "".join(f"L{i * 37 % 100} {i * 61 % 100}" for i in range(60_000))
        + '"/></svg>',
        "longer than",
    ),
    "planes": (
        BOX + '<rect width="99" height="99" fill="red" opacity=".5"/>' * 500 + "</svg>",
        "times",
    ),
    "style": (f"{BOX}<style>{'a{' * 150_000}</style></svg>", "style longer"),
    "attribute": (f'{BOX}<g transform="{"scale(1)" * 2000}"/></svg>', "longer than"),
    "no XML": ("hello", "not XML"),
    "empty": ("", "not XML"),
    "no SVG": ("<html/>", "not SVG"),
    "compressed": (b"\x1f\x8b\x08", "gunzip"),
    "bytes": (bytes(range(256)), "not XML"),
    "large": (b" " * 10_000_001, "10 MB"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_file_gets_one_line_quickly(name, tmp_path):
    text, words = HOSTILE[name]
    path = tmp_path / "evil.svg"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    begun = time.process_time()
    with pytest.raises(ValueError, match=words) as caught:
        load_svg(path)
    assert time.process_time() - begun < HANGS
    assert "\n" not in str(caught.value) and "evil.svg" in str(caught.value)


def test_ordinary_doctype_is_no_harm(tmp_path):
    kind = (
        '<!DOCTYPE svg PUBLIC "-//W3C//DTD SVG 1.1//EN" '
        '"http://www.w3.org/Graphics/SVG/1.1/DTD/svg11.dtd">'
    )
    (tmp_path / "a.svg").write_text(f'{kind}{BOX}<path {INK} d="M0 9H9"/></svg>')
    assert len(load_svg(tmp_path / "a.svg").strokes) == 1


def test_missing_file_and_folder(tmp_path):
    for path in (tmp_path / "none.svg", tmp_path):
        with pytest.raises(ValueError, match=re.escape(path.name)):
            load_svg(path)


def test_digits_without_end_take_no_time():
    begun = time.process_time()
    assert svg_path.outlines("M0 " + "1" * 3_000_000) == []
    assert len(svg_path.outlines("M0 0" + " " * 3_000_000)) == 1
    assert time.process_time() - begun < HANGS
