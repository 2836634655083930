"""Loading of robot functions from a library, with help texts, guards and refinement."""

from __future__ import annotations

import inspect
import textwrap
from collections.abc import Callable, Mapping
from typing import Any

from .call._call import NEARLY_RIGID, Function
from .call.guard import Guard
from .closed_form.fixed_joints import FixedJoints
from .closed_form.refinement import refinement_of
from .closed_form.solutions import solutions_of
from .contract import Argument, FunctionInfo, Manifest
from .joint_limits import joint_limits_of
from .library.cache import open_library
from .size import unit_length
from .tolerances import SOLVED

_WIDTH = 100
_IN = " " * 8
_POSE = (4, 4)


def load_functions(
    manifest: Manifest,
    reduced: Callable[[str], tuple[Any, ...]],
    robot_of: Callable[[Manifest], Any],
) -> dict[str, Function[Any]]:
    """Return the functions of a robot, compiled first if the cache has no library.

    Raises:
        MismatchError: If the library is damaged, and no compiler was found.
        ChaslesError: If the library cannot be compiled; the message states the reason.
    """
    _, library = open_library(manifest)
    functions: dict[str, Function[Any]] = {}
    # A margin function is loaded before the functions whose margin it computes. Inverses are loaded
    # last, because they may call any other function.
    order = sorted(manifest.functions, key=lambda info: (info.role.is_inverse, bool(info.margin)))
    pose = manifest.with_role("pose", "actuators")
    inverse = manifest.with_role("inverse", "pose")
    unit = 1.0
    for info in order:
        if info.role.is_inverse and pose and manifest.inverse.method != "snapped":
            unit = unit_length(functions[pose.name], manifest.coordinates, manifest.loops.reference)
        functions[info.name] = library.function(
            info.name,
            info.inputs,
            info.outputs,
            label=f"{manifest.name}.{info.name}",
            doc=write_doc(info, unit, manifest if info == inverse else None),
            signature=_signature(info, is_of_poses=info == inverse),
            operations=info.operations,
            reduced=reduced(info.name),
            guard=_guard(manifest, info, functions) if info.margin else None,
            solutions=solutions_of(
                *(manifest.coordinates, manifest.wraps, info.role.labels),
                _residual_unit(info, unit),
                joint_limits=joint_limits_of(manifest, functions, info.name),
            )
            if info.role.is_inverse
            else None,
            rescue=refinement_of(manifest, info, functions, unit, _residual_unit(info, unit)),
            poses=_poses(manifest, info),
            fk=pose.name if pose else None,
            unit=unit,
            general=FixedJoints(manifest, functions, robot_of) if info == inverse else None,
            parameters=manifest.direct_parameters if info == inverse else (),
        )
    return {info.name: functions[info.name] for info in manifest.functions}


def _guard(manifest: Manifest, info: FunctionInfo, functions: Mapping[str, Function[Any]]) -> Guard:
    steps = next(item.steps for item in manifest.functions if item.name == info.margin)
    return Guard(
        label=f"{manifest.name}.{info.name}",
        margin=functions[info.margin],
        steps=steps,
        coordinates=manifest.loops.chain if info.role.domain == "chain" else manifest.coordinates,
        dead_point=manifest.tolerances.dead_point,
        is_followed=manifest.is_iterated,
    )


def _poses(manifest: Manifest, info: FunctionInfo) -> int:
    """Return the number that selects the test for rigid poses in C; see PosesOf in operands.h."""
    if not _solves_poses(info):
        return 0
    return 2 if manifest.inverse.method == "general" else 1


def _residual_unit(info: FunctionInfo, unit: float) -> float:
    lengths_alone = info.inputs[0].unit == "m"
    return unit if lengths_alone or _solves_poses(info) else min(unit, 1.0)


def _solves_poses(info: FunctionInfo) -> bool:
    return info.role.is_inverse and info.inputs[0].shape == _POSE


def write_doc(info: FunctionInfo, unit: float = 1.0, fixes: Manifest | None = None) -> str:
    """Return the help text of a function."""
    lines = [info.summary, ""]
    if info.identity:
        lines += [*textwrap.wrap(info.identity, _WIDTH), ""]
    lines += ["Args:"]
    lines += [f"    {_describe(item)}" for item in (info.inputs[:1] if fixes else info.inputs)]
    lines += _about_fixed(fixes) if fixes else []
    out = "float64 array" if len(info.outputs) == 1 else "Tuple of float64 arrays"
    lines += [f"    out: {out} to write into, shaped like the result. None creates a new one."]
    lines += ["    threads: Number of threads for a large batch; 'all' is one thread per core.", ""]
    lines += ["Returns:", *(f"    {_describe(item)}" for item in info.outputs)]
    if info.role.is_inverse:
        tolerance = SOLVED * _residual_unit(info, unit)
        lines += [f"    valid: (..., {len(info.role.labels)}) whether residual <= {tolerance:g}"]
    lines += [""]
    if info.role.labels:
        lines += ["Each slot k of the results holds the solution on one branch.", "", "Slots:"]
        lines += [*(f"    {k}: {label}" for k, label in enumerate(info.role.labels)), ""]
    if _solves_poses(info):
        lines += [
            "Raises:",
            f"    InputValueError: If T deviates from a rigid pose by more than {NEARLY_RIGID:g}.",
            "        `chasles.se3.project` corrects smaller deviations. NaN results in NaN.",
            "",
        ]
    if info.margin:
        lines += [
            "Raises:",
            "    OutOfReachError: If a loop does not close at a single pose. For a batch, or with",
            f"        `out`, the result is NaN. `{info.margin}` returns the margin of each loop.",
            "    SingularityError: If a single pose is at a dead point, where rates are undefined.",
            "",
        ]
    kinds = ", ".join(f"{kind} {n}" for kind, n in info.operations.items() if kind != "total")
    lines += [f"Number of floating-point operations: {info.operations.get('total', 0)} ({kinds})."]
    return "\n".join(lines)


def _about_fixed(manifest: Manifest) -> list[str]:
    joints = ", ".join(joint.name for joint in manifest.loops.chain or manifest.coordinates)
    own = ", ".join(f"{item.name} [{item.unit}]" for item in manifest.redundancy)
    return [
        "    fixed: Values (...) [rad or m] of fixed joints, keyed by joint name.",
        *([f"{_IN}Required: {own}, or the same number of other joints."] if own else []),
        "        The first call for a set of joints may derive an inverse, which takes seconds. If",
        "        no inverse exists, the error lists the joints that can be fixed.",
        *textwrap.wrap(f"Joints: {joints}.", _WIDTH, initial_indent=_IN, subsequent_indent=_IN),
    ]


def _describe(argument: Argument) -> str:
    shape = ", ".join(["...", *map(str, argument.shape)])
    return f"{argument.name}: ({shape}) [{argument.unit}] {argument.meaning}"


def _signature(info: FunctionInfo, is_of_poses: bool) -> inspect.Signature:
    kind = inspect.Parameter
    inputs = [kind(item.name, kind.POSITIONAL_OR_KEYWORD) for item in info.inputs]
    options = [kind("fixed", kind.KEYWORD_ONLY, default=None)] if is_of_poses else []
    options += [kind("out", kind.KEYWORD_ONLY, default=None)]
    options += [kind("threads", kind.KEYWORD_ONLY, default=1)]
    return inspect.Signature([*(inputs[:1] if is_of_poses else inputs), *options])
