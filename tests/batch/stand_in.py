"""A cheap sketcher for batch tests: reads the photo as always, then acts as the photo's name asks.

`NAME.0.5s.png` takes half a second; the words hang, spin, segv, abort, exit, eat, shout and once at
the start of a name make the worker sleep for ever, loop for ever, crash, end, use up memory, print,
or die at the first try only.
"""

import os
import re
import signal
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from crayonize.images.icc import encode_srgb
from crayonize.images.read import Photo
from crayonize.settings import Settings
from stroke_gen.drawing import Drawing


def sketch(source: Photo, settings: Settings) -> tuple[Drawing, Any]:
    """Stands in for api.sketch."""
    photo = source.light(min(settings.size, 64))
    rows, cols = photo.shape[:2]
    act(Path(str(source.source)))
    picture = encode_srgb(photo)
    sheet = SimpleNamespace(cols=cols)
    easel = SimpleNamespace(picture_srgb=lambda light: picture, sheet=sheet, smears=True)
    return Drawing(cols / 10, rows / 10, "drawing", settings.palette, (), seed=settings.seed), easel


def act(source: Path) -> None:
    """Do what the name of the photo asks for."""
    if seconds := re.search(r"\.(\d+(?:\.\d+)?)s\.", source.name):
        time.sleep(float(seconds[1]))
    match re.split(r"[-.0-9]", source.name)[0]:
        case "hang":
            time.sleep(3600)
        case "spin":
            while True:
                pass
        case "segv":
            signal.signal(signal.SIGSEGV, signal.SIG_DFL)
            os.kill(os.getpid(), signal.SIGSEGV)
        case "abort":
            os.abort()
        case "exit":
            os._exit(0)
        case "shout":
            print("shouting", flush=True)
            os.write(1, b'{"status": "ok"}\n')
        case "raise":
            raise RuntimeError("as asked")
        case "eat":
            eaten = []
            while True:
                eaten.append(bytearray(64 << 20))
        case "once":
            mark = source.parent.parent / f"{source.name}.seen"
            if not mark.exists():
                mark.touch()
                os.kill(os.getpid(), signal.SIGKILL)
