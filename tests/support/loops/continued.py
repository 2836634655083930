"""Computes configurations with closed loops stepwise, from the reference to given coordinates."""

import numpy as np

from chasles.derive import DescriptionError
from chasles.derive.loops.closing.closed_loops import ClosedLoops
from chasles.derive.model.tolerances import SAMPLED_RANGE

HALVINGS = 12


def closed_configuration(mechanism, q=None):
    """Return the full configuration z, keyed by name, at which all loops close.

    Without the argument q, the function returns the reference configuration. Otherwise, the loops
    are closed stepwise along the straight line from the reference coordinates to q.
    """
    loops = ClosedLoops(mechanism)
    w = loops.closed(loops.reference, loops.passive)
    if q is not None:
        goal = w.copy()
        for c, value in zip(mechanism.coordinates, q, strict=True):
            goal[loops.names.index(c.moves)] = value * loops.bodies.number(c.ratio)
        w = _continued(loops, w, goal)
    return loops.configuration(w)


def _continued(loops, w, goal):
    start, moved = w, ~loops.passive
    done, step = 0.0, 1.0
    while done < 1:
        part = min(done + step, 1.0)
        line = goal if part == 1 else start + part * (goal - start)
        trial = np.where(moved, line, w)
        try:
            reached = loops.closed(trial, loops.passive)
            _check_branch(loops, reached - w, trial - w)
        except DescriptionError as error:
            if part == 1:
                at_goal = error
            step /= 2
            if step < 1 / 2**HALVINGS:
                raise at_goal from error
        else:
            w, done = reached, part
    return w


def _check_branch(loops, moved, asked):
    scales = np.where(loops.is_length, loops.size, 1.0)
    if np.abs(moved / scales).max() > 2 * np.abs(asked / scales).max() + SAMPLED_RANGE:
        raise DescriptionError("the loops change their branch along the path")
