"""Checks that the actuated coordinates are independent and determine the motion.

The null space of the constraint Jacobian contains the feasible coordinate rates. The rates of the
actuated coordinates determine all rates if their rows of a null-space basis form a regular square
matrix. The module tests several configurations, because the test fails at a singular configuration.
"""

from collections.abc import Sequence

import numpy as np

from ...model.errors import DescriptionError
from ...model.mechanism import Closure, Mechanism, Strut
from ...model.plural import counted
from ...model.tolerances import NUMERICALLY_CLOSED, REPEATED_EQUATION
from ..model.numeric_mechanism import NumericMechanism
from .closed_loops import ClosedLoops, Vector

MAX_NAMED = 6


def check_actuation(loops: ClosedLoops) -> int:
    """Raise an error if the actuators are dependent or do not determine the motion.

    A platform may have more actuators than degrees of freedom, as in a cable robot.

    Args:
        loops: The closure equations of the mechanism.

    Returns:
        Number of redundant actuators.

    Raises:
        DescriptionError: An actuator is missing, or actuators depend on each other. The error
            message lists the joints that need an actuator, or the actuators that depend on each
            other.
    """
    coordinates = loops.mechanism.coordinates
    actuated = [loops.names.index(c.moves) for c in coordinates]
    moving = max((_motions(loops, z) for z in loops.generic), key=lambda m: _rank(m[actuated]))
    rows = moving[actuated]
    freedoms, independent = moving.shape[1], _rank(rows)
    names = [c.name for c in coordinates]
    if freedoms == independent == len(names):
        return 0
    if freedoms == independent and _is_overactuated_platform(loops, rows):
        return len(names) - int(freedoms)
    has = f"robot {loops.mechanism.name!r} has {counted(freedoms, 'degree')} of freedom"
    if freedoms == 0:
        bodies = loops.bodies
        found = [
            f"{c.name}: {words}"
            for c in loops.mechanism.loop_joints
            if (words := across(bodies, c))
        ]
        advice = "; ".join(found) or (
            "remove a rod or a closure, relax a constraint (a pin in place of a weld, a "
            "ball in place of a pin), or add a joint"
        )
        raise DescriptionError(f"{has}: the loops immobilize every body; {advice}")
    parts = []
    if independent < len(names):
        parts.append(_too_many(names, rows))
    if independent < freedoms:
        parts.append(_too_few(loops, moving, rows, freedoms - independent))
    and_has = f"{counted(len(names), 'actuated coordinate')} ({', '.join(names)})"
    raise DescriptionError(f"{has} and {and_has}: {'; '.join(parts)}")


def spare_actuators(loops: ClosedLoops) -> int:
    """Return the number of redundant actuators of a platform, or 0 for other robots."""
    try:
        return check_actuation(loops)
    except DescriptionError:
        return 0


def overactuated_start(mechanism: Mechanism) -> dict[str, float]:
    """Return a closed configuration of a platform with redundant actuators, near its reference.

    If the reference omits an actuator value, this value follows from the other actuators or from
    the platform pose. If the reference values contradict each other, the platform pose determines
    all actuators.
    """
    bodies = NumericMechanism(mechanism)
    loop_joints = [loop_joint.name for loop_joint in mechanism.loop_joints]
    stated = {name for name, _ in mechanism.reference}
    moved = [c.moves for c in mechanism.coordinates]
    open_ = [c.moves for c in mechanism.coordinates if stated.isdisjoint((c.name, c.moves))]
    at = bodies.nearest(bodies.values, open_, loop_joints) if open_ else bodies.values
    free = [*bodies.unknown, *open_]
    near = bodies.nearest(at, free, loop_joints)
    if bodies.all_closed(near, loop_joints):
        return near
    chain = {joint.name for joint in mechanism.main_chain.moving}
    legs = [name for name in (*bodies.unknown, *moved) if name not in chain]
    return bodies.nearest(at, legs, loop_joints)


def _is_overactuated_platform(loops: ClosedLoops, rows: Vector) -> bool:
    """Whether only legs, and no main-chain joints, drive the tool, and all actuators can move."""
    chain = {joint.name for joint in loops.mechanism.main_chain.moving}
    moved = {c.moves for c in loops.mechanism.coordinates}
    is_moving = np.linalg.norm(rows, axis=1) > REPEATED_EQUATION
    return chain.isdisjoint(moved) and bool(rows.size and np.all(is_moving))


