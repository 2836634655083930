"""Loops of MJCF models agree with MuJoCo: linkages, spatial loops and delta robots."""

import random

import numpy as np
import pytest

from chasles.derive import derive
from chasles.derive.latex import fragments
from chasles.derive.loops.closing.loop_model import loop_model
from chasles.derive.loops.functions import constraint_functions
from chasles.derive.terms.casadi_graph import lower
from tests.support.compiling import compiled
from tests.support.mjcf_models import (
    mujoco,
    poses_of,
    random_delta,
    random_linkage,
    random_spatial_loop,
    read_model,
    rod_pair_delta,
    wrong,
)

POSES, LOOPS = 1, (0, 1)
LINKAGES = (5, 0, 1, 4)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "model.xml"


def test_linkage_in_any_plane_writes_latex_rates(path):
    """The LaTeX article of a four-bar linkage in a tilted plane contains the joint rates."""
    robot = read_model(path, random_linkage(random.Random(3)), "world", "tool")
    assert "rates.tex" in fragments(derive(robot, functions=["fk"]))


def satisfied(model, crank):
    """Solve MuJoCo's equality constraints by Newton's method.

    Returns MuJoCo's data at the solution, or None if the loops do not close.
    """
    data = mujoco.MjData(model)
    at = model.joint("crank").qposadr[0]
    free = [k for k in range(model.nq) if k != at]
    for step in np.linspace(0, crank, 5):
        data.qpos[at] = step
        for _ in range(30):
            mujoco.mj_forward(model, data)
            rows = data.efc_type[: data.nefc] == mujoco.mjtConstraint.mjCNSTR_EQUALITY
            error = data.efc_pos[: data.nefc][rows]
            J = data.efc_J.reshape(-1, model.nv)[: data.nefc][rows]
            data.qpos[free] -= np.linalg.lstsq(J[:, free], error, rcond=1e-9)[0]
    mujoco.mj_kinematics(model, data)
    return data if np.abs(error).max() < 1e-12 else None


def at_solutions(path, text, tip, cranks):
    """Return a robot, its functions, MuJoCo's model, and joint values at which all loops close."""
    robot = read_model(path, text, "world", tip)
    if tip == "tool":
        made = derive(robot, functions=("fk", "constraint")).functions
    else:
        # Random loops may have more degrees of freedom than motors.
        made = (constraint_functions.constraint(loop_model(robot)),)
    kernels = lower(made, "r")
    functions = dict(zip((f.name for f in made), kernels, strict=True))
    model = mujoco.MjModel.from_xml_string(
        text.replace("<compiler", '<option jacobian="dense"/><compiler')
    )
    order = [joint.name for joint in robot.joints if joint.kind != "fixed"]
    solutions = []
    for data in (satisfied(model, crank) for crank in cranks):
        if data is None:
            break
        solutions.append({name: data.qpos[model.joint(name).qposadr[0]] for name in order})
    return robot, functions, model, solutions


def compare_linkage(path, seed):
    dice = random.Random(seed)
    text = random_linkage(dice)
    cranks = [0.0, *(dice.uniform(-0.2, 0.2) for _ in range(POSES))]
    robot, functions, model, found = at_solutions(path, text, "tool", cranks)
    for crank, z in zip(cranks, found, strict=True):
        residual = np.array(functions["constraint"](list(z.values())))
        assert np.abs(residual).max() <= 1e-11, seed
        tool = np.array(functions["fk"]([crank])).reshape(4, 4)
        assert np.abs(tool - poses_of(model, z)["tool"]).max() <= 1e-9, seed
    return robot.closures[0].kind


@pytest.mark.parametrize("leads", [True, False])
def test_joint_outside_the_loop_drives_the_crank_like_in_mujoco(path, leads):
    pair, ratio = (
        ('joint1="inner" joint2="crank"', 2) if leads else ('joint1="crank" joint2="inner"', 0.5)
    )
    text = (
        random_linkage(random.Random(5))
        .replace('<joint name="crank"/>', '<joint name="inner"/>')
        .replace("<worldbody>", '<worldbody><body><joint name="crank"/><geom size=".01"/></body>')
        .replace("</equality>", f'<joint {pair} polycoef="0 {ratio} 0 0 0"/></equality>')
    )
    robot = read_model(path, text, "world", "tool")
    assert robot.actuated == ("crank",)
    (fk,) = lower(derive(robot, functions=("fk",)).functions, "r")
    model = mujoco.MjModel.from_xml_string(
        text.replace("<compiler", '<option jacobian="dense"/><compiler')
    )
    for crank in (0.0, 0.07, -0.06):
        site = satisfied(model, crank).site("tool")
        tool = np.array(fk([crank])).reshape(4, 4)
        assert np.abs(tool[:3, 3] - site.xpos).max() <= 1e-9
        assert np.abs(tool[:3, :3].ravel() - site.xmat).max() <= 1e-9


def test_motor_of_the_loop_may_also_move_a_joint_elsewhere(path):
    text = (
        random_linkage(random.Random(5))
        .replace("<worldbody>", '<worldbody><body><joint name="aside"/><geom size=".01"/></body>')
        .replace("</equality>", '<joint joint1="crank" joint2="aside"/></equality>')
    )
    robot = read_model(path, text, "world", "tool")
    assert (robot.actuated, robot.drives) == (("crank",), ())


