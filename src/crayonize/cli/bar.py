"""What is said on stderr while the command works: a line of progress, and our own messages."""

import argparse
import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from stroke_gen.checks import printable

from ..machine.terminal import Bar

if TYPE_CHECKING:
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
                print(f"crayonize: {record.getMessage()}", file=sys.stderr, flush=True)

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


def report(out: str | Path, easel: "Easel", strokes: int, seed: int, begun: float) -> None:
    """What was done, for -v and where the name of the output was ours to choose."""
    size = f"{easel.sheet.cols} x {easel.sheet.rows} pixels"
    figures = f"{size}, {strokes} strokes, seed {seed}, {time.monotonic() - begun:.1f} s"
    print(f"crayonize: {printable(os.fspath(out))}: {figures}", file=sys.stderr)
