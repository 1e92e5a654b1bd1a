"""Turns a photo into a wax-crayon drawing, stroke by stroke, by simulating wax on rough paper.

    from crayonize import convert, draw

    convert("photo.jpg", "out.png", palette="box24", seed=1)

`Live` is a sheet to draw on by hand. Importing this is cheap; numpy, numba and OpenCV are loaded by
the first call, or with `Live`.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .api import convert, draw
    from .settings import Settings
    from .wax.live import Live

__version__ = "0.1.0"
__all__ = ["Live", "Settings", "convert", "draw"]


def __getattr__(name: str) -> Any:
    """The names of __all__, loaded when first used."""
    if name in ("convert", "draw"):
        from . import api

        return getattr(api, name)
    if name == "Live":
        from . import api

        api.workshop()  # first: it says where its kernels are kept
        from .wax.live import Live

        return Live
    if name == "Settings":
        from .settings import Settings

        return Settings
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    """The API, and what Python itself asks of a module."""
    return [*__all__, "__all__", "__doc__", "__file__", "__name__", "__path__", "__version__"]
