"""Tests Newton's iteration along a path whose first step leaves the domain of the equations."""

import ctypes

import numpy as np
import pytest

from chasles.derive.emit.c.header import support
from tests.support.native import Source, compiled

SOURCE = """
#define CLOSURE_NAME(name) one_##name
#define CLOSURE_Q 1
#define CLOSURE_W 2
#define CLOSURE_U 1
#define CLOSURE_M 2
#define CLOSURE_SENSE 0.0
#define CLOSURE_DETERMINANT 1.0
#define CLOSURE_RESUMES 0
static const int one_actuated[] = {0}, one_unknown[] = {1}, one_of_z[] = {0, 1};
static const double one_ratio[] = {1.0}, one_size_u[] = {1.0}, one_size_c[] = {1.0, 1.0};
static const double one_start_q[] = {1.0}, one_start_w[] = {1.0, 1.0}, one_tangent[] = {2.0};
/* The equations sqrt(u) = q and u = q^2, with the derivatives with respect to q and u. */
#define CLOSURE_AT(s) equations((s)->w, (s)->c, (s)->D)
#include <math.h>
static void equations(const double w[2], double c[2], double D[4])
{
    const double root = sqrt(w[1]);
    c[0] = root - w[0];
    c[1] = w[1] - w[0] * w[0];
    D[0] = -1.0;
    D[1] = 0.5 / root;
    D[2] = -2.0 * w[0];
    D[3] = 1.0;
}
#define CLOSURE_BEND(w, wd, D) ((void)(w), (void)(wd), (void)(D))
#include "chasles_closure.h"
__attribute__((visibility("default"))) void configuration(double q, double w[2]);
void configuration(double q, double w[2])
{
    one_closed s;
    one_at(&s, &q, w);
}
"""
FILES = ("", "_newton", "_rates", "_tolerances")


@pytest.fixture(scope="module")
def configuration():
    headers = [f"chasles_closure{part}.h" for part in FILES]
    files = {"path.c": SOURCE, **{name: support(name) for name in headers}}
    function = ctypes.CDLL(str(compiled(Source("closure-path", files)))).configuration
    function.argtypes = [ctypes.c_double, np.ctypeslib.ndpointer(np.float64)]

    def call(q):
        w = np.empty(2)
        function(q, w)
        return w

    return call


@pytest.mark.parametrize("q", [0.9, 0.3, 0.1])
def test_stride_is_halved_where_the_equations_have_no_value(configuration, q):
    np.testing.assert_allclose(configuration(q), [q, q * q], rtol=0, atol=1e-12)


def test_configuration_without_solution_is_nan(configuration):
    assert np.isnan(configuration(-0.5)).all()
