"""C exports of selected functions."""

import numpy as np

import chasles
from tests.support.command_line import run
from tests.support.compiling import loaded


def test_inverse_without_its_swivel_function_has_no_nearest_solution(tmp_path):
    done = run("export", "c", "iiwa14", "--functions", "fk,ik", "--to", tmp_path)
    assert done.exit_code == 0, done.output
    header = (tmp_path / "iiwa14" / "iiwa14.h").read_text(encoding="utf-8")
    assert "void iiwa14_ik(" in header
    assert "ik_nearest" not in header
    own, robot = loaded(tmp_path / "iiwa14"), chasles.load("iiwa14")
    assert list(own.functions) == ["fk", "ik"]
    q, swivel = robot.random_q(100), np.linspace(-3, 3, 100)
    T = robot.fk(q)
    found, expected = (arm.ik(T, fixed={"swivel": swivel}) for arm in (own, robot))
    np.testing.assert_array_equal(found.valid, expected.valid)
    assert expected.valid.sum() >= 200
    np.testing.assert_allclose(found.q, expected.q, atol=1e-9)
