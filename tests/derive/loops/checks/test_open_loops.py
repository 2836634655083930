"""Error messages about mechanisms whose loops cannot close are complete and correct.

The tests introduce typical errors into the robot files of mechanisms. If an error message proposes
a range for a value of the robot file, the loops must close in the middle of this range.
"""

import math
import pickle
import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import sympy as sp

from chasles.derive import (
    DescriptionError,
    Frame,
    LoopError,
    Mechanism,
    Strut,
    derive,
    read,
    read_text,
)
from chasles.derive.loops.checks.closable import doubts_of
from chasles.derive.loops.closing import open_loops
from chasles.derive.loops.closing.open_loops import open_loop
from chasles.derive.loops.closing.swapped_ends import doubtful_ends
from chasles.derive.loops.model.numeric_mechanism import NumericMechanism
from chasles.derive.model.mechanism import Closure
from tests.support.derivations import ROBOTS
from tests.support.loops.closed_in_numbers import Model
from tests.support.loops.continued import closed_configuration
from tests.support.loops.mechanisms import BASE, at, near, pin
from tests.support.loops.solved import solved

LOOPED = ["four_bar", "slider_crank", "five_bar", "excavator", "planar_3rrr"]


@cache
def mechanism(name):
    return read(ROBOTS / f"{name}.toml")


def with_parameter(robot, name, value):
    parameters = tuple(
        replace(p, value=sp.nsimplify(value)) if p.name == name else p for p in robot.parameters
    )
    return replace(robot, parameters=parameters)


def error_of(robot):
    """Return the error that solving a robot's loops raises, or None if it raises no error."""
    try:
        hybrid = solved(robot)
        assert hybrid.forward is not None
    except DescriptionError as error:
        return error
    return None


def message(robot):
    """Return the error message that solving a robot's loops raises, or "" without an error."""
    return str(error_of(robot) or "")


@cache
def spoilt_error(name, parameter, value):
    """Change one parameter of a shipped robot, and return the resulting exception."""
    return error_of(with_parameter(mechanism(name), parameter, value))


# --- closure errors of open loops, and remedies ---

OFFER = re.compile(
    r"^    (\w+).*, now \S+ (?:mm|deg): (\S+)(?: to (\S+))? (mm|deg)( or more)?$", re.M
)


def offers(text):
    """Yield the name and range (meter or radian) of each value that a message suggests."""
    for name, low, high, unit, or_more in OFFER.findall(text):
        factor = 1e-3 if unit == "mm" else np.pi / 180
        bottom = float(low) * factor
        top = float(high) * factor if high else bottom * 2 if or_more else bottom
        yield name, bottom, top


def closes(robot, name, value):
    if name in robot.actuated:
        reference = dict(robot.reference) | {name: sp.nsimplify(round(value, 9))}
        robot = replace(robot, reference=tuple(reference.items()))
    else:
        robot = with_parameter(robot, name, round(value, 9))
    model, random = Model(robot), np.random.default_rng(0)
    for _ in range(30):
        try:
            model.closed(model.q, model.u + random.normal(0, 0.6, len(model.u)))
        except (AssertionError, np.linalg.LinAlgError):
            continue
        return True
    return False


SPOILT = [
    ("four_bar", "b", "0.08"),
    ("five_bar", "w", "0.4"),
    ("slider_crank", "l", "0.02"),
]


@pytest.mark.parametrize(("name", "parameter", "value"), SPOILT)
def test_proposed_parameter_values_close_the_loop(name, parameter, value):
    """For a wrong length, the error message does not propose to swap the ends of a rod."""
    whole = mechanism(name)
    robot = with_parameter(whole, parameter, value)
    text = str(spoilt_error(name, parameter, value))
    assert "swapped" not in text
    assert re.search(rf"'{name}': the loop of '\w+' does not close at the reference", text), text
    assert re.search(r"\d mm", text)
    found = [
        o for o in offers(text) if o[0] in (*robot.actuated, *(p.name for p in robot.parameters))
    ]
    assert any(o[0] == parameter for o in found), text
    for offer, low, high in found:
        assert closes(robot, offer, (low + high) / 2), (offer, low, high)


