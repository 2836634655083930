"""Solves planar loops in closed form.

Solution steps join bodies until all bodies form one rigid group.

At first, each body of a linkage is a separate group. Bodies with a known joint or a weld between
them are joined first. The first applicable step class in ``STEPS`` then joins further bodies. Both
kinds of joining alternate until all bodies are joined. If all bodies are joined, the mechanism is a
sequence of Assur groups of class II. The known joints are the actuated joints or the main-chain
joints.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import sympy as sp

from ...model.tolerances import OFF_BRANCH
from ...terms.tangents import LoopRate
from ...terms.terms import Terms
from ..model.phasors import PhasorSum
from ..model.planes import Linkage
from .clusters import Clusters, PlanarStep
from .loop_step import LoopStep
from .parallelogram import Parallelogram
from .pin_pin_slide import TwoPinsAndSlide
from .pin_slide_slide import PinAndTwoSlides
from .reference import AtReference, Branch
from .three_pins import ThreePins
from .two_pins import PinAndSlide, TwoPins

STEPS: tuple[type[PlanarStep], ...] = (
    TwoPins,
    PinAndSlide,
    Parallelogram,
    PinAndTwoSlides,
    TwoPinsAndSlide,
    ThreePins,
)
"""The classes of planar solution steps, in the order in which they are tried. The first classes in
this list need no square root."""


@dataclass(frozen=True)
class Assembly:
    """A linkage that is completely or partly solved.

    Attributes:
        steps: The solution steps in order.
        values: Solved values of joints, swing angles and cylinders by name. An angle is a sum of
            solved angles and coordinates, and may exceed a full turn.
        loops: Functions that return the rates of the solved angles, keyed by the symbol of the
            angle.
        relations: Loop equations, each a sum of rotated vectors that is zero.
        open: Names of the joints that remain unsolved.
    """

    steps: tuple[LoopStep, ...]
    values: Mapping[str, sp.Expr]
    loops: Mapping[sp.Symbol, LoopRate]
    relations: tuple[PhasorSum, ...]
    open: tuple[str, ...]


def assemble(
    terms: Terms,
    linkage: Linkage,
    known: Mapping[str, sp.Expr],
    reference: AtReference,
    branch: Branch | None = None,
) -> Assembly:
    """Solve a linkage for known values of some joints.

    Args:
        terms: Receives the terms.
        linkage: Bodies and joints.
        known: Known values of joints, swing angles or cylinders by name (radian, meter).
        reference: The reference configuration, which selects the branch if ``branch`` is None.
        branch: The branch to solve. The default is the branch that contains the reference
            configuration.

    Raises:
        DescriptionError: A loop does not close at the reference configuration, or the branch of a
            loop is ambiguous at the reference configuration.
    """
    clusters = Clusters(terms, linkage, known, reference, branch)
    while _join(clusters):
        pass
    return _assembly(clusters)


def assemblies(
    terms: Terms,
    linkage: Linkage,
    known: Mapping[str, sp.Expr],
    reference: AtReference,
    elsewhere: Sequence[AtReference] = (),
) -> Iterator[Assembly]:
    """Yield the assemblies on all branches.

    The assemblies are ordered so that the branch sign of the last solution step varies fastest. Two
    branches share the expressions of all steps before the first step at which their signs differ.

    Args:
        terms: Receives the terms.
        linkage: Bodies and joints.
        known: Known values of joints, swing angles or cylinders by name (radian, meter).
        reference: The configuration of the first branch.
        elsewhere: Configurations at which the closure of every branch other than the reference
            branch is tested.
    """
    first = Branch((), reference.sides)
    waiting = [(Clusters(terms, linkage, known, reference, first), first)]
    while waiting:
        clusters, branch = waiting.pop()
        goes_on = True
        while goes_on:
            taken, before = len(branch.taken), clusters.on(branch)
            goes_on = _join(clusters)
            waiting += [(before.on(other), other) for other in branch.others_since(taken)]
        if -1 not in branch.taken or _fits(clusters, elsewhere):
            yield _assembly(clusters)


def _join(clusters: Clusters) -> bool:
    """Join rigid groups with a weld, a known joint or the first possible solution step.

    The function returns False if no rigid groups can be joined.
    """
    return clusters.join_known() or any(kind.join(clusters) for kind in STEPS)


def _assembly(clusters: Clusters) -> Assembly:
    edges = clusters.linkage.edges
    return Assembly(
        tuple(clusters.steps),
        clusters.values(),
        clusters.loops,
        tuple(clusters.relations),
        tuple(edge.name for edge in clusters.between() if edge in edges),
    )


def _fits(clusters: Clusters, elsewhere: Sequence[AtReference]) -> bool:
    """Whether all redundant joints close their loops, and no dyad has coincident base pins."""
    is_open = any(
        closure_error > OFF_BRANCH for closure_error in clusters.closure_errors(elsewhere)
    )
    return not is_open and not clusters.coincide(elsewhere)
