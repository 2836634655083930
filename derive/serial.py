"""Everything that a serial robot offers, derived once over one scope of shared terms."""

from collections.abc import Sequence
from dataclasses import dataclass

import sympy as sp

from .chain import Group, groups
from .differential import Representation, Twist, columns, hessian, rates, summed, weighted
from .errors import RobotError
from .forward import Forward, Pose
from .function import Argument, Result, SymbolicFunction, matrix_entries
from .robot import Joint, Robot
from .scope import Scope

REPRESENTATIONS: tuple[Representation, ...] = ("space", "body", "mixed")
SEEN: dict[Representation, str] = {
    "space": "of the point of the tool's body at the base origin, in base axes",
    "body": "of the tool's origin, in tool axes",
    "mixed": "of the tool's origin, in base axes",
}
FUNCTIONS = (
    "fk",
    "link_poses",
    "fk_jacobian_mixed",
    *(f"jacobian_{representation}" for representation in REPRESENTATIONS),
    *(f"jacobian_{representation}_dot" for representation in REPRESENTATIONS),
    "hessian_mixed",
    *(f"twist_{representation}" for representation in REPRESENTATIONS),
    *(f"acceleration_{representation}" for representation in REPRESENTATIONS),
)
"""Every function of a serial robot, in the order in which it is derived and written."""
TWIST_UNIT = "m/s, rad/s"
BOTTOM_ROW = (sp.Integer(0), sp.Integer(0), sp.Integer(0), sp.Integer(1))


@dataclass(frozen=True)
class Derivation:
    """A robot with the functions derived for it.

    Attributes:
        robot: The description.
        scope: The terms and constants that all functions share.
        groups: The chain in its smallest form.
        functions: What was derived, in the order in which it is written out.
    """

    robot: Robot
    scope: Scope
    groups: tuple[Group, ...]
    functions: tuple[SymbolicFunction, ...]

    def function(self, name: str) -> SymbolicFunction:
        """The function of that name.

        Raises:
            KeyError: There is none.
        """
        for function in self.functions:
            if function.name == name:
                return function
        raise KeyError(f"{self.robot.name} has no function {name!r}")


def derive(robot: Robot, functions: Sequence[str] = FUNCTIONS) -> Derivation:
    """Derives forward kinematics, Jacobians, their rates, Hessian, twists and accelerations.

    Args:
        robot: A serial robot of any joints, from a file, a URDF or built in Python.
        functions: Names from :data:`FUNCTIONS`; the rest is not derived.

    Raises:
        RobotError: A name is no function of a serial robot.
    """
    unknown = [name for name in functions if name not in FUNCTIONS]
    if unknown:
        known = ", ".join(FUNCTIONS)
        raise RobotError(f"{robot.name} has no function {', '.join(unknown)}; there are {known}")
    return _Derivation(robot).run([name for name in FUNCTIONS if name in functions])


