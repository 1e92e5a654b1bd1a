"""The generator as a whole: any picture gives strokes that can be drawn, the same ones for the same
seed.
"""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from fake_box import PAPER, FlatSheet, box
from skimage.color import deltaE_ciede2000, rgb2lab

from crayonize.images.read import read_linear
from crayonize.pipeline import draw, sketch
from crayonize.settings import Settings
from stroke_gen import analysis, portrait
from stroke_gen.colour import from_oklab, oklab
from stroke_gen.drawing import Drawing, check_drawing
from stroke_gen.drawing_file import load_drawing, save_drawing
from stroke_gen.generate import FINEST, generate, stages
from stroke_gen.params import load_style, style_names
from stroke_gen.subject import Subject
from stroke_gen.swatches import Swatches, firmness

TABLE = box()
LONG_MM = 72.0


@pytest.fixture(autouse=True)
def coarse(monkeypatch):
    """A work grid as coarse against the crayon as that of an A4 sheet."""
    monkeypatch.setattr(analysis, "WORK_LONG", 155)


def clouds(seed=0, shape=(60, 80)):
    noise = np.random.default_rng(seed).random((*shape, 3)).astype(np.float32)
    smooth = cv2.GaussianBlur(noise, (0, 0), 4)
    return (smooth - smooth.min()) / (smooth.max() - smooth.min())


def noise(*shape):
    return np.random.default_rng(1).random((*shape, 3)).astype(np.float32)


def waves(low, high, tint=(1, 1, 1)):
    y, x = np.mgrid[:60, :80] / 20
    level = low + (high - low) * (0.5 + 0.5 * np.sin(2 * x) * np.cos(1.7 * y))
    return (level[..., None] * np.array(tint)).astype(np.float32)


def line_art():
    page = np.full((240, 320, 3), 255, np.uint8)
    cv2.circle(page, (160, 120), 80, (0, 0, 0), 3)
    cv2.line(page, (10, 10), (300, 220), (0, 0, 0), 3)
    cv2.putText(page, "Wax", (40, 200), cv2.FONT_HERSHEY_SIMPLEX, 2, (0, 0, 0), 3)
    return read_linear(page)


def logo(ground):
    """A red ring on nothing, laid on the paper's colour as `sketch` is to be given it."""
    picture = np.zeros((100, 120, 4), np.uint8)
    cv2.circle(picture, (60, 50), 38, (210, 30, 40, 255), -1)
    cv2.circle(picture, (60, 50), 16, (0, 0, 0, 0), -1)
    return read_linear(picture, None, ground)


PICTURES = {
    "1x1": noise(1, 1),
    "1x600": noise(1, 600),
    "600x1": noise(600, 1),
    "2x2": noise(2, 2),
    "tiny": noise(16, 16),
    "white": np.ones((60, 80, 3), np.float32),
    "black": np.zeros((60, 80, 3), np.float32),
    "grey": np.full((60, 80, 3), 0.2, np.float32),
    "noise": noise(150, 110),
    "lines": line_art(),
    "logo": logo((1.0, 1.0, 1.0)),
    "logo on black": logo((0.012, 0.011, 0.012)),
    "fog": waves(0.5, 0.51),
    "night": waves(0.0, 0.08, (0.6, 0.8, 1.0)),
    "high-key": waves(0.7, 1.0, (1.0, 0.98, 0.95)),
    "clouds": clouds(),
}


def sheet_mm(photo):
    scale = LONG_MM / max(photo.shape[:2])
    return max(1.0, photo.shape[1] * scale), max(1.0, photo.shape[0] * scale)


def nobody(photo):
    """A subject that is none."""
    return Subject((), np.zeros(analysis.work_shape(*sheet_mm(photo)), np.float32))


def strokes_for(photo, style="artist", seed=0, table=TABLE, threads=2, who=None, **options):
    style = load_style(style) if isinstance(style, str) else style
    sheet = FlatSheet(*sheet_mm(photo), table)
    hand = {"draw": sheet.draw, "look": sheet.look}
    return generate(
        photo,
        who or nobody(photo),
        sheet_mm(photo),
        table,
        style,
        seed,
        threads=threads,
        **hand,
        **options,
    )


