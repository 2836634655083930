"""Finds the inverse kinematics functions that can return the solution nearest to a seed."""

from collections.abc import Sequence
from dataclasses import dataclass

from ..derivation import Derivation
from ..loops.model.coupling_equations import turning_coordinates
from ..model.mechanism import Described
from ..model.robot import SerialRobot
from ..terms.symbolic_function import Signature, SymbolicFunction
from .c.passive_limits import limited_variables
from .c.windings import shares_limits

MAX_SLOTS = MAX_JOINTS = 64
"""Maximum numbers of solutions and of coordinates that the support files can process."""
_NO_INPUTS = "In no language, because a seed does not determine the inputs"


@dataclass(frozen=True)
class SeedInputs:
    """Inputs of an inverse kinematics function that are computed from a seed configuration.

    Attributes:
        names: Names of the inputs.
        entries: Index of each input in the seed or in the result of ``function``.
        function: Name of the function that computes the inputs from the seed, or None if the seed
            contains all inputs.
        size: Number of results of ``function``.
    """

    names: tuple[str, ...]
    entries: tuple[int, ...]
    function: str | None = None
    size: int = 0


def has_nearest(robot: Described, function: Signature) -> bool:
    """Whether a function is an IK function that fits the size limits of the support files."""
    return (
        function.role.is_inverse
        and function.outputs[0].shape[0] <= MAX_SLOTS
        and len(robot.coordinates) <= MAX_JOINTS
    )


def inverses(derivation: Derivation) -> list[Signature]:
    """Return the inverse kinematics functions that fit the size limits of the support files."""
    functions = (*derivation.functions, *derivation.written)
    return [function for function in functions if has_nearest(derivation.robot, function)]


def seeded(derivation: Derivation) -> list[Signature]:
    """Return the IK functions for which a seed determines all inputs except the target."""
    return [f for f in inverses(derivation) if seed_inputs(derivation, f) is not None]


def seed_inputs(derivation: Derivation, function: Signature) -> SeedInputs | None:
    """Return all inputs of an inverse kinematics function except the target.

    The result is None if a seed does not determine these inputs.
    """
    names, robot = tuple(argument.name for argument in function.inputs[1:]), derivation.robot
    available = {f.name: f for f in (*derivation.functions, *derivation.written)}
    if not names:
        return SeedInputs((), ())
    if [available[name].role.name for name in names if name in available] == ["redundancy"]:
        return SeedInputs(names, (0,), names[0], 1)
    if isinstance(robot, SerialRobot) and robot.couplings:
        return _of_joints(names, [joint.name for joint in robot.moving])
    if derivation.hybrid is None:
        fixed = function.role.fixed
        # A swivel angle can be computed from a seed only if the swivel function is derived.
        return SeedInputs(names, tuple(fixed)) if len(fixed) == len(names) else None
    joints = [joint.name for joint in derivation.hybrid.mechanism.main_chain.moving]
    return _of_joints(names, joints) if "chain" in available else None


def _of_joints(names: tuple[str, ...], joints: Sequence[str]) -> SeedInputs | None:
    if not set(names) <= set(joints):
        return None
    return SeedInputs(names, tuple(map(joints.index, names)), "chain", len(joints))


def printed_nearest(
    derivation: Derivation, printed: Sequence[SymbolicFunction]
) -> list[tuple[SymbolicFunction, SeedInputs]]:
    """Return the inverse kinematics functions with a nearest-solution function in every language.

    The list is empty if the robot needs a search over full turns. If a function that is not in
    ``printed`` computes inputs of an inverse kinematics function from the seed, the list omits this
    inverse kinematics function.
    """
    if shares_limits(derivation, wraps_of(derivation)) or limited_variables(derivation):
        return []
    names = {None, *(function.name for function in printed)}
    found = [f for f in printed if has_nearest(derivation.robot, f)]
    inputs = [seed_inputs(derivation, function) for function in found]
    pairs = zip(found, inputs, strict=True)
    return [(function, own) for function, own in pairs if own and own.function in names]


def missing_nearest(derivation: Derivation, printed: Sequence[SymbolicFunction]) -> str:
    """Return sentences that list the missing ``*_nearest`` functions, with the reasons.

    Args:
        derivation: The derivation of the robot.
        printed: The functions that are printed in an output language.
    """
    found = [function.name for function, _ in printed_nearest(derivation, printed)]
    in_c = {function.name for function in seeded(derivation)}
    reasons: dict[str, list[str]] = {}
    for function in inverses(derivation):
        if function.name in found:
            continue
        reason = _reason(derivation, function, printed) if function.name in in_c else _NO_INPUTS
        reasons.setdefault(reason, []).append(f"{function.name}_nearest")
    return " ".join(f"{reason}: {', '.join(names)}." for reason, names in reasons.items())


def _reason(
    derivation: Derivation, function: Signature, printed: Sequence[SymbolicFunction]
) -> str:
    own, names = seed_inputs(derivation, function), {None, *(f.name for f in printed)}
    assert own is not None
    if {function.name, own.function} <= names:
        return "Only in C, because limits or full turns couple coordinates"
    return "Only in C, because of an iterative solver"


def counts(derivation: Derivation, function: Signature) -> list[bool]:
    """Return whether each coordinate contributes to the distance from a seed configuration.

    Fixed coordinates do not contribute to the distance.
    """
    fixed = {*function.role.fixed, *function.role.free}
    return [k not in fixed for k in range(len(derivation.robot.coordinates))]


def periodic(derivation: Derivation, function: Signature) -> list[bool]:
    """Whether each coordinate may be moved by full turns towards a seed."""
    pairs = zip(counts(derivation, function), wraps_of(derivation), strict=True)
    return [is_counted and wraps for is_counted, wraps in pairs]


def wraps_of(derivation: Derivation) -> list[bool]:
    """Return, for each coordinate, whether a full turn leaves the tool pose unchanged."""
    robot = derivation.robot
    if isinstance(robot, SerialRobot):
        return [
            coordinate.unit == "rad" and (not robot.couplings or _turns_fully(robot, k))
            for k, coordinate in enumerate(robot.coordinates)
        ]
    return turning_coordinates(robot, derivation.terms)


def _turns_fully(robot: SerialRobot, k: int) -> bool:
    ratios = zip(robot.linear_map.C.col(k), robot.moving, strict=True)
    return all(ratio == 0 if joint.unit == "m" else ratio.is_Integer for ratio, joint in ratios)


def nearest_summary(function: Signature) -> list[str]:
    """Return the comment lines that describe a nearest-solution function."""
    kept = ", ".join(argument.name for argument in function.inputs[1:])
    return [
        f"The solution of {function.name} nearest to q_seed within limits.",
        *([f"Fixed at the values in q_seed: {kept}."] if kept else []),
    ]
