"""Shipped robots with loops agree with a numerical model that is independent of the compiler."""

import tomllib
from functools import cache

import numpy as np
import pytest
import sympy as sp

from chasles.derive import kutzbach, mobility, read
from chasles.derive.description.mechanism_file import has_loops
from chasles.derive.model.mechanism import Mechanism
from tests.support.derivations import ROBOTS, description
from tests.support.loops.closed_in_numbers import HELD, NEAR, Model


@cache
def mechanism(name):
    return read(description(name))


@cache
def model(name):
    return Model(mechanism(name))


SHIPPED = {
    "four_bar": ("crank", "crank coupler", "rocker"),
    "slider_crank": ("crank", "slider", "rod_angle"),
    "five_bar": ("left right", "left left_elbow", "right_elbow"),
    "well_manipulator": (
        "theta1 cylinder_1 cylinder_2 l_HI cylinder_3 l_MN cylinder_4",
        "theta1 theta2 theta3 l_HI theta5 l_MN theta7",
        "theta8 theta9 theta10 theta11",
    ),
    "planar_3rrr": ("theta_1 theta_2 theta_3", "x y phi", "psi_1 psi_2 psi_3"),
    "planar_3rrr_170": ("theta_1 theta_2 theta_3", "x y phi", "psi_1 psi_2 psi_3"),
    "board_installer": (
        "waist slider crank yaw push_rod roll",
        "waist slider shoulder elbow wrist yaw pitch roll",
        "elbow_plate rod_KH_swing rod_FH_swing greater_rod_swing smaller_rod_swing push_rod_swing",
    ),
    "bricklaying_gantry": (
        "motor_x motor_y motor_z",
        "y x z",
        "y_second y_cross y_height y_roll y_pitch x_second x_cross x_height x_roll x_pitch",
    ),
    "excavator": (
        "swing boom_cylinder stick_cylinder bucket_cylinder",
        "swing boom stick bucket",
        "rocker bucket_link_swing boom_cylinder_swing stick_cylinder_swing bucket_cylinder_swing",
    ),
    "delta": ("arm_1 arm_2 arm_3", "x y z yaw pitch roll", ""),
    "stewart_gough": ("leg_1 leg_2 leg_3 leg_4 leg_5 leg_6", "x y z yaw pitch roll", ""),
}


def test_every_shipped_mechanism_is_covered():
    files = [*ROBOTS.glob("*.toml"), *ROBOTS.glob("shelf/*.toml")]
    tables = {path.stem: tomllib.loads(path.read_text(encoding="utf-8")) for path in files}
    maybe = {name for name, table in tables.items() if has_loops(table) or "extends" in table}
    assert sorted(SHIPPED) == sorted(n for n in maybe if isinstance(mechanism(n), Mechanism))


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_mechanisms_have_expected_coordinate_names(name):
    coordinates, chain, passive = (tuple(names.split()) for names in SHIPPED[name])
    robot = mechanism(name)
    assert robot.name == name
    assert tuple(c.name for c in robot.coordinates) == coordinates
    assert tuple(joint.name for joint in robot.main_chain.moving) == chain
    assert robot.passive == passive
    assert robot.title != name
    assert robot.source


@pytest.mark.parametrize("name", SHIPPED)
def test_the_reference_is_near_a_closed_configuration(name):
    m = model(name)
    u = m.closed(m.q, m.u)
    assert np.abs(u - m.u).max(initial=0.0) < NEAR
    for c, value in zip(m.mechanism.coordinates, m.q, strict=True):
        low, high = (None if limit is None else float(limit) for limit in c.limits)
        assert low is None or low <= value <= high, c.name
    for strut in m.mechanism.struts:
        if strut.ends == "pin":
            known = float(m.mechanism.reference_of(strut.swing_name))
            assert abs(swing(m, strut, m.q, u) - known) < NEAR, strut.name


