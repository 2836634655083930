"""Mechanisms of millimeter and 100 meter size behave like mechanisms of decimeter size.

The tests scale all lengths of a robot. Scaling must not change computed angles, and must multiply
computed lengths by the same factor.
"""

import re
from pathlib import Path

import numpy as np
import pytest

import chasles
import chasles.derive
from tests.support.compiling import compiled

ROBOTS = Path(chasles.derive.__file__).parent / "robots"
FACTORS = {"planar_3rrr": 256.0, "stewart_gough": 1 / 256}
"""Length factors are powers of two, so that scaled lengths have no rounding errors."""
LENGTHS = {
    "planar_3rrr": re.compile(r"(?<=value = )[\d.]+"),
    "stewart_gough": re.compile(r"(?<=value = )[\d.]+|(?<=leg_\d = )\d+|(?<=\nz = )\d+|160"),
}
FUNCTIONS = (
    *("fk", "fk_jacobian_mixed", "hessian_mixed", "margin", "fk_near", "modes"),
    *("configuration", "configuration_near", "closure", "constraint"),
    *("chain", "chain_fk", "chain_jacobian_mixed", "chain_all"),
    *("actuators", "actuators_D_chain", "actuator_margin", "actuators_all"),
    *("assembly_polynomial", "assembly_position", "assembly_mirror"),
)
"""Names of the compared functions. A robot may have only some of these functions."""
CONFIGURATIONS = 20
SAME = 1e-12
"""Tolerance for angles in radians, and for lengths relative to the robot size."""


def written(name, factor, folder):
    """Return a shipped robot after multiplying all lengths in its file by ``factor``."""
    text = (ROBOTS / f"{name}.toml").read_text()
    file = folder / f"{name}.toml"
    file.write_text(LENGTHS[name].sub(lambda found: f"{float(found[0]) * factor:.12f}", text))
    wanted = [function for function in FUNCTIONS if function in chasles.load(name).functions]
    return compiled(chasles.derive.read(file), folder / name, wanted, ["c"])


@pytest.fixture(scope="module", params=FACTORS.items(), ids=str)
def pair(request, tmp_path_factory):
    """Return a shipped robot, a scaled copy, and the scale factor."""
    name, factor = request.param
    return chasles.load(name), written(name, factor, tmp_path_factory.mktemp("sizes")), factor


def configurations(robot):
    lower = np.where(np.isfinite(robot.lower), robot.lower, np.array(robot.reference.q) - 0.5)
    upper = np.where(np.isfinite(robot.upper), robot.upper, np.array(robot.reference.q) + 0.5)
    return np.random.default_rng(4).uniform(lower, upper, (CONFIGURATIONS, robot.n))


def test_loop_kinematics_are_scale_invariant(pair):
    robot, other, factor = pair
    q = configurations(robot)
    by = np.array([factor if c.unit == "m" else 1.0 for c in robot.coordinates])
    T, resized = robot.fk(q), other.fk(q * by)
    np.testing.assert_array_equal(robot.loops_close(q), other.loops_close(q * by))
    closed = np.isfinite(T).all((-2, -1))
    assert closed.mean() > 0.5
    T[:, :3, 3] *= factor
    np.testing.assert_allclose(resized[..., :3], T[..., :3], atol=SAME)
    np.testing.assert_allclose(resized[:, :3, 3], T[:, :3, 3], atol=SAME * factor)
    found = other.ik_numeric(T[closed])
    assert found.valid.all()
    assert found.residual.max() <= 1e-9 * other.unit_length


def test_assembly_modes_are_scale_invariant(pair):
    robot, other, factor = pair
    q = configurations(robot)
    if not hasattr(robot, "fk_planar_all"):
        return
    modes, resized = robot.fk_planar_all(q), other.fk_planar_all(q)
    np.testing.assert_array_equal(modes.valid, resized.valid)
    assert modes.valid.any()
    at = np.array([factor, factor, 1.0])
    np.testing.assert_allclose(resized.x / at, modes.x, atol=1e-10)


def test_actuators_valid_is_scale_invariant(pair):
    robot, other, factor = pair
    if not hasattr(robot, "chain_closes"):
        return
    theta = robot.chain(configurations(robot))
    theta = theta[np.isfinite(theta).all(-1)]
    by = np.array([factor if c.unit == "m" else 1.0 for c in robot.chain_joints])
    shifted = theta + 1e-3 * np.eye(theta.shape[1])[0]
    for chain in (theta, shifted):
        held = other.chain_closes(chain * by)
        np.testing.assert_array_equal(held, robot.chain_closes(chain))