def in_stages(photo, style="artist", who=None, **options):
    """The strokes of each time that the generator draws."""
    drawn, sheet = [], FlatSheet(*sheet_mm(photo))

    def draw(strokes):
        drawn.append(strokes)
        sheet.draw(strokes)

    style = load_style(style) if isinstance(style, str) else style
    generate(
        photo,
        who or nobody(photo),
        sheet_mm(photo),
        TABLE,
        style,
        0,
        draw=draw,
        look=sheet.look,
        threads=2,
        **options,
    )
    return drawn


def shown(photo, strokes, table=TABLE):
    """What strokes show on a flat sheet."""
    sheet = FlatSheet(*sheet_mm(photo), table)
    sheet.look((90, 120))
    sheet.draw(strokes)
    return sheet.look((90, 120))


def checked(strokes, photo):
    """The strokes as a drawing that keeps the rules of the file."""
    width, height = sheet_mm(photo)
    drawing = Drawing(width, height, "drawing", "box24", tuple(strokes))
    check_drawing(drawing, "drawing")
    for stroke in strokes:
        assert np.isfinite(stroke.path_mm).all() and np.isfinite(stroke.force_n).all()
    return drawing


def same(one, two):
    return len(one) == len(two) and all(
        a.crayon == b.crayon and a.tip == b.tip and a.note == b.note
        and np.array_equal(a.path_mm, b.path_mm) and np.array_equal(a.force_n, b.force_n)
        for a, b in zip(one, two, strict=True)
    )  # fmt: skip


# ---- any picture ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "style, name",
    [("artist", "1x600"), ("artist", "600x1"), *(("child", name) for name in PICTURES)],
)
def test_any_picture_gives_strokes_that_can_be_drawn(style, name):
    photo = PICTURES[name]
    checked(strokes_for(photo, style), photo)


@pytest.mark.parametrize("seed", range(8))
def test_the_hand_is_held_back_on_a_thread_of_a_sheet(seed):
    photo = PICTURES["600x1"]
    checked(strokes_for(photo, replace(load_style("child"), overshoot=2.0), seed), photo)


@pytest.mark.parametrize("style", style_names())
def test_every_style_draws(style):
    strokes = strokes_for(PICTURES["clouds"], style)
    checked(strokes, PICTURES["clouds"])
    assert {s.note for s in strokes} <= {coat.name for coat in load_style(style).passes} | {"line"}
    assert len({s.crayon for s in strokes}) <= load_style(style).crayons
    assert len(strokes) > 20


@pytest.mark.parametrize("style", style_names())
def test_white_stays_white(style):
    assert strokes_for(PICTURES["white"], style) == []


@pytest.mark.parametrize("style", style_names())
def test_white_takes_no_crayon_but_white(style):
    assert {s.crayon for s in strokes_for(PICTURES["white"], style)} <= {"white"}


@pytest.mark.parametrize("style", style_names())
def test_black_is_dark_everywhere(style):
    photo = PICTURES["black"]
    strokes = strokes_for(photo, replace(load_style(style), fade=0.0, margin_mm=0.0))
    lightness = dict(zip(TABLE.names, TABLE.lightness(), strict=True))
    assert strokes and all(lightness[s.crayon] < 0.5 for s in strokes)
    light = oklab(shown(photo, strokes))[..., 0]
    # as dark as one heavy coat of this hand's, nearly
    dark = TABLE.upto(load_style(style).hardest).lightness().min() + 0.145
    assert (light < dark).mean() > (0.7 if style == "sketch" else 0.9), "a sketch is open"
    rim = np.concatenate([light[0], light[-1], light[:, 0], light[:, -1]])
    assert (rim < dark).mean() > (0.5 if style == "sketch" else 0.8), "no pale frame"


