"""Random mechanisms: four-, five- and six-bars, cylinder booms, parallelograms, RSSR.

The lengths of some mechanisms are multiplied by 1000 or 1/1000. The reference configuration is
found by the oracle ``tests/support/oracles/multi_start.py`` and rounded to three digits. Each seed
determines one mechanism.
"""

import random
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import sympy as sp

from chasles.derive import Joint
from chasles.derive.model.mechanism import Closure, Frame, Mechanism, Strut
from chasles.derive.model.placements import Placement, Rotation, Translation
from tests.support.oracles.multi_start import Multistart

BASE = "0"
SCALES = (1, 1, 1000, sp.Rational(1, 1000))
"""Scale factors of the lengths of mechanisms, which are a few decimeters long before scaling."""
ATTEMPTS = 200
"""Maximum number of trials until the loops of a mechanism close."""
DIGITS = 3
"""Number of digits of the reference values."""
Point = tuple[sp.Expr, sp.Expr]
ORIGIN: Point = (sp.S.Zero, sp.S.Zero)


@dataclass
class Sketch:
    """A mechanism under construction, to which methods add bodies and joints.

    Attributes:
        draw: Python random generator from which the mechanism is drawn.
        tools: Bodies that may carry the tool.
    """

    draw: random.Random
    joints: list[Joint] = field(default_factory=list)
    closures: list[Closure] = field(default_factory=list)
    struts: list[Strut] = field(default_factory=list)
    actuated: list[str] = field(default_factory=list)
    tools: list[str] = field(default_factory=list)

    def length(self, low: int, high: int) -> sp.Expr:
        return sp.Rational(self.draw.randint(low, high), 1000)

    def point(self, reach: int = 300) -> Point:
        return self.length(-reach, reach), self.length(-reach, reach)

    def pin(self, name: str, parent: str, at: Point, *more: Rotation | Translation) -> str:
        """Add a body on a revolute joint, and return the body name."""
        before = (Translation((*at, 0)), *more)
        self.joints.append(Joint(name, "revolute", before, link=f"{name}_b", parent=parent))
        return f"{name}_b"

    def slide(self, name: str, parent: str, at: Point, angle: sp.Expr) -> str:
        """Add a body on a prismatic joint in the plane, and return the body name."""
        quarter = sp.pi / 2
        before = (Translation((*at, 0)), Rotation("z", angle), Rotation("y", quarter))
        after = (Rotation("y", -quarter), Rotation("z", -angle))
        self.joints.append(Joint(name, "prismatic", before, after, f"{name}_b", parent))
        return f"{name}_b"

    def close(self, name: str, a: str, at_a: Point, b: str, at_b: Point) -> None:
        """Add a pin joint that closes a loop."""
        self.closures.append(Closure(name, "pin", _frame(a, at_a), _frame(b, at_b)))

    def rod(
        self, name: str, a: str, at_a: Point, b: str, at_b: Point, length: sp.Expr = None
    ) -> None:
        """Add a rod with pin joints at both ends, or a cylinder if no length is specified."""
        is_cylinder = length is None
        retracted = self.draw.choice((sp.S.Zero, self.length(50, 250))) if is_cylinder else length
        self.struts.append(Strut(name, _frame(a, at_a), _frame(b, at_b), retracted, is_cylinder))
        if is_cylinder:
            self.actuated.append(name)

    def dyad(self, name: str, a: str, at_a: Point, b: str, at_b: Point) -> list[str]:
        """Connect two bodies by two links, or by a link and a rod. Returns the link names."""
        first, second = self.length(150, 500), self.length(150, 500)
        one = self.pin(f"{name}_p", a, at_a)
        if self.draw.random() < 0.5:
            self.rod(f"{name}_rod", b, at_b, one, (first, sp.S.Zero), second)
            return [one]
        other = self.pin(f"{name}_q", b, at_b)
        self.close(f"{name}_c", one, (first, sp.S.Zero), other, (second, sp.S.Zero))
        return [one, other]


def _frame(body: str, at: Point, z: sp.Expr = sp.S.Zero) -> Frame:
    return Frame(body, (Translation((*at, z)),))


# --- families ---


