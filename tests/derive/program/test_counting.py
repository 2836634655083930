"""Operation counts of programs by kind."""

from chasles.derive.program.counting import count_operations
from chasles.derive.program.operations import Compute, Input, Operation, Program, Store, Variable


def test_operations_are_counted_by_kind():
    x = Input(0, 0)
    taken = (
        *(Operation.ADD, Operation.SUBTRACT, Operation.MULTIPLY, Operation.SQUARE),
        *(Operation.NEGATE, Operation.SIN, Operation.ATAN2, Operation.SQRT, Operation.SELECT),
    )
    computed = [Compute(Variable(k), operation, (x,)) for k, operation in enumerate(taken)]
    program = Program("f", ("x",), ("y",), (x,), (*computed, Store(0, 0, Variable(0))))
    assert count_operations(program).as_dict() == {
        "multiply": 2,
        "add": 2,
        "negate": 1,
        "trig": 2,
        "other": 2,
        "total": 9,
    }
