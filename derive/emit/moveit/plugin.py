"""Prints the robot-specific code of the kinematics plugin."""

from collections.abc import Sequence

from ...derivation import Derivation
from ...model.errors import InputValueError
from ...model.robot import Joint, SerialRobot
from ...terms.symbolic_function import Signature


def plugin_values(
    derivation: Derivation, inverse: Signature, joints: Sequence[Joint]
) -> dict[str, str]:
    """Returns the values of the plugin's placeholders.

    The plugin works with the joints of the chain. For a robot with loops or couplings, the
    generated C code uses actuator coordinates instead of joints. The functions ``chain`` and
    ``actuators`` convert between joints and actuators.

    Args:
        derivation: The derived robot with its functions.
        inverse: The inverse that the plugin calls.
        joints: The moving joints from the base to the tool.

    Raises:
        InputValueError: An input of the inverse is neither a joint value nor a swivel angle.
    """
    is_direct = list(joints) == list(derivation.robot.coordinates)
    inputs, at = _inputs(derivation, inverse, [joint.name for joint in joints], is_direct)
    slots = inverse.outputs[0].shape[0]
    body = _direct(derivation, inverse) if is_direct else _mapped(derivation, inverse, len(joints))
    return {
        **body,
        "inputs": "inputs" if inputs else "",
        "theta": "theta" if inputs else "",
        "inputs_at": _indented(at),
        "joints": ", ".join(map(str, inputs)),
        "periods": ", ".join(_periods(derivation, joints)),
        "reference": ", ".join(_reference(derivation, joints)),
        "slots": str(slots),
    }


def _direct(derivation: Derivation, inverse: Signature) -> dict[str, str]:
    name, slots = derivation.robot.name, inverse.outputs[0].shape[0]
    call = f"{name}_{inverse.name}({_passed(inverse)}, theta, residual, margin);"
    return {
        "forward": _indented([f"{name}_fk(theta, T);"]),
        "inverse": _indented([f"double margin[{slots}];", call]),
    }


def _mapped(derivation: Derivation, inverse: Signature, m: int) -> dict[str, str]:
    name, (slots, n) = derivation.robot.name, inverse.outputs[0].shape
    forward = [f"double q[{n}];", f"{name}_actuators(theta, q);", f"{name}_fk(q, T);"]
    lines = [
        f"double q[{slots * n}], margin[{slots}];",
        f"{name}_{inverse.name}({_passed(inverse)}, q, residual, margin);",
        f"for (int slot = 0; slot < {slots}; ++slot) {{",
        f"    {name}_chain(q + {n} * slot, theta + {m} * slot);",
        "}",
    ]
    return {"forward": _indented(forward), "inverse": _indented(lines)}


def _periods(derivation: Derivation, joints: Sequence[Joint]) -> list[str]:
    robot, alone = derivation.robot, {joint.name for joint in joints}
    if isinstance(robot, SerialRobot) and len(joints) < len(robot.moving):
        columns = zip(joints, range(len(joints)), strict=True)
        followed = {
            joint.name for joint, k in columns if len(robot.linear_map.C.col(k).values()) > 1
        }
        alone -= followed
    return [
        "FULL_TURN" if joint.kind == "revolute" and joint.name in alone else "0" for joint in joints
    ]


def _reference(derivation: Derivation, joints: Sequence[Joint]) -> list[str]:
    if derivation.hybrid is None:
        return []
    return [repr(round(derivation.hybrid.at_reference[joint.name], 9)) for joint in joints]


def _passed(inverse: Signature) -> str:
    return ", ".join(
        ["T", *(f"inputs + {k}" if k else "inputs" for k in range(len(inverse.inputs) - 1))]
    )


def _inputs(
    derivation: Derivation, inverse: Signature, joints: Sequence[str], is_direct: bool
) -> tuple[list[int], list[str]]:
    """Returns the joint index of each input, and lines that compute other inputs.

    A swivel angle has index -1.
    """
    robot, names = derivation.robot, [argument.name for argument in inverse.inputs[1:]]
    swivel = {f.name for f in derivation.functions if f.role.name == "redundancy"}
    if is_direct and len(names) == len(inverse.role.fixed):
        found = list(inverse.role.fixed)
    elif names and set(names) <= set(joints):
        found = [joints.index(name) for name in names]
    elif is_direct and len(names) == 1 and set(names) <= swivel:
        return [-1], [f"{robot.name}_{names[0]}(theta, inputs);"]
    elif not names:
        return [], []
    else:
        raise InputValueError(
            f"{robot.name}: a plugin of MoveIt cannot sample the inputs {', '.join(names)}"
        )
    return found, [f"inputs[{k}] = theta[{joint}];" for k, joint in enumerate(found)]


def _indented(lines: Sequence[str]) -> str:
    return "\n".join(f"    {line}" for line in lines)
