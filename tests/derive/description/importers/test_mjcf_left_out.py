"""A note or an error names each MJCF element that chasles does not model."""

import numpy as np
import pytest
import sympy as sp

from chasles.derive import DescriptionError, derive, mobility, springs_at_rest
from tests.support.loops.closures import Model
from tests.support.mjcf_models import read_model, wrong

WRIST = """\
<mujoco model="wrist"><worldbody>
<body name="arm"><joint name="shoulder" axis="0 0 1" range="-90 90"/><geom size=".01"/>
<body name="pitch_link" pos=".3 0 0"><joint name="pitch" axis="0 1 0" range="-90 90"/>
<geom size=".01"/><site name="here"/>
<body name="hand"><joint name="roll" axis="1 0 0" range="-90 90"/><geom size=".01"/>
<site name="tcp" pos=".1 0 .02"/></body></body></body>
<body name="other" pos="0 2 0"><joint name="turn" range="0 9"/><geom size=".01"/>
<site name="there"/></body></worldbody>{parts}</mujoco>
"""
FIXED = """\
<fixed name="left"{}><joint joint="pitch" coef="1"/><joint joint="roll" coef="-1"/></fixed>"""
TENDON, SPRING = FIXED.format(""), FIXED.format(' stiffness="9"')
ELSEWHERE = '<fixed name="far"><joint joint="turn" coef="1"/></fixed>'
LEG = """\
<mujoco model="leg"><compiler angle="radian"/><worldbody><body name="base"><geom size=".01"/>
<body name="crank"><joint name="crank" axis="0 0 1"/><geom size=".01"/>
<body name="coupler" pos=".1 0 0"><joint name="coupler" axis="0 0 1"/><geom size=".01"/>
<body name="blade" pos=".2 .1 0"><joint name="blade" axis="0 0 1"{stiffness}/>
<geom size=".01"/><site name="tool" pos=".05 0 0"/></body></body></body>
<body name="rocker" pos=".3 0 0"><joint name="rocker" axis="0 0 1"/><geom size=".01"/></body>
</body></worldbody><equality><connect body1="blade" body2="rocker" anchor=".05 .05 0"/>{equality}
</equality><actuator>{motor}</actuator></mujoco>
"""
MOTOR = '<motor joint="crank"/>'


@pytest.fixture
def path(tmp_path):
    return tmp_path / "model.xml"


@pytest.mark.parametrize(
    ("parts", "notes"),
    [
        ("", ()),
        (
            f"<tendon>{TENDON}{ELSEWHERE}</tendon>"
            '<actuator><position joint="shoulder"/><position tendon="left"/></actuator>',
            ("tendon left over joints pitch, roll (driven by an actuator) is not modeled",),
        ),
        (
            f"<tendon>{SPRING}</tendon>",
            ("tendon left over joints pitch, roll (a spring) is not modeled",),
        ),
        (
            '<tendon><spatial><site site="here"/><site site="there"/></spatial></tendon>',
            ("tendon tendon1 over sites is not modeled",),
        ),
        (
            '<default><joint stiffness="3"/></default>',
            ("joint springs are not modeled (stiffness of shoulder, pitch, roll)",),
        ),
        (
            '<actuator><general name="piston" cranksite="tcp" slidersite="here" cranklength="1"/>'
            "</actuator>",
            ("slider-crank actuators are not modeled: piston",),
        ),
    ],
    ids=["none", "driven tendon", "tendon spring", "spatial tendon", "springs", "slider-crank"],
)
def test_tendons_springs_and_cranks_are_noted(path, parts, notes):
    robot = read_model(path, WRIST.format(parts=parts), tip="tcp")
    assert len(robot.notes) == len(notes)
    for found, expected in zip(robot.notes, notes, strict=True):
        assert found.startswith(expected)
    assert [joint.name for joint in robot.coordinates] == ["shoulder", "pitch", "roll"]


DIFFERENTIAL = """<tendon><fixed name="left"><joint joint="pitch" coef="1"/><joint joint="roll"
coef="1"/></fixed><fixed name="right" range="-1 2"><joint joint="pitch" coef="1"/><joint
joint="roll" coef="-2"/></fixed></tendon><actuator><position joint="shoulder"/>{}</actuator>"""
PULLED = '<position tendon="left"/><position tendon="right"/>'


def test_driven_tendons_that_determine_their_joints_are_coordinates(path):
    robot = read_model(path, WRIST.format(parts=DIFFERENTIAL.format(PULLED)), tip="tcp")
    assert [c.name for c in robot.coordinates] == ["shoulder", "left", "right"]
    assert robot.coordinates[2].limits == (-1, 2)
    q = sp.Matrix(sp.symbols("shoulder left right"))
    _, pitch, roll = robot.linear_map.at(q)
    assert sp.expand(pitch + roll) == q[1]
    assert sp.expand(pitch - 2 * roll) == q[2]
    assert "q holds the lengths of the driven tendons left, right" in robot.notes


def test_tendon_and_actuated_joint_determine_both_joints(path):
    actuators = '<position tendon="left"/><position joint="pitch"/>'
    robot = read_model(path, WRIST.format(parts=DIFFERENTIAL.format(actuators)), tip="tcp")
    assert [c.name for c in robot.coordinates] == ["shoulder", "pitch", "left"]
    assert sp.Matrix([[1, 0, 0], [0, 1, 0], [0, -1, 1]]) == robot.linear_map.C


