"""The damped least-squares search continues if damping is below the matrix rounding errors."""

import numpy as np

from chasles.derive.loops.model.damped_search import least


def test_search_continues_with_stronger_damping_if_the_matrix_is_singular():
    # The Jacobian of the test function has two equal columns.
    def residual(x):
        return 1e8 * (x[..., :1] + x[..., 1:]) ** 3

    found = least(residual, np.array([4.5, 4.5]), np.zeros(2, dtype=bool), 0.0)
    assert abs(residual(found)[0]) < 1e-3
