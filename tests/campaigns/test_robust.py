"""Reading a mutated robot file gives a robot or a chasles error."""

import random
from itertools import islice

import pytest

from chasles.derive import derive, explain, read_text
from chasles.derive.latex import fragments
from tests.campaigns.robust import attempt, mutants, written
from tests.support.generators.round_arms import round_arm

READ = 20
ARMS = (9,)


def test_mutated_files_are_read_or_rejected(tmp_path):
    texts = islice(mutants(random.Random(11)), READ)
    ends = [attempt(written(tmp_path / "mutant", text), derive=False) for text in texts]
    wrong = [one for one in ends if not one.is_good]
    assert wrong == []
    assert min(sum(one.end == end for one in ends) for end in ("made", "refused")) > READ / 10


@pytest.mark.parametrize("seed", ARMS)
def test_arms_with_round_numbers_are_derived(tmp_path, seed):
    path = tmp_path / "arm.toml"
    path.write_text(round_arm(seed), encoding="utf-8")
    ended = attempt(path, derive=True)
    assert ended.end == "made", ended


ZEROS = """name = "arm"
convention = "urdf"
[[joints]]
xyz = [0, "-0.4", "-0.4"]
axis = [0, 0, 1]
[[joints]]
xyz = ["0.123", "-0.4", "0.3"]
axis = [0, 1, 0]
[[joints]]
xyz = ["0.7", "0.3", "-0.4"]
rpy = ["pi/3", 0, 0]
axis = [0, 1, 0]
"""
"""The tool of this arm is on the last axis, so the tool position does not determine the last joint
angle."""


SLIDES = """name = "arm"
convention = "mdh"
[[joints]]
type = "prismatic"
a = "-0.4"
alpha = "pi"
[[joints]]
type = "prismatic"
alpha = "pi/4"
[[joints]]
alpha = "-pi/4"
"""
"""An arm with two prismatic joints and a revolute joint that does not move the tool point."""


@pytest.mark.parametrize("text", [ZEROS, SLIDES], ids=["zero offsets", "prismatic joints"])
def test_pose_determines_an_angle_that_the_position_does_not(text):
    robot = read_text(text)
    derived = derive(robot)
    assert "zoo" not in fragments(derived)["inverse.tex"]
    names = [function.name for function in derived.functions]
    assert "ik" in names
    assert "ik_position" not in names
    assert "ik(T): at most" in str(explain(robot))


SURDS = """name = "arm"
convention = "hayati5"
[[joints]]
a = "1/2"
alpha = "-3*pi/4"
theta = "-pi/6"
[[joints]]
beta = "-5*pi/6"
d = "2/5"
theta = "pi/2"
"""
"""An arm in which one screw entry is a sum of roots that equals 0 but is not simplified to 0."""


def test_article_prints_unsimplified_zero_expression():
    assert fragments(derive(read_text(SURDS)))["screws.tex"]
