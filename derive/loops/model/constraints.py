"""Closure equations of loops on SE(3), as independent scalar equations.

Each loop starts at a body, from which two branches of joints, a and b, lead to the closure or
strut. The loop follows branch a, crosses the closure or strut, and returns along branch b. The
product of all displacements along a closed loop is the identity 1.

    exp(xi_1 z_1) ... exp(xi_k z_k) M exp(xi_(k+1) z_(k+1)) ... exp(xi_n z_n) = 1

Each screw xi_i is the joint screw at zero joint values, expressed in the frame of the body at which
the loop starts. The matrix M is the product of all displacements around the loop at zero joint
values. The scalar equations of a loop follow from this matrix equation. The equations of a planar
loop compare two points, each a sum of rotated vectors. The equations of a spatial loop compare the
poses of both branches.
"""

from collections.abc import Callable, Container, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Literal, NamedTuple

import sympy as sp

from ...chain.forward import Pose
from ...model.errors import DescriptionError, LoopError
from ...model.mechanism import Frame, Mechanism, Strut
from ...model.robot import Joint
from ...model.tolerances import ZERO_COMPONENT
from ...terms.generic_point import GenericPoint
from ...terms.tangents import Tangent, derivative_columns
from ...terms.terms import Terms
from ...terms.vectors import dot, subtracted
from .body_frames import pose_along
from .coupling_equations import CouplingEquation, coupling_equations
from .exponentials import Factor, around
from .phasors import ONE, ZERO, Complex, PhasorSum, PlanarPose, conjugate, product
from .planes import (
    Edge,
    Linkage,
    Loop,
    PinEdge,
    SlideEdge,
    WeldEdge,
    loops,
    planar_loop_joints,
    tidied,
)
from .rows import FACING, ROWS, Along, Kind

EquationKind = Literal["planar", "spatial", "point", "distance"]


class ConfigurationVariable(NamedTuple):
    """An entry of the full configuration z with its unit (m or rad)."""

    name: str
    unit: str


