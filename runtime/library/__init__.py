"""Folders of generated robots, and their compiled libraries in a cache."""

from .cache import build
from .derived import derived_folder, is_description, is_of_shelf, shelf
from .folders import find_folder, shipped_folders

__all__ = [
    "build",
    "derived_folder",
    "find_folder",
    "is_description",
    "is_of_shelf",
    "shelf",
    "shipped_folders",
]
