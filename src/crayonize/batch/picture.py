"""One photo file becomes one picture file: what a worker does for a job."""

import errno
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

from .. import api
from ..images import metadata, page
from ..images.read import Photo, open_photo
from ..images.write import read_settings, same_file
from ..machine import cores
from ..settings import Settings
from . import memory
from .job import Job, Outcome, Recipe
from .remote import SendError, local_copy

# wait until so many bytes of memory are free; False if they never will be
Ask = Callable[[int], bool]


class OutputError(Exception):
    """No picture can be written: the disk is full, or the folder is closed to us."""


class Studio:
    """Everything that is set up once and used for every photo."""

    def __init__(self, recipe: Recipe, render: str | None) -> None:
        """render: "module:function" in place of `api.sketch`.

        ValueError for settings that are none.
        """
        self._recipe = recipe
        if render is None:
            from ..wax.physics import physics

            recipe.settings.parsed()
            physics(recipe.settings.physics)
            api.workshop()
            self._sketch: Callable[..., Any] = api.sketch
        else:
            module, _, name = render.partition(":")
            self._sketch = getattr(import_module(module), name)

    def make(self, job: Job, ask: Ask) -> Outcome:
        """Draw the photo of a job.

        OutputError if this and every other picture cannot be written.
        """
        try:
            return self._make(job, ask)
        except ValueError as error:
            return Outcome("failed", str(error))
        except MemoryError:
            return Outcome(
                "failed",
                "there is not enough memory for it; choose a smaller --size or fewer --jobs",
            )
        except OutputError:
            raise
        except SendError as error:
            raise OutputError(str(error)) from error
        except OSError as error:
            return Outcome("failed", f"cannot be read ({error.strerror or error})")
        except Exception as error:  # one photo is never worth the others
            if cores.is_out_of_threads(error):
                raise OutputError(cores.NO_MORE) from error
            return Outcome(
                "failed", f"this should not have happened ({type(error).__name__}: {error})"
            )

    def _make(self, job: Job, ask: Ask) -> Outcome:
        if job.photo.size > self._recipe.max_bytes:
            raise ValueError(
                f"has {job.photo.size} bytes; the limit is {self._recipe.max_bytes} (--max-bytes)"
            )
        with local_copy(job) as (source, target):
            return self._draw(job, source, target, ask)

    def _draw(self, job: Job, source: str, target: Path, ask: Ask) -> Outcome:
        with open_photo(source) as photo:
            settings, needed = self._look_at(photo)
            if not ask(needed):
                raise ValueError(
                    f"needs about {needed / 1e9:.1f} GB of memory, more than there is; reduce it "
                    "first"
                )
            if same_file(source, target):
                raise ValueError(
                    "its picture would take its own place; choose another output folder"
                )
            if job.strange and not _is_ours(target):
                raise ValueError(
                    f"at {job.out!r} stands something that was not made here; see --existing"
                )
            drawing, easel = self._sketch(photo, settings)
            kept = metadata.kept(photo.exif, self._recipe.metadata)
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            api.finish(
                drawing, easel, target, light=self._recipe.light, settings=settings, kept=kept
            )
        except OSError as error:
            if error.errno == errno.ENAMETOOLONG:
                raise ValueError("the name of its picture is too long for this disk") from error
            raise OutputError(f"{error.filename or job.out}: {error.strerror or error}") from error
        return Outcome(
            "ok", photo.warning, bytes=target.stat().st_size, strokes=len(drawing.strokes)
        )

    def _look_at(self, photo: Photo) -> tuple[Settings, int]:
        """Settings for this photo, and bytes of memory it will take, by its header alone.

        ValueError for a photo beyond the limits.
        """
        recipe, pixels = self._recipe, photo.width * photo.height
        if pixels > recipe.max_pixels:
            raise ValueError(
                f"has {pixels} pixels; the limit is {recipe.max_pixels} (--max-pixels)"
            )
        settings = page.fitted(recipe.settings, recipe.page, recipe.dpi, photo.width, photo.height)
        return settings, memory.need(photo.decoding, settings.size, settings.preview)


def _is_ours(path: Path) -> bool:
    """Whether a picture says that we made it."""
    try:
        return bool(read_settings(path))
    except ValueError:
        return False
