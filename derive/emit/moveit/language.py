"""Writes a ROS 2 package with the generated C and a kinematics plugin for MoveIt 2."""

from collections.abc import Collection, Sequence
from importlib.metadata import version
from pathlib import Path

from ...derivation import Derivation
from ...model.errors import InputValueError
from ...model.mechanism import Mechanism
from ...model.robot import Joint
from ...program.programs import Programs
from ...terms.symbolic_function import Signature
from ..c import language as c
from ..ros2_control.joint_maps import EXAMPLE, MAPS, chain, has_maps, map_files
from ..templates import filled
from .plugin import plugin_values

SUPPORT = Path(__file__).parent / "support"
TEMPLATES = {
    "package.xml": "package.xml",
    "CMakeLists.txt": "CMakeLists.txt",
    "plugin.xml": "plugin.xml",
    "README.md": "README.md",
    "config/kinematics.yaml": "kinematics.yaml",
    "src/plugin.cpp": "plugin.cpp.in",
}
SHARED = ("solver.hpp", "solver.cpp", "solver_setup.cpp")
"""Files that are the same for every robot except for the namespace."""


def files(derivation: Derivation, programs: Programs) -> dict[str, str]:
    """Returns the files of the package, keyed by path.

    Raises:
        InputValueError: The robot lacks a function that the plugin needs.
    """
    name = derivation.robot.name
    inverse = _inverse(derivation)
    every = c.files(derivation, programs)
    in_c = {file: text for file, text in every.items() if "_batch." not in file}
    package = f"chasles_{name}_moveit"
    folders = {file: f"include/{package}" if file == f"{name}.h" else "src" for file in in_c}
    maps = map_files(derivation, inverse, package)
    values = {
        "robot": name,
        "title": derivation.robot.title,
        "version": version("chasles"),
        "sources": " ".join(f"src/{file}" for file in in_c if file.endswith(".c")),
        "base": derivation.robot.base_frame,
        "tip": derivation.robot.tool_frame,
        "maps": _listed_maps(package, maps),
        **plugin_values(derivation, inverse, _joints(derivation)),
    }
    shared = {file: (SUPPORT / file).read_text(encoding="utf-8") for file in SHARED}
    return {
        **{f"{folders[file]}/{file}": text for file, text in in_c.items()},
        **{file: filled(SUPPORT / template, values) for file, template in TEMPLATES.items()},
        **{f"src/{f}": t.replace("chasles_robot_moveit", package) for f, t in shared.items()},
        **maps,
    }


def _joints(derivation: Derivation) -> Sequence[Joint]:
    robot = derivation.robot
    if isinstance(robot, Mechanism) or not robot.couplings:
        return chain(derivation)
    leaders = [c for c in robot.coordinates if isinstance(c, Joint)]
    coupled = {rule.joint for rule in robot.couplings}
    is_mimicry = len(leaders) == len(robot.coordinates) and coupled.isdisjoint(
        joint.name for joint in leaders
    )
    return leaders if is_mimicry else chain(derivation)


def _names(derivation: Derivation) -> set[str]:
    return {function.name for function in (*derivation.functions, *derivation.written)}


def _inverse(derivation: Derivation) -> Signature:
    found = (*derivation.functions, *derivation.written)
    inverse = next((f for f in found if f.role.is_inverse and f.role.domain == "pose"), None)
    needs_maps = list(_joints(derivation)) != list(derivation.robot.coordinates)
    missing = [] if inverse else ["an inverse of poses"]
    missing += [] if "fk" in _names(derivation) else ["fk"]
    missing += [] if has_maps(derivation) or not needs_maps else [", ".join(MAPS)]
    if inverse is None or missing:
        name = derivation.robot.name
        raise InputValueError(f"{name}: a plugin of MoveIt needs {' and '.join(missing)}")
    return inverse


def _listed_maps(package: str, maps: Collection[str]) -> str:
    lines = []
    if any(file.endswith("joints.hpp") for file in maps):
        lines.append(
            f"- `include/{package}/joints.hpp`: actuators to joints and back, and `/joint_states`."
        )
    if EXAMPLE in maps:
        lines.append(f"- `{EXAMPLE}`: actuators behind the joints of ros2_control.")
    return "".join(f"{line}\n" for line in lines)
