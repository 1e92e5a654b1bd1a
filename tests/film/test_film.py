"""A film shows the one drawing, in order, at a hand's pace, and does not change it."""

import os
import stat
import sys
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image, ImageSequence

from crayonize import cli, pipeline
from crayonize.film import plan as timelapse
from crayonize.film import view
from crayonize.film import writers as film
from crayonize.film.plan import Timelapse, pace
from crayonize.images.icc import encode_srgb
from crayonize.svg.load import load_svg
from stroke_gen.drawing import Drawing, Stroke, Tip
from stroke_gen.drawing_file import save_drawing

SIZE = 120


def stroke(path, crayon="red", note="fill", width=3.0):
    path = np.array(path, np.float32)
    return Stroke(path, np.full(len(path), 2.5, np.float32), crayon, Tip("blunt", width), note)


@pytest.fixture(scope="module")
def scribble():
    """Thirty strokes of all crayons that cross each other, some over the edge."""
    rng = np.random.default_rng(1)
    names = ("red", "yellow", "blue", "green", "black")
    paths = [
        rng.uniform((-5, -5), (105, 65)) + np.cumsum(rng.normal(0, 10, (4, 2)), 0)
        for _ in range(30)
    ]
    strokes = tuple(stroke(path, names[i % 5]) for i, path in enumerate(paths))
    return Drawing(100.0, 60.0, "drawing", "box8", strokes)


@pytest.fixture(scope="module")
def line():
    """One long slow line from left to right."""
    path = np.stack([np.linspace(5, 95, 90), np.full(90, 10)], 1)
    return Drawing(100.0, 20.0, "smooth", "box8", (stroke(path, note="line"),))


def frames_of(drawing, tmp_path, size=SIZE, seconds=3, **options):
    """The easel and all frames, as arrays."""
    path = tmp_path / "film.png"
    with Timelapse(path, seconds, **options) as watch:
        easel = pipeline.draw(drawing, size, watch=watch)
    with Image.open(path) as picture:
        frames = []
        for i in range(picture.n_frames):
            picture.seek(i)
            frames.append(np.asarray(picture.convert("RGB")).astype(int))
    return easel, frames


def reduced(easel):
    """What a film should show of an easel, by the plainest means; for sizes up to LONG_SIDE."""
    return encode_srgb(easel.picture()).astype(int)


# ---- the film and the drawing --------------------------------------------------------------------


def test_drawing_is_the_same_with_and_without_a_film(scribble, tmp_path):
    filmed, _ = frames_of(scribble, tmp_path)
    plain = pipeline.draw(scribble, SIZE)
    for a, b in zip(plain.sheet.columns(), filmed.sheet.columns(), strict=True):
        assert np.array_equal(a, b)
    assert plain.box.given_mm3 == filmed.box.given_mm3


def test_film_begins_with_bare_paper_and_ends_with_the_drawing(scribble, tmp_path):
    easel, frames = frames_of(scribble, tmp_path)
    bare = pipeline.easel(scribble, SIZE)
    assert np.abs(frames[0] - reduced(bare)).max() <= 1
    assert np.abs(frames[-1] - reduced(easel)).max() <= 1


def test_film_without_shading(scribble, tmp_path):
    easel, frames = frames_of(scribble, tmp_path, light=False)
    assert np.abs(frames[-1] - encode_srgb(easel.picture(light=False)).astype(int)).max() <= 1


def test_large_drawing_is_shown_reduced_by_area(scribble, tmp_path):
    easel, frames = frames_of(scribble, tmp_path, size=1001)
    assert frames[-1].shape == (300, 500, 3)
    light = easel.picture()[:600, :1000].reshape(300, 2, 500, 2, 3).mean((1, 3))
    assert np.abs(frames[-1] - encode_srgb(light)).max() <= 1


def test_every_frame_is_the_drawing_up_to_a_stroke(scribble, tmp_path, monkeypatch):
    states, put = [], timelapse._Scene.put

    def note(self, number):
        put(self, number)
        states.append((int((self.frame_of <= number).sum()), self.view.now.astype(int)))

    monkeypatch.setattr(timelapse._Scene, "put", note)
    frames_of(scribble, tmp_path)
    counts = [count for count, _ in states]
    assert counts == sorted(counts) and len(set(counts)) > 8
    for count, seen in states[::3]:
        part = pipeline.draw(replace(scribble, strokes=scribble.strokes[:count]), SIZE)
        assert np.abs(seen - reduced(part)).max() <= 1


def test_any_number_of_threads_gives_the_same_film(scribble, tmp_path):
    films = set()
    for threads in (1, 2, 4):
        with Timelapse(tmp_path / "film.png", 3, show_tip=True) as watch:
            pipeline.draw(scribble, SIZE, threads=threads, watch=watch)
        films.add((tmp_path / "film.png").read_bytes())
    assert len(films) == 1


