"""Parametric functions of a robot with loops.

Parametric functions have the geometry parameters p as an additional input. The loop equations are
c(w, p) = 0 with the variables w = (q, u). The vector u contains the values of passive joints and
cylinders. Newton's method in C solves the loop equations for u. The Newton iteration starts at the
configuration of the nominal robot with coordinates q. Let J_u, J_q and J_p be the Jacobians of the
tool with respect to u, q and p. The implicit function theorem gives the total Jacobian J of the
tool with respect to q, or to p.

    L = J_u c_u^-1,    J = J_q - L c_q  for q,    J = J_p - L c_p  for p.

The computation of L = J_u c_u^-1 requires the solution of six linear systems, regardless of the
number of parameters.

Source:
    J. M. Hollerbach, W. Khalil, M. Gautier, Model identification, Springer Handbook of Robotics,
    chapter 6, for closed loops.
"""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import cached_property

import sympy as sp

from ...chain.kinematics import OBSERVED, common_unit, coordinates, pose_entries
from ...chain.parametric import PARAMETRIC, REPRESENTATION, ROLES
from ...model.errors import DescriptionError
from ...model.mechanism import Mechanism
from ...model.placements import Placement, translation
from ...model.robot import PointMass
from ...terms.role import Role
from ...terms.symbolic_function import Argument, Call, Result, SymbolicFunction
from ...terms.vectors import ORIGIN, cross, subtracted
from ..iterated.closure_equations import on_balls
from ..model.constraints import configuration_names
from ..model.coupling_equations import residual_of, unit_of
from ..model.loop_rows import Row, loop_rows
from ..model.mechanism_geometry import MechanismGeometry, mechanism_geometry
from ..model.motions import BASE, ElementaryMotion, Reached, bodies, gradient
from ..solve.solved_loops import SolvedLoops

SYSTEM = "loops_p"
"""Name of the system of closure equations in the C code."""
START = "configuration"
"""Name of the function that returns the initial values of Newton's method."""
PARTS = "parts_p"
"""Name of the function that returns the frames and lengths of a robot file."""
OPERATIONS = 4000
"""Approximate number of operations of three Newton steps with six unknowns."""