def swing(m, strut, q, u):
    """Return the angle of a strut in the xy or xz plane of the body at the strut's first end."""
    body, A, B = m.ends(strut, q, u)
    x, y, z = body[:3, :3].T @ (B[:3, 3] - A[:3, 3])
    flat = abs(z) < 1e-9
    assert flat or abs(y) < 1e-9
    return np.arctan2(y if flat else z, x)


WITHOUT_LIMITS = {"planar_3rrr", "planar_3rrr_170"}
HELD_BOX = np.radians([[50, 170, -70], [92, 212, -28]])
"""Lower and upper limits (radian) of crank angles, for platforms whose source prints no limits."""


@pytest.mark.parametrize("name", SHIPPED)
def test_every_loop_closes_within_the_limits(name):
    m = model(name)
    limits = [c.limits for c in m.mechanism.coordinates]
    low = np.array([-np.pi if a is None else float(a) for a, _ in limits])
    high = np.array([np.pi if b is None else float(b) for _, b in limits])
    if name in WITHOUT_LIMITS:
        low, high = HELD_BOX
    rng = np.random.default_rng(7)
    corner = rng.integers(0, 2, len(low))
    _, tracked = m.followed(low + (high - low) * corner)
    assert tracked > HELD


WELL = [
    (
        [88.79, -49.2, -86.76, -40.62],
        [676.1398945, 748.2321208, 757.8045934, 668.0745509],
        [97.6300533, -3.7476803, 2.5048179, -46.5039847],
    ),
    (
        [88.79, -11.25844509, -129.76606998, -35.55548493],
        [676.1398945, 643.5014571, 829.8580386, 653.2639794],
        [97.6300533, -10.3861568, -5.367422, -41.2434955],
    ),
    (
        [88.79, -100.56101055, -88.57420215, 12.5552127],
        [676.1398945, 921.8775013, 762.1369402, 546.4268791],
        [97.6300533, -5.7127645, 2.2327224, 15.2850872],
    ),
]


@pytest.mark.parametrize(
    ("angles", "lengths", "swings"), WELL, ids=[f"state{k}" for k in range(1, len(WELL) + 1)]
)
def test_well_manipulator_passive_joints_match_printed_states(angles, lengths, swings):
    m = model("well_manipulator")
    l1, l2, l3, l4 = np.array(lengths) / 1000
    q = np.array([0, l1, l2, 0, l3, 0, l4])
    u, _ = m.followed(q)
    assert m.unknown == ["theta2", "theta3", "theta5", "theta7"]
    # The publication prints lengths to 1e-7 mm and, away from dead points, angles to 1e-6 degrees.
    assert np.degrees(u) == pytest.approx(angles, abs=1e-6)
    found = [np.degrees(swing(m, strut, q, u)) for strut in m.mechanism.struts]
    assert found == pytest.approx(swings, abs=1e-6)


def test_well_manipulator_tool_position_matches_paper():
    m = model("well_manipulator")
    u = m.closed(m.q, m.u)
    R = 1000 * m.tip(m.q, u)[:3, 3]
    assert pytest.approx([2255.20386894, 0, 583.84702201], abs=2e-6) == R
    R = 1000 * m.tip(m.q + np.array([np.pi / 6, 0, 0, 0, 0, 0, 0]), u)[:3, 3]
    assert pytest.approx([1953.06384122, 1127.60193447, 583.84702201], abs=2e-6) == R


BOARDS = [
    ([0.0] * 6, [0.0] * 8, (1.5, 0.0, 1.24)),
    (
        [0.34906585, 0.03, 0.174532925, -0.34906585, 0.02, 0.0],
        [
            *(0.34906585, 0.03, 0.153260366, -0.027395016),
            *(-0.12586535, -0.34906585, 0.136203735, 0.0),
        ],
        (1.306884743, 0.331022897, 1.416937781),
    ),
    (
        [-0.610865238, -0.06, -0.261799388, 0.436332313, -0.03, 0.20943951],
        [
            *(-0.610865238, -0.06, -0.288224698, 0.149610191),
            *(0.138614507, 0.436332313, -0.200552588, 0.20943951),
        ],
        (1.463730419, -0.821441844, 0.977165719),
    ),
]


