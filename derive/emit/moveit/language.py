"""Writes a ROS 2 package with the generated C++ and a kinematics plugin for MoveIt 2."""

from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

from ...derivation import Derivation
from ...model.errors import InputValueError
from ...model.robot import Joint, SerialRobot
from ...program.programs import Programs
from ...terms.symbolic_function import Signature
from ..cpp import language as cpp
from ..reserved import safe
from ..ros2_control.joint_maps import MAPS, chain, has_maps, map_files
from ..seeds import seed_inputs, wraps_of
from ..templates import filled

SUPPORT = Path(__file__).parent / "support"


def files(derivation: Derivation, programs: Programs) -> dict[str, str]:
    """Return the files of the ROS 2 package, keyed by path.

    Raises:
        InputValueError: The robot lacks a function that the plugin needs, or an input of its
            inverse kinematics is neither a joint value nor a swivel angle.
    """
    robot, package = derivation.robot, f"chasles_{derivation.robot.name}_moveit"
    inverse = _inverse(derivation)
    generated = {
        file.replace("include/chasles/", f"include/{package}/"): text
        for file, text in cpp.files(derivation, programs).items()
        if file.startswith(("include/", "src/")) and "_batch." not in file
    }
    values = {
        "robot": robot.name,
        "namespace": safe(robot.name),
        "title": robot.title,
        "version": version("chasles"),
        "sources": " ".join(file for file in generated if file.endswith(".c")),
        "base": robot.base_frame,
        "tip": robot.tool_frame,
        **_constants(derivation, inverse),
        **_calls(derivation, inverse),
    }
    return {
        **generated,
        **{
            path.relative_to(SUPPORT).as_posix().removesuffix(".in"): filled(path, values)
            for path in sorted(SUPPORT.rglob("*.*"))
        },
        **map_files(derivation, inverse, package),
    }


def _inverse(derivation: Derivation) -> Signature:
    functions = (*derivation.functions, *derivation.written)
    inverse = next((f for f in functions if f.role.is_inverse and f.role.domain == "pose"), None)
    missing = [] if inverse else ["an inverse of poses"]
    missing += [] if "fk" in {function.name for function in functions} else ["fk"]
    missing += [] if has_maps(derivation) or _is_direct(derivation) else [", ".join(MAPS)]
    if inverse is None or missing:
        name = derivation.robot.name
        raise InputValueError(f"{name}: a MoveIt plugin requires {' and '.join(missing)}")
    return inverse


def _joints(derivation: Derivation) -> Sequence[Joint]:
    """Return the joints of the planning group, without joints that follow other joints."""
    robot = derivation.robot
    own = [coordinate for coordinate in robot.coordinates if isinstance(coordinate, Joint)]
    is_complete = isinstance(robot, SerialRobot) and len(own) == len(robot.coordinates)
    return own if is_complete else chain(derivation)


def _is_direct(derivation: Derivation) -> bool:
    """Whether the joints of the planning group are the coordinates of the robot."""
    return list(_joints(derivation)) == list(derivation.robot.coordinates)


def _constants(derivation: Derivation, inverse: Signature) -> dict[str, str]:
    joints, hybrid = _joints(derivation), derivation.hybrid
    wraps = wraps_of(derivation) if _is_direct(derivation) else [True] * len(joints)
    turns = [w and j.kind == "revolute" for w, j in zip(wraps, joints, strict=True)]
    reference = hybrid.at_reference if hybrid else dict.fromkeys((j.name for j in joints), 0.0)
    return {
        "joints": str(len(joints)),
        "count": str(len(inverse.inputs) - 1),
        "slots": str(inverse.outputs[0].shape[0]),
        "periods": ", ".join("CHASLES_FULL_TURN" if turn else "0" for turn in turns),
        "reference": ", ".join(repr(round(reference[joint.name], 9)) for joint in joints),
        "reach": "0.01" if hybrid else "1",
    }


def _calls(derivation: Derivation, inverse: Signature) -> dict[str, str]:
    """Return the C++ expressions that call functions of the robot."""
    own, names = seed_inputs(derivation, inverse), [joint.name for joint in _joints(derivation)]
    inputs, moving = [v.name for v in inverse.inputs[1:]], [j.name for j in chain(derivation)]
    is_swivel = own is not None and own.function in own.names
    redundant = [moving[k] for k in own.entries] if own and not is_swivel else []
    if own is None or not set(redundant) <= set(names):
        raise InputValueError(
            f"{derivation.robot.name}: a MoveIt plugin cannot sample {', '.join(inputs)}"
        )
    indices = [names.index(joint) for joint in redundant]
    coordinates = "theta" if _is_direct(derivation) else "robot::actuators(theta)"
    sampled = [f"robot::{own.function}({coordinates})"] if is_swivel else []
    return {
        "coordinates": coordinates,
        "theta": "q" if _is_direct(derivation) else "robot::chain(q)",
        "redundant": ", ".join(map(str, indices)),
        "inputs": ", ".join([*sampled, *(f"theta[{k}]" for k in indices)]),
        "inverse": safe(inverse.name),
        "arguments": ", ".join(["T", *(f"inputs[{k}]" for k in range(len(inputs)))]),
    }
