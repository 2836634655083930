"""Numerically compares the inverse kinematics in a LaTeX article with the function ``ik``."""

import itertools

import numpy as np

from chasles.derive.latex import fragments
from chasles.derive.terms.casadi_graph import lower
from tests.support.derivations import every_branch
from tests.support.printed_latex import PrintedInverse

SAME = 1e-9
"""Maximum difference between printed and computed solutions (radian or meter)."""
INSIDE = 1e-3
"""Minimum margin of a solution slot that the test compares."""
POSES = 3


def without_formula(found, texts=None):
    """Return the reason why a printed inverse cannot be evaluated numerically, or an empty text.

    Args:
        found: The derivation.
        texts: The LaTeX article fragments, if they are already derived.
    """
    inverse = found.inverse
    if inverse.general is not None:
        return "no structure: a matrix whose determinant has the solutions as its roots"
    if inverse.written:
        return "refined from the inverse of a nominal arm"
    if "ik" not in inverse.solved:
        return inverse.missing
    printed = PrintedInverse(texts or fragments(found))
    return "" if printed.is_whole else "a quartic, or constants that have no short form"


def read_back(found, poses=POSES, texts=None):
    """Compare computed and printed solutions at reachable poses, and count the equal solution
    slots.

    Args:
        found: The derivation.
        poses: Number of poses.
        texts: The LaTeX article fragments, if they are already derived.
    """
    inverse, robot = found.inverse.solved["ik"], found.robot
    printed = PrintedInverse(texts or fragments(found))
    function = inverse.function
    fk, ik = lower([found.function("fk"), function], "arm")
    others = {f.role.name: f for f in found.inverse.others}
    rng, count = np.random.default_rng(9), 0
    for q in rng.uniform(-1.2, 1.2, (poses, len(robot.coordinates))):
        T = np.array(fk(q)).reshape(4, 4)
        values, given = [], {}
        for argument in function.inputs[1:]:
            if "redundancy" in others:
                value = float(lower([others["redundancy"]], "swivel")[0](q))
                given["\\psi"] = value
            else:
                k = function.role.fixed[len(values)]
                value = float(q[k])
                given[f"q_{{{k + 1}}}"] = value
            values.append(value)
            assert argument.size == 1
        slots, residual, margin = every_branch(function, ik, T.ravel(), *map(np.array, values))
        slots = slots.reshape(-1, len(q))
        for slot, signs in enumerate(itertools.product((1, -1), repeat=len(printed.signs))):
            if margin[slot] < INSIDE or residual[slot] > SAME:
                continue
            known = printed.solve(T, given, signs)
            own = np.array([known.get(f"q_{{{k + 1}}}", 0.0) for k in range(len(q))])
            off = own - slots[slot]
            turns = [coordinate.unit == "rad" for coordinate in robot.coordinates]
            off[turns] = np.angle(np.exp(1j * off[turns]))
            np.testing.assert_allclose(off, 0.0, atol=SAME)
            count += 1
    return count
