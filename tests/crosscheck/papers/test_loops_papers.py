"""Robots with loops reproduce the values that are printed in their papers.

If a paper and its recomputation differ, the paper rounds too early or contains an error. Tests of
printed numbers compare only the printed digits.
"""

from functools import cache

import numpy as np
import pytest

import chasles
from tests.support.tolerances import PRINTED_9

MM, DEG = 1e-3, np.pi / 180


@cache
def robot(name):
    return chasles.load(name)


# --- the well manipulator: states at 0, 25 and 37 s, printed to 1e-7 mm and degrees ---

WELL = {
    0: (
        [88.79, -49.2, -86.76, -40.62],
        [676.1398945, 748.2321208, 757.8045934, 668.0745509],
        [97.6300533, -3.7476803, 2.5048179, -46.5039847],
    ),
    25: (
        [88.79, -11.25844509, -129.76606998, -35.55548493],
        [676.1398945, 643.5014571, 829.8580386, 653.2639794],
        [97.6300533, -10.3861568, -5.367422, -41.2434955],
    ),
    37: (
        [88.79, -100.56101055, -88.57420215, 12.5552127],
        [676.1398945, 921.8775013, 762.1369402, 546.4268791],
        [97.6300533, -5.7127645, 2.2327224, 15.2850872],
    ),
}
HALF = 0.5e-7
"""Half a unit in the last digit of a printed length (mm) or swing angle (degree)."""


def well_q(theta1, lengths):
    l1, l2, l3, l4 = np.array(lengths) * MM
    return np.array([theta1 * DEG, l1, l2, 0.0, l3, 0.0, l4])


def well_theta(theta1, angles):
    t2, t3, t5, t7 = np.array(angles) * DEG
    return np.array([theta1 * DEG, t2, t3, 0.0, t5, 0.0, t7])


@pytest.mark.parametrize("theta1", [0.0, 30.0])
@pytest.mark.parametrize("time", WELL)
def test_well_manipulator_cylinders_and_joints_match_paper(time, theta1):
    r = robot("well_manipulator")
    angles, lengths, swings = WELL[time]
    q, theta = well_q(theta1, lengths), well_theta(theta1, angles)
    found = r.actuators(theta)[[1, 2, 4, 6]] / MM
    # The joint angles are rounded to 1e-8 degrees, which moves a point at a distance of one meter
    # by 1e-7 mm.
    assert found == pytest.approx(lengths, abs=4 * HALF)
    # The tolerance is the effect of rounded lengths on the joint values, plus half a unit in the
    # last digit of an angle.
    slack = np.abs(r.chain_D_q(q)).sum(1) * HALF * MM + HALF * DEG
    assert (np.abs(r.chain(q) - theta) <= slack).all()
    passive = r.passive(r.actuators(theta)) / DEG
    assert passive == pytest.approx(swings, abs=2 * HALF)


def test_well_manipulator_tool_position_matches_paper():
    r = robot("well_manipulator")
    angles, _, _ = WELL[0]
    for theta1, R, printed in (
        (0.0, [2255.20386894, 0.0, 583.84702201], None),
        (30.0, [1953.06384122, 1127.60193447, 583.84702201], [1952.7, 1127.4, 583.8]),
    ):
        q = r.actuators(well_theta(theta1, angles))
        tip = r.fk(q)[:3, 3] / MM
        assert tip == pytest.approx(R, abs=1e-8)
        if printed:
            # The paper rounds intermediate results, so the printed tip position has an error of 0.4
            # mm at a distance of 2 m.
            assert tip == pytest.approx(printed, abs=0.5)
    # The arm is bent so that the tool points down.
    assert r.fk(q)[:3, 0] == pytest.approx([0, 0, -1], abs=1e-12)


def test_well_manipulator_stage_4_rates_match_paper():
    """Initially, the joint velocities sum to zero, so the tool does not rotate."""
    r = robot("well_manipulator")
    printed = np.array([3.794155491, -4.300606998, 0.506451507])
    assert printed.sum() == pytest.approx(0.0, abs=1e-9)
    check_rates(r, WELL[0][0], printed)
    # The joint velocities are constant from t = 15 s to t = 25 s.
    start, end = (np.array(WELL[t][0])[1:] for t in (0, 25))
    assert start + 10 * printed == pytest.approx(end, abs=2e-8)


