"""Builds the manifest, a machine-readable summary of a generated robot."""

import hashlib
import json
from collections.abc import Mapping
from typing import Any

import casadi as ca
import sympy as sp

from chasles import contract
from chasles.contract import (
    FORMAT,
    ActuatedVariable,
    Body,
    BodyJoint,
    CleanedNumber,
    ContractTolerances,
    Frames,
    FunctionInfo,
    GeometryParameter,
    InverseFacts,
    LinkMass,
    LoopFacts,
    Manifest,
    PlacedTip,
    Reference,
    Shape,
    SkeletonFacts,
    Variable,
    manifest_entries,
)

from ..chain.body_shapes import Skeleton
from ..chain.rigid_bodies import TreeBody, pose_rows
from ..derivation import Derivation
from ..inverse.arms.arm_step import from_chain_with_arms
from ..inverse.explanation import notes
from ..inverse.mechanisms.backward_inverse import missing
from ..loops.checks.closable import doubts_of, limits_of
from ..loops.closing.mobility import mobility_of
from ..loops.functions.constraint_functions import equations
from ..loops.model.coupling_equations import joint_couplings
from ..loops.solve.solved_loops import SolvedLoops
from ..model.cleaning import Cleaning, written
from ..model.mechanism import Coordinate, Described
from ..model.robot import UNITS, Joint, Motor, Parameter, SerialRobot
from ..model.tolerances import DEAD_POINT
from ..program.counting import count_operations
from ..program.operations import Program
from ..program.programs import Programs
from ..terms.symbolic_function import Argument, NativeSolverFunction, Result, SymbolicFunction
from .c.passive_limits import limited_variables
from .described_parts import robot_template
from .described_springs import load_template
from .emitter import Files

LINE = 100
"""Maximum length of a line of JSON (characters)."""


def manifest(
    derivation: Derivation,
    programs: Programs,
    files: Mapping[str, Files],
) -> str:
    """Return the manifest as JSON. The manifest contains no date, host or path.

    Args:
        derivation: The derivation of the robot.
        programs: The expression graphs of the robot's functions, from which the operations are
            counted.
        files: The generated files of each output language, whose hashes the manifest lists.
    """
    robot, hybrid = derivation.robot, derivation.hybrid
    found = Manifest(
        format=FORMAT,
        name=robot.name,
        title=robot.title,
        kind=_kind(hybrid),
        source=robot.source,
        coordinates=tuple(_coordinate(joint) for joint in robot.coordinates),
        frames=Frames(robot.base_frame, robot.tool_frame, tuple(robot.link_names)),
        parameters=tuple(_parameter(parameter) for parameter in robot.parameters),
        notes=_notes(derivation),
        cleaning=_cleaning(robot.cleaning),
        geometry=_geometry(derivation),
        robot_file=_robot_file(derivation),
        functions=(
            *(_function(robot, f, programs.whole[f.name]) for f in derivation.functions),
            *(_written(robot, function) for function in derivation.written),
        ),
        loops=_loops(derivation, hybrid) if hybrid else _coupling(derivation),
        inverse=_inverse(derivation),
        skeleton=skeleton_facts(derivation.skeleton),
        load=_load(derivation),
        tolerances=ContractTolerances(DEAD_POINT),
        description_sha256=sha256(description_text(robot)),
        languages={language: tuple(sorted(texts)) for language, texts in sorted(files.items())},
        files={name: sha256(text) for name, text in sorted(_together(files).items())},
        versions={"casadi": ca.CasadiMeta.version(), "sympy": sp.__version__},
    )
    return json_text(manifest_entries(found)) + "\n"


def _notes(derivation: Derivation) -> tuple[str, ...]:
    hybrid, found = derivation.hybrid, [*derivation.robot.notes]
    if hybrid:
        found += mobility_of(hybrid.numbers, equations(hybrid)).disagreements
        found += hybrid.missing.values()
        found += [*limits_of(hybrid), *doubts_of(hybrid)]
    if derivation.inverse:
        found += notes(derivation.inverse)
    return tuple(found)


def _together(files: Mapping[str, Files]) -> dict[str, str]:
    return {name: text for texts in files.values() for name, text in texts.items()}


