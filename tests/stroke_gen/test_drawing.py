"""The drawing file: what is saved comes back, and what is wrong is named."""

import dataclasses
import io
import json
import os
import time
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from stroke_gen.drawing import Drawing, Stroke, Tip
from stroke_gen.drawing_file import drawing_from_json, drawing_to_json, load_drawing, save_drawing


def stroke(points: int = 5, seed: int = 0, **changes: Any) -> Stroke:
    rng = np.random.default_rng(seed)
    fields: dict[str, Any] = {
        "path_mm": rng.uniform(-50, 250, (points, 2)).astype(np.float32),
        "force_n": rng.uniform(0, 4, points).astype(np.float32),
        "crayon": "dark red",
        "tip": Tip(),
    }
    return Stroke(**{**fields, **changes})


def drawing(*strokes: Stroke, **changes: Any) -> Drawing:
    fields: dict[str, Any] = {
        "width_mm": 297.0,
        "height_mm": 210.0,
        "paper": "smooth",
        "palette": "box24",
    }
    return Drawing(**{**fields, "strokes": strokes, **changes})


def tilt_of(stroke: Stroke) -> NDArray[np.float32]:
    """Its tilt; upright is 0."""
    upright = np.zeros((len(stroke.path_mm), 2), np.float32)
    return upright if stroke.tilt_deg is None else stroke.tilt_deg


def equal(one: Drawing, two: Drawing) -> bool:
    def fields(d: Drawing) -> tuple[Any, ...]:
        return d.width_mm, d.height_mm, d.paper, d.palette, d.physics, d.seed, len(d.strokes)

    return fields(one) == fields(two) and all(
        (a.crayon, a.tip, a.note) == (b.crayon, b.tip, b.note)
        and np.allclose(a.path_mm, b.path_mm, rtol=0, atol=0.00052)
        and np.allclose(a.force_n, b.force_n, rtol=0, atol=0.00051)
        and np.allclose(tilt_of(a), tilt_of(b), rtol=0, atol=0.00051)
        and a.path_mm.shape == b.path_mm.shape
        for a, b in zip(one.strokes, two.strokes, strict=True)
    )


VARIED = drawing(
    stroke(7, 1),
    stroke(1, 2, crayon="blue", note="dab"),
    stroke(4, 3, tip=Tip("side", 40.0, -12.5), force_n=np.full(4, 1.2, np.float32)),
    stroke(3, 4, crayon="gr\u00fcn", tip=Tip("sharp", 1.25)),
    stroke(2, 5, path_mm=np.array([[-297, -210], [594, 420]], np.float32)),
    stroke(2, 6, path_mm=np.array([[-0.0001, 12], [0, 12.3456]], np.float32)),
    stroke(3, 7, tilt_deg=np.tile(np.float32([35.5, -45]), (3, 1))),
    stroke(2, 8, tilt_deg=np.array([[0, 90], [80, 360]], np.float32)),
    stroke(2, 9, tilt_deg=np.zeros((2, 2), np.float32)),
    paper={"tooth_um": 40, "name": "rough"},
    physics="grey levels",
    seed=2**63 - 1,
)


# ---- round trip ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "one", [VARIED, drawing(), drawing(stroke(), width_mm=250.0, height_mm=5000.0)]
)
def test_what_is_saved_comes_back(tmp_path: Path, one: Drawing) -> None:
    save_drawing(one, tmp_path / "a.json")
    back = load_drawing(tmp_path / "a.json")
    assert equal(back, one)
    for one_stroke in back.strokes:
        for array in (one_stroke.path_mm, one_stroke.force_n):
            assert array.dtype == np.float32 and array.flags.c_contiguous and array.flags.writeable


def test_same_drawing_same_bytes_and_saving_again_changes_nothing(tmp_path: Path) -> None:
    save_drawing(VARIED, tmp_path / "a.json")
    reordered = dataclasses.replace(VARIED, paper={"name": "rough", "tooth_um": 40})
    save_drawing(reordered, tmp_path / "b.json")
    save_drawing(load_drawing(tmp_path / "a.json"), tmp_path / "c.json")
    first = (tmp_path / "a.json").read_bytes()
    assert (tmp_path / "b.json").read_bytes() == first
    assert (tmp_path / "c.json").read_bytes() == first


