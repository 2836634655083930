r"""The fragment of the parametric functions: the vector p, the pose, its derivative by p."""

from dataclasses import dataclass

import sympy as sp

from ...model.geometry import Geometry
from ...model.placements import Placement, Rotation, Translation
from ..setting.layout import aligned, broken, flowed
from ..setting.notation import LENGTH
from ..setting.page import Page, sentence, text
from ..setting.printer import Printer
from ..setting.transforms import factors
from .parameter_table import parameter_table

_COLUMNS = r"""Every elementary motion $m$ of these products is a turn or a shift by a value $v_m$,
and has a screw: with $e_m$ its axis and $r_m$ its place in base axes, and $r$ the place of the
tool,"""
_SCREWS = r"""\begin{align*}
\mathcal{S}_m &= (e_m \times (r - r_m);\, e_m) && \text{of a turn,} &
\mathcal{S}_m &= (e_m;\, 0) && \text{of a shift.}
\end{align*}"""
_SUM = r"""A rate of $p_k$ at coordinates at rest gives the tool the twist
\begin{align*}
J_k = \sum_m \mathcal{S}_m \frac{\partial v_m}{\partial p_k},
\end{align*}
which is column $k$ of \texttt{identification\_jacobian}; with $q_k$ in the place of $p_k$ it is a
column of \texttt{jacobian\_p}."""
_BY_PART = {
    "base": "A correction of the base moves all behind it: its column is the screw of its motion.",
    "joint": "A length of a joint shifts the tool along its axis, an angle turns it about that.",
    "offset": "The offset of a coordinate has the joint's own screw.",
    "axis": "A correction of an axis acts before the joint's motion and backwards behind it: its"
    " column is the difference of the screws at both places.",
    "transmission": "A gain has the joint's screw times the coordinate, a wave times its sine or"
    " cosine.",
    "compliance": "A compliance has the joint's screw times the torque of gravity.",
    "tool": "A correction of the tool moves the tool alone.",
}
"""A sentence on the columns of each part."""


@dataclass(frozen=True)
class _Segments:
    """The product cut at the joints.

    Attributes:
        between: The motions before, between and behind the joints.
        moving: The motions of the joints, in q, p and torques.
    """

    between: tuple[Placement, ...]
    moving: tuple[Rotation | Translation, ...]


def parametric(page: Page) -> str:
    """The geometry as variables: the table of p, the pose, and the columns of its derivative."""
    found = page.geometry
    if found is None:
        return ""
    printer = _printer(page, found)
    parts = dict.fromkeys(parameter.part for parameter in found.parameters)
    return text(
        sentence(
            "The parametric functions take the geometry as a vector $p$ of"
            rf" ${len(found.parameters)}$ numbers, nominally zero where no value is given:",
            parameter_table(found.parameters, printer),
        ),
        _product(page, found, printer),
        sentence(_COLUMNS, _SCREWS, _SUM, " ".join(_BY_PART[part] for part in parts)),
    )


def _printer(page: Page, found: Geometry) -> Printer:
    notation = page.equations.notation
    tex = {p.symbol: f"p_{{{k}}}" for k, p in enumerate(found.parameters, 1)}
    tex |= {q: notation.tex[own] for q, own in zip(found.q, notation.q, strict=True)}
    tex |= {tau: rf"\tau_{{{k}}}" for k, tau in enumerate(found.torques, 1)}
    order = {p.symbol: (LENGTH, (k,)) for k, p in enumerate(found.parameters)}
    return Printer(tex, order)


def _product(page: Page, found: Geometry, printer: Printer) -> str:
    """The pose of the tool as a product over the joints, and the values of the joints."""
    cut = _cut(found)
    turns = [isinstance(motion, Rotation) for motion in cut.moving]
    moved = [
        rf"{'R' if turn else 'T'}_{_axis(motion)}(v_{{{k}}})\,A_{{{k}}}"
        for k, (turn, motion) in enumerate(zip(turns, cut.moving, strict=True), 1)
    ]
    values = [(f"v_{{{k}}}", [printer.tex(_value(m))]) for k, m in enumerate(cut.moving, 1)]
    links = [
        broken(f"A_{{{k}}}", factors(placement, printer) or ["1"])
        for k, placement in enumerate(cut.between)
    ]
    gravity = ""
    if found.torques:
        gravity = (
            r"Here $\tau_k$ is the torque of gravity on coordinate $k$ (N\,m), or the force on a"
            r" slide (N), in the nominal arm; a compliance is in rad/(N\,m), or in m/N."
        )
    return sentence(
        "The pose of the tool is",
        aligned([(page.pose, [r"A_{0}\,", *moved])], end=","),
        "with the values of the joints",
        aligned(values, end=""),
        "and the constant products",
        flowed(links),
        gravity,
    )


def _cut(found: Geometry) -> _Segments:
    between: list[Placement] = [()]
    moving: list[Rotation | Translation] = []
    for motion in found.motions:
        if _value(motion).free_symbols & set(found.q):
            moving.append(motion)
            between.append(())
        else:
            between[-1] += (motion,)
    return _Segments(tuple(between), tuple(moving))


def _value(motion: Rotation | Translation) -> sp.Expr:
    """The angle of a turn, the length of a shift along one axis."""
    return motion.angle if isinstance(motion, Rotation) else sp.Add(*motion.vector)


def _axis(motion: Rotation | Translation) -> str:
    if isinstance(motion, Rotation):
        return motion.axis
    return next(axis for axis, part in zip("xyz", motion.vector, strict=True) if part != 0)
