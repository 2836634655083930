"""One program for all branches gives bitwise the same results as one program per branch."""

import re

import numpy as np
import pytest

from chasles.derive.program.counting import count_operations
from chasles.derive.program.operations import (
    Compute,
    Constant,
    Input,
    Operation,
    Program,
    Store,
    Variable,
)
from chasles.derive.program.unrolling import unrolled
from chasles.derive.terms.branches import patterns
from tests.support.derivations import ALL, GENERATED, derivation, made

RULES = {
    Operation.ADD: np.add,
    Operation.SUBTRACT: np.subtract,
    Operation.MULTIPLY: np.multiply,
    Operation.DIVIDE: np.divide,
    Operation.SQUARE: np.square,
    Operation.NEGATE: np.negative,
    Operation.SQRT: np.sqrt,
    Operation.SIN: np.sin,
    Operation.COS: np.cos,
    Operation.TAN: np.tan,
    Operation.ATAN: np.arctan,
    Operation.ATAN2: np.arctan2,
    Operation.ABS: np.abs,
    Operation.SIGN: np.sign,
    Operation.MIN: np.fmin,
    Operation.MAX: np.fmax,
    Operation.LESS: np.less,
    Operation.LESS_EQUAL: np.less_equal,
    Operation.EQUAL: np.equal,
    Operation.NOT_EQUAL: np.not_equal,
    Operation.NOT: np.logical_not,
    Operation.AND: np.logical_and,
    Operation.OR: np.logical_or,
    Operation.SELECT: np.where,
}
POSES = 200
SIGNED = [
    (name, function)
    for name in ALL
    for function in re.findall(
        rf"^static void {name}_(\w+)_branch\(", (GENERATED / name / f"{name}.c").read_text(), re.M
    )
]
"""Pairs (robot name, function name) of all functions with branch sign inputs. The function names
are read from the generated C code."""
SAMPLE = ("ur5e", "iiwa14", "lynxmotion", "five_bar", "slider_crank")
"""Names of arms with several branches, a redundant arm, and robots with position tasks or planar
loops."""
SAMPLED = [pair for pair in SIGNED if pair[0] in SAMPLE]
X, Y, S = Input(0, 0), Input(0, 1), Input(1, 0)
A, B, C, D = map(Variable, range(1, 5))


def run(program, arguments):
    """Evaluate a program for many poses.

    Its arguments and results are arrays of shape (entries, poses).
    """
    values = {}

    def value(operand):
        match operand:
            case Constant(number):
                return np.float64(number)
            case Input(argument, entry):
                return arguments[argument][entry]
            case _:
                return values[operand]

    found = {}
    with np.errstate(all="ignore"):
        for statement in program.statements:
            operands = [value(operand) for operand in statement.operands]
            if isinstance(statement, Compute):
                values[statement.result] = RULES[statement.operation](*operands)
            else:
                found[statement.output, statement.entry] = np.broadcast_to(operands[0], (POSES,))
    sizes = [1 + max(e for o, e in found if o == k) for k in range(len(program.results))]
    return [np.stack([found[k, e] for e in range(n)]) for k, n in enumerate(sizes)]


def test_at_least_fifteen_functions_have_branches():
    assert len(SIGNED) >= 15


@pytest.mark.parametrize("name", [*SAMPLE, "planar_3rrr"])
def test_generated_c_has_a_branch_function_per_signed_function(name):
    signed = [(name, f.name) for f in derivation(name).functions if f.signs]
    assert sorted(signed) == sorted(pair for pair in SIGNED if pair[0] == name)


@pytest.mark.parametrize(("name", "function"), SAMPLED)
def test_unrolled_branches_equal_single_branches_bit_for_bit(name, function):
    symbolic = derivation(name).function(function)
    programs, rng = made(name), np.random.default_rng(11)
    given = [rng.uniform(-1, 1, (argument.size, POSES)) for argument in symbolic.inputs]
    whole = run(programs.whole[function], given)
    for b, signs in enumerate(patterns(symbolic)):
        choice = np.repeat(np.array(signs, float)[:, None], POSES, 1)
        for every, one in zip(whole, run(programs.branch[function], [*given, choice]), strict=True):
            n = len(one)
            # A zero result may have the opposite sign.
            np.testing.assert_array_equal(every[b * n : (b + 1) * n] + 0.0, one + 0.0)


@pytest.mark.parametrize(("name", "function"), SAMPLED)
def test_unrolled_branches_share_operations(name, function):
    symbolic = derivation(name).function(function)
    whole = count_operations(made(name).whole[function]).total
    one = count_operations(made(name).branch[function]).total
    assert whole < symbolic.branches * one


def branch(*statements):
    return Program("f_branch", ("x", "choice"), ("y",), (X, Y, S), statements)


def test_value_and_its_negative_are_computed_once():
    given = branch(
        Compute(A, Operation.MULTIPLY, (S, X)),
        Compute(B, Operation.MULTIPLY, (A, Y)),
        Compute(C, Operation.SUBTRACT, (Y, B)),
        Store(0, 0, C),
    )
    program = unrolled(given, [(1,), (-1,)], "f")
    assert program == Program(
        "f",
        ("x",),
        ("y",),
        (X, Y),
        (
            Compute(A, Operation.MULTIPLY, (X, Y)),
            Compute(B, Operation.SUBTRACT, (Y, A)),
            Store(0, 0, B),
            Compute(C, Operation.ADD, (Y, A)),
            Store(0, 1, C),
        ),
    )


