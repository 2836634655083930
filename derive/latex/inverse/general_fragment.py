"""The equations of an arm of six revolute joints without a structure."""

from ...inverse.general.general_inverse import GeneralInverse
from ...inverse.general.raghavan_roth import JOINTS
from ...inverse.structure.words import listed
from ..setting.page import Page, sentence

_ADDED = r"\theta_{\mathrm{tool}}"
"""The angle of the joint that is added to five."""


def general_arm(page: Page, general: GeneralInverse) -> str:
    """The loop, the elimination and the determinant, in the arm's own symbols.

    Args:
        page: The arm's page.
        general: Its inverse.
    """
    choice, count = general.choice, general.function.branches
    split = choice.splits[0]
    free = [tex for k, tex in enumerate(_angles(page)) if k not in choice.given]
    free += [_ADDED] * (JOINTS - len(free))
    q = [free[k] for k in split.joints]
    turns = [rf"R({tex})" for tex in q]
    walked = "from the base to the tool" if split.sense > 0 else "from the tool to the base"
    loop = r"\, ".join(rf"{turn}\, C_{{{k}}}" for k, turn in enumerate(turns, 1))
    left = rf"{turns[2]}\, C_3\, {turns[3]}\, C_4\, {turns[4]}\, C_5\, \ell"
    right = rf"C_2^{{-1}} {turns[1]}^{{-1}} C_1^{{-1}} {turns[0]}^{{-1}} C_6^{{-1}} \ell"
    half = q[4] if split.halved else q[3]
    return sentence(
        f"{_given(page, general)} solved as those of a general arm (Raghavan and Roth)."
        r" With $R(\theta)$ the rotation by $\theta$ about $z$, with the opposite sign"
        r" where the loop is followed against the joint, and $C_{i}$ the placements between the"
        f" joints, one of which contains the pose, the loop of arm and tool, followed {walked}, is",
        _centred(f"{loop} = I."),
        rf"The axis $\ell$ of the last of these joints does not depend on ${q[5]}$:",
        _centred(f"{left} = {right}."),
        r"Its direction $l$ and a point $p$ of it give fourteen quantities, $p$, $l$, $p \cdot p$,"
        r" $p \cdot l$, $p \times l$ and $(p \cdot p)\, l - 2 (p \cdot l)\, p$, that are linear in"
        rf" the products $x$ of cosines and sines of ${q[3]}$ and ${q[4]}$ on the left and in the"
        rf" eight products $y$ of those of ${q[0]}$ and ${q[1]}$ on the right:"
        rf" $A y = B({q[2]})\, x$. Six combinations do not contain $y$. Times cosine and sine of"
        rf" ${half}/2$ they are twelve equations $M({q[2]})\, u = 0$ in as many unknowns; $\det M$"
        rf" is a trigonometric polynomial of degree 8 in ${q[2]}$, known from samples, with at most"
        rf" {count} real roots. For each, $u$ gives ${q[3]}$ and ${q[4]}$, then $y$"
        rf" gives ${q[0]}$ and ${q[1]}$, and the loop gives ${q[5]}$. Newton steps on the pose"
        rf" refine it. There are at most {count} solutions.",
    )


def _angles(page: Page) -> list[str]:
    """The angles of all joints."""
    return [page.tex(symbol) for symbol in page.equations.notation.q]


def _given(page: Page, general: GeneralInverse) -> str:
    """The joints that are solved for, as the subject of a sentence."""
    given = general.choice.given
    if len(_angles(page)) < JOINTS:
        return (
            rf"With a sixth joint of the angle ${_ADDED}$, which turns the tool about an axis of"
            " the tool and is 0 in the solutions of a pose, the arm's five revolute joints are six."
            " They are"
        )
    if not given:
        return "The arm's six revolute joints are"
    names = listed([f"${_angles(page)[k]}$" for k in given])
    if len(given) > 1:
        return (
            f"The coordinates {names} are given, so that they are parts of placements. The other"
            " joints are"
        )
    return f"The angle {names} is given, so that it is part of a placement. The other joints are"


def _centred(formula: str) -> str:
    return f"\\begin{{equation*}}\n{formula}\n\\end{{equation*}}%"
