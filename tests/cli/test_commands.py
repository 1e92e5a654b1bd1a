"""Every command line: exit code, the one line on stderr, nothing unasked on stdout, the same bytes
again.
"""

import json
import os
import signal
import subprocess
import sys

import cv2
import numpy as np
import pytest

from crayonize import api, cli
from crayonize.cli import bar
from crayonize.cli.options import photo_parser
from crayonize.images.read import read_linear
from crayonize.images.write import read_settings
from crayonize.machine import memory


@pytest.fixture(scope="module")
def photo(tmp_path_factory):
    """A small photo: a red disc on a sky."""
    y, x = np.mgrid[:60, :90].astype(np.float32)
    sky = np.dstack([230 - y, 190 - y, 140 - y])
    disc = np.hypot(x - 40, y - 30)[..., None] < 17
    path = tmp_path_factory.mktemp("photo") / "photo.jpg"
    cv2.imwrite(str(path), np.where(disc, (40, 50, 200), sky).astype(np.uint8))
    return path


@pytest.fixture
def run(capsys, monkeypatch):
    """Run a command line here: (exit code, stdout, stderr)."""
    before = signal.getsignal(signal.SIGTERM)

    def run(*words):
        try:
            code = cli.main([str(word) for word in words])
        except SystemExit as end:
            code = end.code or 0
        out, err = capsys.readouterr()
        return code, out, err

    yield run
    signal.signal(signal.SIGTERM, before)


def start(*words, **options):
    """Start a command line as a process of its own."""
    command = [sys.executable, "-m", "crayonize", *(str(word) for word in words)]
    return subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options
    )


@pytest.fixture(scope="module")
def drawn(photo, tmp_path_factory):
    """The photo drawn on one thread, with its strokes: (folder, stdout, stderr)."""
    folder = tmp_path_factory.mktemp("drawn")
    process = start(photo, folder / "one.png", "--size", 200, "--seed", 5, "--threads", 1, "-v",
                    "--strokes", folder / "strokes.json")  # fmt: skip
    out, err = process.communicate()
    assert process.returncode == 0, err
    return folder, out, err


# ---- good ones -----------------------------------------------------------------------------------


@pytest.mark.parametrize("words, wanted", [
    (["--help"], "--palette"),
    (["draw", "--help"], "DRAWING"),
    (["warmup", "--help"], "--quiet"),
    (["bench", "--help"], "--quick"),
    (["--version"], "crayonize 0."),
    (["palettes"], "box24 "),
    (["styles"], "artist "),
    (["papers"], "drawing "),
], ids=lambda value: " ".join(value) if isinstance(value, list) else "")  # fmt: skip
def test_asking(run, words, wanted):
    code, out, err = run(*words)
    assert code == 0 and wanted in out and err == ""


@pytest.mark.parametrize("command", ["palettes", "styles", "papers"])
def test_listings_have_one_entry_a_line(run, command):
    lines = run(command)[1].splitlines()
    assert lines and all(len(line.split(maxsplit=1)) == 2 for line in lines)


def test_drawing_says_nothing_on_stdout_and_with_v_seed_and_time_on_stderr(drawn):
    folder, out, err = drawn
    assert out == ""
    (line,) = [line for line in err.splitlines() if "compiling" not in line]
    files = f"{folder / 'one.png'}, {folder / 'strokes.json'}"
    assert line.startswith(f"crayonize: {files}: 200 x 133 pixels, a sheet of 210 x 140 mm, ")
    assert "seed 5" in line and " s;" in line


def test_picture_has_the_size_and_shows_the_photo(drawn):
    picture = read_linear(drawn[0] / "one.png")
    assert picture.shape == (133, 200, 3)
    disc, sky = picture[55:75, 75:95].mean((0, 1)), picture[10:25, 150:190].mean((0, 1))
    assert disc[0] - disc[2] > sky[0] - sky[2] + 0.1


def test_picture_knows_how_it_was_drawn(drawn):
    told = read_settings(drawn[0] / "one.png")
    assert (
        told["seed"] == 5
        and told["palette"] == "box24"
        and told["style"] == "artist"
        and told["size"] == 200
    )
    assert "threads" not in told


def test_four_threads_and_q_give_the_same_bytes_in_silence(drawn, photo):
    folder = drawn[0]
    process = start(photo, "--size=200", "--threads", 4, folder / "four.png", "-q", "--seed", 5)
    assert (*process.communicate(), process.returncode) == ("", "", 0)
    assert (folder / "four.png").read_bytes() == (folder / "one.png").read_bytes()


