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
from collections.abc import Iterator
from pathlib import Path
from typing import Any

KEEP = 3  # folders of compiled kernels, of the latest versions or machines
IN_USE_S = 3600.0  # a folder used within this time is never cleaned up
_JIT_OFF = "numba"  # our own value of CRAYONIZE_NO_CACHE: only numba's disk cache stays off


def folder() -> Path:
    """The cache folder, made if need be; where none may be used, a path at which nothing is or can be kept."""
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
    status = path.lstat()
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
    part = path.with_name(f".{secrets.token_hex(8)}.part")
    try:
        path.parent.mkdir(mode=0o700, exist_ok=True)
        part.write_bytes(hashlib.sha256(content).digest() + content)
        part.replace(path)
    except OSError:
        with contextlib.suppress(OSError):
            part.unlink()
        return False
    return True


# ---- compiled kernels ------------------------------------------------------------------------------------


def before_kernels() -> None:
    """To be called before any kernel is imported: numba is not to keep its own cache, `keep_kernels` does."""
    os.environ.setdefault("CRAYONIZE_NO_CACHE", _JIT_OFF)


def keep_kernels() -> None:
    """Let all kernels of the modules loaded so far be kept in the cache folder."""
    from numba.core.dispatcher import Dispatcher
    from numba.core.registry import cpu_target

    kernels = {
        id(thing): thing
        for name, module in sorted(sys.modules.items())
        if name.partition(".")[0] in ("crayonize", "stroke_gen")
        for thing in vars(module).values()
        if isinstance(thing, Dispatcher)
    }.values()
    sources = {kernel.py_func.__code__.co_filename for kernel in kernels}
    place = folder() / f"kernels-{_key(sources, cpu_target.target_context.codegen().magic_tuple())}"
    _clean_up(place)
    for kernel in kernels:
        kernel._cache = _Kept(kernel.py_func, place)


def _key(sources: set[str], machine: object) -> str:
    """Changes with the source of any kernel, with numba, Python and the processor."""
    import numba
    from stroke_gen import jit

    key = hashlib.sha256(repr((numba.__version__, sys.version, machine)).encode())
    for path in sorted(sources | {jit.__file__}):
        key.update(hashlib.sha256(Path(path).read_bytes()).digest())
    return key.hexdigest()[:16]


def _clean_up(place: Path) -> None:
    """Note that a folder of kernels is in use, and remove those long out of use."""
    with contextlib.suppress(OSError):
        if place.exists():
            os.utime(place)
            return
        others = [(other.stat().st_mtime, other) for other in place.parent.glob("kernels-*")]
        for used, other in sorted(others, reverse=True)[KEEP - 1 :]:
            if time.time() - used > IN_USE_S:
                shutil.rmtree(other, ignore_errors=True)


@functools.cache
def _announce(place: Path) -> None:
    """Say that it takes a while, and whether it will next time."""
    again = "once" if os.access(place, os.W_OK) else "as on each start, for there is no cache folder to write to"
    logging.getLogger("crayonize").info("compiling for this machine, %s ...", again)


class _Kept:
    """The disk cache of one kernel as numba's dispatcher asks for it (numba.core.caching._Cache)."""

    cache_path = None

    def __init__(self, function: Any, place: Path) -> None:
        self._name, self._place = f"{function.__module__}.{function.__qualname__}", place

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The kernel compiled for the argument types `sig`, or None."""
        from numba.core.compiler import CompileResult

        target_context.refresh()
        content = read(self._path(sig))
        if content is not None:
            with contextlib.suppress(Exception):  # whatever a strange entry may do: it is compiled anew
                return CompileResult._rebuild(target_context, *pickle.loads(content))
        _announce(self._place.parent)
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep a kernel just compiled, if it can be kept."""
        from numba.core.serialize import dumps

        if not data.library.has_dynamic_globals:
            write(self._path(sig), dumps(data._reduce()))

    def _path(self, sig: Any) -> Path:
        return self._place / f"{self._name}-{hashlib.sha256(repr(sig).encode()).hexdigest()[:16]}"

    def enable(self) -> None:
        """Always on."""

    def disable(self) -> None:
        """Always on."""

    def flush(self) -> None:
        """Nothing is held back."""
