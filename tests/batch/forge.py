"""One conversion in a process that waits for its observer: forge.py, then lines `PHOTO PICTURE` on
stdin.

All libraries are loaded once; each line forks a child that prints its number, waits for a further
line, converts, and whose verdict is printed at its end.
"""

import os
import select
import sys

from crayonize.batch.job import Found, Job, Recipe
from crayonize.batch.picture import Studio
from crayonize.settings import Settings

if __name__ == "__main__":
    studio = Studio(Recipe(Settings(size=64)), "stand_in:sketch")
    for line in sys.stdin:
        photo, picture = line.split()
        gate, go = os.pipe()
        child = os.fork()
        if not child:
            os.close(go)
            os.write(1, b"%d\n" % os.getpid())
            select.select([gate], [], [])  # no call that a test counts
            try:
                outcome = studio.make(
                    Job(Found("p", "p", photo, 1, ""), "p", picture), lambda needed: True
                )
                verdict = f"{outcome.status} {outcome.error}"
            except Exception as error:
                verdict = f"{type(error).__name__} {error}"
            os.write(2, verdict.encode() + b"\n")
            os._exit(0)
        os.close(gate)
        sys.stdin.readline()
        os.close(go)
        _, status = os.waitpid(child, 0)
        print(os.waitstatus_to_exitcode(status), flush=True)
