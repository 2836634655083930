"""The drawn assembly modes of a platform have the correct leg lengths."""

import numpy as np
import pytest

import chasles
from chasles.derive import read
from chasles.drawing import skeleton
from chasles.drawing.assembly import assembly_modes, others
from chasles.errors import InputValueError
from tests.support.compiling import compiled
from tests.support.derivations import description

TRUE = 1e-9
"""Tolerance of positions in meters and of direction vectors."""
ROD = """[[rods]]
name = "coupler_1"
length = "L"
a = { body = "crank_1", xyz = ["S_A", 0, 0] }
b = { body = "platform", xyz = ["r_p*cos(210)", "r_p*sin(210)", 0] }
swing = "psi_1"
"""
LINK = """[[joints]]
name = "psi_1"
parent = "crank_1"
link = "coupler_1"
xyz = ["S_A", 0, 0]
axis = [0, 0, 1]

[[closures]]
name = "pin_1"
kind = "pin"
a = { body = "coupler_1", xyz = ["L", 0, 0] }
b = { body = "platform", xyz = ["r_p*cos(210)", "r_p*sin(210)", 0] }
"""


def near_reference(robot, count):
    rng = np.random.default_rng(4)
    return np.array(robot.reference.q) + 0.05 * rng.normal(size=(count, robot.n))


def tools(robot, q):
    """Return the tool poses (k, 4, 4) in all modes."""
    if hasattr(robot, "fk_all"):
        found = robot.fk_all(q)
        return found.T[found.valid]
    x, valid = robot.fk_planar_all(q)
    T = np.tile(np.eye(4), (int(valid.sum()), 1, 1))
    c, s = np.cos(x[valid, 2]), np.sin(x[valid, 2])
    T[:, :2, :2] = np.array([[c, -s], [s, c]]).transpose(2, 0, 1)
    T[:, :2, 3] = x[valid, :2]
    return T


def ends_apart(body, poses):
    """Return the distances (k,) between the end points of a strut."""
    a, b = (
        poses[:, k, :3, :3] @ end + poses[:, k, :3, 3]
        for k, end in zip(body.span.bodies, body.span.ends, strict=True)
    )
    return np.linalg.norm(b - a, axis=-1)


@pytest.mark.parametrize("name", ["planar_3rrr", "delta", "stewart_gough"])
def test_assembly_mode_ghosts_match_platform_poses(name):
    robot = chasles.load(name)
    bodies, counted = skeleton(robot), 0
    variables = [variable.name for variable in robot.configuration_variables]
    for q in near_reference(robot, 4):
        z = robot.configuration(q)
        modes = assembly_modes(bodies, q, z)
        poses, own = (
            bodies.poses_from_configuration(modes.z),
            bodies.poses_from_configuration(z)[None],
        )
        expected = tools(robot, q)
        assert np.abs(bodies.tip_poses(poses) - expected).max() < TRUE
        for body in bodies.bodies:
            if body.span:
                length = ends_apart(body, own)
                assert np.abs(ends_apart(body, poses) - length).max() < TRUE, body.name
        rest = others(modes, z, bodies)
        assert len(rest.z) == len(expected) - 1
        counted += len(rest.z)
        actuated = [variables.index(coordinate.name) for coordinate in robot.coordinates]
        assert (modes.z[:, actuated] == modes.z[0, actuated]).all()
    assert counted >= 4


def test_link_legs_close_in_every_assembly_mode(tmp_path):
    text = description("planar_3rrr").read_text(encoding="utf-8")
    assert ROD in text
    file = tmp_path / "linked.toml"
    file.write_text(text.replace(ROD, LINK).replace("planar_3rrr", "linked"), encoding="utf-8")
    functions = ["fk", "configuration", "configuration_near", "constraint", "constraint_D_z"]
    functions += ["modes"]
    robot = compiled(read(file), tmp_path / "linked", functions, ["c"])
    rods = chasles.load("planar_3rrr")
    bodies, counted = skeleton(robot), 0
    names = [variable.name for variable in robot.configuration_variables]
    for q in near_reference(robot, 4):
        z = robot.configuration(q)
        modes = assembly_modes(bodies, q, z)
        assert len(modes.z) == rods.fk_planar_all(q).valid.sum()
        (pin,) = bodies.closures
        poses = bodies.poses_from_configuration(modes.z)
        tool_poses = [
            poses[:, k] @ np.vstack([frame, [0, 0, 0, 1]])
            for k, frame in zip(pin.bodies, pin.frames, strict=True)
        ]
        assert np.abs(tool_poses[0][:, :3, 3] - tool_poses[1][:, :3, 3]).max() < 1e-8
        assert np.ptp(modes.z[:, names.index("psi_1")]) > 0.1
        counted += len(modes.z)
    assert counted >= 8


def test_draw_shows_assembly_modes_as_ghosts(tmp_path):
    pytest.importorskip("matplotlib")
    robot = chasles.load("planar_3rrr")
    ax = chasles.draw(robot, views=("plane",)).axes[0]
    drawn = chasles.draw(robot, ghosts="modes", views=("plane",)).axes[0]
    assert len(drawn.lines) > len(ax.lines)
    with pytest.raises(InputValueError, match=r'expected "modes", got .mode'):
        chasles.draw(robot, ghosts="mode")
    with pytest.raises(InputValueError, match="a robot with an assembly mode function, got ur5e"):
        chasles.draw(chasles.load("ur5e"), ghosts="modes")
