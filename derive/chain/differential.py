"""Jacobians, their time derivatives, Hessian, twists and accelerations from screw theory.

Column j of a Jacobian is the twist (v_j; omega_j) of the tool if only joint j moves, at unit
velocity. The vector omega_j is the angular velocity of the tool, and v_j is the velocity of the
observed point. There are three Jacobians: `space`, `mixed` and `body`. The Jacobian `space`
contains velocities v_j of the point of the tool body at the base origin, in base axes. The Jacobian
`mixed` contains velocities v_j of the tool origin, in base axes. The Jacobian `body` contains
velocities v_j of the tool origin, in tool axes.

Let r = (r_x, r_y, r_z) be the vector from the axis z of a revolute joint to the observed point, in
joint axes. At unit joint velocity, the observed point has the velocity z x r = (-r_y, r_x, 0), the
cross product of z and r.
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
    """Linear and angular part of a twist, a Jacobian column or an acceleration."""

    v: Vector
    omega: Vector

    @property
    def entries(self) -> tuple[sp.Expr, ...]:
        """The three linear components, followed by the three angular components."""
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

    Column j of the space Jacobian has the derivative J_j' = ad(V_(j-1)) J_j, where V_(j-1) is the
    twist of the link before joint j.

    Column j of the body Jacobian has the derivative J_j' = ad(J_j) (V - V_j), where V - V_j is the
    part of the tool twist that later joints cause.

    Column j of the mixed Jacobian has the derivatives omega_j' = Omega_(j-1) x omega_j and v_j' =
    Omega_j x v_j + omega_j x v. In the derivative v_j', the vector v is the part of the tool
    velocity that the joints after joint j cause.
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
    """Return the derivatives of the mixed Jacobian with respect to the joint values.

    Entry [j][k] is the derivative of Jacobian column j with respect to the value of joint k.

    The angular part of entry [j][k] is omega_k x omega_j if joint k is before joint j, otherwise
    zero.
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
    # The cross product of joint axis and lever is computed in the frame that needs the fewest
    # multiplications.
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
    """Return a list whose entry j is the sum of all twists before twist j."""
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