@pytest.mark.parametrize("style", style_names())
def test_the_margin_is_left(style):
    style = replace(load_style(style), margin_mm=8.0)
    light = shown(PICTURES["black"], strokes_for(PICTURES["black"], style))
    bare = np.abs(light - PAPER).max(2) < 1e-3
    rim = np.concatenate(
        [bare[:3].ravel(), bare[-3:].ravel(), bare[:, :3].ravel(), bare[:, -3:].ravel()]
    )
    assert rim.mean() > 0.95 and bare[30:-30, 30:-30].mean() < 0.6


def test_paper_is_left_around_line_art():
    photo = PICTURES["lines"]
    light = oklab(shown(photo, strokes_for(photo)))[..., 0]
    ink = (analysis.fit(photo, (90, 120))[..., 0] < 0.9).astype(np.uint8)
    black = cv2.dilate(ink, np.ones((9, 9), np.uint8))
    assert (light[black == 0] > 0.97 * oklab(PAPER)[0]).mean() > 0.95
    drawn, wanted = (
        cv2.GaussianBlur(1 - seen, (0, 0), 1.5)  # half a tip
        for seen in (light, oklab(analysis.fit(photo, (90, 120)))[..., 0])
    )
    assert np.corrcoef(drawn.ravel(), wanted.ravel())[0, 1] > 0.8, "the ink is where it was"


def test_logo_takes_the_paper_for_what_is_transparent():
    photo = PICTURES["logo"]
    light = shown(photo, strokes_for(photo))
    lab = oklab(light)
    assert np.allclose(light[2:8, 2:8], PAPER, atol=0.03) and lab[45, 60, 0] > 0.9, (
        "corners and the hole are bare"
    )
    assert lab[20, 60, 1] > 0.15, "the ring is red"


def test_likeness_from_afar():
    """The closed loop ends near its target on a sheet that does what the table says."""
    photo = PICTURES["clouds"]
    style = load_style("artist")
    lab = analysis.tone_map(
        oklab(analysis.fit(photo, (90, 120))),
        TABLE.upto(style.hardest),
        style,
        style.tip_mm * 120 / LONG_MM,
    )
    target = analysis.far(from_oklab(lab))
    off = [np.linalg.norm(analysis.far(shown(photo, strokes)) - target, axis=2).mean()
           for strokes in ([], strokes_for(photo))]  # fmt: skip
    assert off[1] < 0.35 * off[0]


def test_on_dark_paper_lights_are_drawn_and_darks_left():
    paper = np.array((0.012, 0.012, 0.012), np.float32)
    dark = box(paper)
    photo = np.tile(paper, (240, 320, 1))
    photo[60:180, 100:220] = 0.9
    for name in ("artist", "child"):
        light = shown(
            photo, strokes_for(photo, replace(load_style(name), lift=0.0), table=dark), dark
        )
        assert oklab(light)[30:60, 45:75, 0].mean() > 0.8
        assert np.abs(light[3:15, 3:25] - paper).max() < 0.01