def test_own_pictures_are_written_over_and_others_when_o_names_them(photo, run, tmp_path):
    for suffix in ("png", "jpg"):
        out = tmp_path / f"out.{suffix}"
        out.write_bytes(photo.read_bytes())
        assert run(photo, "-o", out, "--size", 40, "--preview")[0] == 0
        assert run(photo, out, "--size", 40, "--preview")[0] == 0


def test_a_photo_taken_away_while_it_is_drawn_costs_no_drawing(photo, run, tmp_path, monkeypatch):
    mine, sketch = tmp_path / "mine.jpg", api.sketch
    mine.write_bytes(photo.read_bytes())

    def sketch_and_lose(*given):
        drawn = sketch(*given)
        mine.unlink()
        return drawn

    monkeypatch.setattr(api, "sketch", sketch_and_lose)
    assert run(mine, tmp_path / "out.png", "--size", 40, "--preview")[0] == 0
    assert (tmp_path / "out.png").exists()


def test_saved_strokes_give_the_same_picture(drawn, run):
    folder = drawn[0]
    again = folder / "again.png"
    code, out, err = run("draw", folder / "strokes.json", again, "--size", 200)
    assert (code, out) == (0, "")
    assert err.startswith(f"crayonize: {again}: 200 x 133 pixels, ") and err.count("\n") == 1
    np.testing.assert_array_equal(
        read_linear(folder / "again.png"), read_linear(folder / "one.png")
    )
    assert read_settings(folder / "again.png")["seed"] == 5


def test_draw_options(drawn, run):
    folder = drawn[0]
    words = ["--size", 120, "--preview", "--no-light", "--threads", 2, "-q"]
    assert run("draw", folder / "strokes.json", folder / "small.jpg", *words) == (0, "", "")
    assert read_linear(folder / "small.jpg").shape == (40, 60, 3)


def test_output_beside_the_photo_and_every_other_option(photo, run, tmp_path):
    mine = tmp_path / "photo.jpeg"
    mine.write_bytes(photo.read_bytes())
    code, out, err = run(
        mine,
        "--size",
        160,
        "--preview",
        "--palette",
        "#a02020 brick,#204080,#f0e0a0,#101010",
        "--paper",
        "kraft",
        "--force",
        "1.2",
        "--style",
        "artist",
        "--seed",
        "random",
        "--focus",
        "0.2,0.2,0.4,0.5",
        "--focus",
        "0,0,.1,.1",
        "--subject",
        "none",
        "--sheet",
        "150mm",
        "--no-light",
    )
    assert code == 0 and out == ""
    assert err.splitlines()[-1].startswith(
        f"crayonize: {tmp_path / 'photo.crayon.png'}: 80 x 53 pixels"
    )
    assert sorted(path.name for path in tmp_path.iterdir()) == ["photo.crayon.png", "photo.jpeg"]


def test_the_crayons_of_a_palette(run, tmp_path):
    code, out, err = run("palettes", "box8")
    assert (code, err) == (0, "") and out.splitlines()[:2] == [
        "Box of 8, 8 crayons", "#df2a33  red",
    ]  # fmt: skip
    (tmp_path / "mine.txt").write_text("#aa0000 brick\n")
    assert run("palettes", tmp_path / "mine.txt")[1].splitlines()[1] == "#aa0000  brick"


def test_swatches_are_shown_in_a_terminal(run, monkeypatch):
    monkeypatch.setattr(bar.sys.stdout, "isatty", lambda: True, raising=False)
    assert "\x1b[48;2;223;42;51m" in run("palettes", "box8")[1]


def test_keys_of_a_style_are_set(photo, run, tmp_path):
    out, words = tmp_path / "out.png", ["--size", 60, "--set", "lines=0.0", "--set", "fill.legs=3"]
    assert run(photo, out, *words)[0] == 0
    style = json.loads(read_settings(out)["style"])
    assert style == {"extends": "artist", "lines": 0.0, "pass": {"fill": {"legs": 3}}}


@pytest.mark.skipif(os.name != "posix", reason="closes streams in a shell")
@pytest.mark.parametrize("closed", [">&-", "2>&-", "<&-", "<&- >&- 2>&-"])
def test_closed_streams_cost_no_drawing(photo, tmp_path, closed):
    out = tmp_path / "out.png"
    line = f'exec "{sys.executable}" -m crayonize "{photo}" "{out}" --size 60 {closed}'
    assert subprocess.run(["sh", "-c", line], capture_output=True).returncode == 0
    assert read_linear(out).shape == (40, 60, 3)


