"""The 49 s motion of the well manipulator, and the stages of this motion."""

import numpy as np
import pytest

import chasles
from chasles.errors import InputValueError
from chasles.study.motion import MotionSequence, limit_violations, line
from chasles.study.planning.plan import no_plan, plan_along

INITIAL = np.radians([0, 88.79, -49.2, 0, -86.76, 0, -40.62])
READY = np.radians([0, 88.79, -11.25844509, 0, -129.76606998, 0, -35.55548493])
T_READY = np.array([[0, 1, 0, 1.237], [0, 0, -1, 0], [-1, 0, 0, 1.020], [0, 0, 0, 1.0]])
"""Configuration in equation (63), and configuration and pose at 25 s, as printed in the papers."""
DESCENT = 2.166
HELD = ("theta1", "l_HI", "l_MN")


def lowered(T, by):
    down = T.copy()
    down[2, 3] -= by
    return down


@pytest.fixture(scope="module")
def robot():
    return chasles.load("well_manipulator")


@pytest.fixture(scope="module")
def process(robot):
    """Return the process of section 5 of the paper.

    In the last stage, four joints satisfy three conditions. The paper does not state a fourth
    condition. Minimum-norm steps from the configuration at 37 s reproduce the printed amplitudes.
    """
    turned = INITIAL + np.radians(30) * np.eye(7)[0]
    ready = robot.ik_numeric(T_READY, robot.actuators(READY), fixed=("theta2", *HELD)).q
    middle, end = lowered(T_READY, DESCENT), lowered(T_READY, 2 * DESCENT)
    return (
        MotionSequence(robot, robot.actuators(INITIAL))
        .move(turned, "constant", space="chain", duration=5)
        .pause(5)
        .move(INITIAL, "constant", space="chain", duration=5)
        .move(robot.chain(ready), "constant", space="chain", duration=10)
        .pause(2)
        .follow(line(T_READY, middle), "constant", fixed=("theta2", *HELD), duration=10)
        .pause(2)
        .follow(line(middle, end), "constant", fixed=HELD, redundancy="minimum_norm", duration=10)
    )


def test_well_process_follows_stages_within_limits(robot, process):
    found = process.sample(100)
    assert len(found.t) == 4901
    assert found.t[-1] == pytest.approx(49)
    assert np.abs(robot.constraint(robot.configuration(found.q))).max() < 1e-12
    descending = (found.stage == 5) | (found.stage == 7)
    np.testing.assert_allclose(found.T[descending][:, :2, 3], [[1.237, 0]] * 2001, atol=1e-9)
    np.testing.assert_allclose(found.T[descending][:, :3, :3], [T_READY[:3, :3]] * 2001, atol=1e-9)
    assert np.allclose(np.diff(found.T[found.stage == 5][:, 2, 3]), -DESCENT / 1000, atol=1e-9)
    assert not limit_violations(robot, found)


def test_process_configurations_match_paper(robot, process):
    found = process.sample(1)
    theta = np.degrees(robot.chain(found.q))
    reach = found.T[:, :3, 3]
    np.testing.assert_allclose(reach[0], [2.25520386894, 0, 0.58384702201], atol=1e-10)
    np.testing.assert_allclose(reach[5], [1.95306384122, 1.12760193447, 0.58384702201], atol=1e-10)
    at_37 = [0, 88.79, -100.56101055, 0, -88.57420215, 0, 12.5552127]
    np.testing.assert_allclose(theta[37], at_37, atol=1e-6)
    lengths = 1000 * found.q[37][[1, 2, 4, 6]]
    np.testing.assert_allclose(
        lengths, [676.1398945, 921.8775013, 762.1369402, 546.4268791], atol=1e-5
    )


