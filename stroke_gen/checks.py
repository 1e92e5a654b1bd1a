"""The tail of an error message about an unknown name: which valid names lie nearest to it."""

import difflib
from collections.abc import Iterable

_SHOWN = 12


def printable(text: str) -> str:
    """The text itself, or with its line ends, control characters and stray bytes written as escapes."""
    return text if text.isprintable() else repr(text)[1:-1]


def quoted(text: str, limit: int = 60) -> str:
    """The text in double quotes, printable, on one line and cut to about `limit` characters."""
    cut = text if len(text) <= limit else text[: limit - 3] + "..."
    return f'"{printable(cut)}"'


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """The nearest valid names as ` (did you mean "a" or "b"?)`; if none is near, all valid ones."""
    valid = list(known)
    near = difflib.get_close_matches(name[:60].lower(), valid, n=3)
    if near:
        return f" (did you mean {' or '.join(quoted(n) for n in near)}?)"
    more = ", ..." if len(valid) > _SHOWN else ""
    return f" (valid: {', '.join(valid[:_SHOWN])}{more})"