def test_long_stroke_grows_from_frame_to_frame(line, tmp_path):
    _, frames = frames_of(line, tmp_path)
    inked = [(np.abs(f - frames[0]).max(2) > 60).any(0) for f in frames]
    reached = [int(np.flatnonzero(columns).max(initial=0)) for columns in inked]
    assert reached == sorted(reached) and len(set(reached)) > 8
    assert abs(reached[len(reached) // 2] - SIZE / 2) < SIZE / 8


def test_tip_is_seen_where_the_stroke_has_come_and_not_at_the_end(line, tmp_path):
    _, plain = frames_of(line, tmp_path)
    _, shown = frames_of(line, tmp_path, show_tip=True)
    middle = len(plain) // 2
    y, x = np.nonzero(np.abs(plain[middle] - shown[middle]).max(2))
    assert y.size > 10 and abs(x.min() - SIZE / 2) < SIZE / 8
    # from the outline round the point, at 12, downwards
    assert y.min() >= 10 and y.max() > 18 and y.mean() > 14
    assert np.array_equal(plain[-1], shown[-1])


def test_drawing_without_strokes_is_a_film_of_paper(line, tmp_path):
    _, frames = frames_of(replace(line, strokes=()), tmp_path)
    assert len(frames) >= 2 and all(np.array_equal(f, frames[0]) for f in frames)


def test_parts_of_the_work_share_the_time(scribble, tmp_path):
    with Timelapse(tmp_path / "film.webp", 4) as watch:
        easel = pipeline.easel(scribble, SIZE)
        easel.show_to(watch)
        easel.draw(scribble.strokes[:20], share=0.5)
        easel.draw(scribble.strokes[20:], share=0.25)  # and a quarter that never comes
    with Image.open(tmp_path / "film.webp") as picture:
        durations = []
        for i in range(picture.n_frames):
            picture.seek(i)
            picture.load()
            durations.append(picture.info["duration"])
        assert sum(durations) == 4000
        assert np.abs(np.asarray(picture.convert("RGB")).astype(int) - reduced(easel)).mean() < 10


def test_pace_is_a_hands():
    long, short = stroke([[0, 0], [200, 0]]), stroke([[0, 0], [60, 0]], note="line")
    start, end = pace([long, short])
    assert end - start == pytest.approx([1.1, 1.1]) and start[0] == pytest.approx(0.25)
    assert start[1] - end[0] == pytest.approx(0.25)


# ---- formats -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "suffix, off", [(".webp", 9), (".gif", 14), (".png", 0.01), (".apng", 0.01)]
)
def test_formats_have_the_length_and_end_with_the_drawing(scribble, tmp_path, suffix, off):
    path = tmp_path / f"film{suffix}"
    with Timelapse(path, 3) as watch:
        easel = pipeline.draw(scribble, SIZE, watch=watch)
    with Image.open(path) as picture:
        total = 0.0
        for i in range(picture.n_frames):
            picture.seek(i)
            picture.load()
            total += picture.info["duration"]
        assert total == pytest.approx(3000) and picture.info["duration"] >= 1500
        assert picture.info["loop"] == 0
        assert np.abs(np.asarray(picture.convert("RGB")).astype(int) - reduced(easel)).mean() < off
    assert list(tmp_path.iterdir()) == [path]


def test_mp4_by_pyav(scribble, tmp_path):
    av = pytest.importorskip("av")
    with Timelapse(tmp_path / "film.mp4", 3) as watch:
        easel = pipeline.draw(scribble, SIZE + 1, watch=watch)
    with av.open(str(tmp_path / "film.mp4")) as container:
        frames = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
    assert len(frames) == 30 and frames[0].shape == (72, 120, 3)
    assert np.abs(frames[-1].astype(int) - reduced(easel)[:72, :120]).mean() < 12


@pytest.mark.skipif(os.name != "posix", reason="a script stands in for the program")
def test_mp4_by_ffmpeg(scribble, tmp_path, monkeypatch):
    program = tmp_path / "ffmpeg"
    program.write_text(
        f"#!{sys.executable}\nimport sys\nopen(sys.argv[-1], 'wb').write(sys.stdin.buffer.read())\n"
    )
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr(film.importlib.util, "find_spec", lambda name: None)
    with Timelapse(tmp_path / "film.mp4", 3) as watch:
        pipeline.draw(scribble, SIZE, watch=watch)
    assert (tmp_path / "film.mp4").stat().st_size == 30 * 72 * 120 * 3
    program.write_text(f"#!{sys.executable}\nimport sys\nsys.exit('no such encoder')\n")
    with (
        pytest.raises(OSError, match="no such encoder"),
        Timelapse(tmp_path / "film.mp4", 3) as watch,
    ):
        pipeline.draw(scribble, SIZE, watch=watch)


def test_mp4_without_its_packages_names_them(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", "")
    monkeypatch.setattr(film.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(ValueError, match=r"pip install av.*ffmpeg") as caught:
        Timelapse(tmp_path / "film.mp4")
    assert isinstance(caught.value.__cause__, ImportError)


@pytest.mark.parametrize("name, seconds, words", [
    ("film.avi", 12, ".webp"), ("film", 12, "suffix"), ("missing/film.gif", 12, "does not exist"),
    ("film.gif", 2, "3 and 600"), ("film.gif", 601, "3 and 600"),
])  # fmt: skip
def test_what_cannot_be_written_is_refused_at_once(tmp_path, name, seconds, words):
    with pytest.raises(ValueError, match=words):
        Timelapse(tmp_path / name, seconds)


def test_full_disk_is_told_and_leaves_nothing(line, tmp_path, monkeypatch):
    def full(_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with (
        pytest.raises(OSError, match="No space left") as caught,
        Timelapse(tmp_path / "film.gif", 3) as watch,
    ):
        pipeline.draw(line, SIZE, watch=watch)
    assert caught.value.filename == str(tmp_path / "film.gif") and list(tmp_path.iterdir()) == []


def test_broken_off_work_leaves_no_film(scribble, tmp_path):
    with pytest.raises(KeyboardInterrupt), Timelapse(tmp_path / "film.webp", 3) as watch:
        easel = pipeline.easel(scribble, SIZE)
        easel.show_to(watch)
        easel.draw(scribble.strokes[:5], share=0.5)
        raise KeyboardInterrupt
    assert list(tmp_path.iterdir()) == []


def test_colours_of_a_gif_are_near_all_that_can_appear(scribble):
    easel = pipeline.draw(scribble, SIZE)
    palette = view.colours(easel).astype(int)
    assert 100 < len(palette) <= 255
    pixels = reduced(easel).reshape(-1, 3)[::7]
    nearest = np.abs(pixels[:, None] - palette).max(2).min(1)
    assert np.mean(nearest) < 20


# ---- the command ---------------------------------------------------------------------------------


def test_command_films_a_saved_drawing_and_adds_its_legend(scribble, tmp_path):
    save_drawing(scribble, tmp_path / "d.json")
    words = [
        "draw",
        tmp_path / "d.json",
        tmp_path / "a.png",
        "--size",
        SIZE,
        "--timelapse",
        tmp_path / "a.gif",
        "--seconds",
        "3",
        "--show-tip",
        "--legend",
        "--strokes",
        tmp_path / "a.svg",
    ]
    assert cli.main([str(word) for word in words]) == 0
    with Image.open(tmp_path / "a.png") as picture, Image.open(tmp_path / "a.gif") as moving:
        assert picture.width == SIZE and picture.height > 72 and moving.n_frames > 9
    assert load_svg(tmp_path / "a.svg", palette="box8").width_mm == 100


def test_command_films_a_photo(tmp_path):
    photo = np.full((40, 60, 3), 230, np.uint8)
    photo[10:30, 20:40] = (200, 40, 30)
    Image.fromarray(photo).save(tmp_path / "photo.png")
    words = [
        tmp_path / "photo.png",
        tmp_path / "a.png",
        "--size",
        SIZE,
        "--timelapse",
        tmp_path / "a.png.webp",
        "--seconds",
        "4",
    ]
    assert cli.main([str(word) for word in words]) == 0
    with Image.open(tmp_path / "a.png.webp") as moving, Image.open(tmp_path / "a.png") as picture:
        frames, ms = [], 0
        for frame in ImageSequence.Iterator(moving):
            frames.append(np.asarray(frame.convert("RGB")).astype(int))
            ms += moving.info["duration"]
        assert ms == 4000
        assert np.abs(frames[-1] - np.asarray(picture)).mean() < 9
    done = np.array([np.abs(frame - frames[0]).mean() for frame in frames]) / 255
    assert done[-1] > 0.05 and np.diff(done).min() > -0.02 * done[-1], "wax only comes on"
    assert np.diff(done).max() < done[-1] / 2, "and never most of it at once"


@pytest.mark.parametrize("film_name, code, words", [
    ("a.avi", 2, ".webp"), ("d.json", 2, "over"), ("a.png", 2, "over"), ("none/a.gif", 2, "folder"),
])  # fmt: skip
def test_command_refuses_films_that_cannot_be(scribble, tmp_path, capsys, film_name, code, words):
    save_drawing(scribble, tmp_path / "d.json")
    line = ["draw", tmp_path / "d.json", tmp_path / "a.png", "--timelapse", tmp_path / film_name]
    assert cli.main([str(word) for word in line]) == code
    error = capsys.readouterr().err
    assert words in error and error.count("\n") == 1 and len(list(tmp_path.iterdir())) == 1