def test_file_has_one_stroke_a_line_and_short_numbers(tmp_path: Path) -> None:
    path = np.array([[1, 2], [3.25, -0.0001], [1234.5678, 4.1]], np.float32)
    one = drawing(stroke(3, path_mm=path, force_n=np.full(3, 1.2, np.float32)), width_mm=2000.0)
    save_drawing(one, tmp_path / "a.json")
    lines = (tmp_path / "a.json").read_text().splitlines()
    assert '{"crayon":"dark red","force":1.2,"path":[[1,2],[3.25,0],[1234.568,4.1]]}' in lines
    assert lines[-1] == "]}"


def test_largest_sheet_keeps_its_thousandths(tmp_path: Path) -> None:
    path = np.array([[9999.999, -4999.999], [8192.123, 10000]], np.float32)
    one = drawing(stroke(2, path_mm=path), width_mm=5000.0, height_mm=5000.0)
    save_drawing(one, tmp_path / "a.json")
    np.testing.assert_allclose(
        load_drawing(tmp_path / "a.json").strokes[0].path_mm, path, rtol=0, atol=0.001
    )


def test_point_at_the_very_limit_survives_the_rounding_of_the_sheet(tmp_path: Path) -> None:
    path = np.array([[246.9128, -210.0]], np.float32)
    save_drawing(drawing(stroke(1, path_mm=path), width_mm=123.4564), tmp_path / "a.json")
    assert load_drawing(tmp_path / "a.json").width_mm == 123.456


def test_object_and_file_say_the_same(tmp_path: Path) -> None:
    save_drawing(VARIED, tmp_path / "a.json")
    assert json.loads((tmp_path / "a.json").read_text()) == drawing_to_json(VARIED)
    assert equal(drawing_from_json(json.loads(json.dumps(drawing_to_json(VARIED)))), VARIED)


def test_text_stream_is_read() -> None:
    assert equal(load_drawing(io.StringIO(json.dumps(drawing_to_json(VARIED)))), VARIED)


def test_twenty_thousand_strokes_take_little_more_than_json_itself(tmp_path: Path) -> None:
    """Against Python's own reader and writer in the same run, so that a busy machine changes
    nothing.
    """
    many = drawing(*[stroke(60, i % 50) for i in range(20_000)])

    def spent(function: Callable[..., Any], *given: Any) -> float:
        start = time.process_time()
        function(*given)
        return time.process_time() - start

    save = spent(save_drawing, many, tmp_path / "a.json")
    plain = drawing_to_json(many)
    assert save < 2 * spent(json.dumps, plain)
    load = spent(load_drawing, tmp_path / "a.json")
    assert load < 6 * spent(json.loads, (tmp_path / "a.json").read_text())


def test_paths_are_packed_while_the_file_is_read(tmp_path: Path) -> None:
    save_drawing(drawing(*[stroke(100, i) for i in range(500)]), tmp_path / "a.json")
    tracemalloc.start()
    load_drawing(tmp_path / "a.json")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 6 * (tmp_path / "a.json").stat().st_size


# ---- written by hand -----------------------------------------------------------------------------

HEAD: dict[str, Any] = {
    "format": "crayonize drawing",
    "version": 1,
    "sheet_mm": [100, 80],
    "paper": "smooth",
    "palette": "box24",
}


def by_hand(*strokes: Any, **changes: Any) -> dict[str, Any]:
    return {**HEAD, "strokes": list(strokes), **changes}


def test_hand_written_drawing_may_leave_out_much() -> None:
    one = drawing_from_json(by_hand({"crayon": "red", "path": [[1, 2], [3, 4]]}))
    assert (one.physics, one.seed) == ("metric", 0)
    assert one.strokes[0].tip == Tip() and one.strokes[0].note == "fill"
    assert one.strokes[0].force_n.tolist() == [1.5, 1.5]


def test_drawing_wide_tip_and_force_are_the_default_of_each_stroke() -> None:
    mine: dict[str, Any] = {"crayon": "red", "path": [[1, 2]], "tip": {"kind": "sharp"}, "force": 2}
    plain = {"crayon": "red", "path": [[1, 2]]}
    one = drawing_from_json(by_hand(plain, mine, tip={"width_mm": 4, "angle_deg": 9}, force=0.5))
    assert [s.tip for s in one.strokes] == [Tip("blunt", 4.0, 9.0), Tip("sharp", 4.0, 9.0)]
    assert [s.force_n.tolist() for s in one.strokes] == [[0.5], [2.0]]


