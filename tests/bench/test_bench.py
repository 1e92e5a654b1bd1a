"""The benchmark measures what it says and tells it in both ways; no test here asks how fast
anything is.
"""

import json
import math

import numpy as np
import pytest

from crayonize import cli
from crayonize.bench import measure as measuring
from crayonize.bench import parts as bench
from crayonize.bench.table import table
from crayonize.images.read import read_linear

TINY_MP = (0.01, 0.02, 0.03)


@pytest.fixture(scope="module")
def found():
    """All figures, from tiny pictures, all in this process but for the uncompiled strokes."""
    with pytest.MonkeyPatch.context() as patch:
        in_child, staged = bench.child, bench._staged

        def here(part, *given, **environment):
            if environment:
                return in_child(part, *given, **environment)
            tiny = {"rubbing": (120, 1), "live": (200, 12)}
            return json.loads(json.dumps(bench.PARTS[part](*tiny.get(part, given))))

        patch.setattr(bench, "child", here)
        patch.setattr(
            bench, "_staged", lambda path, mp: None if path.stem == "small" else staged(path, mp)
        )
        patch.setattr(measuring, "SIZES_MP", TINY_MP)
        patch.setattr(
            measuring, "_starts", lambda folder, repeats, cold: {"help": 0.1, "photo_800": 1.0}
        )
        return measuring.measure(quick=True)


def numbers(figures):
    """All numbers in nested figures, with the way to each."""
    pairs = figures.items() if isinstance(figures, dict) else enumerate(figures)
    for key, value in pairs:
        if isinstance(value, dict | list):
            yield from ((f"{key}.{way}", number) for way, number in numbers(value))
        elif not isinstance(value, str | bool):
            yield str(key), value


def test_all_is_measured(found):
    assert set(found) == {
        "crayonize",
        "quick",
        "machine",
        "start",
        "cell_steps_per_second",
        "sheets",
        "threads",
        "live_ms",
        "yardsticks",
        "ratios",
    }
    assert set(found["machine"]) == {"cpu", "cores", "system", "python", "numpy", "numba", "cv2"}
    assert set(found["cell_steps_per_second"]) == {"smearing", "without_smearing"}
    assert [sheet["megapixels"] for sheet in found["sheets"]] == [0.01, 0.02]
    for sheet in found["sheets"]:
        assert set(sheet) == {"megapixels", "cells", "strokes", "seconds_per_mp", "bytes_per_cell"}
        assert set(sheet["seconds_per_mp"]) == {*bench.STAGES, "all"}
    counts = set(found["threads"]["seconds"])
    assert {"1", str(found["machine"]["cores"])} <= counts == set(found["threads"]["speed_up"])
    assert set(found["live_ms"]) == {"1600", "3508"}
    assert all(set(took) == {"min", "median", "max"} for took in found["live_ms"].values())
    assert set(found["yardsticks"]) == {
        "strokes",
        "strokes_uncompiled",
        "oil_painting",
        "stylization",
    }
    assert set(found["ratios"]) == {
        "uncompiled_over_kernels",
        "whole_over_uncompiled_strokes",
        "whole_over_filters",
    }


def test_figures_are_positive_and_no_stage_is_left_out(found):
    for way, number in numbers(found):
        assert math.isfinite(number) and (number > 0 or "bytes" in way), way


def test_sums_and_ratios_are_of_what_they_say(found):
    for sheet in found["sheets"]:
        per_mp = sheet["seconds_per_mp"]
        assert per_mp["all"] == pytest.approx(sum(per_mp[stage] for stage in bench.STAGES))
    beside, first = found["yardsticks"], found["sheets"][0]
    whole = first["seconds_per_mp"]["all"] * first["cells"] / 1e6
    assert found["ratios"]["whole_over_filters"] == pytest.approx(
        whole / (beside["oil_painting"] + beside["stylization"])
    )
    assert found["threads"]["speed_up"]["1"] == 1


def test_table_shows_every_part(found):
    text = table(found)
    assert all(len(line) <= 110 for line in text.splitlines()) and text == text.rstrip()
    for word in (
        *bench.STAGES,
        "with smearing",
        "peak memory",
        "threads, 0.02 MP",
        "A4, 3508",
        "help",
        "oilPainting",
        "uncompiled",
        found["machine"]["cpu"],
        found["machine"]["numba"],
    ):
        assert word in text


def test_time_within_a_stage_is_counted_once(monkeypatch):
    now = [0.0]
    monkeypatch.setattr(bench.time, "perf_counter", lambda: now[0])
    clock = bench._Clock()
    with clock.stage("planning"):
        now[0] += 2
        with clock.stage("simulation"):
            now[0] += 5
        now[0] += 1
    assert clock.seconds["simulation"] == 5
    assert clock.seconds["planning"] == 3
    assert clock.seconds["writing"] == 0


