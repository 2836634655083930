"""Random serial arms for tests of conversions."""

from dataclasses import replace
from random import Random

import sympy as sp

from chasles.derive import Coupling, Joint, Motor, SerialRobot, Translation

from .drawn_arms import random_arm
from .geometric_errors import displaced

HELICAL, REVERSED, COUPLED, DRIVEN = 0.15, 0.2, 0.3, 0.5
"""Probability of a helical joint, of a reversed joint, and of an arm with a coupled joint.
Probability of a differential or a four-bar linkage in an arm without a coupled joint."""


def convertible_arm(seed: int) -> SerialRobot:
    """Return the random arm for a seed.

    Two thirds of the arms have geometric errors between 1e-6 and 0.1 (meter, radian).
    """
    draw = Random(seed)
    arm = random_arm(seed)
    if draw.random() < 2 / 3:
        arm = displaced(arm, 10 ** draw.uniform(-6, -1), seed)
    joints = [_changed(joint, draw) for joint in arm.joints]
    couplings: tuple[Coupling, ...] = ()
    turning = [joint for joint in joints if joint.kind == "revolute"]
    if len(turning) > 1 and draw.random() < COUPLED:
        leader, follower = draw.sample(turning, 2)
        ratio = sp.Rational(draw.randint(-9, 9) or 1, 4)
        couplings = (Coupling(follower.name, ((leader.name, ratio),), sp.Rational(1, 8)),)
    motors: tuple[Motor, ...] = ()
    if len(turning) > 1 and not couplings and draw.random() < DRIVEN:
        chosen = sorted(draw.sample(range(len(turning)), 2))
        couplings = _driven([turning[k] for k in chosen], draw)
        motors = (Motor("left"), Motor("right"))
    base = (Translation((sp.Rational(draw.randint(-9, 9), 10), sp.S.Zero, sp.S.Zero)), *arm.base)
    return replace(arm, joints=tuple(joints), base=base, couplings=couplings, motors=motors)


def _driven(joints: list[Joint], draw: Random) -> tuple[Coupling, ...]:
    a, b, c = (sp.Rational(draw.choice((-1, 1)), draw.randint(1, 60)) for _ in range(3))
    first = (a, sp.S.Zero) if draw.random() < 1 / 2 else (a, b)
    second = (c, b) if first[1] == 0 else (c, -b * c / a)
    offsets = (sp.Rational(1, 8), sp.Rational(-1, 5))
    return tuple(
        Coupling(joint.name, (("left", row[0]), ("right", row[1])), offset)
        for joint, row, offset in zip(joints, (first, second), offsets, strict=True)
    )


def _changed(joint: Joint, draw: Random) -> Joint:
    if joint.kind == "revolute" and draw.random() < HELICAL:
        joint = replace(joint, kind="helical", pitch=sp.Rational(draw.randint(1, 9), 100))
    if draw.random() < REVERSED:
        joint = replace(joint, direction=-1)
    if draw.random() < 1 / 2:
        joint = replace(joint, limits=(sp.Rational(draw.randint(-30, -1), 10), sp.Rational("1.7")))
    return joint
