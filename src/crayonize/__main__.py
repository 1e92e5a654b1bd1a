"""The command `crayonize`, also as `python -m crayonize`: from its first moment Ctrl-C ends it.

A KeyboardInterrupt would be lost where Python runs inside compiled code (callbacks, clean-up), and
leave a traceback where nothing has been set up yet; so signals end the process themselves.
"""

import os
import signal
import sys
from types import FrameType

_SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP")


def _end(number: int, _: FrameType | None) -> None:
    """Leave nothing half written, clear the line of progress, and go."""
    files = sys.modules.get("stroke_gen.files")
    if files is not None:
        files.drop_parts()
    if os.isatty(2):
        os.write(2, b"\r\x1b[K")
    os._exit(128 + number)


def main() -> int:
    """Run the command; returns its exit code."""
    for name in _SIGNALS:
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) != signal.SIG_IGN:  # nohup
            signal.signal(number, _end)
    # none is of use to us, and where threads are few it would give up for want of them
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from .cli import main as run

    return run()


if __name__ == "__main__":
    sys.exit(main())
