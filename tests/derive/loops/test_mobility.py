"""Test the degrees of freedom of textbook mechanisms.

Formulas check configurations with closed loops.
"""

from dataclasses import replace

import numpy as np
import pytest
import sympy as sp

from chasles.derive import DescriptionError
from chasles.derive.loops.closing.freedoms import virtual_joints
from chasles.derive.loops.closing.mobility import mobility
from chasles.derive.model.mechanism import Mechanism
from chasles.derive.terms.terms import Terms
from tests.support.loops import mechanisms
from tests.support.loops.continued import closed_configuration
from tests.support.loops.mechanisms import BASE, at, body_poses, near, pin, slider

KNOWN = {
    # columns: number of bodies, number of joints, lambda, Kutzbach count, count by loops, idle
    # freedoms, mobility
    "four_bar": (4, 4, 3, 1, 1, 0, 1),
    "slider_crank": (4, 4, 3, 1, 1, 0, 1),
    "five_bar": (5, 5, 3, 2, 2, 0, 2),
    "parallelogram": (5, 6, 3, 0, 0, 0, 1),
    "trammel": (4, 4, 3, 1, 1, 0, 1),
    "planar_3rrr": (8, 9, 3, 3, 3, 0, 3),
    "rssr": (4, 4, 6, 2, 2, 1, 1),
    "bennett": (4, 4, 6, -2, -2, 0, 1),
    "sarrus": (6, 6, 6, 0, 0, 0, 1),
    "delta": (11, 15, 6, 9, 9, 6, 3),
    "stewart": (14, 18, 6, 12, 12, 6, 6),
    "geared": (4, 4, 3, 1, 1, 0, 1),
}


@pytest.mark.parametrize("name", KNOWN)
def test_mobility_counts_match_textbooks(name):
    m = mobility(getattr(mechanisms, name)())
    found = (m.bodies, m.joints, m.order, m.kutzbach, m.by_loops, m.idle, m.true)
    assert found == KNOWN[name]


@pytest.mark.parametrize("name", ["parallelogram", "bennett", "sarrus"])
def test_repeated_constraints_are_reported(name):
    m = mobility(getattr(mechanisms, name)())
    assert m.is_overconstrained
    assert m.equations > m.rank
    assert any(line.startswith("repeated") for line in m.report)
    assert f"loop by loop gives {m.by_loops}, actual mobility 1: overconstrained" in m.report


def test_excavator_arm_is_reported_as_overconstrained():
    m = mobility(mechanisms.excavator_arm())
    assert m.is_overconstrained
    assert (m.bodies, m.joints, m.order, m.kutzbach, m.by_loops) == (5, 5, 6, -1, 2)
    assert m.report[3:] == ("Gruebler-Kutzbach gives -1, actual mobility 2: overconstrained",)


def test_idle_members_are_reported_without_disagreement():
    m = mobility(mechanisms.delta())
    assert not m.is_overconstrained
    assert m.report == (
        "Gruebler-Kutzbach: 6 (11 - 1 - 15) + 39 = 9",
        "loop by loop: 39 - 6 - 6 - 6 - 6 - 6 = 9",
        "constraint Jacobian: 9 coordinates - rank 6 = 3",
        "idle: 6 members between ball joints spin about their own axes",
    )


def test_too_few_motors_are_reported():
    whole = mechanisms.five_bar()
    assert (
        "actuated coordinates: 1, degrees of freedom: 2"
        in mobility(replace(whole, actuated=("left",))).report
    )
    assert len(mobility(whole).report) == 3


def test_parallelogram_with_redundant_cranks_keeps_its_mobility():
    for cranks in (2, 3, 5):
        m = mobility(mechanisms.parallelogram(cranks))
        assert (m.kutzbach, m.true) == (3 - cranks, 1)


def test_open_chain_mobility_equals_joint_count():
    arm = Mechanism("arm", (pin("a", BASE, "l1"), pin("b", "l1", "l2", 1)), ("a", "b"))
    gantry = Mechanism(
        "gantry",
        (
            slider("x", BASE, "l1", 0, 0, 0, ("y", sp.pi / 2)),
            slider("y", "l1", "l2", 0, 0, 0, ("x", sp.pi / 2)),
        ),
        ("x", "y"),
    )
    for mechanism, order in ((arm, 3), (gantry, 3)):
        m = mobility(mechanism)
        assert (m.order, m.kutzbach, m.by_loops, m.true) == (order, 2, 2, 2)
    lifted = replace(
        gantry, joints=(*gantry.joints, slider("z", "l2", "l3", 0, 0, 0, ("y", sp.pi / 2)))
    )
    m = mobility(replace(lifted, tool_body="l3", actuated=("x", "y", "z")))
    assert (m.order, m.kutzbach, m.true) == (6, 3, 3)


