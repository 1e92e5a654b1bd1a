"""A folder of bad files: each gets one line, none a crash, and the good ones among them their
picture.
"""

import sys

from conftest import ROOT, Desk, check_whole, photo

sys.path.insert(0, str(ROOT / "tests"))

import hostile


def test_every_bad_file_gets_its_line(desk: Desk) -> None:
    files = hostile.bad_files()
    assert len(files) >= 120
    for name, (content, _) in files.items():
        (desk.photos / name).write_bytes(content)
    photo(desk.photos / "good.png")
    run = desk.run("-j", "2", "--time-limit", "20", "--name", "{name}")
    assert run.process.returncode == 3
    found = {line["in"]: line for line in run.lines[:-1]}
    wrong = {
        name: found[name]
        for name, (_, wanted) in files.items()
        if found[name]["status"]
        not in (("ok", "failed") if wanted == hostile.EITHER else (wanted,))
    }
    assert not wrong
    assert run.status("good.png") == "ok"
    assert not [line for line in found.values() if line.get("seconds", 0) > 5]
    assert not [
        line for line in found.values() if "should not have happened" in line.get("error", "")
    ]
    assert "Traceback" not in run.said
    check_whole(desk.pictures)


def test_300_mutations(desk: Desk) -> None:
    for name, content in hostile.mutations(300):
        (desk.photos / name).write_bytes(content)
    run = desk.run("-j", "2", "--time-limit", "20", "--name", "{name}")
    account = run.account()
    assert account["counts"]["ok"] + account["counts"]["failed"] == 300, account
    assert account["counts"]["failed"] > 100
    assert not [
        line for line in run.lines[:-1] if "should not have happened" in line.get("error", "")
    ]
