"""The command `crayonize`: words in, one picture or a folder of them out, errors as one line.

The first word chooses: draw, steps, palettes, styles, papers, warmup or bench; anything else is a
photo. Nothing but this room prints, with the account of a batch. `--help` and the listings load
neither numpy nor numba, so imports of anything heavy stand inside functions.

Exit codes: 0 done; 1 stopped (an output cannot be written, an error of ours); 2 what was asked for
cannot be done (an option, a file, a package that is missing); 3 some photos of a folder failed; 4
another run holds the folder; 130 Ctrl-C; 143 terminated.
"""

import atexit
import gc
import os
import sys
from collections.abc import Sequence

from stroke_gen.checks import printable

from ..machine import cores
from ..machine.terminal import tell
from .commands import COMMANDS, convert


def main(words: Sequence[str] | None = None) -> int:
    """Run the command; returns its exit code."""
    words = list(sys.argv[1:] if words is None else words)
    _fill_streams()
    # what is left at the end goes as a whole; to look through it first takes 0.2 s
    atexit.register(gc.freeze)
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")
    try:
        command = COMMANDS.get(words[0]) if words else None
        code = command(words[1:]) if command else convert(words)
        if sys.stdout is not None:
            sys.stdout.flush()
        return code
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:  # the reader of a listing has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except Exception as error:
        if words.count("-v") + 2 * words.count("-vv") > 1:
            raise
        code, line = _verdict(error)
        tell(f"crayonize: {_one_line(line)}\n")
        return code


def _fill_streams() -> None:
    """Open nothing in the place of stdin, stdout or stderr that are closed.

    The next file to be opened, the picture, would else be what libraries take for stderr.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)


def _verdict(error: Exception) -> tuple[int, str]:
    """Exit code and message for an error."""
    if isinstance(error, ValueError | ImportError):
        return 2, str(error)
    if isinstance(error, MemoryError):
        return 1, "there is not enough memory; choose a smaller --size"
    if isinstance(error, OSError):
        name = "" if error.filename is None else f"{os.fsdecode(error.filename)}: "
        return 1, f"{name}{error.strerror or error}"
    if cores.is_out_of_threads(error):
        return 1, cores.NO_MORE
    return 1, f"this should not have happened ({type(error).__name__}: {error}); -v -v shows where"


def _one_line(text: str) -> str:
    return printable(" ".join(text.split()))