def test_four_bar_gap_and_proposed_ranges_are_correct():
    # The crank pin (0, 100) and the rocker pin (350, 0) are 364.0 mm apart.
    apart = 1000 * np.hypot(0.1, 0.35)
    text = str(spoilt_error("four_bar", "b", "0.08"))
    assert f"are at best {apart - 330:.4g} mm apart" in text
    ranges = {name: (1e3 * low, 1e3 * high) for name, low, high in offers(text)}
    assert ranges["b"] == pytest.approx((apart - 250, apart + 250), abs=0.1)
    assert ranges["c"] == pytest.approx((apart - 80, apart + 80), abs=0.1)


def test_loop_error_holds_gap_and_remedies():
    made = spoilt_error("four_bar", "b", "0.08")
    assert type(made) is LoopError
    error = pickle.loads(pickle.dumps(made))
    assert str(error) == str(made)
    assert error.closure_error == pytest.approx(np.hypot(0.1, 0.35) - 0.33, abs=1e-6)
    assert {"b (coupler)", "c (rocker)"} < {remedy.name for remedy in error.remedies}
    assert error.file == ""


def test_open_delta_is_diagnosed_with_few_evaluations(monkeypatch):
    counted, poses = [], NumericMechanism.poses

    def counting(bodies, values):
        counted.append(1)
        return poses(bodies, values)

    monkeypatch.setattr(NumericMechanism, "poses", counting)
    text = str(open_loop(with_parameter(mechanism("delta"), "l_r", "0.1")))
    assert re.search(r"the loop of 'rod_\w+' does not close", text)
    assert "510.1 mm too short" in text
    ranges = {name: (1e3 * low, 1e3 * high) for name, low, high in offers(text)}
    assert ranges["l_r"][0] == pytest.approx(355.1, abs=0.1)
    assert ranges["r_p"] == pytest.approx((344.6, 575.4), abs=0.1)
    assert len(counted) < 3000


def test_loops_that_close_have_no_gap():
    for name in LOOPED:
        assert open_loop(mechanism(name)) is None


def test_ambiguous_reference_error_proposes_a_configuration():
    level = (("left", sp.Integer(0)), ("right", sp.Integer(0)))
    text = message(replace(mechanism("five_bar"), reference=level))
    assert "The loops close at left_elbow = " in text
    assert "write values close to these in [reference]" in text
    assert message(replace(mechanism("five_bar"), reference=())) == ""
    assert "choose a reference" in message(replace(mechanism("slider_crank"), reference=()))


BONNET = """
name = "bonnet"
convention = "urdf"
actuated = ["gas_strut"]
units = { length = "mm", angle = "deg" }
tool = { body = "bonnet", xyz = [1100, 0, 60] }
[[joints]]
name = "front"
link = "front"
axis = [0, -1, 0]
[[joints]]
name = "hinge"
link = "bonnet"
xyz = [130, 0, 90]
axis = [0, -1, 0]
[[joints]]
name = "rear"
parent = "0"
link = "rear"
xyz = [-60, 0, 60]
axis = [0, -1, 0]
[[closures]]
name = "rear_pin"
kind = "pin"
a = { body = "bonnet", xyz = [-110, 0, 40], rpy = [90, 0, 0] }
b = { body = "rear", xyz = [80, 0, 70], rpy = [90, 0, 0] }
[[cylinders]]
name = "gas_strut"
retracted = 260
limits = [0, 220]
a = { body = "0", xyz = [250, 0, -60] }
b = { body = "bonnet", xyz = [350, 0, 10] }
[reference]
gas_strut = 20
"""


