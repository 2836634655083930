"""For robots whose loops are solved by iteration, `ik` refines solutions of the nominal robot."""

from dataclasses import replace

import numpy as np

from chasles.derive import read, read_text
from tests.support.compiling import compiled
from tests.support.derivations import ROBOTS
from tests.support.generators.as_built import single_errors
from tests.support.loops.closures import Model

POSES = 60
NAMES = ("fk", "fk_jacobian_mixed", "configuration", "margin", "ik")


ARM = """
name = "rod_driven"
convention = "urdf"
actuated = ["shoulder", "motor", "wrist"]
tool = {{ body = "hand", xyz = [0.3, 0, 0] }}
[[joints]]
name = "shoulder"
link = "upper"
axis = [0, 0, 1]
[[joints]]
name = "elbow"
link = "fore"
xyz = [1, 0, 0]
axis = [0, 0, 1]
[[joints]]
name = "wrist"
link = "hand"
xyz = [0.8, 0, 0]
axis = [0, 0, 1]
[[joints]]
name = "motor"
parent = "upper"
link = "horn"
xyz = {motor}
rpy = {tilt}
axis = [0, 0, 1]
[[joints]]
name = "fork"
parent = "fore"
link = "cross"
xyz = {fork}
axis = [0, 0, 1]
[[joints]]
name = "pivot"
parent = "cross"
link = "rod"
xyz = [{off}, 0, 0]
axis = [0, 1, 0]
[[closures]]
name = "ball"
kind = "ball"
a = {{ body = "horn", xyz = [{horn}, 0, 0] }}
b = {{ body = "rod", xyz = [{length}, 0, 0] }}
[reference]
shoulder = 0.3
elbow = {elbow}
wrist = {wrist}
motor = 0
fork = {swing}
pivot = {rise}
"""
"""Robot file of a planar arm whose elbow is driven by a crank through a rod. The rod has a ball
joint and a universal joint."""


def drawn_arm(seed, off, wrist):
    """Return a random arm whose universal joint axes are ``off`` meters apart."""
    rng = np.random.default_rng(seed)
    motor, tilt = np.add(rng.uniform(-0.2, 0.2, 3), (0.3, 0, 0.1)), rng.uniform(-0.6, 0.6, 3)
    fork, elbow, horn = (
        np.add(rng.uniform(-0.1, 0.1, 3), (0.2, 0.2, 0)),
        rng.uniform(0.6, 1.2),
        0.25,
    )
    turned = np.eye(3)
    for k, angle in enumerate(tilt):
        i, j = (k + 1) % 3, (k + 2) % 3
        about = np.eye(3)
        about[[i, i, j, j], [i, j, i, j]] = (
            np.cos(angle),
            -np.sin(angle),
            np.sin(angle),
            np.cos(angle),
        )
        turned = about @ turned
    c, s = np.cos(elbow), np.sin(elbow)
    fore = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    rod = motor + horn * turned[:, 0] - (1, 0, 0) - fore @ fork
    x, y, z = fore.T @ rod
    values = {
        "motor": [f"{v:.6f}" for v in motor],
        "tilt": [f"{v:.6f}" for v in tilt],
        "fork": [f"{v:.6f}" for v in fork],
    }
    numbers = {
        "off": off,
        "wrist": wrist,
        "horn": horn,
        "length": np.linalg.norm([x, y, z]),
        "elbow": elbow,
        "swing": np.arctan2(y, x),
        "rise": -np.arctan2(z, np.hypot(x, y)),
    }
    lists = {name: f"[{', '.join(of)}]" for name, of in values.items()}
    return read_text(ARM.format(**lists, **{name: f"{v:.6f}" for name, v in numbers.items()}))


def judged(robot, mechanism, reach):
    """Assert that ``ik`` recovers random configurations, and that all its solutions are correct."""
    q = robot.reference.q + reach * np.random.default_rng(0).uniform(-1, 1, (POSES, robot.n))
    q = q[robot.loops_close(q)]
    assert len(q) > POSES / 2
    model = Model(mechanism)
    z = robot.configuration(q)
    assert model.gap(z).max() < 1e-12
    T = robot.fk(q)
    found = robot.ik(T)
    apart = np.abs(np.remainder(found.q - q[:, None] + np.pi, 2 * np.pi) - np.pi).max(-1)
    assert np.where(found.valid, apart, np.inf).min(-1).max() < 1e-8
    again = robot.fk(found.q[found.valid])
    np.testing.assert_allclose(again, np.repeat(T, found.valid.sum(-1), 0), atol=1e-10)


def test_ik_recovers_configuration_with_offset_universal_joints(tmp_path):
    seed, wrist = 9, 3.1
    built = replace(drawn_arm(seed, 5e-4, wrist), nominal=drawn_arm(seed, 0, wrist))
    robot = compiled(built, tmp_path, NAMES, ["c"])
    assert robot.loop_solution == "newton"
    judged(robot, built, 0.3)


def test_ik_recovers_configuration_out_of_nominal_plane(tmp_path):
    """The nominal design cannot reach the poses of the as-built four-bar with a tilted crank."""
    design = read(ROBOTS / "four_bar.toml")
    built = replace(dict(single_errors(design))["axis of crank"], closure="least squares")
    robot = compiled(replace(built, nominal=design), tmp_path, NAMES, ["c"])
    q = robot.reference.q + np.linspace(-0.3, 0.3, 21)[:, None]
    found = robot.ik(robot.fk(q))
    assert found.valid.any(-1).all()
    assert np.nanmin(np.abs(found.q - q[:, None]), (1, 2)).max() < 1e-9