@pytest.mark.parametrize(
    ("q", "chain", "tip"), BOARDS, ids=[f"case{k}" for k in range(1, len(BOARDS) + 1)]
)
def test_board_installer_chain_and_tool_match_printed_cases(q, chain, tip):
    m = model("board_installer")
    u, _ = m.followed(q)
    values = m.values(q, u)
    found = [values[joint.name] for joint in m.mechanism.main_chain.moving]
    assert found == pytest.approx(chain, abs=5e-9)
    assert m.tip(q, u)[:3, 3] == pytest.approx(tip, abs=5e-9)
    # The parallelogram linkages keep the body elbow_plate horizontal.
    assert values["elbow_plate"] == pytest.approx(-values["shoulder"], abs=1e-9)


@pytest.mark.parametrize(
    ("name", "legs"),
    [
        ("planar_3rrr", [78.52393138, 176.46904472, -29.82437852]),
        ("planar_3rrr_170", [92.25700039, -168.79837185 + 360, -8.8931441]),
    ],
    ids=["130 mm", "170 mm"],
)
def test_planar_3rrr_reaches_pose_of_its_inverse_solution(name, legs):
    m = model(name)
    u, tracked = m.followed(np.radians(legs))
    assert tracked > HELD
    assert dict(zip(m.unknown, u, strict=True)) == pytest.approx(
        {"x": 0.02, "y": 0.05, "phi": 0.0}, abs=1e-9
    )


def test_planar_3rrr_variants_differ_only_in_coupler_and_reference():
    short, long = mechanism("planar_3rrr"), mechanism("planar_3rrr_170")
    lengths = [{p.name: p.value for p in robot.parameters}["L"] for robot in (short, long)]
    assert lengths == [sp.Rational(13, 100), sp.Rational(17, 100)]
    assert long.joints == short.joints
    assert long.struts == short.struts
    assert long.reference != short.reference
    assert [p.meaning for p in long.parameters] == [p.meaning for p in short.parameters]


def test_gantry_motor_angles_give_expected_tool_position():
    robot = mechanism("bricklaying_gantry")
    m = model("bricklaying_gantry")
    q = np.array([10.0, 20.0, 4.0])
    u = m.closed(q, m.u)
    assert m.tip(q, u)[:3, 3] == pytest.approx([0.1, 0.2, 0.06], abs=1e-12)
    at = m.values(q, u)
    assert (at["y_second"], at["x_second"]) == pytest.approx((0.2, 0.1), abs=1e-12)
    bearings = [at[f"{axis}_{kind}"] for axis in "xy" for kind in ("cross", "height", "roll")]
    assert bearings == pytest.approx([0] * 6, abs=1e-12)
    assert [c.limits for c in robot.coordinates] == [(0, 40), (0, 50), (0, sp.Rational(50, 3))]
    assert [c.unit for c in robot.coordinates] == ["rad"] * 3
    kinds = {drive.name: drive.kind for drive in robot.drives}
    assert kinds["motor_z"] == "chain"
    assert list(robot.followers) == ["motor_y_second"]


def test_gantry_link_joint_and_freedom_counts_match_paper():
    robot, m = mechanism("bricklaying_gantry"), model("bricklaying_gantry")
    bodies, joints = len(robot.bodies), len(robot.joints) + len(robot.closures)
    assert (bodies, joints, joints - bodies + 1) == (14, 15, 2)
    assert kutzbach(bodies, joints, joints) == 3
    # The numerical model, which gives the Jacobian rank, is independent of the compiler's
    # equations.
    assert len(m.unknown) == np.linalg.matrix_rank(m.jacobian(m.q, m.u), tol=1e-6) == 10
    counted = mobility(robot)
    assert (counted.kutzbach, counted.by_loops, counted.true) == (3, 3, 3)
    assert counted.disagreements == ()