def _four_bar(s: Sketch, on: str = BASE, name: str = "a") -> tuple[str, list[str]]:
    """Add a crank and a dyad (two links on pins), and return their bodies."""
    crank = s.pin(f"{name}_crank", on, s.point(150) if on != BASE else ORIGIN)
    s.actuated.append(f"{name}_crank")
    far = (s.length(80, 300), sp.S.Zero)
    pivot = (s.length(200, 500), s.length(-100, 100))
    return crank, s.dyad(name, crank, far, on, pivot)


def four_bar(s: Sketch) -> None:
    crank, s.tools = _four_bar(s)
    if s.draw.random() < 0.2:
        s.tools = [crank]


def five_bar(s: Sketch) -> None:
    """A mechanism with two cranks and a dyad (two links on pins) between the cranks."""
    one, other = s.pin("left", BASE, ORIGIN), s.pin("right", BASE, (s.length(100, 400), 0))
    s.actuated = ["left", "right"]
    ends = [(s.length(100, 300), sp.S.Zero) for _ in range(2)]
    s.tools = s.dyad("d", one, ends[0], other, ends[1])[:1]


def watt(s: Sketch) -> None:
    """Add a four-bar, and a dyad (two links on pins) between two adjacent links of the four-bar."""
    crank, links = _four_bar(s)
    pairs = [(crank, links[0])]
    if len(links) > 1:
        pairs += [(links[0], links[1]), (links[1], BASE)]
    _second_dyad(s, s.draw.choice(pairs), links)


def stephenson(s: Sketch) -> None:
    """Add a four-bar, and a dyad (two links on pins) between two opposite links of the four-bar."""
    crank, links = _four_bar(s)
    pairs = [(links[0], BASE)]
    if len(links) > 1:
        pairs += [(crank, links[1])]
    _second_dyad(s, s.draw.choice(pairs), links)
    if s.draw.random() < 0.15 and len(links) > 1:
        s.actuated = ["b_q"] if any(j.name == "b_q" for j in s.joints) else s.actuated


def _second_dyad(s: Sketch, pair: tuple[str, str], links: list[str]) -> None:
    a, b = pair
    at = [(s.length(200, 500), s.length(-300, 300)) if p == BASE else s.point() for p in pair]
    s.tools = [*s.dyad("b", a, at[0], b, at[1]), links[0]]


def slider_crank(s: Sketch) -> None:
    """A slider-crank mechanism whose crank or slider is actuated."""
    crank = s.pin("crank", BASE, ORIGIN)
    end = (s.length(80, 200), sp.S.Zero)
    angle = sp.pi * sp.Rational(s.draw.choice((0, 0, 15, 30, 90, -45)), 180)
    block = s.slide("slide", BASE, (0, s.length(-60, 60)), angle)
    rod = s.length(200, 500)
    s.tools = [block]
    if s.draw.random() < 0.5:
        s.rod("rod", crank, end, block, s.point(50), rod)
    else:
        link = s.pin("elbow", crank, end)
        s.close("gudgeon", link, (rod, sp.S.Zero), block, s.point(50))
        s.tools.append(link)
    s.actuated = [s.draw.choice(("crank", "crank", "slide"))]


def boom(s: Sketch) -> None:
    """Add one to four joints in series.

    A cylinder moves each joint, directly or through a four-bar.
    """
    body, at = BASE, ORIGIN
    for k in range(s.draw.randint(1, 4)):
        arm = s.pin(f"arm{k}", body, at)
        if k and s.draw.random() < 0.25:
            rocker = s.pin(f"rocker{k}", body, (at[0] - s.length(50, 150), s.length(0, 80)))
            tip = (s.length(100, 200), sp.S.Zero)
            s.rod(f"link{k}", rocker, tip, arm, s.point(200), s.length(100, 300))
            s.rod(f"cylinder{k}", body, s.point(250), rocker, tip)
        else:
            s.rod(f"cylinder{k}", body, s.point(250), arm, s.point(250))
        body, at = arm, (s.length(300, 600), s.length(-50, 50))
    s.tools = [body]


def _parallelogram(
    s: Sketch, name: str, on: str, at: Point, pivot: Point, arm: sp.Expr
) -> tuple[str, str]:
    """Add two equal cranks and a bar between them. Returns (crank, bar)."""
    crank = s.pin(f"{name}_crank", on, at)
    base = (pivot[0] - at[0], pivot[1] - at[1])
    end = (arm, sp.S.Zero)
    if s.draw.random() < 0.5:
        bar = s.pin(f"{name}_bar", crank, end)
        s.rod(f"{name}_rod", on, pivot, bar, base, arm)
    else:
        bar = s.pin(f"{name}_bar", crank, end)
        other = s.pin(f"{name}_other", on, pivot)
        s.close(f"{name}_pin", bar, base, other, end)
    return crank, bar


