"""The subcommands `fk` and `ik`."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal

import numpy as np
import typer

import chasles
from chasles import InputValueError, load, se3
from chasles.contract import Coordinate, Redundancy, TaskName
from chasles.tolerances import AT_LIMIT

from .console import print_json, say, warn
from .options import Base, Exact, Fixed, Json, Robot, Tip, add
from .values import (
    FloatArray,
    coordinates,
    fixed_values,
    rounded,
    rounding,
    shown,
    shown_unit,
    values,
)

_XYZ = ("x", "y", "z")
_WEIGHTS: Mapping[TaskName, tuple[float, ...]] = {
    "pose": (1.0, 1.0, 1.0, 1.0, 1.0, 1.0),
    "position": (1.0, 1.0, 1.0, 0.0, 0.0, 0.0),
    "position_direction": (1.0, 1.0, 1.0, 1.0, 1.0, 0.0),
    "orientation": (0.0, 0.0, 0.0, 1.0, 1.0, 1.0),
}
"""Weights of the position errors and rotation errors in tool axes, keyed by the task of
`ik_numeric`."""
_COMPONENTS: Mapping[str, Callable[[FloatArray], Any]] = {
    "position": lambda T: T[:3, 3],
    "plane": lambda T: T[:2, 3],
    "orientation": lambda T: T[:3, :3],
    "direction": lambda T: T[:3, 2],
    "pitch": lambda T: [math.atan2(T[2, 2], math.hypot(T[0, 2], T[1, 2]))],
    "heading": lambda T: [math.atan2(T[1, 0], T[0, 0])],
}
"""Functions that compute a component of a task from a pose, keyed by the name of the component."""
_FREER: tuple[TaskName, ...] = ("position_direction", "position_pitch", "position")
"""Tasks that prescribe the position and at most two components of the orientation."""
_ORIENTATION = "orientation out of reach"
"""Message if the tool reaches the position only with a different orientation."""
_REASONS = {"stalled": "no closer pose found"}
"""Messages for values of `reason` in a result of `ik_numeric`."""
_PLAIN = re.compile(r"[-+.,e\d\s]+", re.IGNORECASE)
"""Numbers without units."""
_FAR = 20.0
"""Maximum plausible distance of a target from the base, relative to the distance of the nearest
reachable pose. If the ratio exceeds this value, the target is probably in millimeters."""
_QUATERNIONS = {"wxyz": ("w", *_XYZ), "xyzw": (*_XYZ, "w")}


def add_to(app: typer.Typer) -> None:
    """Add the subcommands to the command line."""
    add(app, fk, "chasles fk ur5e --q 0,-90deg,90deg,0,90deg,0")
    add(app, ik, "chasles ik ur5e --xyz 300mm,100mm,500mm --rpy 180deg,0,0")


def fk(
    robot: Robot,
    q: Annotated[
        str | None,
        typer.Option(
            "--q", metavar="NUMBERS", help="Coordinates. Default: the reference configuration."
        ),
    ] = None,
    base: Base = None,
    tip: Tip = None,
    exact: Exact = False,
    as_json: Json = False,
    words: Annotated[list[str] | None, typer.Argument(hidden=True)] = None,
) -> None:
    """Compute the pose of the tool, and the joints of the main chain if they are not actuated."""
    if words:
        raise InputValueError(f"fk: pass the coordinates with --q, as in --q {','.join(words)}")
    arm = load(robot, base=base, tip=tip, exact=exact)
    at = coordinates(arm, q, "--q")
    if outside := _outside(arm, at):
        warn(f"outside the limits: {outside}")
    T = np.asarray(arm.fk(at))
    theta = np.asarray(arm.chain(at)) if "chain" in arm.functions else None
    swivel = {one.name: float(getattr(arm, one.name)(at)) for one in _computed(arm)}
    if as_json:
        chain = {} if theta is None else {"theta": theta.tolist()}
        print_json({"robot": arm.name, "q": at.tolist(), **chain, **swivel, "T": T.tolist()})
        return
    say(f"{arm.name}: pose of {arm.tip_frame} in {arm.base_frame}")
    say(f"at {_configuration(arm.coordinates, at)}")
    if theta is not None:
        say(f"main chain: {_configuration(arm.chain_joints, theta)}")
    say()
    for row in T:
        say("  ".join(f"{rounded(number, 8):12.8f}" for number in row))
    p, angles, quaternion = se3.to_xyz(T), se3.to_rpy(T), se3.to_quat(T, order="wxyz")
    say(f"\nxyz [mm]    {_row(p, 'm')}")
    say(f"rpy [deg]   {_row(angles, 'rad')}")
    say(f"quat (wxyz) {'  '.join(f'{rounded(number, 8):12.8f}' for number in quaternion)}")
    for one in _computed(arm):
        heading = f"{one.name} [{shown_unit(one.unit)}]"
        say(f"{heading:<12}{shown(swivel[one.name], one.unit):>12}  {one.meaning}")


def _computed(arm: chasles.Robot) -> list[Redundancy]:
    """Return the redundancy parameters that are not coordinates, such as the swivel angle."""
    return [one for one in arm.redundancy if one.index is None and one.name in arm.functions]


def ik(
    robot: Robot,
    xyz: Annotated[str, typer.Option(metavar="X,Y,Z", help="Position of the tool.")],
    rpy: Annotated[
        str | None,
        typer.Option(
            metavar="R,P,Y",
            help="Roll, pitch and yaw of the tool, as in URDF. Default: the identity orientation.",
        ),
    ] = None,
    quat: Annotated[
        str | None, typer.Option(metavar="NUMBERS", help="Quaternion of the tool; needs --order.")
    ] = None,
    order: Annotated[
        Literal["wxyz", "xyzw"] | None, typer.Option(help="Order of the elements of --quat.")
    ] = None,
    rotvec: Annotated[
        str | None, typer.Option(metavar="X,Y,Z", help="Axis times angle of the tool.")
    ] = None,
    fixed: Fixed = None,
    task: Annotated[
        TaskName,
        typer.Option(
            help="Part of the pose that the tool reaches. position_pitch: the position and the "
            "elevation of the tool's z axis; position_direction: the position and the direction "
            "of this axis; planar: x, y and the rotation in the plane."
        ),
    ] = "pose",
    q_seed: Annotated[
        str | None,
        typer.Option(
            metavar="NUMBERS",
            help="Sort by the distance from these coordinates. Default with --nearest: the "
            "reference configuration.",
        ),
    ] = None,
    nearest: Annotated[
        bool,
        typer.Option(
            "--nearest",
            help="Only the solution nearest to --q-seed, or else to the reference configuration: "
            "the largest move of a joint is minimal. Without --fixed, a redundant robot keeps its "
            "redundancy parameter, such as the swivel angle, at that configuration.",
        ),
    ] = False,
    numeric: Annotated[
        bool, typer.Option("--numeric", help="Iterate; for robots without ik.")
    ] = False,
    base: Base = None,
    tip: Tip = None,
    exact: Exact = False,
    as_json: Json = False,
) -> None:
    """Compute all configurations with a specified pose of the tool.

    The exit status is 1 if there is no solution within the limits.
    """
    arm = load(robot, base=base, tip=tip, exact=exact)
    T = _pose(xyz, rpy, quat, order, rotvec)
    seed = None if q_seed is None else coordinates(arm, q_seed, "--q-seed")
    if nearest and seed is None:
        seed = coordinates(arm, None, "--q-seed")
    values_of_fixed = fixed_values(arm, fixed or ()) or None
    found = _solutions(arm, T, task, seed, values_of_fixed, nearest, numeric)
    near = None if len(found.q) else _near(arm, T, task, seed, values_of_fixed)
    if near is not None and near.reaches_position and found.reason != "limits":
        found = replace(found, reason=_ORIENTATION)
    if task != "position" and rpy is None and quat is None and rotvec is None:
        warn("without --rpy, --quat or --rotvec, the tool has the identity orientation")
    if nearest and q_seed is None and seed is not None:
        at = _configuration(arm.coordinates, seed)
        warn(f"without --q-seed, nearest to the reference configuration: {at}")
    inside = np.array([bool(arm.is_within_limits(row)) for row in found.q], dtype=bool)
    if as_json:
        rows = zip(found.q.tolist(), inside.tolist(), strict=True)
        solutions = [{"q": row, "within_limits": is_inside} for row, is_inside in rows]
        residual = found.residual if math.isfinite(found.residual) else None
        about: dict[str, Any] = {"reason": found.reason, "residual": residual}
        if near is not None:
            about["nearest"] = {"q": near.q.tolist(), "T": np.asarray(near.T).tolist()}
        print_json({"robot": arm.name, "T": T.tolist(), "solutions": solutions, **about})
    else:
        _print_solutions(arm, found, inside)
        if near is not None:
            _print_near(arm, near, T, task)
            _print_task_hint(arm, T, task, found)
            _print_unit_hint(xyz, near, T)
    if not inside.any():
        raise typer.Exit(1)


@dataclass(frozen=True)
class _Near:
    """The configuration q (n,) within limits whose tool pose T is nearest to the target.

    `reaches_position` is true if the tool can reach the target position with a different
    orientation.
    """

    q: FloatArray
    T: FloatArray
    reaches_position: bool


def _near(
    arm: chasles.Robot,
    T: FloatArray,
    task: TaskName,
    seed: FloatArray | None,
    fixed: dict[str, float] | None,
) -> _Near | None:
    if "ik_numeric" not in dir(arm) or task not in _WEIGHTS:
        return None
    q = arm.ik_numeric(T, seed, fixed=fixed, task_weights=_WEIGHTS[task]).q
    reaches_position = task in ("pose", "position_direction") and bool(
        arm.ik_numeric(T, q, fixed=fixed, task_weights=_WEIGHTS["position"]).valid
    )
    return _Near(q, arm.fk(q), reaches_position)


@dataclass(frozen=True)
class _Found:
    """Solutions q (k, n), or the reason for a missing solution.

    Smallest residual [m] if there is no exact solution, otherwise NaN.
    """

    q: FloatArray
    reason: str = ""
    residual: float = math.nan


def _solutions(
    arm: chasles.Robot,
    T: FloatArray,
    task: TaskName,
    seed: FloatArray | None,
    fixed: dict[str, float] | None,
    nearest: bool,
    numeric: bool,
) -> _Found:
    """Return the solutions.

    If there is no exact solution, return solutions within the rounding errors of the target.
    """
    if numeric:
        if task not in _WEIGHTS:
            raise InputValueError(f"--numeric solves --task {', '.join(_WEIGHTS)}, not {task}")
        solution = arm.ik_numeric(T, seed, fixed=fixed, task_weights=_WEIGHTS[task])
        return _single(solution, rounding(arm))
    if nearest and seed is not None:
        found = _single(arm.ik_nearest(T, seed, task=task, fixed=fixed), 0.0)
        is_listed = task == "pose" and bool(fixed) == bool(arm.manifest.redundancy)
        if not len(found.q) and is_listed and found.residual <= rounding(arm):
            return _nearest_within_limits(arm, _all(arm, T, task, seed, fixed))
        return found
    return _all(arm, T, task, seed, fixed)


def _all(
    arm: chasles.Robot,
    T: FloatArray,
    task: TaskName,
    seed: FloatArray | None,
    fixed: dict[str, float] | None,
) -> _Found:
    """Return all solutions.

    If there is no exact solution, return solutions within the rounding errors of the target.
    """
    if task not in arm.manifest.inverses:
        raise InputValueError(_no_closed_form(arm, task))
    if fixed and task != "pose":
        raise InputValueError(f"--fixed also requires --nearest or --numeric for --task {task}")
    if task == "pose" and arm.manifest.redundancy and not fixed:
        raise InputValueError(_infinitely_many(arm))
    inverse = arm.manifest.inverses[task]
    parts = [_COMPONENTS[component](T) for component in inverse.role.components]
    solutions = (
        arm.ik(T, fixed=fixed)
        if task == "pose"
        else arm.functions[inverse.name](np.concatenate(parts))
    )
    least = float(solutions.least_squares().residual)
    if not solutions.valid.any() and least <= rounding(arm):
        solutions = solutions.within_tolerance(rounding(arm))
    if seed is not None:
        solutions = solutions.sorted_by_distance(seed)
    found = np.asarray(solutions.valid_q())
    return _Found(found, "" if len(found) else "out of reach", least)


def _single(solution: Any, tolerance: float) -> _Found:
    """Return a solution that is valid or has a residual within the tolerance."""
    if solution.valid:
        return _Found(solution.q[None])
    is_near = bool(solution.residual <= tolerance)
    reason = "" if is_near else _REASONS.get(solution.reason, str(solution.reason))
    q = solution.q[None] if is_near else np.empty((0, len(solution.q)))
    return _Found(q, reason, float(solution.residual))


def _nearest_within_limits(arm: chasles.Robot, found: _Found) -> _Found:
    """Return the first of sorted solutions within the limits."""
    q = np.array([row for row in found.q if arm.is_within_limits(row)][:1]).reshape(-1, arm.n)
    return _Found(q, "" if len(q) else "limits", found.residual)


def _no_closed_form(arm: chasles.Robot, task: str) -> str:
    """Return the message for a task without a closed form."""
    known = ", ".join(f"--task {word}" for word in arm.manifest.inverses) or "none"
    numeric = ". Add --numeric to find one solution by iteration" if task in _WEIGHTS else ""
    return f"{arm.name} has no closed form for --task {task}; with a closed form: {known}{numeric}"


def _infinitely_many(arm: chasles.Robot) -> str:
    fixed = [f"--fixed {one.name}=10{shown_unit(one.unit)}" for one in arm.manifest.redundancy]
    return (
        f"{arm.name}: infinitely many solutions reach a pose; pass a value such as "
        f"{' '.join(fixed)}, or --nearest with --q-seed for the solution nearest to a configuration"
    )


def _pose(
    xyz: str,
    rpy: str | None,
    quat: str | None,
    order: Literal["wxyz", "xyzw"] | None,
    rotvec: str | None,
) -> FloatArray:
    if quat is not None and order is None:
        raise InputValueError("--quat also requires --order wxyz or --order xyzw")
    angles, plain = ["rad"] * 3, [""] * 4
    turn: dict[str, Any] = {
        "rpy": None if rpy is None else values(rpy, angles, ("roll", "pitch", "yaw"), "--rpy"),
        "rotvec": None if rotvec is None else values(rotvec, angles, _XYZ, "--rotvec"),
        "quat": None if quat is None else values(quat, plain, _QUATERNIONS[str(order)], "--quat"),
    }
    p = values(xyz, ["m"] * 3, _XYZ, "--xyz")
    return se3.pose(p, **turn, order=order if quat else None)


def _print_solutions(arm: chasles.Robot, found: _Found, inside: Any) -> None:
    least = ""
    if math.isfinite(found.residual):
        unit = "m, rad" if arm.unit_length == 1 else f"m, angles times {arm.unit_length:g} m"
        least = f"residual {found.residual:.3g} ({unit})"
    if not len(found.q):
        # A small residual is not reported, because the limits may have removed the solutions.
        missed = (
            f"; the best branch has the {least}" if found.residual > rounding(arm) and least else ""
        )
        say(f"{arm.name}: no solution ({found.reason}{missed})")
        return
    plural = "" if len(found.q) == 1 else "s"
    rounded_pose = least and f" for a rounded pose, {least}"
    within = f"{int(inside.sum())} within the limits"
    say(f"{arm.name}: {len(found.q)} solution{plural}{rounded_pose}, {within}\n")
    heads = [f"{one.name} [{shown_unit(one.unit)}]" for one in arm.coordinates]
    widths = [max(12, len(head)) for head in heads]
    say("  ".join(head.rjust(width) for head, width in zip(heads, widths, strict=True)))
    for row, is_inside in zip(found.q, inside, strict=True):
        cells = [
            shown(number, one.unit).rjust(width)
            for number, one, width in zip(row, arm.coordinates, widths, strict=True)
        ]
        outside = "" if is_inside else f"outside the limits: {_outside(arm, row)}"
        say("  ".join([*cells, outside]).rstrip())


def _print_near(arm: chasles.Robot, near: _Near, T: FloatArray, task: TaskName) -> None:
    """Print the nearest pose within the limits with its coordinates and its error."""
    distance, angle = 0.0, 0.0
    if task != "orientation":
        distance = float(np.linalg.norm(T[:3, 3] - near.T[:3, 3]))
    if task == "position_direction":
        z, u = near.T[:3, 2], T[:3, 2]
        angle = math.atan2(float(np.linalg.norm(np.cross(z, u))), float(z @ u))
    elif task != "position":
        angle = float(np.linalg.norm(se3.to_rotvec(se3.inverse(near.T) @ T)))
    at = _configuration(arm.coordinates, near.q)
    if max(distance, angle * arm.unit_length) <= rounding(arm):
        say(f"--numeric finds a solution within the limits: {at}")
        return
    error = f"{shown(distance, 'm')} mm" + (f" and {shown(angle, 'rad')} deg" if angle else "")
    say(f"nearest pose within the limits, {error} away: {at}")


def _print_task_hint(arm: chasles.Robot, T: FloatArray, task: TaskName, found: _Found) -> None:
    """Print the tasks that can be solved if the tool orientation is not prescribed."""
    if found.reason != _ORIENTATION:
        return
    freer = [one for one in _FREER if one != task and one in arm.manifest.inverses]
    solved = [one for one in freer if len(_all(arm, T, one, None, None).q)]
    words = " or ".join(f"--task {one}" for one in solved) or "--task position --numeric"
    say(f"the position is within reach with other orientations: {words}")


def _print_unit_hint(xyz: str, near: _Near, T: FloatArray) -> None:
    """Print the unit of lengths if a target without units is far beyond the reach."""
    reached, target = np.linalg.norm(near.T[:3, 3]), np.linalg.norm(T[:3, 3])
    if _PLAIN.fullmatch(xyz) and target > _FAR * reached:
        words = ",".join(f"{word}mm" for word in re.split(r"[,\s]+", xyz.strip()))
        say(f"lengths without a unit are in meters; for millimeters: --xyz {words}")


def _outside(arm: chasles.Robot, q: FloatArray) -> str:
    """Return the violated limits with their coordinates or joints."""
    variables, x, limits = [*arm.coordinates], [*q], [*arm.limits]
    if "chain" in arm.functions:
        joints = zip(arm.chain_joints, arm.chain(q[None])[0], arm.joint_limits, strict=True)
        for joint, position, ends in joints:
            if joint.name not in arm.coordinate_names and np.isfinite(position):
                variables, x, limits = [*variables, joint], [*x, position], [*limits, ends]
    found = []
    for one, position, (lower, upper) in zip(variables, x, limits, strict=True):
        slack = AT_LIMIT * (arm.unit_length if one.unit == "m" else 1)
        if not lower - slack <= position <= upper + slack:
            low, high = (f"{float(shown(end, one.unit)):g}" for end in (lower, upper))
            found.append(f"{_coordinate(one, position)} ({low} to {high} {shown_unit(one.unit)})")
    return ", ".join(found)


def _coordinate(one: Coordinate, x: float) -> str:
    return f"{one.name} {float(shown(x, one.unit)):g} {shown_unit(one.unit)}"


def _configuration(variables: Sequence[Coordinate], q: FloatArray) -> str:
    return ", ".join(map(_coordinate, variables, q))


def _row(numbers: FloatArray, unit: str) -> str:
    return "  ".join(shown(float(number), unit).rjust(12) for number in numbers)