def test_equality_of_tendons_is_refused_where_it_couples_the_robot(path):
    law = '<equality><tendon tendon1="{}"/></equality>'
    tendons = f"<tendon>{TENDON}{ELSEWHERE}</tendon>"
    message = wrong(path, WRIST.format(parts=tendons + law.format("left")), tip="tcp")
    assert "an equality fixes the length of tendon 'left' over joints pitch, roll" in message
    assert (
        read_model(path, WRIST.format(parts=tendons + law.format("far")), tip="tcp").name == "wrist"
    )


def test_joints_without_range_are_noted_as_unlimited(path):
    open_ = WRIST.replace('name="pitch" axis="0 1 0" range="-90 90"', 'name="pitch" axis="0 1 0"')
    zero = WRIST.replace('name="pitch" axis="0 1 0" range="-90 90"', 'name="pitch" range="0 0"')
    for text in (open_, zero):
        robot = read_model(path, text.format(parts=""), tip="tcp")
        assert robot.joints[1].limits == (None, None)
        assert robot.notes == ("the file states no limits for joint pitch, which is unlimited",)
    law = '<equality><joint joint1="pitch" joint2="roll"/></equality>'
    assert read_model(path, open_.format(parts=law), tip="tcp").notes == ()


def test_follower_of_a_joint_elsewhere_names_both_joints(path):
    law = '<equality><joint joint1="pitch" joint2="turn"/></equality>'
    message = wrong(path, WRIST.format(parts=law), tip="tcp")
    assert "a joint between world and tcp that pitch follows" in message
    assert "found 'turn'" in message


def test_driven_tendon_in_a_loop_is_refused_by_name(path):
    tendon = '</actuator><tendon><fixed name="t"><joint joint="crank" coef="1"/></fixed></tendon>'
    driven = f'<motor tendon="t"/>{tendon}<actuator>'
    message = wrong(path, LEG.format(stiffness="", equality="", motor=driven), tip="tool")
    assert "<motor joint='crank'/> in <actuator>; driven tendons are not modeled (t)" in message


def test_refusal_of_too_many_freedoms_names_springs(path):
    for stiffness, words in ((' stiffness="9"', "; blade is a spring in the file"), ("", "")):
        text = LEG.format(stiffness=stiffness, equality="", motor=MOTOR)
        with pytest.raises(DescriptionError, match="2 degrees of freedom and 1 actuated") as caught:
            derive(read_model(path, text, tip="tool"), functions=("fk",))
        assert ("spring" in str(caught.value)) == bool(words)
        assert words in str(caught.value)


SPATIAL_LEG = """\
<mujoco model="bird"><worldbody><body name="pelvis" pos="0 0 1"><geom size=".1"/>
<body name="hip" pos="0 0 -.09"><joint name="hip" axis="0 1 0" range="-50 80"/><geom size=".01"/>
<body name="rod" pos="0 0 .045" xyaxes="0.7922 -0.60599 -0.072096 0.60349 0.79547 -0.054922">
<joint type="ball"/><geom size=".01"/></body>
<body name="knee" pos=".12 0 .0045" xyaxes=".70711 -.70711 0 .70711 .70711 0"><geom size=".01"/>
<joint name="knee" ref="-45" range="-164 -37"/>
<body name="shin" pos=".06068 .04741 0"><geom size=".01"/>
<joint name="shin" range="-20 20" stiffness="1500"/>
<body name="tarsus" pos=".43476 .02 0" xyaxes="0.52992 0.84805 0 -0.84805 0.52992 0">
<joint name="tarsus" ref="58" range="50 170"/><geom size=".01"/>
<body name="heel" pos="-.01269 -.03059 .00092"
 xyaxes="-0.91211 0.40829 0.036948 -0.40992 -0.90952 -0.068841">
<joint name="heel" stiffness="1250"/><geom size=".01"/></body>
<body name="foot_crank" pos=".058 -.034 .02275"><joint name="foot_crank" range="-140 -30"/>
<geom size=".01"/><body name="foot_rod" pos=".055 0 -.00791"><joint name="foot_rod"/>
<geom size=".01"/></body></body>
<body name="foot" pos=".408 -.04 0"><joint name="foot" range="-140 -30"/><geom size=".01"/></body>
</body></body></body></body></body></worldbody>
<equality><connect body1="foot_rod" body2="foot" anchor="0.35012 0 0"/>
<connect body1="rod" body2="heel" anchor="0.5012 0 0"/></equality>
<actuator><motor joint="hip"/><motor joint="knee"/><motor joint="foot"/></actuator></mujoco>
"""


def test_loops_with_spare_freedoms_are_not_taken_for_open_loops(path):
    robot = read_model(path, SPATIAL_LEG, tip="foot")
    with pytest.raises(DescriptionError, match="5 degrees of freedom and 3 actuated") as caught:
        derive(robot, functions=("fk",))
    assert "shin and heel are springs in the file" in str(caught.value)


def test_springs_at_rest_are_rigid_at_the_values_without_torque(path):
    text = LEG.format(stiffness=' stiffness="9" springref=".1"', equality="", motor=MOTOR)
    robot = read_model(path, text, tip="tool")
    rigid = springs_at_rest(robot)
    assert mobility(rigid).true == len(rigid.actuated)
    bent, held = Model(robot), Model(rigid)
    assert set(bent.names) - set(held.names) == {"blade"}
    z = np.random.default_rng(0).uniform(-1, 1, (5, len(bent.names)))
    z[:, bent.places_of(["blade"])] = 0.1
    poses = held.poses(z[:, bent.places_of(held.names)])
    for body, T in bent.poses(z).items():
        np.testing.assert_allclose(poses[body], T, atol=1e-12)
