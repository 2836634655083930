"""Compiled C agrees with the equations at 30-digit precision."""

import mpmath
import numpy as np
import pytest
import sympy as sp

import chasles
from tests.support.derivations import FULL, NAMES, derivation
from tests.support.oracles.extended_precision import (
    DIGITS,
    extended_fk,
    from_sympy,
    poses_by_matrices,
    rounded,
)
from tests.support.tolerances import EXACT_CODE

POSES = 4
SERIAL = [name for name in NAMES if name in FULL]


@pytest.fixture(autouse=True)
def thirty_digits():
    with mpmath.workdps(DIGITS):
        yield


@pytest.mark.parametrize("name", SERIAL)
def test_fk_and_link_poses_match_exact_matrix_products(name):
    robot = derivation(name).robot
    compiled = chasles.load(name)
    rng = np.random.default_rng(3)
    for q in rng.uniform(-np.pi, np.pi, (POSES, len(robot.coordinates))):
        links, tool = poses_by_matrices(robot, q)
        assert largest(compiled.fk(q), tool) <= EXACT_CODE
        for found, expected in zip(compiled.link_poses(q), links, strict=True):
            assert largest(found, expected) <= EXACT_CODE


def test_extended_precision_matches_30_digits():
    robot = derivation("ur5e").robot
    q = np.random.default_rng(4).uniform(-np.pi, np.pi, (POSES, 6))
    for row, T in zip(q, extended_fk(robot, q), strict=True):
        _, tool = poses_by_matrices(robot, row)
        assert np.abs(T - rounded(tool)).max() <= 8 * np.finfo(np.longdouble).eps


def largest(found, expected):
    return max(
        abs(mpmath.mpf(float(found[row, column])) - expected[row, column])
        for row in range(4)
        for column in range(4)
    )


@pytest.mark.parametrize("name", SERIAL)
def test_every_function_matches_equations_at_30_digits(name):
    derived = derivation(name)
    compiled = chasles.load(name)
    rng = np.random.default_rng(5)
    n = len(derived.robot.coordinates)
    checked = 0
    for _ in range(POSES):
        numbers = {"q": rng.uniform(-np.pi, np.pi, n)}
        numbers |= {rate: rng.uniform(-1, 1, n) for rate in ("qd", "qdd")}
        values = evaluated(derived, numbers)
        for function in derived.functions:
            if not is_known(function, numbers):
                continue
            arguments = [numbers[argument.name] for argument in function.inputs]
            results = getattr(compiled, function.name)(*arguments)
            results = results if isinstance(results, tuple) else (results,)
            for found, result in zip(results, function.outputs, strict=True):
                expected = [exactly(entry, values) for entry in result.entries]
                error = max(
                    abs(mpmath.mpf(float(f)) - e) / max(1, abs(e))
                    for f, e in zip(found.ravel(), expected, strict=True)
                )
                assert error <= EXACT_CODE, (function.name, float(error))
                checked += 1
    known = sum(is_known(function, numbers) for function in derived.functions)
    assert checked == POSES * (known + 1)


def evaluated(derived, numbers):
    """Evaluate every symbol at 30-digit precision."""
    terms = derived.terms
    values = {symbol: terms.value(symbol) for symbol in (*terms.parameters, *terms.constants)}
    values = {symbol: from_sympy(value) for symbol, value in values.items()}
    for name, vector in numbers.items():
        for k, value in enumerate(vector, 1):
            values[sp.Symbol(f"{name}{k}", real=True)] = mpmath.mpf(float(value))
    known = [f for f in derived.functions if is_known(f, numbers)]
    entries = [entry for f in known for result in f.outputs for entry in result.entries]
    for symbol in terms.needed(entries):
        values[symbol] = exactly(terms.definitions[symbol], values)
    return values


def is_known(function, numbers):
    return {argument.name for argument in function.inputs} <= numbers.keys()


def exactly(expression, values):
    """Evaluate a SymPy expression in mpmath."""
    if expression in values:
        return values[expression]
    if expression.is_Number or expression.is_NumberSymbol:
        return from_sympy(expression)
    arguments = [exactly(argument, values) for argument in expression.args]
    if expression.is_Add:
        return mpmath.fsum(arguments)
    if expression.is_Pow:
        return mpmath.power(*arguments)
    if expression.is_Mul:
        return mpmath.fprod(arguments)
    return getattr(mpmath, expression.func.__name__)(*arguments)
