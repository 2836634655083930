"""Prints the equations of a six-joint arm without a closed form."""

from ...inverse.general.elimination_choice import slides_of
from ...inverse.general.general_inverse import GeneralInverse
from ...inverse.general.raghavan_roth import JOINTS
from ...inverse.structure.words import listed
from ..setting.page import Page, sentence

_ADDED = r"\theta_{\mathrm{tool}}"
"""LaTeX symbol of the sixth joint angle that chasles adds to a five-joint arm."""


def general_arm(page: Page, general: GeneralInverse) -> str:
    """Print the loop equation of an arm, the elimination of its unknowns and the determinant.

    Args:
        page: The symbols and expressions of the arm.
        general: The inverse kinematics of the arm.
    """
    choice, count = general.choice, general.function.branches
    order, slides = choice.orders[0], slides_of(page.robot)
    left_over = [k for k in range(len(_coordinates(page))) if k not in choice.given]
    free = [_coordinates(page)[k] for k in left_over] + [_ADDED] * (JOINTS - len(left_over))
    sliding = [_coordinates(page)[k] for k in left_over if k in slides]
    q = [free[k] for k in order.joints]
    motions = [rf"{'D' if tex in sliding else 'R'}({tex})" for tex in q]
    walked = "from the base to the tool" if order.sense > 0 else "from the tool to the base"
    loop = r"\, ".join(rf"{motion}\, C_{{{k}}}" for k, motion in enumerate(motions, 1))
    left = rf"{motions[2]}\, C_3\, {motions[3]}\, C_4\, {motions[4]}\, C_5\, \ell"
    right = rf"C_2^{{-1}} {motions[1]}^{{-1}} C_1^{{-1}} {motions[0]}^{{-1}} C_6^{{-1}} \ell"
    half = q[4] if order.halved else q[3]
    return sentence(
        f"{_given(page, general)} solved by the method for a general arm (Raghavan and Roth)."
        rf" Let $R(\theta)$ be the rotation by $\theta$ about $z${_slide(sliding)}. If the loop"
        r" passes a joint backwards, the sign of its coordinate is reversed. Let $C_{i}$ be the"
        " constant transforms between the joints. One of them contains the pose. Followed"
        f" {walked}, the loop of the arm and the tool is",
        _centered(f"{loop} = I."),
        rf"The axis $\ell$ of the last of these joints does not depend on ${q[5]}$:",
        _centered(f"{left} = {right}."),
        r"Let $l$ be its direction and $p$ a point on it. The fourteen quantities $p$, $l$,"
        r" $p \cdot p$, $p \cdot l$, $p \times l$ and $(p \cdot p)\, l - 2 (p \cdot l)\, p$ are"
        rf" linear in the products $x$ of cosines and sines of ${q[3]}$ and ${q[4]}$ on the left,"
        rf" and in the eight products $y$ of cosines and sines of ${q[0]}$ and ${q[1]}$ on the"
        rf" right{_powers(sliding)}: $A y = B({q[2]})\, x$. Six combinations do not contain $y$."
        rf" Multiplied by the cosine and sine of ${half}/2$, they are twelve equations"
        rf" $M({q[2]})\, u = 0$ in twelve unknowns. $\det M$ is a trigonometric polynomial of"
        rf" degree 8 in ${q[2]}$, computed from samples, with at most {count} real roots. For each"
        rf" root, $u$ gives ${q[3]}$ and ${q[4]}$, then $y$ gives ${q[0]}$ and ${q[1]}$, and the"
        rf" loop gives ${q[5]}$. Newton's method refines each solution. {_number(count, sliding)}",
    )


def _slide(sliding: list[str]) -> str:
    return ", and $D(d)$ the displacement by $d$ along $z$" if sliding else ""


def _number(roots: int, sliding: list[str]) -> str:
    if len(sliding) <= 1:
        return f"There are at most {roots} solutions."
    return (
        f"Half of the roots do not solve the other equations: there are at most {roots // 2}"
        " solutions."
    )


def _powers(sliding: list[str]) -> str:
    if not sliding:
        return ""
    pairs = [f"${tex}$ and ${tex}^2$" for tex in sliding]
    return f", where {', '.join(pairs)} replace cosine and sine"


def _coordinates(page: Page) -> list[str]:
    return [page.tex(symbol) for symbol in page.equations.notation.q]


def _given(page: Page, general: GeneralInverse) -> str:
    given = general.choice.given
    slides = slides_of(page.robot)
    joints = "joints" if slides else "revolute joints"
    if len(_coordinates(page)) < JOINTS:
        return (
            rf"With a sixth joint with the angle ${_ADDED}$, which rotates the tool about a tool"
            f" axis and is 0 in every solution, the arm's five {joints} become six."
            " They are"
        )
    if not given:
        return f"The arm's six {joints} are"
    names = listed([f"${_coordinates(page)[k]}$" for k in given])
    if len(given) > 1:
        return (
            f"The coordinates {names} are fixed and part of the constant transforms. The other"
            " joints are"
        )
    kind = "displacement" if given[0] in slides else "angle"
    return f"The {kind} {names} is fixed and part of a constant transform. The other joints are"


def _centered(formula: str) -> str:
    return f"\\begin{{equation*}}\n{formula}\n\\end{{equation*}}%"
