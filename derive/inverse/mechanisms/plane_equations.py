"""Numeric equations that keep the ball joints of a platform in planes.

Each leg keeps a ball joint of the platform in a plane. The unknowns of the plane equations are the
joints before the legs and the joints on the platform.

Let B be the pose, in the base frame, of the body at which the legs start. Let W be the tool pose in
the platform frame. For the tool pose T, the platform pose relative to the body at which the legs
start is B^-1 T W^-1. Each joint contributes a factor to B^-1 or W^-1. The factor that a joint
contributes to B^-1 or W^-1 is linear in the cosine and sine of the joint angle, or in the joint
displacement.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, reduce
from itertools import product

import numpy as np
import sympy as sp

from ...chain.forward import Pose
from ...loops.model.body_frames import pose_along
from ...loops.solve.solved_loops import SolvedLoops
from ...model.robot import Joint, Placement
from ...terms.terms import Terms
from .carried_platform import CarriedPlatform
from .differences import FloatArray

RANK = 1e-6
"""The plane equations determine the unknowns if the ratio of their smallest to their largest
singular value is at least this threshold."""
ZERO = 1e-12
"""A coefficient counts as constant if it changes by at most this fraction of its value."""
SAMPLES = 8
"""Number of random joint vectors that test whether a coefficient is constant."""
ANGLES = (0.0, 2.0, 4.0)
"""Angles (radian) at which a function with the terms 1, cosine and sine is sampled."""
Group = tuple[tuple[Joint, ...], Placement, Placement]
"""A moving joint and its adjacent fixed joints, the placement before these joints, and the
placement after these joints."""


@dataclass(frozen=True)
class JointMap:
    """The inverse pose of a joint, as a sum of constant matrices times functions of its coordinate.

    Attributes:
        joint: Index of the joint in a list of the moving joints: first the joints before the
            platform, then the joints on the platform.
        is_slide: Whether the joint is prismatic.
        parts: Matrices (4, 4) that multiply 1, cosine and sine of an angle, or 1, a displacement
            and 0.
    """

    joint: int
    is_slide: bool
    parts: tuple[FloatArray, ...]

    def at(self, x: float) -> FloatArray:
        """Return the inverse pose (4, 4) for a coordinate value (radian or meter)."""
        one, first, second = self.parts
        return one + (x * first if self.is_slide else np.cos(x) * first + np.sin(x) * second)

    def slope(self, x: float) -> FloatArray:
        """Return the derivative of the inverse pose with respect to the coordinate."""
        _, first, second = self.parts
        return first if self.is_slide else np.cos(x) * second - np.sin(x) * first


@dataclass(frozen=True)
class PlaneEquations:
    """The equations that keep each of three ball joints in its own plane.

    The unknowns of the plane equations are the values of joints before the platform and on the
    platform.

    Attributes:
        h: The robot.
        carried: The platform.
    """

    h: SolvedLoops
    carried: CarriedPlatform

    @property
    def before(self) -> int:
        """Number of moving joints before the legs."""
        return sum(joint.kind != "fixed" for joint in self.carried.before)

    @cached_property
    def maps(self) -> tuple[JointMap, ...]:
        """The inverse poses of all joints, in the order of their multiplication.

        Joints before the legs come first, ordered from the legs to the base. Joints on the platform
        come last, ordered from the tool to the platform.
        """
        base = self.h.robot.base if self.carried.before else ()
        before = _groups(self.carried.before, base, ())
        behind = _groups(self.carried.behind, (), self.h.robot.tool)
        own = [self._map(group, k) for k, group in enumerate((*before, *behind))]
        return (*own[: len(before)][::-1], *own[len(before) :][::-1])

    @cached_property
    def rows(self) -> FloatArray:
        """Plane coefficients (3, 4), multiplied by the constant matrix that ``_still`` returns.

        The coefficients of a plane are the unit normal and the negative offset of the plane.
        """
        planes = self.carried.planes
        rows = np.array([[*plane.normal, -plane.offset] for plane in planes])
        return rows @ self._still(self.carried.before, self.h.robot.base, ())

    @cached_property
    def points(self) -> FloatArray:
        """Homogeneous ball joint positions (3, 4), multiplied by the matrix from ``_still``."""
        points = np.array([[*plane.ball, 1.0] for plane in self.carried.planes])
        return points @ self._still(self.carried.behind, (), self.h.robot.tool).T

    def rank(self, unknown: Sequence[int] | None = None) -> int:
        """Return the number of joint values that the plane equations determine.

        Args:
            unknown: Indices of the joints that are not fixed, or None if no joint is fixed.
        """
        columns = range(len(self.maps)) if unknown is None else unknown
        slopes = np.array([self._derivatives(T, x)[:, list(columns)] for x, T in self._closed])
        if not slopes.size:
            return 0
        slides = [i for i, k in enumerate(columns) if self.is_slide(k)]
        slopes[:, :, slides] *= self.h.numbers.size
        values = np.linalg.svd(slopes, compute_uv=False)
        return int(max(np.sum(v > RANK * max(v[0], RANK)) for v in values))

    def has_constant_factor(self, slide: int, unknown: Sequence[int]) -> bool:
        """Whether the coefficient of a displacement is independent of all other unknown joints."""
        rng, (start, T) = np.random.default_rng(0), self._closed[-1]
        found, x = [], start.copy()
        for _ in range(SAMPLES):
            x[list(unknown)] = rng.uniform(-1, 1, len(unknown))
            found.append(self._derivatives(T, x)[:, slide])
        size = max(1.0, float(np.abs(found).max()))
        return bool(np.max(np.ptp(found, axis=0)) <= ZERO * size)

    def is_dependent(self, joint: int, unknown: Sequence[int]) -> bool:
        """Whether the coefficients of 1, cosine and sine of a joint are linearly dependent.

        The test uses random values of all other unknown joints.
        """
        rng, values = np.random.default_rng(0), []
        for start, T in self._closed:
            x = start.copy()
            x[list(unknown)] = rng.uniform(-np.pi, np.pi, len(unknown))
            errors = []
            for x[joint] in ANGLES:
                errors.append(self._product([m.at(x[m.joint]) for m in self.maps], T))
            singular = np.linalg.svd(np.array(errors), compute_uv=False)
            values.append(singular[-1] / singular[0])
        return bool(max(values) < RANK)

    def meet_at_infinity(self, first: int, second: int) -> bool:
        """Whether the equations in two joints have a common root at infinity.

        The test uses random values of all other joints. For example, the equations of two adjacent
        parallel axes share a root at infinity.
        """
        rng, (start, T) = np.random.default_rng(0), self._closed[-1]
        x = rng.uniform(-np.pi, np.pi, len(start))
        sizes = []
        ends = [(0,) if self.is_slide(k) else (1j, -1j) for k in (first, second)]
        for signs in product(*ends):
            chosen = dict(zip((first, second), signs, strict=True))
            factors = [
                m.parts[1] - chosen[m.joint] * m.parts[2] if m.joint in chosen else m.at(x[m.joint])
                for m in self.maps
            ]
            sizes.append(np.abs(self._product(factors, T)).max())
        return bool(min(sizes) <= RANK * max(RANK, *sizes))

    def is_slide(self, joint: int) -> bool:
        """Whether a joint is prismatic."""
        return self.carried.others[joint].kind == "prismatic"

    @cached_property
    def _closed(self) -> list[tuple[FloatArray, FloatArray]]:
        """Return joint values and tool poses (4, 4) of random closed configurations."""
        h, carried, found = self.h, self.carried, []
        base = () if carried.before else h.robot.base
        before_still = self._still(carried.before, h.robot.base, ())
        behind_still = self._still(carried.behind, (), h.robot.tool)
        for w in h.numbers.generic:
            at = {n: sp.Float(value) for n, value in zip(h.numbers.names, w, strict=True)}
            x = np.array([float(at[joint.name]) for joint in carried.others])
            P = self._matrix(carried.platform.joints, base, (), at)
            factors = [m.at(x[m.joint]) for m in self.maps]
            before = reduce(np.matmul, factors[: self.before], before_still)
            behind = reduce(np.matmul, factors[self.before :], np.eye(4)) @ behind_still
            found.append((x, np.linalg.inv(before) @ P @ np.linalg.inv(behind)))
        return found

    def _derivatives(self, T: FloatArray, x: FloatArray) -> FloatArray:
        """Return the derivatives (3, n) of the plane equations with respect to the joint values."""
        found = np.zeros((len(self.carried.planes), len(self.maps)))
        for moved in self.maps:
            factors = [m.slope(x[m.joint]) if m is moved else m.at(x[m.joint]) for m in self.maps]
            found[:, moved.joint] = self._product(factors, T)
        return found

    def _product(self, factors: Sequence[FloatArray], T: FloatArray) -> FloatArray:
        """Return the values (3,) of the plane equations at the ball joints."""
        pose = reduce(np.matmul, [*factors[: self.before], T, *factors[self.before :]])
        found: FloatArray = np.einsum("ij,jk,ik->i", self.rows, pose, self.points)
        return found

    def _still(self, path: Sequence[Joint], base: Placement, tool: Placement) -> FloatArray:
        """Return the inverse of the pose (4, 4) of the fixed joints before or after the platform.

        If the path contains a moving joint, the returned matrix is the identity.
        """
        if any(joint.kind != "fixed" for joint in path):
            return np.eye(4)
        # If the legs start at the base, the planes are given in the base frame, so the base
        # placement is omitted.
        first = base if path else ()
        return np.asarray(np.linalg.inv(self._matrix(path, first, tool, {})))

    def _map(self, group: Group, joint: int) -> JointMap:
        joints, base, tool = group
        (moving,) = [each for each in joints if each.kind != "fixed"]

        def inverse(x: float) -> FloatArray:
            pose = self._matrix(joints, base, tool, {moving.name: sp.Float(x)})
            return np.asarray(np.linalg.inv(pose))

        if moving.kind == "prismatic":
            zero = inverse(0.0)
            return JointMap(joint, True, (zero, inverse(1.0) - zero, np.zeros((4, 4))))
        zero, half, quarter = inverse(0.0), inverse(np.pi), inverse(np.pi / 2)
        middle = (zero + half) / 2
        return JointMap(joint, False, (middle, zero - middle, quarter - middle))

    def _matrix(
        self, path: Sequence[Joint], base: Placement, tool: Placement, at: dict[str, sp.Expr]
    ) -> FloatArray:
        pose = pose_along(self.h.mechanism, self.h.terms, path, tool, at, base)
        return _numbers(self.h.terms, pose)


def _groups(path: Sequence[Joint], base: Placement, tool: Placement) -> list[Group]:
    """Divide a path of joints into groups.

    Each group of joints has one moving joint and the fixed joints before this joint. The last group
    also contains the fixed joints after the last moving joint.

    The returned list is empty if no joint of the path moves.
    """
    ends = [k for k, joint in enumerate(path) if joint.kind != "fixed"]
    groups = []
    for k, end in enumerate(ends):
        is_last = end == ends[-1]
        start = ends[k - 1] + 1 if k else 0
        joints = tuple(path[start : len(path) if is_last else end + 1])
        groups.append((joints, base if k == 0 else (), tool if is_last else ()))
    return groups


def _numbers(terms: Terms, pose: Pose) -> FloatArray:
    T = np.eye(4)
    for j, column in enumerate((*pose[0], pose[1])):
        T[:3, j] = [float(terms.value(entry)) for entry in column]
    return T
