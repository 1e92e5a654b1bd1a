"""The scene: all that the generator knows of a photo, brought together on the work grid."""

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from . import analysis, surfaces
from . import subject as seeing
from .colour import from_oklab, oklab
from .guide import Guide
from .params import Style
from .subject import Subject
from .swatches import Swatches

Floats = NDArray[np.float32]
Box = tuple[float, float, float, float]  # x, y, width, height in fractions of the picture
CALM = 0.5  # tips: windows over which colours are calmed where no care is due
WINDOW = 1.1  # tips: the windows in which a plate follows the photo's colours


@dataclass(frozen=True, eq=False)
class Scene:
    """A photo as it will be drawn, on the work grid (h, w)."""

    target: Floats  # (h, w, 3) linear colours the drawing should show from afar
    lab: Floats  # (h, w, 3) the same as OKLab, chroma doubled
    natural: Floats  # (h, w, 3) OKLab of the photo as it is
    guide: Guide  # calmed colours: what a thick crayon aims at
    label: NDArray[np.int32]  # (h, w) surface of each place
    family: NDArray[np.int32]  # (h, w) family of surfaces that are coloured alike
    tangent: Floats  # (h, w, 2) unit vector along which strokes run, x then y
    coherence: Floats  # (h, w) 0 no direction of its own .. 1 one clear direction
    subject: Subject
    skin: Floats  # (h, w) 0 none .. 1 skin
    hair: Floats  # (h, w) 0 none .. 1 hair
    care: Floats  # (h, w) 0 ground .. 1 the one who is drawn
    detail: Floats  # (h, w) 0 plain .. 1 eyes, lettering, edges
    cell_mm: float


def read(
    photo: Floats,
    subject: Subject,
    sheet_mm: tuple[float, float],
    swatches: Swatches,
    style: Style,
    focus: Sequence[Box],
    pool: Executor,
) -> Scene:
    """See a photo in linear light (h, w, 3) for a sheet of this width and height, as far as these
    crayons can draw it.

    focus: boxes (x, y, w, h) in fractions of the picture that deserve care.
    """
    cell_mm = max(sheet_mm) / analysis.WORK_LONG
    tip = style.tip_mm / cell_mm
    seen = analysis.unframed(analysis.fit(photo, analysis.work_shape(*sheet_mm)))
    lab = analysis.tone_map(oklab(seen), swatches, style, tip)
    target = from_oklab(lab)
    detail = pool.submit(lambda: analysis.detail(lab, tip))
    natural = oklab(seen)
    care = seeing.care(subject, natural, focus)
    skin = seeing.skin(subject, natural)
    hair = seeing.hair(subject, natural, skin)
    calm = oklab(analysis.calmed(target, max(1, round(CALM * tip))))
    structure = pool.submit(lambda: analysis.structure(calm, tip))
    label = surfaces.part(calm, care, subject.mask + skin, tip, style.merge)
    kind = skin + 2 * hair + 0.5 * subject.mask
    family = surfaces.families(label, calm, kind, style.merge)[label].astype(np.int32)
    field = structure.result()
    tangent = surfaces.directions(field, label, care, tip, style.wrist_deg, style.wrist)
    coherence = np.hypot(field[..., 0], field[..., 1]) / (field[..., 2] + 1e-6)
    fine = np.clip(care * 1.5, 0, 1)[..., None]
    guide = Guide((calm * (1 - fine) + lab * fine).astype(np.float32), WINDOW * tip)
    worth = (detail.result() * (0.35 + 0.65 * care)).astype(np.float32)
    return Scene(
        target,
        lab,
        natural,
        guide,
        label,
        family,
        tangent,
        coherence,
        subject,
        skin,
        hair,
        care,
        worth,
        cell_mm,
    )