@pytest.mark.parametrize(
    ("operation", "kept"),
    [(Operation.COS, 1), (Operation.SQUARE, 1), (Operation.ABS, 1), (Operation.SIN, 2)],
)
def test_even_and_odd_operations_are_computed_once(operation, kept):
    given = branch(
        Compute(A, Operation.MULTIPLY, (S, X)), Compute(B, operation, (A,)), Store(0, 0, B)
    )
    computed = unrolled(given, [(1,), (-1,)], "f").computed
    assert [s.operation for s in computed] == [operation, Operation.NEGATE][:kept]


def test_comparison_of_a_negated_value_is_reversed():
    given = branch(
        Compute(A, Operation.NEGATE, (X,)),
        Compute(B, Operation.LESS, (A, Constant(2.0))),
        Compute(C, Operation.SELECT, (B, X, S)),
        Store(0, 0, C),
    )
    first, *choices = unrolled(given, [(1,), (-1,)], "f").computed
    assert first == Compute(A, Operation.LESS, (Constant(-2.0), X))
    assert [c.operands[2] for c in choices] == [Constant(1.0), Constant(-1.0)]


def test_atan2_of_negated_y_is_a_negated_atan2():
    given = branch(
        Compute(A, Operation.NEGATE, (X,)),
        Compute(B, Operation.ATAN2, (A, Y)),
        Compute(C, Operation.MULTIPLY, (B, S)),
        Store(0, 0, C),
    )
    assert [s.operation for s in unrolled(given, [(1,), (-1,)], "f").computed] == [
        Operation.ATAN2,
        Operation.NEGATE,
    ]


def test_constant_operations_are_folded():
    given = branch(
        Compute(A, Operation.ADD, (S, Constant(1.0))),
        Compute(B, Operation.LESS, (A, Constant(1.0))),
        Compute(C, Operation.SELECT, (B, X, Y)),
        Compute(D, Operation.MULTIPLY, (A, C)),
        Store(0, 0, D),
    )
    assert unrolled(given, [(1,), (-1,)], "f").statements == (
        Compute(A, Operation.MULTIPLY, (Constant(2.0), Y)),
        Store(0, 0, A),
        Compute(B, Operation.MULTIPLY, (Constant(0.0), X)),
        Store(0, 1, B),
    )


def test_reversed_difference_keeps_its_value():
    given = branch(
        Compute(A, Operation.SUBTRACT, (X, Y)),
        Compute(B, Operation.NEGATE, (A,)),
        Compute(C, Operation.ADD, (B, X)),
        Compute(D, Operation.NEGATE, (C,)),
        Store(0, 0, D),
        Store(0, 1, B),
        Store(0, 2, S),
    )
    x, y = np.linspace(0.1, 1, POSES), np.linspace(2, 3, POSES)
    ((first, second, _),) = run(unrolled(given, [(1,)], "f"), [np.stack([x, y])])
    np.testing.assert_array_equal(first, -(-(x - y) + x))
    np.testing.assert_array_equal(second, -(x - y))


def random_branch(rng):
    logic = {Operation.NOT, Operation.AND, Operation.OR}
    numbers = [X, Y, S, Input(1, 1), *map(Constant, (0.0, 1.0, -1.0, 0.5, -2.0))]
    conditions, statements = [], []
    for k in range(rng.integers(3, 40)):
        known = [o for o in RULES if conditions or o not in {*logic, Operation.SELECT}]
        operation = known[rng.integers(len(known))]
        count = 3 if operation is Operation.SELECT else RULES[operation].nin
        pool = conditions if operation in logic else numbers
        operands = [pool[rng.integers(len(pool))] for _ in range(count)]
        if operation is Operation.SELECT:
            operands[0] = conditions[rng.integers(len(conditions))]
        result = Variable(k + 1)
        statements.append(Compute(result, operation, tuple(operands)))
        made_condition = operation in logic or operation.name.startswith(("LESS", "EQUAL", "NOT_"))
        (conditions if made_condition else numbers).append(result)
    stored = [v for v in numbers if isinstance(v, Variable)] or [X]
    stores = [Store(0, k, stored[-1 - k]) for k in range(min(4, len(stored)))]
    inputs = (X, Y, S, Input(1, 1))
    return Program("f_branch", ("x", "choice"), ("y",), inputs, (*statements, *stores))


def test_unrolled_random_programs_equal_single_branches():
    rng = np.random.default_rng(8)
    signs = [(1, 1), (1, -1), (-1, 1), (-1, -1)]
    given, differing = rng.normal(size=(2, POSES)), 0
    for _ in range(250):
        alone = random_branch(rng)
        program = unrolled(alone, signs, "f")
        (whole,) = run(program, [given])
        n = len(whole) // len(signs)
        differing += not np.array_equal(whole[:n], whole[-n:], equal_nan=True)
        for b, chosen in enumerate(signs):
            choice = np.repeat(np.array(chosen, float)[:, None], POSES, 1)
            (one,) = run(alone, [given, choice])
            np.testing.assert_array_equal(whole[b * n : (b + 1) * n] + 0.0, one + 0.0)
    assert differing > 75
