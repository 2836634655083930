"""Metadata, help texts and signatures of the functions of a loaded robot."""

import inspect

import pytest


def test_function_metadata_is_complete_and_immutable(robot):
    function = robot.blend
    assert function.__name__ == "blend"
    assert function.__qualname__ == "tiny.blend"
    assert [item.shape for item in function.inputs] == [(2,), (2, 3)]
    assert function.outputs[0].name == "y"
    assert function.operations["total"] == 8
    assert repr(function) == "<chasles function tiny.blend(q, A, *, out=None, threads=1)>"
    assert "q: (..., 2) [rad] The q." in function.__doc__
    assert function.__doc__.startswith("Blends.\n\nIs what it is.\n")
    with pytest.raises((AttributeError, TypeError)):
        function.operations["total"] = 0
    with pytest.raises(AttributeError):
        function.ufunc = None


def test_help_and_signature_list_arguments(robot, capsys):
    assert str(inspect.signature(robot.blend)) == "(q, A, *, out=None, threads=1)"
    help(robot.blend)
    assert "A: (..., 2, 3) [1] The A." in capsys.readouterr().out