def test_proposal_starts_at_the_stated_joints_and_includes_the_stroke():
    """With the default stroke, the loop closes only far from the joint values in the robot file."""
    press = read(Path(__file__).with_name("rocker_press.toml"))
    with pytest.raises(DescriptionError, match="does not close at the reference") as message:
        derive(press, functions=["fk"])
    proposed = re.findall(r"(\w+) = (-?[\d.]+) (deg|mm)", str(message.value))
    stated = {name: math.degrees(float(value)) for name, value in press.reference}
    values = {
        name: sp.Rational(value) * (sp.pi / 180 if unit == "deg" else sp.Rational(1, 1000))
        for name, value, unit in proposed
    }
    assert values.keys() == {"crank", "coupler", "rocker", "ram"}
    for name, value, unit in proposed:
        assert unit == "mm" or float(value) == pytest.approx(stated[name], abs=15)
    derive(replace(press, reference=tuple(values.items())), functions=["fk"])


def test_default_swing_angle_points_along_its_strut():
    robot = read_text(BONNET)
    # At zero joint values, the gas strut is 1.8 mm too short.
    assert message(robot) == ""
    z = closed_configuration(robot)
    assert max(abs(z[name]) for name in ("front", "hinge", "rear")) < 0.1
    assert z["gas_strut_swing"] == pytest.approx(0.64, abs=0.1)
    far = (*robot.reference, ("gas_strut_swing", sp.Rational(1, 2)))
    assert closed_configuration(replace(robot, reference=far)) == pytest.approx(z, abs=1e-12)


def test_error_states_excess_length_of_a_cylinder():
    text = message(read_text(BONNET.replace("gas_strut = 20", "gas_strut = 4000")))
    assert "its ends on 0 and bonnet are" in text
    assert re.search(r"4260 mm long, \d+ mm too long", text)
    assert re.search(r"^    gas_strut, now 4000 mm: \S+ to \S+ mm$", text, re.M)


def test_proposed_angles_are_wrapped_to_half_a_revolution():
    assert open_loops._wrapped(math.radians(-615.1), False) == pytest.approx(math.radians(104.9))
    assert open_loops._wrapped(-615.1, True) == -615.1


PIN_ACROSS = """
name = "upright"
convention = "urdf"
actuated = ["crank"]
tool = { body = "rod" }
[[joints]]
name = "crank"
link = "crank"
axis = [0, -1, 0]
[[joints]]
name = "elbow"
link = "rod"
xyz = [1, 0, 0]
axis = [0, -1, 0]
[[joints]]
name = "foot"
parent = "0"
type = "prismatic"
link = "shoe"
axis = [1, 0, 0]
[[closures]]
name = "pin"
kind = "pin"
a = { body = "rod", xyz = [2, 0, 0] }
b = { body = "shoe" }
[reference]
crank = 1
elbow = -1
foot = 2
"""


def test_error_on_pin_with_wrong_axis_proposes_a_rotation():
    text = message(read_text(PIN_ACROSS))
    assert "a pin rotates about the z axis of its frames" in text
    rotation = "rpy = [90, 0, 0] deg"
    assert f"(0, -1, 0): rotate frame a by {rotation} and frame b by {rotation}" in text
    assert "0 mrad" not in text
    good = PIN_ACROSS.replace("xyz = [2, 0, 0] }", 'xyz = [2, 0, 0], rpy = ["pi/2", 0, 0] }')
    good = good.replace('{ body = "shoe" }', '{ body = "shoe", rpy = ["pi/2", 0, 0] }')
    assert message(read_text(good)) == ""


# --- degrees of freedom and actuators of a mechanism ---


def spoilt_actuation(name):
    """Yield erroneous robots, each with words of the expected error message.

    Each robot has one actuator too few or too many, or lacks a loop joint or rod.
    """
    robot = mechanism(name)
    taken = {c.moves for c in robot.coordinates}
    for k in range(len(robot.actuated) if len(robot.actuated) > 1 else 0):
        fewer = (*robot.actuated[:k], *robot.actuated[k + 1 :])
        yield replace(robot, actuated=fewer), "can still move"
    for member in robot.members:
        if member not in taken:
            yield replace(robot, actuated=(*robot.actuated, member)), "remove "
    for closure in robot.closures:
        less = tuple(c for c in robot.closures if c is not closure)
        yield replace(robot, closures=less), "can still move"
    for strut in robot.struts:
        if not strut.is_cylinder:
            kept = tuple(s for s in robot.struts if s is not strut)
            given = [(n, v) for n, v in robot.reference if n != strut.swing_name]
            less = replace(robot, struts=kept, reference=tuple(given))
            yield less, "can still move"


