"""Virtual prismatic joints that replace a part of a chain.

Together, the replaced joints only translate the next link of the chain.

The rods of a built delta robot are not exactly parallel, so its platform rotates slightly. The
three actuated coordinates of a built delta robot determine the platform orientation as well as the
position. The inverse kinematics of the nominal robot solves for the position. From the nominal
solution, Newton's method converges to the full pose, or only to the position.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import sympy as sp

from ...chain.groups import Group, Station
from ...loops.functions.tool import tool_groups, tool_kinematics
from ...loops.solve.collapse import collapsed
from ...loops.solve.solved_loops import SolvedLoops
from ...model.robot import JointKind
from ...model.tolerances import INDEPENDENT_SLIDES
from ...terms.symbolic_function import Argument, NativeSolverFunction, SymbolicFunction
from ...terms.terms import Terms
from ...terms.vectors import (
    IDENTITY,
    ORIGIN,
    Basis,
    Vector,
    combination,
    turned_about_x,
    turned_about_z,
)
from ..steps.work import Work
from ..structure.lines import Axis, Lines, numbers
from ..subproblems.equations import LineAndPlane
from ..subproblems.found import FoundLength
from ..subproblems.sp4 import on_line
from ..tasks.partial_poses import POSITION
from ..tasks.slots import POSE_SYMBOLS
from .substitution import substituted


@dataclass(frozen=True)
class Slides:
    """The virtual prismatic joints that replace other joints of a chain.

    Attributes:
        values: Displacements of the virtual prismatic joints as functions of the actuated
            coordinates.
        weights: Matrix that converts the virtual displacements to the values of the prismatic
            joints in the shortened chain, with one row per prismatic joint.
    """

    values: tuple[sp.Expr, ...]
    weights: tuple[tuple[sp.Expr, ...], ...]


@dataclass(frozen=True)
class Translating:
    """A chain in which virtual prismatic joints replace several joints.

    Attributes:
        lines: Axes of the shortened chain. The virtual joints have the highest joint indices.
        home: The tool pose (axes and origin) with all joints at zero.
        slides: The virtual prismatic joints.
    """

    lines: Lines
    home: tuple[Basis, Vector]
    slides: Slides


def translating(hybrid: SolvedLoops) -> Translating | None:
    """Return the shortened chain, or None if no part of the chain keeps its orientation."""
    terms = hybrid.terms
    values = [joint.direction * hybrid.forward.values[joint.name] for joint in hybrid.robot.moving]
    shorter, translations = collapsed(
        terms, tool_groups(hybrid), hybrid.forward.relations, len(values)
    )
    if not translations:
        return None
    everything = [*values, *translations]
    names = [joint.name for joint in hybrid.robot.moving]
    axes, home = _home(terms, shorter, everything, names)
    indices = [k for k, axis in enumerate(axes) if not axis.turns]
    if any(b - a != 1 for a, b in pairwise(indices)):
        return None
    kept, weights = _independent(terms, [axes[k] for k in indices])
    slides = Slides(tuple(everything[axes[k].joint] for k in indices), weights)
    chain = (*axes[: indices[0]], *kept, *axes[indices[-1] + 1 :])
    return Translating(Lines(terms, chain), home, slides)


def _home(
    terms: Terms, groups: Sequence[Group], values: Sequence[sp.Expr], names: Sequence[str]
) -> tuple[list[Axis], tuple[Basis, Vector]]:
    basis, origin = IDENTITY, ORIGIN
    axes: list[Axis] = []
    tool: tuple[Basis, Vector] = (basis, origin)
    for group in groups:
        turned = basis
        for station in group.stations:
            if station.joint is not None:
                _, _, z = basis
                h = combination(terms, (sp.Integer(station.sign),), (z,))
                axes.append(_axis(terms, station.joint, names, "revolute", h, origin))
            moving = station.angle.free_symbols
            still = station.angle.xreplace(dict.fromkeys(moving, sp.Integer(0)))
            turned = turned_about_z(terms, basis, *terms.cos_sin(still))
            for slide in station.slides:
                h = combination(terms, slide.direction, turned)
                axes.append(_axis(terms, slide.joint, names, "prismatic", h, ORIGIN))
            reach = _still(terms, station.reach, station, values)
            for frame in station.frames:
                x, y, z = (combination(terms, e, turned) for e in frame.orientation)
                at = combination(
                    terms,
                    (sp.Integer(1), *_still(terms, frame.origin, station, values)),
                    (origin, *turned),
                )
                tool = ((x, y, z), at)
            origin = combination(terms, (sp.Integer(1), *reach), (origin, *turned))
        basis = turned_about_x(terms, turned, *group.tilt)
    return axes, tool


def _axis(
    terms: Terms, joint: int, names: Sequence[str], kind: JointKind, h: Vector, p: Vector
) -> Axis:
    name = names[joint] if joint < len(names) else "translation"
    return Axis(joint, name, kind, h, p, numbers(terms, h), numbers(terms, p))


def _still(terms: Terms, vector: Vector, station: Station, values: Sequence[sp.Expr]) -> Vector:
    moving = [values[slide.joint] for slide in station.slides]
    symbols = {symbol for value in moving for symbol in value.free_symbols}
    rest = dict.fromkeys(symbols, sp.Integer(0))
    x, y, z = (terms.let(spelled(terms, e, symbols).xreplace(rest)) for e in vector)
    return x, y, z


def spelled(terms: Terms, expression: sp.Expr, stop: set[sp.Symbol] | None = None) -> sp.Expr:
    """Replace named terms by their definitions, except the terms in ``stop``."""
    kept = stop or set()
    while True:
        found = {
            s: terms.definitions[s]
            for s in expression.free_symbols - kept
            if s in terms.definitions
        }
        if not found:
            return expression
        expression = expression.xreplace(found)


def _independent(
    terms: Terms, slides: Sequence[Axis]
) -> tuple[list[Axis], tuple[tuple[sp.Expr, ...], ...]]:
    """Return axes that span all prismatic directions, and the directions in this basis."""
    kept: list[Axis] = []
    for axis in slides:
        directions = [a.direction for a in (*kept, axis)]
        if np.linalg.matrix_rank(np.array(directions), tol=INDEPENDENT_SLIDES) == len(directions):
            kept.append(axis)
    basis = sp.Matrix([[terms.spelled(e) for e in axis.h] for axis in kept]).T
    to_basis = (basis.T * basis).inv() * basis.T
    columns = [to_basis * sp.Matrix([terms.spelled(e) for e in axis.h]) for axis in slides]
    weights = tuple(tuple(column[j] for column in columns) for j in range(len(kept)))
    return kept, weights


def actuators_of(
    work: Work, moved: Translating, q: Sequence[sp.Symbol]
) -> dict[sp.Symbol, sp.Expr] | None:
    """Solve for the two actuated coordinates that produce given prismatic displacements.

    One of the two actuated coordinates must be a slider coordinate in which the prismatic
    displacements are linear.

    The other actuated coordinate is a crank angle. Elimination of the slider coordinate leaves an
    equation that must be linear in the cosine and sine of the crank angle.

    Args:
        work: Record of the solution, which already contains the prismatic displacements and
            receives the new solution steps.
        moved: The shortened chain.
        q: The actuated coordinates.

    Returns:
        Expressions for the two actuated coordinates, or None if the equations do not have the form
        described above.
    """
    terms = work.terms
    slides = moved.slides
    kept = [axis for axis in moved.lines.axes if not axis.turns]
    equations = [
        sp.expand(
            sum(
                (
                    w * spelled(terms, terms.spelled(v))
                    for w, v in zip(row, slides.values, strict=True)
                ),
                sp.Integer(0),
            )
        )
        for row in slides.weights
    ]
    equations = [terms.spelled(equation) for equation in equations]
    unknown = sorted(
        {s for equation in equations for s in equation.free_symbols} & set(q), key=list(q).index
    )
    if len(unknown) != len(kept) or len(unknown) != 2:  # noqa: PLR2004
        return None
    lengths = [work.lengths[axis.joint] for axis in kept]
    for along, crank in (unknown, unknown[::-1]):
        rates = [sp.expand(sp.diff(equation, along)) for equation in equations]
        if all(map(terms.is_constant, rates)) and any(rate != 0 for rate in rates):
            rest = [sp.expand(e - r * along) for e, r in zip(equations, rates, strict=True)]
            return _two(work, (along, crank), rates, rest, lengths)
    return None


def _two(
    work: Work,
    unknown: tuple[sp.Symbol, sp.Symbol],
    rates: Sequence[sp.Expr],
    rest: Sequence[sp.Expr],
    lengths: Sequence[sp.Expr],
) -> dict[sp.Symbol, sp.Expr] | None:
    """Solve ``rates[j] along + rest[j](crank) = lengths[j]`` (j = 0, 1) for along and crank."""
    terms, (along, crank) = work.terms, unknown
    alone = sp.expand(rates[1] * rest[0] - rates[0] * rest[1])
    a, b = (sp.expand(alone).coeff(f(crank)) for f in (sp.cos, sp.sin))
    constant = sp.expand(alone - a * sp.cos(crank) - b * sp.sin(crank))
    if crank in constant.free_symbols:
        return None
    a, b = terms.let(a), terms.let(b)
    wanted = terms.let(rates[1] * lengths[0] - rates[0] * lengths[1] - constant)
    rho2 = terms.let(a**2 + b**2)
    found = on_line(terms, a, b, wanted, work.sign(), terms.let(rho2 - wanted**2))
    turn = work.note(
        (crank.name,),
        "subproblem 4",
        "the slider does not contribute to one component of the translation",
        found,
    )
    row = 0 if rates[0] != 0 else 1
    left = rest[row].subs({sp.cos(crank): turn.c, sp.sin(crank): turn.s})
    length = terms.let(terms.let(lengths[row] - left) / terms.let(rates[row]))
    work.note_length(
        (along.name,),
        "line-plane intersection",
        "the slider produces the remaining translation after the crank",
        FoundLength(length, LineAndPlane(rates[row], left - lengths[row])),
    )
    return {crank: terms.solved_angle(turn.c, turn.s), along: length}


def still_axes(design: SolvedLoops) -> Basis | None:
    """Return the axes of the tool frame if no coordinate rotates the tool, otherwise None."""
    axes, _ = tool_kinematics(design).forward.tool_pose()
    is_still = all(design.terms.is_constant(entry) for axis in axes for entry in axis)
    return axes if is_still else None


def of_position_alone(function: SymbolicFunction, axes: Basis) -> SymbolicFunction:
    """Return the function ``ik`` with a residual that contains no orientation error.

    Args:
        function: The task.
        axes: The axes of the tool frame.
    """
    still = {POSE_SYMBOLS[4 * i + j]: axes[j][i] for i in range(3) for j in range(3)}
    outputs = tuple(
        replace(result, entries=substituted(function.terms, result.entries, still))
        for result in function.outputs
    )
    return replace(function, outputs=outputs)


def position_task(polished: NativeSolverFunction) -> NativeSolverFunction:
    """Derive the function ``ik_position`` for target positions from ``ik``.

    The functions ``ik`` and ``ik_position`` refine solutions of the same nominal inverse
    kinematics.
    """
    argument = Argument("p", POSITION, (3,), "m", "position of the tool in the base frame")
    role = replace(polished.role, domain="task", components=("position",))
    return replace(
        polished,
        name="ik_position",
        identity="fk(q[k]) has its origin at p if residual[k] is a rounding error",
        inputs=(argument,),
        role=role,
    )
