"""Tests the angle sums and the groups of parallel axes of simplified chains."""

import sympy as sp

from chasles.derive import Coupling, Joint, SerialRobot, product_of_exponentials, read
from chasles.derive.chain.groups import groups
from chasles.derive.description.conventions import dh, urdf
from chasles.derive.terms.terms import Terms
from tests.support.derivations import NAMES, ROBOTS

q = sp.symbols("q1:9", real=True)
ZERO, ONE = sp.Integer(0), sp.Integer(1)


def shaped(robot):
    """Return a robot's groups of parallel axes, and the angle sums of each group in terms of q."""
    terms = Terms({p.symbol: p.value for p in robot.parameters})
    found = groups(robot, terms, robot.joint_values(q[: len(robot.coordinates)]))
    definitions = {}
    for symbol, term in terms.definitions.items():
        definitions[symbol] = term.xreplace(definitions)
    angles = [
        [
            station.angle.xreplace(definitions)
            for station in group.stations
            if station.joint is not None
        ]
        for group in found
    ]
    return found, [group for group in angles if group]


def test_parallel_axes_sum_their_joint_angles():
    _, angles = shaped(read(ROBOTS / "ur5e.toml"))
    assert angles == [[q[0]], [q[1], q[1] + q[2], q[1] + q[2] + q[3]], [q[4]], [q[5]]]


def test_antiparallel_axis_enters_angle_sum_with_negative_sign():
    found, angles = shaped(read(ROBOTS / "scara.toml"))
    assert angles == [[q[0], q[0] + q[1], q[0] + q[1] - q[3]]]
    (group,) = found
    assert [station.sign for station in group.stations if station.joint is not None] == [1, 1, -1]
    assert [slide.joint for station in group.stations for slide in station.slides] == [2]


def test_right_angle_tilts_are_exact_and_offsets_join_joint_angle():
    found, angles = shaped(read(ROBOTS / "panda.toml"))
    assert angles[-1] == [q[6] - sp.pi / 4]
    assert {abs(entry) for group in found for entry in group.tilt} == {0, 1}


def test_zero_offsets_join_angle_sums_and_full_revolutions_cancel():
    joints = []
    for k, theta in enumerate((sp.pi / 3, 2 * sp.pi, -sp.pi / 2, sp.pi / 6)):
        row = dh("revolute", a=ONE, alpha=ZERO, d=ZERO, theta=theta)
        joints.append(Joint(f"j{k}", "revolute", *row))
    (group,), ((one, two, three, four),) = shaped(SerialRobot("offsets", tuple(joints)))
    assert group.tilt == (1, 0)
    assert one - q[0] == sp.pi / 3
    assert (two - q[0] - q[1] - sp.pi / 3) % (2 * sp.pi) == 0
    assert (three - sum(q[:3]) + sp.pi / 6) % (2 * sp.pi) == 0
    assert (four - sum(q[:4])) % (2 * sp.pi) == 0


def test_group_keeps_signs_of_prismatic_and_helical_joints():
    """The joint axes of the test arm are parallel or antiparallel."""
    row = {"a": ONE, "d": ZERO, "theta": ZERO}
    joints = (
        Joint("turn", "revolute", *dh("revolute", alpha=ZERO, **row)),
        Joint("slide", "prismatic", *dh("prismatic", alpha=sp.pi, **row)),
        Joint("back", "revolute", *dh("revolute", alpha=ZERO, **row), direction=-1),
        Joint("screw", "helical", *dh("helical", alpha=-sp.pi, **row), pitch=sp.Rational(1, 9)),
        Joint("last", "revolute", *dh("revolute", alpha=sp.pi / 2, **row)),
    )
    found, angles = shaped(SerialRobot("mixed", joints))
    assert angles[0] == [
        q[0],
        q[0] + q[2],
        q[0] + q[2] - q[3],
        q[0] + q[2] - q[3] + q[4],
    ]
    stations = found[0].stations
    assert [station.joint for station in stations] == [None, 0, 2, 3, 4]
    assert [station.sign for station in stations] == [1, 1, -1, -1, 1]
    assert [station.pitch for station in stations] == [0, 0, 0, sp.Rational(1, 9), 0]
    assert [slide.direction for slide in stations[1].slides] == [(0, 0, 1)]
    assert [frame.name for station in stations for frame in station.frames] == [
        f"link{k}" for k in range(1, 6)
    ]


def test_prismatic_joint_after_antiparallel_axis_is_reversed():
    row = {"a": ONE, "d": ZERO, "theta": ZERO}
    joints = (
        Joint("turn", "revolute", *dh("revolute", alpha=sp.pi, **row)),
        Joint("back", "revolute", *dh("revolute", alpha=ZERO, **row)),
        Joint("slide", "prismatic", *dh("prismatic", alpha=ZERO, **row)),
    )
    (group,), angles = shaped(SerialRobot("flipped", joints))
    assert angles == [[q[0], q[0] - q[1]]]
    (slide,) = group.stations[-1].slides
    assert (slide.joint, slide.direction) == (2, (0, 0, -1))
    tool = group.stations[-1].frames[-1]
    assert tool.orientation == ((1, 0, 0), (0, -1, 0), (0, 0, -1))


