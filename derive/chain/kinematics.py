"""Functions of a chain: poses, Jacobians and their derivatives, twists, accelerations.

The coordinates of a robot can differ from its joint values. A ``Motion`` maps coordinates to joint
values. In a serial robot, the joint values are linear functions of the coordinates. In a robot with
loops, the joint values follow from the loop equations.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass

import sympy as sp

from ..model.robot import SerialRobot
from ..terms.role import Role
from ..terms.symbolic_function import Argument, Result, SymbolicFunction, matrix_entries
from ..terms.terms import Terms
from .coordinates import Matrix, Motion
from .differential import Representation, Twist, columns, hessian, rates, summed, weighted
from .forward import Forward, Pose
from .groups import Group

REPRESENTATIONS: tuple[Representation, ...] = ("space", "body", "mixed")
OBSERVED: dict[Representation, str] = {
    "space": "of the point of the tool body at the base origin, in base axes",
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
"""Names of all kinematic functions of a chain, in output order."""
ROLES = {
    "fk": "pose",
    "link_poses": "link poses",
    "fk_jacobian_mixed": "pose and jacobian",
    "hessian_mixed": "hessian",
    **{f"jacobian_{representation}": "jacobian" for representation in REPRESENTATIONS},
    **{f"jacobian_{representation}_dot": "jacobian rate" for representation in REPRESENTATIONS},
    **{f"twist_{representation}": "twist" for representation in REPRESENTATIONS},
    **{f"acceleration_{representation}": "acceleration" for representation in REPRESENTATIONS},
}
"""Role of each kinematic function, such as ``pose`` or ``twist``, keyed by function name."""
TWIST_UNIT = "m/s, rad/s"
BOTTOM_ROW = (sp.Integer(0), sp.Integer(0), sp.Integer(0), sp.Integer(1))


@dataclass(frozen=True)
class Kinematics:
    """A chain and the named terms of its functions.

    Attributes:
        robot: The description of the chain.
        terms: Table of named terms.
        motion: The joint motion as a function of the coordinates.
        arguments: The arguments ``q``, ``qd`` and ``qdd``.
        forward: Forward kinematics of the chain in its minimal form.
        links: Forward kinematics of the chain with all links.
    """

    robot: SerialRobot
    terms: Terms
    motion: Motion
    arguments: Mapping[str, Argument]
    forward: Forward
    links: Forward

    @classmethod
    def of(
        cls,
        robot: SerialRobot,
        terms: Terms,
        groups: Sequence[Group],
        motion: Motion,
        arguments: Mapping[str, Argument],
        links: Forward | None = None,
    ) -> "Kinematics":
        """Return the kinematics of a chain that consists of groups of parallel axes.

        If ``groups`` does not contain all links, ``links`` contains the forward kinematics of all
        links.
        """
        forward = Forward(terms, groups)
        return cls(robot, terms, motion, arguments, forward, links or forward)

    def functions(self, names: Collection[str]) -> dict[str, SymbolicFunction]:
        """Derive the kinematic functions with the given names.

        The order of the function names in ``names`` does not affect the names of the terms.
        """
        derivation = _Derivation(self)
        return {name: derivation.function(name) for name in FUNCTIONS if name in names}

    def function(self, name: str) -> SymbolicFunction:
        """Derive the kinematic function with the given name from ``FUNCTIONS``."""
        return self.functions([name])[name]


class _Derivation:
    def __init__(self, chain: Kinematics) -> None:
        self.robot, self.terms, self.motion = chain.robot, chain.terms, chain.motion
        self.arguments, self.forward, self.links = chain.arguments, chain.forward, chain.links
        self.q, self.qd, self.qdd = (chain.arguments[name].symbols for name in ("q", "qd", "qdd"))
        self.pose = f"T_{chain.robot.base_frame}_{chain.robot.tool_frame}"
        self._columns: dict[Representation, list[Twist]] = {}
        self._columns_dot: dict[Representation, list[Twist]] = {}

    def function(self, name: str) -> SymbolicFunction:
        for representation in REPRESENTATIONS:
            if name == f"jacobian_{representation}":
                return self._jacobian(representation)
            if name == f"jacobian_{representation}_dot":
                return self._jacobian_dot(representation)
            if name == f"twist_{representation}":
                return self._twist(representation)
            if name == f"acceleration_{representation}":
                return self._acceleration(representation)
        others = {
            "fk": self._fk,
            "link_poses": self._link_poses,
            "fk_jacobian_mixed": self._fk_jacobian_mixed,
            "hessian_mixed": self._hessian_mixed,
        }
        return others[name]()

    def _joints(self, representation: Representation) -> list[Twist]:
        if representation not in self._columns:
            self._columns[representation] = columns(self.forward, representation)
        return self._columns[representation]

    def _rates(self, representation: Representation) -> list[Twist]:
        if representation not in self._columns_dot:
            joints, speeds = self._joints(representation), self.motion.speeds(self.qd)
            self._columns_dot[representation] = rates(self.terms, representation, joints, speeds)
        return self._columns_dot[representation]

    def _fk(self) -> SymbolicFunction:
        tip, base = self.robot.tool_frame, self.robot.base_frame
        x, of_q = ("theta", ", theta = chain(q)") if self.links is not self.forward else ("q", "")
        return self._function(
            "fk",
            f"Pose of the tool ({tip}) in the base frame ({base}).",
            f"{self.pose} = exp(S_1 {x}_1) ... exp(S_n {x}_n) M_{base}_{tip}{of_q}",
            ("q",),
            self._pose_result(),
        )

    def _link_poses(self) -> SymbolicFunction:
        poses = self.links.link_poses()
        entries = tuple(entry for pose in poses for entry in pose_entries(pose))
        names = ", ".join(self.robot.link_names)
        return self._function(
            "link_poses",
            "Pose of every link's frame in the base frame, in order from the base.",
            f"T[k] is the pose of link k of: {names}",
            ("q",),
            Result("T", entries, (len(poses), 4, 4), "1, m", "link poses"),
        )

    def _jacobian(self, representation: Representation) -> SymbolicFunction:
        return self._function(
            f"jacobian_{representation}",
            f"Jacobian for the twist (v, omega) {OBSERVED[representation]}.",
            f"V = J(q) qd with V = twist_{representation}(q, qd)",
            ("q",),
            self._jacobian_result(representation),
        )

    def _fk_jacobian_mixed(self) -> SymbolicFunction:
        return self._function(
            "fk_jacobian_mixed",
            "Pose of the tool and mixed Jacobian in one call.",
            "(fk(q), jacobian_mixed(q))",
            ("q",),
            self._pose_result(),
            self._jacobian_result("mixed"),
        )

    def _jacobian_dot(self, representation: Representation) -> SymbolicFunction:
        moving = self._by_coordinates(self._rates(representation), self.motion.D_q())
        bend = self.motion.D_q_dot(self.qd)
        if bend is not None:
            turning = self._by_coordinates(self._joints(representation), bend)
            moving = [summed(self.terms, a, b) for a, b in zip(moving, turning, strict=True)]
        entries = _entries(moving)
        return self._function(
            f"jacobian_{representation}_dot",
            f"Time derivative of jacobian_{representation} at joint rates qd.",
            "J_dot = sum_k (d J / d q_k) qd_k",
            ("q", "qd"),
            Result("J_dot", entries, (6, len(self.q)), "m/s, 1/s", "rate of the Jacobian"),
        )

    def _hessian_mixed(self) -> SymbolicFunction:
        table = hessian(self.terms, self._joints("mixed"))
        count = range(len(self.q))
        D_q = self.motion.D_q()
        # The next two lines convert joint indices of the Hessian to coordinate indices: first the
        # index of the differentiation variable, then the column index.
        by_coordinate = [[self._combined(row, D_q, k) for row in table] for k in count]
        entries = [[self._combined(row, D_q, j) for row in by_coordinate] for j in count]
        bend = self.motion.D_q_q()
        if bend is not None:
            joints = self._joints("mixed")
            entries = [
                [
                    summed(self.terms, H, self._combined(joints, D_k, j))
                    for H, D_k in zip(row, bend, strict=True)
                ]
                for j, row in zip(count, entries, strict=True)
            ]
        flat = tuple(entries[j][k].entries[i] for i in range(6) for j in count for k in count)
        return self._function(
            "hessian_mixed",
            "Derivative of jacobian_mixed with respect to the joint coordinates.",
            "H[:, j, k] = d jacobian_mixed[:, j] / d q_k",
            ("q",),
            Result("H", flat, (6, len(self.q), len(self.q)), "m, 1", "Hessian"),
        )

    def _twist(self, representation: Representation) -> SymbolicFunction:
        V = weighted(self.terms, self._joints(representation), self.motion.speeds(self.qd))
        return self._function(
            f"twist_{representation}",
            f"Twist (v, omega) {OBSERVED[representation]}.",
            f"V = jacobian_{representation}(q) qd",
            ("q", "qd"),
            Result("V", V.entries, (6,), TWIST_UNIT, "twist, linear first"),
        )

    def _acceleration(self, representation: Representation) -> SymbolicFunction:
        A = summed(
            self.terms,
            weighted(
                self.terms,
                self._joints(representation),
                self.motion.accelerations(self.qd, self.qdd),
            ),
            weighted(self.terms, self._rates(representation), self.motion.speeds(self.qd)),
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
        role = Role(ROLES[name], "actuators")
        return SymbolicFunction(name, summary, identity, arguments, outputs, self.terms, role=role)

    def _pose_result(self) -> Result:
        entries = pose_entries(self.forward.tool_pose())
        return Result(self.pose, entries, (4, 4), "1, m", "pose of the tool")

    def _jacobian_result(self, representation: Representation) -> Result:
        entries = _entries(self._by_coordinates(self._joints(representation), self.motion.D_q()))
        return Result("J", entries, (6, len(self.q)), "m, 1", f"{representation} Jacobian")

    def _by_coordinates(self, joints: list[Twist], D_q: Matrix) -> list[Twist]:
        return [self._combined(joints, D_q, k) for k in range(len(self.q))]

    def _combined(self, joints: list[Twist], D_q: Matrix, coordinate: int) -> Twist:
        weights = [row[coordinate] for row in D_q]
        own = [(joint, w) for joint, w in zip(joints, weights, strict=True) if w != 0]
        if len(own) == 1 and own[0][1] == 1:
            return own[0][0]
        return weighted(self.terms, [joint for joint, _ in own], [weight for _, weight in own])


def coordinates(name: str, count: int) -> tuple[sp.Symbol, ...]:
    """Return the symbols of the coordinates: ``q1``, ``q2``, ..."""
    return tuple(sp.Symbol(f"{name}{k}", real=True) for k in range(1, count + 1))


def arguments_of(units: Sequence[str], what: str = "joint") -> dict[str, Argument]:
    """Return the arguments ``q``, ``qd`` and ``qdd`` of a robot.

    Args:
        units: Unit of each coordinate.
        what: The component that a coordinate moves, "joint" or "actuator".
    """
    unit, shape = common_unit(units), (len(units),)
    q, qd, qdd = (coordinates(name, len(units)) for name in ("q", "qd", "qdd"))
    return {
        "q": Argument("q", q, shape, unit, f"{what} coordinates"),
        "qd": Argument("qd", qd, shape, f"{unit}/s", f"{what} rates"),
        "qdd": Argument("qdd", qdd, shape, f"{unit}/s^2", f"{what} accelerations"),
    }


def common_unit(units: Iterable[str]) -> str:
    """Return the common unit of the entries of a vector, or "rad or m" if the units differ."""
    found = set(units)
    return found.pop() if len(found) == 1 else "rad or m"


def _entries(twists: Iterable[Twist]) -> tuple[sp.Expr, ...]:
    return matrix_entries(twist.entries for twist in twists)


def pose_entries(pose: Pose) -> tuple[sp.Expr, ...]:
    """Return the 16 entries of a pose matrix (4, 4), row by row."""
    axes, origin = pose
    return (*matrix_entries((*axes, origin)), *BOTTOM_ROW)