TESTED = {"four_bar": 1, "slider_crank": 1, "five_bar": 2, "excavator": 5, "planar_3rrr": 5}
"""For each robot, a number k: the test uses every k-th erroneous variant of the robot. The tested
variants contain each kind of error."""


@pytest.mark.parametrize("name", LOOPED)
def test_error_states_mismatch_of_actuators_and_freedoms(name):
    cases = list(spoilt_actuation(name))[:: TESTED[name]]
    assert {words for _, words in cases} == {"can still move", "remove "}
    for robot, words in cases:
        text = message(robot)
        model = Model(robot)
        # The error message states the robot's name and number of actuated coordinates.
        assert f"robot {robot.name!r} has " in text
        assert f"{len(robot.actuated)} actuated coordinate" in text
        assert words in text
        passive_cylinder = any(s.is_cylinder and s.name not in robot.actuated for s in robot.struts)
        # The numerical rank does not count the degree of freedom of an unactuated cylinder.
        if words == "can still move" and not passive_cylinder:
            J = model.jacobian(model.q, model.u)
            free = len(model.unknown) - np.linalg.matrix_rank(J, tol=1e-6)
            stated = int(re.search(r"has (\d+) degree", text).group(1))
            assert stated - len(robot.actuated) == free > 0


def test_shipped_mechanisms_have_no_loop_or_actuation_error():
    for name in LOOPED:
        assert message(mechanism(name)) == ""


def test_dependent_actuators_are_rejected():
    robot = mechanism("four_bar")
    twice = (*robot.closures, replace(robot.closures[0], name="again"))
    braced = replace(
        robot,
        struts=(),
        closures=twice[:1],
        actuated=("crank", "rocker"),
    )
    with pytest.raises(
        DescriptionError, match="crank and rocker depend on each other: remove 1 of them"
    ):
        derive(braced, functions=["fk"])


def swapped(rod):
    """Return a rod with swapped ends."""
    a, b = rod.a, rod.b
    return replace(rod, a=replace(a, placement=b.placement), b=replace(b, placement=a.placement))


@pytest.mark.parametrize("k", [0, 3])
def test_rod_with_swapped_ends_is_named(k):
    robot = mechanism("delta")
    struts = tuple(swapped(s) if i == k else s for i, s in enumerate(robot.struts))
    spoilt = replace(robot, struts=struts)
    # If the ends of a rod on the second or third arm are swapped, all loops still close, but the
    # platform is rotated by 5 degrees.
    text = message(spoilt) if k < 2 else doubtful_ends(spoilt, closed_configuration(spoilt))
    assert f"the ends of rod {robot.struts[k].name!r} seem swapped" in text
    assert text.count("rod_") == (2 if k < 2 else 1)


def test_diagnostics_report_swapped_rod_ends():
    robot = mechanism("delta")
    struts = tuple(swapped(s) if i == 3 else s for i, s in enumerate(robot.struts))
    (stated,) = doubts_of(solved(replace(robot, struts=struts)))
    assert stated.startswith("the loops close 0.083 (rad, or relative to the size) away from")
    assert "rod 'rod_2_right' seem swapped" in stated


def test_shipped_mechanisms_have_no_swapped_rod_diagnostics():
    for name in ("five_bar", "slider_crank", "delta", "stewart_gough"):
        robot = mechanism(name)
        assert doubtful_ends(robot, closed_configuration(robot)) == ""


