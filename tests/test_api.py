"""The Python interface: what goes in comes out, the same drawing by every way."""

import io
import subprocess
import sys
from dataclasses import fields
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

import crayonize
from crayonize import api
from crayonize.images.read import read_linear
from crayonize.machine import memory
from crayonize.settings import Choices, Settings
from stroke_gen.drawing import Drawing, Stroke, Tip
from stroke_gen.drawing_file import load_drawing

CHOICES = {"size": 120, "sheet_mm": 60.0, "seed": 3, "threads": 2}


@pytest.fixture(scope="module")
def photo():
    y, x = np.mgrid[:40, :60].astype(np.float32)
    return np.dstack([255 - 4 * y, 60 + 3 * x, 120 + 0 * x]).astype(np.uint8)


@pytest.fixture(scope="module")
def picture(photo):
    return crayonize.convert(photo, **CHOICES)


def test_bytes_and_open_files_come_back_as_png(photo, picture):
    file = io.BytesIO()
    Image.fromarray(photo).save(file, "PNG")
    made = crayonize.convert(file.getvalue(), **CHOICES)
    assert isinstance(made, bytes) and made.startswith(b"\x89PNG")
    assert np.array_equal(np.asarray(Image.open(io.BytesIO(made))), picture)
    file.seek(0)
    odd = {"size": np.int64(120), "seed": np.int64(3), "paper": Path("drawing")}
    again = crayonize.convert(file, **CHOICES | odd)
    assert isinstance(again, io.BytesIO) and again.read() == made
    with pytest.raises(ValueError, match="bytes: "):
        crayonize.convert(b"no picture")


def test_a_picture_is_written_into_what_is_open(photo, picture):
    into = io.BytesIO()
    assert np.array_equal(crayonize.convert(photo, into, **CHOICES), picture)
    into.seek(0)
    assert np.array_equal(np.asarray(Image.open(into)), picture)


def test_choices_are_the_fields_of_settings():
    assert list(Choices.__annotations__) == [field.name for field in fields(Settings)]
    assert (Path(api.__file__).parent / "py.typed").exists()


def test_a_cancelled_drawing_writes_nothing(photo, tmp_path):
    def cancel(name, share):
        raise RuntimeError("cancelled")

    with pytest.raises(RuntimeError, match="cancelled"):
        crayonize.convert(photo, tmp_path / "out.png", **CHOICES, progress=cancel)
    assert not list(tmp_path.iterdir())


def test_array_gives_array(picture):
    assert (
        isinstance(picture, np.ndarray)
        and picture.dtype == np.uint8
        and picture.shape == (80, 120, 3)
    )


def test_photo_is_not_changed(photo):
    before = photo.copy()
    crayonize.convert(photo, **CHOICES)
    np.testing.assert_array_equal(photo, before)


def test_picture_gives_the_same_picture(photo, picture):
    made = crayonize.convert(Image.fromarray(photo), **CHOICES)
    assert isinstance(made, Image.Image)
    np.testing.assert_array_equal(np.asarray(made), picture)


def test_path_gives_picture_or_path(photo, picture, tmp_path):
    Image.fromarray(photo).save(tmp_path / "photo.png")
    made = crayonize.convert(tmp_path / "photo.png", **CHOICES)
    assert isinstance(made, Image.Image)
    np.testing.assert_array_equal(np.asarray(made), picture)
    out = crayonize.convert(str(tmp_path / "photo.png"), str(tmp_path / "out.png"), **CHOICES)
    assert out == tmp_path / "out.png"
    np.testing.assert_array_equal(np.asarray(Image.open(out)), picture)


def test_array_can_be_written_too(photo, picture, tmp_path):
    made = crayonize.convert(
        photo, tmp_path / "out.png", strokes=tmp_path / "strokes.json", **CHOICES
    )
    np.testing.assert_array_equal(made, picture)
    np.testing.assert_array_equal(np.asarray(Image.open(tmp_path / "out.png")), picture)
    drawing = load_drawing(tmp_path / "strokes.json")
    for source in (drawing, tmp_path / "strokes.json", str(tmp_path / "strokes.json")):
        np.testing.assert_array_equal(crayonize.draw(source, size=120), picture)