class _Derivation:
    """The symbols of one robot and the functions made from them."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.scope = Scope({p.symbol: p.value for p in robot.parameters})
        count = len(robot.coordinates)
        self.q, self.qd, self.qdd = (_coordinates(name, count) for name in ("q", "qd", "qdd"))
        unit = _common_unit(robot.coordinates)
        self.arguments = {
            "q": Argument("q", self.q, (count,), unit, "joint coordinates"),
            "qd": Argument("qd", self.qd, (count,), f"{unit}/s", "joint rates"),
            "qdd": Argument("qdd", self.qdd, (count,), f"{unit}/s^2", "joint accelerations"),
        }
        self.groups = groups(robot, self.scope, robot.joint_values(self.q))
        self.forward = Forward(self.scope, self.groups)
        self.pose = f"T_{robot.base_frame}_{robot.tool_frame}"
        self.joint_values_D_q = robot.joint_values_D_q()
        self._joints: dict[Representation, list[Twist]] = {}
        self._rates: dict[Representation, list[Twist]] = {}

    def run(self, names: Sequence[str]) -> Derivation:
        functions = tuple(self._derived(name) for name in names)
        return Derivation(self.robot, self.scope, self.groups, functions)

    def joints(self, representation: Representation) -> list[Twist]:
        """Columns of a Jacobian by moving joints, derived when first asked for."""
        if representation not in self._joints:
            self._joints[representation] = columns(self.forward, representation)
        return self._joints[representation]

    def rates(self, representation: Representation) -> list[Twist]:
        """Time derivatives of those columns, derived when first asked for."""
        if representation not in self._rates:
            joints, speeds = self.joints(representation), self._of_joints(self.qd)
            self._rates[representation] = rates(self.scope, representation, joints, speeds)
        return self._rates[representation]

    def _derived(self, name: str) -> SymbolicFunction:
        for representation in REPRESENTATIONS:
            if name == f"jacobian_{representation}":
                return self.jacobian(representation)
            if name == f"jacobian_{representation}_dot":
                return self.jacobian_dot(representation)
            if name == f"twist_{representation}":
                return self.twist(representation)
            if name == f"acceleration_{representation}":
                return self.acceleration(representation)
        others = {
            "fk": self.fk,
            "link_poses": self.link_poses,
            "fk_jacobian_mixed": self.fk_jacobian_mixed,
            "hessian_mixed": self.hessian_mixed,
        }
        return others[name]()

    def fk(self) -> SymbolicFunction:
        tip, base = self.robot.tool_frame, self.robot.base_frame
        return self._function(
            "fk",
            f"Pose of the tool ({tip}) in the base frame ({base}).",
            f"{self.pose} = exp(S_1 q_1) ... exp(S_n q_n) M_{base}_{tip}",
            ("q",),
            self._pose_result(),
        )

    def link_poses(self) -> SymbolicFunction:
        poses = self.forward.link_poses()
        entries = tuple(entry for pose in poses for entry in _pose_entries(pose))
        names = ", ".join(self.robot.link_names)
        return self._function(
            "link_poses",
            "Pose of every link's frame in the base frame, in order from the base.",
            f"T[k] is the pose of link k of: {names}",
            ("q",),
            Result("T", entries, (len(poses), 4, 4), "1, m", "link poses"),
        )

    def jacobian(self, representation: Representation) -> SymbolicFunction:
        return self._function(
            f"jacobian_{representation}",
            f"Jacobian whose twist (v, omega) is {SEEN[representation]}.",
            f"V = J(q) qd with V = twist_{representation}(q, qd)",
            ("q",),
            self._jacobian_result(representation),
        )

    def fk_jacobian_mixed(self) -> SymbolicFunction:
        return self._function(
            "fk_jacobian_mixed",
            "Pose of the tool and mixed Jacobian in one call.",
            "(fk(q), jacobian_mixed(q))",
            ("q",),
            self._pose_result(),
            self._jacobian_result("mixed"),
        )

    def jacobian_dot(self, representation: Representation) -> SymbolicFunction:
        entries = self._by_coordinates(self.rates(representation))
        return self._function(
            f"jacobian_{representation}_dot",
            f"Time derivative of jacobian_{representation} at joint rates qd.",
            "J_dot = sum_k (d J / d q_k) qd_k",
            ("q", "qd"),
            Result("J_dot", entries, (6, len(self.q)), "m/s, 1/s", "rate of the Jacobian"),
        )

    def hessian_mixed(self) -> SymbolicFunction:
        table = hessian(self.scope, self.joints("mixed"))
        count = range(len(self.q))
        # From moving joints to coordinates: in what is derived by first, then in the columns.
        by_coordinate = [[self._combined(row, k) for row in table] for k in count]
        entries = [[self._combined(row, j) for row in by_coordinate] for j in count]
        flat = tuple(entries[j][k].entries[i] for i in range(6) for j in count for k in count)
        return self._function(
            "hessian_mixed",
            "Derivative of jacobian_mixed by the joint coordinates.",
            "H[:, j, k] = d jacobian_mixed[:, j] / d q_k",
            ("q",),
            Result("H", flat, (6, len(self.q), len(self.q)), "m, 1", "Hessian"),
        )

    def twist(self, representation: Representation) -> SymbolicFunction:
        V = weighted(self.scope, self.joints(representation), self._of_joints(self.qd))
        return self._function(
            f"twist_{representation}",
            f"Twist (v, omega) {SEEN[representation]}.",
            f"V = jacobian_{representation}(q) qd",
            ("q", "qd"),
            Result("V", V.entries, (6,), TWIST_UNIT, "twist, linear first"),
        )

    def acceleration(self, representation: Representation) -> SymbolicFunction:
        A = summed(
            self.scope,
            weighted(self.scope, self.joints(representation), self._of_joints(self.qdd)),
            weighted(self.scope, self.rates(representation), self._of_joints(self.qd)),
        )
        return self._function(
            f"acceleration_{representation}",
            f"Time derivative of twist_{representation} at rates qd and accelerations qdd.",
            f"A = jacobian_{representation}(q) qdd + jacobian_{representation}_dot(q, qd) qd",
            ("q", "qd", "qdd"),
            Result("A", A.entries, (6,), "m/s^2, rad/s^2", "acceleration, linear first"),
        )

    def _function(
        self,
        name: str,
        summary: str,
        identity: str,
        inputs: tuple[str, ...],
        *outputs: Result,
    ) -> SymbolicFunction:
        arguments = tuple(self.arguments[argument] for argument in inputs)
        return SymbolicFunction(name, summary, identity, arguments, outputs, self.scope)

    def _pose_result(self) -> Result:
        entries = _pose_entries(self.forward.tool_pose())
        return Result(self.pose, entries, (4, 4), "1, m", "pose of the tool")

    def _jacobian_result(self, representation: Representation) -> Result:
        entries = self._by_coordinates(self.joints(representation))
        return Result("J", entries, (6, len(self.q)), "m, 1", f"{representation} Jacobian")

    def _by_coordinates(self, joints: list[Twist]) -> tuple[sp.Expr, ...]:
        """Row-major entries of the columns, followers added to their leader's column."""
        return matrix_entries(self._combined(joints, k).entries for k in range(len(self.q)))

    def _combined(self, joints: list[Twist], coordinate: int) -> Twist:
        weights = self.joint_values_D_q[:, coordinate]
        own = [(joint, w) for joint, w in zip(joints, weights, strict=True) if w != 0]
        if len(own) == 1 and own[0][1] == 1:
            return own[0][0]
        return weighted(self.scope, [joint for joint, _ in own], [weight for _, weight in own])

    def _of_joints(self, rates_of_q: tuple[sp.Symbol, ...]) -> list[sp.Expr]:
        """Rates of the moving joints from those of the coordinates."""
        product = self.joint_values_D_q * sp.Matrix(rates_of_q)
        return [self.scope.let(entry) for entry in product]


def _coordinates(name: str, count: int) -> tuple[sp.Symbol, ...]:
    return tuple(sp.Symbol(f"{name}{k}", real=True) for k in range(1, count + 1))


def _common_unit(joints: tuple[Joint, ...]) -> str:
    units = {joint.unit for joint in joints}
    return units.pop() if len(units) == 1 else "rad or m"


def _pose_entries(pose: Pose) -> tuple[sp.Expr, ...]:
    axes, origin = pose
    return (*matrix_entries((*axes, origin)), *BOTTOM_ROW)
