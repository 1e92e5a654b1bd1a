"""A photo read by a process of its own, which may die of it, take too long, or be stopped.

Decoders are written in C, and a photo may be hostile. The child is a copy of this process (Linux);
it tells the size, waits for the word, and leaves the light in shared memory. All it says is only
ever data. On other systems the photo is read here.
"""

from __future__ import annotations

import base64
import json
import mmap
import os
import signal
import socket
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ..machine import memory
from ..machine.parent import die_with
from . import metadata
from .read import Photo, open_photo, shown

TIME_LIMIT = 300.0  # s without a word

Message = dict[str, Any]


class ReadApart(Photo):
    """A photo whose light another process has; of its Exif those tags that may go along."""

    def __init__(self, path: str | os.PathLike[str], line: _Line, header: Message) -> None:
        self.source, self.name = path, shown(path)
        self.width, self.height = int(header["width"]), int(header["height"])
        self.decoding = int(header["decoding"])
        self.exif, self.warning = None, ""
        self._line = line

    def light(
        self, max_side: int | None = None, ground: tuple[float, float, float] = (1.0, 1.0, 1.0)
    ) -> NDArray[np.float32]:
        """Have it decoded; as `Photo.light`."""
        self._line.say({"max_side": max_side, "ground": list(ground)})
        found = self._line.hear()
        height, width, self.warning = int(found["height"]), int(found["width"]), found["warning"]
        if found["exif"]:
            self.exif = Image.Exif()
            with suppress(Exception):  # broken Exif raises nearly anything
                self.exif.load(base64.b64decode(found["exif"]))
        with mmap.mmap(self._line.shared, height * width * 12, access=mmap.ACCESS_READ) as view:
            return np.frombuffer(view.read(), np.float32).reshape(height, width, 3).copy()


@contextmanager
def open_apart(path: str | os.PathLike[str]) -> Iterator[Photo]:
    """As `open_photo`; also a ValueError if the child dies of the photo or takes too long."""
    if sys.platform != "linux":
        with open_photo(path) as photo:
            yield photo
        return
    here, there = socket.socketpair()
    shared, parent = os.memfd_create("light"), os.getpid()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # threads of libraries, which the child does not use
        child = os.fork()
    if not child:
        here.close()
        _serve(path, _Line(there, shared), parent)
    there.close()
    try:
        line = _Line(here, shared, shown(path), child)
        yield ReadApart(path, line, line.hear())
    finally:
        with suppress(ProcessLookupError):
            os.kill(child, signal.SIGKILL)
        with suppress(ChildProcessError):
            os.waitpid(child, 0)
        here.close()
        os.close(shared)


class _Line:
    """One end of the line between the two, and the memory they share."""

    def __init__(self, end: socket.socket, shared: int, name: str = "", child: int = 0) -> None:
        self.shared = shared
        self._end, self._name, self._child = end, name, child
        self._lines = end.makefile("rb")

    def say(self, message: Message) -> None:
        """Send a message, if anybody is there."""
        with suppress(OSError):
            self._end.sendall(json.dumps(message).encode() + b"\n")

    def hear(self) -> Message:
        """The next message.

        ValueError for what is wrong with the photo, MemoryError if it takes more than there is.
        """
        self._end.settimeout(TIME_LIMIT if self._child else None)
        try:
            message: Message = json.loads(self._lines.readline() or "{}")
        except TimeoutError as error:
            raise ValueError(f"{self._name}: takes longer than {TIME_LIMIT:g} s to read") from error
        if not message:
            self._mourn()
        if "refused" in message:
            raise ValueError(message["refused"])
        if "memory" in message:
            raise MemoryError
        return message

    def _mourn(self) -> NoReturn:
        """The other end is gone."""
        if not self._child:
            os._exit(0)
        code = os.waitstatus_to_exitcode(os.waitpid(self._child, 0)[1])
        cause = signal.Signals(-code).name if code < 0 else f"exit code {code}"
        raise ValueError(
            f"{self._name}: is damaged, its decoder died of it ({cause}); copy or save it again"
        )


def _serve(path: str | os.PathLike[str], line: _Line, parent: int) -> NoReturn:
    """In the child: read the photo, then end without a trace."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    try:
        die_with(parent)
        memory.limit_addresses(memory.available_bytes())
        with open_photo(path) as photo:
            line.say({"width": photo.width, "height": photo.height, "decoding": photo.decoding})
            wanted = line.hear()
            light = photo.light(wanted["max_side"], tuple(wanted["ground"]))
        os.pwrite(line.shared, light.tobytes(), 0)
        height, width = light.shape[:2]
        tags = metadata.kept(photo.exif, "all") or metadata.kept(photo.exif, "safe")
        line.say({"height": height, "width": width, "warning": photo.warning,
                  "exif": base64.b64encode(tags.tobytes() if tags else b"").decode()})  # fmt: skip
    except MemoryError:
        line.say({"memory": True})
    except Exception as error:  # it is the parent that tells
        line.say({"refused": str(error)})
    finally:
        os._exit(0)