@pytest.mark.parametrize(
    ("time", "height"), [(25, 1020.0), (37, 1020.0 - 2166.0)], ids=["25 s", "37 s"]
)
def test_well_manipulator_tool_pose_over_well_matches_paper(time, height):
    """The rotation of the tool must equal the matrix 0_R_7 printed in the paper.

    The position tolerance is 1e-6 mm, because an angle of 1e-8 degrees corresponds to 5e-7 mm at a
    distance of 3 m.
    """
    r = robot("well_manipulator")
    T = r.fk(r.actuators(well_theta(0.0, WELL[time][0])))
    assert T[:3, 3] / MM == pytest.approx([1237.0, 0.0, height], abs=1e-6)
    assert T[:3, :3] == pytest.approx(np.array([[0, 1, 0], [0, 0, -1], [-1, 0, 0]]), abs=1e-9)


def test_well_manipulator_rates_after_27_s_match_paper():
    r = robot("well_manipulator")
    printed = np.array([-8.284193124, -1.926209727, 10.210402851])
    cylinders = np.array([14.716898778, 1.634283733, -29.628184448])
    found = check_rates(r, WELL[25][0], printed)
    assert found == pytest.approx(cylinders, abs=2e-7)
    theta = well_theta(0.0, WELL[25][0])
    t3, t5, t7 = printed * DEG
    qd = r.actuator_rates(theta, np.array([0, 0, t3, 0, t5, 0, t7]))
    down = r.twist_mixed(r.actuators(theta), qd)
    # The tool moves down vertically at a constant 216.6 mm/s, without rotation.
    assert down[:3] / MM == pytest.approx([0, 0, -216.6], abs=1e-6)


def check_rates(r, angles, rates):
    """Return cylinder speeds (mm/s) for joint rates (deg/s), and check the inverse map."""
    theta = well_theta(0.0, angles)
    t3, t5, t7 = rates * DEG
    thetad = np.array([0, 0, t3, 0, t5, 0, t7])
    qd = r.actuator_rates(theta, thetad)
    q = r.actuators(theta)
    np.testing.assert_allclose(r.chain_rates(q, qd), thetad, atol=1e-14)
    np.testing.assert_allclose(r.twist_mixed(q, qd)[3:], 0, atol=1e-10)
    return qd[[2, 4, 6]] / MM


# --- the board installer: screws of the paper with reconstructed lengths ---

