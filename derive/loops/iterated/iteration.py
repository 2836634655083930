"""Joint values of loops without a closed form.

A solver closes the loops by Newton's method (``closure_equations``). The solver returns the loop
variables w and their derivatives, which follow from the implicit function theorem.
"""

import math
from collections.abc import Collection, Container, Iterable, Sequence
from dataclasses import replace
from functools import cached_property, partial

import sympy as sp

from ...chain.coordinates import ThroughLoops
from ...chain.kinematics import coordinates
from ...terms.role import Role
from ...terms.symbolic_function import Argument, Call, Result, SymbolicFunction
from ...terms.tangents import Tangent
from ..functions.maps import CONFIGURATION, Joints, Maker, backward_makers, forward_makers
from ..functions.tool import open_chain
from ..model.constraints import swing_angles
from ..solve.solved_loops import SolvedLoops
from .closure_equations import LoopClosure

SYSTEM = 400
"""Approximate number of operations per Newton step for six unknowns."""
STEPS = 8
"""Approximate number of Newton steps from the reference to the solution."""
NEAR = 2
"""Approximate number of Newton steps from a nearby configuration to the solution."""
FIRST = "at"
"""Name of the solver function that closes the loops from the reference."""


class Iteration:
    """The loop variables and their derivatives, computed by calls of a numerical solver.

    Attributes:
        closure: The equations of the loops.
        system: Name of the closure equations in the C code.
        w: The loop variables, which the solver computes.
    """

    def __init__(self, closure: LoopClosure) -> None:
        """Create the symbols for the results of the loop solver.

        Args:
            closure: The equations of the loops.
        """
        self.closure, self.hybrid = closure, closure.hybrid
        self._input, self._is_of_chain = closure.inputs, closure.inputs == "theta"
        self.system = "chain_loops" if self._is_of_chain else "loops"
        self._prefix = "_v" if self._is_of_chain else "_w"
        self._n, self._size = len(closure.given), len(closure.names)
        unit = "rad or m"
        self.w = self._vector("w", unit)
        self._wd = self._vector("wd", f"({unit})/s")
        self._wdd = self._vector("wdd", f"({unit})/s^2")
        self._w_q = self._table("w_q", self._size, self._n)
        self._w_q_dot = self._table("w_q_dot", self._size, self._n)
        self._w_q_q = self._table("w_q_q", self._n, self._size, self._n)
        self._margin = replace(self._table("square", 1), unit="1", meaning="margin")

    def _vector(self, name: str, unit: str) -> Argument:
        """Return one symbol per loop variable.

        If the actuated coordinates are the inputs, the main-chain joints keep their symbols
        ``theta``. Expressions that contain the symbols ``theta`` therefore also hold for the joint
        values that the solver returns.
        """
        symbols = list(coordinates(f"{self._prefix}{name[1:]}", self._size))
        if not self._is_of_chain:
            theta = self.hybrid.arguments[f"theta{name[1:]}"].symbols
            for joint, symbol in zip(self.hybrid.robot.moving, theta, strict=True):
                symbols[self.closure.names.index(joint.name)] = symbol
        return Argument(name, tuple(symbols), (self._size,), unit, "variables of the loops")

    def _table(self, name: str, *shape: int) -> Argument:
        symbols = coordinates(f"{self._prefix}_{name}_", math.prod(shape))
        return Argument(name, symbols, shape, "1, m, 1/m", "derivative of the variables")

    # --- joint values and rates ---

    def named(self, names: Iterable[str]) -> tuple[sp.Expr, ...]:
        """Return the values of the named joints, swing angles and cylinders."""
        return tuple(self._values[name] for name in names)

    @cached_property
    def _values(self) -> dict[str, sp.Expr]:
        h = self.hybrid
        values = dict(zip(self.closure.names, self.w.symbols, strict=True))
        return values | swing_angles(h.mechanism, h.terms, values)

    @cached_property
    def _ratios(self) -> dict[int, tuple[int, sp.Expr]]:
        """Return the coordinate index and the coordinate ratio of each input variable.

        The coordinate ratio is the value of the input variable divided by the value of its
        coordinate.
        """
        driven = [c.ratio for c in self.hybrid.mechanism.coordinates]
        ratios = [sp.S.One] * self._n if self._is_of_chain else driven
        return {k: (j, ratios[j]) for j, k in enumerate(self.closure.given)}

    def units(self) -> list[Tangent]:
        """Return the joint rates for each coordinate that moves alone at unit speed."""
        return [self._unit(k) for k in range(self._n)]

    def _unit(self, k: int) -> Tangent:
        rates: dict[sp.Symbol, sp.Expr] = {}
        for i, symbol in enumerate(self.w.symbols):
            j, ratio = self._ratios.get(i, (k, self._w_q.symbols[i * self._n + k]))
            rates[symbol] = ratio if j == k else sp.S.Zero
        first = k * self._size * self._n
        second = self._w_q_q.symbols[first : first + self._size * self._n]
        return Tangent(self.hybrid.terms, rates | dict(zip(self._w_q.symbols, second, strict=True)))

    def along(self, qd: Sequence[sp.Symbol]) -> Tangent:
        """Return the joint rates for coordinate rates qd."""
        slopes = zip(self._w_q.symbols, self._w_q_dot.symbols, strict=True)
        return Tangent(self.hybrid.terms, self._moved(self.w, self._wd, qd) | dict(slopes))

    def twice(self, qd: Sequence[sp.Symbol], qdd: Sequence[sp.Symbol]) -> Tangent:
        """Return joint rates and accelerations from coordinate rates qd and accelerations qdd."""
        first, second = self._moved(self.w, self._wd, qd), self._moved(self._wd, self._wdd, qdd)
        return Tangent(self.hybrid.terms, first | second | dict(zip(qd, qdd, strict=True)))

    def _moved(
        self, of: Argument, rates: Argument, given: Sequence[sp.Symbol]
    ) -> dict[sp.Symbol, sp.Expr]:
        found: dict[sp.Symbol, sp.Expr] = dict(zip(of.symbols, rates.symbols, strict=True))
        for i, (j, ratio) in self._ratios.items():
            found[of.symbols[i]] = self.hybrid.terms.let(ratio * given[j])
        return found

    # --- functions ---

    @property
    def joints(self) -> Joints:
        """All joint values as functions of the input coordinates."""
        passive = self.hybrid.mechanism.passive
        interval = ", swing angles between -pi and pi" if self.hybrid.mechanism.swings else ""
        return Joints(
            self.hybrid, self._input, self.named, self, passive, interval, self.with_calls
        )

    def tool_functions(self, names: Collection[str]) -> dict[str, SymbolicFunction]:
        """Return the requested functions of the tool, by function name."""
        chain = open_chain(self.hybrid)
        motion = ThroughLoops(chain.motion.values, self)
        found = replace(chain, motion=motion, arguments=self.hybrid.arguments).functions(names)
        return {name: self.with_calls(function) for name, function in found.items()}

    def margin(self, name: str, summary: str, identity: str) -> SymbolicFunction:
        """Build the margin function: (det c_u)^2 relative to its value at the reference."""
        loops = ", ".join(loop_joint.name for loop_joint in self.hybrid.mechanism.loop_joints)
        result = Result("margin", self._margin.symbols, (1,), "1", "margin")
        made = self.hybrid.function(
            name, summary, identity, (self._input,), result, role=Role("margin")
        )
        return replace(self.with_calls(made), steps=(loops,))

    def with_calls(self, function: SymbolicFunction, seed: str = "") -> SymbolicFunction:
        """Add the solver calls that a function needs.

        Args:
            function: The function.
            seed: Name of the input that contains the start configuration, or "" to start the
                iteration at the reference.
        """
        needed = {s for _, term in function.definitions() for s in term.free_symbols}
        needed |= {s for r in function.outputs for entry in r.entries for s in entry.free_symbols}
        unknown, x = len(self.closure.unknown), self._input
        at = Call(self.system, FIRST, (x,), (self.w,), SYSTEM * STEPS)
        if seed:
            at = replace(at, entry="seeded", inputs=(x, seed), operations=SYSTEM * NEAR)
        factored = Call(self.system, "factored", (), (), unknown**3)
        found: list[Call] = []
        for call in reversed(self._derivatives()):
            (output,) = call.outputs
            is_passed = any(output.name in later.inputs for later in found)
            if is_passed or not needed.isdisjoint(output.symbols):
                found.insert(0, call)
        if found:
            return replace(function, calls=(at, factored, *found))
        return function if needed.isdisjoint(self.w.symbols) else replace(function, calls=(at,))

    def _derivatives(self) -> list[Call]:
        """Return the solver calls for derivatives, in the order of their dependencies."""
        n, unknown, x = self._n, len(self.closure.unknown), self._input
        call, system = partial(Call, self.system), 4 * unknown * unknown
        return [
            call("rates", (f"{x}d",), (self._wd,), system),
            call("accelerations", ("wd", f"{x}dd"), (self._wdd,), 2 * system),
            call("w_D_q", (), (self._w_q,), n * system),
            call("w_D_q_dot", ("wd", "w_q"), (self._w_q_dot,), n * system),
            call("w_D_q_q", ("w_q",), (self._w_q_q,), n * n * system),
            call("margin", (), (self._margin,), unknown),
        ]


