"""Closure equations in double precision, and their Jacobian.

Each closure equation has a corresponding wrench. Let V be the twist of the body at end b relative
to the body at end a. If the loop is closed, the rate of the residual of a closure equation is the
reciprocal product of its wrench and V.
"""

from collections.abc import Iterator, Mapping

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from ...model.mechanism import Closure, Strut
from ...model.tolerances import REPEATED_EQUATION
from .numeric_mechanism import NumericMechanism
from .rows import FACING, ROWS, Along, Kind, Turn

Floats = NDArray[np.float64]
POLISHING = 4
"""Number of Newton steps that refine a nearby solution."""
_NONE = np.zeros(3)
_LENGTH = (None,)


class NumericRows:
    """The closure equations of one mechanism as functions of joints and cylinders.

    Attributes:
        bodies: Numerical model of the mechanism's bodies and frames.
        names: Names of the joints and cylinders.
        owners: For each equation, the name of its closure or strut. For the equation of a coupling,
            the name of the coupled joint.
        is_turn: Whether each equation relates directions or angles instead of lengths.
        facing_owners: Names of closures, one for each cosine between corresponding axes of the two
            frames of a closure. If a cosine is negative, corresponding axes of the two closure
            frames point in opposite directions.
    """

    def __init__(self, bodies: NumericMechanism) -> None:
        self.bodies, self.names = bodies, [*bodies.values]
        self.owners: list[str] = []
        self.is_turn: list[bool] = []
        mechanism, number = bodies.mechanism, bodies.number
        self._joints = joints = [joint for joint in mechanism.joints if joint.kind != "fixed"]
        self._columns = [self.names.index(joint.name) for joint in joints]
        self._turns = np.array([joint.kind != "prismatic" for joint in joints], float)
        slides = {"prismatic": sp.S.One, "revolute": sp.S.Zero}
        self._slides = np.array([number(slides.get(j.kind, j.pitch)) for j in joints], float)
        self._axes = {closure.name: self._axes_of(closure) for closure in mechanism.closures}
        sides: list[list[list[int]]] = []
        for c in mechanism.loop_joints:
            a, b = (mechanism.path_to(frame.body) for frame in (c.a, c.b))
            rows = _LENGTH if isinstance(c, Strut) else ROWS[self._kind(c)]
            self.owners += [c.name] * len(rows)
            self.is_turn += [isinstance(row, Turn) for row in rows]
            on_a = [-j.direction * (j in a and j not in b) for j in joints]
            on_b = [j.direction * (j in b and j not in a) for j in joints]
            sides += [[on_a, on_b]] * len(rows)
        self.owners += [coupling.joint for coupling in mechanism.couplings]
        self.is_turn += bodies.couplings.is_turn
        self._sides = np.array(sides, float).reshape(-1, 2, len(joints))
        self.facing_owners = [c.name for c in mechanism.closures for _ in FACING[self._kind(c)]]

    def _kind(self, closure: Closure) -> Kind:
        return closure.kind, "plane" if closure.name in self.bodies.planes else "space"

    def _axes_of(self, closure: Closure) -> Floats:
        """Return the axes (3, 3) for the equations of a closure, in the frame of its first end."""
        plane = self.bodies.planes.get(closure.name)
        if plane is None:
            return np.eye(3)
        axes: Floats = self.bodies.matrix(closure.a.placement)[:3, :3].T @ plane
        if closure.kind == "slider":
            guide = np.array([0.0, 0.0, 1.0])
            axes = np.column_stack([guide, np.cross(axes[:, 2], guide), axes[:, 2]])
        return axes

    def at(self, w: Floats) -> tuple[Floats, Floats, Floats]:
        """Evaluate the closure equations at given values of the joints and cylinders.

        Args:
            w: Values (n,) in the order of ``names`` (radian or meter).

        Returns:
            The residuals (m,), their Jacobian (m, n), and cosines between the axes of the two end
            frames of each closure.
        """
        values = dict(zip(self.names, w, strict=True))
        poses = self.bodies.poses(values)
        residual: list[float] = []
        forces, couples, ends, facing = [], [], [], []
        J = np.zeros((len(self.owners), len(w)))
        for loop_joint in self.bodies.mechanism.loop_joints:
            A, B = self.bodies.frames(poses, loop_joint)
            if isinstance(loop_joint, Strut):
                d = B[:3, 3] - A[:3, 3]
                distance = float(np.linalg.norm(d))
                rows = [(distance - self.bodies.length(loop_joint, values), d / distance, _NONE)]
                if loop_joint.is_cylinder:
                    J[len(residual), self.names.index(loop_joint.name)] = -1.0
            else:
                a, b = (T[:3, :3] @ self._axes[loop_joint.name] for T in (A, B))
                rows = [*_rows(self._kind(loop_joint), a.T, b.T, B[:3, 3] - A[:3, 3])]
                facing += [a[:, k] @ b[:, k] for k in FACING[self._kind(loop_joint)]]
            # If all components of a difference vector must be 0, the axes of the components are
            # arbitrary. Newton's method converges better if the difference vector is expressed in
            # axes that do not rotate with frame a. For a difference vector in nonrotating axes, the
            # wrench on the body at end a acts at the origin of frame a.
            is_whole = not isinstance(loop_joint, Strut) and loop_joint.kind != "slider"
            for row, force, couple in rows:
                residual.append(row)
                forces.append(force)
                couples.append(couple)
                ends.append([A[:3, 3] if is_whole else B[:3, 3], B[:3, 3]])
        axes, points = self.bodies.axes(poses, self._joints)
        F, C = (np.reshape(vectors, (-1, 1, 3)) for vectors in (forces, couples))
        M = _crosses(np.reshape(ends, (-1, 2, 3)), F) + C
        power = self._turns * (M @ axes.T - F @ _crosses(axes, points).T)
        power += self._slides * (F @ axes.T)
        count = len(residual)
        J[:count, self._columns] += (self._sides * power).sum(1)
        J[count:] = self.bodies.couplings.rows
        residual += self.bodies.couplings.errors(values).tolist()
        return np.array(residual), J, np.array(facing)

    def relative(self, values: Mapping[str, float]) -> Floats:
        """Return the closure Jacobian (m, n), with lengths divided by the mechanism's size."""
        J = self.at(np.array([values[name] for name in self.names]))[1]
        columns = [self.bodies.size if self.bodies.is_length(n) else 1.0 for n in self.names]
        return J * columns / np.where(self.is_turn, 1.0, self.bodies.size)[:, None]

    def polished(self, values: Mapping[str, float]) -> dict[str, float]:
        """Reduce the closure errors of nearly closed loops to the level of rounding errors.

        Newton steps with a constant Jacobian move the passive joints and cylinders. If the loops
        cannot close, the Newton steps minimize the closure errors.
        """
        w = np.array([values[name] for name in self.names])
        free = [name in self.bodies.unknown for name in self.names]
        back = np.linalg.pinv(self.at(w)[1][:, free], REPEATED_EQUATION)
        for _ in range(POLISHING):
            w[free] -= back @ self.at(w)[0]
        return dict(zip(self.names, map(float, w), strict=True))


def _rows(kind: Kind, a: Floats, b: Floats, d: Floats) -> Iterator[tuple[float, Floats, Floats]]:
    """Yield the tuple (residual, force, couple) of each equation of a closure."""
    for row in ROWS[kind]:
        if isinstance(row, Along):
            yield float(a[row.axis] @ d), a[row.axis], _NONE
        else:
            yield float(a[row.a] @ b[row.b]), _NONE, _cross(b[row.b], a[row.a])


def _crosses(a: Floats, b: Floats) -> Floats:
    """Return the cross products of vectors (..., 3), faster than np.cross."""
    found = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        found[..., i] = a[..., j] * b[..., k] - a[..., k] * b[..., j]
    return found


def _cross(a: Floats, b: Floats) -> Floats:
    """Return the cross product of two vectors (3,), faster than np.cross."""
    (a1, a2, a3), (b1, b2, b3) = a.tolist(), b.tolist()
    return np.array([a2 * b3 - a3 * b2, a3 * b1 - a1 * b3, a1 * b2 - a2 * b1])
