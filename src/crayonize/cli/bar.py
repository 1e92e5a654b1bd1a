"""The progress line of the command: on a terminal only, redrawn in place, gone at the end."""

import sys
from types import TracebackType

WIDTH = 24


class Bar:
    """A progress callback that shows one line, like `shade [########........]  34 %`."""

    def __init__(self, shown: bool) -> None:
        self._shown = shown and sys.stderr.isatty()
        self._last = ""

    def __call__(self, name: str, fraction: float) -> None:
        """Show what is being done and how much of all is done, 0 to 1."""
        done = min(1.0, max(0.0, fraction))
        line = f"{name[:16]:16} [{'#' * round(done * WIDTH):.<{WIDTH}}] {done:4.0%}"
        if self._shown and line != self._last:
            self._put(f"\r{line}")
            self._last = line

    def clear(self) -> None:
        """Take the line away, so that something else may be written."""
        if self._last:
            self._put(f"\r{' ' * len(self._last)}\r")
            self._last = ""

    def _put(self, text: str) -> None:
        sys.stderr.write(text)
        sys.stderr.flush()

    def __enter__(self) -> "Bar":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.clear()