def test_seed_light_and_force_matter(photo, picture):
    for other in ({"seed": 4}, {"light": False}, {"force": "heavy"}):
        assert (crayonize.convert(photo, **CHOICES | other) != picture).any(), other


def test_preview_is_half_the_size(photo):
    assert crayonize.convert(photo, **CHOICES, preview=True).shape == (40, 60, 3)


def test_progress_rises_to_the_end(photo):
    told = []
    crayonize.convert(photo, **CHOICES, progress=lambda name, done: told.append((name, done)))
    shares = [done for _, done in told]
    assert shares == sorted(shares) and shares[0] >= 0 and 0.5 < shares[-1] <= 1
    assert all(isinstance(name, str) and name for name, _ in told)


def test_progress_can_stop_the_work(photo, tmp_path):
    class Enough(Exception):
        pass

    def stop(name, done):
        raise Enough

    with pytest.raises(Enough):
        crayonize.convert(photo, tmp_path / "out.png", progress=stop, **CHOICES)
    assert list(tmp_path.iterdir()) == []


def test_draw_takes_a_drawing_made_by_hand(tmp_path):
    line = Stroke(
        np.array([[5, 10], [25, 12]], np.float32), np.array([2, 3], np.float32), "red", Tip()
    )
    drawing = Drawing(30.0, 20.0, "smooth", "box8", (line,))
    told = []
    made = crayonize.draw(
        drawing, 90, out=tmp_path / "line.jpg", progress=lambda *step: told.append(step)
    )
    assert made.shape == (60, 90, 3) and told[-1][1] == 1
    assert made[30:36, 30:60].astype(int).mean((0, 1)) @ [1, -1, 0] > 40  # red on the way
    assert made[50:].min() > 200  # paper elsewhere
    assert read_linear(tmp_path / "line.jpg").shape == made.shape


@pytest.mark.parametrize("choices, error, words", [
    ({"pallete": "box8"}, TypeError, 'did you mean "palette"'),
    ({"palette": "box9"}, ValueError, "box8"),
    ({"style": "x"}, ValueError, "style"),
    ({"size": 0}, ValueError, "size: 0"),
    ({"size": 100.0}, ValueError, "size: 100.0"),
    ({"seed": True}, ValueError, "seed: true"),
    ({"threads": 0}, ValueError, "threads: 0"),
    ({"focus": [(0, 0, 1)]}, ValueError, "focus"),
    ({"subject": "atuo"}, ValueError, "subject: 'atuo'"),
    ({"out": "/nowhere/out.png"}, ValueError, "nowhere"),
    ({"strokes": "strokes.csv"}, ValueError, ".json"),
], ids=str)  # fmt: skip
def test_bad_choice_is_named(photo, choices, error, words):
    with pytest.raises(error) as caught:
        crayonize.convert(photo, **choices)
    assert words in str(caught.value) and "\n" not in str(caught.value)


def test_a_subject_is_drawn_with_more_strokes_than_the_rest(tmp_path):
    """The same texture everywhere: only the picture of the subject, a half, tells where care is."""
    spots = np.random.default_rng(0).integers(60, 200, (24, 36)).astype(np.uint8)
    photo = np.repeat(np.repeat(spots, 4, 0), 4, 1)
    mask = np.zeros((12, 18), np.uint8)
    mask[:, :9] = 255
    Image.fromarray(mask).save(tmp_path / "left.png")
    share = {}
    for subject in ("none", mask, tmp_path / "left.png"):
        named = subject if isinstance(subject, np.ndarray) else str(subject)
        crayonize.convert(photo, strokes=tmp_path / "d.json", subject=named, **CHOICES)
        lengths = np.zeros(2)
        for stroke in load_drawing(tmp_path / "d.json").strokes:
            step = np.hypot(*np.diff(stroke.path_mm, axis=0).T)
            side = (stroke.path_mm[1:, 0] > 30).astype(int)
            lengths += np.bincount(side, step, minlength=2)
        share[str(named)] = lengths[0] / lengths.sum()
    by_array, by_file = share[str(mask)], share[str(tmp_path / "left.png")]
    assert by_array == by_file > share["none"] + 0.05


