"""Names, trees and places: what is taken, where it goes, and what is refused before any work."""

import base64
import os
import shutil
import socket
from pathlib import Path

import pytest
from conftest import Batch, Desk, photo, tree

from crayonize.batch.conductor import run
from crayonize.batch.job import Recipe
from crayonize.batch.names import check_template, folded, picture_name
from crayonize.batch.options import Options
from crayonize.settings import Settings

ODD_NAMES = [
    b"plain.png",
    b"with space.png",
    b" leading.png",
    b"trailing .png",
    b"two..dots.png",
    b"UPPER.PNG",
    b"mixed.Png",
    "größe.png".encode(),
    "日本語.png".encode(),
    "\U0001f58d.png".encode(),
    "e\u0301.png".encode(),
    b"new\nline.png",
    b"tab\t.png",
    b"quote'\".png",
    b"back\\slash.png",
    b"-dash.png",
    b"--option.png",
    b"star*?.png",
    b"percent%20%s{0}.png",
    b"{stem}.png",
    b"\xff\xfe.png",
    b"half\xc3.png",
    b"\x1b[31mred.png",
    b"semi;$(x)`y`.png",
    b"con.png",
    b"#@!&.png",
]


def refused(inputs: list[Path], output: Path, **options: object) -> str:
    """Why a batch is refused."""
    with pytest.raises(ValueError) as caught:
        run(
            [str(path) for path in inputs],
            str(output),
            Options(**options),
            Recipe(Settings()),
            render="stand_in:sketch",
        )
    assert not output.exists() or ".crayonize" not in os.listdir(output), (
        "nothing is written before"
    )
    return str(caught.value)


def test_odd_names_are_kept_byte_for_byte(desk: Desk) -> None:
    content = photo(desk.base / "a.png").read_bytes()
    for name in ODD_NAMES:
        with open(os.path.join(os.fsencode(desk.photos), name), "wb") as file:
            file.write(content)
    result = desk.run()
    assert result.process.returncode == 0, result.said
    made = set(os.listdir(os.fsencode(desk.pictures))) - {b".crayonize"}
    assert made == {name.rsplit(b".", 1)[0] + b".png" for name in ODD_NAMES}
    exact = [base64.b64decode(line["in_base64"]) for line in result.lines if "in_base64" in line]
    assert sorted(exact) == [b"half\xc3.png", b"\xff\xfe.png"]
    assert "\x1b" not in result.said
    again = desk.run()
    assert again.count("skipped") == len(ODD_NAMES)


def test_long_names_and_deep_folders(desk: Desk) -> None:
    content = photo(desk.base / "a.png").read_bytes()
    (desk.photos / ("n" * 251 + ".png")).write_bytes(content)
    (desk.photos / ("m" * 251 + ".tif")).write_bytes(content)
    deep = desk.photos.joinpath(*"d" * 200)
    deep.mkdir(parents=True)
    (deep / "a.png").write_bytes(content)
    result = desk.run("--format", "webp")
    assert result.status("n" * 251 + ".png") == "failed" and "too long" in result.said
    assert result.status("m" * 251 + ".tif") == "failed"
    assert result.status("/".join("d" * 200) + "/a.png") == "ok"
    assert desk.run().count("ok") == 3


def test_a_path_too_long_for_the_system(desk: Desk) -> None:
    content, here = photo(desk.base / "a.png").read_bytes(), os.open(".", os.O_RDONLY)
    os.chdir(desk.fill(2).photos)
    try:
        for _ in range(18):
            os.mkdir("e" * 250)
            os.chdir("e" * 250)
        Path("a.png").write_bytes(content)
        os.chdir(here)
        result = Batch([desk.photos], desk.pictures, [], [])
        assert result.end() == 3
        assert (
            result.count("ok") == 2
            and result.count("failed") == 1
            and "cannot be listed" in result.said
        )
    finally:
        os.chdir(here)
        os.close(here)
        shutil.rmtree(desk.photos)


def test_what_is_no_ordinary_photo_is_told_and_left(desk: Desk) -> None:
    desk.fill(2)
    outside = photo(desk.base / "outside" / "o.png")
    os.mkfifo(desk.photos / "pipe.png")
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(desk.photos / "socket.png"))
    (desk.photos / "folder.png").mkdir()
    photo(desk.photos / "folder.png" / "in.png")
    (desk.photos / "out.png").symlink_to(outside)
    (desk.photos / "nowhere.png").symlink_to("nothing")
    (desk.photos / "loop").symlink_to(desk.photos)
    (desk.photos / "self.png").symlink_to("self.png")
    for name in (".hidden.png", "Thumbs.db", "desktop.ini", "note.txt", "~$a.png"):
        (desk.photos / name).write_bytes(b"x")
    photo(desk.photos / "__MACOSX" / "a.png")
    photo(desk.photos / ".thumbnails" / "a.png")
    result = desk.run()
    assert result.process.returncode == 0
    assert result.count("ok") == 3 and result.count("ignored") == 13
    assert (desk.pictures / "folder.png" / "in.png").is_file()


