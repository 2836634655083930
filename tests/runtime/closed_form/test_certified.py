"""An arm with errors of 5 mm: known solutions are certified as all, and few are not known."""

import ctypes
import subprocess

import numpy as np
import pytest

from chasles.derive import load
from tests.support.compiling import compiled
from tests.support.derivations import description
from tests.support.generators.geometric_errors import displaced
from tests.support.oracles.pinocchio_fk import pinocchio_fk

SIZE, SEED = 5.4e-3, 13
"""Errors (metre, radian) of the arm, and the seed of the errors."""
LOST = 1e-4
"""Share of random configurations that may be lost."""
CONFIGURATIONS, POSES = 30_000, 600
REGULAR = 1e-4
"""Least singular value (metre, radian) of a configuration that has to be found."""
TRUE = 1e-8
"""Error of a pose (metre, or entry of a rotation) above which a solution is wrong."""
ARE_ALL = """
int count_verdicts(const double *T, const double *q, int count, int verdict)
{
  chasles_general_six six;
  chasles_general_system system;
  const chasles_general_arm *arm = &NAME_ik_tables;
  double root[16];
  int such = 0;
  chasles_general_set(arm, NULL, &six);
  for (int k = 0; k < arm->splits; k++) {
    const int joint = arm->split[k].joint[2];
    for (int i = 0; i < count; i++)
      root[i] = arm->split[k].sense * chasles_general_direction(&six, joint) * q[6 * i + joint];
    chasles_general_eliminate(&six, arm->split + k, T, &system);
    such += chasles_polish_are_all(&system, root, count) == (chasles_polish_verdict)verdict;
  }
  return such;
}
"""
COMPLETE, INCOMPLETE = 1, 2
"""Values of ``chasles_polish_verdict``."""


@pytest.fixture(scope="module")
def robot():
    return displaced(load(description("tx2_60")), SIZE, SEED)


@pytest.fixture(scope="module")
def arm(robot, tmp_path_factory):
    folder = tmp_path_factory.mktemp("certified") / robot.name
    return compiled(robot, folder, ("fk", "fk_jacobian_mixed", "ik"))


@pytest.fixture(scope="module")
def are_all(arm, tmp_path_factory):
    """How many splits certify these solutions of a pose as all, or tell another verdict."""
    folder = tmp_path_factory.mktemp("are_all")
    source, library = folder / "are_all.c", folder / "are_all.so"
    source.write_text(f'#include "{arm.folder}/{arm.name}.c"\n{ARE_ALL.replace("NAME", arm.name)}')
    command = ["cc", "-std=gnu99", "-O1", "-w", "-fPIC", "-shared", source, "-o", library, "-lm"]
    subprocess.run(command, check=True)
    function = ctypes.CDLL(str(library)).count_verdicts

    def asked(T, q, verdict=COMPLETE):
        T, q = np.ascontiguousarray(T), np.ascontiguousarray(q)
        pointers = (values.ctypes.data_as(ctypes.c_void_p) for values in (T, q))
        return function(*pointers, len(q), verdict)

    return asked


def test_ik_recovers_regular_configurations(arm, robot):
    q = np.random.default_rng(0).uniform(-np.pi, np.pi, (CONFIGURATIONS, 6))
    T, J = arm.fk_jacobian_mixed(q)
    found = arm.ik(T)
    held = (found.valid & (np.abs(found.moves_from(q)).max(-1) < 1e-5)).any(-1)
    regular = np.linalg.svd(J, compute_uv=False)[:, -1] > REGULAR
    assert regular.mean() > 0.99
    assert (regular & ~held).sum() <= LOST * CONFIGURATIONS
    fk = pinocchio_fk(robot)
    for k in np.flatnonzero(found.count > 8)[:50]:
        for row in found.q[k][found.valid[k]]:
            assert np.abs(fk(row) - T[k]).max() < TRUE


def test_certificate_accepts_only_complete_solution_sets(arm, are_all):
    q = np.random.default_rng(1).uniform(-np.pi, np.pi, (POSES, 6))
    T = arm.fk(q)
    found = arm.ik(T)
    rng = np.random.default_rng(2)
    whole, missed = [], []
    checked = 0
    for pose, rows, valid in zip(T, found.q, found.valid, strict=True):
        solutions = rng.permutation(rows[valid])
        if len(solutions) < 6:
            continue
        whole.append(are_all(pose, solutions) > 0)
        assert not (whole[-1] and are_all(pose, solutions, INCOMPLETE))
        assert are_all(pose, solutions[:-2]) == 0
        missed.append(are_all(pose, solutions[:-2], INCOMPLETE) > 0)
        assert are_all(pose, solutions[:-1]) == 0
        moved = solutions.copy()
        moved[0] += 1e-3
        assert are_all(pose, moved) == 0
        checked += 1
    assert checked > POSES / 2
    assert np.mean(whole) > 0.7
    assert np.mean(missed) > 0.7
