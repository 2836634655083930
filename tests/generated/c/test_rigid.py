"""The C function that projects a matrix to the nearest pose agrees with a polar decomposition."""

import ctypes
import subprocess
import sysconfig

import numpy as np
import pytest

from chasles.derive.emit.c.header import support
from chasles.derive.emit.c.language import RIGID

SAME_POSE = 1e-14
"""Tolerance of the entries of a projected pose, compared with the oracle."""
SOURCE = f"""#include "{RIGID}"
int project(const double *T, double tolerance, double *rigid);
int project(const double *T, double tolerance, double *rigid)
{{
    return chasles_project(T, tolerance, rigid);
}}
"""
DOUBLES = np.ctypeslib.ndpointer(np.float64, flags="C")


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rigid")
    (folder / RIGID).write_text(support(RIGID))
    (folder / "project.c").write_text(SOURCE)
    compiler = sysconfig.get_config_var("CC").split()[0]
    flags = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Wconversion", "-Werror", "-shared", "-fPIC"]
    subprocess.run(
        [compiler, *flags, "project.c", "-o", "project.so", "-lm"], cwd=folder, check=True
    )
    function = ctypes.CDLL(str(folder / "project.so")).project
    function.argtypes = [DOUBLES, ctypes.c_double, DOUBLES]
    return function


def rotations(count, rng):
    Q, R = np.linalg.qr(rng.normal(size=(count, 3, 3)))
    Q *= np.sign(np.einsum("kii->ki", R))[:, None, :]
    Q[np.linalg.det(Q) < 0, :, 0] *= -1
    return Q


def polar(R):
    square, V = np.linalg.eigh(R.T @ R)
    return R @ (V / np.sqrt(square)) @ V.T


def test_projection_accepts_only_nearly_rigid_matrices(project):
    rng = np.random.default_rng(0)
    accepted = refused = 0
    for R, size in zip(rotations(600, rng), 10 ** rng.uniform(-16, -0.8, 600), strict=True):
        T = np.eye(4)
        T[:3, :3] = R + rng.uniform(-size, size, (3, 3))
        T[:3, 3] = rng.normal(size=3)
        off = np.linalg.norm(T[:3, :3].T @ T[:3, :3] - np.eye(3)) / 8**0.5
        for tolerance in (1e-5, 0.1):
            if abs(off / tolerance - 1) < SAME_POSE / tolerance:
                continue
            rigid = np.full((4, 4), 7.0)
            near = project(T, tolerance, rigid)
            assert near == (off <= tolerance)
            accepted, refused = accepted + near, refused + 1 - near
            if not near:
                assert (rigid == 7).all()
                continue
            assert np.abs(rigid[:3, :3] - polar(T[:3, :3])).max() < SAME_POSE
            np.testing.assert_array_equal(rigid[:3, 3], T[:3, 3])
            np.testing.assert_array_equal(rigid[3], [0, 0, 0, 1])
            assert project(T, tolerance, T)
            np.testing.assert_array_equal(T, rigid)
    assert accepted > 600
    assert refused > 100


def test_projection_rejects_non_rigid_and_non_finite_matrices(project):
    rng = np.random.default_rng(1)
    rigid = np.zeros((4, 4))
    for R in rotations(50, rng):
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = R, rng.normal(size=3)
        assert project(T, 1e-5, rigid)
        for bad in (T.T, T * 1000, T @ np.diag([1, 1, -1, 1]), T @ np.diag([2, 2, 2, 1])):
            assert not project(np.ascontiguousarray(bad), 0.1, rigid)
        for index in np.ndindex(4, 4):
            for value in (np.nan, np.inf):
                lost = T.copy()
                lost[index] = value
                assert not project(lost, 0.1, rigid)
