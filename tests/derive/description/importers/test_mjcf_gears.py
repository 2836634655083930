"""Joint equalities and ball joints in MJCF models with loops agree with MuJoCo."""

from itertools import permutations

import numpy as np
import pytest

from chasles.derive import derive
from chasles.derive.loops.closing.loop_model import loop_model
from chasles.derive.loops.functions import constraint_functions
from chasles.derive.loops.functions.tool import tool_functions
from chasles.derive.loops.solve.solved_loops import solved_loops
from chasles.derive.terms.casadi_graph import lower
from tests.support.mjcf_models import mujoco, read_model, wrong

FIVE_BAR = """\
<mujoco model="five-bar"><compiler angle="radian"/><option jacobian="dense"/><worldbody>
<body name="left"><joint name="left" axis="0 0 1" ref=".2"/><geom size=".01"/>
<body name="coupler" pos=".1 0 0"><joint name="coupler" axis="0 0 -1"/><geom size=".01"/>
<site name="tool" pos=".1 .02 0"/></body></body>
<body name="right" pos=".2 .02 0"><joint name="right" axis="0 0 1"/>
<geom size=".01"/><body name="link" pos=".1 0 .05" euler="0 0 1.5"><joint name="link" axis="0 0 1"/>
<geom size=".01"/></body></body>{bodies}
</worldbody><equality><connect name="pin" body1="coupler" body2="link" anchor=".12 .1 0"/>
{equalities}</equality><actuator><motor joint="{motor}"/></actuator></mujoco>
"""
SHAFT = '<body><joint name="shaft" axis="1 0 0"/><geom size=".01"/></body>'
SECOND = """<body name="crank" pos=".5 0 0"><joint name="crank" axis="0 0 1"/><geom size=".01"/>
<body name="bar" pos=".1 0 0"><joint name="bar" axis="0 0 1"/><geom size=".01"/>
<site name="second" pos=".1 0 0"/></body></body>
<body name="rocker" pos=".8 0 0"><joint name="rocker" axis="0 0 1"/><geom size=".01"/></body>
"""
SECOND_PIN = '<connect name="pin2" body1="bar" body2="rocker" anchor=".25 .2 0"/>'
BALL = """\
<mujoco model="ball"><compiler angle="radian"/><option jacobian="dense"/><worldbody>
<body name="crank"><joint name="crank" axis="0 0 1"/><geom size=".01"/>
<body name="coupler" pos=".1 0 0"><joint name="ball" type="ball"/><geom size=".01"/>
<site name="tool" pos=".1 0 0.03"/></body></body>
<body name="rocker" pos=".3 0 0"><joint name="rocker" axis="0 0 1"/><geom size=".01"/></body>
</worldbody><equality><connect body1="coupler" body2="rocker" anchor=".2 .1 0"/>{second}
</equality><actuator><motor joint="crank"/></actuator></mujoco>
"""


@pytest.fixture
def path(tmp_path):
    return tmp_path / "model.xml"


def closed(model, joint, value):
    data = mujoco.MjData(model)
    mujoco.mj_resetData(model, data)
    at = model.joint(joint).qposadr[0]
    free = [k for k in range(model.nv) if k != model.joint(joint).dofadr[0]]
    for step in np.linspace(0, value, 5):
        data.qpos[at] = model.qpos0[at] + step
        for _ in range(30):
            mujoco.mj_forward(model, data)
            rows = data.efc_type[: data.nefc] == mujoco.mjtConstraint.mjCNSTR_EQUALITY
            error = data.efc_pos[: data.nefc][rows]
            J = data.efc_J.reshape(-1, model.nv)[: data.nefc][rows]
            velocity = np.zeros(model.nv)
            velocity[free] = -np.linalg.lstsq(J[:, free], error, rcond=1e-9)[0]
            mujoco.mj_integratePos(model, data.qpos, velocity, 1)
    mujoco.mj_kinematics(model, data)
    assert np.abs(error).max() < 1e-12
    return data, float(data.qpos[at])


