"""Diagnosis of wrong signs, columns, rows and targets."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from chasles import se3
from chasles.calibration import Poses, Positions, identify
from chasles.calibration.measurements.quaternions import quaternions, rotations
from chasles.errors import InputValueError
from tests.support.measured_arms import drawn

NOISE = 2e-5
ARMS = ("ur5e", "stanford")
"""The test arms: an arm with parallel axes, and an arm with crossed axes and a prismatic joint."""
ONE_ARM = pytest.mark.parametrize("case", ["stanford"], indirect=True)
"""Mistakes in the measurement table or in the device setup, which can occur with every arm."""


@pytest.fixture(params=ARMS)
def case(loaded, request):
    """Return a robot, its coordinates and measured positions."""
    robot = loaded(request.param)
    truth = drawn(robot, 3, zero=0.02, count=24)
    points = truth.positions(robot, truth.q)
    return robot, truth.q, points + NOISE * np.random.default_rng(0).normal(size=points.shape)


def found(robot, q, points):
    return identify(robot, q, Positions(points, NOISE))


def test_good_measurements_raise_no_diagnostics(case):
    assert found(*case).warnings == ()


def test_reversed_joint_sign_is_diagnosed(case):
    robot, q, points = case
    k = np.random.default_rng(2).integers(robot.n)
    signs = np.where(np.arange(robot.n) == k, -1, 1)
    name = robot.coordinates[k].name
    with pytest.raises(InputValueError, match=f"the sign of {name} is reversed"):
        found(robot, signs * q, points)


@ONE_ARM
def test_exchanged_joint_columns_are_diagnosed(case):
    robot, q, points = case
    i, j = sorted(np.random.default_rng(1).choice(robot.n, 2, replace=False))
    order = np.arange(robot.n)
    order[[i, j]] = j, i
    names = robot.coordinates[i].name, robot.coordinates[j].name
    with pytest.raises(InputValueError, match=f"columns of {names[0]} and {names[1]} are swap"):
        found(robot, q[:, order], points)


@pytest.mark.parametrize(
    ("case", "sign", "word"),
    [("ur5e", 1, "added to"), ("stanford", -1, "subtracted from")],
    indirect=["case"],
)
def test_coupled_joint_column_is_diagnosed(case, sign, word):
    """Some controllers report the angle between forearm and floor as a joint value."""
    robot, q, points = case
    turning = [k for k in range(robot.n) if robot.coordinates[k].unit == "rad"]
    pairs = [(i, j) for i in turning for j in turning if 0 < j - i <= 2]
    i, j = np.random.default_rng(6).permutation(pairs)[0]
    names = robot.coordinates[i].name, robot.coordinates[j].name
    wrong = q.copy()
    wrong[:, j] += sign * q[:, i]
    with pytest.raises(InputValueError, match=f"if {names[0]} is {word} {names[1]}. Corr"):
        found(robot, wrong, points)


@pytest.mark.parametrize(("case", "degrees"), [("ur5e", 90), ("stanford", -90)], indirect=["case"])
def test_wrong_joint_zero_is_diagnosed(case, degrees):
    robot, q, points = case
    k = next(k for k in range(1, robot.n - 1) if robot.coordinates[k].unit == "rad")
    wrong = q.copy()
    wrong[:, k] += np.radians(degrees)
    name = robot.coordinates[k].name
    try:
        said = " ".join(found(robot, wrong, points).warnings)
    except InputValueError as error:
        said = str(error)
    assert f"zero of {name} is off by {degrees} deg" in said or "check its zero offset" in said


def test_two_simultaneous_mistakes_are_diagnosed(loaded):
    """The sign of joint 3 is reversed, and the value of joint 2 is added to it."""
    robot = loaded("ur5e")
    truth = drawn(robot, 3, zero=0.01, count=24)
    wrong = truth.q.copy()
    wrong[:, 2] = -wrong[:, 2] + wrong[:, 1]
    measured = Poses(truth.poses(robot, truth.q), (NOISE, NOISE))
    with pytest.raises(InputValueError, match=r"better if .*, and ") as raised:
        identify(robot, wrong, measured)
    assert robot.coordinates[2].name in str(raised.value)


@ONE_ARM
def test_rows_shifted_by_one_are_diagnosed(case):
    robot, q, points = case
    with pytest.raises(InputValueError, match="coordinates are one row too late"):
        found(robot, q[:-1], points[1:])
    with pytest.raises(InputValueError, match="coordinates are one row too early"):
        found(robot, q[1:], points[:-1])


@ONE_ARM
def test_left_handed_device_frame_is_diagnosed(case):
    robot, q, points = case
    for mirrored in (points[..., [1, 0, 2]], -points):
        with pytest.raises(InputValueError, match="the device frame is left-handed"):
            found(robot, q, mirrored)


def test_prismatic_coordinates_in_millimeters_are_diagnosed(loaded):
    robot = loaded("stanford")
    truth = drawn(robot, 3, count=24)
    slides = np.array([c.unit == "m" for c in robot.coordinates])
    with pytest.raises(InputValueError, match="prismatic coordinates are in millimeters"):
        found(robot, np.where(slides, 1e3, 1) * truth.q, truth.positions(robot, truth.q))


@ONE_ARM
def test_exchanged_targets_in_one_row_are_diagnosed(case):
    robot, q, points = case
    points[5] = points[5, [2, 1, 0]]
    assert found(robot, q, points).warnings == ("measurement 6: targets 1 and 3 are swapped",)


@ONE_ARM
def test_joint_coordinates_from_another_row_are_diagnosed(case):
    robot, q, points = case
    wrong = q.copy()
    wrong[7] = q[8]
    (said,) = found(robot, wrong, points).warnings
    assert said.startswith("measurement 8: all 3 targets are off, by ")


@ONE_ARM
def test_base_that_moved_during_measurement_is_diagnosed(case):
    robot, q, points = case
    points[:12] += [0.1, 0.0, 0.05]
    said = " ".join(found(robot, q, points).warnings)
    assert "contradict the others" in said or "error after the identification is" in said


@ONE_ARM
def test_joint_that_does_not_move_is_diagnosed(case):
    robot = case[0]
    still = drawn(robot, 4, count=24)
    still.q[:, 3] = 0.4
    result = found(robot, still.q, still.positions(robot, still.q))
    name = robot.coordinates[3].name
    assert any(said.startswith(f"{name} moves by only 0 deg") for said in result.warnings)
    assert result.unidentifiable


@ONE_ARM
def test_too_few_or_repeated_configurations_are_diagnosed(case):
    robot, q, points = case
    with pytest.raises(InputValueError, match="measure more configurations"):
        found(robot, q[:3], points[:3])
    said = " ".join(found(robot, np.tile(q[:5], (8, 1)), np.tile(points[:5], (8, 1, 1))).warnings)
    assert "only 5 of 40 configurations differ" in said


def test_measurements_of_another_robot_are_diagnosed(loaded):
    robot = loaded("ur5e")
    truth, random = drawn(robot, 3, count=12), np.random.default_rng(5)
    other = random.uniform(-1, 1, truth.q.shape)
    result = identify(robot, other, Poses(truth.poses(robot, truth.q), (NOISE, NOISE)))
    assert any("error after the identification is" in said for said in result.warnings)


def as_quaternions(R):
    """Return SciPy's quaternions (w, x, y, z) of rotation matrices, as a reference for chasles."""
    return Rotation.from_matrix(R).as_quat(scalar_first=True)