BOARDS = {
    "R0": (
        [0.0] * 6,
        [0.0] * 8,
        [[1, 0, 0, 1.5], [0, 1, 0, 0], [0, 0, 1, 1.24], [0, 0, 0, 1]],
        [
            [0.0, -4.0, 0.0, 0.0, 8.352333894, 0.0],
            [0.0, 0.0, 0.0, -1.1, 0.0, 1.24],
            [0.0, 0.0, 0.8, 0.0, -8.217618831, 0.0],
            [0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
            [0.0, 0.0, 0.0, 0.0, -6.735753141, 0.0],
            [1.0, 0.0, 0.0, 1.0, 0.0, 0.0],
        ],
        {(2, 1): 5.0, (3, 1): -5.0, (3, 2): 0.666666667, (4, 2): -0.666666667, (6, 4): 6.735753141},
    ),
    "T1": (
        [0.34906585, 0.03, 0.174532925, -0.34906585, 0.02, 0.0],
        [
            *(0.34906585, 0.03, 0.153260366, -0.027395016),
            *(-0.12586535, -0.34906585, 0.136203735, 0.0),
        ],
        [
            [0.990738602, 0.0, -0.135782995, 1.306884743],
            [0.0, 1.0, 0.0, 0.331022897],
            [0.135782995, 0.0, 0.990738602, 1.416937781],
            [0, 0, 0, 1],
        ],
        [
            [0.0, -3.758770483, -0.130540729, 0.331022897, 9.514842421, 0.04494728],
            [0.0, -1.368080573, -0.04751294, -0.909477934, 0.0, 1.226362232],
            [0.0, 0.0, 0.787846202, 0.0, -7.103625067, -0.327957162],
            [0.0, 0.0, 0.0, 0.0, 0.0, 0.990738602],
            [0.0, 0.0, 0.0, 0.0, -6.900220811, 0.0],
            [1.0, 0.0, 0.0, 1.0, 0.0, 0.135782995],
        ],
        {
            **{(2, 1): 4.962309, (2, 2): 0.038933301, (3, 1): -4.325982372, (3, 2): 0.627832714},
            **{(4, 1): -0.636326628, (4, 2): -0.666766016, (6, 4): 6.900220811},
        },
    ),
    "T2": (
        [-0.610865238, -0.06, -0.261799388, 0.436332313, -0.03, 0.20943951],
        [
            *(-0.610865238, -0.06, -0.288224698, 0.149610191),
            *(0.138614507, 0.436332313, -0.200552588, 0.20943951),
        ],
        [
            [0.965068903, 0.210642581, 0.155793826, 1.463730419],
            [-0.170167686, 0.956095134, -0.238589719, -0.821441844],
            [-0.199210873, 0.203744443, 0.958542242, 0.977165719],
            [0, 0, 0, 1],
        ],
        [
            [0.0, -3.276608177, 0.16960972, -0.75295711, 6.790173107, 0.329922176],
            [0.0, 2.294305745, -0.118762004, -1.075334196, -1.197290723, 1.234623264],
            [0.0, 0.0, 0.772740661, 0.0, -8.74258229, 0.54366836],
            [0.0, 0.0, 0.0, 0.0, -1.159104305, 0.965068903],
            [0.0, 0.0, 0.0, 0.0, -6.573607171, -0.170167686],
            [1.0, 0.0, 0.0, 1.0, 0.0, -0.199210873],
        ],
        {
            **{(2, 1): 5.007984829, (2, 2): -0.099409334, (3, 1): -6.205742183},
            **{(3, 2): 0.773371912, (4, 1): 1.197757354, (4, 2): -0.673962579},
            (6, 4): 6.675015658,
        },
    ),
}
MOVED_ALONG = {(0, 0): 1.0, (1, 1): 1.0, (5, 3): 1.0, (7, 5): 1.0}
"""Expected derivatives of the actuated main-chain joints, keyed by row and column of ``chain_D_q``.
"""


@pytest.mark.parametrize("case", BOARDS)
def test_board_installer_matches_paper_cases(case):
    q, chain, T, J, slopes = (np.array(x) if isinstance(x, list) else x for x in BOARDS[case])
    r = robot("board_installer")
    D = np.zeros((8, 6))
    for (row, column), value in (MOVED_ALONG | slopes).items():
        D[row, column] = value
    # The tolerance follows from the coordinates, which are rounded to nine decimal places.
    H = np.abs(r.jacobian_space(q + 1e-4) - r.jacobian_space(q)).sum() / 1e-4
    slack = PRINTED_9 * (1 + np.abs(D).sum(1))
    assert (np.abs(r.chain(q) - chain) <= slack).all()
    bent = np.abs(r.chain_D_q(q + 1e-4) - r.chain_D_q(q)).sum() / 1e-4
    assert np.abs(r.chain_D_q(q) - D).max() <= PRINTED_9 * (1 + bent)
    assert np.abs(r.jacobian_space(q) - J).max() <= PRINTED_9 * (1 + H)
    assert np.abs(r.fk(q) - T).max() <= PRINTED_9 * (1 + 2 * np.abs(J).sum(1).max())
    assert np.abs(r.actuators(r.chain(q)) - q).max() < 1e-12


def screw_exp(xi, theta):
    """Return the exponential of a screw (v; omega) by Rodrigues' formula."""
    v, w = np.array(xi[:3], float), np.array(xi[3:], float)
    T = np.eye(4)
    if not w.any():
        T[:3, 3] = v * theta
        return T
    W = np.cross(np.eye(3), w)
    R = np.eye(3) + np.sin(theta) * W + (1 - np.cos(theta)) * W @ W
    T[:3, :3] = R
    T[:3, 3] = (np.eye(3) - R) @ np.cross(w, v) + np.outer(w, w) @ v * theta
    return T


def test_board_installer_arm_only_translates():
    """The exponentials of joints 2 to 5 multiply to a translation.

    The translation is (k r (cos q3 - 1) - (k - 1) q2, 0, k r sin q3), with pantograph ratio k and
    link length r.
    """
    r = robot("board_installer")
    L1, L2, k, z_G, g0, crank = 1.0, 1.2, 5, 0.54, -0.2, 0.16
    z_W, x_W = z_G + L1, g0 + L2
    screws = [
        (1, 0, 0, 0, 0, 0),
        (z_G, 0, -g0, 0, -1, 0),
        (z_W, 0, -g0, 0, -1, 0),
        (z_W, 0, -x_W, 0, -1, 0),
    ]
    q = np.random.default_rng(0).uniform(r.lower, r.upper, (500, 6))
    for row, theta in zip(q, r.chain(q), strict=True):
        arm = np.eye(4)
        for xi, value in zip(screws, theta[1:5], strict=True):
            arm = arm @ screw_exp(xi, value)
        expected = np.eye(4)
        q2, q3 = row[1], row[2]
        expected[:3, 3] = k * crank * (np.cos(q3) - 1) - (k - 1) * q2, 0, k * crank * np.sin(q3)
        np.testing.assert_allclose(arm, expected, atol=1e-14)


def test_board_installer_fk_matches_product_of_exponentials():
    r = robot("board_installer")
    z_W, x_W = 1.54, 1.0
    x6, z_C = x_W + 0.1, z_W - 0.3
    x_C = x6 + 0.12
    screws = [
        (0, 0, 0, 0, 0, 1),
        (1, 0, 0, 0, 0, 0),
        (0.54, 0, 0.2, 0, -1, 0),
        (z_W, 0, 0.2, 0, -1, 0),
        (z_W, 0, -x_W, 0, -1, 0),
        (0, -x6, 0, 0, 0, 1),
        (z_C, 0, -x_C, 0, -1, 0),
        (0, z_C, 0, 1, 0, 0),
    ]
    home = np.eye(4)
    home[:3, 3] = x_C + 0.28, 0, z_C
    q = np.random.default_rng(1).uniform(r.lower, r.upper, (300, 6))
    for row, theta in zip(q, r.chain(q), strict=True):
        T = np.eye(4)
        for xi, value in zip(screws, theta, strict=True):
            T = T @ screw_exp(xi, value)
        np.testing.assert_allclose(r.fk(row), T @ home, atol=1e-13)
        # The law of cosines gives the length of the board installer's push rod.
        l0 = np.sqrt(0.24**2 + 0.15**2 - 0.24 * 0.15)
        square = 0.24**2 + 0.15**2 - 2 * 0.24 * 0.15 * np.cos(np.pi / 3 + theta[6])
        assert (l0 + row[4]) ** 2 == pytest.approx(square, abs=1e-14)


# --- the planar platform ---

LEGS = {
    "planar_3rrr": [
        [78.52393138, 0.16983617],
        [176.46904472, 88.26254206],
        [-29.82437852, -129.56592854],
    ],
    "planar_3rrr_170": [
        [92.25700039, -13.56323285],
        [-168.79837185, 73.52995863],
        [-8.8931441, -150.49716296],
    ],
}


@pytest.mark.parametrize("name", LEGS)
def test_planar_leg_angles_match_published_values(name):
    pose = [0.02, 0.05, 0.0]
    solutions = robot(name).ik_planar(pose)
    assert (solutions.valid | solutions.other_mode).all()
    found = np.degrees(solutions.q)
    for leg, printed in enumerate(LEGS[name]):
        for angle in printed:
            apart = np.abs((found[:, leg] - angle + 180) % 360 - 180)
            assert (apart < 0.6e-8).sum() == 4


def test_planar_platform_modes_match_published_values():
    r = robot("planar_3rrr")
    q = np.radians([legs[0] for legs in LEGS["planar_3rrr"]])
    x, valid = r.fk_planar_all(q)
    assert valid.sum() == 2
    other, same = x[valid]
    np.testing.assert_allclose(same, [0.02, 0.05, 0.0], atol=1e-9)
    found = [*(other[:2] / MM), np.degrees(other[2])]
    assert found == pytest.approx([-24.50036954, 36.52683962, -67.51350084], abs=1e-6)
    np.testing.assert_allclose(r.chain(q), same, atol=1e-12)


AREAS = {
    ("planar_3rrr", 0): 64785.990758,
    ("planar_3rrr", 30): 49662.293227,
    ("planar_3rrr_170", 30): 89107.925046,
}


@pytest.mark.parametrize(("name", "degrees"), AREAS)
def test_constant_orientation_area_matches_published_value(name, degrees):
    """Compute the area from the number of grid poses that all legs reach.

    The area error is the boundary length times the cell width.
    """
    step = 0.0015
    x = np.arange(-0.25, 0.25, step)
    grid = np.stack([*np.meshgrid(x, x), np.full((len(x), len(x)), np.radians(degrees))], -1)
    area = robot(name).chain_closes(grid).sum() * step**2 / MM**2
    assert area == pytest.approx(AREAS[name, degrees], rel=2e-3)


# --- the bricklaying gantry ---

INCH = 0.0254


def test_gantry_position_is_motor_angle_times_radius():
    r = robot("bricklaying_gantry")
    radii = np.array([0.01, 0.01, 0.015])
    q = np.random.default_rng(2).uniform(r.lower, r.upper, (100, 3))
    np.testing.assert_allclose(r.fk(q)[:, :3, 3], q * radii, atol=1e-15)
    xyz = r.fk(q)[:, :3, 3]
    names = [joint.name for joint in r.chain_joints]
    theta = xyz[:, ["xyz".index(name) for name in names]]
    np.testing.assert_allclose(r.chain(q), theta, atol=1e-16)
    np.testing.assert_allclose(r.actuators(theta), q, atol=1e-13)
    qd = np.ones(3)
    np.testing.assert_allclose(r.twist_mixed(q, qd)[:, :3], np.tile(radii, (100, 1)), atol=1e-16)


EXACT = [
    (1.09, 4.97, 77.629973623, 5.088123426, 0.067744932),
    (2.04, 5.02, 67.884429004, 5.418671424, 0.05924034),
    (2.99, 5.01, 59.170977563, 5.834397998, 0.051636419),
    (4.03, 4.98, 51.018936476, 6.406348414, 0.044522421),
    (5.13, 5.04, 44.492970939, 7.19155755, 0.038827442),
    (1.01, 1.04, 45.838414974, 1.449724112, 0.040001563),
    (1.99, 2.03, 45.570088445, 2.842709975, 0.039767404),
    (3.01, 3.02, 45.095017789, 4.263859754, 0.039352827),
    (3.97, 4.01, 45.287194485, 5.642783001, 0.039520533),
    (5.01, 5.06, 45.284485147, 7.12065306, 0.039518168),
]


@pytest.mark.parametrize(
    ("x", "y", "theta", "r", "omega"), EXACT, ids=[f"{x} in, {y} in" for x, y, *_ in EXACT]
)
def test_gantry_drop_positions_match_paper(x, y, theta, r, omega):
    gantry = robot("bricklaying_gantry")
    names = [joint.name for joint in gantry.chain_joints]
    spot = {"x": x * INCH, "y": y * INCH, "z": 0.0}
    tip = gantry.fk(gantry.actuators([spot[name] for name in names]))[:2, 3] / INCH
    assert np.degrees(np.arctan2(tip[1], tip[0])) == pytest.approx(theta, abs=PRINTED_9)
    assert np.hypot(*tip) == pytest.approx(r, abs=PRINTED_9)
    assert np.arctan2(tip[1], tip[0]) / 20 == pytest.approx(omega, abs=PRINTED_9)


def test_bricklaying_planar_arm_reaches_paper_target():
    """The planar arm with links of 7, 5 and 5 inches reaches the point (11, 8) inches.

    The last link lies on the line from the base to the target.
    """
    r = robot("bricklaying_planar")
    line, distance = np.arctan2(8, 11), np.sqrt(185) - 5
    A = np.arccos((7**2 + distance**2 - 5**2) / (2 * 7 * distance))
    B = np.arccos((7**2 + 5**2 - distance**2) / (2 * 7 * 5))
    assert np.degrees([A, line]) == pytest.approx([35.5, 36.03], abs=0.05)
    # The paper computes the elbow angle from a rounded distance.
    rounded = np.arccos((7**2 + 5**2 - 8.61**2) / (2 * 7 * 5))
    assert np.degrees(rounded) == pytest.approx(90.11, abs=0.005)
    for side in (1, -1):
        shoulder, elbow = line + side * A, side * (B - np.pi)
        q = [shoulder, elbow, line - shoulder - elbow]
        assert r.fk(q)[:2, 3] / INCH == pytest.approx([11, 8], abs=1e-13)
        wrist = r.link_poses(q)[1, :2, 3] / INCH
        assert wrist == pytest.approx([6.96, 5.06], abs=0.01)
        assert np.hypot(*wrist) == pytest.approx(8.61, abs=0.01)
