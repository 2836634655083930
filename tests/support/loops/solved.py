"""Solves the kinematic loops of a mechanism."""

from chasles.derive.loops.closing.loop_model import loop_model
from chasles.derive.loops.solve.solution import from_actuators, sorted_loops
from chasles.derive.loops.solve.solved_loops import solved_loops


def solved(mechanism):
    return solved_loops(loop_model(mechanism))


def forward(mechanism):
    """Solve the loops for given actuator coordinates.

    Some joint values may remain unsolved.
    """
    model = loop_model(mechanism)
    return from_actuators(sorted_loops(model.mechanism), model.terms, model.q)
