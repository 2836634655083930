r"""Prints the degrees of freedom of a robot with loops."""

from ...loops.closing.freedoms import SPATIAL
from ...loops.closing.mobility import Mobility, mobility_of
from ...loops.functions.constraint_functions import equations
from ..setting.layout import aligned
from ..setting.page import sentence, text
from .loop_page import LoopPage


def freedoms(page: LoopPage) -> str:
    """Print the degrees of freedom from two formulas and from the rank of the Jacobian."""
    found = mobility_of(page.hybrid.numbers, equations(page.hybrid))
    n, j, f, order = found.bodies, found.joints, found.freedoms, found.order
    lost = " ".join(f"- {loop}" for loop in found.loop_orders)
    by_loops = f"{found.loop_freedoms} {lost} = {found.by_loops}"
    true = f"{found.coordinates} - {found.rank} = {found.true}"
    rank = r"\operatorname{rank} \frac{\partial c}{\partial z}"
    counted = aligned(
        [
            (
                r"F_{\mathrm{GK}}",
                [
                    r"\lambda (n - 1 - j) + \textstyle\sum f",
                    f"= {order} ({n} - 1 - {j}) + {f} = {found.kutzbach}",
                ],
            ),
            (r"F_{\mathrm{loops}}", [rf"\textstyle\sum f - \sum \lambda_l = {by_loops}"]),
            ("F", [rf"\dim z - {rank} = {true}"]),
        ]
    )
    return text(
        sentence(
            rf"There are $n = {n}$ bodies, the base included, and $j = {j}$ joints of"
            rf" $\sum f = {f}$ degrees of freedom in the group of order $\lambda = {order}$. By"
            " Gr\\\"ubler and Kutzbach, loop by loop, and by the rank of the loops' equations at"
            " random closed configurations, the degrees of freedom are",
            counted,
        ),
        " ".join(_sentences(found)),
    )


def _sentences(found: Mobility) -> list[str]:
    said = []
    if found.idle:
        said.append(
            f"{found.idle} members between ball joints can spin about their own axes without moving"
            " any other body. These rotations are counted but are not coordinates."
        )
    if found.equations > found.rank:
        said.append(
            f"The mechanism is overconstrained: {found.equations - found.rank} of its"
            f" {found.equations} equations are redundant."
        )
    idle = found.idle if found.order == SPATIAL else 0
    if found.kutzbach - idle != found.true and found.order == SPATIAL:
        said.append(
            rf"Gr\"ubler and Kutzbach's formula gives ${found.kutzbach}$, the rank gives"
            rf" ${found.true}$: in the group of order ${SPATIAL}$, constraints of planar loops"
            " are redundant."
        )
    if found.by_loops - found.idle != found.true:
        said.append(f"The loop-by-loop count is ${found.by_loops}$, the rank gives ${found.true}$.")
    if not said:
        said.append("All counts agree.")
    if found.actuated == found.true:
        said.append("There are as many actuators as degrees of freedom.")
    else:
        said.append(f"There are {found.actuated} actuators.")
    return said
