"""The damped search continues if the damping is smaller than the rounding errors of the matrix."""

import numpy as np

from chasles.derive.loops.model.damped_search import least


def test_search_continues_with_stronger_damping_if_the_matrix_is_singular():
    # The two columns of the Jacobian are equal.
    def residual(x):
        return 1e8 * (x[..., :1] + x[..., 1:]) ** 3

    found = least(residual, np.array([4.5, 4.5]), np.zeros(2, dtype=bool), 0.0)
    assert abs(residual(found)[0]) < 1e-3
