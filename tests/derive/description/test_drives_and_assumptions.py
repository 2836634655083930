"""Robot files with belts, chain drives, coupled motors, bodies on two rails, or assumed values."""

import numpy as np
import pytest
import sympy as sp

from chasles.derive import DescriptionError, derive, read_text
from chasles.derive.latex import fragments
from chasles.derive.loops.closing.mobility import mobility_of
from chasles.derive.loops.functions.constraint_functions import equations
from chasles.derive.loops.spatial.guides import Guides
from chasles.derive.terms.casadi_graph import lower
from tests.support.loops.closed_in_numbers import Model
from tests.support.loops.solved import forward, solved

BRIDGE = """\
name = "bridge"
convention = "urdf"
actuated = ["motor", "lift"]
units = { length = "mm", angle = "deg" }
tool = { body = "hook" }

[parameters]
w = { value = 900, meaning = "between the rails", assumed = true }
n = { value = 20, unit = "1" }

[[joints]]
name = "turntable"
type = "%(base)s"
link = "ground"
axis = [0, 0, 1]

[[joints]]
name = "travel"
link = "bridge"
type = "prismatic"
axis = [0, 1, 0]
limits = [0, 3000]
assumed = ["limits"]

[[joints]]
name = "lift"
link = "hook"
type = "prismatic"
axis = [0, 0, -1]
limits = [0, 800]

[[joints]]
name = "second"
parent = "ground"
link = "carriage"
type = "prismatic"
xyz = ["w", 0, 0]
axis = [0, 1, 0]

%(float)s
[[drives]]
name = "motor"
kind = "belt"
joint = "travel"
teeth = "n"
pitch = 5

[[drives]]
name = "other"
kind = "chain"
joint = "second"
radius = 50
assumed = true
"""
WELDED = """[[closures]]
name = "weld"
kind = "weld"
a = { body = "bridge", xyz = ["w", 0, 0] }
b = { body = "carriage" }
"""
FLOATING = """[[joints]]
name = "cross"
type = "prismatic"
link = "cross_slide"
axis = [1, 0, 0]

[[joints]]
name = "height"
type = "prismatic"
link = "height_slide"
axis = [0, 0, 1]

[[joints]]
name = "roll"
link = "inner_ring"
axis = [1, 0, 0]

[[joints]]
name = "pitch"
link = "outer_ring"
axis = [0, 1, 0]

[[closures]]
name = "yaw"
kind = "pin"
a = { body = "bridge", xyz = ["w", 20, 30] }
b = { body = "outer_ring" }
"""


def bridge(floating=FLOATING, base="fixed"):
    text = BRIDGE % {"float": floating, "base": base}
    return text if base == "fixed" else text.replace('["motor"', '["turntable", "motor"')


@pytest.mark.parametrize("base", ["fixed", "revolute"])
@pytest.mark.parametrize("floating", [WELDED, FLOATING], ids=["welded", "floating"])
def test_bridge_on_two_rails_matches_numeric_closure(floating, base):
    robot = read_text(bridge(floating, base))
    hybrid = solved(robot)

    assert not hybrid.forward.open
    assert not hybrid.backward.open
    is_exact = floating is FLOATING
    assert mobility_of(hybrid.numbers, equations(hybrid)).is_overconstrained is not is_exact
    derived = derive(robot, functions=["configuration", "passive", "actuators", "chain"])
    kernels = dict(
        zip([f.name for f in derived.functions], lower(derived.functions, "b"), strict=True)
    )
    model, random = Model(robot), np.random.default_rng(3)
    radius = 20 * 0.005 / (2 * np.pi)
    for _ in range(10):
        q = random.uniform(0, 1, len(robot.actuated)) * (
            [50, 0.8] if base == "fixed" else [2, 50, 0.8]
        )
        z = np.array(kernels["configuration"](q)).ravel()
        names = [variable.name for variable in hybrid.variables]
        if is_exact:
            at = model.values(q, model.closed(q, model.u))
            assert z == pytest.approx([at[name] for name in names], abs=1e-11)
        message = dict(zip(robot.passive, np.array(kernels["passive"](q)).ravel(), strict=True))
        travel = radius * q[robot.actuated.index("motor")]
        slide = robot.followers["other"].joint
        assert message[slide] == pytest.approx(travel + 0.02 * is_exact, abs=1e-11)
        theta = np.array(kernels["chain"](q)).ravel()
        assert np.array(kernels["actuators"](theta)).ravel() == pytest.approx(q, abs=1e-11)


