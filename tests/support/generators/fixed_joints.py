"""Arms whose inverse kinematics has the value of one joint as an input."""

from collections.abc import Sequence
from functools import cache

import numpy as np

from chasles.derive import read_text
from chasles.derive.inverse.serial_inverse import inverses
from chasles.derive.terms.terms import Terms

from .drawn_arms import Derived

Vector = tuple[int, int, int]
FIXED = ("F", (1, 0, 0))


def solved_with_fixed(
    joints: Sequence[tuple[str, Vector]], seed: int, meeting: int | None = None
) -> Derived:
    """Derive the inverse kinematics of an arm with one fixed joint, and cache the derivation.

    Args:
        joints: Type (R for revolute, P for prismatic, F for fixed) and axis direction of each
            joint.
        seed: Seed of the random lengths.
        meeting: Index of the joint whose axis meets the axes of all later joints, or None if no
            axes meet.
    """
    return _solved(tuple(joints), seed, meeting)


@cache
def _solved(joints: tuple[tuple[str, Vector], ...], seed: int, meeting: int | None) -> Derived:
    rng = np.random.default_rng(seed)
    text = ['name = "r"', 'convention = "urdf"', 'units = { length = "m", angle = "rad" }']
    for k, (kind, axis) in enumerate(joints):
        is_displaced = meeting is None or k <= meeting
        at = rng.uniform(-0.3, 0.3, 3).round(2).tolist() if is_displaced else [0, 0, 0]
        name = "prismatic" if kind == "P" else "revolute"
        text += ["[[joints]]", f'name = "j{k}"\ntype = "{name}"\nxyz = {at}\naxis = {list(axis)}']
    robot = read_text("\n".join(text))
    give = tuple(k for k, joint in enumerate(joints) if joint == FIXED)
    found = inverses(robot, Terms({p.symbol: p.value for p in robot.parameters}), give=give)
    return Derived("fixed", "ik", described=robot, inverses=found)
