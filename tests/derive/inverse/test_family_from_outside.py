"""Tests a new inverse kinematics family for cylindrical arms that only this file defines.

The test arm has a revolute column, a lift, a boom and a tool joint about the vertical. The new
family precedes the listed families, because a listed family also matches the axes of this arm.
"""

import re
from pathlib import Path

import numpy as np
import pytest
import sympy as sp

import chasles.derive
from chasles.derive import derive, explain, read_text, write
from chasles.derive.inverse.families import FAMILIES, LEG_FAMILIES
from chasles.derive.inverse.families.family import Family
from chasles.derive.inverse.steps.work import Work
from chasles.derive.inverse.structure.requirement import Requirement, across, parallel
from chasles.derive.inverse.subproblems.equations import Direction
from chasles.derive.inverse.subproblems.found import FoundTurn
from chasles.derive.inverse.subproblems.slides import slide_to_plane, slide_to_sphere
from chasles.derive.inverse.subproblems.sp1 import sp1
from chasles.derive.inverse.subproblems.turns import (
    CosSin,
    any_across,
    perpendicular,
    rotated,
)
from chasles.derive.inverse.tasks.partial_poses import (
    POSITION,
    POSITION_ENTRIES,
    partial_pose,
    tool_origin,
)
from chasles.derive.inverse.tasks.slots import squares
from chasles.derive.inverse.tasks.task import InputLetter, Task, TaskInput
from chasles.derive.latex import fragments
from chasles.derive.terms.symbolic_function import Argument, Result, SymbolicFunction
from chasles.derive.terms.vectors import combination, dot, subtracted
from tests.support.compiling import loaded

ARM = read_text("""
name = "cylindrical"
convention = "dh"
units = { length = "m", angle = "deg" }
[[joints]]
name = "column"
d = "0.4"
[[joints]]
name = "lift"
type = "prismatic"
alpha = 90
a = "0.1"
theta = 30
[[joints]]
name = "boom"
type = "prismatic"
alpha = -90
[[joints]]
name = "wrist"
a = "0.15"
d = "-0.1"
""")
TITLE = "a column with a lift and a boom"
YAW = sp.Symbol("_yaw", real=True)


def requires(lines):
    kinds = [axis.turns for axis in lines.axes]
    fits = kinds == [True, False, False, True]
    count = Requirement("joints 2 and 3 slide, the others turn", 0.0 if fits else np.inf)
    return [count, parallel(lines, 0, 1, 3), across(lines, 0, 2)]


def to_position(work, lines, start, wanted):
    """Solve lift, boom and column so that the point ``start`` reaches the position ``wanted``."""
    terms, (column, lift, boom, _) = work.terms, lines.axes
    V, reach = subtracted(terms, wanted, column.p), subtracted(terms, start, column.p)
    height = dot(terms, column.h, V)
    found = slide_to_plane(terms, column.h, lift.h, reach, height)
    work.slide(lift, "line-plane intersection", "no other joint lifts the tool", found)
    A, p = (perpendicular(terms, column.h, v) for v in (V, reach))
    found = slide_to_sphere(terms, boom.h, p, dot(terms, A, A), work.sign())
    length = work.slide(boom, "line-sphere intersection", "the column keeps the reach", found)
    extended = combination(terms, (sp.Integer(1), length), (p, boom.h))
    reason = "the boom points to the tool"
    return work.step([column], "subproblem 1", reason, sp1(terms, column.h, extended, A))


def solve(work, lines, target):
    terms, wrist = work.terms, lines.axes[3]
    wanted = work.name_vector(("H", "K"), "a point of the wrist", target.point(terms, wrist.p))
    q1 = to_position(work, lines, wrist.p, wanted)
    e = any_across(terms, wrist.h)
    left = rotated(terms, lines.axes[0].h, q1.back, target.turned(terms, e))
    work.step([wrist], "subproblem 1", "what is left of the turn", sp1(terms, wrist.h, e, left))


def position_yaw(robot, lines):
    """Build the IK function for a tool position and a wrist angle relative to the boom."""
    terms, work, wrist = lines.terms, Work(lines.terms), lines.axes[3]
    turn = CosSin(*terms.cos_sin(YAW))
    lever = rotated(terms, wrist.h, turn, subtracted(terms, tool_origin(robot, terms), wrist.p))
    start = combination(terms, (sp.Integer(1), sp.Integer(1)), (wrist.p, lever))
    found = FoundTurn(turn, Direction(turn.c, turn.s))
    work.step([wrist], "input", "its angle is asked for", found)
    to_position(work, lines, start, POSITION)
    return partial_pose(
        "ik_position_yaw",
        robot,
        work,
        TaskInput(
            Argument("x", (*POSITION, YAW), (4,), "m, rad", "position of the tool, wrist angle"),
            (*POSITION_ENTRIES, InputLetter((r"\eta",))),
        ),
        lambda pose: terms.let(sp.sqrt(squares(terms, subtracted(terms, pose[1], POSITION)))),
        "fk(q[k]) has its origin in x[:3]",
    )


