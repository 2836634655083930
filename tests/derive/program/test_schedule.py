"""Test the order of statements in generated programs."""

from collections import Counter

import pytest

from chasles.derive.program.operations import (
    Compute,
    Constant,
    Input,
    Operation,
    Program,
    Store,
    Variable,
    variables,
)
from chasles.derive.program.schedule import by_depth, calls_first, needed_only
from tests.support.derivations import made

X, Y = Input(0, 0), Input(0, 1)
A, B, C, D = map(Variable, range(1, 5))


def program(*statements):
    return Program("f", ("x",), ("y",), (X, Y), statements)


def depths(found: Program) -> list[int]:
    depth: dict[Variable, int] = {}
    message = []
    for statement in found.statements:
        message.append(max((depth[v] for v in variables(statement.operands)), default=0))
        if isinstance(statement, Compute):
            depth[statement.result] = message[-1] + 1
    return message


def kinds(found: Program) -> Counter:
    """Return the number of statements of each kind in a program.

    Variable names are ignored.
    """
    return Counter(
        (
            getattr(s, "operation", None) or (s.output, s.entry),
            tuple(None if isinstance(o, Variable) else o for o in s.operands),
        )
        for s in found.statements
    )


@pytest.mark.parametrize("name", ["ur5e", "iiwa14", "lynxmotion", "five_bar"])
def test_by_depth_sorts_statements_by_dependency_depth(name):
    for found in made(name).whole.values():
        ordered = by_depth(found)
        assert depths(ordered) == sorted(depths(found))
        assert kinds(ordered) == kinds(found)
        assert ordered.inputs == found.inputs


def test_unused_statements_are_removed():
    given = (
        Compute(A, Operation.ADD, (X, Y)),
        Compute(B, Operation.SIN, (A,)),
        Compute(C, Operation.NEGATE, (A,)),
        Store(0, 0, C),
    )
    assert needed_only(program(*given)).statements == (given[0], *given[2:])


def test_calls_and_their_operands_are_moved_first():
    given = (
        Compute(A, Operation.MULTIPLY, (X, X)),
        Compute(B, Operation.ADD, (X, Y)),
        Store(0, 0, A),
        Compute(C, Operation.SIN, (B,)),
        Compute(D, Operation.ADD, (C, A)),
        Store(0, 1, D),
    )
    assert calls_first(program(*given)).statements == (
        Compute(A, Operation.ADD, (X, Y)),
        Compute(B, Operation.SIN, (A,)),
        Compute(C, Operation.MULTIPLY, (X, X)),
        Store(0, 0, C),
        Compute(D, Operation.ADD, (B, C)),
        Store(0, 1, D),
    )


def test_positive_and_negative_zero_constants_differ():
    assert Constant(0.0) != Constant(-0.0)
    assert len({Constant(0.0), Constant(-0.0), Constant(0.0)}) == 2