def inner_makers(closure: LoopClosure) -> dict[str, Maker]:
    """Return the builders of the functions that the solver calls, by name."""
    return {name: partial(_inner, closure, name) for name in closure.functions}


def _inner(closure: LoopClosure, name: str, _: SolvedLoops) -> SymbolicFunction:
    return closure.functions[name]


def iterated_makers(iteration: Iteration, known: Container[str]) -> dict[str, Maker]:
    """Return the builders of the maps between actuated and other joints, keyed by function name.

    Args:
        iteration: The loop variables as functions of the actuated coordinates.
        known: Names of the functions between actuated and other joints that already have a closed
            form.
    """
    found = forward_makers(iteration.joints)
    found["configuration_D_q"] = lambda _: CONFIGURATION.derivative(iteration.joints)
    found["margin"] = lambda _: iteration.margin(
        "margin",
        "Square of the determinant of the loops' equations, 1 at the reference.",
        "0 at a singularity, where the loops do not determine the unknown variables; NaN if the "
        "loops do not close or if a singularity is between the reference and q",
    )
    found["configuration_near"] = lambda _: _near(iteration, "configuration_near")
    found["fk_near"] = lambda _: _near(iteration, "fk_near")
    closure = None if "actuators" in known else iteration.closure.of_chain
    if closure is None:
        return found
    of_chain = Iteration(closure)
    found |= backward_makers(of_chain.joints)
    found["actuator_margin"] = lambda _: of_chain.margin(
        "actuator_margin",
        "Squared determinant of the closure equations with the main chain fixed.",
        "1 at the reference, 0 at a singularity, NaN if the loops do not close",
    )
    return found


def _near(iteration: Iteration, name: str) -> SymbolicFunction:
    """Build a function that starts the iteration at a nearby configuration."""
    h = iteration.hybrid
    z = h.arguments["z"]
    seed = replace(
        z, name="seed", meaning="nearby configuration; swing angles of struts are ignored"
    )
    found = Result("z", CONFIGURATION.values(iteration.joints), z.shape, z.unit, z.meaning)
    text = "from a nearby configuration by at most eight Newton steps"
    if name == "fk_near":
        pose = iteration.tool_functions(["fk"])["fk"].outputs
        summary, identity = (
            f"Pose of the tool and configuration, {text}.",
            "(fk(q), z) on the branch of the seed; NaN if the seed is too far from q",
        )
    else:
        pose = ()
        summary, identity = (
            f"All joints, swing angles and cylinder lengths, {text}.",
            "constraint(z) = 0; NaN if the seed is too far from q",
        )
    made = h.function(
        name, summary, identity, ("q",), *pose, found, role=Role("near", codomain="configuration")
    )
    return iteration.with_calls(replace(made, inputs=(*made.inputs, seed)), seed=seed.name)
