"""Inverse kinematics solutions of chains with coupled joints satisfy the couplings."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from chasles.derive import Coupling, derive, explain, files
from tests.support.generators.synthetic import Function, robot_of

POSES = 100
CHAINS = (
    ("R+R=R=R", {"j4": ("j3", -1, 0)}),
    ("R+R=R=R", {"j3": ("j2", -2, "1/5")}),
    ("R/R=R/RxrxR", {"j3": ("j2", 1, 0), "j5": ("j4", -1, "1/7")}),
)


def followed(chain, laws):
    """Return a random chain with coupled joints."""
    robot = robot_of(chain)
    couplings = (
        Coupling(name, ((leader, ratio),), offset) for name, (leader, ratio, offset) in laws.items()
    )
    return replace(robot, couplings=tuple(couplings))


@pytest.mark.parametrize(
    ("chain", "laws"),
    CHAINS,
    ids=lambda value: "+".join(value) if isinstance(value, dict) else None,
)
def test_ik_with_coupled_joints_recovers_generating_configuration(chain, laws):
    found = derive(followed(chain, laws))
    fk, ik = (Function(found.function(name)) for name in ("fk", "ik"))
    n = len(found.robot.coordinates)
    q = np.random.default_rng(0).uniform(-np.pi, np.pi, (POSES, n))
    T = np.array(fk.kernel(ca.DM(q.T))).T.reshape(-1, 4, 4)
    answers = ik(T)
    far = np.abs((answers.q - q[:, None] + np.pi) % (2 * np.pi) - np.pi).max(axis=-1)
    assert answers.q.shape[-1] == n
    assert (answers.valid & (far < 1e-6)).any(axis=1).all()
    reached = np.array(fk.kernel(ca.DM(answers.q[answers.valid].T))).T.reshape(-1, 4, 4)
    wanted = np.repeat(T[:, None], answers.q.shape[1], axis=1)[answers.valid]
    np.testing.assert_allclose(reached, wanted, atol=3e-9)
    # The couplings exclude most inverse kinematics solutions of the uncoupled chain.
    assert not answers.valid.all()


def test_article_and_explanation_state_that_coupled_joints_are_free():
    robot = followed(*CHAINS[0])
    written = files(robot)
    (article,) = (
        text.decode() for name, text in written.items() if name.endswith("latex/inverse.tex")
    )
    assert "the chain without the couplings" in article
    assert "All joints are free in these steps" in str(explain(robot))


def test_fractional_ratio_has_no_analytic_inverse():
    assert (
        "follows other coordinates" in explain(followed("R+R=R=R", {"j3": ("j2", "1/2", 0)})).line
    )


def test_redundant_chain_with_coupled_joint_has_no_analytic_inverse():
    robot = followed("R/R/R/R/R/R/R", {"j4": ("j3", 1, 0)})
    assert "follows other coordinates" in explain(robot).line