def test_a_palette_of_a_hundred_crayons():
    times = -(-100 // len(TABLE.names))
    shades = (
        np.random.default_rng(2)
        .uniform(0.7, 1, (len(TABLE.names) * times, 1, 3))
        .astype(np.float32)
    )
    many = Swatches(
        tuple(f"crayon {i}" for i in range(len(shades))),
        TABLE.pressures,
        np.tile(TABLE.a, (1, times, 1, 1)),
        np.tile(TABLE.b, (1, times, 1, 1)) * shades,
        np.tile(TABLE.grain, (times, 1)),
        TABLE.paper,
    )
    checked(strokes_for(PICTURES["clouds"], table=many), PICTURES["clouds"])


def test_a_single_crayon():
    only = TABLE.only([TABLE.names.index("blue")])
    assert {s.crayon for s in strokes_for(PICTURES["clouds"], table=only)} == {"blue"}


# ---- the same and not the same -------------------------------------------------------------------


@pytest.mark.parametrize("style", style_names())
def test_same_seed_same_strokes_with_any_number_of_threads(style):
    first = strokes_for(PICTURES["clouds"], style, threads=1)
    before = cv2.getNumThreads()
    try:
        for threads, cv_threads in ((2, 1), (4, 4)):
            cv2.setNumThreads(cv_threads)
            assert same(first, strokes_for(PICTURES["clouds"], style, threads=threads))
    finally:
        cv2.setNumThreads(before)


def test_other_seed_other_strokes_of_the_same_picture():
    one, other = strokes_for(PICTURES["clouds"], seed=0), strokes_for(PICTURES["clouds"], seed=1)
    assert not same(one, other)
    assert 0.6 < len(one) / len(other) < 1.7
    apart = analysis.far(shown(PICTURES["clouds"], one)) - analysis.far(
        shown(PICTURES["clouds"], other)
    )
    assert np.linalg.norm(apart, axis=2).mean() < 0.08


def test_saving_and_loading_changes_no_stroke(tmp_path):
    style = replace(load_style("child"), tip_mm=4.2345, line_tip=0.337)
    strokes = strokes_for(PICTURES["clouds"], style)
    save_drawing(checked(strokes, PICTURES["clouds"]), tmp_path / "d.json")
    assert same(strokes, load_drawing(tmp_path / "d.json").strokes)


@pytest.mark.parametrize("style", style_names())
def test_it_draws_as_often_as_it_says_coat_by_coat_and_light_before_dark(style):
    style = load_style(style)
    drawn = in_stages(face_like(), style)
    assert len(drawn) == stages(style)
    order = [coat.name for coat in style.passes]
    middle = [some[0].note for some in drawn[2 * style.lines_first : -2] if some]
    assert middle and middle == sorted(middle, key=order.index)
    lightness = dict(zip(TABLE.names, TABLE.lightness(), strict=True))
    for some in drawn:
        assert len({s.note for s in some}) <= 1
        assert np.diff([lightness[s.crayon] for s in some[:: style.search]]).max(initial=-1) <= 1e-6


def test_only_a_child_draws_lines_first():
    photo = face_like()
    photo[photo[..., 2] > 0.65] = (0.75, 0.85, 0.95)  # a sky the disc stands out against
    for name in style_names():
        drawn = in_stages(photo, name, sitter(photo))
        first = next(some for some in drawn if some)[0].note
        assert (first == "line") == (name == "child"), name
        assert {s.note for some in drawn for s in some} >= {"line"}, name


def test_a_coat_is_pressed_as_hard_as_it_says():
    style = load_style("artist")
    soft, hard = (
        in_stages(
            PICTURES["clouds"], replace(style, passes=(replace(style.passes[0], press=press),))
        )[0]
        for press in (1.0, 1.5)
    )
    assert len(soft) > 10
    for one, two in zip(soft, hard, strict=True):
        assert np.array_equal(one.path_mm, two.path_mm)
        np.testing.assert_allclose(two.force_n, (1.5 * one.force_n).clip(0.02, 60), atol=0.011)


@pytest.mark.parametrize("hardest", [0.1, 0.2, 0.38, 0.95])
def test_the_hand_fills_no_harder_than_its_style_says(hardest):
    """As the table counts, for a hand that presses evenly; features are pressed as they ask."""
    style = replace(load_style("artist"), hardest=hardest, force_spread=0.0, swell=0.0)
    press = {coat.name: coat.press for coat in style.passes if coat.kind != "touch"}
    strokes = [s for s in strokes_for(PICTURES["black"], style) if s.note in press]
    firm = [
        s.force_n.max() / (0.785 * s.tip.width_mm**2) / firmness(s.tip.width_mm) / press[s.note]
        for s in strokes
    ]
    assert 0.5 * hardest < max(firm) < 1.03 * hardest


def widths_on(radius, style):
    """Mean width of the blunt tips in a subject so many mm across."""
    photo = np.full((60, 80, 3), 0.2, np.float32)
    mask = nobody(photo).mask.copy()
    h, w = mask.shape
    cv2.circle(mask, (w // 2, h // 2), round(radius * w / LONG_MM), 1.0, -1)
    centre = np.array(sheet_mm(photo)) / 2
    return np.mean([
        s.tip.width_mm
        for s in strokes_for(photo, style, who=Subject((), mask))
        if s.tip.kind == "blunt" and np.linalg.norm(s.path_mm - centre, axis=1).max() < radius
    ])  # fmt: skip


def test_a_small_subject_takes_finer_tips_than_a_large_one():
    """But no wider than the coat says, and not beyond what a tip can be."""
    style = load_style("artist")
    style = replace(style, passes=(replace(style.passes[0], fine=0.6),))
    large, middle, small, tiny = (widths_on(r, style) for r in (26, 18, 8, 5))
    assert large == pytest.approx(style.passes[0].fine * style.tip_mm, rel=0.02)
    assert large > 1.1 * middle > 1.1 * small
    assert [small, tiny] == pytest.approx(2 * [FINEST * style.tip_mm], rel=0.02)
    sharp = replace(style, passes=(replace(style.passes[0], fine=0.25),))
    assert widths_on(8, sharp) == pytest.approx(0.25 * style.tip_mm, rel=0.02)


def test_whites_of_eyes_take_less_wax_than_skin_but_some(monkeypatch):
    photo = np.full((60, 80, 3), 0.1, np.float32)
    white = nobody(photo).mask.copy()
    white[:, : white.shape[1] // 2] = 1
    monkeypatch.setattr(portrait, "kept", lambda *_: (white, 0 * white, 0 * white))
    style = replace(load_style("artist"), open=0.0, passes=load_style("artist").passes[:1])
    dark = 1 - oklab(shown(photo, strokes_for(photo, style)))[15:75, :, 0] / oklab(PAPER)[0]
    eye, skin = dark[:, 15:50].mean(), dark[:, 70:105].mean()
    assert 0.15 * skin < eye < 0.8 * skin


def test_focus_draws_finer_there():
    plain = PICTURES["grey"] + 0.1 * clouds(3)
    wide = []
    for boxes in ([], [(0.0, 0.0, 0.5, 1.0)]):
        some = [s for s in strokes_for(plain, focus=boxes) if s.tip.kind == "blunt"]
        left = [s.tip.width_mm for s in some if s.path_mm[:, 0].max() < 0.45 * LONG_MM]
        right = [s.tip.width_mm for s in some if s.path_mm[:, 0].min() > 0.6 * LONG_MM]
        wide.append([np.mean(left), np.mean(right)])
    left, right = np.log(np.array(wide[0]) / wide[1])
    assert left > np.log(1.25) and abs(right) < left / 8, "there, and not elsewhere"


def test_the_ground_is_hatched_wider_than_the_subject():
    """Lines of the first coat stand 1 + open times as far apart there; later coats fill gaps."""
    photo = np.full((60, 80, 3), 0.2, np.float32)
    mask = nobody(photo).mask.copy()
    mask[:, : mask.shape[1] // 2] = 1
    hatched = []
    for gaps in (0.0, 1.0, 2.0):
        style = replace(load_style("artist"), open=gaps)
        first = next(some for some in in_stages(photo, style, Subject((), mask)) if some)
        inked = [(s.path_mm[:, 0].mean() < LONG_MM / 2, travel(s) * s.tip.width_mm) for s in first]
        hatched.append([sum(mm2 for left, mm2 in inked if left == side) for side in (True, False)])
    subject, ground = np.transpose(hatched)
    assert ground[1:] / ground[0] == pytest.approx([1 / 2, 1 / 3], rel=0.2)
    assert (subject[1:] / subject[0] > 1.3 * ground[1:] / ground[0]).all()


# ---- styles are hands of their own ---------------------------------------------------------------


def face_like():
    """A disc with eyes on a ground of two colours: something to draw for every coat and line."""
    photo = np.tile(np.array((0.35, 0.5, 0.7), np.float32), (240, 320, 1))
    photo[160:] = (0.15, 0.3, 0.1)
    cv2.circle(photo, (150, 120), 80, (0.6, 0.35, 0.25), -1, cv2.LINE_AA)
    for x in (120, 180):
        cv2.circle(photo, (x, 100), 9, (0.02, 0.02, 0.03), -1, cv2.LINE_AA)
    cv2.ellipse(photo, (150, 150), (35, 12), 0, 0, 180, (0.3, 0.03, 0.03), 6, cv2.LINE_AA)
    return photo


def sitter(photo):
    """The disc of `face_like` as its subject."""
    h, w = analysis.work_shape(*sheet_mm(photo))
    mask = np.zeros((h, w), np.float32)
    cv2.circle(mask, (w * 150 // 320, h // 2), w // 4, 1.0, -1)
    return Subject((), mask)


@pytest.fixture(scope="module")
def hands():
    """Strokes of each style for one picture, and the sheet they give."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(analysis, "WORK_LONG", 155)
        photo = face_like()
        strokes = {name: strokes_for(photo, name, who=sitter(photo)) for name in style_names()}
        return {name: (some, shown(photo, some)) for name, some in strokes.items()}


def travel(stroke):
    """Length of a stroke in mm."""
    return float(np.hypot(*np.diff(stroke.path_mm, axis=0).T).sum())


def bare_share(light):
    return float((np.abs(light - PAPER).max(2) < 1e-3).mean())


def test_a_sketch_leaves_more_paper_than_an_artist_and_he_more_than_a_solid_hand(hands):
    bare = {name: bare_share(light) for name, (_, light) in hands.items()}
    assert bare["sketch"] > bare["artist"] + 0.1 and bare["artist"] > bare["solid"]
    assert bare["sketch"] < 0.75 and bare["solid"] < 0.1, bare


def test_a_sketch_leaves_out_the_ground_and_not_the_sitter(hands):
    bare = np.abs(hands["sketch"][1] - PAPER).max(2) < 1e-3
    y, x = np.mgrid[:90, :120]
    inner = np.hypot(x - 56, y - 45) < 25
    far = np.hypot(x - 56, y - 45) > 50
    assert bare[far].mean() > bare[inner].mean() + 0.3


def test_each_style_is_a_hand_of_its_own(hands):
    """Every two differ clearly in paper left, width of tips, lines' share, crayons, length or
    force.
    """

    def figures(name):
        strokes, light = hands[name]
        length = np.array([travel(s) for s in strokes])
        line = np.array([s.note == "line" for s in strokes])
        width = np.array([s.tip.width_mm for s in strokes])
        return np.array(
            [
                np.log(0.02 + bare_share(light)),
                np.log((width * length).sum() / length.sum()),
                np.log(0.02 + length[line].sum() / length.sum()),
                np.log(len({s.crayon for s in strokes})),
                np.log(length[~line].mean()),
                np.log(
                    np.median(
                        [
                            s.force_n.mean() / s.tip.width_mm**1.25
                            for s in strokes
                            if s.note != "line"
                        ]
                    )
                ),
            ]
        )

    of = {name: figures(name) for name in hands}
    for one in hands:
        for other in hands:
            if one < other:
                assert np.abs(of[one] - of[other]).max() > np.log(1.4), (one, other)


def test_a_solid_hand_presses_hardest_and_a_fine_one_is_finest(hands):
    def mean(name, value):
        some = [s for s in hands[name][0] if s.note != "line"]
        return np.average([value(s) for s in some], weights=[travel(s) for s in some])

    width = {name: mean(name, lambda s: s.tip.width_mm) for name in hands}
    assert min(width, key=width.get) == "fine" and max(width, key=width.get) == "child"
    force = {
        name: mean(name, lambda s: s.force_n.mean() / s.tip.width_mm**1.25)
        for name in ("artist", "solid")
    }
    assert force["solid"] > 1.15 * force["artist"]


def test_a_fine_hand_comes_nearer_to_the_photo_than_a_child(hands):
    """However light it draws: tones are compared as far as one line does not bring them in."""
    inner = np.s_[20:70, 30:80]
    target = analysis.far(analysis.fit(face_like(), (90, 120)))[inner]

    def off(name):
        seen = analysis.far(hands[name][1])[inner]
        line = np.polyfit(seen[..., 0].ravel(), target[..., 0].ravel(), 1)
        seen[..., 0] = np.polyval(line, seen[..., 0])
        return np.linalg.norm(seen - target, axis=2).mean()

    fine, child = off("fine"), off("child")
    assert fine < 0.7 * child


@pytest.mark.parametrize("style", style_names())
def test_strokes_stay_on_the_sheet(style):
    """A hand may slip over the border of the sheet, but not further than its overshoot and half a
    line.
    """
    for changes in ({}, {"margin_mm": 0.0}):
        hand = replace(load_style(style), **changes)
        points = np.concatenate([s.path_mm for s in strokes_for(PICTURES["black"], hand)])
        over = np.maximum(-points, points - sheet_mm(PICTURES["black"])).max(1)
        assert np.percentile(over, 99) < 2.5 and over.max() < 10, "mm"


# ---- on real wax ---------------------------------------------------------------------------------


def drawn(photo, size=120, **changes):
    return sketch(photo, Settings(size=size, sheet_mm=LONG_MM, **changes))


@pytest.mark.parametrize("name", [n for n in PICTURES if n not in ("1x600", "600x1")])
def test_any_picture_is_drawn_in_wax(name):
    drawing, easel = drawn(PICTURES[name])
    check_drawing(drawing, name)
    light = easel.picture()
    assert np.isfinite(light).all() and light.min() >= 0 and light.max() <= 1.2
    if name == "white":
        assert light.min() > 0.5
    if name == "black":
        assert np.median(light) < 0.05


@pytest.mark.parametrize("name", ["1x600", "600x1"])
def test_a_thread_of_a_picture_is_drawn_in_wax(name):
    check_drawing(drawn(PICTURES[name])[0], name)


@pytest.mark.parametrize("style", style_names())
def test_every_style_is_drawn_in_wax_the_same_again(style):
    first, easel = drawn(PICTURES["clouds"], style=style, threads=1)
    again, other = drawn(PICTURES["clouds"], style=style, threads=4)
    assert same(first.strokes, again.strokes)
    assert np.array_equal(easel.picture(), other.picture())


@pytest.mark.parametrize("long_mm", [LONG_MM, 71.6543])
def test_a_saved_drawing_gives_the_same_picture(tmp_path, long_mm):
    drawing, easel = sketch(PICTURES["clouds"], Settings(size=120, sheet_mm=long_mm))
    save_drawing(drawing, tmp_path / "d.json")
    assert np.array_equal(draw(load_drawing(tmp_path / "d.json"), 120).picture(), easel.picture())


def test_the_left_hand_hatches_the_other_way():
    grey = PICTURES["grey"]
    for left, expected in ((False, -50), (True, 50)):
        strokes = drawn(grey, left_handed=left)[0].strokes
        step = np.concatenate([np.diff(s.path_mm, axis=0) for s in strokes if s.note != "line"])
        angle = 0.5 * np.degrees(np.angle(((step[:, 0] + 1j * step[:, 1]) ** 2).sum()))
        assert abs(angle - expected) < 25


def test_twice_the_size_is_the_same_picture_from_afar():
    apart = []
    for seed in (5, 6):
        photo = clouds(seed, (240, 320))
        small, large = (drawn(photo, size=size)[1].picture(light=False) for size in (200, 400))
        large = cv2.resize(large, small.shape[1::-1], interpolation=cv2.INTER_AREA)
        seen = [
            rgb2lab(np.clip(cv2.GaussianBlur(p, (0, 0), 0.012 * 200), 0, 1) ** (1 / 2.2))
            for p in (small, large)
        ]
        apart.append(deltaE_ciede2000(*seen).mean())
    assert np.mean(apart) < 3.9