@pytest.mark.parametrize("as_text", [False, True])
def test_force_in_a_point_wins(as_text: bool) -> None:
    path: list[list[float]] = [[1, 2, 0.5], [3, 4], [5, 6, 0]]
    given = by_hand(
        {"crayon": "red", "path": path},
        {"crayon": "red", "path": path, "force": [1, 2, 3]},
        {"crayon": "red", "path": [p[:2] for p in path], "force": [1, 2, 3]},
    )
    one = load_drawing(io.StringIO(json.dumps(given))) if as_text else drawing_from_json(given)
    assert [s.force_n.tolist() for s in one.strokes] == [[0.5, 1.5, 0], [0.5, 2, 0], [1, 2, 3]]
    assert all(s.path_mm.tolist() == [[1, 2], [3, 4], [5, 6]] for s in one.strokes)


@pytest.mark.parametrize("as_text", [False, True])
def test_tilt_is_given_once_or_for_each_point(as_text: bool) -> None:
    path = [[1, 2], [3, 4]]
    given = by_hand(
        {"crayon": "red", "path": path, "tilt": [35, 45]},
        {"crayon": "red", "path": path, "tilt": [[0, 0], [40, -90]]},
        {"crayon": "red", "path": path},
    )
    one = load_drawing(io.StringIO(json.dumps(given))) if as_text else drawing_from_json(given)
    assert [tilt_of(s).tolist() for s in one.strokes] == [
        [[35, 45], [35, 45]],
        [[0, 0], [40, -90]],
        [[0, 0], [0, 0]],
    ]
    lines = json.dumps(drawing_to_json(one))
    assert lines.count('"tilt": ') == 2 and '"tilt": [35.0, 45.0]' in lines  # upright is not said


# ---- what is wrong, and what would be right ------------------------------------------------------


def bad(**changes: Any) -> dict[str, Any]:
    """A drawing whose second stroke is wrong."""
    good = {"crayon": "red", "path": [[1, 2], [3, 4]]}
    return by_hand(good, {**good, **changes})


