r"""Prints the functions of the geometry parameters p."""

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

_COLUMNS = r"""Every elementary motion $m$ of these products is a rotation or a translation by a
value $v_m$. Its screw in base axes, with axis $e_m$, a point $r_m$ on the axis and the tool's
position $r$, is"""
_SCREWS = r"""\begin{align*}
\mathcal{S}_m &= (e_m \times (r - r_m);\, e_m) && \text{for a rotation,} &
\mathcal{S}_m &= (e_m;\, 0) && \text{for a translation.}
\end{align*}"""
_SUM = r"""A unit rate of $p_k$ at constant coordinates gives the tool the twist
\begin{align*}
J_k = \sum_m \mathcal{S}_m \frac{\partial v_m}{\partial p_k},
\end{align*}
which is column $k$ of \texttt{identification\_jacobian}; with $q_k$ in place of $p_k$ it is a
column of \texttt{jacobian\_p}."""
_BY_PART = {
    "parameter": "A parameter of the description moves every value that is stated with it.",
    "base": "A base correction moves the whole robot: its column is the screw of its motion.",
    "joint": "A joint length moves the tool along its axis; a joint angle rotates it about its"
    " axis.",
    "offset": "The column of a coordinate offset is the joint's screw.",
    "axis": "An axis correction acts before the joint's motion, and inversely after it: its"
    " column is the difference of both screws.",
    "transmission": "The column of a gain is the joint's screw times the coordinate; of a wave,"
    " times its sine or cosine.",
    "coupling": "The column of a ratio is the joint's screw times the output of the drive.",
    "compliance": "A compliance's column is the joint's screw times the gravity torque.",
    "tool": "A correction of the tool moves only the tool.",
}
"""Sentences about the Jacobian columns of each parameter group."""


@dataclass(frozen=True)
class _Segments:
    """Tool pose as a product of transforms.

    Attributes:
        between: Fixed transforms before, between and after the joints.
        moving: The joint motions as functions of q, p and joint torques.
    """

    between: tuple[Placement, ...]
    moving: tuple[Rotation | Translation, ...]


def parametric(page: Page) -> str:
    """Print the table of the parameters p, the tool pose for p, and the derivatives of the pose."""
    found = page.geometry
    if found is None:
        return ""
    printer = _printer(page, found)
    parts = dict.fromkeys(parameter.part for parameter in found.parameters)
    return text(
        sentence(
            "The parametric functions take the geometry as a vector $p$ of"
            rf" ${len(found.parameters)}$ parameters; the nominal value is zero unless stated:",
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
            r"Here $\tau_k$ is the gravity torque on coordinate $k$ (N\,m), or the force on a"
            r" prismatic joint (N), in the nominal arm; a compliance is in rad/(N\,m), or in m/N."
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
    return motion.angle if isinstance(motion, Rotation) else sp.Add(*motion.vector)


def _axis(motion: Rotation | Translation) -> str:
    if isinstance(motion, Rotation):
        return motion.axis
    return next(axis for axis, part in zip("xyz", motion.vector, strict=True) if part != 0)
