"""Every output that depends on a NaN input is NaN."""

import numpy as np
import pytest

import chasles
from chasles.derive.program.operations import Input, Operation
from tests.support.derivations import FULL, derivation, made

CHOOSING = {Operation.SELECT, Operation.MIN, Operation.MAX}


def inputs_behind(program):
    """Return the input entries on which each output entry depends."""
    behind, entries = {}, {}
    for statement in program.statements:
        found = set()
        for operand in statement.operands:
            found |= {operand} if isinstance(operand, Input) else behind.get(operand, set())
        if hasattr(statement, "result"):
            behind[statement.result] = found
        else:
            entries[statement.output, statement.entry] = found
    return entries


def arguments(robot, function, rng):
    """Return random arguments of a function, within 0.01 of their reference values.

    Arguments without a reference value are within 0.01 of 0.4.
    """
    reference = getattr(robot, "reference", None)
    known = {}
    if reference is not None:
        known = {"q": np.array(reference.q), "z": np.array(reference.z)}
        known["theta"] = np.array(robot.chain(known["q"])) if "chain" in robot.functions else None
    given = []
    for argument in function.inputs:
        value = known.get(argument.name)
        near = rng.uniform(-0.01, 0.01, argument.size)
        given.append(near + (np.ravel(value) if value is not None else 0.4))
    return given


@pytest.mark.parametrize("name", FULL)
def test_nan_reaches_every_entry_that_is_computed_from_it(name):
    robot, rng, checked = chasles.load(name), np.random.default_rng(2), 0
    for function in derivation(name).functions:
        program = made(name).whole[function.name]
        if any(program.has(operation) for operation in CHOOSING):
            continue
        given, entries = arguments(robot, function, rng), inputs_behind(program)
        # In each row, one input entry is NaN.
        rows = list(program.inputs)
        if not rows:
            continue
        wrong = [np.tile(value, (len(rows), 1)) for value in given]
        for row, entry in enumerate(rows):
            is_given = entry.argument < len(given)
            wrong[entry.argument if is_given else 0][row, entry.entry if is_given else 0] = np.nan
        shaped = [
            w.reshape(len(rows), *a.shape) for w, a in zip(wrong, function.inputs, strict=True)
        ]
        result = robot.functions[function.name](*shaped)
        results = result if isinstance(result, tuple) else (result,)
        outputs = [np.isnan(r).reshape(len(rows), -1) for r in results]
        for (output, k), behind in entries.items():
            for row, entry in enumerate(rows):
                if entry in behind:
                    assert outputs[output][row, k], (function.name, entry, output, k)
                    checked += 1
    assert checked > 20
