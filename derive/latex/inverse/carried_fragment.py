r"""Prints the inverse kinematics of a platform on legs that is combined with other joints."""

from collections.abc import Callable, Iterable, Sequence

import sympy as sp

from ...inverse.classify import Attempt
from ...inverse.mechanisms.carried_arm import CarriedArm
from ...inverse.mechanisms.carried_platform import Plane
from ...inverse.mechanisms.carried_wrist import ROTATIONS, CarriedWrist
from ...inverse.mechanisms.differences import FloatArray
from ...inverse.steps.work import Work
from ...inverse.structure.lines import Lines
from ...inverse.structure.words import listed as in_words
from ...inverse.tasks.slots import POSE_SYMBOLS
from ...model.robot import SerialRobot
from ..loops.arms_fragment import arm_inverses, arm_page
from ..loops.loop_page import LoopPage
from ..setting.layout import aligned
from ..setting.names import escape
from ..setting.page import listed, sentence
from .inverse_fragment import arm_steps, method
from .printed_task import PrintedTask

Solve = Callable[[Work, Sequence[sp.Expr]], list[sp.Expr]]
Part = tuple[SerialRobot, Solve, Lines, Attempt | None]
"""Tuple (arm, function that solves the arm, axes of the arm, structure of these axes or None)."""
DIGITS = 6
"""Number of printed digits in the plane equations and in the positions of the ball joints."""


def carried(page: LoopPage, chain: CarriedWrist | CarriedArm) -> list[str]:
    """Print the equations and solution steps of a platform that is combined with other joints."""
    own = chain.carried
    if isinstance(chain, CarriedArm):
        return _arm(page, chain)
    names = [escape(joint.name) for joint in chain.wrist.moving]
    (platform, of_platform), (wrist, of_wrist) = _steps(
        page,
        (own.platform, own.place, own.lines, own.found),
        (chain.wrist, chain.turn, chain.axes, None),
    )
    axes = f"The axes of {in_words(names)} meet" if names[1:] else f"The axis of {names[0]} passes"
    return [
        sentence(
            f"{axes} {'in' if names[1:] else 'through'} the wrist center $c$ of the platform."
            r" The pose of the tool determines the position $w$ of this point. Each of three legs"
            r" constrains a ball joint $b_i$ of the platform to a plane with the unit normal $n_i$"
            r" and the offset $d_i$, $i = 1, 2, 3$, with",
            aligned(list(_planes(own.planes, chain.center))),
        ),
        _ROTATIONS,
        method((of_platform, of_wrist)),
        r"\paragraph{Joints of the platform.} With $T$ the pose of the platform in the base frame,"
        r" which consists of $R$ and of the position $w - R\,c$:",
        platform,
        r"\paragraph{Joints of the wrist.} With $T$ the pose of the tool relative to the platform:",
        wrist,
    ]


def _steps(page: LoopPage, *parts: Part) -> list[tuple[str, PrintedTask]]:
    """Print the solution steps of several arms, numbered consecutively across the arms."""
    printed, first = [], 1
    for robot, solve, lines, found in parts:
        work = Work(page.terms)
        values = solve(work, POSE_SYMBOLS)
        inverses = arm_inverses(lines, found, robot, work, values)
        printed.append(arm_steps(arm_page(page, robot), inverses, first))
        first += len(printed[-1][1].steps)
    return printed


def _arm(page: LoopPage, chain: CarriedArm) -> list[str]:
    """Print the equations that eliminate the unknown joints of an arm with a platform."""
    own = chain.carried
    unknown = [own.others[k] for k in chain.unknown]
    given = [page.hybrid.robot.moving[k].name for k in chain.given]
    symbols = {joint.name: f"${page.tex(page.joints[joint.name])}$" for joint in unknown}
    slides, angles = (
        [symbols[joint.name] for joint in unknown if joint.kind == kind]
        for kind in ("prismatic", "revolute")
    )
    fixed = f"Fixed inputs are {listed(page.tex(page.joints[name]) for name in given)}."
    ((platform, of_platform),) = _steps(page, (own.platform, own.place, own.lines, own.found))
    joints = f" for {in_words([*symbols.values()])}" if symbols else ""
    return [
        sentence(
            r"Each of three legs constrains a ball joint $b_i$ of the platform to a plane with the"
            r" unit normal $n_i$ and the offset $d_i$ in the frame of the legs,"
            r" $i = 1, 2, 3$, with",
            aligned(list(_planes(own.planes, None))),
        ),
        sentence(
            r"With the pose $B$ of the legs in the base frame and the pose $W$ of the tool relative"
            r" to the platform, the pose $T$ of the tool gives three equations"
            rf"{joints},",
            "\\begin{equation*}\n"
            r"(n_i, -d_i)\, B^{-1}\, T\, W^{-1}\, (b_i, 1)^{\mathsf{T}} = 0."
            "\n\\end{equation*}%",
            "Each equation is linear in the cosine and sine of a revolute joint and in the"
            " displacement of a prismatic joint.",
            fixed if given else "",
        ),
        _elimination(chain, slides, angles),
        method((of_platform,)),
        r"\paragraph{Joints of the platform.} With the pose $B^{-1}\,T\,W^{-1}$ of the platform in"
        r" the frame of the legs, which is called $T$ in these steps:",
        platform,
    ]


