"""Statements of the generated C: their order."""

import re
from collections import Counter

import pytest
from derivations import NAMES, derivation

from chasles.derive.program.statements import NAME, Body, Compute, bodies
from chasles.derive.terms.casadi_graph import lower


def depths(body: Body) -> list[int]:
    """Depth of each statement: the longest chain of statements that it waits for."""
    depth: dict[str, int] = {}
    found = []
    for statement in body.statements:
        text = statement.expression if isinstance(statement, Compute) else statement.value
        found.append(max((depth[name] for name in NAME.findall(text)), default=0))
        if isinstance(statement, Compute):
            depth[statement.name] = found[-1] + 1
    return found


def kinds(body: Body) -> Counter:
    """Statements by what is left of them without names."""
    return Counter(re.sub(NAME, "v", str(statement)) for statement in body.statements)


@pytest.mark.parametrize("name", NAMES)
def test_by_depth_nothing_waits_for_what_comes_later(name):
    derived = derivation(name)
    for body in bodies(lower(derived.functions, name)):
        ordered = body.by_depth()
        assert depths(ordered) == sorted(depths(body))
        assert kinds(ordered) == kinds(body)
        assert ordered.loads == body.loads
