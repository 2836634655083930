"""The 49 s motion of the well manipulator agrees with the statements of the paper."""

import numpy as np
import pytest
import well_manipulator as paper
import well_process as laws

import chasles

MM = 1e-3


def test_tool_descends_vertically_with_constant_orientation():
    found = paper.process()
    sampled = found.sampled
    down = sampled.t >= 25
    assert down.sum() == 24 * paper.RATE + 1
    T = sampled.T[down]
    np.testing.assert_allclose(
        T[:, :3, :3], np.tile(paper.OVER_THE_WELL[:3, :3], (len(T), 1, 1)), atol=1e-10
    )
    np.testing.assert_allclose(T[:, :2, 3], np.tile([1.237, 0], (len(T), 1)), atol=1e-10)
    t = sampled.t[down]
    moved = 0.2166 * (np.clip(t - 27, 0, 10) + np.clip(t - 39, 0, 10))
    np.testing.assert_allclose(T[:, 2, 3], 1.02 - moved, atol=1e-10)


def test_loops_close_and_telescopes_stay_at_zero():
    found, well = paper.process(), paper.robot()
    np.testing.assert_allclose(well.constraint(well.configuration(found.sampled.q)), 0, atol=1e-12)
    np.testing.assert_allclose(found.theta[:, [3, 5]], 0, atol=1e-13)
    still = found.sampled.t < 39
    np.testing.assert_allclose(found.theta[still, 1], np.radians(88.79), atol=1e-12)


def test_rates_match_finite_differences_of_angles():
    found = paper.process()
    t, stage = found.sampled.t, found.sampled.stage
    inside = np.r_[False, np.diff(stage) == 0] & np.r_[np.diff(stage) == 0, False]
    inside[-1] = False
    for values, rates in ((found.theta, found.rates), (found.sampled.q, found.sampled.qd)):
        slopes = np.gradient(values, t, axis=0)
        # The error of the difference quotient is step^2 / 6 times the third derivative. The third
        # derivative is below 0.5/s^3.
        np.testing.assert_allclose(slopes[inside], rates[inside], atol=0.1 / paper.RATE**2)


@pytest.mark.parametrize("norm", [laws.joint_norm, laws.cylinder_norm])
def test_integrated_rates_follow_the_line_and_have_minimum_norm(norm):
    found, well = laws.integrated(norm), paper.robot()
    last = found.sampled.t > 38.99
    theta, rates = found.theta[last], found.rates[last][:, paper.ARMS]
    down = 1.02 - 2.166 - 0.2166 * (found.sampled.t[last] - 39)
    expected = np.stack([np.full(len(down), 1.237), np.zeros(len(down)), down], axis=1)
    np.testing.assert_allclose(found.sampled.T[last, :3, 3], expected, atol=1e-8)
    by_chain = well.actuators_D_chain(theta)
    J = (well.jacobian_mixed(found.sampled.q[last]) @ by_chain)[:, :, paper.ARMS]
    still = np.linalg.svd(J[:, [0, 2, 4]])[2][:, -1]
    by_norm = np.array([norm(own) for own in by_chain])
    along = np.einsum("mki,mi,mkj,mj->m", by_norm, still, by_norm, rates)
    np.testing.assert_allclose(along, 0, atol=1e-12)


def test_start_within_the_digits_reaches_the_object():
    assert np.abs(np.degrees(paper.SHIFT)).max() < 0.005
    theta = np.radians([30, 88.79, -49.2, 0, -86.76, 0, -40.62])
    theta[paper.ARMS] += paper.SHIFT
    own = paper.robot().fk(paper.robot().actuators(theta))[:3, 3] / MM
    np.testing.assert_allclose(own, [1952.7, 1127.4, 583.8], atol=0.05)


def test_cylinder_amplitudes_match_printed_and_corrected_pin():
    theta2 = paper.process().theta[:, 1]
    C = np.stack(
        [
            -209 * np.cos(theta2) - 170.8 * np.sin(theta2),
            np.zeros(len(theta2)),
            1030 - 209 * np.sin(theta2) + 170.8 * np.cos(theta2),
        ],
        axis=1,
    )
    ranges = {
        pin: np.ptp(np.linalg.norm(C - pin, axis=1))
        for pin in ((-85.4, 154.5, 0.0), (-85.4, 0.0, 154.5))
    }
    assert list(ranges.values()) == pytest.approx([344.486, 348.918], abs=1e-3)
    (row,) = (own for own in paper.rows() if own.item == "amplitude of the length of cylinder 1")
    assert row.ours == pytest.approx(ranges[-85.4, 0.0, 154.5], abs=1e-8)
    assert f"gives {ranges[-85.4, 154.5, 0.0]:.2f} mm" in row.note


def test_speed_printed_for_cylinder_4_belongs_to_cylinder_3():
    """The value that the paper prints for cylinder 4, 2408 mm deg/s, belongs to cylinder 3."""
    speeds = np.degrees(np.ptp(paper.process().sampled.qd[:, paper.CYLINDERS], axis=0)) / MM
    assert speeds[2] == pytest.approx(2408, abs=1)
    assert np.abs(speeds[[0, 1, 3]] - 2408).min() > 300


def test_known_errors_have_their_verdicts():
    verdicts = {(row.item, row.where): row.verdict for row in paper.rows()}
    for item, where in (
        ("r_B", "(64)"),
        ("z of R after 39 s", "section 5, step 8"),
        ("0_7_p, the position of frame 7", "(36)"),
        ("coordinate systems 3 to 7", "section 4.1"),
        ("discontinuous points of model (6), which give equation (7)", "section 3.1, above (7)"),
        ("third term of the series of a rotation, at omega^3", "(5)"),
    ):
        assert verdicts[item, where] == "erratum"
    for k in (8, 9, 10, 11):
        verdict = verdicts[f"amplitude of theta{k}", "section 5, figure 8"]
        assert verdict == "not reproducible"
    assert chasles.load("well_manipulator").parameters["B_z"].value == 0.1545
