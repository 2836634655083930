"""The reasons why a robot lacks a function, and the functions to call instead."""

from __future__ import annotations

from typing import Any

_PARTS_OF_A_POSE = {
    "ik_position": "a position",
    "ik_position_pitch": "a position and a pitch",
    "ik_position_direction": "a position and a direction",
}
"""Tasks of arms that reach no whole pose, with their targets."""


def no_inverse(robot: Any) -> tuple[str, str]:
    """The reason that the manifest states, and the methods that solve the same problem.

    Args:
        robot: A robot without an inverse in closed form.

    Returns:
        The reason, "" if there is none; and the substitutes, "" if there are none.
    """
    substitutes = {
        "ik_planar": "ik_planar, which takes the pose of a planar platform",
        "actuators": "actuators, which takes the joints of the main chain",
        "ik_numeric": "ik_numeric, which finds one solution by iteration, and with lock= keeps "
        "given joints at their values of the seed",
    }
    tasks = [name for name in robot.functions if name in _PARTS_OF_A_POSE]
    found = [f"{name}, which takes {_PARTS_OF_A_POSE[name]}" for name in tasks]
    found += [text for name, text in substitutes.items() if name in dir(robot)]
    if robot.kind == "serial":
        found.append(
            "chasles-derive FILE --give JOINTS, which writes an ik of given joints where they "
            "leave a closed form"
        )
    reason = (
        "its loops are solved by iteration"
        if robot.manifest.is_iterated
        else robot.manifest.inverse.missing
    )
    return reason, "; ".join(found)


def no_representation(robot: Any, name: str) -> tuple[str, str]:
    """The functions that differ by their representation of twists only.

    Args:
        robot: A robot.
        name: The name without a representation, such as "jacobian" or "jacobian_dot".
    """
    stem, _, suffix = name.partition("_")
    named = ["_".join(filter(None, (stem, kind, suffix))) for kind in ("space", "body", "mixed")]
    return "the representation must be named", ", ".join(n for n in named if n in robot.functions)
