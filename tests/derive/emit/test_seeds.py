"""Test the function ik_nearest in output languages other than C."""

import pytest

from chasles.derive import derive, read_text
from chasles.derive.emit.printed import printed_functions
from chasles.derive.emit.seeds import SeedInputs, missing_nearest, printed_nearest
from tests.support.derivations import robot_of
from tests.support.pages import examples


def nearest(robot, functions):
    derivation = derive(robot, functions=functions)
    printed = printed_functions(derivation)
    found = {f.name: own for f, own in printed_nearest(derivation, printed)}
    return found, missing_nearest(derivation, printed)


@pytest.mark.parametrize(
    ("name", "functions", "inputs"),
    [
        ("ur5e", ["ik"], SeedInputs((), ())),
        ("panda", ["ik"], SeedInputs(("q7",), (6,))),
        ("iiwa14", ["ik", "swivel"], SeedInputs(("swivel",), (0,), "swivel", 1)),
    ],
)
def test_seed_determines_the_inputs_of_an_inverse(name, functions, inputs):
    assert nearest(robot_of(name), functions) == ({"ik": inputs}, "")


def test_inverse_without_its_swivel_function_is_named():
    sentence = "In no language, because a seed does not determine the inputs: ik_nearest."
    assert nearest(robot_of("iiwa14"), ["ik"]) == ({}, sentence)


def test_inverse_of_a_differential_with_shared_limits_is_named():
    text = next(t for t in examples("how-to/couplings.md", "toml") if "planetary" in t)
    found, sentence = nearest(read_text(text), ["fk", "ik"])
    assert found == {}
    assert sentence == "Only in C, because limits or full turns couple coordinates: ik_nearest."


def test_inverse_with_an_iterative_solver_is_named():
    found, sentence = nearest(robot_of("jaco2"), ["fk", "ik"])
    assert found == {}
    assert sentence == "Only in C, because of an iterative solver: ik_nearest."