def test_process_rates_match_paper(robot, process):
    found = process.sample(10)
    theta_rates = np.degrees(robot.chain_rates(found.q, found.qd))
    np.testing.assert_allclose(
        theta_rates[200][[2, 4, 6]], [3.794155491, -4.300606998, 0.506451507], atol=1e-7
    )
    begins = np.flatnonzero(found.stage == 5)[0]
    expected = [-8.284193124, -1.926209727, 10.210402851]
    np.testing.assert_allclose(theta_rates[begins][[2, 4, 6]], expected, atol=1e-6)
    lengths = 1000 * found.qd[begins][[2, 4, 6]]
    np.testing.assert_allclose(lengths, [14.716898778, 1.634283733, -29.628184448], atol=1e-6)


def test_process_amplitudes_match_paper(robot, process):
    found = process.sample(100)
    theta = np.degrees(robot.chain(found.q))
    printed = [30, 81, 98, 132, 55]
    np.testing.assert_allclose(np.ptp(theta, axis=0)[[0, 1, 2, 4, 6]], printed, atol=0.5)
    lengths = 1000 * np.ptp(found.q, axis=0)[[1, 2, 4, 6]]
    np.testing.assert_allclose(lengths, [348.9, 302.7, 318.9, 123.2], atol=0.05)
    # The first printed amplitude was computed with two swapped coordinates of B, as in equation
    # (64).
    np.testing.assert_allclose(lengths[1:], [302, 319, 123], atol=1)


def test_sequence_reports_rate_jumps_at_stage_ends(process):
    jumps = process.jumps()
    assert {name for _, name, _, _ in jumps} == {"rate"}
    assert [stage for stage, *_ in jumps] == [0, 0, 2, 2, 3, 3, 5, 5, 7, 7]
    times = [time for *_, time, _ in jumps]
    np.testing.assert_allclose(times, [0, 5, 10, 15, 15, 25, 27, 37, 39, 49], atol=1e-12)


def test_curve_that_starts_away_from_tool_is_rejected(robot):
    start = MotionSequence(robot, robot.actuators(INITIAL))
    with pytest.raises(
        InputValueError,
        match=r"the curve must start at the tool pose; positions differ by 1\.11 m, rotations",
    ):
        start.follow(line(T_READY, lowered(T_READY, 0.1)), "cubic", duration=1)


CORNERS = np.array(
    [[0, -1, 1.2, -0.4, 0.5, 0], [0.3, -1, 1.2, -0.4, 0.5, 0], [0.3, -1, 1.2, 0, 1, 0]]
)


def test_followed_plan_stops_at_its_corners():
    arm, plan = chasles.load("ur5e"), plan_along(CORNERS, 0)
    sequence = MotionSequence(arm, CORNERS[0]).follow(plan, "quintic", duration=3, name="away")
    assert [stage.name for stage in sequence._stages] == ["away 1", "away 2"]
    assert sequence.duration == pytest.approx(3)
    found = sequence.sample(1000)
    for corner in CORNERS:
        k = int(np.argmin(np.abs(found.q - corner).max(1)))
        np.testing.assert_allclose(found.q[k], corner, atol=1e-4)
        assert np.abs(found.qd[k]).max() < 2e-2
    np.testing.assert_allclose(sequence.q_end, CORNERS[-1], atol=1e-12)
    slow = MotionSequence(arm, CORNERS[0]).follow(plan, "trapezoidal", speed=0.1, acceleration=1)
    assert np.linalg.norm(slow.sample().qd, axis=1).max() == pytest.approx(0.1)


def test_plan_without_path_or_from_elsewhere_is_not_followed():
    arm = chasles.load("ur5e")
    with pytest.raises(InputValueError, match="the plan has no path: goal blocked"):
        MotionSequence(arm, CORNERS[0]).follow(no_plan(6, "goal blocked"), "cubic", duration=1)
    with pytest.raises(InputValueError, match=r"start at q_end; it differs by 0\.3 rad or m"):
        MotionSequence(arm, CORNERS[1]).follow(plan_along(CORNERS, 0), "cubic", duration=1)
