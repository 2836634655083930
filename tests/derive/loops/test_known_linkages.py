"""Linkages with a known closed-form motion, described in Python."""

import numpy as np
import pytest

from chasles.derive import derive, read_text
from chasles.derive.loops.closing.mobility import mobility_of
from chasles.derive.loops.functions.constraint_functions import equations
from chasles.derive.terms.casadi_graph import lower
from tests.support.loops.closed_in_numbers import Model

HEAD = (
    'name = "{name}"\nconvention = "urdf"\nactuated = ["{actuated}"]\n'
    'units = {{ length = "mm", angle = "deg" }}\n'
)


def joint(name, link, parent="", xyz="[0, 0, 0]", axis="[0, 0, 1]", kind="revolute"):
    carried = f'parent = "{parent}"\n' if parent else ""
    return (
        f'[[joints]]\nname = "{name}"\nlink = "{link}"\n{carried}type = "{kind}"\n'
        f"xyz = {xyz}\naxis = {axis}\n"
    )


def rod(name, length, a, b):
    (body_a, at_a), (body_b, at_b) = a, b
    return (
        f'[[rods]]\nname = "{name}"\nlength = "{length}"\n'
        f'a = {{ body = "{body_a}", xyz = {at_a} }}\nb = {{ body = "{body_b}", xyz = {at_b} }}\n'
    )


def upright_pin(name, a, b):
    (body_a, at_a), (body_b, at_b) = a, b
    turned = "rpy = [90, 0, 0]"
    return (
        f'[[closures]]\nname = "{name}"\nkind = "pin"\n'
        f'a = {{ body = "{body_a}", xyz = {at_a}, {turned} }}\n'
        f'b = {{ body = "{body_b}", xyz = {at_b}, {turned} }}\n'
    )


PEAUCELLIER = (
    HEAD.format(name="peaucellier", actuated="crank")
    + 'tool = { body = "far", xyz = ["s", 0, 0] }\n[parameters]\nl = 240\ns = 100\nr = 75\n'
    + joint("upper", "upper")
    + joint("far", "far", xyz='["l", 0, 0]')
    + joint("lower", "lower", "0")
    + joint("crank", "crank", "0", '["r", 0, 0]')
    + rod("near_upper", "s", ("crank", '["r", 0, 0]'), ("upper", '["l", 0, 0]'))
    + rod("near_lower", "s", ("crank", '["r", 0, 0]'), ("lower", '["l", 0, 0]'))
    + rod("far_lower", "s", ("lower", '["l", 0, 0]'), ("far", '["s", 0, 0]'))
    + "[reference]\ncrank = 10\nupper = 20\nlower = -15\nfar = -40\n"
)
UP = "[0, -1, 0]"
SCISSORS = (
    HEAD.format(name="scissors", actuated="foot")
    + 'tool = { body = "table" }\n[parameters]\nl = 1200\n'
    + joint("first", "arm_1", axis=UP)
    + joint("second", "arm_2", xyz='["2*l", 0, 0]', axis=UP)
    + joint("table", "table", xyz='["2*l", 0, 0]', axis=UP)
    + joint("foot", "shoe", "0", axis="[1, 0, 0]", kind="prismatic")
    + joint("third", "arm_3", axis=UP)
    + joint("fourth", "arm_4", xyz='["2*l", 0, 0]', axis=UP)
    + joint("roller", "roller", "table", axis="[1, 0, 0]", kind="prismatic")
    + upright_pin("low", ("arm_1", '["l", 0, 0]'), ("arm_3", '["l", 0, 0]'))
    + upright_pin("high", ("arm_2", '["l", 0, 0]'), ("arm_4", '["l", 0, 0]'))
    + upright_pin("top", ("arm_4", '["2*l", 0, 0]'), ("roller", "[0, 0, 0]"))
    + "[reference]\nfoot = 2000\nfirst = 33\nsecond = 114\ntable = -147\nthird = 147\n"
    + "fourth = -114\nroller = 2000\n"
)
JANSEN = (
    HEAD.format(name="jansen", actuated="crank")
    + 'tool = { body = "foot", xyz = ["(g**2 + i**2 - h**2)/(2*g)", '
    + '"sqrt(i**2 - ((g**2 + i**2 - h**2)/(2*g))**2)", 0] }\n[parameters]\n'
    + "a = 38.0\nb = 41.5\nc = 39.3\nd = 40.1\ne = 55.8\nf = 39.4\ng = 36.7\nh = 65.7\n"
    + "i = 49.0\nj = 50.0\nk = 61.9\nl = 7.8\nm = 15.0\n"
    + joint("lower", "lower", xyz='["-a", "-l", 0]')
    + joint("ankle", "foot", xyz='["c", 0, 0]')
    + joint("crank", "crank", "0")
    + joint("upper", "upper", "0", '["-a", "-l", 0]')
    + rod("j", "j", ("crank", '["m", 0, 0]'), ("upper", '["b", 0, 0]')).replace('"j"', '"rod_j"', 1)
    + rod("k", "k", ("crank", '["m", 0, 0]'), ("lower", '["c", 0, 0]')).replace('"k"', '"rod_k"', 1)
    + rod(
        "rod_f",
        "f",
        (
            "upper",
            '["(b**2 + d**2 - e**2)/(2*b)", "sqrt(d**2 - ((b**2 + d**2 - e**2)/(2*b))**2)", 0]',
        ),
        ("foot", '["g", 0, 0]'),
    )
    + "[reference]\nupper = 70\nlower = -74\nankle = -96\n"
)