def functions(robot, lines):
    """Build a kinematics function that computes the wrist height above the base."""
    terms, q = lines.terms, sp.symbols("_h1:5", real=True)
    height = terms.let(lines.axes[3].p[2] + q[1])
    result = Result("height", (height,), (), "m", "height of the lift")
    argument = Argument("q", q, (4,), "rad, m", "joint coordinates")
    return (SymbolicFunction("height", "Height.", "h = q2", (argument,), (result,), terms),)


CYLINDRICAL = Family(
    TITLE,
    (4,),
    requires,
    solve,
    readings=("base",),
    tasks=(Task("ik_position_yaw", position_yaw),),
    functions=functions,
)


@pytest.fixture(scope="module")
def derivation():
    return derive(ARM, families=(CYLINDRICAL, *FAMILIES))


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    folder = tmp_path_factory.mktemp("generated") / ARM.name
    write(ARM, folder, families=(CYLINDRICAL, *FAMILIES))
    return loaded(folder)


def configurations(count=200):
    rng = np.random.default_rng(0)
    return rng.uniform(-1, 1, (count, 4)) * [3.0, 0.3, 0.3, 3.0]


def test_only_the_family_list_imports_family_modules():
    room = Path(chasles.derive.__file__).parent
    names = {path.stem for path in (room / "inverse/families").glob("*.py")}
    names -= {"__init__", "family"}
    assert len(names) == len(LEG_FAMILIES)
    imported = re.compile(rf"(families\.|from \.|import )({'|'.join(names)})\b")
    paths = [*(room / "inverse").rglob("*.py"), *(room / "latex/inverse").rglob("*.py")]
    naming = {path.name for path in paths if imported.search(path.read_text(encoding="utf-8"))}
    assert naming == {"__init__.py"}


def test_first_matching_family_is_selected(derivation):
    assert derivation.inverse.classification.found.family is CYLINDRICAL
    assert derive(ARM).inverse.classification.found.family in FAMILIES


def test_compiled_ik_of_custom_family_recovers_configuration(arm):
    q = configurations()
    found = arm.ik(arm.fk(q))
    assert found.q.shape == (200, 2, 4)
    assert found.valid.all()
    np.testing.assert_allclose(arm.fk(found.q), np.repeat(arm.fk(q)[:, None], 2, 1), atol=1e-10)
    difference = found.q - q[:, None]
    difference[..., [0, 3]] = np.angle(np.exp(1j * difference[..., [0, 3]]))
    assert np.abs(difference).max(axis=-1).min(axis=-1).max() < 1e-9


def test_custom_family_adds_its_task_and_function(arm):
    q = configurations()
    wanted = np.column_stack([arm.fk(q)[:, :3, 3], q[:, 3]])
    found = arm.ik_position_yaw(wanted)
    assert found.valid.all()
    np.testing.assert_allclose(
        arm.fk(found.q)[..., :3, 3], wanted[:, None, :3] + 0 * found.q[..., :3], atol=1e-10
    )
    np.testing.assert_allclose(found.q[..., 3], np.repeat(q[:, 3:], 2, axis=1), atol=1e-12)
    np.testing.assert_allclose(arm.height(q) - arm.height(0 * q), q[:, 1], atol=1e-15)


def test_explanation_contains_text_of_custom_family():
    text = str(explain(ARM, families=(CYLINDRICAL, *FAMILIES)))
    assert f"Structure: {TITLE}." in text
    assert "joints 2 and 3 slide, the others turn: holds" in text
    assert "lift, by line-plane intersection: no other joint lifts the tool." in text
    assert "ik_position_yaw(x): at most 2 solutions" in text


def test_article_contains_text_and_equations_of_custom_family(derivation):
    text = fragments(derivation)["inverse.tex"]
    assert rf"\emph{{{TITLE}}}" in text
    assert "position of the tool, wrist angle" in text
    assert r"q_{4} &= \operatorname{atan2}(\sin \eta, \cos \eta)." in text
    assert "H_{x} &=" in text
    assert "the column keeps the reach. It" in text.replace("\n", " ")
    assert "q_{3}^2" in text


def test_family_with_other_joint_count_is_not_evaluated():
    """The conditions of an inverse family may be valid only for the family's number of joints."""
    seen = []
    other = Family("other", (5,), lambda lines: seen.append(lines) or [], solve)
    derive(ARM, families=(other, CYLINDRICAL))
    assert not seen


@pytest.mark.parametrize("given", [True, False])
def test_family_option_decides_whether_joints_may_be_fixed(given):
    """With a second lift, the test arm has one joint more than the inverse family allows."""
    text = """
name = "two_lifts"
convention = "dh"
units = { length = "m", angle = "deg" }
joints = [
  { type = "prismatic" }, { d = "0.4" }, { type = "prismatic", alpha = 90, a = "0.1", theta = 30 },
  { type = "prismatic", alpha = -90 }, { a = "0.15" },
]
"""
    family = Family(TITLE, (4,), requires, solve, readings=("base",), behind_given=given)
    found = derive(read_text(text), families=(family,)).inverse.classification.found
    assert (found is not None) == given
    assert found is None or found.given == (0,)
