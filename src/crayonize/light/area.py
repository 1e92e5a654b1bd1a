"""Area means: a picture that comes strip by strip, reduced to a coarser grid without ever being
held whole.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]


def narrowed(strip: Floats, columns: int) -> Floats:
    """Area mean along each row of a strip (rows, cols, 3): (rows, columns, 3), no more columns than
    there are.

    OpenCV leaves out shares below 1/1000 pixel: divide by those it did count.
    """
    counted = cv2.resize(
        np.ones((1, strip.shape[1]), np.float32), (columns, 1), interpolation=cv2.INTER_AREA
    )
    narrow = cv2.resize(strip, (columns, len(strip)), interpolation=cv2.INTER_AREA)
    return np.asarray(narrow / counted[..., np.newaxis], np.float32)


def add_rows(out: Floats, rows: Floats, top: int, height: int) -> None:
    """Area mean down the columns: give each source row to the one or two rows of `out` that it
    covers.

    rows: from row `top` on of a source `height` rows high, as wide as `out` and no lower. Counted
        in whole
    numbers: a source row is len(out) units high, a row of `out` is `height` units.
    """
    for y, row in enumerate(rows, start=top):
        target, offset = divmod(y * len(out), height)
        spill = max(0, offset + len(out) - height)
        out[target] += row * ((len(out) - spill) / height)
        if spill:
            out[target + 1] += row * (spill / height)