def description_text(robot: Described) -> str:
    """Return the complete description of a robot as text.

    The text omits empty fields of the description, so that new fields do not change the text of
    other robots.
    """
    own: tuple[object, ...]
    if isinstance(robot, SerialRobot):
        own = (robot.springs, robot.couplings, robot.motors)
    else:
        own = (tuple(strut.name for strut in robot.struts if strut.has_universal),)
    parts = (robot, *(part for part in (robot.load, robot.transmissions, *own) if part))
    return " ".join(map(repr, parts))


def sha256(text: str) -> str:
    """Return the hexadecimal SHA-256 of a text in UTF-8."""
    return hashlib.sha256(text.encode()).hexdigest()


def _kind(hybrid: SolvedLoops | None) -> str:
    """Return the kind of a robot, one of `chasles.contract.KINDS`."""
    if hybrid is None:
        return "serial"
    if not hybrid.forward.open:
        return "hybrid"
    actuated = {coordinate.moves for coordinate in hybrid.mechanism.coordinates}
    backward = (from_chain_with_arms(hybrid) or hybrid).backward
    return "platform" if actuated.isdisjoint(backward.open) else "iterated"


def _cleaning(cleaning: Cleaning) -> contract.Cleaning:
    if not cleaning.numbers:
        return contract.Cleaning()
    numbers = (
        CleanedNumber(n.at, n.field, written(n.found), sp.sstr(n.taken)) for n in cleaning.numbers
    )
    return contract.Cleaning(cleaning.position, cleaning.orientation, tuple(numbers))


def _load(derivation: Derivation) -> contract.Load:
    """Return the link masses and the gravity vector of a robot as numbers."""
    load = derivation.robot.load
    if load is None:
        return contract.Load()

    def number(entry: sp.Expr) -> float:
        return float(derivation.terms.value(entry))

    masses = (LinkMass(m.link, number(m.mass), tuple(map(number, m.at))) for m in load.masses)
    return contract.Load(tuple(masses), tuple(map(number, load.gravity)))


def _geometry(derivation: Derivation) -> tuple[GeometryParameter, ...]:
    if derivation.geometry is None:
        return ()
    return tuple(
        GeometryParameter(
            parameter.name,
            float(derivation.terms.value(parameter.value)),
            parameter.unit,
            parameter.joint,
            parameter.part,
            parameter.meaning,
        )
        for parameter in derivation.geometry.parameters
    )


def _robot_file(derivation: Derivation) -> str:
    if derivation.geometry is None:
        return ""
    loops = derivation.parametric_loops
    return robot_template(loops.hybrid) if loops else load_template(derivation.robot)


def _inverse(derivation: Derivation) -> InverseFacts:
    inverse, hybrid = derivation.inverse, derivation.hybrid
    if inverse is None:
        names = {f.name for f in (*derivation.functions, *derivation.written)}
        reason = missing(hybrid) if hybrid and "ik" not in names else ""
        return InverseFacts("none", reason) if reason else InverseFacts()
    method = "general" if inverse.general else inverse.classification.method
    return InverseFacts(method, inverse.missing)


def _loops(derivation: Derivation, hybrid: SolvedLoops) -> LoopFacts:
    mechanism = hybrid.mechanism
    names = [variable.name for variable in hybrid.variables]
    units = {variable.name: variable.unit for variable in hybrid.variables}
    at = hybrid.at_reference
    return LoopFacts(
        chain=tuple(_coordinate(joint) for joint in mechanism.main_chain.moving),
        passive=tuple(Variable(name, units[name]) for name in mechanism.passive),
        configuration=tuple(Variable(name, units[name]) for name in names),
        names=tuple(loop_joint.name for loop_joint in mechanism.loop_joints),
        reference=Reference(
            tuple(_rounded(value) for value in hybrid.q_at_reference.tolist()),
            tuple(_rounded(at[name]) for name in names),
        ),
        actuated_in_z=tuple(
            ActuatedVariable(names.index(c.moves), float(hybrid.terms.value(c.ratio)))
            for c in mechanism.coordinates
        ),
        solution="newton" if hybrid.forward.open else "closed form",
        joint_couplings=joint_couplings(mechanism, names),
        limited=limited_variables(derivation),
    )


