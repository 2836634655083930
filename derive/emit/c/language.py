"""Writes C for single poses, for parallel solution branches and for batches of poses."""

from collections.abc import Sequence

from ...derivation import Derivation
from ...program.programs import Programs
from ...terms.symbolic_function import NativeSolverFunction, SymbolicFunction
from . import (
    batch,
    branch_lanes,
    closed_loops,
    nearest,
    polished,
    scalar,
    written,
)
from .header import header, support

RIGID = "chasles_rigid.h"
"""Support file that finds the rigid pose nearest to a matrix."""


def files(derivation: Derivation, programs: Programs) -> dict[str, str]:
    """Return the C files of a robot and the shared support files, keyed by name."""
    robot, functions = derivation.robot, derivation.functions
    nearest_files = nearest.nearest_files(derivation)
    further = [name for name in nearest_files if name == nearest.nearest_file(robot)]
    declared = nearest.nearest_declarations(derivation)
    return {
        f"{robot.name}.c": scalar.source(robot, functions, programs, derivation.written, further),
        f"{robot.name}.h": header(robot, (*functions, *derivation.written), programs, declared),
        **nearest_files,
        scalar.SUPPORT: support(scalar.SUPPORT),
        **_for_poses((*functions, *derivation.written)),
        **written.written_files(robot, derivation.written),
        **polished.polished_files(derivation, programs),
        **closed_loops.closure_files(derivation),
        **branch_lanes.files(robot, functions, programs),
        **batch.files(robot, functions, programs, derivation.written),
    }


def _for_poses(functions: Sequence[SymbolicFunction | NativeSolverFunction]) -> dict[str, str]:
    takes_pose = any(item.shape == (4, 4) for f in functions for item in f.inputs)
    return {RIGID: support(RIGID)} if takes_pose else {}
