"""The LaTeX of inverses, read back from its text alone and evaluated, is the generated inverse."""

import itertools

import numpy as np
import pytest
from derivations import ROBOTS, every_branch
from printed_latex import Formula, PrintedInverse

from bench.cases.synthetic import robot_of
from chasles.derive import derive, load
from chasles.derive.latex import fragments
from chasles.derive.terms.casadi_graph import lower

SAME = 1e-9
"""Radian or metre: printed formulas lose digits near the boundary."""
INSIDE = 1e-3
"""Margin from which slots are compared."""
SHIPPED = ("ur5e", "puma560", "iiwa14", "stanford", "lynxmotion")
CHAINS = ("R=R/R/RxrxR", "R/RLP/RxrxR", "R/R=R=R/RxR")
"""Arms at random with a structure and right angles, so that no constant is printed in decimals."""
POSES = 3


def read_back(robot):
    """How many slots agree with ``ik``; None where the text has no formula for every step."""
    found = derive(robot, ["fk", "ik"])
    inverse = found.inverse.solved.get("ik")
    if inverse is None or found.inverse.written:
        return None
    printed = PrintedInverse(fragments(found))
    if not printed.is_whole or printed.letters is None:
        return None
    function = inverse.function
    fk, ik = lower([found.function("fk"), function], "arm")
    others = {f.role.name: f for f in found.inverse.others}
    rng, count = np.random.default_rng(9), 0
    for q in rng.uniform(-1.2, 1.2, (POSES, len(robot.moving))):
        T = np.array(fk(q)).reshape(4, 4)
        values, given = [], {}
        for argument in function.inputs[1:]:
            if "redundancy" in others:
                value = float(lower([others["redundancy"]], "swivel")[0](q))
                given["\\psi"] = value
            else:
                k = function.role.given[len(values)]
                value = float(q[k])
                given[f"q_{{{k + 1}}}"] = value
            values.append(value)
            assert argument.size == 1
        slots, _, margin = every_branch(function, ik, T.ravel(), *map(np.array, values))
        slots = slots.reshape(-1, len(q))
        for slot, signs in enumerate(itertools.product((1, -1), repeat=len(printed.signs))):
            if margin[slot] < INSIDE:
                continue
            known = printed.solve(T, given, signs)
            own = np.array([known.get(f"q_{{{k + 1}}}", 0.0) for k in range(len(q))])
            off = own - slots[slot]
            turns = [joint.kind == "revolute" for joint in robot.moving]
            off[turns] = np.angle(np.exp(1j * off[turns]))
            np.testing.assert_allclose(off, 0.0, atol=SAME)
            count += 1
    return count


@pytest.mark.parametrize("name", SHIPPED)
def test_the_text_of_shipped_arms_is_their_inverse(name):
    assert read_back(load(ROBOTS / f"{name}.toml")) >= POSES


@pytest.mark.parametrize("chain", CHAINS)
def test_the_text_of_drawn_arms_is_their_inverse(chain):
    assert read_back(robot_of(chain, right=True)) >= POSES


def test_a_reader_sees_a_wrong_sign():
    assert Formula(r"a_{2} c_{1} - 2 (b + 1)^{2}", {"a_{2}": 3, "c_{1}": 2, "b": 1}).value() == -2
    arm = load(ROBOTS / "puma560.toml")
    found = fragments(derive(arm))
    text = found["inverse.tex"]
    wrong = text.replace(r"t_{18} t_{20} - t_{17}", r"t_{18} t_{20} + t_{17}")
    assert wrong != text
    T = np.eye(4)
    T[:3, 3] = 0.4, 0.3, 0.5
    one, other = (
        PrintedInverse(found | {"inverse.tex": shown}).solve(T, {}, (1, 1, 1))
        for shown in (text, wrong)
    )
    assert abs(one["q_{2}"] - other["q_{2}"]) > 0.1