def test_floating_rail_is_solved_by_a_guides_step():
    hybrid = solved(read_text(bridge()))
    assert [type(step) for step in hybrid.forward.steps] == [Guides]
    assert hybrid.forward.steps[0].name(hybrid.mechanism) == "yaw"


def test_bearings_with_repeated_axis_are_not_guides():
    # One bearing with a roll axis and one with a yaw axis are independent, but two bearings with
    # roll axes are not.
    twice = FLOATING.replace("axis = [0, 1, 0]", "axis = [1, 0, 0]")
    assert forward(read_text(bridge(twice))).open


def test_teeth_and_pitch_give_the_drive_radius():
    robot = read_text(bridge())
    motor, other = robot.drives
    (n,) = (p.symbol for p in robot.parameters if p.name == "n")
    assert motor.ratio == n * sp.Rational(5, 1000) / (2 * sp.pi)
    assert (motor.kind, other.kind) == ("belt", "chain")
    assert list(robot.followers) == ["other"]
    assert "other" not in robot.passive
    high = robot.coordinates[0].limits[1]
    assert float(high) == pytest.approx(3 / (20 * 0.005) * 2 * np.pi)


WRONG = [
    ('teeth = "n"', 'teeth = "n"\nradius = 3', "radius", "either a radius, or teeth and pitch"),
    ('teeth = "n"\npitch = 5', "teeth = 20", "pitch", "a nonzero number"),
    ('teeth = "n"\npitch = 5', "", "radius", "per motor radian, or teeth and pitch"),
    ('kind = "belt"', 'kind = "bell"', "kind", "did you mean 'belt'?"),
    ('teeth = "n"', 'ratio = 2\nteeth = "n"', "ratio", "no ratio: travel is prismatic"),
    ('assumed = ["limits"]', 'assumed = ["limit"]', "assumed[1]", "did you mean 'limits'?"),
    ('assumed = ["limits"]', "assumed = 3", "assumed", "true, or a list of fields"),
    ('assumed = ["limits"]', 'assumed = ["pitch"]', "assumed[1]", "one of limits, axis"),
]


@pytest.mark.parametrize(
    ("line", "text", "field", "words"),
    WRONG,
    ids=[f"{field}-{words}" for _, _, field, words in WRONG],
)
def test_invalid_drives_and_assumptions_name_their_field(line, text, field, words):
    whole = bridge()
    assert line in whole
    with pytest.raises(DescriptionError) as caught:
        read_text(whole.replace(line, text), file="bridge.toml")
    assert caught.value.field.endswith(f".{field}")
    assert words in str(caught.value)


def test_assumed_values_are_noted_and_marked_in_latex():
    robot = read_text(bridge())
    assert robot.notes == (
        "assumed, not stated by the source: limits of travel; parameters w; ratios of other",
    )
    assert [c.assumed for c in robot.coordinates] == [True, False]
    printed = fragments(derive(robot))["parameters.tex"]
    assert printed.count(r"\,$^{\ast}$") >= 3
    assert "An asterisk marks a value that the description assumes" in printed
    assert "the motor other rotates by $" in printed
    text = bridge().replace(", assumed = true", "").replace("assumed = true", "")
    stated = read_text(text.replace('assumed = ["limits"]', ""))
    assert stated.notes == ()
    assert r"\ast" not in fragments(derive(stated))["parameters.tex"]


def test_serial_robot_file_marks_assumed_values():
    text = 'name = "arm"\nconvention = "dh"\n[[joints]]\nname = "j"\na = 1\nlimits = [-1, 1]\n'
    assert read_text(text).notes == ()
    assert read_text(text + "assumed = true\n").joints[0].assumed == ("limits", "a")
    marked = read_text(text + 'assumed = ["limits"]\n')
    assert marked.notes == ("assumed, not stated by the source: limits of j",)
    assert r"$\pm 1$\,$^{\ast}$" in fragments(derive(marked))["parameters.tex"]


def test_cylinder_reference_defaults_to_middle_of_limits():
    text = """
name = "boom"
convention = "urdf"
actuated = ["jack"]
[[joints]]
name = "boom"
axis = [0, 0, 1]
[[cylinders]]
name = "jack"
retracted = 1
limits = [0, 1]
a = { body = "0", xyz = [0, -1, 0] }
b = { body = "link1", xyz = [1, 0, 0] }
[reference]
boom = "1/2"
"""
    assert read_text(text).reference_of("jack") == sp.Rational(1, 2)
    assert read_text(text + "jack = 0\n").reference_of("jack") == 0
    assert solved(read_text(text)).at_reference["jack"] == 0.5
