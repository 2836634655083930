"""The robots described in five papers agree with independently computed reference values."""

import numpy as np
import pytest

import chasles
from tests.support.tolerances import PRINTED_9

PHOTO_ROBOT = {
    (0, 0, 0, 0, 0, 0, 0, 0): [
        [0, 0, 1, 1.333],
        [0, -1, 0, 0],
        [1, 0, 0, -0.33],
        [0, 0, 0, 1],
    ],
    (0.4, 0.3, -0.5, 0.2, 0.6, -0.7, 0.8, -0.9): [
        [0.937344702, 0.167547179, 0.305471525, 1.602496199],
        [-0.036479699, -0.824758137, 0.564307759, 0.062639415],
        [0.346488299, -0.540094398, -0.766970599, -0.110420206],
        [0, 0, 0, 1],
    ],
}
LYNXMOTION = {
    (50, -25, 45, -60): ([0.15997621, 0.190652223, 0.168544632], 50),
    (60, -30, 50, -55): ([0.118964723, 0.206052945, 0.166117219], 55),
}


def test_photo_robot_fk_matches_paper_in_world_frame():
    robot = chasles.load("photo_robot")
    assert robot.functions["fk"].outputs[0].name == "T_w_ee"
    for q, T_w_ee in PHOTO_ROBOT.items():
        assert np.abs(robot.fk(q) - np.array(T_w_ee)).max() <= PRINTED_9


def test_photo_robot_world_frame_times_paper_pose_equals_fk():
    """Equation (12) of the paper omits the factor A0 from equation (3)."""
    A0 = np.array([[0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
    T_0_ee = [
        [-0.036479699, -0.824758137, 0.564307759, 0.062639415],
        [0.346488299, -0.540094398, -0.766970599, -0.110420206],
        [0.937344702, 0.167547179, 0.305471525, 1.602496199],
        [0, 0, 0, 1],
    ]
    q = (0.4, 0.3, -0.5, 0.2, 0.6, -0.7, 0.8, -0.9)
    T_w_ee = chasles.load("photo_robot").fk(q)
    assert np.abs(T_w_ee - A0 @ np.array(T_0_ee)).max() <= PRINTED_9


@pytest.mark.parametrize("degrees", LYNXMOTION, ids=lambda degrees: " ".join(map(str, degrees)))
def test_lynxmotion_position_and_pitch_match_paper(degrees):
    position, pitch = LYNXMOTION[degrees]
    T = chasles.load("lynxmotion").fk([*np.radians(degrees), 0.0])
    assert np.abs(T[:3, 3] - np.array(position)).max() <= PRINTED_9
    # The tool points along axis z5, so the elevation of z5 is the pitch angle of the tool.
    assert np.degrees(np.arcsin(T[2, 2])) == pytest.approx(pitch, abs=1e-9)


def test_lynxmotion_limits_match_table_1_3():
    robot = chasles.load("lynxmotion")
    expected = [(-90, 90), (30, 150), (-135, 45), (-150, 30)]
    found = np.degrees(np.stack([robot.lower, robot.upper], axis=1))
    np.testing.assert_allclose(found[:4], expected, atol=1e-12)
    assert np.isinf(found[4]).all()
