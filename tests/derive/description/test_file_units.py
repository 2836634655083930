"""Units of robot files: conversion, and errors for suspicious values."""

from dataclasses import replace

import pytest
import sympy as sp

from chasles.derive import DescriptionError, read_text

HEAD = 'name = "r"\nconvention = "dh"\n'

METRIC = """\
name = "metric"
convention = "hayati5"
units = { length = "m", angle = "rad" }

[parameters]
l = { value = "0.3", unit = "m" }
tilt = "pi/3"
r = { value = "0.25", unit = "1" }
h = "0.02"
turned = "pi/6"

[base]
xyz = ["0.1", 0, "l + 0.01"]
rpy = ["pi/2", "tilt - pi", 0]

[[joints]]
a = "l"
alpha = "turned"
limits = ["-pi", "pi/2"]

[[joints]]
type = "prismatic"
a = "r*l*cos(tilt + pi/4)"
d = "2*l - h - 0.05"
alpha = "atan(1/3) + pi/18"
limits = [0, "0.75"]

[[joints]]
type = "helical"
pitch = "h/2 + 0.001"
beta = "pi/180"

[[joints]]
type = "prismatic"
a = "l*sin(pi/6)"
mimic = { joint = "joint1", multiplier = "0.036/pi", offset = "0.01" }

[[joints]]
mimic = { joint = "joint2", multiplier = "5*pi/9", offset = "pi/9" }

[[joints]]
mimic = { joint = "joint1", multiplier = "-1/2" }

[tool]
xyz = ["0.0254", 0, 0]
"""
MILLIMETERS = """\
name = "millimeters"
convention = "hayati5"
units = { length = "mm", angle = "deg" }

[parameters]
l = { value = 30, unit = "cm" }
tilt = 60
r = { value = "0.25", unit = "1" }
h = 20
turned = 30

[base]
xyz = [100, 0, "l + 10"]
rpy = [90, "tilt - 180", 0]

[[joints]]
a = "l"
alpha = "turned"
limits = [-180, 90]

[[joints]]
type = "prismatic"
a = "r*l*cos(tilt + 45)"
d = "2*l - h - 50"
alpha = "atan(1/3) + 10"
limits = [0, 750]

[[joints]]
type = "helical"
pitch = "h/2 + 1"
beta = 1

[[joints]]
type = "prismatic"
a = "l*sin(30)"
mimic = { joint = "joint1", multiplier = "0.2", offset = 10 }

[[joints]]
mimic = { joint = "joint2", multiplier = "0.1", offset = 20 }

[[joints]]
mimic = { joint = "joint1", multiplier = "-1/2" }

[tool]
xyz = ["25.4", 0, 0]
"""


def test_meter_and_millimeter_files_give_equal_robots():
    metric, same = read_text(METRIC), read_text(MILLIMETERS)
    for one, other in zip(metric.joints, same.joints, strict=True):
        assert one == other
    assert metric.parameters == same.parameters
    assert metric.base == same.base
    assert replace(metric, name="r", title="r") == replace(same, name="r", title="r")
    assert metric.couplings[0].ratios == (("joint1", sp.Rational(36, 1000) / sp.pi),)
    assert metric.couplings == same.couplings


def test_roots_and_arctangents_of_lengths_are_unit_independent():
    """A file in millimeters and a file in meters describe the same robot.

    The symbol h is a length without a unit.
    """
    text = """\
name = "r"
convention = "dh"
units = { length = "%s", angle = "%s" }
[parameters]
l = { value = 30, unit = "cm" }
h = { value = 70, unit = "mm" }
[[joints]]
alpha = "2*atan2(h, l)"
d = "sqrt(l**2 - h**2) + %s"
"""
    numbers = {sp.Symbol("l", real=True): sp.Rational(5), sp.Symbol("h", real=True): sp.Integer(2)}
    one, other = (
        read_text(text % units).joints[0] for units in (("m", "rad", "0.02"), ("mm", "deg", "20"))
    )
    for field in ("alpha", "d"):
        first, second = (dict(joint.given)[field].xreplace(numbers) for joint in (one, other))
        assert abs((first - second).evalf(40)) < sp.Float("1e-38")
    alpha = 2 * sp.atan2(2, 5)
    assert dict(one.given)["alpha"].xreplace(numbers) == alpha