def compare_loop(path, seed):
    dice = random.Random(seed)
    text = random_spatial_loop(dice)
    robot, functions, _, found = at_solutions(path, text, "b1", [0.0, 0.02, -0.03])
    for z in found:
        values = np.array(list(z.values()))
        assert np.abs(np.array(functions["constraint"](values))).max() <= 1e-11, seed
        shifted = values + 1e-3 * np.array([dice.choice((-1, 1)) for _ in values])
        assert np.abs(np.array(functions["constraint"](shifted))).max() > 1e-6, seed
    return robot.closures[0].kind, len(found)


def test_spatial_loop_residuals_vanish_at_mujoco_solutions(path):
    kinds, counts = zip(*(compare_loop(path, seed) for seed in LOOPS), strict=True)
    assert set(kinds) == {"ball", "weld"}
    assert sum(counts) > 2 * len(LOOPS)


def test_linkage_residuals_and_poses_match_mujoco(path):
    kinds = {compare_linkage(path, seed) for seed in LINKAGES}
    assert kinds == {"ball", "pin", "weld"}


def compare_delta(path, seed):
    dice = random.Random(seed)
    text = random_delta(dice)
    robot = read_model(path, text, "world", "tool")
    assert [strut.ends for strut in robot.struts] == ["ball"] * 3
    (fk,) = lower(derive(robot, functions=("fk",)).functions, "r")
    for _ in range(POSES):
        q = [dice.uniform(-0.3, 0.3) for _ in range(3)]
        tool = np.array(fk(q)).reshape(4, 4)[:3, 3]
        assert np.abs(tool - delta_at(text, q).site("tool").xpos).max() <= 1e-9, seed


def delta_at(text, q):
    """Return MuJoCo's data of a delta robot at the motor values q (3,)."""
    model = mujoco.MjModel.from_xml_string(
        text.replace("<compiler", '<option jacobian="dense"/><compiler')
    )
    data = mujoco.MjData(model)
    rows = [model.joint(f"motor{k}").qposadr[0] for k in range(3)]
    moving = [model.joint(f"motor{k}").dofadr[0] for k in range(3)]
    free = [k for k in range(model.nv) if k not in moving]
    for part in (0.5, 1.0):
        data.qpos[rows] = part * np.array(q)
        for _ in range(30):
            mujoco.mj_forward(model, data)
            kinds = data.efc_type[: data.nefc] == mujoco.mjtConstraint.mjCNSTR_EQUALITY
            error = data.efc_pos[: data.nefc][kinds]
            J = data.efc_J.reshape(-1, model.nv)[: data.nefc][kinds]
            step = np.zeros(model.nv)
            step[free] = -np.linalg.lstsq(J[:, free], error, rcond=1e-9)[0]
            mujoco.mj_integratePos(model, data.qpos, step, 1.0)
    assert np.abs(error).max() < 1e-12
    mujoco.mj_kinematics(model, data)
    return data


def test_delta_platform_pose_matches_mujoco(path):
    compare_delta(path, 0)


def test_three_connects_between_two_bodies_are_rejected(path):
    linkage = random_linkage(random.Random(0))
    closure = linkage[linkage.index("<equality>") : linkage.index("</equality>")]
    frames = [f'body1="rocker" body2="coupler" anchor="0 0 {k / 10}"' for k in range(3)]
    three = "<equality>" + "".join(f"<connect {frame}/>" for frame in frames)
    assert "3 connect equalities join" in wrong(path, linkage.replace(closure, three), tip="tool")


def test_ball_joint_of_rod_with_extra_connect_becomes_three_joints(path):
    """A body with a ball joint and two `connect` constraints is not read as a rod."""
    text = random_delta(random.Random(0)).replace(
        "</equality>", '<connect body1="rod0" body2="arm1" anchor="0 0 0"/></equality>'
    )
    robot = read_model(path, text, tip="tool")
    assert {"ball0_yaw", "ball0_pitch", "ball0_roll"} <= {joint.name for joint in robot.joints}
    assert [strut.name for strut in robot.struts] == ["link1", "link2"]


@pytest.mark.parametrize("is_free", [True, False])
def test_delta_with_ball_joints_in_its_tree_agrees_with_mujoco(tmp_path, is_free):
    path, text, dice = tmp_path / "model.xml", rod_pair_delta(is_free=is_free), random.Random(0)
    robot = read_model(path, text, tip="platform")
    assert [strut.ends for strut in robot.struts] == ["ball"] * 6
    loaded = compiled(robot, tmp_path / "delta", ("fk", "ik"), ["c"])
    for _ in range(5):
        q = [dice.uniform(-0.4, 0.4) for _ in range(3)]
        platform, T = delta_at(text, q).body("platform"), loaded.fk(q)
        assert np.abs(T[:3, 3] - platform.xpos).max() <= 1e-9
        assert np.abs(T[:3, :3].ravel() - platform.xmat).max() <= 1e-9
        found = loaded.ik(T)
        assert np.abs(found.q[found.valid] - q).max(-1).min() <= 1e-9
