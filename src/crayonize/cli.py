"""The command `crayonize`: options in, one picture out, errors as one line.

The first word chooses: draw, palettes, styles, papers or warmup; anything else is a photo. Only here is
anything printed: what was asked for on stdout, all else on stderr. `--help` and the listings load neither
numpy nor numba, so imports of anything heavy stand inside functions.

Exit codes: 0 done; 1 stopped (an output cannot be written, an error of ours); 2 the command line or a file
it names cannot be used; 3 an extra is not installed; 130 Ctrl-C; 143 terminated.
"""

import argparse
import os
import signal
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NoReturn

from . import __version__
from .did_you_mean import did_you_mean, printable
from .settings import Settings

_NEARLY_ALL = "0 quiet, errors only; 1 as usual; 2 tells seed and time; 3 shows tracebacks"


class _Parser(argparse.ArgumentParser):
    """argparse with our way of complaining: a ValueError of one line that knows the nearest option."""

    def __init__(self, **options: Any) -> None:
        super().__init__(allow_abbrev=False, formatter_class=argparse.RawDescriptionHelpFormatter, **options)

    def error(self, message: str) -> NoReturn:
        raise ValueError(f"{message}; see {self.prog} --help")

    def read(self, words: Sequence[str]) -> argparse.Namespace:
        """Parsed arguments; an unknown option is named with the nearest one."""
        options, rest = self.parse_known_args(words)
        for word in rest:
            if word.startswith("-"):
                name = word.partition("=")[0]
                known = [o for action in self._actions for o in action.option_strings if o.startswith("--")]
                raise ValueError(f"unknown option {printable(name)}{did_you_mean(name, known)}")
        if rest:
            raise ValueError(f"too many arguments: {printable(rest[0])}; see {self.prog} --help")
        return options


def main(words: Sequence[str] | None = None) -> int:
    """Run the command; returns its exit code."""
    words = list(sys.argv[1:] if words is None else words)
    loud = sum(word.count("v") for word in words if word in ("-v", "-vv", "--verbose"))
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")
    try:
        signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
        run = COMMANDS.get(words[0]) if words else None
        code = run(words[1:]) if run else _convert(words)
        sys.stdout.flush()
        return code
    except BrokenPipeError:  # the reader of our listing has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except KeyboardInterrupt:
        return 130
    except Exception as error:
        if loud > 1:
            raise
        return _complain(error)


def _complain(error: Exception) -> int:
    """One line about an error on stderr; returns the exit code."""
    if isinstance(error, ValueError | TypeError) and _missing_extra(error):
        code, line = 3, str(error)
    elif isinstance(error, ValueError):
        code, line = 2, str(error)
    elif isinstance(error, MemoryError):
        code, line = 1, "there is not enough memory; choose a smaller --size"
    elif isinstance(error, OSError):
        name = f"{os.fsdecode(error.filename)}: " if error.filename is not None else ""
        code, line = 1, f"{name}{error.strerror or error}"
    else:
        code, line = 1, f"an error of ours, {type(error).__name__}: {error}; -vv shows where"
    print(f"crayonize: {printable(' '.join(line.split()))}", file=sys.stderr)
    return code


def _missing_extra(error: BaseException) -> bool:
    """Whether an error goes back to a package that is not installed."""
    cause: BaseException | None = error
    while cause is not None:
        if isinstance(cause, ImportError):
            return True
        cause = cause.__cause__
    return False


# ---- the commands ----------------------------------------------------------------------------------------


def _convert(words: Sequence[str]) -> int:
    """crayonize PHOTO [OUT]: draw a photo."""
    from stroke_gen import params

    from . import api
    from .palette import load_palette

    options = _convert_parser().read(words)
    begun = time.monotonic()
    out = options.out or Path(options.photo).with_suffix("").with_name(f"{Path(options.photo).stem}.crayon.png")
    settings = api.settings_of(_settings(options))
    load_palette(settings.palette)
    params.with_force(params.load_style(settings.style), settings.force)
    if not Path(options.photo).exists():
        raise ValueError(f"{options.photo}: there is no such file")
    api.check_outputs([options.photo, *api.used_files(settings)], out, options.strokes)
    with _talk(options) as progress:
        drawing, easel = api.sketch(options.photo, settings, progress)
        api.finish(drawing, easel, out, options.strokes, light=options.light, told=api.notes(settings, options.light))
    _report(options, out, easel, len(drawing.strokes), settings.seed, begun)
    if options.out is None and options.loud == 0:
        print(f"crayonize: drawn as {printable(str(out))}", file=sys.stderr)
    return 0


def _draw(words: Sequence[str]) -> int:
    """crayonize draw DRAWING OUT: render strokes."""
    from . import api

    options = _draw_parser().read(words)
    begun = time.monotonic()
    with _talk(options) as progress:
        drawing, easel = api.redraw(
            options.drawing, options.size, options.threads, options.preview, progress, out=options.out
        )
        api.finish(drawing, easel, options.out, light=options.light, told=api.notes_of(drawing, options))
    _report(options, options.out, easel, len(drawing.strokes), drawing.seed, begun)
    return 0
