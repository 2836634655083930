"""An arm whose wrist bends at two coupled joints, such as the hollow wrist of a paint robot.

Joints 4 to 7 are revolute, and their axes pass through one point. One motor moves joints 5 and 6 by
equal or opposite angles. If angles 5 and 6 are zero, axes 4 to 7 lie in one plane. The first three
joints position the common point of axes 4 to 7. Joints 5 and 6 set the angle between axes 4 and 7
(``subproblems.coupled_turns``). Joints 4 and 7 produce the remaining tool rotation. The arm has at
most four times as many solutions as its first three joints.
"""

from functools import partial
from itertools import combinations

import numpy as np
import sympy as sp

from ..terms.vectors import cross
from .coupled_chain import CoupledChain
from .families.family import Family
from .steps import three_joints
from .steps.rotations import last_turn, turned_back
from .steps.target import Target
from .steps.work import Work
from .steps.wrist_in_reach import with_angle_to_axis
from .structure.lines import Lines
from .structure.requirement import Requirement, meeting, revolute
from .subproblems.coupled_turns import CoupledPair, coupled_turns
from .subproblems.sp1 import sp1
from .subproblems.turns import rotated

JOINTS = 7
_WRIST = (3, 4, 5, 6)
_ONE, _OTHER = _WRIST[1:3]


def coupled_wrist(chain: CoupledChain) -> tuple[Family, ...]:
    """Return the arm family of a chain with a coupled wrist, or () if the wrist is not coupled."""
    if chain.C.rows != JOINTS or chain.surplus != 1:
        return ()
    for sense in (1, -1):
        apart = chain.C.row(_OTHER) - sense * chain.C.row(_ONE)
        if not any(apart) and chain.c[_OTHER] == sense * chain.c[_ONE]:
            angles = "equal" if sense == 1 else "opposite"
            title = f"three joints and a wrist with {angles} angles 5 and 6"
            solve = partial(_solve, sense)
            return (Family(title, (JOINTS,), _requires, solve, ("base",), has_couplings=True),)
    return ()


def _requires(lines: Lines) -> list[Requirement]:
    return [
        revolute(lines, _WRIST),
        meeting(lines, *_WRIST),
        _in_plane(lines),
        three_joints.requires(_arm(lines)),
    ]


def _in_plane(lines: Lines) -> Requirement:
    axes = [lines.axes[k] for k in _WRIST]
    triples = combinations([axis.direction for axis in axes], 3)
    deviation = max(abs(float(np.linalg.det(np.array(triple)))) for triple in triples)
    *names, last = (axis.name for axis in axes)
    return Requirement(f"axes {', '.join(names)} and {last} lie in one plane", deviation)


def _solve(sense: int, work: Work, lines: Lines, target: Target) -> None:
    terms = work.terms
    a4, a5, a6, a7 = (lines.axes[k] for k in _WRIST)

    # 1 to 3. The wrist joints do not move the wrist center.
    arm = _arm(lines)
    center = lines.meeting(_WRIST[3], _WRIST[2])
    W = work.name_vector(("W", "V"), "the wrist's center", target.point(terms, center))
    case = three_joints.case_of(arm)
    assert case is not None
    case.solve(work, arm, center, W)
    wanted = target.turned(terms, a7.h)
    pair = CoupledPair(a4.h, a5.h, a6.h, a7.h, sense)
    with_angle_to_axis(work, lines, center, W, (wanted, pair.middle(terms)), sp.Integer(1))

    # 4, 5. Joints 5 and 6 set the angle between axes 4 and 7.
    seen = turned_back(work, lines, _WRIST[0], wanted)
    signs = work.sign(), work.sign()
    root, found = coupled_turns(terms, pair, seen, signs)
    reason = f"only these joints change the angle between axes {a4.name} and {a7.name}"
    work.note_length((a5.name, a6.name), "a quadratic equation", reason, root)
    reason = (
        f"opposite angles of {a5.name} produce equal angles between axes {a4.name} and {a7.name}"
    )
    q5 = work.step([a5], "the cosine", reason, found)
    q6 = work.turns[a6.joint] = q5.counted(sense)

    # 6, 7. The remaining rotation.
    bent = rotated(terms, a5.h, q5, rotated(terms, a6.h, q6, a7.h))
    reason = f"this joint produces the remaining rotation of axis {a7.name}"
    degenerate = (
        f"if axis {a7.name} coincides with axis {a4.name}, the angle is arbitrary and set to 0"
    )
    q4 = work.step([a4], "subproblem 1", reason, sp1(terms, a4.h, bent, seen), degenerate)
    e = cross(terms, a7.h, a6.h)
    turned = turned_back(work, lines, _WRIST[0], target.turned(terms, e))
    last_turn(work, a7, e, turned, ((a4, q4), (a5, q5), (a6, q6)))


def _arm(lines: Lines) -> Lines:
    return Lines(lines.terms, lines.axes[:3], lines.tolerance)
