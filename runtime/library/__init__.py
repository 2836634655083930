"""Folders of generated robots, and the cache of compiled libraries."""

from .cache import build, cache_folder
from .compiler import find_compiler
from .derived import is_description, is_of_shelf, options_of, shelf
from .folders import find_folder, shipped_folders

__all__ = [
    "build",
    "cache_folder",
    "find_compiler",
    "find_folder",
    "is_description",
    "is_of_shelf",
    "options_of",
    "shelf",
    "shipped_folders",
]
