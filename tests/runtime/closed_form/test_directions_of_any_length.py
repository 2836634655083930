"""``ik_position_direction`` accepts directions of any length, and returns NaN for length 0."""

import numpy as np
import pytest

import chasles
from chasles.closed_form.task_components import Task
from chasles.derive import read_text
from tests.support.generators.drawn_arms import cases_of
from tests.support.oracles.tasks import TASKS

NAME = "ik_position_direction"
POSES = 200
MACHINE = """\
name = "machine"
convention = "poe"
joints = [
  { type = "prismatic", axis = [1, 0, 0] },
  { type = "prismatic", axis = [0, 1, 0] },
  { type = "prismatic", axis = [0, 0, 1] },
  { axis = [0, 0, 1], point = [0, 0, 0] },
  { axis = [0, 1, 0], point = [0, 0, "0.1"] },
]
tool = { xyz = ["0.1", 0, "0.3"] }
"""


def lengthened(target, rng):
    """Return the targets with each direction vector multiplied by a random factor."""
    factors = 10.0 ** rng.uniform(-6, 6, (len(target), 1))
    return np.concatenate([target[:, :3], factors * target[:, 3:]], axis=1)


@pytest.fixture(scope="module")
def arm():
    return chasles.load("lynxmotion")


def test_direction_of_any_length_gives_the_solutions_of_the_unit_vector(arm):
    rng = np.random.default_rng(0)
    T = arm.fk(rng.uniform(-2, 2, (POSES, arm.n)))
    target = TASKS[NAME].target(T)
    longer = lengthened(target, rng)
    expected, found = arm.ik_position_direction(target), arm.ik_position_direction(longer)
    assert expected.valid.any(axis=1).all()
    np.testing.assert_array_equal(found.valid, expected.valid)
    np.testing.assert_allclose(found.q[found.valid], expected.q[expected.valid], atol=1e-10)
    reached = arm.fk(found.q[found.valid])
    wanted = np.repeat(target, found.valid.sum(axis=1), axis=0)
    assert TASKS[NAME].error(reached, wanted).max() < 1e-10
    single = arm.ik_position_direction(longer[3])
    np.testing.assert_array_equal(single.q, found.q[3])


def test_singular_targets_are_refined_with_a_direction_of_any_length(arm):
    q = np.array([0.4, 0.3, 0.0, 0.2, 0.0])
    target = TASKS[NAME].target(arm.fk(q))
    found = arm.ik_position_direction(np.concatenate([target[:3], 7 * target[3:]]))
    assert found.count == arm.ik_position_direction(target).count > 0
    assert TASKS[NAME].error(arm.fk(found.valid_q()), target).max() < 1e-9


def test_zero_and_nan_directions_give_nan_without_solutions(arm):
    target = np.array([[0.1, 0.0, 0.1, 0.0, 0.0, 0.0], [0.1, 0.0, 0.1, np.nan, 0.0, 1.0]])
    for found in (arm.ik_position_direction(target), arm.ik_position_direction(target[0])):
        assert np.isnan(found.q[..., 1]).all()
        assert not found.valid.any()


def test_task_of_direction_does_not_depend_on_its_length():
    rng = np.random.default_rng(1)
    T, J = np.tile(np.eye(4), (POSES, 1, 1)), rng.normal(size=(POSES, 6, 5))
    u = rng.normal(size=(POSES, 3))
    task = Task(("direction",))
    unit = u / np.linalg.norm(u, axis=1, keepdims=True)
    for found, expected in zip(task(T, J, u), task(T, J, unit), strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-12)


def test_machine_tool_takes_a_direction_of_any_length():
    made = read_text(MACHINE)
    (case,) = (case for case in cases_of(made) if case.function == NAME)
    rng = np.random.default_rng(2)
    target = case.targets(rng.uniform(-2, 2, (20, len(made.coordinates))))
    function = case.robot.functions[NAME]
    found, expected = function(lengthened(target, rng)), function(target)
    valid = expected.valid
    assert valid.any(axis=1).all()
    np.testing.assert_array_equal(found.valid, valid)
    apart = np.sin((found.q - expected.q)[valid] / 2)
    assert np.abs(apart).max() < 1e-7