def _coupling(derivation: Derivation) -> LoopFacts:
    robot = derivation.robot
    if not isinstance(robot, SerialRobot) or not robot.couplings:
        return LoopFacts()
    C = robot.linear_map.C
    rows = tuple(tuple(float(entry) for entry in C.row(j)) for j in range(C.rows))
    return LoopFacts(chain=tuple(map(_coordinate, robot.moving)), coupling=rows)


def _rounded(value: float) -> float:
    return float(f"{value:.12g}") + 0.0


def _coordinate(joint: Coordinate | Joint | Motor) -> contract.Coordinate:
    lower, upper = (None if limit is None else float(limit) for limit in joint.limits)
    return contract.Coordinate(joint.name, joint.kind, joint.unit, lower, upper, _is_assumed(joint))


def _is_assumed(joint: Coordinate | Joint | Motor) -> bool:
    return joint.assumed if isinstance(joint, Coordinate) else "limits" in joint.assumed


def _parameter(parameter: Parameter) -> contract.Parameter:
    return contract.Parameter(
        parameter.name,
        float(parameter.value),
        sp.sstr(parameter.value),
        UNITS[parameter.kind],
        parameter.meaning,
        parameter.assumed,
    )


def _function(robot: Described, function: SymbolicFunction, program: Program) -> FunctionInfo:
    counted = count_operations(program).as_dict()
    called = sum(call.operations for call in function.calls)
    for kind in ("other", "total"):
        counted[kind] += called
    return _info(robot, function, counted)


def _written(robot: Described, function: NativeSolverFunction) -> FunctionInfo:
    return _info(robot, function, {"other": function.operations, "total": function.operations})


def _info(
    robot: Described,
    function: SymbolicFunction | NativeSolverFunction,
    operations: Mapping[str, int],
) -> FunctionInfo:
    return FunctionInfo(
        name=function.name,
        symbol=f"{robot.name}_{function.name}",
        summary=function.summary,
        identity=function.identity,
        role=function.role,
        inputs=tuple(_argument(argument) for argument in function.inputs),
        outputs=tuple(_argument(result) for result in function.outputs),
        operations=operations,
        margin=function.margin,
        steps=tuple(function.steps),
    )


def _argument(value: Argument | Result) -> contract.Argument:
    return contract.Argument(value.name, tuple(value.shape), value.unit, value.meaning)


def json_text(value: Any, depth: int = 0) -> str:
    """Format data as JSON.

    Lists and dictionaries that fit into a line stay on one line.

    Args:
        value: Data that consist of dictionaries, lists, texts, numbers, booleans and None.
        depth: Indentation in spaces.
    """
    line = json.dumps(value, ensure_ascii=False)
    if len(line) + depth <= LINE or not isinstance(value, dict | list):
        return line
    if isinstance(value, dict):
        parts = [f"{json.dumps(key)}: {json_text(part, depth + 1)}" for key, part in value.items()]
    else:
        parts = [json_text(part, depth + 1) for part in value]
    begin, end = "{}" if isinstance(value, dict) else "[]"
    within = ",\n".join(" " * (depth + 1) + part for part in parts)
    return f"{begin}\n{within}\n{' ' * depth}{end}"


def skeleton_facts(found: Skeleton) -> SkeletonFacts:
    """Return the bodies of a robot in meters and radians.

    The pose of each body is a matrix with three rows.

    Args:
        found: The bodies of the robot, with their shapes.
    """
    return SkeletonFacts(
        float(f"{found.size:.6g}"),
        PlacedTip(found.tip, pose_rows(found.tip_placement)),
        tuple(_body(body, shapes) for body, shapes in zip(found.bodies, found.shapes, strict=True)),
        tuple(found.q_drawn),
        found.closures,
    )


def _body(body: TreeBody, shapes: tuple[Shape, ...]) -> Body:
    if body.joint is not None:
        is_fixed = body.joint.kind == "fixed"
        joint = BodyJoint(body.joint.name, "fixed") if is_fixed else body.joint
        return Body(body.name, body.parent, pose_rows(body.placement), joint, shapes=shapes)
    return Body(body.name, span=body.span, shapes=shapes)
