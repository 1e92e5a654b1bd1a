"""One photo file becomes one picture file: what a worker does for a job."""

import errno
import os
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from ..image_color import encode_srgb
from ..image_read import open_picture, read_linear
from ..image_write import file_format, read_settings, same_file, write_image
from ..settings import Settings
from .job import Job, Outcome, Recipe
from .worker import OutputError

Ask = Callable[[int], bool]  # wait until so many bytes of memory are free; False if they never will be
Render = Callable[[NDArray[np.float32], Settings], tuple[NDArray[np.float32], int]]
