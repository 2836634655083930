"""Texts that nobody chose end in a robot or in an error of chasles, within their time."""

import random

import pytest

from chasles.derive import artifacts, explain, loads
from tests.campaigns.robust import attempt, sources, wounded
from tests.support.derivations import ROBOTS as SHIPPED
from tests.support.generators.round_arms import round_arm

READ = 400
ARMS = 12
URDF = """<robot name="arm">
  <link name="base"/><link name="one"/><link name="two"/><link name="tool"/>
  <joint name="turn" type="revolute">
    <parent link="base"/><child link="one"/>
    <origin xyz="0.1 0 0.08920113858084797" rpy="0 1.5707963267948966 0.2"/>
    <axis xyz="0.57735026918962 0.57735026918963 0.577350269189626"/>
    <limit lower="-3.14159" upper="3.14159"/>
  </joint>
  <joint name="slide" type="prismatic">
    <parent link="one"/><child link="two"/>
    <origin xyz="-0.4251460319702735 0 0.2" rpy="3.1351985141209435 0 0.0000942"/>
    <axis xyz="0 1 0"/><limit lower="0" upper="0.5"/>
  </joint>
  <joint name="flange" type="fixed">
    <parent link="two"/><child link="tool"/><origin xyz="0 0 0.1" rpy="0 0 0"/>
  </joint>
</robot>
"""


def test_mutated_files_are_read_or_refused(tmp_path):
    texts = wounded([*sources(SHIPPED), *[(".urdf", URDF)] * 5], random.Random(11))
    ends = []
    for _ in range(READ):
        suffix, text = next(texts)
        path = tmp_path / f"wounded{suffix}"
        path.write_text(text, encoding="utf-8")
        ends.append(attempt(path, derive=False))
    wrong = [one for one in ends if one.end not in ("made", "refused")]
    assert wrong == []
    assert min(sum(one.end == end for one in ends) for end in ("made", "refused")) > READ / 10


@pytest.mark.parametrize("seed", range(ARMS))
def test_arms_of_round_numbers_are_derived(tmp_path, seed):
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
"""The tool on the last axis, which does not move it: no position determines the angle."""


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
"""Slides along one line, and a turn that none of them sees."""


@pytest.mark.parametrize("text", [ZEROS, SLIDES])
def test_an_angle_that_no_equation_determines(text):
    robot = loads(text)
    article = artifacts(robot)["latex/inverse.tex"]
    assert "the tool moves in fewer directions" in str(explain(robot))
    assert "zoo" not in article
    assert "There is no closed form" in article


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
"""An entry of a screw is 0, a sum of roots that does not say so."""


def test_a_zero_that_does_not_look_like_one_is_printed():
    assert artifacts(loads(SURDS))["latex/screws.tex"]
