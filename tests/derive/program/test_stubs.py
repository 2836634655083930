"""The type stubs in the Python package of a robot."""

import ast

import pytest

from chasles.derive import derive, read
from chasles.derive.emit import python_package
from tests.support.derivations import description


@pytest.mark.parametrize("name", ["scara", "iiwa14"])
def test_stub_of_ik_takes_fixed_joints(name):
    derived = derive(read(description(name)), functions=["fk", "ik"])
    text = python_package.files(derived, None)["__init__.pyi"]
    found = {item.name: item for item in ast.parse(text).body if isinstance(item, ast.FunctionDef)}
    inverse, pose = found["ik"].args, found["fk"].args
    assert [argument.arg for argument in inverse.kwonlyargs] == ["fixed", "out", "threads"]
    assert [argument.arg for argument in pose.kwonlyargs] == ["out", "threads"]
    assert [argument.arg for argument in inverse.args] == ["T"]
    assert "from collections.abc import Mapping" in text
