"""The manifest: the facts of a generated robot in fields, for the runtime and for people."""

import hashlib
from collections.abc import Mapping
from typing import Any

import casadi as ca
import sympy as sp

from ..derivation import Derivation
from ..inverse.explanation import notes
from ..inverse.serial_inverse import Inverses
from ..loops.checks.closable import doubts_of, limits_of
from ..loops.hybrid import Hybrid
from ..model.cleaning import Cleaning, written
from ..model.mechanism import Coordinate, Described
from ..model.robot import UNITS, Joint, Parameter, Robot
from ..model.tolerances import DEAD_POINT
from ..program.counting import count_operations
from ..program.operations import Program
from ..program.programs import Programs
from ..terms.role import Role
from ..terms.symbolic_function import Argument, Result, Signature, SymbolicFunction, WrittenFunction
from .described_parts import robot_template
from .described_springs import springs_template
from .emitter import Files
from .json_text import json_text
from .skeleton_entry import skeleton_entry

FORMAT = 2


def manifest(
    derivation: Derivation,
    programs: Programs,
    files: Mapping[str, Files],
) -> str:
    """The manifest as JSON, without date, host or path, so that equal robots give equal bytes.

    Args:
        derivation: The derivation of the robot.
        programs: The programs of its functions, for the operation counts.
        files: The files of each language, by the language's name; the manifest lists their hashes.
    """
    robot, hybrid = derivation.robot, derivation.hybrid
    content = {
        "chasles": FORMAT,
        "name": robot.name,
        "title": robot.title,
        "kind": _kind(hybrid),
        "source": robot.source,
        "coordinates": [_coordinate(joint) for joint in robot.coordinates],
        "frames": {
            "base": robot.base_frame,
            "tip": robot.tool_frame,
            "links": list(robot.link_names),
        },
        "parameters": [_parameter(parameter) for parameter in robot.parameters],
        "notes": [
            *robot.notes,
            *(hybrid.mobility.disagreements if hybrid else ()),
            *(hybrid.missing.values() if hybrid else ()),
            *(limits_of(hybrid) if hybrid else ()),
            *(doubts_of(hybrid) if hybrid else ()),
            *(notes(derivation.inverse) if derivation.inverse else ()),
        ],
        **_cleaning(robot.cleaning),
        **_geometry(derivation),
        "functions": [
            _function(robot, function, programs.whole[function.name])
            for function in derivation.functions
        ]
        + [_written(robot, function) for function in derivation.written],
        **({} if hybrid is None else _loops(hybrid)),
        **({} if derivation.inverse is None else _inverse(derivation.inverse)),
        "skeleton": skeleton_entry(derivation.skeleton),
        "tolerances": {"dead_point": DEAD_POINT},
        "description_sha256": sha256(description_text(robot)),
        "languages": {language: sorted(texts) for language, texts in sorted(files.items())},
        "files": {name: sha256(text) for name, text in sorted(_together(files).items())},
        "versions": {"casadi": ca.CasadiMeta.version(), "sympy": sp.__version__},
    }
    return json_text(content) + "\n"


def _together(files: Mapping[str, Files]) -> dict[str, str]:
    """The files of all languages in one dictionary, by file name."""
    return {name: text for texts in files.values() for name, text in texts.items()}


def description_text(robot: Described) -> str:
    """The description as text; load, transmissions and springs are named where there are any."""
    load, springs = (robot.load, robot.springs) if isinstance(robot, Robot) else (None, None)
    parts = (robot, *(part for part in (load, robot.transmissions, springs) if part))
    return " ".join(map(repr, parts))


def sha256(text: str) -> str:
    """SHA-256 of a text in UTF-8, in hexadecimal."""
    return hashlib.sha256(text.encode()).hexdigest()


def _kind(hybrid: Hybrid | None) -> str:
    """The kind of a robot: the way from the actuated coordinates to the tool's pose.

    "serial": the joints are the actuated coordinates. "hybrid": loops are solved in closed form.
    "platform": the runtime solves the loops by iteration, while the actuated coordinates follow
    from the main chain in closed form. "iterated": both directions need iteration.
    """
    if hybrid is None:
        return "serial"
    if not hybrid.forward.open:
        return "hybrid"
    actuated = {coordinate.moves for coordinate in hybrid.mechanism.coordinates}
    return "platform" if actuated.isdisjoint(hybrid.backward.open) else "iterated"


def _cleaning(cleaning: Cleaning) -> dict[str, Any]:
    """The numbers that were not taken as written, and bounds of their effect on the tool's pose."""
    if not cleaning.numbers:
        return {}
    numbers = [
        {"at": n.at, "field": n.field, "found": written(n.found), "taken": sp.sstr(n.taken)}
        for n in cleaning.numbers
    ]
    bounds = {"position": cleaning.position, "orientation": cleaning.orientation}
    return {"cleaning": {**bounds, "numbers": numbers}}