@dataclass(frozen=True)
class LoopEquations:
    """The equations of one loop as functions of the full configuration.

    Attributes:
        loop: The loop, which consists of a closure or strut and two branches.
        kind: Kind of the equations: ``point`` for a spatial ball closure, ``distance`` for a strut
            with ball ends, otherwise ``planar`` or ``spatial``.
        residual: Independent expressions that are zero if the loop is closed. Each residual is a
            component of the position difference of the two branch ends (a minus b), a difference of
            lengths, or a direction cosine.
        units: Unit of each residual: m for a length, 1 for a direction cosine.
        facing: Cosines between corresponding axes of the two end frames, each 1 if the loop is
            closed. If the residual is zero but a frame is flipped, a term of ``facing`` is 0 or
            negative.
        exponentials: Function that computes the properties ``factors`` and ``home`` when they are
            first read.
    """

    loop: Loop
    kind: EquationKind
    residual: tuple[sp.Expr, ...]
    units: tuple[str, ...]
    facing: tuple[sp.Expr, ...]
    exponentials: Callable[[], tuple[tuple[Factor, ...], sp.ImmutableMatrix]]

    @cached_property
    def _around(self) -> tuple[tuple[Factor, ...], sp.ImmutableMatrix]:
        return self.exponentials()

    @property
    def factors(self) -> tuple[Factor, ...]:
        """The matrix exponentials of the joints around the loop, from a body back to the same body.

        If the loop is closed, the product of the exponentials and of ``home`` is the identity.
        """
        return self._around[0]

    @property
    def home(self) -> sp.ImmutableMatrix:
        """The displacement around the loop at zero joint values, as a matrix (4, 4)."""
        return self._around[1]

    @property
    def name(self) -> str:
        """Name of the closure or strut."""
        return self.loop.loop_joint.name

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints around the loop."""
        return tuple(dict.fromkeys(factor.name for factor in self.factors))


ClosureEquations = LoopEquations | CouplingEquation
"""The equations of a loop or of a coupling."""


def configuration_names(mechanism: Mechanism) -> tuple[ConfigurationVariable, ...]:
    """Return the name and unit of each entry of the full configuration z.

    The full configuration lists the moving tree joints first, then the struts, in the order of the
    description. A cylinder contributes its coordinate, and a strut with pin ends contributes its
    swing angle.
    """
    found = [ConfigurationVariable(j.name, j.unit) for j in mechanism.joints if j.kind != "fixed"]
    for strut in mechanism.struts:
        if strut.is_cylinder:
            found.append(ConfigurationVariable(strut.name, "m"))
        if strut.ends == "pin":
            found.append(ConfigurationVariable(strut.swing_name, "rad"))
    return tuple(found)


def constraints(
    mechanism: Mechanism, terms: Terms, z: Sequence[sp.Symbol], *, may_stay_open: bool = False
) -> tuple[ClosureEquations, ...]:
    """Return the equations of all loops in the order of the closures and struts.

    The table ``ROWS`` lists the equations of each kind of closure. If two points must coincide,
    their difference is expressed in the axes of the body at which the loop starts. A strut with
    ball ends has one equation for the distance between its ends. A strut with pin ends has two
    equations. The two equations state that a vector with the length and direction of the strut
    connects the strut's end points.

    Equations that hold in every configuration are omitted.

    Args:
        mechanism: The description.
        terms: Receives the terms.
        z: Symbols of the full configuration (radian or meter), in the order of
            ``configuration_names``.
        may_stay_open: If True, the loops need to close only in the least-squares sense, and an
            equation that holds in no configuration causes no error.

    Raises:
        DescriptionError: A loop never closes, or a spatial loop contains a strut with pin ends.
    """
    names = [variable.name for variable in configuration_names(mechanism)]
    values = dict(zip(names, z, strict=True))
    of_loops = _Constraints(mechanism, terms, values, may_stay_open=may_stay_open).all()
    return (*of_loops, *coupling_equations(mechanism, terms, values))


def residuals(
    mechanism: Mechanism, terms: Terms, values: Mapping[str, sp.Expr], loop_joints: Container[str]
) -> list[tuple[sp.Expr, str]]:
    """Return the residuals of the named closures and struts.

    Residuals that are always zero are included.

    Args:
        mechanism: The description.
        terms: Receives the terms.
        values: Symbolic values of joints, swing angles and cylinders by name (radian or meter).
        loop_joints: Names of the requested closures and struts.

    Returns:
        A pair (residual, unit) for each equation of the named closures and struts. The unit of a
        residual is m for a length and 1 for a direction cosine.
    """
    at = _Constraints(mechanism, terms, values)
    requested = [
        at.residual_of(loop) for loop in loops(mechanism) if loop.loop_joint.name in loop_joints
    ]
    return [pair for one in requested for pair in zip(one.entries, one.units, strict=True)]


def swing_angles(
    mechanism: Mechanism, terms: Terms, values: Mapping[str, sp.Expr]
) -> dict[str, sp.Expr]:
    """Return the swing angle (-pi to pi) of each pin-ended strut, keyed by the name of the angle.

    Args:
        mechanism: The description. Struts with pin ends must belong to planar loops.
        terms: Receives the terms.
        values: Symbolic values of all joints and cylinders by name (radian or meter).
    """
    linkage_of = planar_loop_joints(mechanism)
    return {
        loop.loop_joint.swing_name: _Planar(
            terms, linkage_of[loop.loop_joint.name], loop, values
        ).swing_of(loop.loop_joint)
        for loop in loops(mechanism)
        if isinstance(loop.loop_joint, Strut) and loop.loop_joint.ends == "pin"
    }


def jacobian(
    equations: Sequence[ClosureEquations], terms: Terms, z: Sequence[sp.Symbol]
) -> tuple[tuple[sp.Expr, ...], ...]:
    """Return the Jacobian of all closure residuals with respect to z, shape (equations, len(z)).

    Each row of the Jacobian has the unit of its equation per radian or meter. The Jacobian loses
    rank at a singularity, and if the mechanism is overconstrained.
    """
    return derivative_rows([entry for loop in equations for entry in loop.residual], terms, z)


def derivative_rows(
    entries: Sequence[sp.Expr], terms: Terms, z: Sequence[sp.Symbol]
) -> tuple[tuple[sp.Expr, ...], ...]:
    """Return the Jacobian of expressions with respect to z, shape (entries, len(z))."""
    columns = derivative_columns(terms, entries, z)
    return tuple(zip(*columns, strict=True)) if entries else ()


def jacobian_dot(
    equations: Sequence[ClosureEquations],
    terms: Terms,
    z: Sequence[sp.Symbol],
    zd: Sequence[sp.Symbol],
) -> tuple[tuple[sp.Expr, ...], ...]:
    """Return the time derivative of the Jacobian of the closure residuals at the rates zd.

    The accelerations zdd of the mechanism satisfy ``J zdd + J_dot zd = 0``, where J is the Jacobian
    of the closure residuals.
    """
    return rates_of(jacobian(equations, terms, z), terms, z, zd)


def rates_of(
    rows: Sequence[Sequence[sp.Expr]],
    terms: Terms,
    z: Sequence[sp.Symbol],
    zd: Sequence[sp.Symbol],
) -> tuple[tuple[sp.Expr, ...], ...]:
    """Return the time derivative of a matrix that depends on z, at the rates zd."""
    tangent = Tangent(terms, dict(zip(z, zd, strict=True)))
    return tuple(tuple(tangent.of_each(row)) for row in rows)


class _Residual(NamedTuple):
    kind: EquationKind
    entries: tuple[sp.Expr, ...]
    units: tuple[str, ...]
    facing: tuple[sp.Expr, ...] = ()


class _Constraints:
    """Builds the loop equations of one mechanism."""

    def __init__(
        self,
        mechanism: Mechanism,
        terms: Terms,
        values: Mapping[str, sp.Expr],
        *,
        may_stay_open: bool = False,
    ) -> None:
        self.mechanism, self.terms, self.values = mechanism, terms, values
        self.may_stay_open = may_stay_open
        self.linkage_of = planar_loop_joints(mechanism)

    @cached_property
    def generic(self) -> list[GenericPoint]:
        """Return two arbitrary configurations."""
        symbols = (*self.terms.parameters, *self.values.values())
        return [GenericPoint(self.terms, symbols, phase) for phase in (1, 2)]

    def all(self) -> tuple[LoopEquations, ...]:
        return tuple(self.of(loop) for loop in loops(self.mechanism))

    def of(self, loop: Loop) -> LoopEquations:
        linkage = self.linkage_of.get(loop.loop_joint.name)
        residual = self.residual_of(loop)
        kept = [k for k, e in enumerate(residual.entries) if not self._vanishes(loop, e)]
        return LoopEquations(
            loop,
            residual.kind,
            tuple(residual.entries[k] for k in kept),
            tuple(residual.units[k] for k in kept),
            tuple(entry for entry in residual.facing if entry != ONE),
            partial(around, self.terms, loop, linkage),
        )

    def residual_of(self, loop: Loop) -> _Residual:
        linkage = self.linkage_of.get(loop.loop_joint.name)
        if linkage is not None:
            return _Planar(self.terms, linkage, loop, self.values).residual()
        return _Spatial(self.mechanism, self.terms, loop, self.values).residual()

    def _vanishes(self, loop: Loop, entry: sp.Expr) -> bool:
        """Whether a loop equation holds in all configurations.

        The test evaluates the equation in two arbitrary configurations.
        """
        if self.terms.is_constant(entry):
            first = second = self.terms.value(entry)
        else:
            first, second = (point.value(entry) for point in self.generic)
        if abs(first) < ZERO_COMPONENT and abs(second) < ZERO_COMPONENT:
            return True
        if abs(first - second) < ZERO_COMPONENT and not self.may_stay_open:
            raise LoopError(
                f"robot {self.mechanism.name!r}: a loop does not close in any configuration; the "
                f"residual of {loop.loop_joint.name!r} is {first.evalf(6)}"
            )
        return False


# --- planar loops ---


class _Planar:
    def __init__(
        self, terms: Terms, linkage: Linkage, loop: Loop, values: Mapping[str, sp.Expr]
    ) -> None:
        self.terms, self.loop, self.linkage, self.values = terms, loop, linkage, values
        self.edges = {edge.name: edge for edge in linkage.edges}
        self.a, self.b = self._end(loop.to_a), self._end(loop.to_b)

    def residual(self) -> _Residual:
        loop_joint = self.loop.loop_joint
        if isinstance(loop_joint, Strut):
            return self._strut(loop_joint)
        edge = self.edges[loop_joint.name]
        if isinstance(edge, PinEdge):
            return self._met(self.a.point(edge.at_a) - self.b.point(edge.at_b))
        c, s = self._turn(edge)
        if isinstance(edge, WeldEdge):
            met = self._met(self.a.point(edge.at_a) - self.b.origin)
            return met._replace(entries=(*met.entries, s), units=(*met.units, "1"), facing=(c,))
        return _Residual("planar", (self._offset(edge), s), ("m", "1"), (c,))

    def _end(self, path: Iterable[Joint]) -> PlanarPose:
        body = PlanarPose()
        for joint in path:
            body = self._after(body, self.edges[joint.name])
        return body

    def _after(self, body: PlanarPose, edge: Edge) -> PlanarPose:
        rotor = product(body.rotor, edge.rotor)
        re, im = tidied(self.terms, sp.Matrix(rotor))
        if isinstance(edge, WeldEdge):
            return PlanarPose(body.angle, (re, im), body.point(edge.at_a))
        value = self.values[edge.name]
        if isinstance(edge, SlideEdge):
            moved = replace(body, rotor=(re, im), origin=body.point(edge.at_a))
            along = body.vector((value * edge.direction[0], value * edge.direction[1]))
            return replace(moved, origin=moved.origin + along - moved.vector(edge.at_b))
        turned = PlanarPose(body.angle + edge.sense * value, (re, im), body.point(edge.at_a))
        return replace(turned, origin=turned.origin - turned.vector(edge.at_b))

    def _met(self, difference: PhasorSum) -> _Residual:
        return _Residual("planar", difference.coordinates(self.terms), ("m", "m"))

    def swing_of(self, strut: Strut) -> sp.Expr:
        """Return the direction angle of a strut, relative to the body at its first end."""
        swing, end = self.edges[strut.swing_name], self.edges[f"{strut.name}.end"]
        assert isinstance(swing, PinEdge)
        assert isinstance(end, PinEdge)
        along = self.b.point(end.at_b) - self.a.point(swing.at_a)
        seen = along.turned(-self.a.angle).times(conjugate(self.a.rotor))
        x, y = seen.coordinates(self.terms)
        return self.terms.let(sp.atan2(swing.sense * y, x, evaluate=False))

    def _strut(self, strut: Strut) -> _Residual:
        swing, end = self.edges[strut.swing_name], self.edges[f"{strut.name}.end"]
        assert isinstance(swing, PinEdge)
        assert isinstance(end, PinEdge)
        begin, far = self.a.point(swing.at_a), self.b.point(end.at_b)
        length = strut.length + (self.values[strut.name] if strut.is_cylinder else ZERO)
        if strut.ends == "ball":
            x, y = (begin - far).coordinates(self.terms)
            return _distance(self.terms, (x, y), length)
        angle = self.a.angle + swing.sense * self.values[strut.swing_name]
        barrel = PlanarPose(angle, self.a.rotor, begin)
        return self._met(barrel.point((length, ZERO)) - far)

    def _turn(self, edge: SlideEdge | WeldEdge) -> Complex:
        """Return the cosine and sine of body b's rotation from its orientation in a closed loop."""
        wanted = product(self.a.rotor, edge.rotor)
        rotor = product(self.b.rotor, conjugate(wanted))
        re, im = tidied(self.terms, sp.Matrix(rotor))
        return PhasorSum.of((re, im), self.b.angle - self.a.angle).coordinates(self.terms)

    def _offset(self, edge: SlideEdge) -> sp.Expr:
        """Return the slider point's signed distance from the guide line, positive to the right."""
        guide = product(edge.direction, self.a.rotor)
        difference = self.a.point(edge.at_a) - self.b.point(edge.at_b)
        _, across = difference.turned(-self.a.angle).times(conjugate(guide)).coordinates(self.terms)
        return across