@pytest.mark.parametrize(
    "names",
    [
        ("a.jpg", "a.png"),
        ("A.png", "a.png"),
        ("é.png", "e\u0301.png"),
        ("x/a.jpg", "X/a.jpg"),
        ("ß.png", "SS.png"),
        ("a.jpg", "a.png/b.png"),
    ],
)
def test_two_photos_for_one_place_are_refused(desk: Desk, names: tuple[str, str]) -> None:
    for name in names:
        photo(desk.photos / name)
    reason = refused([desk.photos], desk.pictures)
    assert (
        all(os.path.basename(name.split("/b")[0]) in reason for name in names)
        and "--name" in reason
    )


def test_the_whole_name_keeps_a_jpg_and_a_png_apart(desk: Desk) -> None:
    photo(desk.photos / "a.jpg")
    photo(desk.photos / "a.png")
    assert desk.run("--name", "{name}").count("ok") == 2
    assert set(tree(desk.pictures)) == {"a.jpg.png", "a.png.png"}


@pytest.mark.parametrize("where", ["same", "inside", "around", "link", "link inside"])
def test_folders_in_one_another_are_refused(desk: Desk, where: str) -> None:
    desk.fill(3)
    output = desk.pictures
    match where:
        case "same":
            output = desk.photos / "."
        case "inside":
            output = desk.photos / "0" / "new"
        case "around":
            output = desk.base
        case "link":
            output.symlink_to(desk.photos)
        case "link inside":
            output.mkdir()
            (output / "1").symlink_to(desk.photos / "2")
    before = tree(desk.photos)
    assert "another" in (reason := refused([desk.photos], output)) or "leads into" in reason
    assert tree(desk.photos) == before
    if output.is_symlink():
        output.unlink()


def test_a_list_of_photos_is_never_written_over(desk: Desk) -> None:
    first, second = photo(desk.photos / "a.png", 1), photo(desk.photos / "b.png", 2)
    assert "over a photo" in refused([first, second], desk.photos)
    link = desk.base / "pictures" / "a.png"
    link.parent.mkdir()
    link.symlink_to(first)
    os.link(second, desk.base / "pictures" / "b.png")
    more = desk.pictures / "c.png"
    more.symlink_to(first)
    assert "over a photo" in refused([more], desk.pictures)
    more.unlink()
    result = desk.run("--existing", "overwrite")
    assert (
        result.process.returncode == 3
        and result.count("failed") == 2
        and "its own place" in result.said
    )


def test_photos_of_one_name_from_two_folders(desk: Desk) -> None:
    paths = [photo(desk.photos / folder / "a.png") for folder in "xy"]
    assert "both become 'a.png'" in refused(paths, desk.pictures)
    assert (
        run(
            [str(desk.photos / "x"), str(desk.photos / "y")],
            str(desk.pictures),
            Options(quiet=True),
            Recipe(Settings()),
            render="stand_in:sketch",
        )
        == 0
    )
    assert set(tree(desk.pictures)) == {"x/a.png", "y/a.png"}


def test_patterns_and_named_links_and_files(desk: Desk) -> None:
    photo(desk.photos / "a1.png")
    photo(desk.photos / "a2.png")
    photo(desk.photos / "b.png").rename(desk.photos / "b.odd")
    (desk.photos / "c.png").symlink_to(desk.photos / "a1.png")
    names = [str(desk.photos / name) for name in ("a*.png", "b.odd", "c.png", "a1.png")]
    assert (
        run(
            names,
            str(desk.pictures),
            Options(quiet=True),
            Recipe(Settings()),
            render="stand_in:sketch",
        )
        == 0
    )
    assert set(tree(desk.pictures)) == {"a1.png", "a2.png", "b.png", "c.png"}
    assert "no such" in refused([desk.photos / "z*.png"], desk.base / "more")


@pytest.mark.parametrize(
    "template",
    [
        "",
        "x",
        "{stem",
        "{nothing}",
        "{stem.__class__}",
        "{stem!r}",
        "{stem:>9}",
        "../{stem}",
        "a/{stem}",
        "{0}{stem}",
    ],
)
def test_templates_that_are_refused(template: str) -> None:
    with pytest.raises(ValueError, match="--name"):
        check_template(template)


def test_names_by_template() -> None:
    more = {"palette": "box24"}
    assert (
        picture_name("d/e/a.b.jpg", "{parent}-{stem}.{palette}", ".png", more)
        == "d/e/e-a.b.box24.png"
    )
    assert picture_name("a.jpg", "{name}", ".webp", {}) == "a.jpg.webp"
    assert folded("STRASSE") == folded("straße")
    assert folded("\u00e9") == folded("e\u0301") == folded("E\u0301")
