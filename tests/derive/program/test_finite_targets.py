"""An inverse kinematics function rejects NaN even if a NaN input cancels from its residual."""

import numpy as np
import pytest

from chasles.derive import read, read_text
from chasles.derive.program.operations import Compute, Input, Operation, Program, Store, Variable
from chasles.derive.program.programs import with_input_check
from chasles.derive.program.reading import programs as read_programs
from chasles.derive.terms.casadi_graph import lower
from tests.support.compiling import compiled
from tests.support.derivations import ROBOTS, derivation

GANTRY = """name = "gantry"
convention = "dh"
joints = [
  { name = "x", type = "prismatic", alpha = "pi/2", theta = "pi/2" },
  { name = "y", type = "prismatic", alpha = "pi/2", theta = "pi/2" },
  { name = "z", type = "prismatic" },
]
"""
X, Y = Input(0, 0), Input(0, 1)
A = Variable(1)


def test_program_is_unchanged_if_residual_depends_on_all_inputs():
    statements = (Compute(A, Operation.ADD, (X, Y)), Store(0, 0, A), Store(1, 0, A), Store(2, 0, X))
    program = Program("ik", ("T",), ("q", "residual", "margin"), (X, Y), statements)
    assert with_input_check(program) is program


def test_input_missing_from_the_residual_is_added():
    statements = (Compute(A, Operation.ADD, (X, Y)), Store(0, 0, A), Store(1, 0, X), Store(2, 0, X))
    program = with_input_check(Program("ik", ("T",), ("q", "r", "m"), (X, Y), statements))
    assert [s.operation for s in program.computed] == [
        Operation.ADD,
        Operation.ABS,
        Operation.LESS_EQUAL,
        Operation.SELECT,
    ]
    (residual,) = (s.value for s in program.stored if s.output == 1)
    assert residual == program.computed[-1].result


@pytest.mark.parametrize(
    ("name", "inverse"), [("bricklaying_gantry", "ik"), ("gantry", "ik_position")]
)
def test_nonfinite_targets_are_not_valid(name, inverse, tmp_path):
    shipped = name == "bricklaying_gantry"
    robot = read(ROBOTS / f"{name}.toml") if shipped else read_text(GANTRY, file="gantry.toml")
    arm = compiled(robot, tmp_path, ["fk", inverse], ["c"])
    function = arm.functions[inverse]
    rng = np.random.default_rng(4)
    T = arm.fk(rng.uniform(0.1, 1, arm.n))
    target = T if function is arm.functions.get("ik") else T[:3, 3]
    assert function(target).valid.any()
    positions = [(i, 3) for i in range(3)] if target.ndim == 2 else [(i,) for i in range(3)]
    for entry in positions:
        for wrong in (np.nan, np.inf, -np.inf):
            other = target.copy()
            other[entry] = wrong
            assert not function(other).valid.any()
            both = function(np.stack([other, target])).valid
            assert not both[0].any()
            assert both[1].any()


def test_shipped_arm_inverses_already_depend_on_all_inputs():
    for name in ("ur5e", "lynxmotion", "iiwa14"):
        found = [f for f in derivation(name).functions if f.role.name == "inverse"]
        assert found
        for program in read_programs(lower(found, name)):
            assert with_input_check(program) is program
