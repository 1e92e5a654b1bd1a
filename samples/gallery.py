"""Draws the gallery: each photo of samples/photos in four styles, side by side, and the README's
first picture.

usage: python samples/gallery.py [NAME ...]        one strip a photo goes to
samples/gallery/NAME.jpg
"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image

from crayonize import convert

HERE = Path(__file__).parent
STYLES = ("artist", "child", "sketch", "solid")
FIRST = "astronaut"
STRIP_PX, FIRST_PX = 440, 720  # height of a strip, of the first picture
QUALITY = 84


def beside(pictures: list[Image.Image], height: int) -> Image.Image:
    """Pictures scaled to one height, side by side on white."""
    sizes = [(round(p.width * height / p.height), height) for p in pictures]
    scaled = [
        p.convert("RGB").resize(s, Image.Resampling.LANCZOS)
        for p, s in zip(pictures, sizes, strict=True)
    ]
    gap = np.full((height, 8, 3), 255, np.uint8)
    row = [part for picture in scaled for part in (np.asarray(picture), gap)][:-1]
    return Image.fromarray(np.hstack(row))


def main(names: list[str]) -> None:
    """Draw the photos named, or all."""
    for path in sorted(HERE.glob("photos/*.*g")):
        if names and path.stem not in names:
            continue
        photo = Image.open(path)
        drawings = [convert(photo, style=style) for style in STYLES]
        target = HERE / "gallery" / f"{path.stem}.jpg"
        beside([photo, *drawings], STRIP_PX).save(target, quality=QUALITY)
        print(target)
        if path.stem == FIRST:
            beside([photo, drawings[0]], FIRST_PX).save(
                HERE / "gallery" / "first.jpg", quality=QUALITY
            )


if __name__ == "__main__":
    main(sys.argv[1:])
