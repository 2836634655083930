"""A self-contained HTML page that shows a robot: skeleton, sliders and three.js."""

from __future__ import annotations

import base64
import html
import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from string import Template
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chasles import Robot
from chasles.contract import check_type, output_file

from ..drawing import Skeleton
from .display import Display, Displayed
from .escaping import script_json
from .slider_units import SliderUnit, slider_units
from .solids import Solid

FloatArray = NDArray[np.float64]

_HERE = Path(__file__).parent
_PARTS = {
    "style": "page/page.css",
    "three": "three/three.min.js",
    "orbit": "three/OrbitControls.js",
    "kinematics": "page/kinematics.js",
    "inverse": "page/inverse.js",
    "handle": "page/handle.js",
    "ghosts": "page/ghosts.js",
    "scene": "page/scene.js",
}


def write_html(robot: Robot, path: str | os.PathLike[str]) -> None:
    """Write a self-contained HTML page on which the robot follows sliders for its coordinates.

    The page computes the passive joints of loops by Gauss-Newton iteration from the previous
    configuration, so that loops stay on the same branch. If a loop does not close, the robot keeps
    the last closed configuration.

    Args:
        robot: The robot, from `chasles.load`.
        path: The HTML file to write.

    Raises:
        ManifestError: The robot was derived by an earlier version of chasles. Derive it again.
    """
    check_type("write_html: robot", robot, Robot)
    parts = {name: (_HERE / file).read_text(encoding="utf-8") for name, file in _PARTS.items()}
    data = script_json(page_data(robot))
    page = Template((_HERE / "page/page.html").read_text(encoding="utf-8"))
    title, source = html.escape(robot.title), html.escape(robot.source)
    text = page.substitute(parts, title=title, source=source, robot=data)
    with output_file(path) as target:
        target.write_text(text, encoding="utf-8")


def page_data(robot: Robot) -> dict[str, Any]:
    """Return the data for the scripts of the page.

    Args:
        robot: The robot.

    Returns:
        Lengths are in meters, and angles in radians. Poses are 16 numbers in row order.
    """
    display = Display(robot)
    skeleton, start = display.skeleton, display.start
    units = slider_units(robot, start.q)
    return {
        "name": robot.name,
        "size": skeleton.size,
        "z": start.z.tolist(),
        "scales": _scales(robot, skeleton),
        "sliders": [_slider(robot, skeleton, k, unit) for k, unit in enumerate(units)],
        "bodies": _bodies(skeleton),
        "struts": _struts(skeleton, start),
        "closures": _closures(skeleton),
        "couplings": _couplings(robot, start.z, _scales(robot, skeleton), skeleton.size),
        "tool": {"body": skeleton.tip, "placement": skeleton.tip_placement.ravel().tolist()},
        "surfaces": [_surface(solid, display.moved) for solid in display.solids],
    }


def _scales(robot: Robot, skeleton: Skeleton) -> list[float]:
    """Return the scale of each entry of z: 1 rad for an angle, the robot size for a length."""
    variables = robot.configuration_variables or robot.coordinates
    return [1.0 if variable.unit == "rad" else skeleton.size for variable in variables]


def _slider(robot: Robot, skeleton: Skeleton, k: int, unit: SliderUnit) -> dict[str, Any]:
    index = next(i for i, own in skeleton.actuators.items() if own == k)
    ratio = robot.manifest.loops.actuated_in_z[k].ratio if robot.configuration_variables else 1.0
    limits = [float(robot.lower[k]), float(robot.upper[k])]
    return {
        "name": unit.name,
        "unit": unit.unit,
        "factor": unit.factor,
        "lower": unit.lower,
        "upper": unit.upper,
        "limits": [end if math.isfinite(end) else None for end in limits],
        "index": index,
        "ratio": ratio,
    }


def _bodies(skeleton: Skeleton) -> list[dict[str, Any]]:
    found = []
    for body in skeleton.bodies:
        placement = np.eye(4)
        placement[: len(body.placement)] = np.reshape(body.placement, (-1, 4))
        joint, span = body.joint, body.span
        found.append(
            {
                "name": body.name,
                "parent": body.parent,
                "placement": placement.ravel().tolist(),
                "joint": joint and {name: getattr(joint, name) for name in _JOINT},
                "span": span and {name: getattr(span, name) for name in _SPAN},
            }
        )
    return found


_JOINT = ("kind", "at", "axis", "coordinate", "ratio", "offset", "advance")
_SPAN = ("bodies", "ends", "across", "from_end")


def _struts(skeleton: Skeleton, start: Displayed) -> list[dict[str, Any]]:
    """Return each strut once, with its length at coordinate 0."""
    names = [variable.name for variable in skeleton.robot.configuration_variables]
    spans = {body.span.name: body.span for body in skeleton.bodies if body.span}
    found = []
    for name, span in spans.items():
        k = names.index(name) if name in names else -1
        a, b = (
            start.bodies[body, :3, :3] @ end + start.bodies[body, :3, 3]
            for body, end in zip(span.bodies, span.ends, strict=True)
        )
        length = float(np.linalg.norm(b - a)) - (start.z[k] if k >= 0 else 0.0)
        found.append({"bodies": span.bodies, "ends": span.ends, "coordinate": k, "length": length})
    return found


def _closures(skeleton: Skeleton) -> list[dict[str, Any]]:
    return [
        {
            "kind": closure.kind,
            "bodies": closure.bodies,
            "frames": [[*np.ravel(frame).tolist(), 0, 0, 0, 1] for frame in closure.frames],
        }
        for closure in skeleton.closures
    ]


def _couplings(
    robot: Robot, z: NDArray[np.float64], scales: Sequence[float], size: float
) -> list[dict[str, Any]]:
    found = []
    for row in robot.manifest.loops.joint_couplings:
        factors = np.array(row) * size / np.abs(np.array(row) * scales).max()
        found.append({"factors": factors.tolist(), "total": float(factors @ z)})
    return found


def _surface(solid: Solid, moved: Mapping[str, int]) -> dict[str, Any]:
    red, green, blue = solid.colour
    return {
        "body": solid.body,
        "moves": moved.get(solid.joint),
        "colour": f"#{red:02x}{green:02x}{blue:02x}",
        "vertices": _encoded(solid.triangles.vertices.astype("<f4")),
        "faces": _encoded(solid.triangles.faces.astype("<u2")),
    }


def _encoded(values: NDArray[Any]) -> str:
    return base64.b64encode(values.tobytes()).decode("ascii")
