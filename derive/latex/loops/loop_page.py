"""Collects the symbols and solution steps for a LaTeX article about a robot with loops."""

from dataclasses import dataclass
from functools import cached_property

import sympy as sp

from ...chain.body_shapes import Skeleton
from ...derivation import Derivation, derive
from ...inverse.serial_inverse import METHODS, STRUCTURED, Inverses
from ...loops.checks.dead_values import DeadValues, dead_values
from ...loops.model.mechanism_geometry import MechanismGeometry
from ...loops.solve.solved_loops import SolvedLoops
from ...model.geometry import Geometry
from ...model.mechanism import Mechanism
from ...terms.symbolic_function import SymbolicFunction
from ...terms.terms import Terms
from ..setting.notation import LENGTH, MAX_WRITTEN
from ..setting.page import Page
from ..setting.printed_terms import PrintedTerms
from ..setting.sharing import PRINTED
from .members import Letters, Members, members
from .printed_steps import PrintedLoopStep, VectorPrinter, after, printed_steps


@dataclass(frozen=True)
class LoopPage:
    """A robot with loops and the data of its LaTeX article.

    Attributes:
        mechanism: The description.
        hybrid: The loops of the robot and their solution.
        skeleton: The bodies of the robot with their drawn shapes.
        chain: Printed expressions of the main chain, with the joint symbols from `members`.
        members: The printed symbols of the robot's joints.
        letters: Letters that the LaTeX article uses for intermediate results.
        inverse: The robot's inverse kinematics functions, or None if they were not derived.
        functions: The derived closed-form functions, which call no iterative solver.
        geometry: The robot's parametric functions, or None if they were not derived.
    """

    mechanism: Mechanism
    hybrid: SolvedLoops
    skeleton: Skeleton
    chain: Page
    members: Members
    letters: Letters
    inverse: Inverses | None
    functions: tuple[SymbolicFunction, ...]
    geometry: MechanismGeometry | None = None

    @classmethod
    def of(cls, derivation: Derivation) -> "LoopPage":
        """Collect the data of a LaTeX article from the derivation of a robot with loops."""
        mechanism, hybrid = derivation.robot, derivation.hybrid
        assert isinstance(mechanism, Mechanism)
        assert hybrid is not None
        symbols = members(mechanism)
        printed = derive(mechanism.main_chain, functions=PRINTED, families=derivation.families)
        inverse, functions = derivation.inverse, (f for f in derivation.functions if not f.calls)
        # If the robot has inverse kinematics functions of its own, the LaTeX article omits the
        # general inverse kinematics of the main chain.
        methods = STRUCTURED if inverse and inverse.solved else METHODS
        chain = Page.of(printed, symbols.theta, len(mechanism.coordinates), methods)
        letters = Letters(chain.equations.notation, symbols)
        skeleton, geometry = derivation.skeleton, derivation.geometry
        assert not isinstance(geometry, Geometry)
        return cls(
            *(mechanism, hybrid, skeleton, chain, symbols, letters, inverse),
            functions=tuple(functions),
            geometry=geometry,
        )

    @property
    def terms(self) -> Terms:
        """Return the table of all named terms of the loops."""
        return self.hybrid.terms

    @cached_property
    def q(self) -> tuple[sp.Symbol, ...]:
        """Return the printed symbols of the actuated coordinates."""
        return tuple(self._symbol(tex, k) for k, tex in enumerate(self.members.q))

    @cached_property
    def theta(self) -> tuple[sp.Expr, ...]:
        """Return the printed symbols of the main-chain coordinates."""
        return self.chain.equations.notation.q

    @cached_property
    def joints(self) -> dict[str, sp.Symbol]:
        """Return the printed symbol of each configuration entry, keyed by the entry's name."""
        known = dict(zip(self.members.q, self.q, strict=True))
        known |= dict(zip(self.members.theta, self.theta, strict=True))
        return {
            name: known.get(tex) or self._symbol(tex, 20 + k)
            for k, (name, tex) in enumerate(self.members.of.items())
        }

    @cached_property
    def printed_terms(self) -> PrintedTerms:
        """Return the named terms of the loop equations with their printed symbols."""
        hybrid = self.hybrid
        known = dict(zip(hybrid.q, self.q, strict=True))
        known |= dict(zip(hybrid.theta, self.theta, strict=True))
        z = hybrid.arguments["z"].symbols
        pairs = zip(z, hybrid.variables, strict=True)
        known |= {symbol: self.joints[variable.name] for symbol, variable in pairs}
        return PrintedTerms(self.terms, self.chain.equations.notation, known)

    @cached_property
    def vectors(self) -> VectorPrinter:
        """Return the printer of equations that contain products of vectors."""
        notation = self.chain.equations.notation
        return VectorPrinter.of(notation)

    @cached_property
    def forward_steps(self) -> tuple[PrintedLoopStep, ...]:
        """Return the steps that solve the loops for known actuator positions."""
        return printed_steps(self.printed_terms, self.letters, self.hybrid.forward, 1, self.joints)

    @cached_property
    def backward_steps(self) -> tuple[PrintedLoopStep, ...]:
        """Return the steps that solve the loops for known main-chain joints."""
        first = after(self.forward_steps)
        return printed_steps(
            self.printed_terms, self.letters, self.hybrid.backward, first, self.joints
        )

    @cached_property
    def dead_values(self) -> dict[int, DeadValues]:
        """Return actuator positions at which solutions of a step merge, keyed by step number."""
        steps = self.forward_steps
        with_margin = [printed.number for printed in steps if printed.step.margin is not None]
        found = zip(with_margin, dead_values(self.hybrid), strict=True)
        return {number: values for number, values in found if values is not None}

    def constant(self, expression: sp.Expr) -> sp.Expr:
        """Convert a constant expression to printed symbols."""
        if self.terms.is_number(expression) and self.terms.size(expression) > MAX_WRITTEN:
            return self.printed_terms.notation.constant(self.terms.value(expression))
        addends = sp.Add.make_args(sp.expand(self.terms.spelled(expression)))
        return sp.Add(*map(self.printed_terms.constant, addends))

    def tex(self, expression: sp.Expr) -> str:
        """Format an expression in printed symbols as LaTeX on one line."""
        return self.printed_terms.tex(expression)

    def _symbol(self, tex: str, place: int) -> sp.Symbol:
        return self.chain.equations.notation.symbol(tex, (LENGTH, (80, place)))
