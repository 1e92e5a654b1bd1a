"""What is said on stderr while the command works: a line of progress, and our own messages."""

import argparse
import os
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from stroke_gen.checks import printable

from ..machine.terminal import Bar, tell

if TYPE_CHECKING:
    from stroke_gen.drawing import Drawing

    from ..pipeline import Easel, Progress


@contextmanager
def talk(options: argparse.Namespace) -> Iterator["Progress"]:
    """The progress line, and our own messages, on stderr; with -q nothing, and warnings only with
    -v.
    """
    import logging
    import warnings

    bar = Bar(shown=not options.quiet)

    def progress(name: str, share: float) -> None:
        bar.show(share, f"{share:4.0%}", f"{name[:16]:16} ")

    with warnings.catch_warnings():

        class Messages(logging.Handler):
            def emit(self, record: logging.LogRecord) -> None:
                bar.clear()
                tell(f"crayonize: {record.getMessage()}\n")

        log, messages = logging.getLogger("crayonize"), Messages()
        if not options.verbose:
            warnings.simplefilter("ignore")
        if not options.quiet:
            log.addHandler(messages)
            log.setLevel(logging.INFO)
        try:
            yield progress
        finally:
            bar.clear()
            log.removeHandler(messages)


def swatch(colour: str) -> str:
    """Some blanks on a ground of #rrggbb if stdout is a terminal; else nothing."""
    if sys.stdout is None or not sys.stdout.isatty():
        return ""
    red, green, blue = bytes.fromhex(colour[1:])
    return f"\x1b[48;2;{red};{green};{blue}m    \x1b[0m "


def report(
    out: str | Path, beside: Sequence[str | None], easel: "Easel", drawing: "Drawing", begun: float,
    *, verbose: bool,
) -> None:  # fmt: skip
    """One line on stderr: what was written, how large it is, and how long it took."""
    files = ", ".join(printable(os.fspath(name)) for name in (out, *beside) if name)
    pixels = f"{easel.sheet.cols} x {easel.sheet.rows} pixels"
    sheet = f"a sheet of {drawing.width_mm:.0f} x {drawing.height_mm:.0f} mm"
    more = f"; {len(drawing.strokes)} strokes, seed {drawing.seed}" if verbose else ""
    seconds = time.monotonic() - begun
    tell(f"crayonize: {files}: {pixels}, {sheet}, {seconds:.1f} s{more}\n")