NAN, INF = float("nan"), float("inf")
MALFORMED: list[tuple[Any, str]] = [
    ([], "d.json: a list of 0 is not an object with format, version"),
    ({}, 'd.json: "format" is missing'),
    ({k: v for k, v in by_hand().items() if k != "palette"}, 'd.json: "palette" is missing'),
    (by_hand(format="svg"), 'd.json: format: "svg" is not "crayonize drawing"'),
    (by_hand(version=2), "d.json: version: 2 is not 1, the one this program reads"),
    (by_hand(version=True), "d.json: version: true is not 1"),
    (by_hand(stroke=[]), 'd.json: unknown key "stroke" (did you mean "strokes"?)'),
    (by_hand(sheet_mm=[100]), "d.json: sheet_mm: a list of 1 is not [width, height]"),
    (by_hand(sheet_mm=[100, 0.5]), "d.json: sheet_mm: 0.5 is not a number from 1 to 5000 mm"),
    (by_hand(sheet_mm=[INF, 10]), "d.json: sheet_mm: inf is not a number from 1 to 5000 mm"),
    (by_hand(sheet_mm=["a", 10]), 'd.json: sheet_mm: "a" is not a number'),
    (by_hand(paper=3), "d.json: paper: 3 is not text"),
    (
        by_hand(palette={"film_um": NAN}),
        "d.json: palette: not a JSON object of text and finite numbers",
    ),
    (by_hand(physics=""), 'd.json: physics: "" is not text'),
    (by_hand(seed=-1), "d.json: seed: -1 is not a whole number from 0"),
    (by_hand(seed=1.5), "d.json: seed: 1.5 is not a whole number"),
    (by_hand(seed=10**30), "d.json: seed: a huge number is not"),
    (
        by_hand(tip={"kind": "flat"}),
        'd.json: tip: kind: "flat" is no kind of tip (valid: sharp, blunt',
    ),
    (by_hand(force=-1), "d.json: force: -1 is not a number from 0 to 100 N"),
    (by_hand(strokes={}), "d.json: strokes: an object is not a list"),
    (by_hand("red"), 'd.json: stroke 1: "red" is not an object with crayon, path'),
    (by_hand({"path": [[1, 2]]}), 'd.json: stroke 1: "crayon" is missing'),
    (by_hand({"crayon": "red"}), 'd.json: stroke 1 (red): "path" is missing'),
    (bad(crayon=5), "d.json: stroke 2: crayon: 5 is not text"),
    (bad(crayon="a\nb"), 'd.json: stroke 2: crayon: "a\\nb" is not text'),
    (bad(crayon="\ud800"), 'd.json: stroke 2: crayon: "\\ud800" is not text'),
    (bad(colour="red"), 'd.json: stroke 2 (red): unknown key "colour"'),
    (bad(forse=1), 'd.json: stroke 2 (red): unknown key "forse" (did you mean "force"?)'),
    (bad(note=None), "d.json: stroke 2 (red): note: nothing is not text"),
    (bad(path=[]), "d.json: stroke 2 (red): path: a list of 0 is not a list of points"),
    (bad(path="M 1 2"), 'd.json: stroke 2 (red): path: "M 1 2" is not a list of points'),
    (
        bad(path=[[1, 2], 3]),
        "d.json: stroke 2 (red): path: point 2: 3 is not [x, y] or [x, y, force]",
    ),
    (bad(path=[[1, 2, 3, 4]]), "stroke 2 (red): path: point 1: a list of 4 is not [x, y]"),
    (bad(path=[[1, 2], [3, "4"]]), 'stroke 2 (red): path: point 2: "4" is not a finite number'),
    (bad(path=[[1, True]]), "stroke 2 (red): path: point 1: true is not a finite number"),
    (
        bad(path=[[1, 2], [None, 2]]),
        "stroke 2 (red): path: point 2: nothing is not a finite number",
    ),
    (bad(path=[[1, 2], [3, NAN]]), "stroke 2 (red): path: point 2: nan is not a finite number"),
    (
        bad(path=[[1, 2, 1], [3, 4, -INF]]),
        "stroke 2 (red): path: point 2: -inf is not a finite number",
    ),
    (
        bad(path=[[1, 10**400]]),
        "stroke 2 (red): path: point 1: a huge number is not a finite number",
    ),
    (bad(path=[[1, 2], [200.1, 2]]), "path: point 2: x = 200.1 is not from -100 to 200 mm"),
    (bad(path=[[1, -81]]), "path: point 1: y = -81 is not from -80 to 160 mm"),
    (bad(path=[[1, 1e300]]), "path: point 1: y = inf is not from -80 to 160 mm"),
    (bad(path=[[1, 2, 101]]), "stroke 2 (red): force: point 1: force = 101 is not from 0 to 100 N"),
    (bad(force=100.5), "stroke 2 (red): force: 100.5 is not a number from 0 to 100 N"),
    (bad(force=[1, -0.1]), "stroke 2 (red): force: point 2: force = -0.1 is not from 0 to 100 N"),
    (bad(force=[1]), "stroke 2 (red): force: 1 numbers for 2 points"),
    (bad(force=[1, "2"]), 'stroke 2 (red): force: "2" is not a finite number'),
    (bad(force=[1, NAN]), "stroke 2 (red): force: nan is not a finite number"),
    (bad(tilt=35), "stroke 2 (red): tilt: 35 is not [tilt, azimuth], in degrees"),
    (bad(tilt=[35]), "stroke 2 (red): tilt: a list of 1 is not [tilt, azimuth], in degrees"),
    (bad(tilt=[35, NAN]), "stroke 2 (red): tilt: a list of 2 is not [tilt, azimuth], in degrees"),
    (bad(tilt=[[1, 2]] * 3), "stroke 2 (red): tilt: 3 pairs for 2 points, give one or one for"),
    (bad(tilt=[81, 0]), "stroke 2 (red): tilt: point 1: tilt = 81 is not from 0 to 80 degrees"),
    (bad(tilt=[9, 361]), "tilt: point 1: azimuth = 361 is not from -360 to 360 degrees"),
    (
        bad(tip="blunt"),
        'stroke 2 (red): tip: "blunt" is not an object with kind, width_mm, angle_deg',
    ),
    (bad(tip={"kind": "blnt"}), 'tip: kind: "blnt" is no kind of tip (did you mean "blunt"?)'),
    (bad(tip={"kind": []}), "stroke 2 (red): tip: kind: a list of 0 is no kind of tip"),
    (bad(tip={"width": 2}), 'tip: unknown key "width" (did you mean "width_mm"?)'),
    (
        bad(tip={"width_mm": 0}),
        "stroke 2 (red): tip: width_mm: 0 is not a number from 0.1 to 200 mm",
    ),
    (
        bad(tip={"angle_deg": INF}),
        "stroke 2 (red): tip: angle_deg: inf is not a number from -360 to 360",
    ),
]


@pytest.mark.parametrize(("given", "part"), MALFORMED)
@pytest.mark.parametrize("as_text", [False, True])
def test_malformed_drawing_is_named_in_one_line(given: Any, part: str, as_text: bool) -> None:
    stream = io.StringIO(json.dumps(given))
    stream.name = "d.json"
    with pytest.raises(ValueError) as caught:
        load_drawing(stream) if as_text else drawing_from_json(given, "d.json")
    message = str(caught.value)
    assert part in message
    assert message.startswith("d.json: ") and message.isprintable() and len(message) < 250


