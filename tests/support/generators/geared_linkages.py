"""Random linkages with gears, racks and planetary stages between their joints.

Newton's method computes a configuration with closed loops before the gears are added. Each seed
determines one mechanism.
"""

import random
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
import sympy as sp

from chasles.derive import Mechanism
from chasles.derive.loops.model.coupling_equations import is_length
from chasles.derive.model.coupling import Coupling
from chasles.derive.model.placements import Rotation, Translation
from tests.support.generators.drawn_mechanisms import BASE, DIGITS, ORIGIN, Sketch
from tests.support.loops.closed_in_numbers import HELD, Model

RATIOS = (1, -1, 2, -2, "1/2", "-1/2", "3/2", "-2/3", "1/3", 3, "-20/60")
TRIALS = 400
EACH_CYLINDER = 3
FAR = (sp.Rational(1, 5), sp.S.Zero)
RADII = (-80, -30, 25, 60, 100)
"""Pitch radii of pinions (millimeter)."""


@dataclass(frozen=True)
class GearedLinkage:
    """A random mechanism, and its coordinates q (n,) at the reference configuration."""

    mechanism: Mechanism
    family: str
    q: np.ndarray


Pair = tuple[str, Mapping[str, sp.Expr]]
"""A coupled joint, and the gear ratio for each leader joint, keyed by name."""


def geared_linkage(seed: int) -> GearedLinkage:
    draw = random.Random(seed)
    for _ in range(TRIALS):
        family = draw.choice(CYLINDER_FAMILIES if seed % EACH_CYLINDER == 0 else FAMILIES)
        sketch = Sketch(draw)
        pairs = family(sketch)
        turned = [_reversed_at_times(draw, pair) for pair in pairs]
        is_unique = len({joint for joint, _ in turned}) == len(turned)
        found = _with_gears(sketch, turned if is_unique else pairs)
        if found is not None:
            return GearedLinkage(*found[:1], family.__name__, found[1])
    raise AssertionError(f"seed {seed}: no linkage closes")


def _with_gears(sketch: Sketch, pairs: list[Pair]) -> tuple[Mechanism, np.ndarray] | None:
    draw, rng = sketch.draw, np.random.default_rng(sketch.draw.randrange(2**32))
    bare = Mechanism(
        name="geared",
        joints=tuple(sketch.joints),
        actuated=tuple(sketch.actuated),
        closures=tuple(sketch.closures),
        struts=tuple(sketch.struts),
        tool_body=draw.choice(sketch.tools),
        tool=(Translation((*sketch.point(), 0)),),
    )
    at = _closed(bare, rng)
    if at is None:
        return None
    couplings = tuple(_fitted(pair, at) for pair in pairs)
    reference = tuple((name, sp.Rational(f"{x:.{DIGITS}f}")) for name, x in at.items())
    found = replace(bare, couplings=couplings, reference=reference)
    model = Model(found)
    try:
        u = model.closed(model.q, model.u)
    except AssertionError:
        return None
    is_near = np.abs(u - model.u).max(initial=0.0) < 0.05
    return (found, model.q) if is_near and model.held(model.q, u) > 2 * HELD else None


def _closed(bare: Mechanism, rng: np.random.Generator) -> dict[str, float] | None:
    """Return all joint values of a random closed configuration, or None if none is found."""
    free = Model(replace(bare, actuated=(bare.joints[0].name,)))
    q, u = rng.uniform(-1, 1, 1), rng.uniform(-1.5, 1.5, len(free.u))
    try:
        at = free.values(q, free.closed(q, u))
    except (AssertionError, np.linalg.LinAlgError):
        return None
    slides = {name for name, member in bare.members.items() if is_length(member)}
    return {
        n: x if n in slides else float(np.remainder(x + np.pi, 2 * np.pi) - np.pi)
        for n, x in at.items()
    }


def _fitted(pair: Pair, at: Mapping[str, float]) -> Coupling:
    joint, ratios = pair
    offset = at[joint] - sum(float(ratio) * at[name] for name, ratio in ratios.items())
    return Coupling(joint, tuple(ratios.items()), sp.Rational(f"{offset:.{DIGITS}f}"))


def _reversed_at_times(draw: random.Random, pair: Pair) -> Pair:
    """With probability 1/2, solve the equation of a gear for a randomly selected leader joint."""
    joint, ratios = pair
    if draw.random() < 0.5:
        return pair
    leader = draw.choice([*ratios])
    others = {name: -ratio / ratios[leader] for name, ratio in ratios.items() if name != leader}
    return leader, others | {joint: 1 / ratios[leader]}