def across(bodies: NumericMechanism, loop_joint: Closure | Strut) -> str:
    """Describe how the pins of a loop prevent a planar motion, or return ""."""
    if loop_joint.name in bodies.planes or _kind(loop_joint) != "pin":
        return ""
    poses = bodies.poses(bodies.values)
    paths = [bodies.mechanism.path_to(frame.body) for frame in (loop_joint.a, loop_joint.b)]
    turning = [
        (poses[joint.parent] @ bodies.matrix(joint.before))[:3, 2]
        for path in paths
        for joint in path
        if joint.kind == "revolute" and not all(joint in other for other in paths)
    ]
    if not turning or not all(abs(axis @ turning[0]) > 1 - NUMERICALLY_CLOSED for axis in turning):
        return ""
    n = turning[0]
    A, B = bodies.frames(poses, loop_joint)
    axis = ", ".join(f"{x + 0.0:.3g}" for x in np.round(n, 6))
    if isinstance(loop_joint, Strut):
        apart = abs(float(n @ (B[:3, 3] - A[:3, 3])))
        return (
            f"its ends are {1000 * apart:.4g} mm apart along ({axis}), the axis of the loop's "
            "joints: put both ends in one plane normal to that axis, or use ball ends"
        )
    frames = (("a", A), ("b", B))
    rotated = [f"{end} by {_rotation(F[:3, :3].T @ n)}" for end, F in frames if _tilts(F, n)]
    if not rotated:
        return ""
    return (
        "a pin rotates about the z axis of its frames, but the loop's joints rotate about "
        f"({axis}): rotate frame {' and frame '.join(rotated)}"
    )


def _tilts(frame: Vector, n: Vector) -> bool:
    return bool(abs(frame[:3, 2] @ n) <= 1 - NUMERICALLY_CLOSED)


def _rotation(n: Vector) -> str:
    """Describe the rotation from the z axis of a frame to a direction n in this frame."""
    along = [k for k in range(2) if abs(n[k]) > 1 - NUMERICALLY_CLOSED]
    return f"rpy = {('[0, 90, 0]', '[90, 0, 0]')[along[0]]} deg" if along else "rpy"


def _kind(loop_joint: Closure | Strut) -> str:
    return loop_joint.ends if isinstance(loop_joint, Strut) else loop_joint.kind


def _motions(loops: ClosedLoops, z: Vector) -> Vector:
    """Return a basis of the feasible coordinate rates, with one column per basis vector."""
    _, values, V = np.linalg.svd(loops.unit_rows(z))
    kept = int(np.sum(values > REPEATED_EQUATION * max(values, default=1.0)))
    found: Vector = V[kept:].T
    return found


def _rank(rows: Vector) -> int:
    return int(np.linalg.matrix_rank(rows, tol=REPEATED_EQUATION)) if rows.size else 0


def _too_many(names: Sequence[str], rows: Vector) -> str:
    """Return the error message for dependent actuated coordinates."""
    spare = len(names) - _rank(rows)
    dependent = [
        name for k, name in enumerate(names) if _rank(np.delete(rows, k, axis=0)) == _rank(rows)
    ]
    motors = "its motor" if spare == 1 else "their motors"
    return (
        f"{_few(dependent)} depend on each other: remove {spare} of them from actuated (a drive "
        f"that is not in actuated follows, so {motors} can stay in the file)"
        if len(dependent) > 1
        else f"{dependent[0]} cannot move: remove it from actuated"
    )


def _too_few(loops: ClosedLoops, moving: Vector, rows: Vector, missing: int) -> str:
    """Return the error message for joints that move although all actuators are locked."""
    _, values, V = np.linalg.svd(rows)
    free = moving @ V[int(np.sum(values > REPEATED_EQUATION)) :].T
    moves = np.linalg.norm(free, axis=1) > REPEATED_EQUATION
    members = set(loops.mechanism.members)
    loose = [name for name, is_moving in zip(loops.names, moves, strict=True) if is_moving]
    named = [name for name in loose if name in members] or loose
    locked = "with all actuators fixed, " if len(rows) else ""
    if len(named) == 1:
        hold = "or constrain it by a rod or a closure"
        advice = f"{locked}{named[0]} can still move: add it to actuated, {hold}"
    else:
        count = "one" if missing == 1 else str(missing)
        hold = "or constrain them by a rod or a closure"
        advice = f"{locked}{_few(named)} can still move: add {count} of them to actuated, {hold}"
    springs = [name for name in loose if name in dict(loops.mechanism.springs)]
    if springs:
        names, them = ("is a spring", "it") if len(springs) == 1 else ("are springs", "them")
        rigid = f"to make {them} rigid, delete {them} or call chasles.derive.springs_at_rest(robot)"
        return f"{advice}; {_few(springs)} {names} in the file: {rigid}"
    other = (
        "; or choose another configuration in [reference]" if loops.mechanism.loop_joints else ""
    )
    return f"{advice}{other}"


def _few(names: Sequence[str]) -> str:
    shown = [*names[:MAX_NAMED], "others"] if len(names) > MAX_NAMED else [*names]
    return " and ".join(filter(None, [", ".join(shown[:-1]), shown[-1]]))