def tool_of(text):
    """Return the hybrid model and the tool pose (4, 4) as a function of q."""
    derivation = derive(read_text(text), functions=["fk"])
    (kernel,) = lower(derivation.functions, derivation.robot.name)
    return derivation.hybrid, lambda q: np.array(kernel(q)).reshape(4, 4)


def test_peaucellier_inversor_traces_a_straight_line():
    hybrid, tool = tool_of(PEAUCELLIER)
    found = mobility_of(hybrid.numbers, equations(hybrid))
    assert found.true == found.kutzbach == 1
    heights = []
    for crank in np.radians(np.linspace(-30, 30, 13)):
        x, y, _ = tool(crank)[:3, 3]
        assert x == pytest.approx((0.24**2 - 0.1**2) / (2 * 0.075), abs=1e-12)
        heights.append(y)
    assert np.ptp(heights) > 0.1


def test_a_scissor_lift_keeps_its_table_level():
    hybrid, tool = tool_of(SCISSORS)
    assert mobility_of(hybrid.numbers, equations(hybrid)).true == 1
    for foot in np.linspace(0.5, 2.3, 10):
        T = tool(foot)
        assert T[2, 3] == pytest.approx(2 * np.sqrt(2.4**2 - foot**2), abs=1e-12)
        assert T[:3, :3] == pytest.approx(np.eye(3), abs=1e-12)


@pytest.mark.parametrize("body", ["roller", "arm_4", "shoe"])
def test_scissor_lift_actuator_follows_from_any_tool_body(body):
    tool = "tool = { body = "
    robot = read_text(SCISSORS.replace(f'{tool}"table"', f'{tool}"{body}"'))
    chain, actuators = lower(derive(robot, functions=["chain", "actuators"]).functions, robot.name)
    for foot in np.linspace(0.5, 2.3, 7):
        assert float(actuators(chain(foot))) == pytest.approx(foot, abs=1e-12)


def test_jansen_leg_traces_a_closed_path_with_flat_stance():
    hybrid, tool = tool_of(JANSEN)
    assert mobility_of(hybrid.numbers, equations(hybrid)).true == 1
    model = Model(hybrid.mechanism)
    u = model.closed(model.q, model.u)
    points = []
    for crank in np.radians(np.arange(0, 361, 15)):
        u = model.closed(np.array([crank]), u)
        points.append(tool(crank)[:3, 3])
        assert points[-1] == pytest.approx(model.tip(np.array([crank]), u)[:3, 3], abs=1e-10)
    x, y, _ = 1000 * np.array(points).T
    assert points[0] == pytest.approx(points[-1], abs=1e-12)
    # The foot is on the ground for more than a third of a crank turn. On the ground, the path of
    # the foot is straight to a few millimeters.
    assert np.mean(y < y.min() + 3) > 0.35
    assert np.ptp(x) > 60
