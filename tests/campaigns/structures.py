"""Searches for poses that the IK functions of random arms with a known axis structure miss.

Each arm has a prescribed axis structure, and its lengths and angles are random decimals. The
campaign ``losses`` tests arms with random round numbers, which rarely have a known axis structure.
"""

from tests.support.generators.drawn_arms import cases_of
from tests.support.generators.synthetic import robot_of

from .campaign import Campaign, Outcome
from .losses import losses_of

WRIST = "/RxrxR"
STRUCTURES = (
    *(arm + WRIST for arm in ("R=R/R", "R/R=R", "RxR/R", "R/RxR", "R/R/R", "RxR/P", "R=R=P")),
    *(arm + WRIST for arm in ("R/RLP", "P=R=R", "P/RxR", "P/P/R", "P/P/P")),
    *("R/R=R=R/RxR", "R/R=R=R/R/R", "R/RxrxR/R/R", "RLpLP=R/RxR", "R/R/R=R=R/R"),
    *("RxrxRLrLRxrxR", "RxrxR/R/RxrxR", "RxrxRxRxRxrxR", "RxrxR=R/RxrxR"),
    *("R/R=R/RxrxR/R", "P/R/R=R/RxrxR"),
    *("R=R=R", "R=R=R=P", "R=R=P=R", "R=P=R=R", "P=R=R=R"),
    *("R+R=R=R", "RLR=R=R+R", "R=R=RLR", "R/R=R/R", "R+R=R+R", "RLR=RLR", "RxR=R+R", "R+R=RxR"),
    *("R/R=R/RxR", "R=R=R/R/R"),
    *("R/P/P", "P=R/P", "RLP/R", "RLPLR/RxrxR", "RLPLP", "R=P/P", "P/R=P"),
    *("P=RLP/RxrxR", "R/P/P/RxrxR", "R=P=R/RxrxR"),
)
"""Axis structures for every closed-form family of inverse kinematics, in the notation of
`tests.support.generators.synthetic`."""


def trial(number: int) -> Outcome:
    """Test each IK function of an arm whose skew axes are at right angles or at random angles."""
    turn, index = divmod(number, 2 * len(STRUCTURES))
    chain, right = STRUCTURES[index // 2], bool(index % 2)
    if turn % 3 == 2:
        chain = chain[::-1]
    cases = cases_of(robot_of(chain, right=right, seed=turn))
    losses = [loss for case in cases for loss in losses_of(case, number)]
    counts = {"arms with an inverse": int(bool(cases)), "inverses": len(cases)}
    failures = tuple(f"{chain}, right {right}, {loss}" for loss in losses if loss.is_real)
    return Outcome(counts, failures)


CAMPAIGN = Campaign(
    "structures",
    "No inverse of an arm with a given structure leaves a reachable pose without a solution.",
    trial,
)
