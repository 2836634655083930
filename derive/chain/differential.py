"""Jacobians, their time derivatives, Hessian, twists and accelerations from screw theory.

Column j of a Jacobian is (v_j; omega_j). Let joint j move at unit velocity: then omega_j is the
angular velocity, and v_j is the velocity of the observed point. There are three Jacobians. In the
Jacobian `space`, v_j is the velocity of the point at the base origin, in base axes. In the Jacobian
`mixed`, v_j is the velocity of the tool origin, in base axes. In the Jacobian `body`, v_j is the
velocity of the tool origin, in tool axes.

Let z be the axis of a revolute joint. Let r = (r_x, r_y, r_z) be the vector from a point of this
axis to the observed point, in joint axes. If the joint rotates at unit angular velocity, the
velocity of the point is z x r = (-r_y, r_x, 0).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import sympy as sp

from ..terms.terms import Terms
from ..terms.vectors import (
    ORIGIN,
    ZERO,
    Basis,
    Vector,
    added,
    combination,
    cross,
    named,
    rotated_x,
    rotated_z,
)
from .forward import Forward
from .groups import Station

Representation = Literal["space", "body", "mixed"]


@dataclass(frozen=True)
class Twist:
    """A twist, a Jacobian column or an acceleration: linear and angular part."""

    v: Vector
    omega: Vector

    @property
    def entries(self) -> tuple[sp.Expr, ...]:
        """The linear and the angular components."""
        return (*self.v, *self.omega)


NO_TWIST = Twist(ORIGIN, ORIGIN)


def columns(forward: Forward, representation: Representation) -> list[Twist]:
    """Return the Jacobian columns, one per moving joint, in the order of the chain."""
    if representation == "body":
        axes, end_axes = forward.axes_in_tool()
    else:
        axes, end_axes = forward.axes[:-1], forward.end_axes
    space = representation == "space"
    levers = forward.levers_of_base() if space else forward.levers_of_tool()
    found: list[Twist] = []
    for g, k, station in forward.stations():
        last = k == len(forward.groups[g].stations) - 1
        if station.joint is not None:
            choices = [(axes[g], levers[g].from_axis[k])]
            if last:
                choices.append((end_axes[g], levers[g].turned))
            found.append(_turning(forward.terms, station, choices))
        for slide in station.slides:
            c, s = forward.trigonometry[g][k]
            choices = [(axes[g], rotated_z(forward.terms, slide.direction, c, s))]
            if last:
                choices.append((end_axes[g], slide.direction))
            if last and g + 1 < len(axes):
                c, s = forward.groups[g].tilt
                choices.append((axes[g + 1], rotated_x(forward.terms, slide.direction, c, -s)))
            found.append(Twist(_cheapest(forward.terms, choices), ORIGIN))
    return found


def rates(
    terms: Terms, representation: Representation, screws: Sequence[Twist], speeds: Sequence[sp.Expr]
) -> list[Twist]:
    """Return the time derivatives of the Jacobian columns at given joint velocities.

    Space Jacobian: J_j' = ad(V_(j-1)) J_j, where V_(j-1) is the twist of the link before joint j.

    Body Jacobian: J_j' = ad(J_j) (V - V_j), where V - V_j is the twist that the joints after joint
    j cause.

    Mixed Jacobian: omega_j' = Omega_(j-1) x omega_j, and v_j' = Omega_j x v_j + omega_j x v. Here v
    is the part of the tool velocity that the joints after joint j cause.
    """
    scaled = [_scaled(terms, screw, speed) for screw, speed in zip(screws, speeds, strict=True)]
    before, after = _partial_sums(terms, scaled), _partial_sums(terms, scaled[::-1])[::-1]
    if representation == "space":
        return [_bracket(terms, V, J) for V, J in zip(before, screws, strict=True)]
    if representation == "body":
        return [_bracket(terms, J, V) for V, J in zip(after, screws, strict=True)]
    return [
        Twist(
            added(
                terms,
                cross(terms, added(terms, V.omega, own.omega), J.v),
                cross(terms, J.omega, rest.v),
            ),
            cross(terms, V.omega, J.omega),
        )
        for V, own, rest, J in zip(before, scaled, after, screws, strict=True)
    ]


def hessian(terms: Terms, screws: Sequence[Twist]) -> list[list[Twist]]:
    """Return the derivatives of the mixed Jacobian.

    Entry [j][k] is the derivative of column j with respect to joint k.

    The angular part of an entry is omega_k x omega_j if joint k is before joint j. Otherwise, the
    angular part is zero.
    """
    count = range(len(screws))
    return [
        [
            Twist(
                cross(terms, screws[min(j, k)].omega, screws[max(j, k)].v),
                cross(terms, screws[k].omega, screws[j].omega) if k < j else ORIGIN,
            )
            for k in count
        ]
        for j in count
    ]


def weighted(terms: Terms, screws: Sequence[Twist], weights: Sequence[sp.Expr]) -> Twist:
    """Return J w, the sum of the Jacobian columns weighted by w."""
    parts = [_scaled(terms, screw, weight) for screw, weight in zip(screws, weights, strict=True)]
    return _total(terms, parts)


def summed(terms: Terms, *twists: Twist) -> Twist:
    """Return the sum of twists."""
    return _total(terms, twists)


def _turning(terms: Terms, station: Station, choices: Sequence[tuple[Basis, Vector]]) -> Twist:
    sign = sp.Integer(station.sign)
    _, _, z = choices[0][0]
    omega = named(terms, (sign * component for component in z))
    # The product is computed in the frame that needs the fewest multiplications.
    spun = [(axes, (-sign * y, sign * x, ZERO)) for axes, (x, y, _) in choices]
    v = _cheapest(terms, spun)
    if station.pitch != 0:
        v = combination(terms, (sp.Integer(1), station.pitch), (v, omega))
    return Twist(v, omega)


def _cheapest(terms: Terms, choices: Sequence[tuple[Basis, Vector]]) -> Vector:
    axes, weights = min(choices, key=_products)
    return combination(terms, weights, axes)


def _products(choice: tuple[Basis, Vector]) -> int:
    axes, weights = choice
    return sum(
        entry != 0 and abs(entry) != 1
        for weight, axis in zip(weights, axes, strict=True)
        if weight != 0
        for entry in axis
    )


def _scaled(terms: Terms, twist: Twist, factor: sp.Expr) -> Twist:
    v, omega = (named(terms, (factor * x for x in part)) for part in (twist.v, twist.omega))
    return Twist(v, omega)


def _total(terms: Terms, twists: Sequence[Twist]) -> Twist:
    total = NO_TWIST
    for twist in twists:
        total = Twist(added(terms, total.v, twist.v), added(terms, total.omega, twist.omega))
    return total


def _partial_sums(terms: Terms, twists: Sequence[Twist]) -> list[Twist]:
    """Return a list whose entry j is the sum of the twists before j."""
    sums = [NO_TWIST]
    for twist in twists[:-1]:
        sums.append(_total(terms, (sums[-1], twist)))
    return sums


def _bracket(terms: Terms, a: Twist, b: Twist) -> Twist:
    """Return ad(a) b = (Omega_a x v_b + v_a x omega_b, Omega_a x omega_b)."""
    return Twist(
        added(terms, cross(terms, a.omega, b.v), cross(terms, a.v, b.omega)),
        cross(terms, a.omega, b.omega),
    )
