"""The subcommands `fk`, `ik`, `info` and `list`."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
import typer

import chasles
from chasles import InputValueError, load, robots, se3, shelf_robots
from chasles.contract import Argument, Coordinate, Manifest, read_manifest
from chasles.library import find_folder, options_of, shelf, shipped_folders
from chasles.tolerances import AT_LIMIT

from .console import err, print_json, say
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
_POSITION = (1.0, 1.0, 1.0, 0.0, 0.0, 0.0)
"""Weights of the tool's position and orientation for the task "position"."""
_PLAIN = re.compile(r"[-+.,e\d\s]+", re.IGNORECASE)
"""Numbers without units."""
_FAR = 20.0
"""Ratio of a target's distance to the distance of the nearest pose, above which the target is
probably in millimeters."""
_QUATERNIONS = {"wxyz": ("w", *_XYZ), "xyzw": (*_XYZ, "w")}


def add_to(app: typer.Typer) -> None:
    """Add the subcommands to the command line."""
    add(app, fk, "chasles fk ur5e --q 0,-90deg,90deg,0,90deg,0")
    add(app, ik, "chasles ik ur5e --xyz 300mm,100mm,500mm --rpy 180deg,0,0")
    add(app, info, "chasles info panda")
    add(app, list_robots, "chasles list --json", "list")


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
        _warn(f"outside the limits: {outside}")
    T = np.asarray(arm.fk(at))
    theta = np.asarray(arm.chain(at)) if "chain" in arm.functions else None
    if as_json:
        chain = {} if theta is None else {"theta": theta.tolist()}
        print_json({"robot": arm.name, "q": at.tolist(), **chain, "T": T.tolist()})
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
        Literal["pose", "position"], typer.Option(help="What the tool reaches.")
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
        bool, typer.Option("--nearest", help="Only the solution nearest to --q-seed.")
    ] = False,
    numeric: Annotated[
        bool, typer.Option("--numeric", help="Iterate; for robots without a closed form.")
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
    if task == "pose" and rpy is None and quat is None and rotvec is None:
        _warn("without --rpy, --quat or --rotvec, the tool has the identity orientation")
    if nearest and q_seed is None and seed is not None:
        at = _configuration(arm.coordinates, seed)
        _warn(f"without --q-seed, nearest to the reference configuration: {at}")
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
            _print_unit_hint(xyz, near, T)
    if not inside.any():
        raise typer.Exit(1)


def _warn(message: str) -> None:
    err.print(message, style="yellow", markup=False)


@dataclass(frozen=True)
class _Near:
    """The configuration q (n,) within the limits whose pose T is nearest to an unreached target."""

    q: FloatArray
    T: FloatArray


def _near(
    arm: chasles.Robot,
    T: FloatArray,
    task: Literal["pose", "position"],
    seed: FloatArray | None,
    fixed: dict[str, float] | None,
) -> _Near | None:
    if "ik_numeric" not in dir(arm):
        return None
    q = arm.ik_numeric(T, seed, fixed=fixed, task_weights=_weights(task)).q
    return _Near(q, arm.fk(q))


def _weights(task: Literal["pose", "position"]) -> tuple[float, ...] | None:
    return _POSITION if task == "position" else None


@dataclass(frozen=True)
class _Found:
    """Solutions q (k, n), or the reason why there is no solution.

    For a pose without an exact solution, the smallest residual [m], otherwise NaN.
    """

    q: FloatArray
    reason: str = ""
    residual: float = math.nan


def _solutions(
    arm: chasles.Robot,
    T: FloatArray,
    task: Literal["pose", "position"],
    seed: FloatArray | None,
    fixed: dict[str, float] | None,
    nearest: bool,
    numeric: bool,
) -> _Found:
    """Return the exact solutions, or else the solutions within the rounding of printed poses."""
    if numeric:
        solution = arm.ik_numeric(T, seed, fixed=fixed, task_weights=_weights(task))
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
    task: Literal["pose", "position"],
    seed: FloatArray | None,
    fixed: dict[str, float] | None,
) -> _Found:
    """Return all exact solutions, or else all within the rounding of printed poses."""
    if f"ik{'_position' if task == 'position' else ''}" not in arm.functions:
        raise InputValueError(_no_closed_form(arm, task))
    if fixed and task == "position":
        raise InputValueError("--fixed with --task position also requires --nearest or --numeric")
    if task == "pose" and arm.manifest.redundancy and not fixed:
        raise InputValueError(_infinitely_many(arm))
    solutions = arm.ik(T, fixed=fixed) if task == "pose" else arm.ik_position(T[:3, 3])
    least = float(solutions.least_squares().residual)
    if not solutions.valid.any() and least <= rounding(arm):
        solutions = solutions.within_tolerance(rounding(arm))
    if seed is not None:
        solutions = solutions.sorted_by_distance(seed)
    found = np.asarray(solutions.valid_q())
    return _Found(found, "" if len(found) else "out of reach", least)


def _single(solution: Any, tolerance: float) -> _Found:
    """Return one solution; the residual of an invalid solution must be within the tolerance."""
    if solution.valid:
        return _Found(solution.q[None])
    is_near = bool(solution.residual <= tolerance)
    reason = "" if is_near else str(solution.reason)
    q = solution.q[None] if is_near else np.empty((0, len(solution.q)))
    return _Found(q, reason, float(solution.residual))


def _nearest_within_limits(arm: chasles.Robot, found: _Found) -> _Found:
    """Return the first of sorted solutions within the limits."""
    q = np.array([row for row in found.q if arm.is_within_limits(row)][:1]).reshape(-1, arm.n)
    return _Found(q, "" if len(q) else "limits", found.residual)