def _planes(planes: Sequence[Plane], center: FloatArray | None) -> Iterable[tuple[str, list[str]]]:
    """Return the normal, the offset and the ball joint position of each plane.

    If ``center`` is not None, the ball joint positions are relative to ``center``.
    """
    for k, plane in enumerate(planes, 1):
        yield f"n_{k}", [_vector(plane.normal)]
        yield f"d_{k}", [_number(plane.offset)]
        if center is None:
            yield f"b_{k}", [_vector(plane.ball)]
        else:
            yield f"b_{k} - c", [_vector(plane.ball - center)]


def _vector(values: Iterable[float]) -> str:
    return f"({', '.join(map(_number, values))})"


def _number(value: float) -> str:
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
_ROW = r"$M\,(1, \cos, \sin)^{\mathsf{T}} = 0$"


def _elimination(chain: CarriedArm, slides: Sequence[str], angles: Sequence[str]) -> str:
    """Explain how the equations are solved for the unknown displacements and angles."""
    if chain.has_dixon_resultant:
        return _dixon(chain, *slides, *angles)
    without = ""
    if slides and len(angles) > 1:
        without = (
            f"The equation with the largest coefficient of {slides[0]} eliminates {slides[0]}. "
        )
    match len(angles):
        case 0:
            if not slides:
                return "The equations hold at the poses that the platform reaches."
            return f"Their least-squares solution gives {in_words(slides)}."
        case 1:
            if slides:
                return _with_slides(slides, *angles)
            return (
                f"The equations are linear in the cosine and sine of {angles[0]}. Their"
                f" least-squares solution gives {angles[0]}."
            )
    form = (
        f"{without}The equations have the form {_ROW} for {angles[0]}, with a matrix $M$"
        f" that is linear in the cosine and sine of {angles[1]}."
    )
    if slides:
        return (
            rf"{form} The cross product $(D_1, D_2, D_3)$ of its two rows satisfies"
            rf" $D_2^2 + D_3^2 = D_1^2$, a trigonometric polynomial of degree 4 in"
            rf" {angles[1]}. {_NEWTON}"
        )
    return (
        rf"{form} Then $\det M = 0$ is a trigonometric polynomial of degree 3 in"
        rf" {angles[1]}. {_NEWTON}"
    )


def _with_slides(slides: Sequence[str], angle: str) -> str:
    """Explain how one unknown angle and the unknown displacements are found."""
    columns = f"The constant terms and the coefficients of {in_words(slides)} are the columns of a"
    columns += f" matrix $M$ that is linear in the cosine and sine of {angle}."
    if slides[1:]:
        zero = r"$\det M = 0$ is a trigonometric polynomial of degree 3"
    else:
        zero = "At a solution, they are parallel, which gives trigonometric polynomials of degree 2"
    return f"{columns} {zero} in {angle}. Linear equations then give {in_words(slides)}. {_NEWTON}"


def _dixon(chain: CarriedArm, inner: str, middle: str, outer: str) -> str:
    """Explain how two unknowns are eliminated together."""
    if chain.slides:
        tangents, size, after = (
            f"the tangent of half the angle {middle}",
            4,
            f"{middle} and {inner} follow",
        )
        degrees = f"are linear in {inner} and of degree 2 in this tangent"
    else:
        tangents, size = f"the tangents of half the angles {inner} and {middle}", 8
        degrees = "are polynomials of degree 2 in each tangent"
        after = f"the equations have the form {_ROW} for {inner}, and $\\det M = 0$ gives {middle}"
    return (
        f"With {tangents}, the equations {degrees}. Their Dixon matrix ({size}, {size}) is singular"
        " at a solution. Its determinant is a trigonometric polynomial of degree"
        f" {chain.solutions // 2} in {outer}, with up to {chain.solutions} real roots. At a root,"
        f" {after}. {_NEWTON}"
    )


_NEWTON = "Newton's iteration refines all values."
