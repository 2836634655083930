"""Writes a C++ header that converts between actuators and joints."""

from collections.abc import Sequence
from pathlib import Path

from ...derivation import Derivation
from ...model.mechanism import Mechanism
from ...model.robot import Joint
from ...terms.symbolic_function import Signature
from ..seeds import seeded
from ..templates import filled

SUPPORT = Path(__file__).parent / "support"
MAPS = ("chain", "chain_D_q", "chain_rates", "actuators", "actuators_D_chain", "actuator_rates")
"""Functions that convert between actuators and joints."""
EXAMPLE = "examples/hardware.cpp"
"""Path of the example in the ROS 2 package."""


def chain(derivation: Derivation) -> Sequence[Joint]:
    """Return the moving joints from the base to the tool."""
    robot = derivation.robot
    return robot.main_chain.moving if isinstance(robot, Mechanism) else robot.moving


def has_maps(derivation: Derivation) -> bool:
    """Whether the robot has all functions that the header calls."""
    further = {"configuration"} if derivation.hybrid else set()
    functions = (*derivation.functions, *derivation.written)
    return {*MAPS, *further} <= {function.name for function in functions}


def map_files(derivation: Derivation, inverse: Signature, package: str) -> dict[str, str]:
    """Return the header and the example, keyed by path.

    The result is {} if the robot lacks a function that converts between actuators and joints.

    Args:
        derivation: The derivation of the robot.
        inverse: The inverse kinematics function that the example calls.
        package: The package name, which is also the C++ namespace.
    """
    if not has_maps(derivation):
        return {}
    robot, hybrid = derivation.robot, derivation.hybrid
    names = [joint.name for joint in chain(derivation)]
    # Couplings are linear. Without loops, the conversion of rates between actuators and joints does
    # not depend on the positions.
    has_slope = hybrid is not None
    all_joints = [v.name for v in hybrid.variables] if hybrid else names
    values = {
        "robot": robot.name,
        "package": package,
        "guard": robot.name.upper(),
        "title": robot.title,
        "n": str(len(robot.coordinates)),
        "m": str(len(names)),
        "z": str(len(all_joints)),
        "actuator_names": _quoted([coordinate.name for coordinate in robot.coordinates]),
        "chain_names": _quoted(names),
        "joint_names": _quoted(all_joints),
        "all": "configuration" if hybrid else "chain",
        "rates_q": "actuator.position.data(), " if has_slope else "",
        "rates_theta": "joint.position.data(), " if has_slope else "",
        "inverse": inverse.name,
        "moved": str(len(robot.coordinates) - 1),
    }
    found = {f"include/{package}/joints.hpp": filled(SUPPORT / "joints.hpp.in", values)}
    if hybrid is not None and inverse in seeded(derivation):
        values["start"] = ", ".join(repr(round(x, 9)) for x in hybrid.q_at_reference.tolist())
        found[EXAMPLE] = filled(SUPPORT / "hardware.cpp.in", values)
    return found


def _quoted(names: Sequence[str]) -> str:
    return ", ".join(f'"{name}"' for name in names)