def parallelogram(s: Sketch) -> None:
    """A parallelogram or antiparallelogram, sometimes with three cranks."""
    pivot, arm = (s.length(150, 400), sp.S.Zero), s.length(100, 300)
    _, bar = _parallelogram(s, "a", BASE, ORIGIN, pivot, arm)
    s.actuated, s.tools = ["a_crank"], [bar]
    if s.draw.random() < 0.25:
        middle = (pivot[0] / 2, s.length(0, 60))
        s.rod("third", BASE, middle, bar, middle, arm)


def parallelograms(s: Sketch) -> None:
    """Two parallelograms in series that keep the tool level."""
    pivot, arm = (s.length(100, 200), s.length(-100, 0)), s.length(200, 400)
    _, bar = _parallelogram(s, "a", BASE, ORIGIN, pivot, arm)
    there = (s.length(50, 150), s.length(20, 120))
    _, last = _parallelogram(s, "b", bar, ORIGIN, there, s.length(200, 400))
    s.actuated, s.tools = ["a_crank", "b_crank"], [last]


def palletizer(s: Sketch) -> None:
    """An arm whose elbow is driven by a base crank through a parallelogram."""
    arm, crank = s.length(200, 400), s.length(60, 150)
    lower = s.pin("lower", BASE, ORIGIN)
    foot = s.pin("foot", BASE, ORIGIN)
    upper = s.pin("upper", lower, (arm, sp.S.Zero))
    s.rod("push", foot, (crank, sp.S.Zero), upper, (crank, sp.S.Zero), arm)
    s.actuated, s.tools = ["lower", "foot"], [upper]


def series(s: Sketch) -> None:
    """Two or three (sometimes five) four-bars in series."""
    on = BASE
    for k in range(s.draw.choice((2, 2, 3, 3, 5))):
        _, links = _four_bar(s, on, f"m{k}")
        on = links[0]
    s.tools = [on]


def nested(s: Sketch) -> None:
    """A four-bar whose crank is moved by a cylinder. A dyad (two links on pins) is optional."""
    crank, links = _four_bar(s)
    s.actuated = []
    s.rod("ram", BASE, s.point(250), crank, s.point(150))
    s.tools = links
    if s.draw.random() < 0.5:
        _second_dyad(s, (links[0], BASE), links)


def _rssr(s: Sketch, name: str, on: str) -> str:
    crank = s.pin(f"{name}_in", on, s.point(50))
    angle = sp.pi * sp.Rational(s.draw.choice((90, 60, 90, 35, -90)), 180)
    tilt = sp.pi * sp.Rational(s.draw.choice((0, 0, 20, 45)), 180)
    rocker = s.pin(
        f"{name}_out",
        on,
        (s.length(200, 400), s.length(-100, 100)),
        Translation((0, 0, s.length(-100, 200))),
        Rotation("z", tilt),
        Rotation("x", angle),
    )
    a = _frame(crank, (s.length(60, 200), sp.S.Zero), s.length(-50, 50))
    b = _frame(rocker, (s.length(100, 300), sp.S.Zero), s.length(-50, 50))
    s.struts.append(Strut(f"{name}_rod", a, b, s.length(200, 500), ends="ball"))
    s.actuated.append(f"{name}_in")
    return rocker


def rssr(s: Sketch) -> None:
    """Add one or two RSSR loops.

    Each RSSR loop has two cranks about skew axes, and a rod with ball joints.
    """
    rocker = _rssr(s, "a", BASE)
    if s.draw.random() < 0.25:
        rocker = _rssr(s, "b", rocker)
    s.tools = [rocker]


def rsur(s: Sketch) -> None:
    """Two cranks about skew axes and a rod with a ball joint and a universal joint."""
    rocker = _rssr(s, "a", BASE)
    (rod,) = s.struts
    s.struts = []
    first = replace(s.joints[-1], name="u1", link="u1_b", parent=rocker)
    turn = (Rotation("y", sp.pi / 2),)
    s.joints.append(replace(first, before=(*rod.b.placement, *turn)))
    second = replace(first, name="u2", link="u2_b", parent="u1_b")
    s.joints.append(replace(second, before=(Rotation("x", sp.pi / 2),)))
    along = Frame("u2_b", (Translation((rod.length, 0, 0)),))
    s.closures.append(Closure("ball", "ball", rod.a, along))
    s.tools = [rocker]


