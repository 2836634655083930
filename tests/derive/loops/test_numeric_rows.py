"""Numerical closure equations agree with their Jacobian and with the exact equations."""

import numpy as np
import pytest

from chasles.derive.loops.closing.closed_loops import ClosedLoops
from chasles.derive.loops.model.numeric_mechanism import NumericMechanism
from chasles.derive.loops.model.numeric_rows import NumericRows
from tests.support.loops import mechanisms
from tests.support.loops.continued import closed_configuration

NAMES = ("four_bar", "slider_crank", "parallelogram", "bennett", "sarrus", "stewart", "delta")
STEP = 1e-6


@pytest.mark.parametrize("name", NAMES)
def test_jacobian_of_closed_loops_matches_differences(name):
    mechanism = getattr(mechanisms, name)()
    rows, at = NumericRows(NumericMechanism(mechanism)), closed_configuration(mechanism)
    w = np.array([at[variable] for variable in rows.names])
    residual, J, facing = rows.at(w)
    assert np.abs(residual).max() < 1e-12
    assert facing == pytest.approx(np.ones(len(facing)))
    steps = STEP * np.eye(len(w))
    slopes = [(rows.at(w + h)[0] - rows.at(w - h)[0]) / (2 * STEP) for h in steps]
    assert pytest.approx(np.transpose(slopes), abs=1e-8) == J
    assert [*rows.owners] == sorted(rows.owners, key=[c.name for c in mechanism.loop_joints].index)


def test_gradient_of_least_squares_is_zero_where_all_loops_close():
    mechanism = mechanisms.parallelogram(3)
    loops = ClosedLoops(mechanism, closed_configuration(mechanism), in_least_squares=True)
    gradient, J, _ = loops.evaluated(loops.reference)
    assert np.abs(gradient).max() < 1e-12
    # The least-squares gradient has one entry per passive joint. The Jacobian of this gradient is
    # approximately J^T J, where J is the Jacobian of the closure errors.
    assert J.shape == (sum(loops.passive), len(loops.names))
    part = J[:, loops.passive]
    assert part == pytest.approx(part.T, abs=1e-8)
    assert np.linalg.eigvalsh(part).min() > 0
