"""Arms whose joints are coupled to motors by random matrices of rational numbers.

Matrix products with the uncoupled arm give the expected poses, Jacobians, derivatives and rates.
Each solution of the uncoupled arm, converted to motor coordinates, must be among the solutions of
the coupled arm.
"""

import numpy as np

from tests.support.generators.coupled_arms import coupled_arm
from tests.support.oracles.matrix_product import product_errors

from .bars import barred
from .campaign import Campaign, Outcome

POSES = 5
BARS = {"pose": 1e-13, "jacobian": 1e-13, "rate": 1e-13, "maps": 1e-13, "lost": 0.0}


def trial(number: int) -> Outcome:
    arm = coupled_arm(number)
    found = product_errors(arm, POSES, np.random.default_rng(number))
    kind = f"{len(arm.c)} joints" + ("" if found.solutions else ", no closed form")
    return barred(kind, found, BARS, f"arm {number}")


CAMPAIGN = Campaign(
    "couplings", "Coupled arms equal the matrix product and keep every solution.", trial
)
