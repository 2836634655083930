"""Pinocchio in C++, compiled from the headers of its wheel."""

import ctypes
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from tests.support.native import Source

from ...cases.arms import Arm
from ...native.library import Loop, headers, loop
from .placements import placements

SOURCE = Path(__file__).with_suffix(".cpp")
DEFINITIONS = (
    "-DBOOST_MPL_LIMIT_LIST_SIZE=30",
    "-DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS",
)


if find_spec("pinocchio") is None:
    raise ImportError("pin is not installed")
FOLDERS = (
    headers("libpinocchio", "/pinocchio/multibody.hpp"),
    headers("cmeel-eigen", "/Eigen/Core"),
)


def loops(arm: Arm) -> list[Loop]:
    found = loop("Pinocchio C++", arm.joints, source(), by_columns=True)
    found.library.make.restype = ctypes.c_void_p
    blocks = np.ascontiguousarray(placements(arm))
    context = found.library.make(ctypes.c_long(arm.joints), ctypes.c_void_p(blocks.ctypes.data))
    return [replace(found, context=context)]


def source() -> Source:
    """Return one C++ source for all arms, because one compilation of Pinocchio is slow."""
    text = SOURCE.read_text(encoding="utf-8")
    folders = [f"-isystem{folder}" for folder in FOLDERS]
    return Source("pinocchio", {SOURCE.name: text}, (*DEFINITIONS, *folders))
