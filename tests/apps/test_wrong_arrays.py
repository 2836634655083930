"""Arguments that are not real numbers raise an error that names the argument."""

import numpy as np
import pytest

import chasles
from chasles import InputError, InputTypeError, InputValueError, calibration, se3
from chasles.study import motion, planning, reach, workspace

ARM = chasles.load("ur5e")
Q = ARM.q_reference
T = ARM.fk(Q)
PLATFORM, LINKAGE = chasles.load("stewart_gough"), chasles.load("four_bar")

WRONG = {
    "complex": lambda shape: np.zeros(shape, dtype=complex),
    "text": lambda shape: np.full(shape, "a"),
    "none": lambda shape: np.full(shape, None),
    "ragged": lambda _: [[1, 2], [3]],
    "mapping": lambda _: {"a": 1},
}
CALLS = {
    "ur5e.ik_path: T": ((3, 4, 4), lambda x: ARM.ik_path(x, Q)),
    "ur5e.ik_path: q_seed": ((6,), lambda x: ARM.ik_path(T[None], x)),
    "stewart_gough.solve_loops: q": ((6,), PLATFORM.solve_loops),
    "stewart_gough.solve_loops_along: q": ((2, 6), PLATFORM.solve_loops_along),
    "four_bar.chain_closes: theta": ((3,), LINKAGE.chain_closes),
    "se3.interpolate: s": ((3,), lambda x: se3.interpolate(T, T, x)),
    "samples": ((), lambda x: workspace(ARM, x, progress=False)),
    "workspace: resolution": ((), lambda x: workspace(ARM, 100, resolution=x, progress=False)),
    "targets": ((6,), lambda x: reach(ARM, x)),
    "joint_line: q_end": ((6,), lambda x: motion.joint_line(Q, x)),
    "line: T_end": ((4, 4), lambda x: motion.line(T, x)),
    "MotionSequence: q_start": ((6,), lambda x: motion.MotionSequence(ARM, x)),
    "draw: q": ((6,), lambda x: chasles.draw(ARM, x)),
    "draw: ghosts": ((2, 6), lambda x: chasles.draw(ARM, Q, ghosts=x)),
    "draw: path": ((2, 6), lambda x: chasles.draw(ARM, Q, path=x)),
    "animate: trajectory": ((2, 6), lambda x: chasles.animate(ARM, x, "a.gif")),
    "Positions: points": ((8, 1, 3), calibration.Positions),
    "Poses: T": ((8, 4, 4), calibration.Poses),
    "optimal_design: candidates": ((9, 6), lambda x: calibration.optimal_design(ARM, x, 4)),
}
OBSTACLES = {
    "sphere: center": ((3,), lambda x: planning.sphere(x, 0.1)),
    "sphere: radius": ((), lambda x: planning.sphere([0, 0, 0], x)),
    "box: size": ((3,), lambda x: planning.box(np.eye(4), x)),
}
NAMES = {"line: T_end": "line: ", "MotionSequence: q_start": "MotionSequence"}


@pytest.mark.parametrize("kind", WRONG)
@pytest.mark.parametrize("name", CALLS)
def test_argument_without_real_numbers_is_refused(name, kind):
    shape, call = CALLS[name]
    with pytest.raises(InputTypeError, match=NAMES.get(name, name)):
        call(WRONG[kind](shape))


@pytest.mark.parametrize("kind", WRONG)
@pytest.mark.parametrize("name", OBSTACLES)
def test_obstacle_without_real_numbers_is_refused(name, kind):
    pytest.importorskip("coal")
    shape, call = OBSTACLES[name]
    with pytest.raises(InputTypeError, match=name):
        call(WRONG[kind](shape))


@pytest.mark.parametrize("name", ["draw: q", "draw: ghosts", "draw: path", "animate: trajectory"])
def test_drawing_refuses_nan(name):
    shape, call = CALLS[name]
    with pytest.raises(InputValueError, match=f"{name}: expected finite numbers"):
        call(np.full(shape, np.nan))


@pytest.mark.parametrize("name", sorted(CALLS.keys() - {"se3.interpolate: s"}))
def test_wrong_shape_is_refused(name):
    shape, call = CALLS[name]
    with pytest.raises(InputError):
        call(np.zeros((*shape, 2, 5)))
