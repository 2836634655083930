"""The LaTeX article of an arm with coupled joints prints the IK function for joints and motors."""

import re

import pytest

from chasles.derive import derive, read_text
from chasles.derive.latex import fragments
from tests.support.palletizer import PALLETIZER
from tests.support.read_back import read_back

BASE_ELBOW = """
name = "base_elbow"
convention = "mdh"
units = { length = "mm", angle = "deg" }
joints = [
  { name = "j1", d = 1140 },
  { name = "j2", alpha = 90, a = 460, theta = 90 },
  { name = "j3", a = 1050, theta = 90 },
  { name = "j4", alpha = 90, a = 250, d = 1205, theta = 180 },
  { name = "j5", alpha = 90, theta = 180 },
  { name = "j6", alpha = 90, d = 200 },
]
[couplings]
j3 = { j3 = 1, j2 = -1 }
"""
FOLLOWER = """
name = "follower"
convention = "urdf"
tool = { xyz = ["0.09", 0, 0] }
joints = [
  { name = "j1", xyz = [0, 0, "0.4"], axis = [0, 0, 1] },
  { name = "j2", xyz = ["0.1", 0, 0], axis = [0, 1, 0] },
  { name = "bar", xyz = [0, 0, "0.6"], axis = [0, 1, 0] },
  { name = "j3", xyz = ["0.08", 0, "0.05"], axis = [0, 1, 0] },
  { name = "j4", xyz = ["0.5", 0, 0], axis = [1, 0, 0] },
  { name = "j5", axis = [0, 1, 0] },
  { name = "j6", axis = [1, 0, 0] },
]
[couplings]
bar = { j2 = -1 }
"""
ARMS = {"base_elbow": BASE_ELBOW, "palletizer": PALLETIZER, "follower": FOLLOWER}


@pytest.fixture(scope="module", params=ARMS)
def article(request):
    """Return the name, the derivation and the LaTeX fragments of a coupled arm."""
    found = derive(read_text(ARMS[request.param]), functions=["fk", "ik"])
    return request.param, found, fragments(found)


def test_printed_steps_and_coordinates_reproduce_ik(article):
    name, found, texts = article
    opening, structure, steps = texts["inverse.tex"].partition("The structure is")
    if name == "follower":
        texts = texts | {"symbols.tex": opening.partition("Here ")[2]}
    position = r"\\paragraph\{\\texttt\{ik\\_position.*?(?=The residual of)"
    steps = re.sub(position, "", steps, flags=re.DOTALL)
    assert read_back(found, 10, texts | {"inverse.tex": structure + steps}) > 10


def test_printed_inverse_ends_with_its_coordinates(article):
    name, _, texts = article
    joint = r"\\varphi" if name == "follower" else r"\\theta"
    assert re.search(
        r"The coordinates of each solution are(?s:.*)"
        rf"q_\{{3\}} &= {joint}_\{{2\}} \+ {joint}_\{{3\}}",
        texts["inverse.tex"],
    )
    for words in ("also satisfies the couplings", "the couplings keep the orientation of the tool"):
        assert (words in texts["inverse.tex"]) == (name == "palletizer")


def test_merged_joints_have_their_own_letters(article):
    name, _, texts = article
    merged = r"\varphi_{3} &= q_{3} - q_{2}" in texts["inverse.tex"]
    assert merged == (name == "follower")
    if merged:
        assert r"Here $\varphi_i$ stands for the coordinate" in texts["inverse.tex"]
        assert not re.search(r"\\theta_|c_\{\d|t_\{\d", texts["inverse.tex"])
        assert "C_{3} S_{5}" in texts["singularities.tex"]
