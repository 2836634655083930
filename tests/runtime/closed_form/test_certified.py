"""For a calibrated arm, the C code certifies that all solutions of a pose are found."""

import ctypes
import subprocess

import numpy as np
import pytest

from tests.support.displaced_arm import near_wrist
from tests.support.oracles.pinocchio_fk import pinocchio_fk

CONFIGURATIONS, POSES = 5000, 150
REGULAR = 1e-4
"""The inverse kinematics function must find all configurations whose smallest singular value
(meter, radian) exceeds this value."""
TRUE = 1e-8
"""Maximum pose error (meter, or rotation matrix entry) of a correct solution."""
CERTIFIED = """
int is_certified(const double *T)
{
  chasles_general_six six;
  chasles_general_found found;
  chasles_general_set(&NAME_ik_tables, NULL, &six);
  return chasles_general_by_orders(&six, T, &found);
}
int count_verdicts(const double *T, const double *q, int count, int verdict)
{
  chasles_general_six six;
  chasles_general_system system;
  const chasles_general_arm *arm = &NAME_ik_tables;
  double root[16];
  int such = 0;
  chasles_general_set(arm, NULL, &six);
  for (int k = 0; k < arm->orders; k++) {
    const int joint = arm->order[k].joint[2];
    for (int i = 0; i < count; i++)
      root[i] = arm->order[k].sense * chasles_general_direction(&six, joint) * q[6 * i + joint];
    chasles_general_eliminate(&six, arm->order + k, T, &system);
    such += chasles_polish_are_all(&system, root, count) == (chasles_polish_verdict)verdict;
  }
  return such;
}
"""
COMPLETE, INCOMPLETE = 1, 2
"""Values of ``chasles_polish_verdict``."""


@pytest.fixture(scope="module")
def library(displaced_arm, tmp_path_factory):
    """Compile the C functions in ``CERTIFIED`` for the displaced arm."""
    folder, name = tmp_path_factory.mktemp("certified"), displaced_arm.name
    source, library = folder / "certified.c", folder / "certified.so"
    code = CERTIFIED.replace("NAME", name)
    source.write_text(f'#include "{displaced_arm.folder}/{name}.c"\n{code}')
    command = ["cc", "-std=gnu99", "-O0", "-w", "-fPIC", "-shared", source, "-o", library, "-lm"]
    subprocess.run(command, check=True)
    return ctypes.CDLL(str(library))


@pytest.fixture(scope="module")
def are_all(library):
    """Return a function that counts the elimination orders with a given certificate verdict.

    The C function `chasles_polish_are_all` returns the verdict for each elimination order.
    """
    function = library.count_verdicts

    def asked(T, q, verdict=COMPLETE):
        T, q = np.ascontiguousarray(T), np.ascontiguousarray(q)
        pointers = (values.ctypes.data_as(ctypes.c_void_p) for values in (T, q))
        return function(*pointers, len(q), verdict)

    return asked


def test_ik_recovers_regular_configurations(displaced_arm, displaced_robot):
    arm = displaced_arm
    q = np.random.default_rng(0).uniform(-np.pi, np.pi, (CONFIGURATIONS, 6))
    T, J = arm.fk_jacobian_mixed(q)
    found = arm.ik(T)
    held = (found.valid & (np.abs(found.distances_from(q)).max(-1) < 1e-5)).any(-1)
    regular = np.linalg.svd(J, compute_uv=False)[:, -1] > REGULAR
    assert regular.mean() > 0.99
    assert not (regular & ~held).any()
    fk = pinocchio_fk(displaced_robot)
    for k in np.flatnonzero(found.count > 8)[:20]:
        for row in found.q[k][found.valid[k]]:
            assert np.abs(fk(row) - T[k]).max() < TRUE


def test_general_solver_certifies_nearly_all_poses(displaced_arm, library):
    """The determinant of an arm with small errors is tiny, but accurate to ten digits."""
    poses = [np.ascontiguousarray(T) for T in displaced_arm.fk(near_wrist(300, 1))]
    certified = [library.is_certified(T.ctypes.data_as(ctypes.c_void_p)) for T in poses]
    assert np.mean(certified) > 0.98


def certifies_moved(are_all, pose, solutions):
    moved = solutions + 1e-3 * np.eye(len(solutions))[:, :, None]
    return any(are_all(pose, each) > 0 for each in moved)


def test_certificate_rejects_moved_solution_next_to_nearly_double_root(displaced_arm, are_all):
    arm, q = displaced_arm, np.random.default_rng(1).uniform(-np.pi, np.pi, (600, 6))
    for k in (59, 88, 220):
        T = arm.fk(q[k])
        solutions = arm.ik(T).distinct().valid_q()
        assert not certifies_moved(are_all, T, solutions)


def test_certificate_accepts_only_complete_solution_sets(displaced_arm, are_all):
    arm = displaced_arm
    q = np.random.default_rng(1).uniform(-np.pi, np.pi, (POSES, 6))
    T = arm.fk(q)
    # Near singularities, two solution slots may contain the same solution.
    found = arm.ik(T).distinct()
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
        assert not certifies_moved(are_all, pose, solutions)
        checked += 1
    assert checked > POSES / 2
    assert np.mean(whole) > 0.7
    assert np.mean(missed) > 0.7