def test_fixed_joints_do_not_change_mobility():
    flat, tilted = mechanisms.four_bar(), mechanisms.ground(mechanisms.four_bar(), at(1, 2, 3))
    assert mobility(tilted) == mobility(flat)


def terms():
    return Terms({})


def test_free_platform_joints_are_virtual():
    for mechanism, names in (
        (mechanisms.stewart(), ["x", "y", "z", "yaw", "pitch", "roll"]),
        (mechanisms.planar_3rrr(), ["x", "y", "yaw"]),
    ):
        (run,) = virtual_joints(mechanism, terms())
        assert [joint.name for joint in run] == names


def test_driven_or_loaded_joints_are_not_virtual():
    whole = mechanisms.planar_3rrr()
    assert virtual_joints(replace(whole, actuated=("x",)), terms()) == []
    assert virtual_joints(replace(whole, tool_body="p_xy"), terms()) == []
    branch = pin("branch", "p_xy", "extra")
    joints = (*whole.joints, branch)
    assert virtual_joints(replace(whole, joints=joints), terms()) == []
    assert virtual_joints(mechanisms.sarrus(), terms()) == []


def test_delta_closed_configuration_satisfies_rod_lengths():
    m = mechanisms.delta()
    z = closed_configuration(m, (0.2, -0.3, 0.1))
    poses = body_poses(m, z)
    assert [z[name] for name in m.actuated] == [0.2, -0.3, 0.1]
    for rod in m.struts:
        ends = (poses[p.body] @ mechanisms.matrix(p.placement, {}) for p in (rod.a, rod.b))
        a, b = (T[:3, 3] for T in ends)
        assert np.linalg.norm(a - b) == pytest.approx(0.8, abs=1e-12)
    assert z["yaw"] == pytest.approx(0, abs=1e-11)
    assert z["roll"] == pytest.approx(0, abs=1e-11)


def test_full_crank_rotation_keeps_the_branch():
    m = mechanisms.four_bar()
    for crank in np.linspace(-2 * np.pi, 2 * np.pi, 7):
        z = closed_configuration(m, (crank,))
        x, y = np.cos(crank), np.sin(crank)
        d = np.hypot(3 - x, y)
        rocker = np.arctan2(y, x - 3) - np.arccos((2.5**2 + d**2 - 9) / (5 * d))
        assert np.exp(1j * z["rocker"]) == pytest.approx(np.exp(1j * rocker), abs=1e-12)
        assert z["crank"] == crank


def test_redundant_constraints_keep_configuration_accuracy():
    # If only the loop residual were limited to 1e-12, joint errors could reach 1e-12 divided by the
    # smallest singular value of the Jacobian.
    for q in np.linspace(0.2, 2.8, 4):
        z = closed_configuration(mechanisms.parallelogram(5), (q,))
        found = [z[f"crank{k}"] for k in range(5)]
        np.testing.assert_allclose([*found, -z["bar"]], q, rtol=0, atol=1e-14)


def test_motor_angle_is_scaled_by_gear_ratio():
    m = mechanisms.geared()
    assert closed_configuration(m)["crank"] == pytest.approx(np.pi / 3)
    assert closed_configuration(m, (5.0,))["crank"] == 0.5


def test_the_loop_that_does_not_close_is_named():
    far = replace(mechanisms.slider_crank(), reference=near(("crank", 1), ("cross", 3)))
    short = replace(
        far,
        closures=(replace(far.closures[0], a=replace(far.closures[0].a, placement=at("1/10"))),),
    )
    with pytest.raises(
        DescriptionError, match="'slider_crank': the loop of 'gudgeon' does not close"
    ):
        closed_configuration(short)
    with pytest.raises(DescriptionError, match=r"the loop of 'leg3' does not close: .* mm remain"):
        closed_configuration(mechanisms.stewart(), (0, 0, 0, 9, 0, 0))


def test_flipped_frames_do_not_count_as_closed():
    m = mechanisms.welded()
    over = replace(m, reference=near(("j1", 1), ("j2", -1), ("j3", "-7/5"), ("j4", "17/10")))
    with pytest.raises(DescriptionError, match="it closes only with a flipped frame"):
        closed_configuration(over)


def test_a_serial_mechanism_is_always_closed():
    serial = Mechanism("serial", (pin("j", BASE, "b"),), ("j",))
    assert closed_configuration(serial, (0.3,)) == {"j": 0.3}