def test_draw_checks_too(tmp_path):
    drawing = Drawing(30.0, 20.0, "smooth", "box8", ())
    for options in ({"size": 0}, {"threads": -1}, {"out": tmp_path / "x.gif"}):
        with pytest.raises(ValueError):
            crayonize.draw(drawing, **options)
    with pytest.raises(ValueError, match="cannot be read"):
        crayonize.draw(tmp_path / "missing.json")


@pytest.mark.parametrize("far", [np.inf, np.nan, 1e30])
def test_a_drawing_made_by_hand_is_checked_before_it_is_drawn(far):
    path, force = np.array([[1, 1], [far, 5]], np.float32), np.ones(2, np.float32)
    drawing = Drawing(20.0, 20.0, "drawing", "box24", (Stroke(path, force, "red", Tip()),))
    with pytest.raises(ValueError, match="stroke 1"):
        crayonize.draw(drawing, 60)


def test_inputs_are_never_outputs(photo, tmp_path):
    Image.fromarray(photo).save(tmp_path / "photo.png")
    Image.fromarray(photo).save(tmp_path / "paper.png")
    before = (tmp_path / "photo.png").read_bytes()
    for name in ("photo.png", "paper.png"):
        with pytest.raises(ValueError, match="over"):
            crayonize.convert(
                tmp_path / "photo.png", tmp_path / name, paper=str(tmp_path / "paper.png")
            )
    assert (tmp_path / "photo.png").read_bytes() == before


def test_notes_hold_no_folder(photo, tmp_path):
    (tmp_path / "mine.txt").write_text("#aa2211 brick\n#112233\n#ffeedd\n")
    out = crayonize.convert(
        photo, tmp_path / "out.png", palette=str(tmp_path / "mine.txt"), **CHOICES
    )
    assert str(tmp_path).encode() not in Path(tmp_path / "out.png").read_bytes()
    assert isinstance(out, np.ndarray)


# ---- memory --------------------------------------------------------------------------------------