@pytest.mark.parametrize(
    ("content", "part"),
    [
        (b"", "line 1, column 1: not JSON"),
        (b'{"format": "crayonize drawing",\n "version": 1,\n}', "line 3, column 1: not JSON"),
        (b"[" * 200_000, "nested too deeply"),
        (b'{"a":' * 200_000, "nested too deeply"),
        (b'{"seed": ' + b"9" * 5000 + b"}", "thousands of digits"),
        (b'{"seed": 1, "tip": {"kind": "rim", "kind": "side"}}', 'the key "kind" stands twice'),
        (b"\xff\xfe{}", "not UTF-8"),
    ],
)
def test_file_that_is_no_drawing_is_named_in_one_line(
    tmp_path: Path, content: bytes, part: str
) -> None:
    path = tmp_path / "d.json"
    path.write_bytes(content)
    with pytest.raises(ValueError) as caught:
        load_drawing(path)
    assert str(caught.value).startswith(f"{path}: ") and part in str(caught.value)


def test_missing_file_and_folder_are_named(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"none\.json: cannot be read"):
        load_drawing(tmp_path / "none.json")
    with pytest.raises(ValueError, match="cannot be read"):
        load_drawing(tmp_path)


def test_too_many_strokes_points_or_characters_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    given = bad()
    for limit, part in (("STROKES", "2 strokes, at most 1"), ("POINTS", "4 points, at most 1")):
        with monkeypatch.context() as patch, pytest.raises(ValueError, match=part):
            patch.setattr(f"stroke_gen.drawing.MAX_{limit}", 1)
            drawing_from_json(given)
    monkeypatch.setattr("stroke_gen.drawing_file.MAX_CHARS", 10)
    with pytest.raises(ValueError, match="longer than 10 characters"):
        load_drawing(io.StringIO(json.dumps(given)))


# ---- saving --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("wrong", "part"),
    [
        (
            drawing(stroke(2, path_mm=np.zeros((2, 3), np.float32))),
            r"stroke 1 \(dark red\): path \(2, 3\)",
        ),
        (drawing(stroke(2, force_n=np.ones(3, np.float32))), r"force \(3,\) are not of shapes"),
        (drawing(stroke(2, path_mm=np.full((2, 2), np.nan, np.float32))), "x = nan is not from"),
        (drawing(stroke(), stroke(crayon="")), "stroke 2: crayon"),
        (drawing(stroke(tip=Tip("round"))), 'kind: "round" is no kind of tip'),
        (drawing(stroke(), width_mm=NAN), "sheet_mm: nan"),
        (drawing(paper={"a": {1, 2}}), "paper: not a JSON object"),
    ],
)
def test_wrong_drawing_is_not_saved(tmp_path: Path, wrong: Drawing, part: str) -> None:
    (tmp_path / "a.json").write_text("old")
    with pytest.raises(ValueError, match=part):
        save_drawing(wrong, tmp_path / "a.json")
    with pytest.raises(ValueError, match=part):
        drawing_to_json(wrong)
    assert (tmp_path / "a.json").read_text() == "old"


@pytest.mark.parametrize("call", ["fsync", "replace"])
def test_failed_save_leaves_the_old_file_and_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call: str
) -> None:
    def fail(*_: object) -> None:
        raise OSError(28, "No space left on device")

    target = tmp_path / "a.json"
    target.write_text("old")
    monkeypatch.setattr(os, call, fail)
    with pytest.raises(OSError, match=r"No space left on device: .*a\.json") as caught:
        save_drawing(VARIED, target)
    assert caught.value.errno == 28
    assert os.listdir(tmp_path) == ["a.json"] and target.read_text() == "old"


def test_save_into_a_missing_folder_names_the_target(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"none/a\.json': the folder .* does not exist"):
        save_drawing(VARIED, tmp_path / "none" / "a.json")


def test_save_replaces_a_link_and_not_what_it_points_to(tmp_path: Path) -> None:
    (tmp_path / "kept.json").write_text("kept")
    (tmp_path / "a.json").symlink_to(tmp_path / "kept.json")
    save_drawing(VARIED, tmp_path / "a.json")
    assert (tmp_path / "kept.json").read_text() == "kept"
    assert equal(load_drawing(tmp_path / "a.json"), VARIED)
