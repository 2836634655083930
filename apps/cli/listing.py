"""The subcommands `info` and `list`."""

from __future__ import annotations

import tomllib

import typer

from chasles import robots, shelf_robots
from chasles.contract import Coordinate, Manifest, read_manifest
from chasles.library import find_folder, options_of, shelf, shipped_folders

from .console import print_json, say
from .options import Base, Exact, Json, Robot, Tip, add
from .values import DECIMALS, rounded, scaled, shown_unit

_GROUPS = {
    "pose": ("pose", "link poses", "pose and jacobian"),
    "Jacobian": ("jacobian", "jacobian rate", "hessian"),
    "twist": ("twist", "acceleration"),
    "inverse": ("inverse", "redundancy"),
    "loops": ("map", "map derivative", "map rate", "map acceleration", "margin", "branches"),
    "constraint": ("constraint", "constraint derivative", "constraint rate"),
    "geometry": ("parametric pose", "parametric jacobian", "identification jacobian"),
}
"""Function groups that `chasles info` lists, with the roles of the functions in each group.
The last group lists functions with other roles."""
_OTHER = "other"


def add_to(app: typer.Typer) -> None:
    """Add the subcommands to the command line."""
    add(app, info, "chasles info panda")
    add(app, list_robots, "chasles list --json", "list")


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
        unit = shown_unit(parameter.unit)
        number = f"{scaled(parameter.value, parameter.unit):.10g} {unit}"
        say(f"    {parameter.name:<20} {number:<20} {parameter.meaning}")
    _say_functions(manifest)


def _say_functions(manifest: Manifest) -> None:
    """Print the names of the functions in groups."""
    group_of = {role: group for group, roles in _GROUPS.items() for role in roles}
    groups: dict[str, list[str]] = {group: [] for group in (*_GROUPS, _OTHER)}
    for function in manifest.functions:
        inputs = ", ".join(item.name for item in function.inputs)
        groups[group_of.get(function.role.name, _OTHER)].append(f"{function.name}({inputs})")
    say("\nfunctions (--json prints their inputs, outputs and operations):")
    for group, signatures in groups.items():
        if signatures:
            say(f"    {group:<12} {', '.join(signatures)}")


def _with_limits(variable: Coordinate) -> str:
    return f"{variable.name:<20} {variable.kind:<10} {_limits(variable)}"


def _limits(variable: Coordinate) -> str:
    """Return the limits in the units that `fk` and `ik` print."""
    unit = shown_unit(variable.unit)
    ends = [
        None if end is None else f"{rounded(scaled(end, variable.unit), DECIMALS):g}"
        for end in (variable.lower, variable.upper)
    ]
    match ends:
        case None, None:
            return "unlimited"
        case None, upper:
            return f"at most {upper} {unit}"
        case lower, None:
            return f"at least {lower} {unit}"
    return f"{ends[0]} to {ends[1]} {unit}"


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
    joints = ", ".join(f"{item.name} [{shown_unit(item.unit)}]" for item in manifest.loops.chain)
    passive = ", ".join(f"{item.name} [{shown_unit(item.unit)}]" for item in manifest.loops.passive)
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
