r"""Prints the rotations of a platform that carries a wrist, and the joints at each rotation."""

from collections.abc import Iterable

from ...inverse.mechanisms.carried_wrist import ROTATIONS, CarriedWrist, carried_wrist
from ...inverse.steps.work import Work
from ...inverse.structure.words import listed as in_words
from ...inverse.tasks.slots import POSE_SYMBOLS
from ..loops.arms_fragment import arm_inverses, arm_page
from ..loops.loop_page import LoopPage
from ..setting.layout import aligned
from ..setting.names import escape
from ..setting.page import sentence
from .inverse_fragment import arm_steps, method

DIGITS = 6
"""Number of printed digits of the planes and of the ball joints."""


def carried(page: LoopPage) -> list[str]:
    """Prints the rotations of the platform, the steps of its joints and the steps of the wrist."""
    wrist = carried_wrist(page.hybrid)
    assert wrist is not None
    names = [escape(joint.name) for joint in wrist.wrist.moving]
    printed, tasks, first = [], [], 1
    for robot, solve, lines, found in (
        (wrist.platform, wrist.place, wrist.lines, wrist.found),
        (wrist.wrist, wrist.turn, wrist.axes, None),
    ):
        work = Work(page.terms)
        values = solve(work, POSE_SYMBOLS)
        inverses = arm_inverses(lines, found, robot, work, values)
        steps, task = arm_steps(arm_page(page, robot), inverses, first)
        first += len(task.steps)
        printed.append(steps)
        tasks.append(task)
    axes = f"The axes of {in_words(names)} meet" if names[1:] else f"The axis of {names[0]} passes"
    return [
        sentence(
            f"{axes} {'in' if names[1:] else 'through'} the wrist center $c$ of the platform,"
            r" which the pose of the tool places at $w$. Each of three legs keeps a ball joint"
            r" $b_i$ of the platform in a plane with the unit normal $n_i$ and the offset $d_i$,"
            r" $i = 1, 2, 3$, with",
            aligned(list(_planes(wrist))),
        ),
        _ROTATIONS,
        method(tasks),
        r"\paragraph{Joints of the platform.} With $T$ the pose of the platform in the base frame,"
        r" which consists of $R$ and of the position $w - R\,c$:",
        printed[0],
        r"\paragraph{Joints of the wrist.} With $T$ the pose of the tool relative to the platform:",
        printed[1],
    ]


def _planes(wrist: CarriedWrist) -> Iterable[tuple[str, list[str]]]:
    """Returns the equations for the planes and for the ball joints relative to the center."""
    center = wrist.center
    for k, plane in enumerate(wrist.planes, 1):
        yield f"n_{k}", [_vector(plane.normal)]
        yield f"d_{k}", [_number(plane.offset)]
        yield f"b_{k} - c", [_vector(plane.ball - center)]


def _vector(values: Iterable[float]) -> str:
    return f"({', '.join(map(_number, values))})"


def _number(value: float) -> str:
    # Zero has no sign.
    return f"{round(value, DIGITS) + 0.0:.{DIGITS}g}"


_ROTATIONS = rf"""The rotation $R$ of the platform satisfies
\begin{{equation*}}
n_i\cdot R\,(b_i - c) = d_i - n_i\cdot w, \quad i = 1, 2, 3.
\end{{equation*}}%
With $m_i = (b_i - c) / |b_i - c|$ and $e_i = (d_i - n_i\cdot w) / |b_i - c|$, the planes are
numbered so that $|e_1|$ is the smallest. The matrices $N$ and $M$ are rotations with the first
columns $n_1$ and $m_1$; $R_x$ and $R_z$ are rotations about the axes $x$ and $z$. Two angles
$\alpha$ and $\beta$ remain in the first equation,
\begin{{equation*}}
R = N\,R_x(\alpha)\,R_z(\arccos e_1)\,R_x(\beta)\,M^{{\mathsf{{T}}}}.
\end{{equation*}}%
With $u = (N\,R_x(\alpha)\,R_z(\arccos e_1))^{{\mathsf{{T}}}} n_i$ and
$v = M^{{\mathsf{{T}}}} m_i$, the other two equations are
\begin{{equation*}}
(u_y v_y + u_z v_z) \cos\beta + (u_z v_y - u_y v_z) \sin\beta + u_x v_x - e_i = 0, \quad i = 2, 3,
\end{{equation*}}%
or $A_i \cos\beta + B_i \sin\beta + C_i = 0$. Both hold for the same $\beta$ if
\begin{{equation*}}
(B_2 C_3 - B_3 C_2)^2 + (C_2 A_3 - C_3 A_2)^2 = (A_2 B_3 - A_3 B_2)^2.
\end{{equation*}}%
This is a trigonometric polynomial of degree 4 in $\alpha$ with up to {ROTATIONS} real roots.
Newton's iteration on the three equations refines each rotation."""
