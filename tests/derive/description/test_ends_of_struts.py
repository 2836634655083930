"""Rods and cylinders may have different joints at their two ends.

The tests use constraint equations between the frames at both ends.
"""

import numpy as np
import pytest
import sympy as sp

from chasles.derive import DescriptionError, mobility, read_text
from chasles.derive.model.mechanism import Closure, Strut
from tests.support.compiling import compiled
from tests.support.loops.legs_of_joints import turned
from tests.support.pages import examples

CLOSED, CONVERGED = 1e-10, 1e-13
RETRACTED = 0.2
UP = 0.5
TANGENT, RADIAL = (-90, -90), (180, -90)
"""Roll and pitch (degrees) of two frames whose x axis points up. At yaw 0, the z axis of frame
TANGENT is tangential, and the z axis of frame RADIAL is radial."""


def around(ends, axes, radii):
    """Return three legs at intervals of 120 degrees.

    Each leg is a tuple (joint types at its ends, base frame, platform frame), and each of these
    frames is a tuple (position, angles).
    """
    legs = []
    for yaw in (0, 120, 240):
        out = np.array([np.cos(np.deg2rad(yaw)), np.sin(np.deg2rad(yaw)), 0])
        frames = [(r * out, (*axis, yaw)) for r, axis in zip(radii, axes, strict=True)]
        legs.append((ends, *frames))
    return legs


EXECHON = [
    (("universal", "pin"), ((0.3, 0, 0), (*RADIAL, 0)), ((0.1, 0, 0), (*TANGENT, 0))),
    (("universal", "pin"), ((-0.3, 0, 0), (*RADIAL, 0)), ((-0.1, 0, 0), (*TANGENT, 0))),
    (("ball", "pin"), ((0, 0.32, 0), (0, 0, 0)), ((0, 0.11, 0), (*RADIAL, 0))),
]
PLATFORMS = {
    "3-RPS": around(("pin", "ball"), (TANGENT, TANGENT), (0.3, 0.2)),
    "3-SPR": around(("ball", "pin"), (TANGENT, TANGENT), (0.3, 0.2)),
    "3-UPU": around(("universal", "universal"), (TANGENT, TANGENT), (0.3, 0.2)),
    "Exechon": EXECHON,
}
HEAD = """
name = "struts"
convention = "urdf"
units = { length = "m", angle = "deg" }
actuated = ["leg0", "leg1", "leg2"]
[[joints]]
name = "platform"
type = "free"
link = "platform"
"""


def text(legs):
    """Return the robot file of a platform whose orientation is 0 in the reference configuration."""
    found, reference = HEAD, f"\n[reference]\nz = {UP}\n"
    for k, (ends, a, b) in enumerate(legs):
        sides = [
            f'{side} = {{ body = "{body}", xyz = {[*map(float, xyz)]}, rpy = {[*rpy]} }}\n'
            for side, body, (xyz, rpy) in (("a", "0", a), ("b", "platform", b))
        ]
        found += f'\n[[cylinders]]\nname = "leg{k}"\nretracted = {RETRACTED}\n'
        found += f"limits = [0.1, 0.6]\nends = {[*ends]}\n{''.join(sides)}"
        length = np.linalg.norm(np.add(b[0], [0, 0, UP]) - a[0])
        reference += f"leg{k} = {float(length) - RETRACTED}\n"
    return found + reference


def gaps(legs, T, q):
    """Return the residuals of the leg lengths and of the constraints at the leg ends."""
    found = []
    for (ends, (at, rpy_a), (to, rpy_b)), stroke in zip(legs, q, strict=True):
        d = T[:3, :3] @ to + T[:3, 3] - at
        A, B = turned(np.deg2rad(rpy_a))[:, 2], T[:3, :3] @ turned(np.deg2rad(rpy_b))[:, 2]
        found.append(np.linalg.norm(d) - RETRACTED - stroke)
        found += [d @ axis for kind, axis in zip(ends, (A, B), strict=True) if kind == "pin"]
        if ends == ("universal", "universal"):
            found.append(d @ np.cross(A, B))
        elif "universal" in ends:
            found.append(A @ B)
    return np.array(found)


def stepped(T, x):
    """Return pose T translated by x[:3] and rotated by the rotation vector x[3:]."""
    moved, angle = T.copy(), np.linalg.norm(x[3:])
    moved[:3, 3] += x[:3]
    if angle:
        K = np.cross(np.eye(3), -x[3:] / angle)
        moved[:3, :3] = (np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K) @ T[:3, :3]
    return moved


