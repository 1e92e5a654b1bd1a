"""Compiled kernels in the cache folder, in place of numba's own disk cache.

That one does not notice an edit in another file, and raises where no folder can be written to. Ours
finds a kernel by the source of its whole room, and uses numba's inner names; with a numba that has
others, kernels are compiled anew in each process, and nothing else is lost.
"""

import contextlib
import functools
import hashlib
import logging
import os
import pickle
import shutil
import sys
import time
from collections.abc import Iterable
from pathlib import Path
from types import ModuleType
from typing import Any

from .folder import folder, read, write
from .source import hash_of

KEEP = 3  # latest versions of a compiled kernel, and latest machines or versions of numba
IN_USE_S = 3600.0  # a folder used within this time is never cleaned up


def keep_kernels() -> None:
    """Let the kernels of all modules loaded so far be kept in the cache folder, whatever happens to
    it.

    To be called again when modules with further kernels have been imported.
    """
    try:
        from numba.core.dispatcher import Dispatcher

        machine = _machine()
    except (ImportError, AttributeError, TypeError):  # a numba with other inner names
        return
    place = folder() / f"kernels-{hashlib.sha256(machine.encode()).hexdigest()[:16]}"
    _clean_up(place)
    for module in _modules():
        for thing in vars(module).values():
            if isinstance(thing, Dispatcher):
                dispatcher: Any = thing
                dispatcher._cache = _Kept(dispatcher.py_func, place)


def _machine() -> str:
    """What compiled code depends on beside its source."""
    import numba
    from numba.core.registry import cpu_target

    return repr((numba.__version__, sys.version, cpu_target.target_context.codegen().magic_tuple()))


def _modules() -> list[ModuleType]:
    ours = ("crayonize", "stroke_gen")
    return [module for name, module in sys.modules.items() if name.partition(".")[0] in ours]


def _clean_up(place: Path) -> None:
    """Note that a folder of kernels is in use, and remove those of machines and versions long out
    of use.
    """
    with contextlib.suppress(OSError):
        if place.exists():
            os.utime(place)
        else:
            _remove_old(place.parent.glob("kernels-*"), KEEP - 1)


def _remove_old(paths: Iterable[Path], keep: int) -> None:
    """Remove all but the `keep` latest, and what was in use within the last hour."""
    dated = sorted(((path.stat().st_mtime, path) for path in paths), reverse=True)
    for used, path in dated[keep:]:
        if path.is_dir() and time.time() - used > IN_USE_S:
            shutil.rmtree(path, ignore_errors=True)
        elif not path.is_dir():
            path.unlink(missing_ok=True)


@functools.cache
def _announce(place: Path) -> None:
    """Say that it takes a while, and whether it will next time."""
    again = (
        "once"
        if os.access(place, os.W_OK)
        else "as at each start, for no cache folder can be written to"
    )
    logging.getLogger("crayonize").info("compiling for this machine, %s ...", again)


class _Kept:
    """The disk cache of one kernel, as numba's dispatcher asks for it (numba.core.caching._Cache).

    An entry's name holds the argument types and a hash of all source that went into it: of the room
    (folder) of the kernel and of the rooms of the kernels it may call, for constants come from
    files beside them.
    """

    cache_path = None

    def __init__(self, function: Any, place: Path) -> None:
        self._function, self._place = function, place

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The kernel compiled for the argument types `sig`, or None."""
        # a strange entry, or a strange numba: it is compiled anew
        with contextlib.suppress(Exception):
            from numba.core import compiler
            from numba.core.runtime.nrt import rtsys

            rebuild: Any = compiler.CompileResult._rebuild
            rtsys.initialize(target_context)
            content = read(self._path(sig))
            if content is not None:
                return rebuild(target_context, *pickle.loads(content))
        target_context.refresh()
        _announce(self._place.parent)
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep a kernel just compiled, and few of its earlier versions, if it can be kept."""
        with contextlib.suppress(Exception):  # a numba with other inner names, or a full disk
            from numba.core import serialize

            dumps: Any = serialize.dumps
            path = self._path(sig)
            if not data.library.has_dynamic_globals and write(path, dumps(data._reduce())):
                _remove_old(path.parent.glob(f"{path.stem}.*"), KEEP)

    def _path(self, sig: Any) -> Path:
        name = f"{self._function.__module__}.{self._function.__qualname__}".replace(
            "<", ""
        ).replace(">", "")
        types = hashlib.sha256(repr(sig).encode()).hexdigest()[:12]
        return self._place / f"{name}-{types}.{_source_hash(self._function.__module__)}"

    def enable(self) -> None:
        """Always on."""

    def disable(self) -> None:
        """Always on."""

    def flush(self) -> None:
        """Nothing is held back."""


@functools.cache
def _source_hash(module: str) -> str:
    """Hash of all source in the room of a module, in the rooms of all kernels it can see, and so
    on.
    """
    from numba.core.dispatcher import Dispatcher

    from stroke_gen import jit

    files, modules = {Path(jit.__file__)}, [module]
    for name in modules:
        loaded = sys.modules[name]
        files.update(Path(str(loaded.__file__)).parent.glob("*.py"))
        for thing in vars(loaded).values():
            if isinstance(thing, Dispatcher) and thing.py_func.__module__ not in modules:
                modules.append(thing.py_func.__module__)
    return hash_of(files)