class ParametricLoops:
    """The parametric functions of one mechanism."""

    def __init__(self, hybrid: SolvedLoops) -> None:
        """Create the symbols of the variables and parameters.

        Args:
            hybrid: The robot.

        Raises:
            DescriptionError: The robot has no loops, or the numbers of equations and unknown
                variables differ.
        """
        self.hybrid, self.terms = hybrid, hybrid.terms
        self.mechanism = mechanism = on_balls(hybrid.mechanism)
        variables = configuration_names(mechanism)
        actuated = [c.moves for c in mechanism.coordinates]
        self.unknown = [v for v in variables if v.name not in actuated]
        q = hybrid.q
        u = coordinates("_u", len(self.unknown))
        symbols = dict(zip((v.name for v in self.unknown), u, strict=True))
        self.geometry: MechanismGeometry = mechanism_geometry(
            hybrid.mechanism, self.terms, q, symbols
        )
        w, p = (*q, *u), tuple(parameter.symbol for parameter in self.geometry.parameters)
        unit = common_unit(parameter.unit for parameter in self.geometry.parameters)
        self.arguments = {
            "q": hybrid.arguments["q"],
            "w": Argument("w", w, (len(w),), "rad or m", "coordinates and unknown variables"),
            "p": Argument("p", p, (len(p),), unit, "parameters of the geometry"),
        }
        self._check()

    @cached_property
    def units(self) -> list[str]:
        """The unit of each loop equation, m or 1."""
        return [row.unit for row in self._rows]

    @cached_property
    def size(self) -> float:
        """The longest translation or rod (meter), by which lengths are divided."""
        return float(f"{self.hybrid.numbers.size:.3g}")

    @cached_property
    def inner(self) -> Mapping[str, SymbolicFunction]:
        """The functions of w and p that the parametric functions call, by name."""
        found = [self._closure(), self._closure_by_p(), self._tool()]
        found += [self._tool_by(name) for name in ("w", "p")]
        found.append(self._parts())
        return {function.name: function for function in found}

    def functions(self, names: Collection[str]) -> dict[str, SymbolicFunction]:
        """Return the parametric functions with given names, in the order of ``PARAMETRIC``."""
        return {name: self._parametric(name) for name in PARAMETRIC if name in names}

    def called(self, name: str) -> list[str]:
        """Return the names of the functions that a parametric function needs."""
        return [START, "closure_p", *(c.entry for c in self._calls(name) if not c.system)]

    @cached_property
    def _bodies(self) -> dict[str, Reached]:
        steps = self.geometry.steps
        return bodies(self.hybrid.mechanism, self.terms, self.geometry.base, steps)

    @cached_property
    def _rows(self) -> list[Row]:
        return loop_rows(self.hybrid.mechanism, self.terms, self.geometry, self._bodies)

    @cached_property
    def _end(self) -> Reached:
        return self._bodies[self.mechanism.tool_body].moved(self.terms, self.geometry.tool)

    def _check(self) -> None:
        name, (m, n) = self.mechanism.name, (len(self._rows), len(self.unknown))
        if not m:
            raise DescriptionError(
                f"robot {name}: the robot has no loops; use the parametric functions of its main "
                "chain"
            )
        if m != n:
            raise DescriptionError(
                f"{name}: redundant loop equations hold only for the nominal geometry, so there "
                f"are no parametric functions; {m} loop equations for {n} unknown variables"
            )

    def _closure(self) -> SymbolicFunction:
        entries = tuple(row.residual for row in self._rows)
        slopes = [row.gradient(self.terms, self.arguments["w"].symbols) for row in self._rows]
        count = len(entries)
        return self._function(
            "closure_p",
            "Closure equations for any geometry, zero if the loops are closed.",
            "closure_p(w, p) = 0",
            Result("residual", entries, (count,), "m or 1", "residuals"),
            Result(
                "residual_D_w",
                _flat(slopes),
                (count, self.arguments["w"].size),
                "1, m, 1/m",
                "their derivative",
            ),
        )

    def _closure_by_p(self) -> SymbolicFunction:
        slopes = [row.gradient(self.terms, self.arguments["p"].symbols) for row in self._rows]
        shape = (len(slopes), self.arguments["p"].size)
        return self._function(
            "closure_p_D_p",
            "Derivative of the closure equations with respect to the parameters.",
            "residual_D_w wd + residual_D_p pd = 0",
            Result(
                "residual_D_p", _flat(slopes), shape, "1, m, 1/m", "derivative with respect to p"
            ),
        )

    def _tool(self) -> SymbolicFunction:
        h = self.hybrid.robot
        name = f"T_{h.base_frame}_{h.tool_frame}"
        return self._function(
            "tool_p",
            "Tool pose for any geometry, from the coordinates and unknown variables.",
            f"{name}(w, p)",
            Result(name, pose_entries(self._end.pose), (4, 4), "1, m", "pose of the tool"),
        )

    def _tool_by(self, name: str) -> SymbolicFunction:
        symbols = self.arguments[name].symbols
        twists = [(self._twist(motion), motion) for motion in self._end.motions]
        rows = [
            gradient(self.terms, [(twist[k], motion) for twist, motion in twists], symbols)
            for k in range(6)
        ]
        return self._function(
            f"tool_p_D_{name}",
            f"Twist (v, omega) of the tool in base axes per unit rate of {name}.",
            f"V = tool_p_D_{name}(w, p) {name}d with the other input constant",
            Result(
                "J", _flat(rows), (6, len(symbols)), "m, 1", f"derivative with respect to {name}"
            ),
        )

    def _parts(self) -> SymbolicFunction:
        """Build the function for the frames of a robot file, in file order."""
        w = self.arguments["w"].symbols
        placements = file_parts(self.hybrid.mechanism, self.geometry, w)
        frames = [BASE.moved(self.terms, placement).pose for placement in placements]
        entries = tuple(entry for pose in frames for entry in pose_entries(pose))
        return replace(
            self._function(
                PARTS,
                "Frames of the joints and loop ends for any geometry, at zero coordinates.",
                "the frame values of a robot file",
                Result("frames", entries, (len(frames), 4, 4), "1, m", "frames in body axes"),
            ),
            inputs=(self.arguments["p"],),
        )

    def _twist(self, motion: ElementaryMotion) -> tuple[sp.Expr, ...]:
        """Return the mixed twist of the tool if one elementary motion has unit speed."""
        if motion.point is None:
            return (*motion.axis, *ORIGIN)
        lever = subtracted(self.terms, self._end.pose[1], motion.point)
        return (*cross(self.terms, motion.axis, lever), *motion.axis)

    def _function(
        self, name: str, summary: str, identity: str, *outputs: Result
    ) -> SymbolicFunction:
        arguments = (self.arguments["w"], self.arguments["p"])
        role = Role("closure", "configuration")
        return SymbolicFunction(name, summary, identity, arguments, outputs, self.terms, role=role)

    def _parametric(self, name: str) -> SymbolicFunction:
        """Build a parametric function from the results of its solver calls."""
        h = self.hybrid.robot
        if name == "fk_p":
            pose = f"T_{h.base_frame}_{h.tool_frame}"
            summary = "Pose of the tool in the base frame for any geometry."
            identity = f"{pose}(q, p); fk_p(q, nominal p) = fk(q)"
            entries = self._table("T", 4, 4).symbols
            result = Result(pose, entries, (4, 4), "1, m", "pose of the tool")
        elif name == "jacobian_p":
            summary = "Mixed Jacobian for any geometry."
            identity = "V = jacobian_p(q, p) qd; jacobian_p(q, nominal p) = jacobian_mixed(q)"
            result = self._result(len(self.hybrid.q), "derivative by q")
        else:
            summary = (
                f"Twist (v, omega) {OBSERVED[REPRESENTATION[name]]}, for each parameter's rate."
            )
            identity = f"V = {name}(q, p) pd with constant q"
            result = self._result(self.arguments["p"].size, "derivative by p")
        # Only the call of the loop solver has q as an input. All statements after the solver call
        # use the solved variables w, which are NaN if the loops do not close.
        q = self.arguments["q"]
        q = replace(q, symbols=coordinates("_given", q.size))
        return SymbolicFunction(
            name,
            summary,
            f"{identity}; NaN if the loops do not close near the nominal configuration",
            (q, self.arguments["p"]),
            (result,),
            self.terms,
            role=Role(ROLES[name], "actuators"),
            calls=self._calls(name),
        )

    def _calls(self, name: str) -> tuple[Call, ...]:
        """Return the function calls with which the code of a parametric function starts."""
        closed = Call(SYSTEM, "at", ("q", "p"), (self.arguments["w"],), OPERATIONS)
        if name == "fk_p":
            return (closed, self._called("tool_p", "T"))
        L, n = self._table("L", 6, len(self.units)), len(self.hybrid.q)
        levers = Call(SYSTEM, "levers", ("J_w",), (L,), 0)
        calls = [closed, self._called("tool_p_D_w", "J_w"), levers]
        if name == "jacobian_p":
            J = self._table("J_mixed", 6, n)
            return (*calls, Call(SYSTEM, "by_q", ("J_w", "L"), (J,), 0))
        J, representation = (
            self._table("J_mixed", 6, self.arguments["p"].size),
            REPRESENTATION[name],
        )
        calls += [self._called("tool_p_D_p", "J_p"), self._called("closure_p_D_p", "c_p")]
        by_p = Call(SYSTEM, "by_p", ("J_p", "L", "c_p"), (J,), 0)
        if representation == "mixed":
            return (*calls, by_p)
        turned = Call(SYSTEM, f"in_{representation}", ("T", "J_mixed"), (), 0)
        return (*calls, self._called("tool_p", "T"), by_p, turned)

    def _called(self, name: str, array: str) -> Call:
        """Return a function call with the arguments w and p that stores its result in an array."""
        shape = self.inner[name].outputs[0].shape
        return Call("", name, ("w", "p"), (self._table(array, *shape),), 0)

    def _result(self, columns: int, meaning: str) -> Result:
        """Return the declaration of the result J, whose entries the last solver call computes."""
        entries = self._table("J_mixed", 6, columns).symbols
        return Result("J", entries, (6, columns), "m, 1", meaning)

    def _table(self, name: str, *shape: int) -> Argument:
        symbols = coordinates(f"_{name}_", math.prod(shape))
        return Argument(name, symbols, shape, "1, m, 1/m", "result of a call")


