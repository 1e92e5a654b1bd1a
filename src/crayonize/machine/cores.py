"""How many processor cores there are for us."""

import os


def allowed() -> int:
    """Cores this process may use: fewer than the machine has under taskset, in a container or batch
    system.
    """
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # a system that binds no process to cores
        return os.cpu_count() or 1
