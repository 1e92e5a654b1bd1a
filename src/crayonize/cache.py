"""The user's cache folder: compiled kernels and measured tables."""

import os
import tempfile
from pathlib import Path


def folder() -> Path:
    """The cache folder, made if need be; a temporary one where none can be written."""
    base = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    path = Path(base) / "crayonize"
    try:
        path.mkdir(mode=0o700, parents=True, exist_ok=True)
    except OSError:
        return Path(tempfile.gettempdir())
    return path