def test_shipped_robots_have_parallel_axis_groups_of_data_sheet():
    runs = {
        "bricklaying_planar": [[0, 1, 2]],
        "iiwa14": [[0], [1], [2], [3], [4], [5], [6]],
        "irb6640": [[0], [1, 2], [3], [4], [5]],
        "jaco2": [[0], [1, 2], [3], [4], [5]],
        "lynxmotion": [[0], [1, 2, 3], [4]],
        "panda": [[0], [1], [2], [3], [4], [5], [6]],
        "photo_robot": [[1], [2, 4], [5], [6], [7]],
        "puma560": [[0], [1, 2], [3], [4], [5]],
        "scara": [[0, 1, 3]],
        "stanford": [[0], [1], [3], [4], [5]],
        "ur5e": [[0], [1, 2, 3], [4], [5]],
    }
    assert set(NAMES) == set(runs)
    for name, expected in runs.items():
        found, _ = shaped(read(ROBOTS / f"{name}.toml"))
        turning = [[s.joint for s in group.stations if s.joint is not None] for group in found]
        assert [run for run in turning if run] == expected, name


def test_the_groups_multiply_to_the_orientation_of_the_tool():
    """The tool orientation R_0_ee is a product of rotations about z and x.

    The test multiplies the rotations of all groups as documented in the module of `groups`, at
    30-digit precision.
    """
    checked = 0
    for name in NAMES:
        robot = read(ROBOTS / f"{name}.toml")
        terms = Terms({p.symbol: p.value for p in robot.parameters})
        values = robot.joint_values(q[: len(robot.coordinates)])
        found = groups(robot, terms, values)
        numbers = {symbol: sp.Rational(k * k + 2, 5) for k, symbol in enumerate(q)}
        numbers |= terms.parameters
        for symbol, term in (*terms.constants.items(), *terms.definitions.items()):
            numbers[symbol] = term.xreplace(numbers).evalf(30)
        R = sp.eye(3)
        for group in found:
            c, s = group.tilt
            tilt = sp.Matrix([[1, 0, 0], [0, c, -s], [0, s, c]])
            turn = sp.rot_ccw_axis3(group.stations[-1].angle)
            R = (R * (turn * tilt).xreplace(numbers)).evalf(30)
        axes = found[-1].stations[-1].frames[-1].orientation
        R = (R * sp.Matrix(axes).T.xreplace(numbers)).evalf(30)
        S, M = product_of_exponentials(robot)
        expected = sp.eye(3)
        for k, value in enumerate(values):
            x, y, z = S[3:, k]
            W = sp.Matrix([[0, -z, y], [z, 0, -x], [-y, x, 0]])
            turn = sp.eye(3) + sp.sin(value) * W + (1 - sp.cos(value)) * W * W
            expected = (expected * turn.xreplace(numbers)).evalf(30)
        difference = R - expected * M[:3, :3]
        assert max(map(abs, difference)) < sp.Float("1e-26"), name
        checked += 1
    assert checked == len(NAMES)


def test_axis_rotated_back_joins_parallel_group():
    half = sp.pi / 2
    first = urdf("revolute", xyz=(ZERO, ZERO, ZERO), rpy=(half, ZERO, ZERO), axis=(ZERO, ONE, ZERO))
    second = urdf(
        "revolute", xyz=(ONE, ZERO, ZERO), rpy=(ZERO, half, half), axis=(ZERO, ZERO, -ONE)
    )
    joints = (Joint("a", "revolute", *first), Joint("b", "revolute", *second))
    _, angles = shaped(SerialRobot("detour", joints))
    ((one, both),) = angles
    assert (one.diff(q[0]), both.diff(q[0]), both.diff(q[1])) in {(1, 1, -1), (-1, -1, 1)}
    tilted = sp.Rational(1, 3)
    there = dh("revolute", a=ONE, alpha=tilted, d=ZERO, theta=ZERO)
    back = dh("fixed", a=ONE, alpha=-tilted, d=ZERO, theta=ZERO)
    last = dh("revolute", a=ONE, alpha=ZERO, d=ZERO, theta=ZERO)
    joints = (
        Joint("a", "revolute", *there),
        Joint("b", "fixed", *back),
        Joint("c", "revolute", *last),
    )
    _, angles = shaped(SerialRobot("cancelled", joints))
    assert angles == [[q[0], q[0] + q[1]]]


def test_coupled_joint_adds_scaled_leader_angle():
    row = {"alpha": ZERO, "d": ZERO, "theta": ZERO}
    joints = (
        Joint("a", "revolute", *dh("revolute", a=ONE, **row)),
        Joint("b", "revolute", *dh("revolute", a=ONE, **row)),
    )
    _, angles = shaped(
        SerialRobot("follower", joints, couplings=(Coupling("b", (("a", "-1/2"),)),))
    )
    assert angles == [[q[0], q[0] / 2]]


def test_tilt_by_named_parameter_separates_groups_even_at_zero():
    """Groups of parallel axes must not depend on the changeable value of a named parameter."""
    alpha = sp.Symbol("alpha", real=True)
    from chasles.derive import Parameter

    first = dh("revolute", a=ONE, alpha=alpha, d=ZERO, theta=ZERO)
    last = dh("revolute", a=ONE, alpha=ZERO, d=ZERO, theta=ZERO)
    joints = (Joint("a", "revolute", *first), Joint("b", "revolute", *last))
    robot = SerialRobot("tilted", joints, parameters=(Parameter("alpha", ZERO, "angle"),))
    _, angles = shaped(robot)
    assert angles == [[q[0]], [q[1]]]
