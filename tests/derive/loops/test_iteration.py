"""Functions that depend on iteratively solved loops call the solver first."""

import pytest

from chasles.derive.program.counting import count_operations
from tests.support.derivations import derivation, made

CLOSED = ["at"]
FACTORED = [*CLOSED, "factored"]
CALLED = {
    "fk": CLOSED,
    "chain": CLOSED,
    "configuration": CLOSED,
    "configuration_near": ["seeded"],
    "margin": [*FACTORED, "margin"],
    "twist_mixed": [*FACTORED, "rates"],
    "chain_rates": [*FACTORED, "rates"],
    "acceleration_mixed": [*FACTORED, "rates", "accelerations"],
    "jacobian_mixed": [*FACTORED, "w_D_q"],
    "jacobian_space_dot": [*FACTORED, "rates", "w_D_q", "w_D_q_dot"],
    "hessian_mixed": [*FACTORED, "w_D_q", "w_D_q_q"],
    "actuators": [],
    "chain_fk": [],
}
"""For each generated function, the entries of the loop solver that the function calls. The twist
needs one linear system, and the Jacobian one system per coordinate."""
COUNTED = {"fk": 25, "jacobian_mixed": 54, "jacobian_space_dot": 379, "twist_mixed": 14}
"""Maximum number of arithmetic operations of each function after its calls of the loop solver."""


@pytest.mark.parametrize("name", CALLED)
def test_function_calls_only_the_entries_that_it_reads(name):
    function = derivation("stewart_gough").function(name)
    assert [call.entry for call in function.calls] == CALLED[name]


@pytest.mark.parametrize("name", COUNTED)
def test_derivatives_are_multiplied_without_their_zeros(name):
    assert count_operations(made("stewart_gough").whole[name]).total <= COUNTED[name]
