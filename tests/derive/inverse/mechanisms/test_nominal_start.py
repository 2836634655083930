"""The inverse kinematics of an as-built robot iterates from the solutions of the nominal robot."""

from dataclasses import replace
from itertools import product

import numpy as np

from chasles.derive import derive
from chasles.derive.terms.casadi_graph import lower
from tests.support.generators.driven_arms import built_arm


def reversed_joint(arm, name):
    joints = [replace(j, direction=-j.direction) if j.name == name else j for j in arm.joints]
    reference = tuple((key, -value if key == name else value) for key, value in arm.reference)
    nominal = reversed_joint(arm.nominal, name) if arm.nominal else None
    return replace(arm, joints=tuple(joints), reference=reference, nominal=nominal)


def test_reversed_joint_of_chain_leaves_a_solution_of_the_nominal_arm():
    arm = built_arm(141)
    robot = reversed_joint(arm, arm.main_chain.moving[-1].name)
    derivation = derive(robot, functions=["fk", "ik_nominal"])
    nominal = derivation.function("ik_nominal")
    fk, start = lower([derivation.function("fk"), nominal], "arm")
    values = dict(derivation.robot.reference)
    q = np.array([float(values[c.name]) for c in derivation.robot.coordinates])
    T, fixed = np.array(fk(q)).ravel(), q[list(nominal.role.fixed)]
    signs = product((1, -1), repeat=len(nominal.signs))
    residuals = [float(start(T, *fixed, choice)[1]) for choice in signs]
    assert np.nanmin(residuals) < 0.01