def _ratio(s: Sketch) -> sp.Expr:
    return sp.Rational(s.draw.choice(RATIOS))


def _radius(s: Sketch) -> sp.Expr:
    return sp.Rational(s.draw.choice(RADII), 1000)


def _four_bar(s: Sketch, on: str, name: str, at: tuple[sp.Expr, sp.Expr] = ORIGIN) -> list[str]:
    """Add a crank, a coupler and a rocker on a body, and return their bodies."""
    crank = s.pin(f"{name}_crank", on, at)
    far = (s.length(80, 250), sp.S.Zero)
    pivot = (at[0] + s.length(200, 400), at[1] + s.length(-80, 80))
    first, second = s.length(200, 450), s.length(200, 400)
    coupler, rocker = s.pin(f"{name}_coupler", crank, far), s.pin(f"{name}_rocker", on, pivot)
    s.close(f"{name}_pin", coupler, (first, sp.S.Zero), rocker, (second, sp.S.Zero))
    return [crank, coupler, rocker]


# --- families ---


def _five_bar(s: Sketch) -> list[str]:
    joints = ("left", "left_link", "right", "right_link")
    one, other = s.pin("left", BASE, ORIGIN), s.pin("right", BASE, (s.length(100, 400), 0))
    ends = [(s.length(100, 300), sp.S.Zero) for _ in range(2)]
    lengths = [s.length(200, 450) for _ in range(2)]
    links = [
        s.pin(f"{name}_link", body, end)
        for name, body, end in zip(("left", "right"), (one, other), ends, strict=True)
    ]
    s.close("pin", links[0], (lengths[0], sp.S.Zero), links[1], (lengths[1], sp.S.Zero))
    s.tools = [*links, other]
    return [*joints]


def geared_five_bar(s: Sketch) -> list[Pair]:
    """A gear pair between the cranks of a five-bar linkage."""
    _five_bar(s)
    s.actuated = ["left"]
    return [("right", {"left": _ratio(s)})]


def gears_between_passive_joints(s: Sketch) -> list[Pair]:
    """A gear pair between two passive joints of a five-bar linkage."""
    joints = _five_bar(s)
    s.actuated = [s.draw.choice(joints)]
    follower, leader = s.draw.sample([name for name in joints if name not in s.actuated], 2)
    return [(follower, {leader: _ratio(s)})]


def gear_train(s: Sketch) -> list[Pair]:
    """A rocker of one four-bar that drives the crank of a second one through a gear."""
    _four_bar(s, BASE, "a")
    bodies = _four_bar(s, BASE, "b", (s.length(500, 600), s.length(-100, 100)))
    s.actuated, s.tools = [s.draw.choice(("a_crank", "a_rocker"))], bodies
    leader = "a_rocker" if s.actuated == ["a_crank"] else "a_crank"
    return [("b_crank", {leader: _ratio(s)})]


def rack(s: Sketch) -> list[Pair]:
    """A pinion on a rocker meshes with a rack on a slide.

    The slide carries an arm or a four-bar linkage.
    """
    _four_bar(s, BASE, "a")
    carriage = s.slide("slide", BASE, s.point(), sp.pi * sp.Rational(s.draw.randint(-4, 4), 8))
    s.actuated = [s.draw.choice(("a_crank", "slide"))]
    pairs: list[Pair] = [("slide", {"a_rocker": _radius(s)})]
    if s.draw.random() < 0.5:
        s.tools = [s.pin("arm", carriage, s.point())]
        return [*pairs, ("arm", {"a_coupler": _ratio(s), "slide": sp.Integer(2)})]
    s.tools = _four_bar(s, carriage, "b")
    return [*pairs, ("b_crank", {"a_coupler": _ratio(s)})]


def planetary_stage(s: Sketch) -> list[Pair]:
    """A planetary stage whose ring is a rocker, and whose carrier moves an arm or a linkage."""
    _four_bar(s, BASE, "a")
    sun, ring = s.draw.randint(15, 40), s.draw.randint(50, 90)
    s.pin("sun", BASE, ORIGIN)
    total = sp.Integer(sun + ring)
    if s.draw.random() < 0.5:
        carrier = s.pin("carrier", BASE, ORIGIN)
        s.tools = [carrier, s.pin("arm", carrier, FAR)]
        s.actuated = ["sun", "a_crank", "arm"]
    else:
        _, coupler, rocker = _four_bar(s, BASE, "b", (s.length(500, 600), sp.S.Zero))
        s.joints = [replace(j, name="carrier") if j.name == "b_crank" else j for j in s.joints]
        s.tools, s.actuated = [coupler, rocker], ["sun", "a_crank"]
    return [("carrier", {"sun": sun / total, "a_rocker": ring / total})]


