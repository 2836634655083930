"""The benchmark interfaces of chasles."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import chasles
from chasles.contract import read_manifest
from tests.support.native import UNPACKED, Source

from ...cases.arms import Arm
from ...native.library import Loop, loop
from . import Batch, Call

NAME = "chasles"
PLAIN = "chasles, one sine at a time"
"""Name of the variant that computes sines by the C math library (libm).

The C++ code of the other libraries also uses libm.
"""
PLAIN_FLAGS = ("-DCHASLES_PLAIN",)


def calls(arm: Arm) -> list[Call]:
    robot = chasles.load(arm.name)
    return [Call(NAME, robot.fk, robot.fk_jacobian_mixed, _read)]


def _read(result) -> tuple:
    return result if isinstance(result, tuple) else (result,)


def loops(arm: Arm) -> list[Loop]:
    return [generated_loop(chasles.load(arm.name).folder, arm.name, arm.joints)]


def plain_loop(arm: Arm) -> Loop:
    loop = generated_loop(chasles.load(arm.name).folder, arm.name, arm.joints, flags=PLAIN_FLAGS)
    return replace(loop, name=PLAIN)


def generated_loop(
    folder: Path, name: str, joints: int, pair: bool = True, flags: Sequence[str] = ()
) -> Loop:
    """Compile a C loop that calls the generated C of a robot.

    Without `pair`, the loop calls only fk, not fk_jacobian_mixed.
    """
    both = f"{name}_fk_jacobian_mixed(q, T, J);" if pair else "(void)q, (void)T, (void)J;"
    main = f"""
#include "{name}.c"
static void fk(void *none, const double *q, double *T) {{ (void)none; {name}_fk(q, T); }}
static void fk_jacobian(void *none, const double *q, double *T, double *J)
{{ (void)none; {both} }}
#include "loop.h"
"""
    own = read_manifest(folder).sources()
    return loop(NAME, joints, Source(f"own-{name}", {"main.c": main, **own}, (UNPACKED, *flags)))


def batches(arm: Arm) -> list[Batch]:
    robot = chasles.load(arm.name)
    return [Batch(NAME, robot.fk, robot.fk_jacobian_mixed)]
