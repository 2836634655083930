"""The printed equations of serial arms in loops hold at closed configurations.

Configurations with closed loops come from Newton's method on a NumPy model.
"""

from functools import cache
from itertools import product

import numpy as np
import pytest
import sympy as sp

from chasles.derive import derive
from chasles.derive.latex.inverse.inverse_of_loops import inverse_of_loops
from chasles.derive.latex.loops.arms_fragment import arms, printed_arms
from chasles.derive.latex.loops.loop_page import LoopPage
from chasles.derive.latex.setting.transforms import matrix
from tests.support.generators.carried_planes import carrying, moved
from tests.support.generators.leg_platforms import LEG_KINDS, drawn_as
from tests.support.loops.closures import Model
from tests.support.loops.legs_of_joints import driven_by_a_leg

SAME = 1e-9
STEP = 0.05
"""Maximum deviation of the actuated coordinates from the reference (radian or meter)."""


@cache
def printed(kind):
    return LoopPage.of(derive(drawn_as(LEG_KINDS[kind], 0), functions=["actuators"]))


def closed(model):
    """Return a configuration near the reference at which the loops close (n_z,)."""
    at = dict(model.mechanism.reference)
    z = np.array([[float(at.get(name, 0)) for name in model.names]])
    z = model.newton(z, model.actuated)
    z[:, model.actuated] += STEP * np.arange(1, len(model.actuated) + 1) / len(model.actuated)
    z = model.newton(z, model.actuated)
    assert model.gap(z).max() < SAME
    return z


def symbols_of(page, arm, poses):
    """Return the pose entries of the end of an arm, keyed by the symbols in the LaTeX article."""
    notation = arm.symbols.equations.notation

    def number(placement):
        return np.array(matrix(placement, notation), dtype=float)

    base = np.eye(4) if arm.own.base == page.mechanism.base_frame else poses[arm.own.base][0]
    T = np.linalg.inv(base @ number(arm.own.begin)) @ poses[arm.own.body][0]
    entries = zip(notation.entries(), (T @ number(arm.own.arm.end)).ravel(), strict=True)
    return {symbol: value for symbol, value in entries if symbol is not None}


def values_of(arm, known):
    """Return the symbol values that result from the printed solution steps of an arm."""
    task = arm.task
    done = dict(known)
    for step in task.steps:
        for symbol, value in step.definitions:
            done[symbol] = float(value.subs(done))
        done[step.name] = float(sum(step.solution).subs(done))
        rest = [(symbol, value) for symbol, value in task.rest if value.free_symbols <= {*done}]
        done |= {symbol: float(value.subs(done)) for symbol, value in rest}
    return done


@pytest.mark.parametrize("kind", ["tripteron", "3-UPU"])
def test_printed_steps_of_an_arm_give_the_joints_of_closed_loops(kind):
    page = printed(kind)
    model = Model(page.mechanism)
    z = closed(model)
    poses, at = model.poses(z), dict(zip(model.names, z[0], strict=True))
    own = [arm for arm in printed_arms(page) if arm.like is None]
    assert own
    for arm in own:
        constants = page.chain.equations.notation.values()
        pose = symbols_of(page, arm, poses) | {s: float(v) for s, v in constants.items()}
        vectors = dict(pose)
        for symbol, value in arm.task.definitions:
            vectors[symbol] = float(value.subs(vectors))
        errors = []
        for signs in product((1, -1), repeat=len(arm.task.signs)):
            found = values_of(arm, vectors | dict(zip(arm.task.signs, signs, strict=True)))
            joints = {joint.name for joint in arm.own.arm.unknown}
            apart = [found[page.joints[name]] - at[name] for name in joints]
            errors.append(np.abs(np.remainder(np.add(apart, np.pi), 2 * np.pi) - np.pi).max())
        assert min(errors) < SAME


def test_legs_of_the_same_shape_share_their_steps():
    solution = "\n\n".join(arms(printed("3-UPU")))
    assert solution.count(r"\textbf{Step 1:") == 1
    assert solution.count("The joints follow as in steps 1 to 5") == 2
    assert r"$q_{3}$ in place of $q_{1}$" in solution
    assert r"The branch of the reference configuration has $\sigma_{1}" in solution


def test_pose_of_an_arm_has_its_own_letters():
    page = printed("tripteron")
    of_tool = {*page.chain.equations.notation.entries()} - {None}
    for arm in printed_arms(page):
        own = {*arm.symbols.equations.notation.entries()} - {None}
        assert own.isdisjoint(of_tool)
        assert not sp.Tuple(*arm.task.steps[0].solution).free_symbols & of_tool


def test_article_states_the_polynomial_of_joints_next_to_a_platform():
    spin = ("turntable", (0, 0, 1), (0, "0.1", 0))
    axis = [((0, 0, 1), ("0.1", "0.05", "0.1"))]
    mechanism = moved(carrying(driven_by_a_leg(), axis), *spin)
    text = inverse_of_loops(LoopPage.of(derive(mechanism, functions=["ik"])))
    assert r"(n_i, -d_i)\, B^{-1}\, T\, W^{-1}\, (b_i, 1)" in text
    assert r"$\det M = 0$ is a trigonometric polynomial of degree 3 in $\theta_{1}$" in text
    assert r"\paragraph{Joints of the platform.}" in text
