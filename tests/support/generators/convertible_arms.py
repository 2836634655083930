"""Random serial arms for conversions: helical, coupled and reversed joints, geometric errors."""

from dataclasses import replace
from random import Random

import sympy as sp

from chasles.derive import Coupling, Joint, SerialRobot, Translation

from .drawn_arms import random_arm
from .geometric_errors import displaced

HELICAL, REVERSED, COUPLED = 0.15, 0.2, 0.3
"""Fractions of helical and reversed joints, and of arms with a coupled joint."""


def convertible_arm(seed: int) -> SerialRobot:
    """Returns the arm for a seed; two of three arms have errors of a random size between 1e-6 and
    0.1 (metre, radian)."""
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
    base = (Translation((sp.Rational(draw.randint(-9, 9), 10), sp.S.Zero, sp.S.Zero)), *arm.base)
    return replace(arm, joints=tuple(joints), base=base, couplings=couplings)


def _changed(joint: Joint, draw: Random) -> Joint:
    if joint.kind == "revolute" and draw.random() < HELICAL:
        joint = replace(joint, kind="helical", pitch=sp.Rational(draw.randint(1, 9), 100))
    if draw.random() < REVERSED:
        joint = replace(joint, direction=-1)
    if draw.random() < 1 / 2:
        joint = replace(joint, limits=(sp.Rational(draw.randint(-30, -1), 10), sp.Rational("1.7")))
    return joint
