"""Public functions reject arguments that are not a robot, motion or trajectory."""

import inspect
import re
from importlib import import_module
from importlib.util import find_spec

import numpy as np
import pytest

import chasles
from chasles import InputError, InputTypeError, ShapeError, derive
from chasles.study.motion import MotionSequence, concatenate, limit_violations, time_optimal

MODULES = ("calibration", "drawing", "study", "study.motion", "study.planning", "view")
OPTIONAL = {"for_jax": "jax", "for_torch": "torch", "Kernels": "cuda"}
INTERNAL = {"ConfigurationSpace", "DifferentiableArm", "Skeleton"}
"""Classes that only store a robot and do not check it."""


def functions_of_robots():
    """List the public functions and classes whose first argument is a robot."""
    names = [(chasles, name) for name in chasles.__all__]
    for short in (*MODULES, "autodiff", "cuda"):
        module = import_module(f"chasles.{short}")
        names += [(module, name) for name in module.__all__]
    found = {}
    for module, name in names:
        value = getattr(module, name)
        if name in INTERNAL or not (inspect.isfunction(value) or inspect.isclass(value)):
            continue
        start = getattr(value, "__init__", value) if inspect.isclass(value) else value
        parameters = getattr(start, "__annotations__", {})
        if next(iter(parameters.items()), None) == ("robot", "Robot"):
            found[name] = value
    return found


FUNCTIONS = functions_of_robots()


def test_functions_of_robots_are_found():
    assert {"draw", "workspace", "Motion", "identify", "write_html", "reach"} <= set(FUNCTIONS)


@pytest.mark.parametrize("wrong", [None, 3, "ur5e", [1.0], np.zeros((2, 2))], ids=repr)
@pytest.mark.parametrize("name", sorted(FUNCTIONS))
def test_argument_that_is_no_robot_is_named(name, wrong):
    if find_spec(OPTIONAL.get(name, "chasles")) is None:
        pytest.skip(f"{OPTIONAL[name]} is not installed")
    parameters = list(inspect.signature(FUNCTIONS[name]).parameters.values())[1:]
    needed = [own for own in parameters if own.default is own.empty]
    others = {own.name: 1.0 for own in needed if own.kind is not own.VAR_KEYWORD}
    with pytest.raises(InputTypeError, match=rf"^{name}: robot: expected a Robot, got ") as caught:
        FUNCTIONS[name](wrong, **others)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("wrong", [None, 3, "fast", np.zeros(6)], ids=repr)
def test_argument_that_is_no_motion_or_trajectory_is_named(wrong):
    arm = chasles.load("ur5e")
    with pytest.raises(InputTypeError, match=r"^time_optimal: motion: expected a Motion, got "):
        time_optimal(wrong, rate_limits=1, acceleration_limits=1)
    with pytest.raises(
        InputTypeError, match=r"^limit_violations: trajectory: expected a Trajectory"
    ):
        limit_violations(arm, wrong)
    with pytest.raises(InputTypeError, match=r"^concatenate: trajectories(\[0\])?: expected a "):
        concatenate(wrong)
    with pytest.raises(InputTypeError, match=re.escape("concatenate: trajectories[0]: expected a")):
        concatenate([wrong])


def test_trajectory_of_another_robot_has_the_wrong_shape():
    arm, planar = chasles.load("ur5e"), chasles.load("scara")
    q = planar.q_reference
    other = MotionSequence(planar, q).move(q + 0.01, "quintic", duration=1).sample(4)
    with pytest.raises(ShapeError, match=r"expected 6 coordinates of ur5e, got shape \(5, 4\)"):
        limit_violations(arm, other)


@pytest.mark.parametrize("wrong", [None, 3, "ur5e", np.zeros((2, 2))], ids=repr)
def test_argument_that_is_no_description_is_named(wrong):
    functions = {
        "description": (
            derive.derive,
            derive.explain,
            derive.files,
            derive.model_report,
            derive.product_of_exponentials,
            lambda robot: derive.write(robot, "folder"),
        ),
        "robot": (
            derive.springs_at_rest,
            derive.with_suitable_conventions,
            lambda robot: derive.convert(robot, "toml"),
            lambda robot: derive.expressions(robot, "fk"),
        ),
        "mechanism": (derive.mobility,),
    }
    for name, calls in functions.items():
        for call in calls:
            with pytest.raises(InputTypeError, match=rf"^\w+: {name}: expected a .*, got "):
                call(wrong)


@pytest.mark.parametrize("wrong", [None, 3, np.zeros((2, 2))], ids=repr)
def test_argument_of_casadi_function_that_is_no_description_is_named(wrong):
    with pytest.raises(InputTypeError, match=r"^casadi_function: robot: expected a .*, got "):
        derive.casadi_function(wrong, "fk")


@pytest.mark.parametrize("wrong", [None, "x", [1, 2], np.zeros(3), 1j], ids=repr)
def test_tolerance_that_is_no_number_is_named(wrong):
    with pytest.raises(InputError, match=r"^se3\.project: tolerance must "):
        chasles.se3.project(np.eye(4), wrong)


@pytest.mark.parametrize("wrong", [3, [], np.zeros(3), np.zeros((2, 4)), np.zeros((2, 2, 3))])
def test_path_of_the_wrong_shape_is_named(wrong):
    platform = chasles.load("planar_3rrr")
    with pytest.raises(ShapeError, match=r"solve_loops_along: expected q \(k, 3\), got \("):
        platform.solve_loops_along(wrong)
