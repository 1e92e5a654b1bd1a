"""How many processor cores there are for us."""

import os

NO_MORE = "the system allows no more threads or processes (see pids.max and ulimit -u)"


def is_out_of_threads(error: BaseException) -> bool:
    """Whether this is Python's way to say that a thread could not be started."""
    return isinstance(error, RuntimeError) and "start new thread" in str(error)


def allowed() -> int:
    """Cores this process may use: fewer than the machine has under taskset, in a container or batch
    system.
    """
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # a system that binds no process to cores
        return os.cpu_count() or 1