def with_a_tilted_rocker(kind, closure):
    """Return a four-bar linkage whose rocker axis is tilted by 0.05 degrees."""
    tilt = ("x", sp.pi / 3600)
    return Mechanism(
        "tilted",
        (
            pin("crank", BASE, "crank_b"),
            pin("coupler", "crank_b", "coupler_b", 1),
            pin("rocker", BASE, "rocker_b", 3, 0, 0, tilt),
        ),
        ("crank",),
        closures=(Closure("far", kind, Frame("coupler_b", at(3)), Frame("rocker_b", at(2))),),
        reference=near(("crank", 1), ("coupler", "-1/2"), ("rocker", 2)),
        closure=closure,
    )


@pytest.mark.parametrize("kind", ["pin", "ball"])
def test_error_reports_nonparallel_axes_and_redundant_constraints(kind):
    stated = message(with_a_tilted_rocker(kind, "exact"))
    assert "'far' does not close" in stated
    assert "the axis of 'rocker' is 0.873 mrad out of parallel" in stated
    count = {"pin": "3 constraints are", "ball": "1 constraint is"}[kind]
    assert f"{count} redundant; smallest achievable closure errors: 'far' 1.72 mm" in stated
    assert ("0.873 mrad of misalignment" in stated) == (kind == "pin")
    assert 'closure = "least squares" at the top of the file' in stated
    assert message(with_a_tilted_rocker(kind, "least squares")) == ""


def with_a_third_crank(closure, miss="0.0002"):
    """Return a parallelogram with a third crank that has a length error (meter)."""
    lengths = (("rod", 2, 1), ("third", 1, 1 + sp.Rational(miss)))
    rods = tuple(
        Strut(name, Frame(BASE, at(x)), Frame("coupler", at(x)), length)
        for name, x, length in lengths
    )
    return Mechanism(
        "three",
        (pin("crank", BASE, "arm"), pin("bar", "arm", "coupler", 1)),
        ("crank",),
        struts=rods,
        tool_body="coupler",
        reference=near(("crank", 1), ("bar", -1)),
        closure=closure,
    )


def test_error_names_the_redundant_third_crank():
    stated = message(with_a_third_crank("exact"))
    assert "0.2 mm too long" in stated
    assert "1 constraint is redundant" in stated
    # The closure errors of 'rod' and 'third' have the ratio 1 to -2.
    assert "'third' 0.16 mm in length, 'rod' 0.08 mm in length" in stated
    assert "omitting 'rod' or 'third' adds no freedom" in stated
    (note,) = solved(with_a_third_crank("least squares")).mechanism.notes
    assert note.startswith("closed in least squares: 1 constraint is redundant")


def test_least_squares_closure_rejects_large_gaps():
    stated = message(with_a_third_crank("least squares", "0.1"))
    assert "'third' does not close" in stated
    assert 'closure = "least squares" applies to redundant constraints' in stated


def test_least_squares_closure_rejects_unreachable_loops():
    robot = with_parameter(mechanism("four_bar"), "d", "0.9")
    assert "does not close" in message(replace(robot, closure="least squares"))


def test_least_squares_closure_rejects_conflicting_motors():
    robot = mechanism("four_bar")
    fight = replace(robot, actuated=("crank", "rocker"), closure="least squares")
    off = replace(fight, reference=tuple((n, v + sp.Rational(1, 1000)) for n, v in fight.reference))
    assert message(off) != ""


def test_a_parameter_may_have_any_name():
    text = (ROBOTS / "four_bar.toml").read_text()
    for own, name in {"a": "z1", "b": "theta1", "c": "p1", "d": "tau1", "h": "phi"}.items():
        text = text.replace(f"\n{own} = {{ value", f"\n{name} = {{ value", 1)
        text = text.replace(f'"{own}"', f'"{name}"')
    text = text.replace('"b / 2", "phi"', '"theta1 / 2", "phi + turn"')
    text = text.replace("[parameters]", "[parameters]\nturn = 1")
    called = solved(read_text(text, file="four_bar.toml"))

    assert called.at_reference == pytest.approx(solved(mechanism("four_bar")).at_reference)