def test_memory_refuses_what_cannot_fit_and_names_a_size_that_does():
    memory.check_fits(1000, 1000, available=None if memory.available_bytes() is None else 10**12)
    figures = r"size: 20000 x 10000 cells need 15\.3 GB of memory, 4\.0 GB are free"
    with pytest.raises(ValueError, match=figures) as error:
        memory.check_fits(10000, 20000, available=4 * 10**9)
    fitting = int(str(error.value).split("a size of ")[1].split()[0])
    memory.check_fits(fitting // 2, fitting, available=4 * 10**9)
    with pytest.raises(ValueError):
        memory.check_fits(round(fitting * 0.51), round(fitting * 1.02), available=4 * 10**9)
    with pytest.raises(ValueError):
        memory.check_fits(fitting // 2, fitting, filmed=True, available=4 * 10**9)


def test_no_size_is_named_if_none_fits():
    with pytest.raises(ValueError) as error:
        memory.check_fits(100, 100, available=memory.OVERHEAD + 1000)
    assert "would fit" not in str(error.value)


def test_a_photo_that_cannot_be_read_is_refused():
    deep = memory.decoding("PNG", 200_000_000, deep=True)
    with pytest.raises(
        ValueError, match=r"the photo needs 3\.9 GB of memory, 2\.0 GB are free; reduce it first"
    ):
        memory.check_fits(100, 100, photo=deep, available=2 * 10**9)
    memory.check_fits(100, 100, photo=memory.decoding("PNG", 200_000_000), available=2 * 10**9)
    assert memory.decoding("something new", 1) == memory.decoding("JPEG", 1, deep=True)
    assert memory.decoding(None, 10**9) == 0


def test_memory_is_looked_at_before_the_photo_is_read(photo, tmp_path, monkeypatch):
    Image.fromarray(photo).save(tmp_path / "photo.png")
    monkeypatch.setattr(memory, "available_bytes", lambda: 2_000_000_000)
    monkeypatch.setattr(
        "crayonize.images.read.Photo.light", lambda *_: pytest.fail("began to read")
    )
    for image in (photo, Image.fromarray(photo), tmp_path / "photo.png"):
        with pytest.raises(
            ValueError, match=r"size: 20000 x \d+ cells need \d+\.\d GB of memory, 2\.0 GB are free"
        ):
            crayonize.convert(image, size=20000)


def test_a_preview_may_be_twice_as_large(monkeypatch):
    """It has a quarter of the cells: what just fits as a preview does not fit whole."""
    monkeypatch.setattr(
        memory, "available_bytes", lambda: memory.OVERHEAD + 1000**2 * memory.BYTES_PER_CELL
    )
    api.check_size(2, 2, 2000, preview=True)
    api.check_size(2, 2, 1000, preview=False)
    with pytest.raises(ValueError, match="a size of 1414 would fit"):
        api.check_size(2, 1, 2000, preview=False)
    with pytest.raises(ValueError, match="2000 x 2000 cells"):
        api.check_size(2, 2, 2000, preview=False)
    with pytest.raises(ValueError, match="1000 x 1000 cells"):
        api.check_size(2, 2, 2000, preview=True, filmed=True)


STATUS = Path("/proc/self/status")


@pytest.mark.skipif(
    not STATUS.exists(), reason="the system does not tell a process its peak of memory"
)
@pytest.mark.parametrize("suffix", [".png", ".webp"])
def test_a_drawing_takes_no_more_memory_than_said_and_not_much_less(photo, tmp_path, suffix):
    Image.fromarray(photo).save(tmp_path / "photo.png")
    script = (
        "import sys, pathlib, crayonize; crayonize.convert(*sys.argv[1:3], size=2100);"
        f"print(pathlib.Path({str(STATUS)!r}).read_text())"
    )
    files = tmp_path / "photo.png", tmp_path / f"out{suffix}"
    told = subprocess.run(
        [sys.executable, "-c", script, *files], capture_output=True, text=True, check=True
    ).stdout
    peak = 1024 * int(told.split("VmHWM:")[1].split()[0])
    said = memory.OVERHEAD + memory.BYTES_PER_CELL * 2100 * 1400
    assert 0.7 * said < peak < said


def test_threads_share_two_heaps_where_there_is_a_choice(monkeypatch):
    asked = []
    library = SimpleNamespace(mallopt=lambda *choice: asked.append(choice))
    monkeypatch.setattr(memory.ctypes, "CDLL", lambda _: library)
    memory.share_heaps()
    assert asked == [(-8, 2)]
    del library.mallopt
    memory.share_heaps()


def test_memory_of_this_machine_is_plausible():
    free = memory.available_bytes()
    assert free is None or 10**7 < free < 10**14


def test_the_limit_of_addresses_counts(monkeypatch):
    resource = pytest.importorskip("resource")
    monkeypatch.setattr(resource, "getrlimit", lambda which: (10**15, 10**15))
    used = 10**15 - next(memory._of_process())
    assert 10**7 < used < 10**14
    monkeypatch.setattr(resource, "getrlimit", lambda which: (resource.RLIM_INFINITY,) * 2)
    assert list(memory._of_process()) == []


def test_limits_of_control_groups(tmp_path):
    (tmp_path / "max").write_text("1000\n")
    (tmp_path / "now").write_text("700\n")
    (tmp_path / "stat").write_text("anon 5\ninactive_file 200\n")
    files = [tmp_path / name for name in ("max", "now", "stat")]
    assert list(memory._left(*files)) == [500]
    (tmp_path / "max").write_text("max\n")
    assert list(memory._left(*files)) == []
    assert list(memory._left(tmp_path / "none", *files[1:])) == []


def test_workshop_is_set_up_once():
    assert api.workshop() is api.workshop()
