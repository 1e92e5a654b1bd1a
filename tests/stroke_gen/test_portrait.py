"""Portraits: marks settle on what the photo shows, small faces get less, symbols grow up."""

import cv2
import numpy as np
import pytest
from fake_box import box
from test_subject import looked_at, photo

from stroke_gen import eyes, marks, portrait, subject
from stroke_gen.colour import oklab
from stroke_gen.marks import Mark
from stroke_gen.symbols import symbols


@pytest.fixture(scope="module")
def sitter():
    """The astronaut's face, and the photo's OKLab."""
    seen, lab = looked_at(photo("astronaut.png"))
    return seen.faces[0], lab


def features(sitter, factor=1.0):
    face, lab = sitter
    small = subject.Face(face.landmarks * np.float32(factor), face.score)
    size = tuple(round(factor * n) for n in lab.shape[1::-1])
    return small, portrait.features(
        small, cv2.resize(lab, size, interpolation=cv2.INTER_AREA), np.random.default_rng(0)
    )


def test_a_line_settles_on_the_darkness_beside_it():
    y, x = np.mgrid[:80, :200].astype(np.float32)
    there = 40 + 4 * np.sin(x / 25)
    dark = np.exp(-((y + 0.5 - there) ** 2) / 4).astype(np.float32)
    begun = np.stack([np.linspace(10, 190, 200), np.full(200, 40.0)], 1).astype(np.float32)
    path = marks.settled(begun, dark, 6.0)
    off = path[:, 1] - (40 + 4 * np.sin((path[:, 0] - 0.5) / 25))
    assert np.abs(off).max() < 0.8
    assert (
        np.abs(marks.settled(begun, 0 * dark, 6.0)[:, 1] - 40).max() < 0.1
    )  # nothing there: it stays


def test_a_curve_keeps_its_ends_and_steps_evenly():
    path = marks.curve(np.float32([[0, 0], [10, 0], [10, 10], [30, 10]]), 0.5)
    assert path[0].tolist() == [0, 0] and path[-1].tolist() == [30, 10]
    steps = np.hypot(*np.diff(path, axis=0).T)
    assert steps.min() > 0.35 and steps.max() < 0.65


@pytest.mark.parametrize(("across", "radius"), [(-0.12, 0.19), (0.0, 0.21), (0.15, 0.2)])
def test_the_iris_is_where_it_looks(across, radius):
    """A dark disc on a white eye 40 cells wide is found, whichever way it looks."""
    t = np.linspace(0, np.pi, 9)
    top = np.stack([50 - 20 * np.cos(t), 50 - 8 * np.sin(t)], 1)
    ring = np.concatenate([top, (top * [1, -1] + [0, 100])[::-1]]).astype(np.float32)
    middle = np.array([50 + 40 * across, 49.0])
    points = np.mgrid[30:70:0.5, 42:58:0.5].reshape(2, -1).T.astype(np.float32)
    inside = cv2.fillPoly(np.zeros((100, 100), np.uint8), [ring.astype(np.int32)], 1)
    points = points[inside[tuple(points.astype(int).T[::-1])] > 0]
    level = np.where(np.linalg.norm(points - middle, axis=1) < 40 * radius, 0.25, 0.8)
    centre, found = eyes._disc(points, level, ring, 40.0)
    assert np.linalg.norm(centre - middle) < 2 and found == pytest.approx(40 * radius, rel=0.2)


def test_each_feature_is_drawn_where_it_is(sitter):
    face, made = features(sitter)
    areas = {
        "iris": [face.path((*subject.UPPER_LID[i], *subject.LOWER_LID[i])) for i in (0, 1)],
        "brow": [face.path((*subject.BROW_TOP[i], *subject.BROW_BOTTOM[i])) for i in (0, 1)],
        "lips": [face.path((*subject.LIP_TOP, *subject.LIP_BOTTOM))],
        "nose": [face.path(portrait.NOSE)],
    }
    for role, shapes in areas.items():
        mine = [mark.path.mean(0) for mark in made if mark.role == role]
        for shape in shapes:
            near = [p for p in mine if np.linalg.norm(p - shape.mean(0)) < 0.2 * face.height]
            assert near, f"no {role}"
    for mark in made:
        assert (
            mark.pressure.min() >= 0
            and mark.pressure.max() <= 1
            and len(mark.path) == len(mark.pressure)
        )


def test_lines_begin_and_end_lightly(sitter):
    _, made = features(sitter)
    (lid, *_) = (mark for mark in made if mark.role == "lid")
    assert max(lid.pressure[0], lid.pressure[-1]) < 0.7 * lid.pressure.max()


