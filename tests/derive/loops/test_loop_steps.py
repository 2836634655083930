"""Loop solution steps of every kind satisfy the equations printed for them."""

from dataclasses import replace
from functools import cache, reduce

import numpy as np
import pytest
import sympy as sp
from test_assembly import crank_slider_offset, oldham
from test_spatial import crank_and_slider

from chasles.derive import Frame, Mechanism, Strut
from chasles.derive.loops.planar.assembly import STEPS as PLANAR
from chasles.derive.loops.planar.loop_step import Cross, components, length_of, quantity
from chasles.derive.loops.planar.parallelogram import CrossedParallelogram
from chasles.derive.loops.spatial.hinged_rod import HingePoints
from chasles.derive.loops.spatial.legs import STEPS as SPATIAL
from chasles.derive.loops.spatial.telescope import TelescopeTravel
from chasles.derive.loops.spatial.universal_leg import UniversalLeg
from chasles.derive.terms.tangents import Tangent
from tests.support.loops.legs_of_joints import drawn, tripod
from tests.support.loops.mechanisms import (
    BASE,
    at,
    delta,
    excavator_arm,
    near,
    parallelogram,
    pin,
    rssr,
    rsur,
    slider_crank,
    slotted_rocker,
    stewart,
)
from tests.support.loops.solved import solved

TRUE = 1e-10


def crossed():
    """Return a parallelogram in the crossed assembly mode."""
    return Mechanism(
        "crossed",
        (pin("crank", BASE, "arm"), pin("bar", "arm", "coupler", 1)),
        ("crank",),
        struts=(Strut("rod", Frame(BASE, at(2)), Frame("coupler", at(2)), 1),),
        tool_body="coupler",
        reference=near(("crank", 1), ("bar", "-18/10"), ("rod_swing", "-18/10")),
    )


def pushed():
    """Return a slider-crank with an actuated slider and the tool on its rod."""
    whole = slider_crank()
    return replace(whole, name="pushed", actuated=("cross",), tool_body="rod")


BUILDERS = (
    *(crank_and_slider, crank_slider_offset, crossed, delta, excavator_arm, oldham, parallelogram),
    *(pushed, rssr, rsur, slider_crank, slotted_rocker),
)
"""Functions that build mechanisms whose joint values all follow from the actuator values."""


def flat_legs():
    return drawn(1, ("RPS", "PRS", "RRS"))


PLATFORMS = (stewart, flat_legs, tripod)
"""Functions that build mechanisms whose joint values follow from the joint values of the main
chain."""


@cache
def hybrid(build):
    return solved(build())


def steps():
    """Return a pair (solution, step) for each step of the forward and backward solutions."""
    forward = [hybrid(build).forward for build in BUILDERS]
    backward = [hybrid(build).backward for build in (*PLATFORMS, slider_crank, delta, pushed)]
    return [(solution, step) for solution in (*forward, *backward) for step in solution.steps]


class Numbers:
    """Values of the symbols in a loop solution step."""

    def __init__(self, solution, equations):
        self.of = solution.reference.of
        self.known = {}
        for letter, vector in equations.vectors.items():
            values = np.array([self.of(part) for part in vector])
            self.known[quantity(letter)] = values
            self.known[length_of(letter)] = np.linalg.norm(values)
            self.known |= zip(components(letter, "xyz"[: len(values)]), values, strict=True)
        self.known |= {symbol: self.of(term) for symbol, term in equations.scalars.items()}
        for symbol, value in equations.results:
            self.known[symbol] = found = self(value)
            if isinstance(found, np.ndarray):
                self.known |= zip(components(symbol.name, "xyz"), found, strict=True)

    def __call__(self, value):
        if value in self.known:
            return self.known[value]
        if not value.free_symbols or value.is_Symbol:
            return self.of(value)
        parts = [self(part) for part in value.args]
        if isinstance(value, Cross):
            return np.cross(*parts)
        if value.is_Pow and isinstance(parts[0], np.ndarray):
            return (parts[0] @ parts[0]) ** (parts[1] / 2)
        if value.is_Pow:
            return parts[0] ** parts[1]
        if isinstance(value, sp.Abs):
            return np.linalg.norm(parts[0])
        if value.is_Add or value.is_Mul:
            return sum(parts) if value.is_Add else reduce(np.multiply, parts)
        return float(value.func(*map(sp.Float, parts)))


def test_every_step_kind_is_covered():
    assert {type(step) for _, step in steps()} == {
        *PLANAR,
        *SPATIAL,
        CrossedParallelogram,
        UniversalLeg,
        HingePoints,
        TelescopeTravel,
    }


def test_step_equations_match_solved_results_angles_and_margins():
    checked = 0
    for solution, step in steps():
        equations = step.equations()
        numbers = Numbers(solution, equations)
        for symbol, term in equations.unknowns.items():
            assert numbers(symbol) == pytest.approx(numbers.of(term), abs=TRUE)
            checked += 1
        for equation in equations.angles:
            here = complex(*(numbers(part) for part in components(equation.here)))
            there = complex(*(numbers(part) for part in equation.there))
            turned = here * np.exp(1j * numbers.of(equation.angle))
            assert turned == pytest.approx(there, abs=TRUE)
            checked += 1
        assert (equations.margin is None) is (step.margin is None)
        if step.margin is not None:
            assert numbers(equations.margin) == pytest.approx(numbers.of(step.margin), abs=TRUE)
            checked += 1
    assert checked == 70


def test_step_rate_equations_match_solution_rates():
    checked = 0
    for solution, step in steps():
        equations = step.equations()
        numbers = Numbers(solution, equations)
        terms = hybrid_of(solution).terms
        given = [s for s in numbers_in(solution) if s not in terms.definitions]
        pattern = {s: sp.Rational(k + 1, 7) for k, s in enumerate(given)}
        tangent = Tangent(terms, pattern, solution.loops)
        meaning = terms_of(equations)
        rate_of = lambda s: solution.reference.of(tangent.of(meaning(s)))  # noqa: B023, E731
        for rate in equations.rates:
            left = sum(numbers(weight) * rate_of(symbol) for symbol, weight in rate.left)
            right = sum(numbers(weight) * rate_of(symbol) for symbol, weight in rate.right)
            assert left == pytest.approx(right, abs=TRUE)
            checked += 1
    assert checked > 25


def hybrid_of(solution):
    return next(
        hybrid(b) for b in (*BUILDERS, *PLATFORMS) if hybrid(b).mechanism is solution.mechanism
    )


def numbers_in(solution):
    """Return the coordinates from which a loop solution computes the other joint values."""
    h = hybrid_of(solution)
    return h.q if solution is h.forward else h.theta


def terms_of(equations):
    found = {**equations.scalars, **equations.unknowns}
    for letter, vector in equations.vectors.items():
        found |= zip(components(letter, "xyz"[: len(vector)]), vector, strict=True)
    return lambda symbol: found.get(symbol, symbol)


def test_step_without_equations_states_a_reason():
    found = [step for _, step in steps() if not step.equations().vectors]
    assert len(found) > 1
    assert all(step.reason.endswith(".") for step in found)


def test_two_branch_steps_have_a_name_and_a_remark():
    for _, step in steps():
        assert bool(step.branch) is step.is_choice
        # A step has a remark on the sign of its root if the step has equations and several
        # branches.
        assert bool(step.remark) is bool(step.branch and step.equations().vectors)
