"""A worker process: hears the recipe, then draws one photo after another until nobody listens any
more.

Started by the crew with two pipes. It dies with the crew: at once where the system offers that, and
else when its pipe ends. Nothing of a photo is opened before the crew has granted the memory it will
take.
"""

import contextlib
import json
import os
import queue
import signal
import threading
from typing import IO, Any

from ..machine import cores
from ..machine.memory import limit_addresses
from ..machine.parent import die_with
from .job import Found, Job, Outcome, Recipe

_IDLE = 3600.0  # s

Message = dict[str, Any]


class _Line:
    """The two pipes to the crew."""

    def __init__(self) -> None:
        """Take the pipes away from stdin and stdout, so that no library can write into them."""
        self._from: IO[bytes] = os.fdopen(os.dup(0), "rb")
        self._to = os.dup(1)
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        os.dup2(2, 1)
        self._messages: queue.SimpleQueue[Message] = queue.SimpleQueue()

    def open(self) -> Message:
        """The first message; from then on a thread listens, and ends the process with the pipe."""
        first: Message = json.loads(self._from.readline())
        threading.Thread(target=self._listen, daemon=True).start()
        return first

    def _listen(self) -> None:
        with contextlib.suppress(OSError, ValueError):
            for line in self._from:
                self._messages.put(json.loads(line))
        os._exit(0)

    def hear(self) -> Message:
        """The next message; the end if none comes for long: on a cluster nobody may be left to send
        one.
        """
        try:
            return self._messages.get(timeout=_IDLE)
        except queue.Empty:
            os._exit(0)

    def say(self, message: Message) -> None:
        """Send a message."""
        os.write(self._to, json.dumps(message).encode() + b"\n")

    def ask_for(self, memory: int) -> bool:
        """Ask for bytes of memory and wait; False if there will never be so much."""
        self.say({"asks": memory})
        return bool(self.hear()["go"])


def main() -> None:
    """Serve the crew at the other end of stdin and stdout."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    line = _Line()
    try:
        hello = line.open()
    except RuntimeError:
        return line.say({"broken": f"a worker cannot start: {cores.NO_MORE}"})
    die_with(hello["parent"])
    try:
        from .picture import OutputError, Studio

        studio = Studio(Recipe.from_json(hello["recipe"]), hello["render"])
        limit_addresses(hello["memory"])
    except ValueError as error:
        return line.say({"refused": str(error)})
    except Exception as error:  # whatever a broken installation raises
        if cores.is_out_of_threads(error):
            return line.say({"broken": f"a worker cannot start: {cores.NO_MORE}"})
        return line.say({"broken": f"a worker cannot start: {type(error).__name__}: {error}"})
    line.say({"ready": os.getpid()})
    while True:
        plain = line.hear()["job"]
        job = Job(**{**plain, "photo": Found(**plain["photo"])})
        try:
            outcome = studio.make(job, line.ask_for)
        except OutputError as error:
            return line.say({"broken": str(error)})
        line.say(_message(outcome))


def _message(outcome: Outcome) -> Message:
    return {
        "status": outcome.status,
        "error": outcome.error,
        "bytes": outcome.bytes,
        "strokes": outcome.strokes,
    }


if __name__ == "__main__":
    main()
