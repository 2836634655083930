"""Error messages with hints for function names and keywords of other libraries."""

import inspect
import pickle
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

import chasles
from chasles.call import hints

TABLES = tomllib.loads((Path(hints.__file__).parent / "hints.toml").read_text(encoding="utf-8"))
ROWS = [(name, row) for row in TABLES["robot"] for name in row["names"]]
Q = np.array([0.3, -1.2, 1.5, -0.4, 0.9, 0.2])


@pytest.fixture(scope="module")
def robot():
    return chasles.load("ur5e")


@pytest.mark.parametrize(("name", "row"), ROWS, ids=[name for name, _ in ROWS])
def test_attribute_of_another_library_names_the_own_one(robot, name, row):
    library = f" ({row['library']})" if "library" in row else ""
    with pytest.raises(AttributeError) as caught:
        getattr(robot, name)
    assert str(caught.value) == f"'ur5e' has no {name!r}{library}; {row['hint']}"
    assert not hasattr(robot, name)
    assert name not in dir(robot)


def test_hints_name_attributes_that_exist(robot):
    words = {"n", "dof", "lower", "upper"}
    for row in TABLES["robot"]:
        called = set(re.findall(r"(?<![\w.])(\w+)\(", row["hint"]))
        used = re.findall(r"\buse (\w+)(?![\w.])", row["hint"])
        for name in (*called, *used):
            assert hasattr(robot, name), name
        words -= {*used}
    assert not words


@pytest.mark.parametrize("name", [name for row in TABLES["module"] for name in row["names"]])
def test_module_names_its_own_functions(name):
    (row,) = (row for row in TABLES["module"] if name in row["names"])
    with pytest.raises(AttributeError, match=f"^chasles has no '{name}'.*{re.escape(row['hint'])}"):
        getattr(chasles, name)


@pytest.mark.parametrize(("keyword", "own"), TABLES["keywords"].items())
def test_keyword_of_another_library_names_the_own_one(robot, keyword, own):
    T = robot.fk(Q)
    with pytest.raises(chasles.InputTypeError) as caught:
        robot.ik_numeric(T, **{keyword: 1})
    message = f"ur5e.ik_numeric: unknown argument {keyword!r}; pass {own}=; it takes T, q_seed, "
    assert str(caught.value).startswith(message)
    with pytest.raises(chasles.InputTypeError, match=f"ur5e.ik: unknown argument '{keyword}'"):
        robot.ik(T, **{keyword: 1})
    with pytest.raises(chasles.InputTypeError, match=f"ur5e.ik_nearest: unknown .*'{keyword}'"):
        robot.ik_nearest(T, Q, **{keyword: 1})


def test_unknown_names_have_no_hint(robot):
    with pytest.raises(AttributeError, match="has no attribute 'flange'"):
        _ = robot.flange
    with pytest.raises(AttributeError, match=r"^chasles has no 'flange'$"):
        _ = chasles.flange


def test_robot_of_a_name_refers_to_load():
    with pytest.raises(chasles.InputTypeError, match=r"call chasles\.load\("):
        chasles.Robot("ur5e")


def test_methods_with_hints_keep_signature_and_pickle(robot):
    assert "q_seed" in inspect.signature(robot.ik_numeric).parameters
    again = pickle.loads(pickle.dumps(robot.ik_numeric))
    T = robot.fk(Q)
    np.testing.assert_array_equal(again(T, Q).q, robot.ik_numeric(T, Q).q)