def followed(legs, start, q, steps=4):
    """Return the platform pose at the cylinder strokes q.

    Newton's method computes the pose at intermediate strokes on the line from ``start`` to q.
    """
    T = np.eye(4)
    T[2, 3] = UP
    for part in np.linspace(0, 1, steps):
        strokes = start + part * (q - start)
        for _ in range(12):
            r = gaps(legs, T, strokes)
            if np.abs(r).max() < CONVERGED:
                break
            h = 1e-6 * np.eye(6)
            rows = [
                gaps(legs, stepped(T, e), strokes) - gaps(legs, stepped(T, -e), strokes) for e in h
            ]
            T = stepped(T, np.linalg.lstsq(np.array(rows).T / 2e-6, -r, rcond=None)[0])
    return T


@pytest.mark.parametrize("name", PLATFORMS)
def test_platforms_on_cylinders_with_different_ends(name, tmp_path):
    legs = PLATFORMS[name]
    robot = compiled(read_text(text(legs)), tmp_path / "r", ("fk", "ik"), ["c"])
    start = np.array(robot.reference.q)
    q = start + np.random.default_rng(0).uniform(-0.02, 0.02, (6, 3))
    T = robot.fk(q)
    for k in range(len(q)):
        assert np.abs(gaps(legs, T[k], q[k])).max() < CLOSED
        np.testing.assert_allclose(T[k], followed(legs, start, q[k]), rtol=0, atol=1e-8)
    found = robot.ik(T)
    apart = np.where(found.valid, np.abs(found.q - q[:, None]).max(-1), np.inf)
    assert apart.min(-1).max() < CLOSED


ROCKER = """
name = "rocker"
convention = "urdf"
actuated = ["crank"]
joints = [
    { name = "crank", axis = [0, 0, 1], link = "crank" },
    { name = "rocker", axis = [1, 0, 0], xyz = [0.3, 0, 0], parent = "0", link = "rocker" },
]
[[rods]]
name = "coupler"
length = 0.26
ends = %s
a = { body = "crank", xyz = [0.06, 0, 0] }
b = { body = "rocker", xyz = [0, 0, 0.1] }
"""


def test_universal_joint_and_ball_keep_a_distance_without_an_idle_rotation():
    balls, pair = (read_text(ROCKER % ends) for ends in ('"ball"', '["universal", "ball"]'))
    (strut,) = pair.struts
    assert (strut.ends, strut.has_universal, pair.joints) == ("ball", True, balls.joints)
    assert [mobility(robot).idle for robot in (balls, pair)] == [1, 0]
    assert mobility(pair).kutzbach == mobility(pair).true == 1


def test_chain_of_a_strut_starts_at_the_end_with_fewer_freedoms():
    robot = read_text(ROCKER % '["ball", "pin"]\nswing = "lean"\nassumed = true')
    assert [(j.name, j.parent, j.link) for j in robot.joints[2:]] == [("lean", "rocker", "coupler")]
    (ball,) = robot.loop_joints
    assert isinstance(ball, Closure)
    assert (ball.name, ball.kind, ball.a.body, ball.b.body) == (
        "coupler",
        "ball",
        "coupler",
        "crank",
    )
    assert robot.tool_body == "rocker"
    assert robot.notes == ("assumed, not stated by the source: points of coupler on coupler (a)",)


def test_two_pins_in_a_list_are_a_strut():
    assert read_text(ROCKER % '["pin", "pin"]').struts == read_text(ROCKER % '"pin"').struts
    assert isinstance(read_text(ROCKER % '["ball", "ball"]').loop_joints[0], Strut)


def test_cylinder_without_a_reference_starts_in_the_middle_of_its_limits():
    legs = PLATFORMS["3-RPS"]
    robot = read_text(text(legs).partition("leg0 =")[0])
    assert [robot.reference_of(f"leg{k}") for k in range(3)] == [sp.Rational(7, 20)] * 3
    assert robot.omitted == ("leg0", "leg1", "leg2")


def test_page_shows_a_cylinder_with_a_universal_joint_and_a_pin():
    (cylinder,) = (e for e in examples("reference/robot-files.md", "toml") if "universal" in e)
    head = HEAD.replace('"leg0", "leg1", "leg2"', '"leg"').replace('"m"', '"mm"')
    robot = read_text(head + cylinder)
    assert [j.link for j in robot.joints[6:]] == ["leg_barrel", "leg_piston", "leg_far_cross"]
    assert [j.name for j in robot.joints[6:]] == ["leg_swing", "leg", "leg_far_tilt"]
    assert robot.joints[6].parent == "platform"


@pytest.mark.parametrize(
    ("ends", "expected"),
    [
        ('["pin"]', r"rods\[1\]\.ends: expected a list of 2 kinds of joints"),
        ('["pin", "bal"]', r"rods\[1\]\.ends\[2\]: .*did you mean 'ball'"),
        ('["universal", "ball"]\nswing = "s"', r"rods\[1\]\.swing: expected no swing"),
    ],
)
def test_wrong_ends_are_refused(ends, expected):
    with pytest.raises(DescriptionError, match=expected):
        read_text(ROCKER % ends)
