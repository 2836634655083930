"""Folders of generated robots, and the cache of compiled libraries."""

from .cache import GLUE_FILE, build, cache_folder, kernel_recipe, write_library
from .compiler import Compiler, find_compiler
from .derived import is_description, is_of_shelf, options_of, shelf
from .folders import find_folder, shipped_folders

__all__ = [
    "GLUE_FILE",
    "Compiler",
    "build",
    "cache_folder",
    "find_compiler",
    "find_folder",
    "is_description",
    "is_of_shelf",
    "kernel_recipe",
    "options_of",
    "shelf",
    "shipped_folders",
    "write_library",
]