def test_cell_steps_are_counted_as_the_kernels_make_them(monkeypatch):
    monkeypatch.setattr(bench, "seconds_of", lambda act: (act(), 1.0)[1])
    side, edge, stride, lines = 150, bench.TIP_CELLS, 0.16 * bench.TIP_CELLS, 14
    contacts = lines * (side - 2 * edge) / stride
    assert bench._rubbed(side, True) == pytest.approx(contacts * math.pi / 4 * 24**2, rel=0.05)


def test_photo_is_the_same_each_time_and_has_the_size_asked_for(tmp_path):
    for name in ("a.png", "b.png"):
        bench.photo(str(tmp_path / name), 0.05)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    picture = read_linear(tmp_path / "a.png")
    assert picture.shape[0] * picture.shape[1] == pytest.approx(50_000, rel=0.01)
    assert len(np.unique((picture * 255).astype(np.uint8).reshape(-1, 3), axis=0)) > 1000


def test_a_part_runs_in_a_process_of_its_own():
    assert bench.child("machine") == bench.machine()


def test_a_part_that_fails_is_named():
    with pytest.raises(RuntimeError, match=r"^bench: filters: .*rror"):
        bench.child("filters", "/missing.jpg", 1)


def test_starts_are_timed_warm_and_with_an_empty_cache(tmp_path, monkeypatch):
    asked = []
    monkeypatch.setattr(bench, "child", lambda *_: None)
    monkeypatch.setattr(
        measuring.subprocess, "run", lambda line, env, **_: asked.append((line[2:], env))
    )
    found = measuring._starts(str(tmp_path), 2, cold=True)
    assert set(found) == {"help", "photo_800", "photo_800_cold"} and all(
        seconds > 0 for seconds in found.values()
    )
    draws = [(line, env) for line, env in asked if "--help" not in line]
    assert len(draws) == 4 and all(line == draws[0][0] for line, _ in draws)
    assert draws[-1][1]["CRAYONIZE_CACHE"] == str(tmp_path / "cache")
    assert all(
        env["CRAYONIZE_CACHE"] != str(tmp_path / "cache")
        for _, env in draws[:-1]
        if "CRAYONIZE_CACHE" in env
    )
    assert set(measuring._starts(str(tmp_path), 1, cold=False)) == {"help", "photo_800"}


# ---- the command ---------------------------------------------------------------------------------


@pytest.fixture
def run(capsys, monkeypatch, found):
    """`crayonize bench` with figures at hand: (exit code, stdout, stderr, how it was measured)."""
    asked = []

    def measure(quick, progress):
        asked.append(quick)
        return found

    def run(*words):
        monkeypatch.setattr(measuring, "measure", measure)
        asked.clear()
        return cli.main(["bench", *map(str, words)]), *capsys.readouterr(), asked

    return run


def test_it_prints_the_table(run, found):
    assert run() == (0, table(found) + "\n", "", [False])
    assert run("--quick")[3] == [True]


def test_it_writes_json_beside_the_table(run, found, tmp_path):
    code, out, err, _ = run("--json", tmp_path / "all.json")
    assert (code, out, err) == (0, table(found) + "\n", "")
    assert json.loads((tmp_path / "all.json").read_text()) == found
    assert [path.name for path in tmp_path.iterdir()] == ["all.json"]


def test_it_writes_json_alone_to_stdout(run, found):
    code, out, err, _ = run("--json", "-")
    assert (code, json.loads(out), err) == (0, found, "")


@pytest.mark.parametrize("path", ["missing/all.json", "", "file/all.json"])
def test_json_that_cannot_be_written_is_refused_before_all_work(run, tmp_path, path):
    (tmp_path / "file").write_text("old")
    code, out, err, asked = run("--json", tmp_path / path)
    assert code in (1, 2) and out == "" and asked == []
    assert err.startswith("crayonize: ") and err.count("\n") == 1


def test_folder_that_may_not_be_written_to_is_refused_before_all_work(run, tmp_path, monkeypatch):
    def refuse(path, *_, **__):
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr("pathlib.Path.touch", refuse)
    code, out, err, asked = run("--json", tmp_path / "all.json")
    assert (code, out, asked) == (
        1,
        "",
        [],
    ) and err == f"crayonize: {tmp_path / 'all.json'}: Permission denied\n"


def test_an_error_leaves_the_old_json(run, found, tmp_path, monkeypatch):
    old = tmp_path / "all.json"
    old.write_text("old")
    found["live_ms"]["1600"]["min"], kept = object(), found["live_ms"]["1600"]["min"]
    code, _, err, _ = run("--json", old)
    found["live_ms"]["1600"]["min"] = kept
    assert code == 1 and err.count("\n") == 1
    assert old.read_text() == "old" and len(list(tmp_path.iterdir())) == 1
