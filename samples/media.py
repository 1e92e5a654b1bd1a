"""Draws samples/gallery/media.jpg: swatches of all media, and one photo drawn with each.

usage: python samples/media.py
"""

from pathlib import Path

import numpy as np
from gallery import QUALITY, beside
from PIL import Image

from crayonize import convert, draw
from stroke_gen.drawing import Drawing, Stroke, Tip

HERE = Path(__file__).parent
MEDIA = ("metric", "oil-pastel", "pencil")  # a crayon first
TIPS_MM = (2.4, 3.1, 1.1)
PRESSURES = (0.12, 0.4, 1.0)  # N/mm^2
SIDE_MM, GAP_MM = 18.0, 2.0
OVER = (("blue", "yellow"), ("black", "yellow"), ("red", "white"))  # below, and drawn across it
SHEET_MM = (7 * (SIDE_MM + GAP_MM) + GAP_MM, SIDE_MM + 2 * GAP_MM)
PHOTO, WIDE = HERE / "photos" / "fig.jpg", 1300


def hatching(left: float, angle_deg: float, crayon: str, tip: Tip, pressure: float) -> Stroke:
    """A zigzag over the square whose left edge is at `left`."""
    half, angle = SIDE_MM / 2, np.deg2rad(angle_deg)
    lines = np.arange(-1.4 * half, 1.4 * half, 0.62 * tip.width_mm)
    along = np.linspace(-1.5 * half, 1.5 * half, 60)
    ends = []
    for number, y in enumerate(lines):
        x, y = along * np.cos(angle) - y * np.sin(angle), along * np.sin(angle) + y * np.cos(angle)
        inside = np.flatnonzero((np.abs(x) < half) & (np.abs(y) < half))
        if inside.size:
            both = inside[[0, -1]] if number % 2 else inside[[-1, 0]]
            ends.append(np.stack([x[both], y[both]], 1))
    path = np.concatenate(ends) + np.array([left + half, GAP_MM + half])
    force = np.full(len(path), pressure * tip.area_mm2)
    return Stroke(path.astype(np.float32), force.astype(np.float32), crayon, tip)


def swatches(physics: str, tip_mm: float) -> Image.Image:
    """Three pressures, a stroke that leans more and more, and light over dark."""
    tip, strokes = Tip("blunt", tip_mm), []
    for number, pressure in enumerate(PRESSURES):
        left = GAP_MM + number * (SIDE_MM + GAP_MM)
        strokes.append(hatching(left, -50, "red", tip, pressure))
    left = GAP_MM + 3 * (SIDE_MM + GAP_MM)
    for number, tilt in enumerate((0, 25, 50, 70)):
        y = GAP_MM + (number + 0.5) * SIDE_MM / 4
        path = np.array([[left, y], [left + SIDE_MM, y]], np.float32)
        force = np.full(2, 0.4 * tip.area_mm2, np.float32)
        lean = np.tile(np.float32([tilt, 90]), (2, 1))
        strokes.append(Stroke(path, force, "blue", tip, tilt_deg=lean))
    for number, (below, above) in enumerate(OVER):
        left = GAP_MM + (4 + number) * (SIDE_MM + GAP_MM)
        strokes.append(hatching(left, -50, below, tip, 0.4))
        y = GAP_MM + SIDE_MM / 2
        for aside in (-4.5, 0.0, 4.5):
            ends = [[left - 1, y + aside], [left + SIDE_MM + 1, y + aside]]
            force = np.full(2, 0.6 * tip.area_mm2, np.float32)
            strokes.append(Stroke(np.array(ends, np.float32), force, above, tip))
    drawing = Drawing(*SHEET_MM, "drawing", "box24", tuple(strokes), physics)
    return Image.fromarray(draw(drawing, size=WIDE))


def main() -> None:
    """Draw and save the sheet."""
    rows = [swatches(*medium) for medium in zip(MEDIA, TIPS_MM, strict=True)]
    photos = [convert(PHOTO, physics=medium, size=900) for medium in MEDIA]
    strip = beside(photos, round(WIDE / 3 / photos[0].width * photos[0].height))
    strip = strip.resize((WIDE, round(strip.height * WIDE / strip.width)), Image.Resampling.LANCZOS)
    sheet = Image.fromarray(np.vstack([np.asarray(row) for row in [*rows, strip]]))
    target = HERE / "gallery" / "media.jpg"
    sheet.save(target, quality=QUALITY)
    print(target)


if __name__ == "__main__":
    main()
