"""Inverse kinematics with user-fixed joints, including revolute joints inside the chain."""

import numpy as np
import pytest

from chasles import InputValueError
from chasles.derive import derive, explain, read
from chasles.derive.inverse.given_joints import joint_sets_to_fix
from tests.campaigns.losses import sets
from tests.support.derivations import ROBOTS
from tests.support.generators.drawn_arms import cases_for_given, random_arm
from tests.support.oracles.verdict import judged

SEED = 155
"""Seed of a random arm with a fixed revolute joint inside the chain."""


def test_ik_with_random_fixed_joints_solves_every_random_pose():
    cases = cases_for_given(random_arm(SEED), SEED)
    assert len(cases) == 2
    for case in cases:
        lines, give = case.inverses.classification.lines, case.inverses.classification.give
        assert give not in joint_sets_to_fix(lines, len(give))
        chosen, poses = next(sets(case, np.random.default_rng(SEED)))
        assert poses.name == "random"
        found = judged(chosen, poses, chosen.answers)
        assert (found.missed, found.wrong, found.lost or 0) == (0, 0, 0), case.name
        # The solutions contain the given values of the fixed joints, bitwise equal.
        q = np.random.default_rng(SEED).uniform(-3, 3, (20, case.robot.n))
        assert (case.found(q).q[..., list(give)] == q[:, None, list(give)]).all()


def derived(name, *give):
    return derive(read(ROBOTS / f"{name}.toml"), functions=["ik"], fixed=give)


def test_fixed_joints_become_function_inputs():
    well = derived("well_manipulator", "l_MN", "theta2", "l_HI")
    assert [a.name for a in well.function("ik").inputs] == ["T", "theta2", "l_HI", "l_MN"]
    assert well.inverse.classification.give == (1, 3, 5)
    panda = derived("panda", "joint2")
    (ik,) = panda.written
    assert [a.name for a in ik.inputs] == ["T", "q2"]
    assert ik.role.fixed == (1,)
    (ik,) = derived("ur5e", "elbow").written
    assert (ik.solver, ik.role.fixed) == ("general_tool", (2,))
    text = str(explain(read(ROBOTS / "photo_robot.toml"), fixed=("theta2", "r4")))
    assert "Structure: spherical wrist, with theta2 and r4 fixed." in text


@pytest.mark.parametrize(
    ("name", "fixed", "message"),
    [
        (
            "panda",
            ("joint8",),
            "panda: cannot fix unknown joint joint8; expected one of joint1, joi",
        ),
        ("scara", ("shoulder", "elbow", "quill", "flange"), "all joints are fixed"),
        ("iiwa14", ("A4",), "the other joints could move without moving the tool; joints that"),
        (
            "well_manipulator",
            ("theta2",),
            "3 joints must be fixed; .* theta2, l_HI, l_MN; ",
        ),
        ("board_installer", ("waist",), "loops couple the joints of its main chain; ik_numeric"),
    ],
    ids=["panda", "scara", "iiwa14", "well_manipulator", "board_installer"],
)
def test_error_states_which_joints_can_be_fixed(name, fixed, message):
    with pytest.raises(InputValueError, match=message):
        derived(name, *fixed)