@pytest.mark.skipif(os.name != "posix", reason="closes streams in a shell")
def test_a_closed_stream_is_no_file_of_ours(tmp_path):
    code = "import os; from crayonize.cli import main; main(['styles']); os.write(2, b'lost')"
    line = f'exec "{sys.executable}" -c "{code}; print(open(1).name)" 2>&- >&-'
    assert subprocess.run(["sh", "-c", line], cwd=tmp_path).returncode == 0


@pytest.mark.parametrize("words", [["--print", "A4"], ["--sheet", "A4"], ["--sheet", "200MM"]])
def test_pages_may_be_written_in_capitals(words):
    read = photo_parser().read(["photo.jpg", *words])
    assert read.print == "a4" or read.sheet_mm in (297.0, 200.0)


def test_a_name_that_begins_with_a_dash(photo, run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "-dash.jpg").write_bytes(photo.read_bytes())
    assert run("--size", 60, "--", "-dash.jpg", "out.png")[0] == 0
    assert (tmp_path / "out.png").exists()


# ---- bad ones: exit code, and words of the one line ----------------------------------------------

PHOTO, OUT, TEXT, FOLDER = "{photo}", "{tmp}/out.png", "{tmp}/text.jpg", "{tmp}"
BAD = [
    (2, [], "PHOTO"),
    (2, ["-q"], "PHOTO"),
    (2, ["{tmp}/missing.jpg", OUT], "missing.jpg", "No such file"),
    (2, [PHOTO, OUT, "--sheet", "a55"], "--sheet", "'a55'", "10mm to 5000mm"),
    (2, [PHOTO, OUT, "--sheet", "9mm"], "--sheet", "'9mm'"),
    (2, [TEXT, OUT], "text.jpg", "picture"),
    (2, [PHOTO, OUT, "--subject", "nobody"], "subject: 'nobody'", "none"),
    (2, [FOLDER, OUT], "two folders"),
    (2, [FOLDER], "is a folder"),
    (2, [PHOTO, PHOTO], "photo.jpg", "over"),
    (2, [PHOTO, "{tmp}/link.png"], "link.png", "over"),
    (2, [PHOTO, "{tmp}/hard.png"], "hard.png", "over"),
    (2, [PHOTO, "{tmp}/second.jpg"], "second.jpg", "-o"),
    (2, [PHOTO, "{tmp}/missing/out.png"], "missing", "folder"),
    (2, [PHOTO, "{tmp}/out.gif"], ".gif", ".png"),
    (2, [PHOTO, "{tmp}/out"], "suffix", ".png"),
    (2, [PHOTO, OUT, "third.png"], "third.png"),
    (2, [PHOTO, OUT, "--shard", "1/2"], "--shard", "folders"),
    (2, ["{tmp}/missing*.jpg", "-o", "{tmp}/new"], "no such file"),
    (2, [PHOTO, "-o", "{tmp}/new/", "--name", "{{x}}"], "--name"),
    (2, [PHOTO, "-o", "{tmp}/new/", "--jobs", "0"], "1 to 512"),
    (2, [PHOTO, "-o", "{tmp}/new/", "--shard", "3/2"], "3/2"),
    (2, [PHOTO, "-o", "{tmp}/new/", "--max-pixels", "many"], "many"),
    (2, [PHOTO, "-o", "{tmp}/new/", "--time-limit", "0"], "seconds"),
    (2, [PHOTO, "-o", "{tmp}/new/", "--strokes", "s.json"], "one photo"),
    (2, [PHOTO, OUT, "--palete", "box8"], "--palete", 'did you mean "--palette"'),
    (2, [PHOTO, OUT, "--palet=box8"], "--palet", 'did you mean "--palette"'),
    (2, [PHOTO, OUT, "-z"], "-z"),
    (2, ["palete"], "palete", 'did you mean the command "palettes"'),
    (2, ["nothing", OUT], "nothing", "no file"),
    (2, ["{tmp}/house.json", OUT], "crayonize draw {tmp}/house.json"),
    (2, [PHOTO, OUT, "--age", "5"], "age", "style child"),
    (2, [PHOTO, OUT, "--seconds", "5"], "--seconds changes nothing without --timelapse"),
    (2, [PHOTO, OUT, "--show-tip"], "--show-tip changes nothing without --timelapse"),
    (2, [PHOTO, OUT, "--size=90", "--print", "a4"], "--size changes nothing: --print"),
    (2, [PHOTO, OUT, "--size=90", "--dpi", "100"], "--size changes nothing: --dpi"),
    (2, [PHOTO, OUT, "--sheet", "a4", "--print", "a4"], "--sheet changes nothing: --print"),
    (2, [PHOTO, OUT, "--set", "linse=2"], "linse", "lines"),
    (2, [PHOTO, OUT, "--set", "fil.legs=2"], "fil", "fill"),
    (2, [PHOTO, OUT, "--set", "lines"], "KEY=VALUE"),
    (2, [PHOTO, OUT, "--set", "lines=many"], "lines", "many"),
    (2, [PHOTO, OUT, "-q", "-v"], "not allowed"),
    (2, [PHOTO, OUT, "--palette", "box25"], "box25", "box24"),
    (2, [PHOTO, OUT, "--palette", TEXT], "text.jpg"),
    (2, [PHOTO, OUT, "--style", "artits"], "artits", "artist"),
    (2, [PHOTO, OUT, "--paper", "lunarr"], "lunarr", "lunar"),
    (2, [PHOTO, OUT, "--paper", TEXT], "text.jpg"),
    (2, [PHOTO, OUT, "--force", "strong"], "force", "strong", "heavy"),
    (2, [PHOTO, OUT, "--force", "0"], "force", "0.1 to 5"),
    (2, [PHOTO, OUT, "--size", "0"], "size", "1 to 20000"),
    (2, [PHOTO, OUT, "--size", "20001"], "size", "1 to 20000"),
    (2, [PHOTO, OUT, "--size", "big"], "size", "big"),
    (2, [PHOTO, OUT, "--size"], "--size"),
    (2, [PHOTO, OUT, "--threads", "0"], "threads", "1 to 256"),
    (2, [PHOTO, OUT, "--seed", "-1"], "seed", "-1"),
    (2, [PHOTO, OUT, "--seed", "x"], "seed", "x"),
    (2, [PHOTO, OUT, "--focus", "1,2"], "focus"),
    (2, [PHOTO, OUT, "--focus", "0,0,2,1"], "focus"),
    (2, [PHOTO, OUT, "--focus", "a,b,c,d"], "focus", "a,b,c,d"),
    (2, [PHOTO, OUT, "--strokes", "{tmp}/strokes.txt"], "strokes.txt", ".json"),
    (2, [PHOTO, OUT, "--strokes", "{tmp}/missing/s.json"], "missing", "folder"),
    (2, ["draw"], "DRAWING"),
    (2, ["draw", "{tmp}/missing.json", OUT], "missing.json"),
    (2, ["draw", PHOTO, OUT], "no drawing", "crayonize {photo} {tmp}/out.png"),
    (2, ["draw", "{tmp}/text.txt", OUT], "text.txt", "JSON"),
    (2, ["steps", PHOTO, "{tmp}/out.pdf"], "no drawing", "crayonize {photo}"),
    (2, ["draw", "{tmp}/png.png", "{tmp}/png.png"], "png.png", "over"),
    (2, ["draw", TEXT, OUT, "--sise", "3"], "--sise", "--size"),
    (2, ["palettes", "box25"], "box25", "box24"),
    (2, ["warmup", "--fast"], "--fast"),
    (2, ["bench", "--quik"], "--quik", 'did you mean "--quick"'),
    (2, ["bench", "x"], "x is one too many"),
    (2, ["bench", "--json"], "--json"),
    (2, ["bench", "--json", "{tmp}/missing/all.json"], "missing", "folder"),
    (2, ["bench", "--json", FOLDER], "folder"),
]  # fmt: skip


