"""Reading the photo: colours that crayons can give, structure, detail.

All maps live on the work grid, a few cells to a crayon's width, whatever the size of photo and
sheet.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from .colour import oklab
from .params import Style
from .swatches import Swatches

Floats = NDArray[np.float32]
WORK_LONG = 640  # cells along the work grid's long side
RIM = 0.006  # of the long side: a frame that is not drawn
WIDE = 3.0  # cells: wide enough a bell to look smooth on its grid
WHITE = 0.83  # OKLab L from which what has no colour turns into bare paper
KNEE = 0.15  # OKLab L above the darkest crayon from which tones may stay as they are
LOCAL = 4.0  # tips: over less than that, contrast stays as it is when tones are drawn together
FLATTEST = 0.9  # share of the crayons' range of tones that a photo is taken to have at least
WARM = np.deg2rad(58)  # OKLab hue of skin


def work_shape(width_mm: float, height_mm: float) -> tuple[int, int]:
    """Rows and columns of the work grid."""
    cell = max(width_mm, height_mm) / WORK_LONG
    return max(2, round(height_mm / cell)), max(2, round(width_mm / cell))


def fit(linear: Floats, shape: tuple[int, int]) -> Floats:
    """Linear light resampled to `shape`: area mean when shrinking, smooth when enlarging."""
    shrink = linear.shape[0] * linear.shape[1] >= shape[0] * shape[1]
    method = cv2.INTER_AREA if shrink else cv2.INTER_CUBIC
    return np.clip(cv2.resize(linear, shape[::-1], interpolation=method), 0, 1).astype(np.float32)


def blur(image: Floats, sigma: float) -> Floats:
    """Gaussian blur, edges reflected; sigma in cells."""
    if sigma < 0.3:
        return image
    return np.asarray(
        cv2.GaussianBlur(image, (0, 0), sigma, borderType=cv2.BORDER_REFLECT), np.float32
    )


def wide_blur(image: Floats, sigma: float) -> Floats:
    """As `blur`, to a hundredth or so: a wide bell is laid on a grid as coarse as it bears."""
    shrink = int(sigma / WIDE)
    if shrink < 2:
        return blur(image, sigma)
    h, w = image.shape[:2]
    size = -(-w // shrink), -(-h // shrink)
    coarse = np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.float32)
    # Taking means and going back are themselves as wide as a bell of this variance.
    coarse = blur(coarse, np.sqrt(sigma**2 - shrink**2 / 4) / shrink)
    return np.asarray(cv2.resize(coarse, (w, h), interpolation=cv2.INTER_LINEAR), np.float32)


def far(linear: Floats) -> Floats:
    """OKLab (h, w, 3) of a picture as the eye sees it from across the room."""
    return oklab(wide_blur(linear, 0.012 * max(linear.shape)))


def structure(lab: Floats, tip: float) -> Floats:
    """Cosine and sine (h, w, 3) of the double angle along the form, times its energy, and the
    energy.

    A colour structure tensor at two scales, the finest a tip's: strong gradients speak far into
    flat areas, and what is finer than a stroke says nothing about where strokes run.
    """
    smooth = blur(lab, 0.5 * tip)
    gx, gy = _scharr(smooth, 1, 0), _scharr(smooth, 0, 1)
    e, f, g = _sum(gx * gx), _sum(gx * gy), _sum(gy * gy)
    cap = np.float32(np.percentile(e + g, 98)) + np.float32(1e-8)
    limit = np.minimum(1, cap / (e + g + 1e-8))
    # The stroke runs along the edge: the double angle of the gradient, turned by half a turn.
    tensor = np.dstack([(g - e) * limit, -2 * f * limit, (e + g) * limit]).astype(np.float32)
    return np.asarray(0.6 * wide_blur(tensor, 1.2 * tip) + wide_blur(tensor, 4 * tip), np.float32)


def _sum(image: Floats) -> Floats:
    """Sum over the three channels; numpy takes ten times as long over so short an axis."""
    return np.asarray(cv2.transform(image, np.ones((1, 3), np.float32)), np.float32)


def _scharr(image: Floats, dx: int, dy: int) -> Floats:
    """Scharr derivative, edges reflected, in units per cell."""
    return np.asarray(
        cv2.Scharr(image, cv2.CV_32F, dx, dy, scale=1 / 32, borderType=cv2.BORDER_REFLECT),
        np.float32,
    )


def calmed(linear: Floats, radius: int) -> Floats:
    """Kuwahara's filter: each place takes the mean of the quietest of the four windows it is a
    corner of.

    Texture goes, borders stay and the half-tones along them vanish, so no grey rims are drawn.
    """
    side = radius + 1
    brightness = _sum(linear)
    quiet, out = np.full(brightness.shape, np.inf, np.float32), linear.copy()
    for anchor in ((0, 0), (radius, 0), (0, radius), (radius, radius)):
        mean, square = (
            cv2.boxFilter(m, cv2.CV_32F, (side, side), anchor=anchor)
            for m in (brightness, brightness**2)
        )
        spread = square - mean * mean
        quieter = spread < quiet
        np.copyto(quiet, spread, where=quieter)
        cv2.copyTo(
            cv2.boxFilter(linear, cv2.CV_32F, (side, side), anchor=anchor),
            quieter.astype(np.uint8),
            out,
        )
    return out


def unframed(linear: Floats) -> Floats:
    """The outermost cells replaced by their inner neighbours: scans have dark rims that nobody
    would draw.
    """
    rim = max(1, round(RIM * max(linear.shape)))
    inner = linear[rim:-rim, rim:-rim]
    return (
        np.pad(inner, ((rim, rim), (rim, rim), (0, 0)), mode="edge")
        if min(inner.shape[:2]) > rim
        else linear
    )


def detail(lab: Floats, tip: float) -> Floats:
    """Where a sharpened tip is worth taking: fine local contrast that rises over its
    surroundings.
    """
    fine = np.sqrt(blur(_sum((lab - blur(lab, 0.8 * tip)) ** 2), 0.6 * tip))
    around = wide_blur(fine, 6 * tip)
    level = np.clip(fine / (0.03 + around) - 0.4, 0, 1.2) / 1.2 * np.clip(fine / 0.06, 0, 1)
    return np.asarray(level, np.float32)


def turned(tangent: Floats, degrees: np.float32 | Floats) -> Floats:
    """A field of directions turned by an angle, one for all or one for each place (h, w)."""
    c, s = np.cos(np.deg2rad(degrees)), np.sin(np.deg2rad(degrees))
    x, y = tangent[..., 0], tangent[..., 1]
    return np.ascontiguousarray(np.dstack([c * x - s * y, s * x + c * y]), np.float32)


def _toe(lightness: Floats, low: float, darkest: float) -> Floats:
    """Lightness that stays as it is from KNEE above `darkest` and is drawn together below, `low` to
    `darkest`.
    """
    knee = darkest + KNEE
    if low >= darkest:
        return lightness
    depth = np.clip((knee - lightness) / (knee - low), 0, 1)
    return np.where(
        depth > 0, knee - KNEE * (1 - (1 - depth) ** ((knee - low) / KNEE)), lightness
    ).astype(np.float32)


def tone_map(lab: Floats, swatches: Swatches, style: Style, tip: float) -> Floats:
    """A photo's OKLab colours brought into what paper and crayons can give; tip in cells.

    Tones may stay as they are, with only the darks drawn together, or all be drawn together alike,
    from the darkest crayon to the paper: `style.lift` says how far. What is finer than a few tips
    keeps its contrast.
    """
    # on dark paper crayons are the light
    given = np.append(swatches.lightness(), oklab(swatches.paper)[0])
    darkest, lightest = float(given.min()), float(given.max())
    out, light = lab.copy(), lab[..., 0]
    low, high = np.percentile(light, (0.5, 98)).tolist()
    base = np.asarray(
        cv2.ximgproc.guidedFilter(light, light, max(2, round(LOCAL * tip)), 4e-3), np.float32
    )
    spread = min(low + FLATTEST * (lightest - darkest), lightest)  # what is light stays light
    dark, bright = min(low, darkest), max(high, spread)
    straight = darkest + (base - dark) * (lightest - darkest) / (bright - dark)
    tone = style.lift * straight + (1 - style.lift) * _toe(base, low, darkest)
    out[..., 0] = np.clip(tone + light - base, darkest, lightest)
    chroma = np.hypot(lab[..., 1], lab[..., 2])
    paling = max(lightest - WHITE - 0.03, 0.01)  # no crayon may be that light on dark paper
    white = np.clip((out[..., 0] - WHITE) / paling, 0, 1) * np.clip(2 - chroma / 0.03, 0, 1)
    out[..., 0] += white * white * (3 - 2 * white) * (lightest - out[..., 0])
    warm = np.clip(
        (lab[..., 1] * np.cos(WARM) + lab[..., 2] * np.sin(WARM)) / (chroma + 1e-6), 0, 1
    )
    shy = np.exp(-((chroma / 0.18) ** 2)) * np.clip(chroma / 0.05, 0, 1)
    out[..., 1:] *= (style.chroma * (1 + style.skin * warm**2 * shy))[..., None]
    return out
