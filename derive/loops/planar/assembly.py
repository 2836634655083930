"""Planar loops solved in closed form: bodies are joined, three at a time, until all are rigid.

At the start every body of a linkage stands alone. Bodies that a known joint or a weld holds are
joined; then the first bodies that a step of :data:`STEPS` fits, and so on: the mechanism is a
sequence of Assur groups of class II. Whether the actuated joints are known or the main chain's
makes no difference here.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import sympy as sp

from ...model.tolerances import OFF_BRANCH
from ...terms.tangents import LoopRate
from ...terms.terms import Terms
from .clusters import Clusters, PlanarStep
from .loop_step import LoopStep
from .parallelogram import Parallelogram
from .phasors import PhasorSum
from .pin_pin_slide import TwoPinsAndSlide
from .pin_slide_slide import PinAndTwoSlides
from .planes import Linkage
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
"""The kinds of steps in the order of their cost: steps without a root come first."""


@dataclass(frozen=True)
class Assembly:
    """A linkage, solved as far as its steps go.

    Attributes:
        steps: In the order of the solution.
        values: Joint, swing and cylinder values as far as determined; angles are sums of solved
            angles and coordinates, and may exceed a turn.
        loops: Rates of the solved angles.
        relations: Sums of turning vectors that are zero.
        open: Names of the edges between bodies that could not be joined.
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
    """Solves a linkage for given values of some of its joints.

    Args:
        terms: Names of all terms.
        linkage: Bodies and joints.
        known: Values of joints, swings or cylinders by name (radian, metre).
        reference: The configuration that selects the branch.
        branch: The branch that is asked for, instead of that at the reference.

    Raises:
        RobotError: A loop does not close at the reference, or its branch there is not clear.
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
    """The same on all branches that exist, the reference's first; later steps change sides first.

    Branches share the steps before the first side that they do not share.

    Args:
        terms: Names of all terms.
        linkage: Bodies and joints.
        known: Values of joints, swings or cylinders by name (radian, metre).
        reference: The configuration whose sides are its branch's.
        elsewhere: Configurations at which a branch that exists is closed.
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
    """Joins the first clusters that can be joined; False where there are none."""
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
    """Whether joints that repeat others fit on a branch, and pins stay apart, where it closes."""
    is_open = any(gap > OFF_BRANCH for gap in clusters.gaps(elsewhere))
    return not is_open and not clusters.coincide(elsewhere)
