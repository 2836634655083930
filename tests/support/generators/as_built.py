"""As-built robots with loops: small random length errors in the loops."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import sympy as sp

from chasles.derive import Joint, Mechanism, Rotation, Translation
from chasles.derive.model.mechanism import Closure, Frame
from chasles.derive.model.robot import Placement

DECIMALS = 9


def as_built(
    mechanism: Mechanism, members: frozenset[str], error: float, rng: np.random.Generator
) -> Mechanism:
    """Return a mechanism with random length errors of some joints and rods.

    Args:
        mechanism: The mechanism with its designed lengths.
        members: Names of the joints and rods with errors.
        error: Maximum error of a pin coordinate or of a rod length (meter).
        rng: Random generator of the errors.
    """

    def off(value: sp.Expr) -> sp.Expr:
        if value == 0:
            return value
        return value + sp.Rational(f"{rng.uniform(-error, error):.{DECIMALS}f}")

    joints = tuple(
        replace(joint, before=_moved(joint.before, off)) if joint.name in members else joint
        for joint in mechanism.joints
    )
    struts = tuple(
        replace(
            strut,
            length=off(strut.length),
            a=_end(strut.a, off),
            b=_end(strut.b, off),
        )
        if strut.name in members
        else strut
        for strut in mechanism.struts
    )
    return replace(mechanism, joints=joints, struts=struts)


BOARD_INSTALLER = frozenset(
    {
        *("elbow", "wrist", "crank", "elbow_plate"),
        *("rod_KH", "rod_FH", "greater_rod", "smaller_rod"),
    }
)
"""Joints and rods of the pantograph and parallelograms of the board installer."""


UPRIGHT = Rotation("x", sp.pi / 2)
"""Rotation that maps z to -y, the direction of the arm axis of the board installer."""


LONGER = sp.Rational(2, 10_000)
"""Size of the error of a single length (meter)."""
TILT = Rotation("x", sp.pi / 1800)
"""Rotation error of a single axis (0.1 degrees)."""
Value = Callable[[sp.Expr], sp.Expr]


def single_errors(mechanism: Mechanism) -> Iterator[tuple[str, Mechanism]]:
    """Yield (error name, mechanism) for each error of one length or one joint axis.

    The second-to-last mechanism has errors in all lengths at once. The last mechanism has errors in
    all lengths and all joint axes.
    """
    lengths: list[sp.Expr] = []

    def listed(value: sp.Expr) -> sp.Expr:
        lengths.append(value)
        return value

    _with_lengths(mechanism, listed)
    for k, value in enumerate(lengths):
        if value != 0:
            yield f"length {k}, {value}", _with_lengths(mechanism, _longer({k: LONGER}))
    joints = [joint.name for joint in mechanism.joints if joint.kind != "fixed"]
    for name in joints:
        yield f"axis of {name}", _tilted(mechanism, {name})
    signs = np.random.default_rng(0).choice((-1, 1), len(lengths)).tolist()
    all_off = {k: s * LONGER for k, (s, x) in enumerate(zip(signs, lengths, strict=True)) if x != 0}
    spoilt = _with_lengths(mechanism, _longer(all_off))
    yield "all lengths", spoilt
    yield "all lengths and axes", _tilted(spoilt, set(joints))


def _longer(off: dict[int, sp.Rational]) -> Value:
    met = iter(range(10_000))
    return lambda value: value + off.get(next(met), 0)


def _with_lengths(mechanism: Mechanism, of: Value) -> Mechanism:
    """Return a mechanism with each length replaced by `of(length)`."""
    return replace(
        mechanism,
        joints=tuple(
            replace(j, before=_moved(j.before, of), after=_moved(j.after, of))
            for j in mechanism.joints
        ),
        closures=tuple(replace(c, a=_end(c.a, of), b=_end(c.b, of)) for c in mechanism.closures),
        struts=tuple(
            replace(
                s,
                a=_end(s.a, of),
                b=_end(s.b, of),
                length=s.length if s.is_cylinder else of(s.length),
            )
            for s in mechanism.struts
        ),
    )


def _moved(placement: Placement, of: Value) -> Placement:
    return tuple(
        replace(part, vector=tuple(map(of, part.vector))) if isinstance(part, Translation) else part
        for part in placement
    )


def _end(frame: Frame, of: Value) -> Frame:
    return replace(frame, placement=_moved(frame.placement, of))


def _tilted(mechanism: Mechanism, names: set[str]) -> Mechanism:
    return replace(
        mechanism,
        joints=tuple(
            replace(joint, before=(*joint.before, TILT)) if joint.name in names else joint
            for joint in mechanism.joints
        ),
    )


def on_links(mechanism: Mechanism, axis: Placement = ()) -> Mechanism:
    """Return a mechanism with pinned links in place of its rods.

    Each rod with pins becomes a body with two pins, and the geometry of the mechanism is unchanged.

    Args:
        mechanism: The robot, whose rod frames are parallel to the base frame.
        axis: Rotation from the z axis to the pin axis. By default, the pin axis is the z axis.
    """
    back = tuple(replace(turn, angle=-turn.angle) for turn in reversed(axis))
    rods = [s for s in mechanism.struts if s.ends == "pin" and not s.is_cylinder]
    joints = tuple(
        Joint(
            rod.swing_name,
            "revolute",
            before=(*rod.a.placement, *axis),
            after=back,
            link=f"{rod.name}_link",
            parent=rod.a.body,
        )
        for rod in rods
    )
    pins = tuple(
        Closure(
            rod.name,
            "pin",
            Frame(f"{rod.name}_link", (Translation((rod.length, 0, 0)), *axis)),
            Frame(rod.b.body, (*rod.b.placement, *axis)),
        )
        for rod in rods
    )
    kept = tuple(strut for strut in mechanism.struts if strut not in rods)
    return replace(
        mechanism,
        joints=(*mechanism.joints, *joints),
        struts=kept,
        closures=(*mechanism.closures, *pins),
        tool_body=mechanism.tool_body,
    )


def out_of_plane(mechanism: Mechanism, rng: np.random.Generator) -> Mechanism:
    """Return a mechanism with displaced joints.

    The loops of the mechanism close only in the least-squares sense.

    Each joint frame is shifted by 0.1 to 0.5 mm along each axis and rotated by 0.1 to 2 mrad about
    each axis.
    """
    joints = tuple(replace(j, before=(*j.before, *displaced(rng))) for j in mechanism.joints)
    closures = tuple(
        replace(c, a=replace(c.a, placement=(*c.a.placement, *displaced(rng))))
        for c in mechanism.closures
    )
    return replace(mechanism, joints=joints, closures=closures, closure="least squares")


def displaced(rng: np.random.Generator) -> Placement:
    """Return a random shift (0.1 to 0.5 mm per axis) and rotation (0.1 to 2 mrad per axis)."""

    def drawn(least: float, most: float) -> sp.Rational:
        value = rng.uniform(least, most) * rng.choice((-1, 1))
        return sp.Rational(f"{value:.{DECIMALS}f}")

    shift = Translation(tuple(drawn(1e-4, 5e-4) for _ in range(3)))
    return (shift, *(Rotation(axis, drawn(1e-4, 2e-3)) for axis in "xyz"))