@pytest.mark.parametrize(
    ("value", "kind"),
    [("x", "angle"), ("atan2(x, 3)", "length"), ("atan(x/x)", None), ("sin(x)", "angle")],
)
def test_parameter_kind_is_inferred_from_first_use(value, kind):
    text = f'{HEAD}[parameters]\nx = 1\n[[joints]]\nalpha = "{value}"\n'
    if kind == "length":
        # x is a length, so the ratio x / 3 depends on the length unit.
        with pytest.raises(
            DescriptionError, match="with length parameters, this expression has another unit"
        ):
            read_text(text)
    else:
        assert read_text(text).parameters[0].kind == (kind or "length")


def test_error_in_inline_joint_names_its_line():
    text = (
        'name = "r"\nconvention = "dh"\njoints = [\n  { a = 1 },\n  { a = "x" },\n  { d = 1 },\n]\n'
    )
    with pytest.raises(DescriptionError) as caught:
        read_text(text)
    assert (caught.value.line, caught.value.field) == (5, "joints[2].a")


def test_missing_poe_axis_is_rejected():
    text = 'name = "r"\nconvention = "poe"\n[[joints]]\npoint = [1, 0, 0]\n'
    with pytest.raises(DescriptionError, match="the direction of the joint axis"):
        read_text(text)


DEGREES = HEAD + 'units = {{ angle = "deg" }}\n[[joints]]\na = 1\nalpha = {}\n[[joints]]\na = 1\n'


@pytest.mark.parametrize(
    ("written", "degrees"),
    [("1.5708", 90), ('"-1.571"', -90), ("1.57", 90), ("3.14159", 180), ("0.7854", 45)],
)
def test_radians_in_a_file_in_degrees_are_refused(written, degrees):
    with pytest.raises(DescriptionError, match=rf"alpha: .* in radians: write {degrees}, or"):
        read_text(DEGREES.format(written))


@pytest.mark.parametrize("written", ["1.5", "0.785", "90", "15.708", '"3927/2500"', "0.0", "0.5"])
def test_degrees_that_are_no_rounded_multiple_of_pi_are_taken(written):
    joint = read_text(DEGREES.format(written)).joints[0]
    assert dict(joint.given)["alpha"] == sp.Rational(written.strip('"')) * sp.pi / 180


def test_radians_in_a_parameter_and_in_limits_are_refused():
    for text in ("[parameters]\nt = { value = 1.5708 }\n", "[parameters]\nt = 1.5708\n"):
        turned = DEGREES.format('"t"').replace("[[joints]]", text + "[[joints]]", 1)
        with pytest.raises(DescriptionError, match="pi/2 in radians: write 90"):
            read_text(turned.replace("t = {", 't = { meaning = "twist",'))
    with pytest.raises(DescriptionError, match="-pi in radians: write -180"):
        read_text(DEGREES.format("90") + "limits = [-3.1416, 3.1416]\n")


@pytest.mark.parametrize(
    ("joint", "unit"), [('type = "revolute"', "45 rad"), ('type = "prismatic"', "m, the default")]
)
def test_large_limits_need_a_stated_unit(joint, unit):
    text = f'name = "r"\nconvention = "dh"\n[[joints]]\n{joint}\nlimits = [-170, 170]\n'
    with pytest.raises(DescriptionError, match=rf"limits: expected .* {unit}.* state the unit"):
        read_text(text)
    units = 'units = { length = "m", angle = "rad" }\n[[joints]]'
    assert read_text(text.replace("[[joints]]", units)).joints[0].limits == (-170, 170)
