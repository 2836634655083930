"""The Robotics Toolbox, with each robot modeled as a sequence of elementary transforms.

This is the fastest robot model of the toolbox.
"""

import roboticstoolbox as rtb

from ...cases.arms import Arm, Motion
from . import Call


def calls(arm: Arm) -> list[Call]:
    sequence = rtb.ETS([_element(motion) for motion in arm.motions])

    def fk(q):
        return (sequence.eval(q),)

    def fk_jacobian(q):
        return sequence.eval(q), sequence.jacob0(q)

    def wrapped(q):
        return (sequence.fkine(q),)

    def wrapped_jacobian(q):
        return sequence.fkine(q), sequence.jacob0(q)

    return [
        Call("Robotics Toolbox eval", fk, fk_jacobian, tuple),
        Call("Robotics Toolbox fkine", wrapped, wrapped_jacobian, lambda r: (r[0].A, *r[1:])),
    ]


def _element(motion: Motion) -> rtb.ET:
    axis = "xyz"[motion.axis]
    if motion.kind == "shift":
        return getattr(rtb.ET, f"t{axis}")(motion.value)
    turn = getattr(rtb.ET, f"R{axis}")
    return turn() if motion.value is None else turn(motion.value, unit="deg")