def _geometry(derivation: Derivation) -> dict[str, Any]:
    """The parameters p, where the robot has parametric functions."""
    if derivation.geometry is None:
        return {}
    parameters = [
        {
            "name": parameter.name,
            "value": float(derivation.terms.value(parameter.value)),
            "unit": parameter.unit,
            "of": parameter.of,
            "part": parameter.part,
            "meaning": parameter.meaning,
        }
        for parameter in derivation.geometry.parameters
    ]
    loops = derivation.parametric_loops
    template = robot_template(loops.hybrid) if loops else springs_template(derivation.robot)
    file = {"robot_file": template} if template else {}
    return {"geometry": parameters, **file}


def _inverse(inverse: Inverses) -> dict[str, Any]:
    """The tier of the inverse, or the reason why there is none."""
    tier = "general" if inverse.general else inverse.classification.tier
    return {"inverse": {"tier": tier, "missing": inverse.missing}}


def _loops(hybrid: Hybrid) -> dict[str, Any]:
    """The loops of a robot: their variables, their reference and how they are solved."""
    mechanism = hybrid.mechanism
    names = [variable.name for variable in hybrid.variables]
    units = {variable.name: variable.unit for variable in hybrid.variables}
    at = hybrid.at_reference
    # The runtime takes passive joints that are iterated from the configuration.
    iterated = [variable.name for variable in hybrid.passive_in_loops]
    passive = iterated if hybrid.forward.open else mechanism.passive
    return {
        "chain": [_coordinate(joint) for joint in mechanism.main_chain.moving],
        "passive": [{"name": name, "unit": units.get(name, "rad")} for name in passive],
        "configuration": [{"name": name, "unit": units[name]} for name in names],
        "loops": [closer.name for closer in mechanism.closers],
        "reference": {
            "q": [_rounded(value) for value in hybrid.q_at_reference.tolist()],
            "z": [_rounded(at[name]) for name in names],
        },
        "actuated_in_z": [
            {"index": names.index(c.moves), "ratio": float(hybrid.terms.value(c.ratio))}
            for c in mechanism.coordinates
        ],
        "solution": "newton" if hybrid.forward.open else "closed form",
    }


def _rounded(value: float) -> float:
    """A number rounded to the digits that agree on every machine."""
    return float(f"{value:.12g}") + 0.0


def _coordinate(joint: Coordinate | Joint) -> dict[str, Any]:
    lower, upper = (None if limit is None else float(limit) for limit in joint.limits)
    return {
        "name": joint.name,
        "kind": joint.kind,
        "unit": joint.unit,
        "lower": lower,
        "upper": upper,
        **({"assumed": True} if _is_assumed(joint) else {}),
    }


def _is_assumed(joint: Coordinate | Joint) -> bool:
    """Whether the limits are assumed."""
    return joint.assumed if isinstance(joint, Coordinate) else "limits" in joint.assumed


def _parameter(parameter: Parameter) -> dict[str, Any]:
    return {
        "name": parameter.name,
        "value": float(parameter.value),
        "exact": sp.sstr(parameter.value),
        "unit": UNITS[parameter.kind],
        "meaning": parameter.meaning,
        **({"assumed": True} if parameter.assumed else {}),
    }


def _function(robot: Described, function: SymbolicFunction, program: Program) -> dict[str, Any]:
    return {
        **_signature(robot, function),
        "operations": count_operations(program).as_dict(),
        **_guard(function),
    }


def _guard(function: SymbolicFunction | WrittenFunction) -> dict[str, Any]:
    """The name of the guard of a function, and the loops of a guard."""
    return {
        **({"margin": function.margin} if function.margin else {}),
        **({"steps": list(function.steps)} if function.steps else {}),
    }


def _written(robot: Described, function: WrittenFunction) -> dict[str, Any]:
    """The entry of a handwritten function; the kinds of its operations depend on the pose."""
    operations = {"other": function.operations, "total": function.operations}
    return {**_signature(robot, function), "operations": operations, **_guard(function)}


def _signature(robot: Described, function: Signature) -> dict[str, Any]:
    return {
        "name": function.name,
        "symbol": f"{robot.name}_{function.name}",
        "summary": function.summary,
        "identity": function.identity,
        **_role(function.role),
        "inputs": [_described(argument) for argument in function.inputs],
        "outputs": [_described(result) for result in function.outputs],
    }


def _role(role: Role) -> dict[str, Any]:
    """The role of a function; fields without a value are left out."""
    fields = {
        "domain": role.domain,
        "codomain": role.codomain,
        "given": list(role.given),
        "labels": list(role.labels),
        "directions": list(role.directions),
        "aims": list(role.aims),
        "held": list(role.held),
        "searches": role.searches,
    }
    return {"role": role.name, **{key: value for key, value in fields.items() if value}}


def _described(value: Argument | Result) -> dict[str, Any]:
    return {
        "name": value.name,
        "shape": list(value.shape),
        "unit": value.unit,
        "meaning": value.meaning,
    }
