"""The chain in its smallest form: which angles are summed, which axes share a group."""

import sympy as sp
from derivations import ROBOTS

from chasles.derive import Joint, Mimic, Robot, load
from chasles.derive.chain import groups
from chasles.derive.conventions import dh, urdf
from chasles.derive.scope import Scope

q = sp.symbols("q1:9", real=True)
ZERO, ONE = sp.Integer(0), sp.Integer(1)


def shaped(robot):
    """The groups, and every angle in terms of q alone."""
    scope = Scope({p.symbol: p.value for p in robot.parameters})
    found = groups(robot, scope, robot.joint_values(q[: len(robot.coordinates)]))
    definitions = {}
    for symbol, term in scope.terms.items():
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


def test_parallel_axes_share_one_angle():
    _, angles = shaped(load(ROBOTS / "ur5e.toml"))
    assert angles == [[q[0]], [q[1], q[1] + q[2], q[1] + q[2] + q[3]], [q[4]], [q[5]]]


def test_an_antiparallel_axis_counts_backwards_in_its_group():
    found, angles = shaped(load(ROBOTS / "scara.toml"))
    assert angles == [[q[0], q[0] + q[1], q[0] + q[1] - q[3]]]
    (group,) = found
    assert [station.sign for station in group.stations if station.joint is not None] == [1, 1, -1]
    assert [slide.joint for station in group.stations for slide in station.slides] == [2]


def test_right_angles_are_permutations_and_other_offsets_join_the_angle():
    found, angles = shaped(load(ROBOTS / "panda.toml"))
    assert angles[-1] == [q[6] - sp.pi / 4]
    assert {abs(entry) for group in found for entry in group.tilt} == {0, 1}


def test_an_axis_turned_back_is_parallel_again():
    """Two tilts that cancel, in a URDF's detour: the numbers are multiplied, then recognised."""
    half = sp.pi / 2
    first = urdf("revolute", xyz=(ZERO, ZERO, ZERO), rpy=(half, ZERO, ZERO), axis=(ZERO, ONE, ZERO))
    second = urdf(
        "revolute", xyz=(ONE, ZERO, ZERO), rpy=(ZERO, half, half), axis=(ZERO, ZERO, -ONE)
    )
    joints = (Joint("a", "revolute", *first), Joint("b", "revolute", *second))
    _, angles = shaped(Robot("detour", joints))
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
    _, angles = shaped(Robot("cancelled", joints))
    assert angles == [[q[0], q[0] + q[1]]]


def test_a_follower_adds_its_leader():
    row = {"alpha": ZERO, "d": ZERO, "theta": ZERO}
    joints = (
        Joint("a", "revolute", *dh("revolute", a=ONE, **row)),
        Joint("b", "revolute", *dh("revolute", a=ONE, **row), mimic=Mimic("a", sp.Rational(-1, 2))),
    )
    _, angles = shaped(Robot("led", joints))
    assert angles == [[q[0], q[0] / 2]]


def test_a_tilt_by_a_parameter_keeps_its_group_even_at_a_right_angle():
    """Its value may change, so its structure may not be read off the value."""
    alpha = sp.Symbol("alpha", real=True)
    from chasles.derive import Parameter

    first = dh("revolute", a=ONE, alpha=alpha, d=ZERO, theta=ZERO)
    last = dh("revolute", a=ONE, alpha=ZERO, d=ZERO, theta=ZERO)
    joints = (Joint("a", "revolute", *first), Joint("b", "revolute", *last))
    robot = Robot("tilted", joints, parameters=(Parameter("alpha", ZERO, "angle"),))
    _, angles = shaped(robot)
    assert angles == [[q[0]], [q[1]]]
