"""Solves planar loops in closed form. Steps join bodies until all form one rigid group.

At first, each body of a linkage is a separate group. Bodies with a known joint or a weld between
them are joined first. Then bodies are joined by the first step in ``STEPS`` that is possible.
These two operations alternate until all bodies are joined. The
mechanism is then a sequence of Assur groups of class II. The known joints are the actuated joints
or the main-chain joints.
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
"""The classes of planar solution steps, in the order in which they are tried. The first steps need
no square root."""


@dataclass(frozen=True)
class Assembly:
    """A linkage that is completely or partly solved.

    Attributes:
        steps: The solution steps in order.
        values: The values of joints, swing angles and cylinders that are solved. Angles are sums of
            solved angles and coordinates. The angles may exceed a full turn.
        loops: Rates of all solved angles.
        relations: Sums of rotated vectors that are zero.
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
        reference: The configuration that selects the branch.
        branch: The branch. The default is the branch that contains the reference configuration.

    Raises:
        DescriptionError: A loop does not close at the reference, or its branch is ambiguous there.
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

    The branch of the last step varies fastest. Two branches share the expressions of all steps
    before the first step at which their signs differ.

    Args:
        terms: Receives the terms.
        linkage: Bodies and joints.
        known: Known values of joints, swing angles or cylinders by name (radian, meter).
        reference: The configuration of the first branch.
        elsewhere: Configurations at which every branch is closed.
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
    """Join rigid groups with the first loop step that can join any of them.

    Returns False if no step can join rigid groups.
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
    """Whether all redundant joints close their loops, and no two pins coincide."""
    is_open = any(
        closure_error > OFF_BRANCH for closure_error in clusters.closure_errors(elsewhere)
    )
    return not is_open and not clusters.coincide(elsewhere)