def _distance(terms: Terms, difference: Sequence[sp.Expr], length: sp.Expr) -> _Residual:
    square = terms.let(sum((terms.let(x**2) for x in difference), ZERO))
    return _Residual("distance", (terms.let(terms.let(sp.sqrt(square)) - length),), ("m",))


# --- spatial loops ---


class _Spatial:
    """Closure equations of a spatial loop, computed from the poses of its two end frames."""

    def __init__(
        self, mechanism: Mechanism, terms: Terms, loop: Loop, values: Mapping[str, sp.Expr]
    ) -> None:
        self.mechanism, self.terms, self.loop, self.values = mechanism, terms, loop, values

    def residual(self) -> _Residual:
        loop_joint = self.loop.loop_joint
        if isinstance(loop_joint, Strut) and loop_joint.ends == "pin":
            raise DescriptionError(
                f"robot {self.mechanism.name!r}: {loop_joint.name!r}: the ends are pins, but the "
                'loop is not planar; use ends = "ball" or ["pin", "ball"], or replace the rod or '
                "cylinder by a joint and a closure"
            )
        (A, p_a), (B, p_b) = (
            self._pose(self.loop.to_a, loop_joint.a),
            self._pose(self.loop.to_b, loop_joint.b),
        )
        difference = subtracted(self.terms, p_a, p_b)
        if isinstance(loop_joint, Strut):
            length = loop_joint.length + (
                self.values[loop_joint.name] if loop_joint.is_cylinder else ZERO
            )
            return _distance(self.terms, difference, length)
        along = partial(dot, self.terms)
        kind: Kind = (loop_joint.kind, "space")
        rows = ROWS[kind]
        # If all three components of the position difference must be zero, any axes are suitable.
        # The axes of the body at which the loop starts give the shortest expressions.
        is_met = sum(isinstance(row, Along) for row in rows) == len(difference)
        entries = [
            (difference[row.axis] if is_met else along(A[row.axis], difference))
            if isinstance(row, Along)
            else along(A[row.a], B[row.b])
            for row in rows
        ]
        units = ["m" if isinstance(row, Along) else "1" for row in rows]
        facing = tuple(along(A[k], B[k]) for k in FACING[kind])
        name: EquationKind = "point" if loop_joint.kind == "ball" else "spatial"
        return _Residual(name, tuple(entries), tuple(units), facing)

    def _pose(self, path: Sequence[Joint], frame: Frame) -> Pose:
        """Return the pose of a frame relative to the body at which the loop starts."""
        return pose_along(self.mechanism, self.terms, path, frame.placement, self.values)
