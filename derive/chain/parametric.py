"""Parametric functions of a serial robot, with geometry and coordinates as inputs.

Each elementary motion that depends on q or on a parameter is one joint of an extended chain.
Therefore, the Jacobian of the extended chain contains the screw of every motion. The elementary
motion m has the value v_m (angle or length) and the screw S_m. The Jacobians J_q and J_p are sums
over the motions m:

    J_q = sum_m S_m dv_m/dq,    J_p = sum_m S_m dv_m/dp,

The formulas for J_q and J_p are exact for any function v_m(q, p).

Source:
    I.-W. Park, B.-J. Lee, S.-H. Cho, Y.-D. Hong, J.-H. Kim, Laser-based kinematic calibration of
    robot manipulator using differential kinematics, IEEE/ASME Transactions on
    Mechatronics 17 (2012).
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import sympy as sp

from ..model.geometry import Geometry, geometry
from ..model.kinds import JointKind
from ..model.placements import Placement, Translation, inverse, rotation, translation
from ..model.robot import Joint, SerialRobot
from ..terms.role import Role
from ..terms.symbolic_function import Argument, Result, SymbolicFunction, matrix_entries
from ..terms.terms import Terms
from .differential import Representation, Twist, columns, weighted
from .forward import Forward
from .gravity import GravityTorques, gravity_torques
from .groups import groups
from .kinematics import OBSERVED, arguments_of, common_unit, pose_entries

PARAMETRIC = (
    "fk_p",
    "jacobian_p",
    "identification_jacobian",
    "identification_jacobian_space",
    "identification_jacobian_body",
)
"""Names of all parametric functions, in output order."""
REPRESENTATION: dict[str, Representation] = {
    "identification_jacobian": "mixed",
    "identification_jacobian_space": "space",
    "identification_jacobian_body": "body",
}
ROLES = {
    "fk_p": "parametric pose",
    "jacobian_p": "parametric jacobian",
    **dict.fromkeys(REPRESENTATION, "identification jacobian"),
}
_TO_Z: dict[str, Placement] = {
    "x": rotation("y", sp.pi / 2),
    "y": rotation("x", -sp.pi / 2),
    "z": (),
}
"""Rotations that turn the z axis into the x, y or z axis, keyed by the name of the new axis."""


@dataclass(frozen=True)
class Parametric:
    """The extended chain of a serial robot, with one joint per variable elementary motion.

    Attributes:
        geometry: Geometry of the robot, with a symbol for each parameter.
        arguments: The arguments ``q`` and ``p``.
        values: Angle or length of each elementary motion of the extended chain, as a function of q,
            p and the gravity torques.
        forward: Forward kinematics of the extended chain.
        pose: Name of the tool pose.
        torques: The gravity torques, or None for a robot with rigid joints.
    """

    geometry: Geometry
    arguments: Mapping[str, Argument]
    values: tuple[sp.Expr, ...]
    forward: Forward
    pose: str
    torques: GravityTorques | None = None

    @classmethod
    def of(cls, robot: SerialRobot, terms: Terms) -> "Parametric":
        """Return the extended chain of a serial robot.

        Args:
            robot: The description.
            terms: Table of named terms.
        """
        q = arguments_of([joint.unit for joint in robot.coordinates])["q"]
        found = geometry(robot, q.symbols)
        chain, values = _lengthened(robot, found.motions)
        torques = gravity_torques(robot, robot.load, terms, q.symbols) if robot.load else None
        at = dict(zip(found.torques, torques.values, strict=True)) if torques else {}
        forward = Forward(terms, groups(chain, terms, [value.xreplace(at) for value in values]))
        pose = f"T_{robot.base_frame}_{robot.tool_frame}"
        return cls(found, {"q": q, "p": _argument(found)}, values, forward, pose, torques)

    def functions(self, names: Collection[str]) -> dict[str, SymbolicFunction]:
        """Derive the functions with the given names, in the order of ``PARAMETRIC``."""
        return {name: self._function(name) for name in PARAMETRIC if name in names}

    def _function(self, name: str) -> SymbolicFunction:
        if name == "fk_p":
            entries = pose_entries(self.forward.tool_pose())
            return self._made(
                name,
                "Pose of the tool in the base frame for any geometry.",
                f"{self.pose}(q, p); fk_p(q, nominal p) = fk(q)",
                Result(self.pose, entries, (4, 4), "1, m", "pose of the tool"),
            )
        if name == "jacobian_p":
            return self._jacobian(
                name,
                "mixed",
                "q",
                "Mixed Jacobian for any geometry.",
                "V = jacobian_p(q, p) qd; jacobian_p(q, nominal p) = jacobian_mixed(q)",
            )
        representation = REPRESENTATION[name]
        return self._jacobian(
            name,
            representation,
            "p",
            f"Twist (v, omega) {OBSERVED[representation]}, for each parameter's rate.",
            f"V = {name}(q, p) pd with constant q",
        )

    def _jacobian(
        self, name: str, representation: Representation, by: str, summary: str, identity: str
    ) -> SymbolicFunction:
        screws = columns(self.forward, representation)
        entries = matrix_entries(
            self._column(screws, variable).entries for variable in self.arguments[by].symbols
        )
        shape = (6, self.arguments[by].size)
        return self._made(
            name, summary, identity, Result("J", entries, shape, "m, 1", f"derivative by {by}")
        )

    def _column(self, screws: Sequence[Twist], variable: sp.Symbol) -> Twist:
        moved = self._rates[variable]
        return weighted(
            self.forward.terms,
            [screws[m] for m in moved],
            [self.forward.terms.let(rate) for rate in moved.values()],
        )

    @cached_property
    def _rates(self) -> dict[sp.Symbol, dict[int, sp.Expr]]:
        """The nonzero derivatives dv_m/dx of the motion values, as ``{x: {m: derivative}}``."""
        found: dict[sp.Symbol, dict[int, sp.Expr]] = {}
        symbols = [value.free_symbols for value in self.values]
        for variable in (x for argument in self.arguments.values() for x in argument.symbols):
            sources = {variable, *self.geometry.torques}
            rates = {
                m: self._rate(value, variable)
                for m, value in enumerate(self.values)
                if not sources.isdisjoint(symbols[m])
            }
            found[variable] = {m: rate for m, rate in rates.items() if rate != 0}
        return found

    def _rate(self, value: sp.Expr, variable: sp.Symbol) -> sp.Expr:
        """Return the derivative of a motion value v_m with respect to a coordinate or parameter.

        The derivative with respect to a coordinate includes the change of the gravity torques.
        """
        rate = sp.diff(value, variable)
        if self.torques is None:
            return rate
        symbols = self.geometry.torques
        if variable in self.geometry.q:
            k = self.geometry.q.index(variable)
            for symbol, row in zip(symbols, self.torques.D_q, strict=True):
                rate += sp.diff(value, symbol) * row[k]
        return rate.xreplace(dict(zip(symbols, self.torques.values, strict=True)))

    def _made(self, name: str, summary: str, identity: str, result: Result) -> SymbolicFunction:
        inputs = (self.arguments["q"], self.arguments["p"])
        role = Role(ROLES[name], "actuators")
        terms = self.forward.terms
        return SymbolicFunction(name, summary, identity, inputs, (result,), terms, role=role)


def _argument(found: Geometry) -> Argument:
    symbols = tuple(parameter.symbol for parameter in found.parameters)
    unit = common_unit(parameter.unit for parameter in found.parameters)
    return Argument("p", symbols, (len(symbols),), unit, "parameters of the geometry")


def _lengthened(robot: SerialRobot, motions: Placement) -> tuple[SerialRobot, tuple[sp.Expr, ...]]:
    joints: list[Joint] = []
    values: list[sp.Expr] = []
    waiting: Placement = ()

    def add(kind: JointKind, axis: str, value: sp.Expr) -> None:
        nonlocal waiting
        to_z = _TO_Z[axis]
        joints.append(Joint(f"m{len(joints) + 1}", kind, waiting + to_z, inverse(to_z)))
        values.append(value)
        waiting = ()

    for motion in motions:
        if isinstance(motion, Translation):
            for axis, length in zip("xyz", motion.vector, strict=True):
                if length.free_symbols:
                    add("prismatic", axis, length)
            fixed = (part if not part.free_symbols else sp.S.Zero for part in motion.vector)
            waiting += translation(*fixed)
        elif motion.angle.free_symbols:
            add("revolute", motion.axis, motion.angle)
        else:
            waiting += (motion,)
    longer = replace(
        robot.uncoupled, joints=tuple(joints), base=(), tool=waiting, parameters=(), load=None
    )
    return longer, tuple(values)