def two_gears_in_a_loop(s: Sketch) -> list[Pair]:
    """A six-bar ring whose joints are connected by two gear pairs."""
    body, at = BASE, ORIGIN
    names = [f"j{k}" for k in range(5)]
    for name in names:
        body, at = s.pin(name, body, at), (s.length(120, 300), sp.S.Zero)
    s.close("pin", body, at, BASE, (s.length(200, 400), s.length(-100, 100)))
    s.tools = [f"{name}_b" for name in names[2:4]]
    s.actuated = [s.draw.choice(names)]
    left = [name for name in names if name not in s.actuated]
    one, two, three, four = s.draw.sample(left, 4)
    return [(one, {two: _ratio(s)}), (three, {four: _ratio(s), one: _ratio(s)})]


def spatial_linkage(s: Sketch) -> list[Pair]:
    """An RSSR linkage whose output crank turns an arm through a gear."""
    s.pin("input", BASE, ORIGIN)
    tilt = sp.Rational(s.draw.randint(20, 90), 100)
    s.pin("output", BASE, (s.length(200, 400), s.length(-100, 100)), Rotation("x", tilt))
    ends = [(s.length(60, 150), sp.S.Zero) for _ in range(2)]
    s.rod("rod", "input_b", ends[0], "output_b", ends[1], s.length(250, 400))
    s.struts = [replace(strut, ends="ball") for strut in s.struts]
    s.pin("base_arm", BASE, s.point(), Rotation("y", tilt))
    s.tools, s.actuated = [s.pin("arm", "base_arm_b", FAR)], ["input"]
    return [("base_arm", {"output": _ratio(s)}), ("arm", {"input": _ratio(s), "output": _ratio(s)})]


def gears_without_loops(s: Sketch) -> list[Pair]:
    """An arm without loops whose joints are connected by gears."""
    s.pin("shaft", BASE, s.point())
    one = s.pin("one", BASE, ORIGIN)
    two = s.pin("two", one, FAR, Rotation("x", sp.Rational(1, 2)))
    s.tools, s.actuated = [s.pin("three", two, FAR)], ["shaft", "two"]
    return [("one", {"shaft": _ratio(s)}), ("three", {"one": _ratio(s), "two": _ratio(s)})]


def cylinders_in_unison(s: Sketch) -> list[Pair]:
    """Two booms with connected cylinders: oil that leaves one cylinder fills the other."""
    one = s.pin("one", BASE, ORIGIN)
    on, at = s.draw.choice(((one, FAR), (BASE, (s.length(300, 500), sp.S.Zero))))
    two = s.pin("two", on, at)
    s.rod("first", BASE, s.point(), one, s.point())
    s.rod("second", on, s.point(), two, s.point())
    s.tools, s.actuated = [two], [s.draw.choice(("first", "one"))]
    return [("second", {"first": _ratio(s)})]


def spindle(s: Sketch) -> list[Pair]:
    """A rocker turns the spindle of a cylinder, and the cylinder lifts a boom."""
    _four_bar(s, BASE, "a")
    boom = s.pin("boom", BASE, (s.length(-300, 300), s.length(400, 600)))
    s.rod("spindle", BASE, s.point(), boom, s.point())
    s.tools, s.actuated = [boom], [s.draw.choice(("a_crank", "boom"))]
    return [("spindle", {"a_rocker": _radius(s)})]


def cylinder_in_a_five_bar(s: Sketch) -> list[Pair]:
    """A five-bar linkage with a cylinder whose length is coupled to a joint angle."""
    joints = _five_bar(s)
    tools = s.tools
    s.rod("ram", BASE, s.point(), s.draw.choice(tools), s.point())
    s.actuated = [s.draw.choice(joints)]
    leader = s.draw.choice([name for name in joints if name not in s.actuated])
    return [("ram", {leader: _radius(s)})]


CYLINDER_FAMILIES: tuple[Callable[[Sketch], list[Pair]], ...] = (
    cylinders_in_unison,
    spindle,
    cylinder_in_a_five_bar,
)
FAMILIES: tuple[Callable[[Sketch], list[Pair]], ...] = (
    geared_five_bar,
    gears_between_passive_joints,
    gear_train,
    rack,
    planetary_stage,
    two_gears_in_a_loop,
    spatial_linkage,
    gears_without_loops,
)
