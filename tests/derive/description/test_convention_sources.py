"""Every link convention agrees with the matrices printed in its cited source."""

import pytest
import sympy as sp

from chasles.derive import read
from tests.support.convention_robots import BY_NAME, equal, motion_matrix, q
from tests.support.derivations import ROBOTS, derivation

a, d, e = sp.symbols("a d e", real=True)
ZERO, ONE, HALF = sp.Integer(0), sp.Integer(1), sp.pi / 2


def test_mdh5_matches_equation_6_of_well_manipulator_paper():
    b, c, alpha, theta = sp.symbols("b c alpha theta", real=True)
    ca, sa, ct, st = sp.cos(alpha), sp.sin(alpha), sp.cos(theta), sp.sin(theta)
    printed = [[ct, -st, 0, a], [ca * st, ca * ct, -sa, b], [sa * st, sa * ct, ca, c], [0, 0, 0, 1]]
    assert equal(motion_matrix("mdh5", theta, a=a, b=b, c=c, alpha=alpha), sp.Matrix(printed))


def test_hayati5_matches_equation_8_of_well_manipulator_paper():
    alpha, beta, theta = sp.symbols("alpha beta theta", real=True)
    Rx, Ry, Rz = (sp.rot_ccw_axis1, sp.rot_ccw_axis2, sp.rot_ccw_axis3)
    R = Rx(alpha) * Ry(beta)
    p = R * sp.Matrix([0, 0, d]) + sp.Matrix([a, 0, 0])
    printed = sp.eye(4)
    printed[:3, :3], printed[:3, 3] = R * Rz(theta), p
    found = motion_matrix("hayati5", theta, a=a, alpha=alpha, beta=beta, d=d)
    assert equal(found, printed)


def test_dh_matches_equation_1_of_photo_robot_paper():
    alpha, theta, r, length = sp.symbols("alpha theta r l", real=True)
    ca, sa, ct, st = sp.cos(alpha), sp.sin(alpha), sp.cos(theta), sp.sin(theta)
    printed = [
        [ct, -ca * st, st * sa, length * ct],
        [st, ca * ct, -ct * sa, length * st],
        [0, sa, ca, r],
        [0, 0, 0, 1],
    ]
    assert equal(motion_matrix("dh", theta, a=length, alpha=alpha, d=r), sp.Matrix(printed))


def test_s_model_matches_equation_2_of_photo_robot_paper():
    alpha, beta, theta, x, y, z = sp.symbols("alpha beta theta x y z", real=True)
    ca, sa, cb, sb = sp.cos(alpha), sp.sin(alpha), sp.cos(beta), sp.sin(beta)
    ct, st = sp.cos(theta), sp.sin(theta)
    printed = [
        [
            cb * ct,
            ct * sa * sb - ca * st,
            sa * st + ca * sb * ct,
            z * (sa * st + ca * sb * ct) - y * (ca * st - ct * sa * sb) + x * cb * ct,
        ],
        [
            cb * st,
            st * sa * sb + ca * ct,
            -sa * ct + ca * sb * st,
            # The S-model paper erroneously prints cos(alpha) cos(beta) instead of cos(alpha)
            # cos(theta).
            -z * (sa * ct - ca * sb * st) + y * (ca * ct + st * sa * sb) + x * cb * st,
        ],
        [-sb, cb * sa, ca * cb, z * ca * cb - x * sb + y * cb * sa],
        [0, 0, 0, 1],
    ]
    given = {"alpha": alpha, "beta": beta, "x": x, "y": y, "z": z}
    assert equal(motion_matrix("s_model", theta, **given), sp.Matrix(printed))


def test_mdh_matches_craig_matrix():
    alpha, theta = sp.symbols("alpha theta", real=True)
    ca, sa, ct, st = sp.cos(alpha), sp.sin(alpha), sp.cos(theta), sp.sin(theta)
    printed = [
        [ct, -st, 0, a],
        [st * ca, ct * ca, -sa, -sa * d],
        [st * sa, ct * sa, ca, ca * d],
        [0, 0, 0, 1],
    ]
    assert equal(motion_matrix("mdh", theta, a=a, alpha=alpha, d=d), sp.Matrix(printed))


def test_hayati_matches_product_of_rotations_in_its_source():
    alpha, beta, theta = sp.symbols("alpha beta theta", real=True)
    Rx, Ry, Rz = (sp.rot_ccw_axis1, sp.rot_ccw_axis2, sp.rot_ccw_axis3)
    printed = sp.eye(4)
    printed[:3, :3] = Rz(theta) * Rx(alpha) * Ry(beta)
    printed[:3, 3] = Rz(theta) * sp.Matrix([a, 0, 0])
    assert equal(motion_matrix("hayati", theta, a=a, alpha=alpha, beta=beta), printed)


