"""Transmissions of a URDF are couplings with the equations of ros2_control."""

import random
from dataclasses import replace
from functools import cache

import pytest
import sympy as sp

from chasles.contract.errors import InputValueError
from chasles.derive import Coupling, DescriptionError, Motor, convert, read_text
from tests.support.pages import examples

ARM = """<robot name="arm">
<link name="base"/><link name="one"/><link name="two"/><link name="three"/>
<joint name="a" type="revolute"><parent link="base"/><child link="one"/>
  <axis xyz="0 0 1"/><limit lower="-1" upper="1"/></joint>
<joint name="b" type="revolute"><parent link="one"/><child link="two"/>
  <origin xyz="0.3 0 0"/><axis xyz="0 1 0"/><limit lower="-1" upper="1"/></joint>
<joint name="c" type="prismatic"><parent link="two"/><child link="three"/>
  <axis xyz="1 0 0"/><limit lower="0" upper="0.5"/></joint>
{}
</robot>"""


def part(tag, name, role="", **numbers):
    inside = "".join(f"<{field}>{value}</{field}>" for field, value in numbers.items())
    stated = f' role="{role}"' if role else ""
    return f'<{tag} name="{name}"{stated}>{inside}</{tag}>'


def transmission(kind, *parts):
    inside = f"<plugin>transmission_interface/{kind}</plugin>{''.join(parts)}"
    return (
        f'<ros2_control name="s" type="system"><transmission name="t">{inside}</transmission>'
        "</ros2_control>"
    )


def read_arm(*elements):
    return read_text(ARM.format("".join(elements)), format="urdf")


def differential(n, m, c):
    def actuators(x, y):
        x, y = x - c[0], y - c[1]
        return (x * m[0] + y * m[1]) * n[0], (x * m[0] - y * m[1]) * n[1]

    return actuators


def four_bar(n, m, c):
    def actuators(x, y):
        x, y = x - c[0], y - c[1]
        return x * m[0] * n[0], (x + y * m[1]) * n[1]

    return actuators


@pytest.mark.parametrize(
    ("kind", "equations"),
    [("DifferentialTransmission", differential), ("FourBarLinkageTransmission", four_bar)],
)
@pytest.mark.parametrize("seed", range(3))
def test_two_actuators_have_the_equations_of_ros2_control(kind, equations, seed):
    draw = random.Random(seed)
    n, m, c = (
        [sp.Rational(draw.randint(1, 99), draw.choice((-8, 5))) for _ in "ab"] for _ in "nmc"
    )
    parts = [
        *(
            part(
                "joint",
                joint,
                f"joint{k + 1}",
                mechanical_reduction=float(m[k]),
                offset=float(c[k]),
            )
            for k, joint in enumerate("ba")
        ),
        *(
            part("actuator", f"m{k}", f"actuator{k + 1}", mechanical_reduction=float(n[k]))
            for k in (0, 1)
        ),
    ]
    draw.shuffle(parts)
    robot = read_arm(transmission(kind, *parts))
    x, y = sp.Rational(3, 7), sp.Rational(-2, 9)
    wanted = dict(zip(("m0", "m1"), equations(n, m, c)(x, y), strict=True)) | {"c": 0}
    theta = robot.linear_map.at([wanted[name.name] for name in robot.coordinates])
    assert theta == (y, x, 0)
    assert robot.motors == (Motor("m0"), Motor("m1"))


def test_simple_transmission_of_urdf_and_of_ros2_control_agree():
    wanted = (Coupling("a", (("motor", "-1/50"),), "0.1"),)
    old = (
        '<transmission name="t"><type>transmission_interface/SimpleTransmission</type>'
        f"{part('joint', 'a', offset=0.1)}{part('actuator', 'motor', mechanicalReduction=-50)}"
        "</transmission>"
    )
    new = transmission(
        "SimpleTransmission",
        part("joint", "a", mechanical_reduction=-50, offset=0.1),
        part("actuator", "motor"),
    )
    assert read_arm(old).couplings == read_arm(new).couplings == wanted
    assert "transmission t: q has motor for a" in read_arm(new).notes


