"""A line of progress on a terminal: redrawn in place, gone at the end, never in a file."""

import contextlib
import sys

WIDTH = 20  # of the bar, in characters


class Bar:
    """One line on stderr like `shade [########............] 34 %`, if that is a terminal."""

    def __init__(self, shown: bool) -> None:
        self._shown = shown and sys.stderr is not None and sys.stderr.isatty()
        self._last = ""

    def show(self, share: float, after: str, before: str = "") -> None:
        """Draw the line: words, how much of all is done (0..1), words."""
        hashes = "#" * int(min(1.0, max(0.0, share)) * WIDTH)
        line = f"{before}[{hashes:.<{WIDTH}}] {after}"
        if self._shown and line != self._last:
            tell(f"\r{line:<{len(self._last)}}")
            self._last = line

    def clear(self) -> None:
        """Take the line away, so that something else may be written."""
        if self._last:
            tell(f"\r{' ' * len(self._last)}\r")
            self._last = ""


def tell(text: str) -> None:
    """Text for people on stderr; nothing is lost if it cannot be written."""
    if sys.stderr is not None:
        with contextlib.suppress(OSError):
            sys.stderr.write(text)
            sys.stderr.flush()