def joint_values(model, data):
    """Return MuJoCo's joint values, keyed by joint name.

    A ball joint gives three angles about the axes z, y and x.
    """
    found = {}
    for k in range(model.njnt):
        joint, body = model.joint(k), data.body(model.jnt_bodyid[k])
        if model.jnt_type[k] != mujoco.mjtJoint.mjJNT_BALL:
            found[joint.name] = data.qpos[joint.qposadr[0]]
            continue
        parent = data.body(model.body_parentid[model.jnt_bodyid[k]])
        R = parent.xmat.reshape(3, 3).T @ body.xmat.reshape(3, 3)
        found["ball_yaw"] = np.arctan2(R[1, 0], R[0, 0])
        found["ball_pitch"] = np.arctan2(-R[2, 0], np.hypot(R[0, 0], R[1, 0]))
        found["ball_roll"] = np.arctan2(R[2, 1], R[2, 2])
    return found


def compare(path, text, motor, tip):
    """Compare ``fk`` with MuJoCo near the reference configuration of a robot.

    If the loops are solved by iteration, check the loop residuals at MuJoCo's joint values instead.
    """
    robot = read_model(path, text, "world", tip)
    hybrid = solved_loops(loop_model(robot))
    function = (
        constraint_functions.constraint(hybrid)
        if hybrid.forward.open
        else tool_functions(hybrid, ["fk"])["fk"]
    )
    (kernel,) = lower([function], "r")
    model = mujoco.MjModel.from_xml_string(text)
    for value in (0.0, 0.06, -0.05):
        data, q = closed(model, motor, value)
        if hybrid.forward.open:
            at = joint_values(model, data)
            z = [at[variable.name] for variable in hybrid.variables]
            assert np.abs(np.array(kernel(z))).max() <= 1e-11
            continue
        T, site = np.array(kernel([q])).reshape(4, 4), data.site(tip)
        assert np.abs(T[:3, 3] - site.xpos).max() <= 1e-9
        assert np.abs(T[:3, :3].ravel() - site.xmat).max() <= 1e-9
    return robot, hybrid


GEAR = '<joint joint1="{a}" joint2="{b}" polycoef="{c} {r} 0 0 0"/>'


@pytest.mark.parametrize(
    ("bodies", "equalities", "motor", "tip", "couplings"),
    [
        ("", GEAR.format(a="right", b="left", c=0.1, r=-2), "left", "tool", ["right"]),
        ("", GEAR.format(a="coupler", b="link", c=0.2, r=1.5), "left", "tool", ["coupler"]),
        (
            SHAFT,
            GEAR.format(a="left", b="shaft", c=0, r=1)
            + GEAR.format(a="right", b="shaft", c=0, r=2),
            "left",
            "tool",
            ["right"],
        ),
        (
            SECOND,
            SECOND_PIN
            + GEAR.format(a="crank", b="right", c=0, r=-1)
            + '<joint joint1="link" polycoef=".02 0 0 0 0"/>',
            "left",
            "second",
            ["link", "crank"],
        ),
    ],
    ids=["cranks", "passive joints", "shaft outside", "gear train"],
)
def test_joint_equality_in_loops_matches_mujoco(path, bodies, equalities, motor, tip, couplings):
    text = FIVE_BAR.format(bodies=bodies, equalities=equalities, motor=motor)
    robot, hybrid = compare(path, text, motor, tip)
    assert [coupling.joint for coupling in robot.couplings] == couplings
    assert bool(hybrid.forward.open) == (couplings == ["coupler"])


@pytest.mark.parametrize(
    ("equalities", "words"),
    [
        (
            '<joint name="cam" joint1="right" joint2="left" polycoef="0 1 2 0 0"/>',
            "joint 'right' is coupled to 'left' by equality 'cam'; the position of a coupled joint "
            "must be linear",
        ),
        (
            GEAR.format(a="right", b="left", c=0.1, r=2)
            + GEAR.format(a="left", b="right", c=0, r=0.5)
            + '<joint joint1="link"/>',
            "no joint positions satisfy all equalities of left, right; correct or delete one",
        ),
    ],
    ids=["cam", "contradiction"],
)
def test_unsupported_joint_equality_is_refused_by_name(path, equalities, words):
    text = FIVE_BAR.format(bodies="", equalities=equalities, motor="left")
    assert words in wrong(path, text, tip="tool")