@pytest.fixture
def desk(tmp_path, photo):
    """A folder with things to stumble over."""
    (tmp_path / "text.jpg").write_text("no picture, no palette, no drawing\n")
    (tmp_path / "text.txt").write_text("no drawing\n")
    (tmp_path / "png.png").write_text("{}")
    (tmp_path / "folder.png").mkdir()
    (tmp_path / "link.png").symlink_to(photo)
    (tmp_path / "hard.png").hardlink_to(photo)
    (tmp_path / "second.jpg").write_bytes(photo.read_bytes())
    return tmp_path


@pytest.mark.parametrize("bad", BAD, ids=lambda bad: " ".join(bad[1]) or "nothing")
def test_bad_command_line_is_one_clear_line_and_changes_nothing(bad, desk, photo, run):
    code, words, *wanted = bad
    before = {path: path.read_bytes() for path in desk.iterdir() if path.is_file()}
    got, out, err = run(*(word.format(photo=photo, tmp=desk) for word in words))
    assert got == code and out == ""
    assert err.startswith("crayonize: ") and err.count("\n") == 1 and err.endswith("\n")
    for word in wanted:
        assert word.format(photo=photo, tmp=desk) in err
    assert {path: path.read_bytes() for path in desk.iterdir() if path.is_file()} == before


