"""Who is drawn: faces found where they are and nowhere else, the mask, skin, hair and care."""

import hashlib
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image

from stroke_gen import networks, subject
from stroke_gen.colour import oklab
from stroke_gen.saliency import saliency

PHOTOS = Path(__file__).parents[2] / "samples" / "photos"
FACELESS = ("brushes.jpg", "dandelion.jpg", "dogs.jpg", "fig.jpg", "mountains.jpg", "sunset.jpg")
EYES = (203, 101), (246, 103)  # pixels of the astronaut's pupils, by eye
DARK = np.array([0.22, 0.14, 0.11], np.float32)  # of the light that pale skin throws back


def photo(name):
    """A sample photo in linear light, its long side at most 800."""
    with Image.open(PHOTOS / name) as picture:
        picture.thumbnail((800, 800))
        srgb = np.asarray(picture.convert("RGB"), np.float32) / 255
    linear = np.where(srgb < 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    return linear.astype(np.float32)


@pytest.fixture(scope="module")
def astronaut():
    return photo("astronaut.png")


def looked_at(linear, mask=None):
    """The subject of a photo on a grid of 640 cells, and the photo's OKLab there."""
    h, w = linear.shape[:2]
    shape = round(640 * h / max(h, w)), round(640 * w / max(h, w))
    lab = oklab(cv2.resize(linear, shape[::-1], interpolation=cv2.INTER_AREA).clip(0, 1))
    return subject.see(linear, shape, mask), lab


def test_networks_are_those_that_the_notice_names():
    notice = (networks.MODELS / "NOTICE").read_text()
    for path in networks.MODELS.glob("*.tflite"):
        assert hashlib.sha256(path.read_bytes()).hexdigest() in notice
    assert networks.available()


def test_the_face_is_found_where_it_is(astronaut):
    seen, _ = looked_at(astronaut)
    (face,) = seen.faces
    for lids, pupil in zip(
        zip(subject.UPPER_LID, subject.LOWER_LID, strict=True), EYES, strict=True
    ):
        middle = np.concatenate([face.path(lid) for lid in lids]).mean(0) * 512 / 640
        assert np.abs(middle - pupil).max() < 4
    assert seen.mask[face.landmarks[4].astype(int)[1], face.landmarks[4].astype(int)[0]] > 0.9
    assert seen.mask[:40].mean() < 0.3 and seen.mask[300:, 100:300].mean() > 0.9  # wall, suit


@pytest.mark.parametrize("threads", [1, 2, 4])
def test_threads_change_no_bit(astronaut, threads):
    once, lab = looked_at(astronaut)
    before = cv2.getNumThreads()
    cv2.setNumThreads(threads)
    try:
        again, _ = looked_at(astronaut)
        assert cv2.getNumThreads() == threads
        care = subject.care(again, lab, [(0.1, 0.1, 0.3, 0.5)])
    finally:
        cv2.setNumThreads(before)
    assert again.mask.tobytes() == once.mask.tobytes()
    assert again.faces[0].landmarks.tobytes() == once.faces[0].landmarks.tobytes()
    assert care.tobytes() == subject.care(once, lab, [(0.1, 0.1, 0.3, 0.5)]).tobytes()


@pytest.mark.parametrize("name", FACELESS)
def test_no_face_in_photos_without(name):
    assert looked_at(photo(name))[0].faces == ()


@pytest.mark.parametrize("seed", range(14))
def test_no_face_in_made_up_pictures(seed):
    rng = np.random.default_rng(seed)
    if seed < 7:  # clouds, from fine to coarse
        made = cv2.GaussianBlur(
            rng.random((300, 400, 3)).astype(np.float32), (0, 0), 1.5 ** (seed + 1)
        )
        made = (made - made.min()) / (made.max() - made.min())
    else:  # coloured discs on a ground
        made = np.full((300, 400, 3), 0.5, np.float32)
        for _ in range(40):
            middle = int(rng.integers(400)), int(rng.integers(300))
            cv2.circle(made, middle, int(rng.integers(4, 60)), rng.random(3).tolist(), -1)
    assert looked_at(made.astype(np.float32))[0].faces == ()


@pytest.mark.parametrize("degrees", [-45, -20, 20, 45])
def test_a_turned_face_is_found(astronaut, degrees):
    head = np.ascontiguousarray(astronaut[20:220, 130:330])
    turn = cv2.getRotationMatrix2D((100, 100), degrees, 1)
    turned = cv2.warpAffine(head, turn, (200, 200), borderValue=(0.5, 0.5, 0.5))
    (face,) = looked_at(turned)[0].faces
    assert np.degrees(np.arctan2(*face.down)) == pytest.approx(degrees, abs=12)


@pytest.mark.parametrize("pixels", [60, 30, 20])
def test_a_small_face_is_found(astronaut, pixels):
    size = round(512 * pixels / 108)  # the face is 108 pixels high
    small = cv2.resize(astronaut, (size, size), interpolation=cv2.INTER_AREA)
    wide = np.full((max(size, 480), 640, 3), 0.5, np.float32)
    wide[:size, 200 : 200 + size] = small
    (face,) = looked_at(wide)[0].faces
    assert face.height == pytest.approx(pixels, rel=0.25)


@pytest.mark.parametrize(
    "part", [np.s_[:, 205:], np.s_[105:], np.s_[:165]], ids=["left", "top", "bottom"]
)
def test_a_face_cut_by_the_border_is_found(astronaut, part):
    assert len(looked_at(np.ascontiguousarray(astronaut[part]))[0].faces) == 1


def test_care_is_highest_on_the_face_and_fades_into_the_ground(astronaut):
    seen, lab = looked_at(astronaut)
    care = subject.care(seen, lab)
    x, y = seen.faces[0].landmarks[4].astype(int)
    assert care[y, x] == 1 and 0.6 < care[500, 200] < 0.9 and care[100, 40] < 0.1
    assert np.abs(np.diff(care, axis=0)).max() < 0.5


def test_focus_is_no_rectangle():
    plain = np.zeros((400, 600, 3), np.float32) + np.float32([0.6, 0, 0])
    nobody = subject.Subject((), np.zeros((400, 600), np.float32))
    care = subject.care(nobody, plain, [(0.25, 0.25, 0.5, 0.5)])
    assert care[200, 300] > 0.99 and care[0, 0] < 0.01
    for level in (0.2, 0.5, 0.8):
        inside = care > level
        rows, cols = np.flatnonzero(inside.any(1)), np.flatnonzero(inside.any(0))
        box = (np.ptp(rows) + 1) * (np.ptp(cols) + 1)
        assert inside.sum() / box == pytest.approx(
            np.pi / 4, abs=0.03
        )  # an ellipse fills that much


def test_focus_gives_way_to_edges():
    """Half of what the box holds is another thing than what lies beyond it on that side."""
    lab = np.zeros((400, 600, 3), np.float32) + np.float32([0.8, 0, 0])
    lab[:, 330:] = [0.3, 0.1, 0.1]
    nobody = subject.Subject((), np.zeros((400, 600), np.float32))
    box = [(0.25, 0.25, 0.3, 0.5)]  # up to column 330
    across = subject.care(nobody, lab, box)[200]
    plain = subject.care(nobody, 0 * lab, box)[200]
    assert np.abs(np.diff(across)[325:335]).max() > 2 * np.abs(np.diff(plain)[325:335]).max()


@pytest.mark.parametrize("tint", [np.ones(3, np.float32), DARK], ids=["pale", "dark"])
def test_skin_is_the_face_but_not_the_suit(astronaut, tint):
    lit = cv2.GaussianBlur((looked_at(astronaut)[0].mask > 0.5).astype(np.float32), (0, 0), 2)
    lit = cv2.resize(lit, (512, 512))[..., None]
    seen, lab = looked_at((astronaut * (1 - lit + lit * tint)).astype(np.float32))
    (face,) = seen.faces
    bare = subject.skin(seen, lab)

    def at(landmark):
        x, y = face.landmarks[landmark].astype(int)
        return bare[y, x]

    assert min(at(i) for i in (50, 280, 9, 199)) > 0.8  # cheeks, forehead, chin
    own = subject.features(face, bare.shape) > 0.9
    assert bare[own].min() > 0.5  # eyes, brows and mouth are drawn on skin
    assert bare[450:600, 100:250].mean() < 0.2 and bare[:, :140].mean() < 0.03


def test_hair_frames_the_face(astronaut):
    seen, lab = looked_at(astronaut)
    hair = subject.hair(seen, lab, subject.skin(seen, lab))
    face = seen.faces[0]
    above = (face.landmarks[subject.CROWN] - 0.3 * face.height * face.down).astype(int)
    assert hair[above[1] - 5 : above[1] + 5, above[0] - 15 : above[0] + 15].mean() > 0.3
    assert hair[face.landmarks[4].astype(int)[1], face.landmarks[4].astype(int)[0]] < 0.05
    assert hair[300:].mean() < 0.01


def test_a_mask_of_the_users_own_is_taken(astronaut):
    left = np.zeros((10, 10), np.float32)
    left[:, :5] = 1
    seen, _ = looked_at(astronaut, left)
    assert seen.mask[:, :250].min() == 1 and seen.mask[:, 400:].max() == 0
    nothing, _ = looked_at(astronaut, np.zeros((1, 1), np.float32))
    assert nothing.faces == () and nothing.mask.max() == 0


def test_without_networks_what_stands_out_is_the_subject(astronaut, monkeypatch):
    monkeypatch.setattr(networks, "available", lambda: False)
    seen, _ = looked_at(astronaut)
    assert seen.faces == ()
    assert seen.mask[400:600, 150:300].mean() > seen.mask[:80].mean() + 0.15


def test_saliency_is_high_on_what_no_border_leads_to_and_low_on_a_plain():
    lab = np.zeros((200, 300, 3), np.float32) + np.float32([0.7, 0, 0])
    lab[..., 0] += np.linspace(-0.2, 0.2, 300)  # the light falls off: that is no thing
    assert saliency(lab).max() < 0.2
    cv2.circle(lab, (160, 100), 40, (0.5, 0.2, 0.1), -1)
    found = saliency(lab)
    assert found[90:110, 150:170].min() > 0.9 and found[:20].max() < 0.2


@pytest.mark.parametrize("size", [(1, 1), (3, 900), (900, 3), (40, 80)])
def test_any_size_is_looked_at(size):
    linear = np.random.default_rng(0).random((*size, 3)).astype(np.float32)
    h, w = (max(2, round(640 * n / max(size))) for n in size)
    seen = subject.see(linear, (h, w))
    lab = np.zeros((h, w, 3), np.float32)
    assert seen.mask.shape == (h, w) == subject.care(seen, lab, [(0, 0, 0, 0)]).shape
    assert np.isfinite(seen.mask).all() and seen.mask.dtype == np.float32
