"""Folders of photos: each becomes a picture, none is lost, whatever happens on the way."""

from .job import Recipe
from .options import Options, add_options, options_of
from .run import run

__all__ = ["Options", "Recipe", "add_options", "options_of", "run"]
