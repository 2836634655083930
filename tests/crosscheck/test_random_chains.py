"""Random chains agree with Pinocchio: poses, Jacobians and accelerations."""

import pytest

pytest.importorskip("pinocchio", reason="missing package: pinocchio (make test installs it)")

from tests.campaigns.chains import check_jacobians, check_motions

CHAINS, MOTIONS = (2, 6, 8, 9, 10, 11, 13), (3, 15)
"""Random seeds whose chains together cover every frame type, every joint type and a mimic joint."""


@pytest.mark.parametrize("seed", CHAINS)
def test_poses_and_jacobians_of_random_chains_agree_with_pinocchio(seed):
    check_jacobians(seed)


def test_hessians_twists_and_accelerations_of_random_chains_agree_with_pinocchio():
    followed = sum(check_motions(seed) for seed in MOTIONS)
    assert followed > 0
