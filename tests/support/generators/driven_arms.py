"""Random arms driven by cylinders, rods and cranks.

Two or three joints move in a plane. Some arms have a column or a wrist. Each planar joint has one
of five drives. The main chain of each arm has a closed-form inverse kinematics function. Each seed
determines one arm.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import sympy as sp

from chasles.derive import Mechanism
from chasles.derive.model.placements import Placement, Rotation, Translation
from tests.support.generators.as_built import as_built, displaced
from tests.support.generators.drawn_mechanisms import (
    BASE,
    ORIGIN,
    DrawnMechanism,
    Point,
    Sketch,
    drawn,
)
from tests.support.oracles.multi_start import Multistart

QUARTER = sp.pi / 2
ERROR = 5e-4
"""Maximum length error (meter)."""
TOOL = (Translation((sp.Rational("0.15"), sp.Rational("0.02"), sp.S.Zero)),)
"""Tool offset from the axis of the last joint, so that this joint moves the tool."""
CLEAR = 0.02
"""Minimum distance of the reference from dead points (radian, or relative to the size). Length
errors cannot move the reference to a dead point."""
ATTEMPTS, ATTEMPTS_APART = 20, 100_000
SCALE = sp.S.One
"""Scale factor of the arm lengths. With this scale, arms are a few decimeters long, and an error of
0.5 mm is a typical manufacturing error."""
Drive = Callable[[Sketch, str, str, Point], None]
"""Function with the arguments (sketch, body, other body, pin position) that adds a drive."""


def _motor(s: Sketch, body: str, _on: str, _at: Point) -> None:
    s.actuated.append(_joint_of(body))


def _cylinder(s: Sketch, body: str, on: str, _at: Point) -> None:
    s.rod(f"{body}_cylinder", on, s.point(250), body, s.point(250))


def _crank(s: Sketch, body: str, on: str, at: Point) -> None:
    crank = s.pin(f"{body}_crank", on, _nearby(s, at))
    s.actuated.append(f"{body}_crank")
    tip = (s.length(60, 200), sp.S.Zero)
    s.rod(f"{body}_rod", crank, tip, body, s.point(150), s.length(150, 400))


def _rocker(s: Sketch, body: str, on: str, at: Point) -> None:
    rocker = s.pin(f"{body}_rocker", on, _nearby(s, at))
    tip = (s.length(100, 200), sp.S.Zero)
    s.rod(f"{body}_link", rocker, tip, body, s.point(150), s.length(100, 300))
    s.rod(f"{body}_cylinder", on, s.point(250), rocker, tip)


def _foot(s: Sketch, body: str, on: str, at: Point) -> None:
    """Add a crank on the preceding joint axis, and a rod parallel to the preceding link."""
    foot = next(joint for joint in s.joints if joint.link == on)
    arm = s.length(60, 150)
    crank = f"{body}_crank"
    s.pin(crank, foot.parent, tuple(foot.before[0].vector[:2]), *foot.before[1:])
    s.actuated.append(crank)
    s.rod(f"{body}_rod", f"{crank}_b", (arm, sp.S.Zero), body, (arm, sp.S.Zero), at[0])


DRIVES: tuple[Drive, ...] = (_motor, _cylinder, _crank, _rocker, _foot)


def _joint_of(body: str) -> str:
    return body.removesuffix("_b")


def _nearby(s: Sketch, at: Point) -> Point:
    x, y = s.point(250)
    return at[0] + x, at[1] + y


WRISTS: tuple[tuple[tuple[Rotation, ...], ...], ...] = (
    (),
    (),
    ((),),
    ((), (Rotation("y", QUARTER),)),
    ((Rotation("y", QUARTER),), (Rotation("y", -QUARTER),), (Rotation("y", QUARTER),)),
)
"""Rotations before each wrist joint, for four wrist types: none, pitch, pitch-roll and spherical.
"""


def driven_arm(s: Sketch) -> None:
    """Add the joints and struts of a random arm."""
    body, at, is_upright = BASE, ORIGIN, s.draw.random() < 0.6
    if is_upright:
        body = s.pin("column", BASE, ORIGIN)
        s.joints[-1] = replace(s.joints[-1], after=(Rotation("x", QUARTER),))
        s.actuated.append("column")
    wrist = s.draw.choice(WRISTS)
    count = 2 if len(wrist) == 3 else s.draw.choice((2, 2, 3))
    for k in range(count):
        arm, end = s.pin(f"arm{k}", body, at), (s.length(250, 500), sp.S.Zero)
        s.draw.choice(DRIVES if k else DRIVES[:-1])(s, arm, body, at)
        body, at = arm, end
    if is_upright or len(wrist) < 3:
        for k, turn in enumerate(wrist):
            body, at = s.pin(f"wrist{k}", body, at, *turn), ORIGIN
            s.actuated.append(f"wrist{k}")
    s.tools = [body]


def drawn_arm(seed: int, tool: Placement = TOOL) -> DrawnMechanism:
    """Return the arm for a seed, with a tool on its last body."""
    found = drawn(driven_arm, "driven arm", seed, SCALE)
    return replace(found, mechanism=replace(found.mechanism, tool=tool))


def built_arm(seed: int) -> Mechanism:
    """Return the as-built arm for a seed.

    If the loops of the as-built arm do not close near the reference of the design, another design
    is drawn. Near a dead point, length errors may prevent the loops from closing.
    """
    for attempt in range(ATTEMPTS):
        design = drawn_arm(seed + ATTEMPTS_APART * attempt)
        built = arm_as_built(design.mechanism, np.random.default_rng(seed))
        numbers = Multistart(built)
        names = list(design.mode)
        own = np.array(list(design.mode.values()))
        for mode in numbers.modes(design.q[None], numbers.actuated)[0]:
            apart = numbers.wrapped(names, np.array([mode[name] for name in names]) - own)
            if np.abs(apart).max() < CLEAR:
                return built
    raise AssertionError(f"seed {seed}: no generated arm closes as built")


def arm_as_built(design: Mechanism, rng: np.random.Generator) -> Mechanism:
    """Return an arm with errors in all lengths and in the joint axes outside the loops.

    Args:
        design: The arm.
        rng: Random generator of the errors (up to 0.5 mm and 2 mrad).
    """
    members = frozenset(member.name for member in (*design.joints, *design.struts))
    built = as_built(design, members, ERROR, rng)
    held = set[str]()
    for strut in design.struts:
        held |= _joints_below(design, strut.a.body) ^ _joints_below(design, strut.b.body)
    joints = (
        joint if joint.name in held else replace(joint, before=(*joint.before, *displaced(rng)))
        for joint in built.joints
    )
    return replace(built, joints=tuple(joints), nominal=design)


def _joints_below(mechanism: Mechanism, body: str) -> set[str]:
    carriers = {joint.link: joint for joint in mechanism.joints}
    found = set()
    while body in carriers:
        found.add(carriers[body].name)
        body = carriers[body].parent
    return found
