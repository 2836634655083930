"""The manifest: what a generated robot says of itself, for the runtime and for people."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from typing import Any

import casadi as ca
import sympy as sp

from .function import Argument, Result, SymbolicFunction
from .lower import count_operations
from .robot import UNITS, Joint, Parameter, Robot

FORMAT = 1


def manifest(
    robot: Robot,
    functions: Sequence[SymbolicFunction],
    lowered: Sequence[ca.Function],
    files: Mapping[str, str],
) -> str:
    """The manifest as JSON: no date, host or path, so that equal robots give equal bytes.

    Args:
        robot: The description.
        functions: What was derived.
        lowered: The same, lowered, for the operation counts.
        files: Name and text of every other generated file, for their hashes.
    """
    content = {
        "chasles": FORMAT,
        "name": robot.name,
        "title": robot.title,
        "source": robot.source,
        "coordinates": [_coordinate(joint) for joint in robot.coordinates],
        "frames": {
            "base": robot.base_frame,
            "tip": robot.tool_frame,
            "links": list(robot.link_names),
        },
        "parameters": [_parameter(parameter) for parameter in robot.parameters],
        "notes": list(robot.notes),
        "functions": [
            _function(robot, function, kernel)
            for function, kernel in zip(functions, lowered, strict=True)
        ],
        "description_sha256": sha256(repr(robot)),
        "files": {name: sha256(text) for name, text in sorted(files.items())},
        "versions": {package: version(package) for package in ("casadi", "sympy")},
    }
    return json.dumps(content, indent=1, ensure_ascii=False) + "\n"


def sha256(text: str) -> str:
    """SHA-256 of a text in UTF-8, in hexadecimal."""
    return hashlib.sha256(text.encode()).hexdigest()


def _coordinate(joint: Joint) -> dict[str, Any]:
    lower, upper = (None if limit is None else float(limit) for limit in joint.limits)
    return {
        "name": joint.name,
        "kind": joint.kind,
        "unit": joint.unit,
        "lower": lower,
        "upper": upper,
    }


def _parameter(parameter: Parameter) -> dict[str, Any]:
    return {
        "name": parameter.name,
        "value": float(parameter.value),
        "exact": sp.sstr(parameter.value),
        "unit": UNITS[parameter.kind],
        "meaning": parameter.meaning,
    }


def _function(robot: Robot, function: SymbolicFunction, kernel: ca.Function) -> dict[str, Any]:
    return {
        "name": function.name,
        "symbol": f"{robot.name}_{function.name}",
        "summary": function.summary,
        "identity": function.identity,
        "inputs": [_described(argument) for argument in function.inputs],
        "outputs": [_described(result) for result in function.outputs],
        "operations": count_operations(kernel).as_dict(),
    }


def _described(what: Argument | Result) -> dict[str, Any]:
    return {
        "name": what.name,
        "shape": list(what.shape),
        "unit": what.unit,
        "meaning": what.meaning,
    }
