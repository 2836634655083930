"""The examples on the pages about inverse kinematics run, and their comments are true."""

import re

import numpy as np
import pytest

from tests.support.pages import examples, run, text

PAGE = "how-to/inverse.md"


def test_inverse_page_examples_run_as_documented():
    names, seen = {}, []
    for block in examples(PAGE):
        exec(compile(block, PAGE, "exec"), names)
        seen.append(dict(names))
    first, rounded, chosen, far, oriented = seen
    arm, q_now = first["arm"], first["q_now"]
    assert first["solutions"].valid_q().shape == (8, 6)
    np.testing.assert_allclose(first["solutions"].nearest(q_now), q_now, atol=1e-12)
    assert rounded["se3"].deviation(rounded["coarse"]) == pytest.approx(5e-4, rel=0.1)
    assert arm.ik(rounded["se3"].project(rounded["coarse"], tolerance=1e-3)).count == 8
    assert chosen["solutions"].q.shape == (256, 6)
    np.testing.assert_allclose(chosen["solutions"].valid_q()[0], q_now, atol=1e-12)
    assert not arm.ik(far["far"]).valid.any()
    assert far["best"].residual > 0.5
    assert oriented["found"].q.shape == (2, 6)
    np.testing.assert_allclose(oriented["found"].q[0], q_now, atol=1e-9)


def test_one_solution_page_examples_run_as_documented(capsys):
    names = run("how-to/one-solution.md")
    assert names["found"].valid
    np.testing.assert_allclose(names["found"].q, names["q_now"], atol=1e-12)
    assert names["path"].complete
    assert names["path"].q.shape == (500, 6)
    (printed,) = re.findall(r"print\(path\)  # (.*)", text("how-to/one-solution.md"))
    assert capsys.readouterr().out == f"{printed}\n"


def test_redundant_arms_page_examples_run():
    names = run("how-to/redundant-arms.md")
    assert [item.name for item in names["panda"].redundancy] == ["joint7"]


def test_calibrated_arms_page_examples_run():
    assert run("how-to/calibrated-arms.md")["arm"].ik_nearest