def test_an_open_smile_keeps_its_teeth(sitter):
    face, lab = sitter
    assert portrait.parted(face)
    white, _, _ = portrait.kept(subject.Subject((face,), lab[..., 0]), lab.shape[:2])
    x, y = face.path(subject.MOUTH_TOP + subject.MOUTH_BOTTOM).mean(0).astype(int)
    assert white[y, x] == 1
    closed = face.landmarks.copy()
    closed[list(subject.MOUTH_BOTTOM)] = closed[list(subject.MOUTH_TOP)]
    shut = subject.Face(closed, 1.0)
    assert not portrait.parted(shut)
    assert portrait.kept(subject.Subject((shut,), lab[..., 0]), lab.shape[:2])[0][y, x] == 0


@pytest.mark.parametrize(("eye", "roles"), [
    (12, {"lid", "lips", "brow", "mouth"}), (7, {"lid", "pupil", "brow"}), (4, {"lid", "mouth"}),
])  # fmt: skip
def test_small_faces_get_less(sitter, eye, roles):
    face, made = features(sitter, eye / sitter[0].eye_width)
    assert face.eye_width == pytest.approx(eye, rel=0.01)
    assert roles <= {mark.role for mark in made}
    assert len(made) <= {12: 400, 7: 40, 4: 3}[eye]


def test_the_same_marks_at_any_place_of_the_sheet(sitter):
    face, lab = sitter
    moved = np.roll(lab, (40, -24), (0, 1))
    there = subject.Face(face.landmarks + np.float32([-24, 40]), face.score)
    here = portrait.features(face, lab, np.random.default_rng(0))
    gone = portrait.features(there, np.ascontiguousarray(moved), np.random.default_rng(0))
    assert len(here) == len(gone)
    assert (
        max(
            np.abs(a.path - b.path + np.float32([-24, 40])).max()
            for a, b in zip(here, gone, strict=True)
        )
        < 0.05
    )


def test_marks_stay_on_the_paper_that_may_be_drawn_on():
    path = np.stack([np.linspace(5, 95, 181), np.full(181, 20.0)], 1).astype(np.float32)
    inside = np.ones((40, 100), np.float32)
    inside[:, 40:60] = 0
    pieces = Mark(path, np.ones(181, np.float32), np.zeros(3, np.float32), 2.0, "lid").within(
        inside
    )
    assert len(pieces) == 2
    assert pieces[0].path[:, 0].max() < 40.6 and pieces[1].path[:, 0].min() > 59.4


def test_lines_on_skin_take_skins_crayons_and_irises_any():
    names = {"peach": (0.8, 0.5, 0.35), "brown": (0.2, 0.08, 0.03), "red": (0.6, 0.03, 0.03),
             "blue": (0.05, 0.15, 0.5), "green": (0.05, 0.3, 0.1),
             "black": (0.02, 0.02, 0.02)}  # fmt: skip
    heavy = np.array(list(names.values()), np.float32)[:, None]
    table = oklab(1 - (1 - heavy) * np.float32([0.5, 0.9, 1])[:, None])  # (k, p, 3), on white paper

    def crayon(role, rgb):
        colour = oklab(np.float32(rgb))
        mark = Mark(np.zeros((2, 2), np.float32), np.ones(2, np.float32), colour, 2.0, role)
        return list(names)[marks._crayon(mark, table)[0]]

    red, blue = (0.5, 0.03, 0.03), (0.05, 0.15, 0.5)
    assert crayon("nose", red) in ("brown", "black") and crayon("jaw", blue) in ("brown", "black")
    assert crayon("lips", red) == "red" and crayon("iris", blue) == "blue"


def test_strokes_press_within_what_wax_bears(sitter):
    _, made = features(sitter)
    strokes = marks.strokes(made, box(), 0.33, np.random.default_rng(0))
    assert len(strokes) == len(made)
    for stroke in strokes:
        assert stroke.tip.kind == "sharp" and stroke.tip.width_mm >= marks.FINEST_MM
        assert stroke.force_n.max() / (0.785 * stroke.tip.width_mm**2) < 1.6


def test_symbols_grow_with_age(sitter):
    face, lab = sitter
    made = {age: symbols(face, lab, age, np.random.default_rng(0)) for age in (3, 5, 8, 10)}
    counts = [len(made[age]) for age in (3, 5, 8, 10)]
    assert counts[0] == 3 and counts == sorted(set(counts))  # two eyes and a mouth; more each time
    widths = [made[age][0].width for age in (3, 5, 8, 10)]
    assert widths == sorted(widths, reverse=True)
    for marks_ in made.values():
        middles = np.array([mark.path.mean(0) for mark in marks_])
        for feature in (subject.UPPER_LID[0], subject.UPPER_LID[1], subject.MOUTH_TOP):
            place = face.path(feature).mean(0)
            assert np.linalg.norm(middles - place, axis=1).min() < 0.12 * face.height


def test_a_smile_is_a_smile_at_every_age(sitter):
    face, lab = sitter
    for age in (3, 5):
        mouth = symbols(face, lab, age, np.random.default_rng(0))[-1].path
        ends, middle = mouth[[0, -1]].mean(0), mouth[len(mouth) // 2]
        assert (middle - ends) @ face.down > 0.02 * face.height
