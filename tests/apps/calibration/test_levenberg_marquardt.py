"""The Levenberg-Marquardt iteration agrees with SciPy on random problems."""

import numpy as np
import pytest
import scipy.optimize
from numpy.testing import assert_allclose

from chasles.calibration.fitting.levenberg_marquardt import Errors, least_squares

SCALE = 1e-3


class Drawn:
    """Residuals A x + sin(B x) - y with outliers in y."""

    def __init__(self, seed, weakest):
        random = np.random.default_rng(seed)
        rows, count = int(random.integers(40, 120)), int(random.integers(3, 20))
        size = np.geomspace(1, weakest, count)
        self.A = random.normal(size=(rows, count)) * size / SCALE
        self.B = random.normal(size=(rows, count)) * size / SCALE / 30
        self.true = SCALE * random.normal(size=count)
        self.y = self(self.true) + 1e-2 * random.normal(size=rows)
        self.off = random.random(rows) < 0.1
        self.gross = np.where(self.off, random.normal(size=rows) * 50, 0)

    y = gross = 0.0

    def __call__(self, x):
        return self.A @ x + np.sin(self.B @ x) - self.y - self.gross

    def derivative(self, x):
        return self.A + np.cos(self.B @ x)[:, None] * self.B

    def found(self, loss_from, start, evaluations=100):
        return least_squares(
            lambda x: Errors(self(x), lambda: self.derivative(x)),
            start,
            SCALE,
            loss_from=loss_from,
            step=1e-12,
            evaluations=evaluations,
        )


@pytest.mark.parametrize("weakest", [1.0, 1e-4])
@pytest.mark.parametrize("loss_from", [0.0, 0.02])
def test_minimum_matches_scipy_least_squares(loss_from, weakest):
    for seed in range(20):
        drawn = Drawn(seed, weakest)
        if not loss_from:
            drawn.gross = 0.0
        start = drawn.true + (1e-2 if loss_from else 1.0) * SCALE * np.ones(len(drawn.true))
        of_scipy = scipy.optimize.least_squares(
            drawn,
            start,
            jac=drawn.derivative,
            x_scale=SCALE,
            loss="cauchy" if loss_from else "linear",
            f_scale=loss_from or 1.0,
            xtol=1e-13,
            ftol=1e-13,
            gtol=1e-13,
        )
        x = drawn.found(loss_from, start)
        assert_allclose(x, of_scipy.x, atol=1e-6 * SCALE / weakest)
        rank = np.linalg.matrix_rank(drawn.derivative(x) * SCALE)
        assert rank == len(x)


def test_robust_loss_suppresses_gross_errors():
    for seed in range(20):
        drawn = Drawn(seed, 1.0)
        x = drawn.found(0.02, drawn.true)
        assert np.abs(x - drawn.true).max() < 0.03 * SCALE
        assert np.abs(drawn.found(0.0, drawn.true) - drawn.true).max() > 0.3 * SCALE


def test_damping_converges_on_rosenbrock_function():
    """From Rosenbrock's original start values, undamped steps increase the error."""

    def errors(x):
        values = np.array([10 * (x[1] - x[0] ** 2), 1 - x[0]])
        return Errors(values, lambda: np.array([[-20 * x[0], 10], [-1, 0]]))

    x = least_squares(errors, np.array([-1.2, 1.0]), 1.0, step=1e-14, evaluations=100)
    assert_allclose(x, 1, atol=1e-9)


def test_variables_without_effect_keep_their_values():
    def errors(x):
        return Errors(np.array([x[0] - 1, 2 * x[0] - 2]), lambda: np.array([[1.0, 0], [2, 0]]))

    x = least_squares(errors, np.array([0.0, 5.0]), 1.0, step=1e-12, evaluations=50)
    assert_allclose(x, [1, 5], atol=1e-8)