def test_folder_that_may_not_be_written_to(photo, run, tmp_path, monkeypatch):
    monkeypatch.setattr(os, "access", lambda *_: False)
    code, out, err = run(photo, tmp_path / "out.png")
    assert (code, out) == (
        1,
        "",
    ) and err == f"crayonize: {tmp_path / 'out.png'}: its folder may not be written to\n"


def test_full_disk_is_one_line_and_leaves_the_old_picture(drawn, run, tmp_path, monkeypatch):
    def full(_):
        raise OSError(28, "No space left on device")

    old = tmp_path / "out.png"
    old.write_bytes(b"old")
    monkeypatch.setattr(os, "fsync", full)
    code, out, err = run("draw", drawn[0] / "strokes.json", old, "--size", 40)
    assert (code, out, err) == (1, "", f"crayonize: {old}: No space left on device\n")
    assert old.read_bytes() == b"old" and len(list(tmp_path.iterdir())) == 1


def test_size_that_does_not_fit_is_refused_with_the_figures(photo, run, tmp_path, monkeypatch):
    monkeypatch.setattr(memory, "available_bytes", lambda: 2_000_000_000)
    monkeypatch.setattr(api, "workshop", lambda: pytest.fail("began to work"))
    code, _, err = run(photo, tmp_path / "out.png", "--size", 20000)
    assert code == 2 and "GB of memory, 2.0 GB are free" in err and "would fit" in err


@pytest.mark.parametrize("error, code, words", [
    (MemoryError(), 1, "--size"),
    (RuntimeError("odd\nlines"), 1, "RuntimeError: odd lines"),
    (ModuleNotFoundError("No module named 'x'"), 2, "No module named"),
    (ValueError("tail\x1b[31m red"), 2, "\\x1b[31m"),
], ids=repr)  # fmt: skip
def test_any_error_is_one_line(photo, run, tmp_path, monkeypatch, error, code, words):
    def fail(*_):
        raise error

    monkeypatch.setattr(api, "sketch", fail)
    got, out, err = run(photo, tmp_path / "out.png")
    assert got == code and out == "" and err.count("\n") == 1 and words in err


def test_a_missing_extra_is_for_the_user_to_mend(photo, run, tmp_path, monkeypatch):
    """Code 2, as for a wrong option: 3 means photos that failed, and nothing else."""

    def fail(*_):
        raise ImportError('it needs more: pip install "crayonize[video]"')

    monkeypatch.setattr(api, "sketch", fail)
    assert run(photo, tmp_path / "out.png")[0] == 2


def test_twice_v_shows_where(tmp_path):
    process = start(tmp_path / "missing.jpg", tmp_path / "out.png", "-v", "-v")
    out, err = process.communicate()
    assert process.returncode == 1 and out == "" and "Traceback" in err


def test_closed_pipe_is_quiet():
    process = start("palettes")
    process.stdout.close()
    assert process.stderr.read() == "" and process.wait() == 0
    process.stderr.close()


SLEEPER = """
import signal, sys, time
if signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:  # inherited, where tests run as a job
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
from crayonize import __main__, api
from crayonize.cli import bar
from crayonize.cli.options import photo_parser
def sketch(*_):
    print("ready", flush=True)
    time.sleep(60)
api.sketch = sketch
sys.exit(__main__.main())
"""


@pytest.mark.skipif(os.name != "posix", reason="signals")
@pytest.mark.parametrize(
    "number, code", [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)]
)
def test_signals_end_it_quietly(photo, tmp_path, number, code):
    command = [sys.executable, "-c", SLEEPER, photo, tmp_path / "out.png"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "ready\n"
    process.send_signal(number)
    assert (*process.communicate(timeout=300), process.returncode) == ("", "", code)
    assert list(tmp_path.iterdir()) == []


# ---- starting ------------------------------------------------------------------------------------


def test_warmup_compiles_everything_once(photo, tmp_path):
    environment = {
        **os.environ,
        "CRAYONIZE_CACHE": str(tmp_path / "cache"),
        "CRAYONIZE_NO_CACHE": "",
    }
    process = start("warmup", env=environment)
    out, err = process.communicate()
    assert process.returncode == 0 and out == ""
    first, last = err.splitlines()
    assert first == "crayonize: compiling for this machine, once ..." and last.startswith(
        "crayonize: ready after "
    )
    process = start(photo, tmp_path / "out.png", "--size", 120, "-v", env=environment)
    assert "compiling" not in process.communicate()[1] and process.returncode == 0
