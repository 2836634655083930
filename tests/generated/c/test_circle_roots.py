"""All real roots of trigonometric polynomials are found, also roots that nearly coincide."""

import ctypes
import subprocess
import sysconfig

import numpy as np
import pytest

from chasles.derive.emit.c.header import support
from chasles.derive.emit.c.written import CIRCLE

DEGREE, SAMPLES, MAX_ROOTS, TRIALS = 8, 64, 32, 50
NOISE = 4e-15
"""Error of the polynomial coefficients, relative to the largest coefficient."""
SAME, IN_CLUSTER = 1e-6, 1e-3
"""Maximum errors (radian) of a simple root (`SAME`) and of a root in a cluster (`IN_CLUSTER`)."""
SOURCE = f"""#include "{CIRCLE[0]}"
int roots(const double *a, const double *b, double noise, double *angles);
int roots(const double *a, const double *b, double noise, double *angles)
{{
    chasles_circle_series series;
    chasles_circle_roots found;
    memcpy(series.a, a, sizeof series.a);
    memcpy(series.b, b, sizeof series.b);
    series.most = 1.0;
    series.noise = noise;
    chasles_circle_real(NULL, NULL, &series, &found);
    memcpy(angles, found.angle, sizeof found.angle);
    return found.count;
}}
"""
DOUBLES = np.ctypeslib.ndpointer(np.float64, flags="C")


@pytest.fixture(scope="module")
def solve(tmp_path_factory):
    """Return a function that builds a trigonometric polynomial from roots and finds its real roots.

    The arguments of the returned function are the real roots and one root of each complex pair.
    """
    folder = tmp_path_factory.mktemp("roots")
    for name in CIRCLE:
        (folder / name).write_text(support(name))
    (folder / "roots.c").write_text(SOURCE)
    compiler = sysconfig.get_config_var("CC").split()[0]
    flags = ["-std=gnu99", "-O1", "-shared", "-fPIC"]
    subprocess.run([compiler, *flags, "roots.c", "-o", "roots.so", "-lm"], cwd=folder, check=True)
    function = ctypes.CDLL(str(folder / "roots.so")).roots
    function.argtypes = [DOUBLES, DOUBLES, ctypes.c_double, DOUBLES]

    def solved(real, pairs):
        x = 2 * np.pi * np.arange(SAMPLES) / SAMPLES
        values = np.prod(np.sin((x[:, None] - real) / 2), axis=1)
        values *= np.prod(np.cosh(pairs.imag) - np.cos(x[:, None] - pairs.real), axis=1)
        c = np.fft.rfft(values)[: DEGREE + 1] / SAMPLES
        a, b = np.r_[c[0].real, 2 * c[1:].real], np.r_[0.0, -2 * c[1:].imag]
        most, angles = max(np.abs(a).max(), np.abs(b).max()), np.empty(MAX_ROOTS)
        count = function(a / most, b / most, NOISE, angles)
        return angles[:count]

    return solved


def distances(roots, found):
    """Return the distance (radian) from each root to the nearest found root."""
    return np.abs(np.angle(np.exp(1j * (roots[:, None] - found)))).min(1)


def test_roots_after_a_cluster_of_three_roots_are_found(solve):
    rng = np.random.default_rng(0)
    for start in rng.uniform(0.2, 3.0, TRIALS):
        cluster = start + np.array([0.0, 1.2e-4, 3.0e-4])
        simple = np.array([start + 0.014, 4.0, 4.08])
        # A simple root and two complex roots lie near the three clustered roots, so the polynomial
        # is small near the cluster.
        found = solve(np.r_[cluster, simple], np.array([start + 0.25j]))
        assert distances(simple, found).max() < SAME
        assert distances(cluster[:1], found).max() < IN_CLUSTER
