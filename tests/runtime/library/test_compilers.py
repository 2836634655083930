"""The small compiler tcc compiles the code of every shipped robot.

tcc supports neither SIMD vectors nor intrinsics.
"""

import numpy as np
import pytest

import chasles
from chasles.derive import read, write
from chasles.derive.build import ROBOTS
from tests.support.tools import path_of

N = 16
SAME = 1e-12
"""Tolerance of forward kinematics, relative to the largest entry. Results differ slightly, because
each compiler fuses and reorders operations differently."""
SAME_SOLUTION = 1e-7
"""Tolerance of inverse solutions [rad or m], which amplify rounding errors near double roots."""

SOLUTIONS_OF_GEN3 = 456
"""Number of solutions that gcc-compiled code finds for 64 poses of the Kinova Gen3, with and
without vector code."""


def configurations(robot, rng, n=N):
    center = np.array(robot.reference.q) if robot.reference else np.zeros(robot.n)
    lower, upper = np.maximum(robot.lower, center - 1), np.minimum(robot.upper, center + 1)
    return center + 0.5 * (rng.uniform(lower, upper, (n, robot.n)) - center)


def inverse(robot, q):
    """Return the solutions of `ik` at the poses of q, with the redundancy parameters of q."""
    role = robot.manifest.with_role("inverse", "pose").role
    fixed = {robot.coordinates[k].name: q[:, k] for k in role.fixed}
    if any(item.name == "swivel" for item in robot.redundancy):
        fixed = {"swivel": robot.swivel(q)}
    return robot.ik(robot.fk(q), **({"fixed": fixed} if fixed else {}))


@pytest.mark.parametrize("name", chasles.robots())
def test_tcc_compiles_every_robot(name, tmp_path, monkeypatch):
    path_of("tcc")
    expected = chasles.load(name)
    monkeypatch.setenv("CC", "tcc")
    monkeypatch.setenv("CHASLES_CACHE", str(tmp_path))
    robot = chasles.load(name)
    assert len(list(tmp_path.glob("*.so"))) == 1
    q = configurations(robot, np.random.default_rng(5))
    T, wanted = robot.fk(q), expected.fk(q)
    assert np.isfinite(T).any()
    np.testing.assert_allclose(T, wanted, rtol=0, atol=SAME * np.nanmax(np.abs(wanted)))
    if robot.manifest.with_role("inverse", "pose"):
        found, solutions = inverse(robot, q), inverse(expected, q)
        np.testing.assert_array_equal(found.valid, solutions.valid)
        np.testing.assert_allclose(
            found.q[found.valid], solutions.q[found.valid], rtol=0, atol=SAME_SOLUTION
        )


def test_tcc_compiles_the_general_solver_of_refined_inverses(tmp_path, monkeypatch):
    path_of("tcc")
    monkeypatch.setenv("CC", "tcc")
    monkeypatch.setenv("CHASLES_CACHE", str(tmp_path / "cache"))
    folder = tmp_path / "gen3"
    functions = ["fk", "fk_jacobian_mixed", "ik"]
    write(read(ROBOTS / "shelf" / "gen3.toml"), folder, functions=functions, languages=["c"])
    robot = chasles.load(folder)
    found = inverse(robot, configurations(robot, np.random.default_rng(5), 64))
    # Without the general solver, refinement from the nominal arm loses solutions.
    assert found.valid.sum() == SOLUTIONS_OF_GEN3