FAMILIES: Mapping[str, Callable[[Sketch], None]] = {
    "four-bar": four_bar,
    "five-bar": five_bar,
    "Watt": watt,
    "Stephenson": stephenson,
    "slider-crank": slider_crank,
    "boom": boom,
    "parallelogram": parallelogram,
    "parallelograms": parallelograms,
    "palletizer": palletizer,
    "series": series,
    "nested": nested,
    "RSSR": rssr,
    "RSUR": rsur,
}


@dataclass(frozen=True)
class DrawnMechanism:
    """A mechanism with its family and a closed configuration.

    Attributes:
        family: Name of the family.
        mechanism: The description.
        q: Actuated coordinates of the closed configuration (radian or meter).
        mode: Joint values at the reference (radian or meter), keyed by name.
    """

    family: str
    mechanism: Mechanism
    q: np.ndarray
    mode: Mapping[str, float]


def drawn_mechanism(seed: int) -> DrawnMechanism:
    """Return the random mechanism for a seed."""
    family = list(FAMILIES)[seed % len(FAMILIES)]
    return drawn(FAMILIES[family], family, seed)


def drawn(
    sketched: Callable[[Sketch], None], family: str, seed: int, scale: sp.Expr | None = None
) -> DrawnMechanism:
    """Return a random mechanism whose loops close at the reference configuration.

    Args:
        sketched: Function that adds the joints and struts of the mechanism.
        family: Name of the family.
        seed: The seed.
        scale: Scale factor of all lengths, which is random by default.
    """
    draw = random.Random(seed)
    rng = np.random.default_rng(seed)
    scale = scale or draw.choice(SCALES)
    for _ in range(ATTEMPTS):
        sketch = Sketch(draw)
        sketched(sketch)
        open_ = _mechanism(sketch, scale, f"m{seed}", draw.choice(sketch.tools))
        numbers = Multistart(open_)
        q = numbers.random_q(rng, 1)
        modes = numbers.modes(q, numbers.actuated)[0]
        if modes:
            mode = modes[draw.randrange(len(modes))]
            return DrawnMechanism(family, _near(open_, numbers, mode), q[0], mode)
    raise AssertionError(f"seed {seed}: no generated mechanism closes")


def _mechanism(sketch: Sketch, scale: sp.Expr, name: str, tool: str) -> Mechanism:
    scaled = _scaled_by(scale)
    return Mechanism(
        name,
        tuple(replace(j, before=scaled(j.before), after=scaled(j.after)) for j in sketch.joints),
        tuple(sketch.actuated),
        closures=tuple(
            replace(c, a=_moved(c.a, scaled), b=_moved(c.b, scaled)) for c in sketch.closures
        ),
        struts=tuple(
            replace(c, a=_moved(c.a, scaled), b=_moved(c.b, scaled), length=c.length * scale)
            for c in sketch.struts
        ),
        tool_body=tool,
    )


def _scaled_by(scale: sp.Expr) -> Callable[[Placement], Placement]:

    def scaled(placement: Placement) -> Placement:
        return tuple(
            Translation(tuple(x * scale for x in step.vector))
            if isinstance(step, Translation)
            else step
            for step in placement
        )

    return scaled


def _moved(frame: Frame, scaled: Callable[[Placement], Placement]) -> Frame:
    return Frame(frame.body, scaled(frame.placement))


def _near(mechanism: Mechanism, numbers: Multistart, mode: Mapping[str, float]) -> Mechanism:
    """Return the mechanism with the rounded joint values of ``mode`` as reference configuration."""
    values = dict(mode) | numbers.strut_values(mode)
    lengths = {name for name, unit in numbers.units(values).items() if unit == "m"}
    found = []
    for name, value in values.items():
        size = numbers.size if name in lengths else 1.0
        text = f"{value / size:.{DIGITS}f}"
        found.append((name, sp.Rational(text) * sp.nsimplify(size, rational=True)))
    return replace(mechanism, reference=tuple(found))
