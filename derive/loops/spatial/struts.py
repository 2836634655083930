"""Struts with ball ends, and the points, lengths and joint values that are already known."""

import math
from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import sympy as sp

from ...model.errors import DescriptionError, LoopError
from ...model.mechanism import Frame, Mechanism, Strut
from ...model.robot import Joint
from ...model.tolerances import BRANCHES_APART
from ...terms.tangents import LoopRate
from ...terms.terms import Terms
from ...terms.vectors import ZERO, Vector, dot, subtracted
from ..model.body_frames import pose_of
from ..planar.loop_step import LoopStep
from ..planar.reference import AtReference, Branch, wrapped

SIGNS = (1, -1)


class LegStep(LoopStep):
    """A solution step that computes joint values from ball-ended struts."""

    @classmethod
    @abstractmethod
    def use(cls, legs: "Legs", struts: Sequence[Strut]) -> bool:
        """Solve the joints whose values the struts determine, and record the step.

        Args:
            legs: The partially solved mechanism.
            struts: A single strut, or all unsolved struts.

        Returns:
            Whether the step solved the struts.

        Raises:
            DescriptionError: The loop does not close at the reference.
        """


@dataclass(frozen=True)
class Known:
    """The joint values that are already solved.

    Attributes:
        values: Values of joints, swing angles and cylinders by name.
        loops: Rates of all solved angles.
        steps: The solution steps of the loops that are already solved.
    """

    values: dict[str, sp.Expr]
    loops: dict[sp.Symbol, LoopRate]
    steps: list[LoopStep]


@dataclass(frozen=True)
class Reach:
    """A strut of known length between a known point and a body that one joint moves.

    Attributes:
        strut: The strut.
        joint: The only unknown joint that moves an end of the strut.
        tip: The strut end on the moved body, in the joint frame, when the joint value is zero.
        target: The known end of the strut, in the joint frame.
        square: The square of the strut length.
    """

    strut: Strut
    joint: Joint
    tip: Vector
    target: Vector
    square: sp.Expr


class Legs:
    """The struts of a mechanism and the joints that they determine.

    Attributes:
        terms: Names of all terms.
        mechanism: The description.
        known: Record of the known values, to which each solution step adds its results.
        reference: The configuration that selects the branch.
        branch: The branch to solve, or None for the branch of the reference.
    """

    def __init__(
        self,
        terms: Terms,
        mechanism: Mechanism,
        known: Known,
        reference: AtReference,
        branch: Branch | None,
    ) -> None:
        """Store the known values."""
        self.terms, self.mechanism, self.known = terms, mechanism, known
        self.reference, self.branch = reference, branch

    # --- unknown joints and points ---

    def unknown(self, frame: Frame) -> list[Joint]:
        """Return the unknown joints between the base and a frame."""
        path = self.mechanism.path_to(frame.body)
        return [j for j in path if j.kind != "fixed" and j.name not in self.known.values]

    def moving(self, strut: Strut) -> list[Joint]:
        """Return the unknown joints on the paths from the base to both ends of a strut."""
        return [*self.unknown(strut.a), *self.unknown(strut.b)]

    def length(self, strut: Strut) -> sp.Expr | None:
        """Return the length of a strut, or None for a cylinder with an unknown coordinate."""
        if not strut.is_cylinder:
            return strut.length
        value = self.known.values.get(strut.name)
        return None if value is None else strut.length + value

    def while_long(self, square: sp.Expr, strut: Strut) -> sp.Expr:
        """Return the radicand ``square``, or -1 for a cylinder of non-positive length."""
        length = self.length(strut)
        if not strut.is_cylinder or length is None:
            return square
        gated = self.terms.let(sp.Piecewise((square, sp.Gt(length, 0)), (-1, True)))
        self.known.loops.setdefault(gated, lambda tangent: tangent.of(square))
        return gated

    def point(self, frame: Frame) -> Vector:
        """Return the position of the origin of a frame in the base frame."""
        return pose_of(self.mechanism, self.terms, frame, self.known.values)[1]

    def axis(self, joint: Joint, values: Mapping[str, sp.Expr]) -> Vector:
        """Return the direction of the z axis of a joint in the base frame."""
        frame = Frame(joint.parent, joint.before)
        return pose_of(self.mechanism, self.terms, frame, values)[0][2]

    def reach(self, struts: Sequence[Strut], *, sliding: bool) -> Reach | None:
        """Return a strut that determines a single unknown joint, together with this joint, or None.

        Args:
            struts: The struts. For several struts, the function returns None.
            sliding: True if the joint must be prismatic, False if the joint must be revolute.
        """
        if len(struts) != 1:
            return None
        (strut,) = struts
        length, moving = self.length(strut), self.moving(strut)
        if length is None or len(moving) != 1:
            return None
        (joint,) = moving
        if (joint.kind == "prismatic") is not sliding:
            return None
        on_joint = joint in self.mechanism.path_to(strut.a.body)
        near, far = (strut.a, strut.b) if on_joint else (strut.b, strut.a)
        frame = Frame(joint.parent, joint.before)
        axes, origin = pose_of(self.mechanism, self.terms, frame, self.known.values)
        still = self.known.values | {joint.name: ZERO}
        _, at_zero = pose_of(self.mechanism, self.terms, near, still)
        tip, target = (
            self._in_axes(axes, subtracted(self.terms, point, origin))
            for point in (at_zero, self.point(far))
        )
        return Reach(strut, joint, tip, target, self.terms.let(length**2))

    def _in_axes(self, axes: Sequence[Vector], vector: Vector) -> Vector:
        """Convert a vector from the base frame to other axes."""
        x, y, z = (dot(self.terms, axis, vector) for axis in axes)
        return x, y, z

    # --- branches ---

    def chosen(self, reach: Reach, value: Callable[[int], float]) -> sp.Expr:
        """Return the branch sign for which the joint is nearest to its reference value.

        Args:
            reach: The strut and its unknown joint.
            value: Function of the branch sign that returns the joint value at the reference, or NaN
                if the leg does not close.
        """
        joint = reach.joint
        hint = self.reference.hints_of([joint.name]).get(joint.name, 0.0)
        if self.branch is not None:
            return self.branch.side((reach.strut.name,))
        size = self.reference.size
        apart = wrapped if joint.kind != "prismatic" else lambda length: length / size
        return self.sign({s: abs(apart(value(s) - hint)) for s in SIGNS}, reach.strut.name)

    def sign(
        self, distances: Mapping[int, float], name: str, *, is_length: bool = False
    ) -> sp.Expr:
        """Return the requested branch sign, or the sign of the branch nearer to the reference.

        Args:
            distances: For each branch sign, the distance of the joint from its reference value
                (radian, or relative to the mechanism size). The distance is NaN if the loop does
                not close.
            name: Name of the loop for the error message.
            is_length: Whether the branch sign is the sign of a leg length.

        Raises:
            DescriptionError: The loop does not close at the reference, or its branch is ambiguous
                there.
        """
        if self.branch is not None:
            side = self.branch.length if is_length else self.branch.side
            return side((name,))
        if any(math.isnan(distance) for distance in distances.values()):
            raise LoopError(f"{name}: the loop does not close at the reference")
        if abs(distances[1] - distances[-1]) < BRANCHES_APART:
            raise DescriptionError(
                f"{name}: both branches of the loop are equally near to the reference, or the "
                "loop is at a dead point there: choose a reference nearer to one branch"
            )
        self.reference.sides[(name,)] = min(distances, key=distances.__getitem__)
        return self.reference.sides[(name,)]