def test_order_of_joint_equalities_does_not_change_the_robot(path):
    # All MJCF joint equalities of the test hold at these joint positions. For the joint ``left``,
    # MuJoCo subtracts the ``ref`` of 0.2 from the position.
    values = {"left": 0.3, "right": 0.7, "link": -0.6, "coupler": 0.05}
    equalities = (
        GEAR.format(a="right", b="left", c=0.5, r=2),
        GEAR.format(a="link", b="right", c=0.1, r=-1),
        '<joint joint1="right" polycoef=".7 0 0 0 0"/>',
        GEAR.format(a="link", b="shaft", c=-0.9, r=3),
        GEAR.format(a="left", b="shaft", c=0, r=1),
    )
    found = set()
    # Try every fifth of the 120 possible orders of the equalities.
    for ordered in [*permutations(equalities)][::5]:
        text = FIVE_BAR.format(bodies=SHAFT, equalities="".join(ordered), motor="coupler")
        found.add(read_model(path, text, "world", "tool").couplings)
    (couplings,) = found
    # The five joint equalities are linear equations of rank four.
    assert [c.joint for c in couplings] == ["left", "right", "link"]
    for c in couplings:
        follows = sum(ratio * values[name] for name, ratio in c.ratios) + c.offset
        assert abs(follows - values[c.joint]) < 1e-12


def test_order_of_joint_equalities_does_not_change_a_chain(path):
    arm = """<mujoco model="arm"><compiler angle="radian"/><worldbody>{}</worldbody>
    <equality>{}</equality></mujoco>"""
    bodies = "".join(
        f'<body name="{name}" pos=".1 0 0"><joint name="{name}"/><geom size=".01"/>'
        for name in "abcd"
    )
    equalities = (
        GEAR.format(a="b", b="a", c=0, r=2),
        GEAR.format(a="b", b="c", c=0.1, r=1),
        GEAR.format(a="a", b="b", c=0, r=0.5),
    )
    model = mujoco.MjModel.from_xml_string(arm.format(bodies + 4 * "</body>", "".join(equalities)))
    data = mujoco.MjData(model)
    data.qpos[:] = 0.2, 0.4, 0.3, 0.7
    mujoco.mj_kinematics(model, data)
    robots = [
        read_model(path, arm.format(bodies + 4 * "</body>", "".join(ordered)), "world", "d")
        for ordered in permutations(equalities)
    ]
    assert {robot.couplings for robot in robots} == {robots[0].couplings}
    # The MJCF equalities determine all joint values except those of joints c and d.
    assert [c.name for c in robots[0].coordinates] == ["c", "d"]
    (fk,) = lower([derive(robots[0], functions=("fk",)).function("fk")], "r")
    T = np.array(fk([0.3, 0.7])).reshape(4, 4)
    assert np.abs(T[:3, 3] - data.body("d").xpos).max() < 1e-12


def test_ball_joint_in_the_tree_with_a_pin_matches_mujoco(path):
    second = '<connect body1="coupler" body2="rocker" anchor=".2 .1 .1"/>'
    text = BALL.format(second=second)
    robot, _ = compare(path, text, "crank", "tool")
    assert [closure.kind for closure in robot.closures] == ["pin"]
    fk = lower([derive(robot, functions=("fk", "actuators_all")).function("fk")], "r")[0]
    data, q = closed(mujoco.MjModel.from_xml_string(text), "crank", 0.07)
    T, site = np.array(fk([q])).reshape(4, 4), data.site("tool")
    assert np.abs(T[:3, 3] - site.xpos).max() <= 1e-9


def test_tip_on_a_rod_between_balls_is_refused_because_the_rod_spins(path):
    message = wrong(path, BALL.format(second=""), tip="tool")
    assert "a rod between two ball joints, which rotates freely about the line" in message
    hinges = '<joint name="a" axis="0 1 0"/><joint name="b" axis="0 0 1"/>'
    text = BALL.format(second="").replace('<joint name="ball" type="ball"/>', hinges)
    compare(path, text, "crank", "tool")