def test_actuator_may_have_the_name_of_its_joint_and_a_joint_may_mimic_it():
    robot = read_arm(
        transmission(
            "SimpleTransmission", part("actuator", "a"), part("joint", "a", mechanical_reduction=2)
        )
    )
    assert robot.couplings == (Coupling("a", (("a", "1/2"),)),)
    assert robot.motors == ()
    text = ARM.replace('<axis xyz="0 1 0"/>', '<axis xyz="0 1 0"/><mimic joint="a" offset="1"/>')
    gear = transmission(
        "SimpleTransmission",
        part("actuator", "m"),
        part("joint", "a", mechanical_reduction=2, offset=0.5),
    )
    follower = read_text(text.format(gear), format="urdf").couplings[1]
    assert follower == Coupling("b", (("m", "1/2"),), "3/2")


def test_transmission_without_effect_is_noted_unless_it_is_direct():
    direct = transmission("SimpleTransmission", part("actuator", "m"), part("joint", "a"))
    robot = read_arm(direct)
    assert (robot.couplings, robot.notes) == ((), ())
    other = transmission("gear/Custom", part("actuator", "m"), part("joint", "a"))
    assert read_arm(other).notes == ("transmission t has no effect: Custom, 1 actuators, 1 joints",)
    outside = transmission(
        "DifferentialTransmission",
        *(part("actuator", name) for name in "mn"),
        *(part("joint", name) for name in ("a", "grip")),
    )
    assert read_arm(outside).couplings == ()
    assert "grip is not a joint of the chain" in read_arm(outside).notes[0]


GEAR = transmission(
    "SimpleTransmission", part("actuator", "m"), part("joint", "a", mechanical_reduction=2)
)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (GEAR.replace(">2<", ">0<"), "<joint a> mechanical_reduction: .*nonzero"),
        (GEAR.replace(">2<", ">two<"), "<joint a> mechanical_reduction: .*decimal number"),
        (GEAR.replace('"m"', '"b"'), "<actuator b> name: .*no other joint"),
        (GEAR + GEAR, "<actuator m> name: .*no other transmission"),
        (GEAR + GEAR.replace('"m"', '"n"'), "<joint a> name: .*without another transmission"),
        (GEAR.replace(' name="m"', ""), "<actuator> name"),
    ],
)
def test_invalid_transmission_is_refused_with_its_element(text, message):
    with pytest.raises(DescriptionError, match=message):
        read_arm(text)


@cache
def robots():
    """Return the arms with coupled joints from the documentation, keyed by robot name."""
    found = map(read_text, examples("how-to/couplings.md", "toml"))
    return {robot.name: robot for robot in found}


@pytest.mark.parametrize("name", ["base_elbow", "bevel_wrist"])
def test_couplings_are_written_as_transmissions_and_read_back(name):
    robot = robots()[name]
    written = convert(robot, "urdf")
    assert read_text(written.text, format="urdf").linear_map == robot.linear_map
    assert "the hardware of <ros2_control> is a simulation" in written.notes
    limited = "URDF has no motor limits: left, right"
    assert (limited in written.notes) == (name == "bevel_wrist")


def test_couplings_without_a_transmission_are_refused():
    with pytest.raises(InputValueError, match="cannot express the coupling of j2, j3, level"):
        convert(robots()["palletizer"], "urdf")
    joint1_last = read_arm(
        transmission(
            "FourBarLinkageTransmission",
            *(part("actuator", name) for name in "mn"),
            *(part("joint", name) for name in "ba"),
        )
    )
    couplings = (Coupling("a", (("n", 1), ("m", -1))), Coupling("b", (("m", 1),)))
    assert convert(joint1_last, "urdf").error == (0, 0)
    with pytest.raises(
        InputValueError,
        match="order of the coordinates, because joint 1 of a four-bar linkage follows joint 2; "
        "new order: m, n, c",
    ):
        convert(replace(joint1_last, couplings=couplings), "urdf")
    constant = replace(joint1_last, couplings=(Coupling("a", (), "0.3"),), motors=())
    with pytest.raises(InputValueError, match="cannot express the coupling of a"):
        convert(constant, "urdf")
