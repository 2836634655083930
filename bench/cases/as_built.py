"""Robots with loops as they are built: every length of some loops off by a little."""

from dataclasses import replace

import numpy as np
import sympy as sp

from chasles.derive import Mechanism
from chasles.derive.model.robot import Placement, Translation

DECIMALS = 9


def as_built(
    mechanism: Mechanism, members: frozenset[str], error: float, rng: np.random.Generator
) -> Mechanism:
    """A mechanism with every length of some joints and rods off by a random amount.

    Args:
        mechanism: The robot as designed.
        members: Names of its joints and rods.
        error: Largest difference of a coordinate of a pin, or of a rod's length (metre).
        rng: Draws the differences.
    """

    def off(value: sp.Expr) -> sp.Expr:
        if value == 0:
            return value
        return value + sp.Rational(f"{rng.uniform(-error, error):.{DECIMALS}f}")

    def moved(placement: Placement) -> Placement:
        return tuple(
            replace(part, vector=tuple(map(off, part.vector)))
            if isinstance(part, Translation)
            else part
            for part in placement
        )

    joints = tuple(
        replace(joint, before=moved(joint.before)) if joint.name in members else joint
        for joint in mechanism.joints
    )
    struts = tuple(
        replace(
            strut,
            length=off(strut.length),
            a=replace(strut.a, placement=moved(strut.a.placement)),
            b=replace(strut.b, placement=moved(strut.b.placement)),
        )
        if strut.name in members
        else strut
        for strut in mechanism.struts
    )
    return replace(mechanism, joints=joints, struts=struts)


BOARD_INSTALLER = frozenset(
    {
        *("elbow", "wrist", "crank", "elbow_plate"),
        *("rod_KH", "rod_FH", "greater_rod", "smaller_rod"),
    }
)
"""The pantograph and the parallelograms of the board installer."""