def _no_closed_form(arm: chasles.Robot, task: str) -> str:
    """Return the message for a task without a closed form, with the command that solves it."""
    tasks = {"ik": "pose", "ik_position": "position"}
    known = [f"--task {word}" for name, word in tasks.items() if name in arm.functions]
    return (
        f"{arm.name} has no closed form for --task {task}; with a closed form: "
        f"{', '.join(known) or 'none'}. Add --numeric to find one solution by iteration"
    )


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
        # Limits can remove solutions whose residual is small.
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


def _print_near(
    arm: chasles.Robot, near: _Near, T: FloatArray, task: Literal["pose", "position"]
) -> None:
    """Print the nearest pose within the limits with its coordinates and its error."""
    distance = float(np.linalg.norm(T[:3, 3] - near.T[:3, 3]))
    angle = float(np.linalg.norm(se3.to_rotvec(se3.inverse(near.T) @ T))) if task == "pose" else 0.0
    at = _configuration(arm.coordinates, near.q)
    if max(distance, angle * arm.unit_length) <= rounding(arm):
        say(f"--numeric finds a solution within the limits: {at}")
        return
    error = f"{shown(distance, 'm')} mm" + (f" and {shown(angle, 'rad')} deg" if angle else "")
    say(f"nearest pose within the limits, {error} away: {at}")


def _print_unit_hint(xyz: str, near: _Near, T: FloatArray) -> None:
    """Print the unit of lengths if a target without units is far beyond the reach."""
    reached, target = np.linalg.norm(near.T[:3, 3]), np.linalg.norm(T[:3, 3])
    if _PLAIN.fullmatch(xyz) and target > _FAR * reached:
        words = ",".join(f"{word}mm" for word in re.split(r"[,\s]+", xyz.strip()))
        say(f"lengths without a unit are in meters; for millimeters: --xyz {words}")


def _outside(arm: chasles.Robot, q: FloatArray) -> str:
    """Return the coordinates and main-chain joints outside their limits, with the limits."""
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


def info(
    robot: Robot, base: Base = None, tip: Tip = None, exact: Exact = False, as_json: Json = False
) -> None:
    """Show coordinates, parameters and functions of a robot."""
    words = options_of(exact, parametric=False, base=base, tip=tip)
    manifest = read_manifest(find_folder(robot, words))
    if as_json:
        print((manifest.folder / "manifest.json").read_text(encoding="utf-8"))
        return
    title = "" if manifest.title == manifest.name else f": {manifest.title}"
    heading = [f"{manifest.name}{title}", manifest.source, *manifest.notes]
    say("\n".join([*filter(None, heading), ""]))
    say(f"frames: {manifest.frames.base} to {manifest.frames.tip}\n\ncoordinates (q):")
    for coordinate in manifest.coordinates:
        say(f"    {_with_limits(coordinate)}")
    _say_coupling(manifest)
    _say_loops(manifest)
    if manifest.parameters:
        say("\nparameters:")
    for parameter in manifest.parameters:
        number = f"{parameter.value:.10g} {parameter.unit}"
        say(f"    {parameter.name:<20} {number:<20} {parameter.meaning}")
    say("\nfunctions:")
    for function in manifest.functions:
        counts = ", ".join(f"{n} {kind}" for kind, n in function.operations.items() if n)
        say(f"    {function.name}({_arguments(function.inputs)})")
        say(f"        -> {_arguments(function.outputs)}")
        say(f"        {function.summary}\n        {counts}")


def _with_limits(variable: Coordinate) -> str:
    limits = f"{_limit(variable.lower, '-')} to {_limit(variable.upper, '')}"
    return f"{variable.name:<20} {variable.kind:<10} {limits} {variable.unit}"


def _say_coupling(manifest: Manifest) -> None:
    """Print the joints of a coupled arm with their limits and ratios."""
    coupling = manifest.loops.coupling
    if not coupling:
        return
    say("\njoints (theta = C q + c, with the nonzero entries of C):")
    for joint, row in zip(manifest.loops.chain, coupling, strict=True):
        ratios = [
            f"{ratio:.10g} {coordinate.name}"
            for ratio, coordinate in zip(row, manifest.coordinates, strict=True)
            if ratio
        ]
        say(f"    {_with_limits(joint)}: {', '.join(ratios) or 'constant'}")


def _say_loops(manifest: Manifest) -> None:
    if not manifest.loops.solution:
        return
    joints = ", ".join(f"{item.name} [{item.unit}]" for item in manifest.loops.chain)
    passive = ", ".join(f"{item.name} [{item.unit}]" for item in manifest.loops.passive)
    say(f"\nloops ({manifest.loops.solution}): {', '.join(manifest.loops.names)}")
    say(f"    main chain (theta): {joints}\n    passive: {passive or 'none'}")


def list_robots(as_json: Json = False) -> None:
    """List the robots that can be loaded by name."""
    generated = {name: read_manifest(folder).title for name, folder in shipped_folders().items()}
    texts = {name: shelf()[name].read_text(encoding="utf-8") for name in shelf_robots()}
    derived = {name: str(tomllib.loads(text)["title"]) for name, text in texts.items()}
    if as_json:
        print_json({"generated": generated, "derived_on_first_use": derived})
        return
    for name in robots():
        say(f"{name:<24} {generated[name]}")
    say("\nderived on first use:")
    for name, title in derived.items():
        say(f"{name:<24} {title}")


def _limit(limit: float | None, sign: str) -> str:
    return f"{sign}inf" if limit is None else f"{limit:.6g}"


def _arguments(arguments: Sequence[Argument]) -> str:
    return ", ".join(f"{item.name} {list(item.shape)} [{item.unit}]" for item in arguments)
