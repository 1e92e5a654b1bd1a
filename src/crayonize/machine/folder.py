"""The user's cache folder: measured tables, and the kernels as compiled for this machine.

Entries are written whole under their final name and begin with a checksum, so that a damaged one counts as
missing, and any number of processes may write at once. Compiled kernels are code: a folder that somebody
else could write to is left alone. Nothing here raises; without a usable folder nothing is kept.

CRAYONIZE_CACHE names the folder, CRAYONIZE_NO_CACHE=1 goes without.
"""

import contextlib
import functools
import hashlib
import logging
import os
import pickle
import secrets
import shutil
import stat
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

from stroke_gen.files import whole_file

KEEP = 3  # latest versions of a compiled kernel, and latest machines or versions of numba
IN_USE_S = 3600.0  # a folder used within this time is never cleaned up
_JIT_OFF = "numba"  # our own value of CRAYONIZE_NO_CACHE: only numba's disk cache stays off


def folder() -> Path:
    """The cache folder, made if need be; if none may be used, a path where nothing can be kept."""
    if os.environ.get("CRAYONIZE_NO_CACHE", _JIT_OFF) in ("", _JIT_OFF):
        for path in _places():
            with contextlib.suppress(OSError):
                path.mkdir(mode=0o700, parents=True, exist_ok=True)
                if _ours(path):
                    return path
    return Path(os.devnull).with_name(f"no-cache-{secrets.token_hex(8)}") / "none"


def _places() -> Iterator[Path]:
    """Where the folder may lie, best first."""
    named = os.environ.get("CRAYONIZE_CACHE")
    if named:
        yield Path(named).absolute()
        return
    xdg = os.environ.get("XDG_CACHE_HOME", "")
    if Path(xdg).is_absolute():
        yield Path(xdg) / "crayonize"
    with contextlib.suppress(RuntimeError):  # no home
        home = Path.home()
        if sys.platform == "win32":
            yield Path(os.environ.get("LOCALAPPDATA") or home / "AppData" / "Local") / "crayonize" / "cache"
        elif sys.platform == "darwin":
            yield home / "Library" / "Caches" / "crayonize"
        else:
            yield home / ".cache" / "crayonize"
    with contextlib.suppress(OSError):
        user = os.getuid() if hasattr(os, "getuid") else "user"
        yield Path(tempfile.gettempdir()) / f"crayonize-{user}"


def _ours(path: Path) -> bool:
    """Whether only we, or the machine's administrator, can write here."""
    status = path.stat()
    if not stat.S_ISDIR(status.st_mode):
        return False
    return not hasattr(os, "getuid") or (status.st_uid in (os.getuid(), 0) and not status.st_mode & 0o022)


def read(path: Path) -> bytes | None:
    """An entry as it was written, or None if it is missing or not whole."""
    with contextlib.suppress(OSError):
        content = path.read_bytes()
        if hashlib.sha256(content[32:]).digest() == content[:32]:
            return content[32:]
    return None


def write(path: Path, content: bytes) -> bool:
    """Keep an entry, whole or not at all; whether it is kept now."""
    try:
        path.parent.mkdir(mode=0o700, exist_ok=True)
        with whole_file(path, durable=False) as part:
            part.write_bytes(hashlib.sha256(content).digest() + content)
    except (OSError, ValueError):
        return False
    return True


# ---- compiled kernels ------------------------------------------------------------------------------------


def before_kernels() -> None:
    """To be called before any kernel is imported: numba's own disk cache stays off, for `keep_kernels`."""
    os.environ.setdefault("CRAYONIZE_NO_CACHE", _JIT_OFF)


def keep_kernels() -> None:
    """Let the kernels of all modules loaded so far be kept in the cache folder, whatever happens to it.

    To be called again when modules with further kernels have been imported.
    """
    import numba
    from numba.core.dispatcher import Dispatcher
    from numba.core.registry import cpu_target

    machine = repr((numba.__version__, sys.version, cpu_target.target_context.codegen().magic_tuple()))
    place = folder() / f"kernels-{hashlib.sha256(machine.encode()).hexdigest()[:16]}"
    _clean_up(place)
    for module in _modules():
        for thing in vars(module).values():
            if isinstance(thing, Dispatcher):
                dispatcher: Any = thing
                dispatcher._cache = _Kept(dispatcher.py_func, place)


def _modules() -> list[ModuleType]:
    ours = ("crayonize", "stroke_gen")
    return [module for name, module in sys.modules.items() if name.partition(".")[0] in ours]


def _clean_up(place: Path) -> None:
    """Note that a folder of kernels is in use, and remove those of machines and versions long out of use."""
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
    again = "once" if os.access(place, os.W_OK) else "as at each start, for no cache folder can be written to"
    logging.getLogger("crayonize").info("compiling for this machine, %s ...", again)


class _Kept:
    """The disk cache of one kernel, as numba's dispatcher asks for it (numba.core.caching._Cache).

    An entry's name holds the argument types and a hash of all source that went into it: of the room (folder) of
    the kernel and of the rooms of the kernels it may call, for constants come from files beside them.
    """

    cache_path = None

    def __init__(self, function: Any, place: Path) -> None:
        self._function, self._place = function, place

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The kernel compiled for the argument types `sig`, or None."""
        from numba.core import compiler
        from numba.core.runtime.nrt import rtsys

        rebuild: Any = compiler.CompileResult._rebuild
        rtsys.initialize(target_context)
        content = read(self._path(sig))
        if content is not None:
            with contextlib.suppress(Exception):  # whatever a strange entry may do: it is compiled anew
                return rebuild(target_context, *pickle.loads(content))
        target_context.refresh()
        _announce(self._place.parent)
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep a kernel just compiled, and few of its earlier versions, if it can be kept."""
        from numba.core import serialize

        dumps: Any = serialize.dumps
        path = self._path(sig)
        if not data.library.has_dynamic_globals and write(path, dumps(data._reduce())):
            with contextlib.suppress(OSError):
                _remove_old(path.parent.glob(f"{path.stem}.*"), KEEP)

    def _path(self, sig: Any) -> Path:
        name = f"{self._function.__module__}.{self._function.__qualname__}".replace("<", "").replace(">", "")
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
    """Hash of all source in the room of a module, in the rooms of all kernels it can see, and so on."""
    from numba.core.dispatcher import Dispatcher

    from stroke_gen import jit

    files, modules = {Path(jit.__file__)}, [module]
    for name in modules:
        loaded = sys.modules[name]
        files.update(Path(str(loaded.__file__)).parent.glob("*.py"))
        for thing in vars(loaded).values():
            if isinstance(thing, Dispatcher) and thing.py_func.__module__ not in modules:
                modules.append(thing.py_func.__module__)
    hashes = sorted(hashlib.sha256(file.read_bytes()).digest() for file in files)
    return hashlib.sha256(b"".join(hashes)).hexdigest()[:12]
