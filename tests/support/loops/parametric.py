"""Parametric equations of shipped robots with loops."""

from functools import cache

import numpy as np

from chasles.derive import read
from chasles.derive.loops.parametric.parametric_loops import ParametricLoops
from chasles.derive.terms.casadi_graph import lower
from tests.support.derivations import ROBOTS
from tests.support.loops.solved import solved


@cache
def loops_of(name):
    loops = ParametricLoops(solved(read(ROBOTS / f"{name}.toml")))
    functions = list(loops.inner.values())
    return loops, dict(zip(loops.inner, lower(functions, name), strict=True))


def nominal(loops):
    return np.array([float(loops.terms.value(p.value)) for p in loops.geometry.parameters])


def reference(loops):
    """Return w = (q, u): the coordinates q and the unknown joint values u at the reference."""
    at, terms = loops.hybrid.at_reference, loops.terms
    coordinates = loops.mechanism.coordinates
    q = [at[c.moves] / float(terms.value(c.ratio)) for c in coordinates]
    return np.array([*q, *(at[variable.name] for variable in loops.unknown)])
