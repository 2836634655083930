"""Numerical model of a mechanism: poses of bodies and closure errors of loops.

The body poses follow directly from the description, for any parameter values. If a parameter value
is changed, the closure errors show whether the loops close with the new value.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from ...model.mechanism import Closure, Frame, Mechanism, Strut
from ...model.placements import Rotation, Translation, symbols_of
from ...model.robot import Joint, Placement
from ...model.tolerances import CLOSING_GAIN, NUMERICALLY_CLOSED, WORTHWHILE_GAIN
from ...terms.terms import Terms
from .coupling_equations import NumericCouplings
from .damped_search import least
from .planes import planar_loop_joints

Floats = NDArray[np.float64]
Value = float | Floats
"""One joint value, or an array (n,) of joint values for n configurations."""
OTHERS_FIRST = 1e3
"""Weight of the other loops while the closure error of one loop is minimized."""
_AXES = {"x": 0, "y": 1, "z": 2}


class ClosureResidual(NamedTuple):
    """The distance (meter) and the angle (radian) between the two ends of a loop."""

    distance: float
    turn: float


class NumericMechanism:
    """Bodies, loops and constants of a mechanism as numbers.

    Attributes:
        mechanism: The description.
        constants: All parameters, and all rod lengths and frame offsets that do not depend on
            parameters, by name (meter or radian).
        values: Reference values of joints and cylinders by name (radian or meter).
        unknown: Names of the passive joints and cylinders.
        size: Length of the longest translation or rod (meter), or 1 if all these lengths are zero.
        couplings: The equations of the couplings.
        planes: A matrix (3, 3) for each planar loop, keyed by the name of its closure or strut. The
            matrix columns are the plane's axes x and y and its normal, in the frame of the body at
            end a.
    """

    def __init__(self, mechanism: Mechanism, planes: Mapping[str, Floats] | None = None) -> None:
        """Compute the reference configuration and the planes of loops.

        Args:
            mechanism: The description.
            planes: Axes of the plane of each planar loop, keyed by the name of its closure or
                strut. If None, the plane axes are computed from the mechanism.
        """
        self.mechanism = mechanism
        self._placed: dict[str, Floats] = {}
        self._numbers: dict[sp.Expr, float] = {}
        self._uses: dict[str | sp.Expr, frozenset[str]] = {}
        self._constants: dict[str, float] = {}
        self.constants = {p.name: float(p.value) for p in mechanism.parameters}
        self._symbols = tuple(p.symbol for p in mechanism.parameters)
        self.planes = _planes(mechanism) if planes is None else planes
        self._bare = self._lengths()
        self.constants = self.constants | self._bare
        self.values = self._reference()
        actuated = {c.moves for c in mechanism.coordinates}
        self.unknown = [name for name in mechanism.members if name not in actuated]
        self.size = self._size()
        self.couplings = NumericCouplings(mechanism, tuple(mechanism.members))

    # --- constants ---

    @property
    def constants(self) -> dict[str, float]:
        """The constants by name. To change a constant, assign a new dictionary."""
        return self._constants

    @constants.setter
    def constants(self, values: dict[str, float]) -> None:
        changed = {name for name, value in values.items() if self._constants.get(name) != value}
        self._constants = values
        uses = self._uses
        self._placed = {k: T for k, T in self._placed.items() if uses[k].isdisjoint(changed)}
        self._numbers = {k: x for k, x in self._numbers.items() if uses[k].isdisjoint(changed)}

    def number(self, expression: sp.Expr) -> float:
        """Return the value of an expression in the parameters."""
        if expression not in self._numbers:
            function = _function(self._symbols, expression)
            self._uses[expression] = frozenset(symbol.name for symbol in expression.free_symbols)
            given = (self.constants[symbol.name] for symbol in self._symbols)
            self._numbers[expression] = float(function(*given))
        return self._numbers[expression]

    def matrix(self, placement: Placement) -> Floats:
        """Return the matrix (4, 4) of a placement at the current parameters."""
        T = np.eye(4)
        for motion in placement:
            if isinstance(motion, Rotation):
                T = T @ _turn(_AXES[motion.axis], self.number(motion.angle))
            else:
                T[:3, 3] += T[:3, :3] @ np.array([self.number(x) for x in motion.vector])
        return T

    def length(self, strut: Strut, values: Mapping[str, float]) -> float:
        """Return the length of a strut (meter)."""
        return self._retracted(strut) + (values[strut.name] if strut.is_cylinder else 0.0)

    def _retracted(self, strut: Strut) -> float:
        """Return the length of a rod or of a retracted cylinder (meter)."""
        name = length_of(strut)
        return self.constants[name] if name in self._bare else self.number(strut.length)

    def _lengths(self) -> dict[str, float]:
        """Return the strut lengths and frame offsets (meter) that do not depend on parameters."""
        found = {
            length_of(strut): float(strut.length)
            for strut in self.mechanism.struts
            if not strut.length.free_symbols
        }
        placed = [(offset_of(joint), joint.before) for joint in self.mechanism.joints]
        for loop_joint in self.mechanism.loop_joints:
            placed += [
                (offset_of(loop_joint, side), frame.placement) for side, frame in _sides(loop_joint)
            ]
        for name, placement in placed:
            if not any(map(_has_symbols, placement)) and (
                distance := _shift(self.matrix(placement))
            ):
                found[name] = distance
        return found

    def _offset(self, name: str, placement: Placement) -> Floats:
        """Return the matrix of a placement.

        If `constants` contains `name`, the translation is scaled to the length `constants[name]`.
        """
        T = self._placed.get(name)
        if T is None:
            T = self._placed[name] = self.matrix(placement)
            self._uses[name] = frozenset({name, *(symbol.name for symbol in symbols_of(placement))})
            T[:3, 3] *= self.constants[name] / self._bare[name] if name in self._bare else 1.0
        return T

    def _reference(self) -> dict[str, float]:
        given = {name: self.number(value) for name, value in self.mechanism.reference}
        for c in self.mechanism.coordinates:
            if c.name in given:
                given[c.moves] = given[c.name] * self.number(c.ratio)
        return {name: given.get(name, 0.0) for name in self.mechanism.members}

    def _size(self) -> float:
        lengths = [abs(self.number(strut.length)) for strut in self.mechanism.struts]
        for joint in self.mechanism.joints:
            lengths += [_shift(self.matrix(part)) for part in (joint.before, joint.after)]
        for loop_joint in self.mechanism.loop_joints:
            lengths += [
                _shift(self.matrix(frame.placement)) for frame in (loop_joint.a, loop_joint.b)
            ]
        return max(lengths, default=0.0) or 1.0

    # --- poses and closure errors ---

    def poses(self, values: Mapping[str, Value]) -> dict[str, Floats]:
        """Return the pose of every body in the base frame, (4, 4) or (n, 4, 4)."""
        found = {self.mechanism.base_frame: np.eye(4)}
        for joint in self.mechanism.joints:
            T = found[joint.parent] @ self._offset(offset_of(joint), joint.before)
            if joint.kind != "fixed":
                T = T @ _motion(joint, values, self.number)
            found[joint.link] = T @ self._offset(f"{joint.name}.after", joint.after)
        return found

    def closure_errors(self, values: Mapping[str, float]) -> dict[str, ClosureResidual]:
        """Return the closure error of each loop, keyed by the name of the closure or strut.

        The returned dictionary also contains the closure error of each coupling, keyed by the name
        of the coupled joint.
        """
        poses, mechanism = self.poses(values), self.mechanism
        found = {}
        for loop_joint in mechanism.loop_joints:
            shift, turns = self._open(loop_joint, poses, values)
            found[loop_joint.name] = ClosureResidual(
                float(np.linalg.norm(shift)), float(np.linalg.norm(turns))
            )
        rows = zip(self.couplings.errors(values), self.couplings.is_turn, strict=True)
        for coupling, (error, is_turn) in zip(mechanism.couplings, rows, strict=True):
            parts = (0.0, abs(error)) if is_turn else (abs(error), 0.0)
            found[coupling.joint] = ClosureResidual(*map(float, parts))
        return found

    def ends(
        self, loop_joint: Closure | Strut, values: Mapping[str, float]
    ) -> tuple[Floats, Floats, Floats]:
        """Return both end frames (4, 4) of a closure or strut, and the vector from a to b.

        For a planar loop, the vector between the end frames is projected on the loop plane.
        """
        poses = self.poses(values)
        A, B = self.frames(poses, loop_joint)
        return A, B, self._in_plane(loop_joint, poses, B[:3, 3] - A[:3, 3])

    def normal(self, loop_joint: Closure | Strut, poses: Mapping[str, Floats]) -> Floats | None:
        """Return the unit normal of a planar loop in the base frame, or None for a spatial loop."""
        plane = self.planes.get(loop_joint.name)
        return None if plane is None else poses[loop_joint.a.body][..., :3, :3] @ plane[:, 2]

    def swings(self, values: Mapping[str, float]) -> dict[str, float]:
        """Return the swing angle (radian) of each pin-ended strut."""
        poses, found = self.poses(values), {}
        for strut in self.mechanism.struts:
            if strut.ends == "pin":
                A, B = self.frames(poses, strut)
                axes = poses[strut.a.body][:3, :3] @ self.planes[strut.name]
                x, y, _ = (B[:3, 3] - A[:3, 3]) @ axes
                found[strut.swing_name] = float(np.arctan2(y, x))
        return found

    def is_closed(self, closure_error: ClosureResidual) -> bool:
        """Whether a closure error is so small that the loop counts as closed."""
        return (
            closure_error.distance <= NUMERICALLY_CLOSED * self.size
            and closure_error.turn <= NUMERICALLY_CLOSED
        )

    def all_closed(self, values: Mapping[str, float], loops: Iterable[str]) -> bool:
        """Whether all named loops are closed, and all couplings hold."""
        closure_errors = self.closure_errors(values)
        names = (*loops, *(coupling.joint for coupling in self.mechanism.couplings))
        return all(self.is_closed(closure_errors[name]) for name in names)

    def axes(self, poses: Mapping[str, Floats], joints: Sequence[Joint]) -> tuple[Floats, Floats]:
        """Return the unit axes of joints and a point on each axis (n, 3), in the base frame."""
        found = [poses[j.parent] @ self._offset(offset_of(j), j.before) for j in joints]
        T = np.reshape(found, (-1, 4, 4))
        return T[:, :3, 2], T[:, :3, 3]

    def frames(
        self, poses: Mapping[str, Floats], loop_joint: Closure | Strut
    ) -> tuple[Floats, Floats]:
        """Return both end frames (4, 4) of a closure or strut, relative to the base frame."""
        A, B = (
            poses[frame.body] @ self._offset(offset_of(loop_joint, side), frame.placement)
            for side, frame in _sides(loop_joint)
        )
        return A, B

    def _in_plane(
        self, loop_joint: Closure | Strut, poses: Mapping[str, Floats], vector: Floats
    ) -> Floats:
        n = self.normal(loop_joint, poses)
        if n is None:
            return vector
        inside: Floats = vector - n * np.sum(n * vector, axis=-1, keepdims=True)
        return inside

    def _open(
        self, loop_joint: Closure | Strut, poses: Mapping[str, Floats], values: Mapping[str, Value]
    ) -> tuple[Floats, Floats]:
        """Return the closure errors of a loop as distances (meter) and angles (radian)."""
        A, B = self.frames(poses, loop_joint)
        d = self._in_plane(loop_joint, poses, B[..., :3, 3] - A[..., :3, 3])
        nothing = d[..., :0]
        if isinstance(loop_joint, Strut):
            advance = values[loop_joint.name] if loop_joint.is_cylinder else 0.0
            return (_norm(d) - self._retracted(loop_joint) - advance)[..., None], nothing
        if loop_joint.kind == "ball":
            return d, nothing
        turned = np.swapaxes(A[..., :3, :3], -1, -2)
        R = turned @ B[..., :3, :3]
        if loop_joint.kind == "pin":
            z = R[..., :, 2]
            # A pin of a planar loop may connect frames with opposite z axes.
            opposed = (loop_joint.name in self.planes) & (z[..., 2:] < 0)
            return d, _tilt(np.where(opposed, -z, z))
        if loop_joint.kind == "slider":
            d = (turned[..., :2, :] @ d[..., None])[..., 0]
        return d, _rotation_vector(R)

    # --- numerical closure of loops ---

    def nearest(
        self,
        values: Mapping[str, float],
        free: Sequence[str],
        loops: Iterable[str],
        last: str = "",
    ) -> dict[str, float]:
        """Minimize the closure errors of loops over joints, cylinders and constants.

        The Levenberg-Marquardt method starts from the given values and the current constants.

        Args:
            values: Initial values of all joints and cylinders (radian or meter).
            free: Names of the joints, cylinders or constants that may change.
            loops: Names of the closures and struts whose errors are reduced to zero.
            last: Name of the loop whose error is minimized while the other loops stay closed. If
                ``last`` is empty, all loops have equal weights.
        """
        at = {**values, **{name: self.constants[name] for name in free if name in self.constants}}
        before = self.constants
        residual, x = self._residual(at, free, loops, last)
        try:
            worthwhile = WORTHWHILE_GAIN if last else CLOSING_GAIN
            residual(least(residual, x, self._apart(free), worthwhile))
        finally:
            self.constants = before
        return at

    def _residual(
        self, at: dict[str, float], free: Sequence[str], loops: Iterable[str], last: str
    ) -> tuple[Callable[[Floats], Floats], Floats]:
        """Return a function from free variables to closure errors, and the initial variable values.

        Lengths are divided by the size of the mechanism.
        """
        names = {*loops}
        scale = np.array([self.size if self.is_length(name) else 1.0 for name in free])

        def residual(x: Floats) -> Floats:
            self._set(at, free, x * scale)
            poses = self.poses(at)
            couplings = self.couplings.errors(at) / self._coupling_scale
            parts = [couplings]
            for loop_joint in self.mechanism.loop_joints:
                if loop_joint.name in names:
                    shift, turns = self._open(loop_joint, poses, at)
                    weight = 1.0 if not last or loop_joint.name == last else OTHERS_FIRST
                    parts += [shift / self.size * weight, turns * weight]
            whole = [part if part.ndim == x.ndim else np.tile(part, (len(x), 1)) for part in parts]
            return np.concatenate(whole, axis=-1)

        return residual, np.array([at[name] for name in free]) / scale

    @property
    def _coupling_scale(self) -> Floats:
        return np.array([1.0 if turn else self.size for turn in self.couplings.is_turn])

    def is_length(self, name: str) -> bool:
        """Whether the value of a joint, cylinder or constant is a length."""
        member = self.mechanism.members.get(name)
        if member is not None:
            return isinstance(member, Strut) or member.kind == "prismatic"
        kinds = {p.name: p.kind for p in self.mechanism.parameters}
        return kinds.get(name, "length") == "length"

    def _apart(self, free: Sequence[str]) -> NDArray[np.bool_]:
        return np.array([name in self.constants for name in free], bool)

    def _set(self, at: dict[str, Any], names: Sequence[str], x: Floats) -> None:
        changed = {}
        for name, column in zip(names, x.T, strict=True):
            at[name] = column if column.ndim else float(column)
            if name in self.constants and self.constants[name] != column.flat[0]:
                changed[name] = float(column.flat[0])
        if changed:
            self.constants = self.constants | changed


@lru_cache(maxsize=4096)
def _function(symbols: tuple[sp.Symbol, ...], expression: sp.Expr) -> Callable[..., float]:
    function: Callable[..., float] = sp.lambdify(symbols, expression, "math")
    return function


@lru_cache(maxsize=16)
def _planes(mechanism: Mechanism) -> dict[str, Floats]:
    terms = Terms({p.symbol: p.value for p in mechanism.parameters})
    planar = planar_loop_joints(mechanism)
    axes = {
        c.name: planar[c.name].axes[c.a.body] for c in mechanism.loop_joints if c.name in planar
    }
    return {name: np.column_stack([_floats(v, terms) for v in own]) for name, own in axes.items()}


def length_of(strut: Strut) -> str:
    """Return the name of the constant for the length of a strut."""
    return f"{strut.name}.length"


def offset_of(member: Joint | Closure | Strut, side: str = "") -> str:
    """Return the name of the constant for the distance from a body origin to a frame."""
    return f"{member.name}.xyz" if not side else f"{member.name}.{side}.xyz"


def _sides(loop_joint: Closure | Strut) -> tuple[tuple[str, Frame], tuple[str, Frame]]:
    return ("a", loop_joint.a), ("b", loop_joint.b)


def _motion(
    joint: Joint, values: Mapping[str, Value], number: Callable[[sp.Expr], float]
) -> Floats:
    """Return the displacement of a moving joint, (4, 4) or (n, 4, 4)."""
    value = joint.direction * values[joint.name]
    T = _turn(2, 0.0 * value if joint.kind == "prismatic" else value)
    if joint.kind != "revolute":
        T[..., 2, 3] = value * (number(joint.pitch) if joint.kind == "helical" else 1.0)
    return T


def _turn(axis: int, angle: Value) -> Floats:
    i, j = (axis + 1) % 3, (axis + 2) % 3
    T = np.zeros((*np.shape(angle), 4, 4))
    T[..., axis, axis] = T[..., 3, 3] = 1.0
    T[..., i, i] = T[..., j, j] = np.cos(angle)
    T[..., j, i] = np.sin(angle)
    T[..., i, j] = -T[..., j, i]
    return T


def _norm(vector: Floats) -> Floats:
    return np.asarray(np.linalg.norm(vector, axis=-1))


def _tilt(axis: Floats) -> Floats:
    """Return the angles (radian) about x and y by which a unit vector is tilted from the z axis."""
    across = np.stack([-axis[..., 1], axis[..., 0]], axis=-1)
    return _scaled(across, axis[..., 2])


def _rotation_vector(R: Floats) -> Floats:
    """Return the rotation vector (radian) of a rotation matrix."""
    pairs = ((2, 1), (0, 2), (1, 0))
    v = np.stack([R[..., i, j] - R[..., j, i] for i, j in pairs], axis=-1) / 2
    return _scaled(v, (np.trace(R, axis1=-2, axis2=-1) - 1) / 2)


def _scaled(sine: Floats, cosine: Floats) -> Floats:
    """Scale a vector from the length sin(angle) to the length ``angle`` (radian).

    For a zero vector, the result points along the first axis.
    """
    length = _norm(sine)
    angle = np.arctan2(length, cosine)
    direction = np.where(
        length[..., None] == 0,
        np.eye(sine.shape[-1])[0],
        sine / np.where(length == 0, 1.0, length)[..., None],
    )
    return direction * angle[..., None]


def _floats(vector: sp.Matrix, terms: Terms) -> Floats:
    return np.array([float(terms.value(entry)) for entry in vector])


def _shift(T: Floats) -> float:
    return float(np.linalg.norm(T[:3, 3]))


def _has_symbols(motion: Rotation | Translation) -> bool:
    values = (motion.angle,) if isinstance(motion, Rotation) else motion.vector
    return any(value.free_symbols for value in values)