@pytest.mark.parametrize(
    ("misread", "said"),
    [
        (
            lambda R: Rotation.from_quat(np.roll(as_quaternions(R), -1, -1), scalar_first=True),
            "are written x, y, z, w, not w, x, y, z",
        ),
        (
            lambda R: Rotation.from_quat(np.roll(as_quaternions(R), 1, -1), scalar_first=True),
            "are written w, x, y, z, not x, y, z, w",
        ),
        (
            lambda R: Rotation.from_matrix(R.swapaxes(1, 2)),
            "transform from the device frame to the probe frame",
        ),
    ],
    ids=["xyzw as wxyz", "wxyz as xyzw", "inverse rotation"],
)
def test_misread_orientations_are_diagnosed(loaded, misread, said):
    robot = loaded("stanford")
    truth = drawn(robot, 0, zero=0.02, count=24)
    T = truth.poses(robot, truth.q) @ se3.exp([0.1, 0.2, -0.1, 0.4, 1.0, 0.2])
    assert identify(robot, truth.q, Poses(T, (NOISE, NOISE))).warnings == ()
    T[:, :3, :3] = misread(T[:, :3, :3]).as_matrix()
    with pytest.raises(InputValueError, match=said):
        identify(robot, truth.q, Poses(T, (NOISE, NOISE)))


def test_quaternion_conversion_matches_scipy_and_round_trips():
    R = Rotation.random(500, random_state=0).as_matrix()
    R[:4] = np.eye(3), np.diag([1.0, -1, -1]), np.diag([-1.0, 1, -1]), np.diag([-1.0, -1, 1])
    found = quaternions(R)
    assert np.abs(np.abs((found * as_quaternions(R)).sum(-1)) - 1).max() < 1e-14
    assert np.abs(rotations(found) - R).max() < 1e-14
    assert np.abs(rotations(-3 * found) - R).max() < 1e-14
