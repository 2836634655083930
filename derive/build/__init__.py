"""Runs the jobs of the command line, such as deriving or checking robots.

The submodule `jobs` imports SymPy and CasADi, but importing the package `build` does not.
"""

from typing import TYPE_CHECKING

from ..description.shipped_files import ROBOTS, located
from .freshness import GENERATED, Job, Report, is_up_to_date, write_sources

if TYPE_CHECKING:
    from . import jobs as jobs

__all__ = [
    "GENERATED",
    "ROBOTS",
    "Job",
    "Report",
    "is_up_to_date",
    "jobs",
    "located",
    "write_sources",
]
