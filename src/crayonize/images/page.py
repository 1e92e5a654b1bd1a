"""Drawings for a page of paper: the largest sheet of the photo's proportions that the page
holds.
"""

from ..settings import Settings

PAGES = {  # short and long side in mm
    "a6": (105.0, 148.0),
    "a5": (148.0, 210.0),
    "a4": (210.0, 297.0),
    "a3": (297.0, 420.0),
    "a2": (420.0, 594.0),
    "a1": (594.0, 841.0),
    "a0": (841.0, 1189.0),
    "letter": (215.9, 279.4),
    "legal": (215.9, 355.6),
    "tabloid": (279.4, 431.8),
    "4x6in": (101.6, 152.4),
    "8x10in": (203.2, 254.0),
}
DPI = 300.0
_MM_PER_INCH = 25.4


def fitted(
    settings: Settings, page: str | None, dpi: float | None, width: int, height: int
) -> Settings:
    """Settings whose sheet fills a page, upright or turned, for a photo of width x height pixels.

    Strokes keep their width in mm: a larger page has more of them.
    page: a name of PAGES; None leaves the sheet as it is.   dpi: pixels to the inch of paper; None
    means 300 with a page, and without one leaves the size as it is.
    """
    sheet_mm = settings.sheet_mm
    if page is not None:
        short_mm, long_mm = PAGES[page]
        sheet_mm = min(long_mm, short_mm * max(width, height) / min(width, height))
        dpi = dpi or DPI
    size = settings.size if dpi is None else max(1, round(sheet_mm / _MM_PER_INCH * dpi))
    return settings.changed(sheet_mm=sheet_mm, size=size)
