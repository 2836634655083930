"""For turntable arms with errors in every parameter, refinement finds all solutions."""

import numpy as np

from chasles.derive import read
from chasles.derive.inverse.classify import classify
from chasles.derive.inverse.nominal import nominal_of
from chasles.derive.inverse.structure.lines import Lines, axes_of
from chasles.derive.model.tolerances import EXACT_STRUCTURE
from chasles.derive.terms.terms import Terms
from tests.support.compiling import compiled
from tests.support.derivations import description
from tests.support.generators.geometric_errors import displaced
from tests.support.oracles.pinocchio_fk import pinocchio_fk

ARM = read(description("so101"))
SEEDS = range(2)
TRUE = 1e-8
"""Maximum pose error (meter, or rotation matrix entry) of a correct inverse kinematics solution."""
SAME = 1e-6
"""Two solutions count as equal if their difference (radian) is below 1e-6."""
REGULAR = 1e-5
"""Minimum singular value (meter or radian per radian) of the tested configurations."""


def drawn(seed):
    """Return an SO-101 arm with random geometric errors.

    The maximum error is between 0.1 and 10 mm for lengths, and between 0.1 and 10 mrad for angles.
    """
    size = float(10 ** np.random.default_rng(seed).uniform(-4, -2))
    return displaced(ARM, size, seed)


def test_nominal_arm_has_the_exact_structure():
    checked = 0
    for seed in SEEDS:
        robot = drawn(seed)
        terms = Terms({})
        classification = classify(robot, terms)
        found = classification.near[0]
        nominal = nominal_of(robot, classification.lines, found)
        assert found.deviation > EXACT_STRUCTURE
        assert found.on(Lines(terms, axes_of(nominal, terms))).deviation < EXACT_STRUCTURE
        checked += 1
    assert checked == len(SEEDS)


def test_ik_of_displaced_arm_recovers_generating_configuration(tmp_path):
    seed = 92
    robot = drawn(seed)
    arm = compiled(robot, tmp_path / robot.name, ("fk", "fk_jacobian_mixed", "ik"), ["c"])
    q = np.random.default_rng(seed).uniform(-np.pi, np.pi, (2000, 5))
    T, J = arm.fk_jacobian_mixed(q)
    assert not hasattr(arm, "ik_position")
    assert any("only inverses of a full pose" in note for note in arm.notes)
    found = arm.ik(T)
    is_found = (found.valid & (np.abs(found.distances_from(q)).max(-1) < SAME)).any(-1)
    regular = np.linalg.svd(J, compute_uv=False)[:, -1] > REGULAR
    assert regular.mean() > 0.999
    assert is_found[regular].all()
    fk = pinocchio_fk(robot)
    for k in range(0, 2000, 100):
        for row in found.q[k][found.valid[k]]:
            assert np.abs(fk(row) - T[k]).max() < TRUE