def _flat(rows: Sequence[Sequence[sp.Expr]]) -> tuple[sp.Expr, ...]:
    return tuple(entry for row in rows for entry in row)


def file_parts(
    mechanism: Mechanism, geometry: MechanismGeometry, coordinates: Collection[sp.Symbol]
) -> list[Placement]:
    """Return the frames and lengths of a robot file.

    All coordinates and variables are 0.

    A robot file contains no body frames, so the frame of a body is the frame of its parent joint.
    Placements on the child body of a joint include the constant transform after the joint, because
    a robot file has no body frames.

    Args:
        mechanism: The description.
        geometry: The geometry of the robot as variables.
        coordinates: The symbols of the coordinates and the unknown variables.

    Returns:
        The frames in the order of the file: the base body in the base frame, each joint in its
        parent body, both ends of each closure or strut, and the tool.
        struts: the frame at the second end of a strut, relative to the frame at its first end.
    """
    zero: dict[sp.Symbol, sp.Expr] = dict.fromkeys(coordinates, sp.S.Zero)
    behind: dict[str, Placement] = {mechanism.base_frame: ()}
    frames = [geometry.base]
    for joint in mechanism.joints:
        step = geometry.steps[joint.link]
        frames.append(
            behind[joint.parent] + step.before + tuple(motion.at(zero) for motion in step.motion)
        )
        behind[joint.link] = step.after
    for loop_joint in mechanism.loop_joints:
        a, b = geometry.ends[loop_joint.name]
        frames += [behind[loop_joint.a.body] + a, behind[loop_joint.b.body] + b]
    frames.append(behind[mechanism.tool_body] + geometry.tool)
    for strut in mechanism.struts:
        length = geometry.lengths[strut.name].xreplace(zero)
        frames.append(translation(length, sp.S.Zero, sp.S.Zero))
    numbers = {p.symbol: p.value for p in mechanism.parameters}
    for mass in masses_of_links(mechanism):
        at = (x.xreplace(numbers) for x in mass.at)
        frames.append(behind[mass.link] + translation(*at))
    at_zero = {name: value.xreplace(zero) for name, value in geometry.values.items()}
    for coupling in mechanism.couplings:
        unit = sp.S.One if unit_of(mechanism, coupling) == "m" else 180 / sp.pi
        offset = geometry.offsets[coupling.joint].xreplace(zero)
        shift = offset - coupling.offset - residual_of(coupling, at_zero)
        frames.append(translation(shift * unit, sp.S.Zero, sp.S.Zero))
    return frames


def masses_of_links(mechanism: Mechanism) -> list[PointMass]:
    """Return the point masses on links, without the masses on sections of struts."""
    masses = mechanism.load.masses if mechanism.load else ()
    return [mass for mass in masses if mass.link in mechanism.joint_of]