def test_photo_robot_fk_equals_product_of_printed_matrices():
    q = sp.symbols("q1:9", real=True)
    r10, r2, l3, r40, r6 = (p.symbol for p in read(ROBOTS / "photo_robot.toml").parameters)

    def turned(angle, tilt, reach=0, rise=0):
        """Return a link transform in the form of equations (5) to (10) of the paper.

        The argument ``tilt`` is the sine of alpha, which is 1 or -1.
        """
        c, s = sp.cos(angle), sp.sin(angle)
        rows = [[c, 0, tilt * s, reach * c], [s, 0, -tilt * c, reach * s]]
        return sp.Matrix([*rows, [0, tilt, 0, rise], [0, 0, 0, 1]])

    half, c, s = sp.pi / 2, sp.cos(q[7]), sp.sin(q[7])
    printed = (
        sp.Matrix([[0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]]),
        sp.Matrix([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, q[0] + r10], [0, 0, 0, 1]]),
        turned(q[1] - half, -1, rise=r2),
        turned(q[2] - half, -1, reach=l3),
        sp.Matrix([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, q[3] + r40], [0, 0, 0, 1]]),
        turned(q[4] + half, -1),
        turned(q[5], 1, rise=r6),
        turned(q[6] - half, -1),
        sp.Matrix([[c, s, 0, 0], [-s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]),
    )
    T = sp.eye(4)
    for matrix in printed:
        T = T * matrix
    (entries,) = derivation("photo_robot").function("fk").expanded()
    difference = (sp.Matrix(4, 4, entries) - T).applyfunc(lambda x: sp.expand(x, trig=True))
    assert difference == sp.zeros(4, 4)


def test_urdf_origin_and_axis_follow_specification():
    """Roll, pitch and yaw rotate about fixed axes x, y, z, as in the URDF specification."""
    roll, pitch, yaw, theta = sp.symbols("r p y theta", real=True)
    cr, sr, cp, sp_ = sp.cos(roll), sp.sin(roll), sp.cos(pitch), sp.sin(pitch)
    cy, sy = sp.cos(yaw), sp.sin(yaw)
    origin = sp.Matrix(
        [
            [cy * cp, cy * sp_ * sr - sy * cr, cy * sp_ * cr + sy * sr, a],
            [sy * cp, sy * sp_ * sr + cy * cr, sy * sp_ * cr - cy * sr, d],
            [-sp_, cp * sr, cp * cr, e],
            [0, 0, 0, 1],
        ]
    )
    found = motion_matrix("urdf", 0, xyz=(a, d, e), rpy=(roll, pitch, yaw))
    assert equal(found, origin)
    about_y = sp.eye(4)
    about_y[:3, :3] = sp.rot_ccw_axis2(theta)
    found = motion_matrix("urdf", theta, axis=(ZERO, 3 * ONE, ZERO))
    assert equal(found, about_y)


def test_poe_joint_matches_rodrigues_formula():
    """Rodrigues' formula gives the expected rotation about any axis through any point."""
    theta = sp.Symbol("theta", real=True)
    checked = 0
    for axis in ((1, 0, 0), (0, -1, 0), (0, 0, -1), (0, 0, 1), (1, 2, 2), (-3, 0, 4), (1, 1, 1)):
        n = sp.Matrix(axis) / sp.sqrt(sum(x * x for x in axis))
        K = sp.Matrix([[0, -n[2], n[1]], [n[2], 0, -n[0]], [-n[1], n[0], 0]])
        expected = sp.eye(4)
        R = sp.eye(3) + sp.sin(theta) * K + (1 - sp.cos(theta)) * K * K
        point = sp.Matrix([a, d, e])
        expected[:3, :3], expected[:3, 3] = R, point - R * point
        exact_axis = tuple(sp.Integer(x) for x in axis)
        assert equal(motion_matrix("poe", theta, axis=exact_axis, point=(a, d, e)), expected)
        checked += 1
    assert checked == 7


@pytest.mark.parametrize("convention", BY_NAME)
def test_prismatic_joint_translates_along_axis_of_its_convention(convention):
    """A prismatic joint moves the tool along the joint axis that its link convention defines."""
    angles = iter(sp.symbols("u v w", real=True))
    fields = BY_NAME[convention].fields
    given = {field.name: next(angles) for field in fields if field.kind == "angle"}
    T = motion_matrix(convention, q[0], "prismatic", **given)
    theta, alpha, beta = (given.get(f, ZERO) for f in ("theta", "alpha", "beta"))
    Rx, Ry = sp.rot_ccw_axis1(alpha), sp.rot_ccw_axis2(beta)
    axis = {
        "mdh": Rx,
        "mdh5": Rx,
        "hayati5": Rx * Ry,
        "s_model": sp.rot_ccw_axis3(theta) * Ry * Rx,
    }.get(convention, sp.eye(3))[:, 2]
    assert equal(T[:3, 3].diff(q[0]), axis)
    assert T[:3, :3].diff(q[0]) == sp.zeros(3, 3)
