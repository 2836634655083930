"""Random planar platforms, as robot files and as numerical models.

Each leg has three joints, of which one is actuated and another one closes the loop. In each leg,
the joints before the closure form a chain that starts at the base.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np

Place = tuple[float, float, float]
"""Position x, y (meter) and angle of a frame relative to the preceding frame."""
HEAD = """
name = "{name}"
convention = "urdf"
actuated = ["q_1", "q_2", "q_3"]
units = {{ length = "m", angle = "rad" }}
tool = {{ body = "platform" }}

[[joints]]
name = "platform"
type = "planar"
link = "platform"
coordinates = ["x", "y", "phi"]
"""
JOINT = """
[[joints]]
name = "{name}"
type = "{kind}"
parent = "{parent}"
link = "{link}"
xyz = [{x}, {y}, 0]
rpy = [0, 0, {angle}]
axis = {axis}
"""
CLOSURE = """
[[closures]]
name = "closure_{k}"
kind = "{kind}"
a = {{ body = "{body_a}", {a} }}
b = {{ body = "{body_b}", {b} }}
"""
TYPES = {"R": ("revolute", "[0, 0, 1]"), "P": ("prismatic", "[1, 0, 0]")}
JOINTS = 3
LEGS = tuple(
    ("".join(kinds), actuated)
    for kinds in product("RP", repeat=JOINTS)
    for actuated in range(JOINTS)
    if "R" in kinds[:actuated] + kinds[actuated + 1 :]
)
"""For each leg type, a pair (joint types from base to platform, index of the actuated joint)."""
ITERATIONS, CLOSED, TINY = 30, 1e-11, 1e-30
"""Number of Newton steps to the reference, closure tolerance, and step of complex derivatives."""
AWAY = 0.05
"""Maximum change of the reference by rounding (radian or meter)."""


@dataclass(frozen=True)
class DrawnLeg:
    """A random leg.

    Attributes:
        kinds: Joint types (R or P) of a leg from base to platform.
        actuated: Index of the actuated joint.
        closed: Index of the joint that closes the loop.
        front: For each joint between the base and the closure, the frame in which the joint moves.
        back: For each joint between the platform and the closure, the frame in which the joint
            moves.
        values: Values of the joints near the reference (radian or meter).
    """

    kinds: str
    actuated: int
    closed: int
    front: tuple[Place, ...]
    back: tuple[Place, ...]
    values: tuple[float, ...]

    @property
    def passive(self) -> int:
        """Index of the leg's passive joint that does not close the loop."""
        return JOINTS - self.actuated - self.closed

    @property
    def behind(self) -> range:
        """Indices of the joints carried by the platform, starting at the platform."""
        return range(JOINTS - 1, self.closed, -1)

    def __str__(self) -> str:
        letters = self.kinds.lower()
        return "".join(x.upper() if i == self.actuated else x for i, x in enumerate(letters))


@dataclass(frozen=True)
class DrawnPlatform:
    """A random platform."""

    legs: tuple[DrawnLeg, ...]
    pose: Place

    @property
    def q(self) -> np.ndarray:
        """(3,) actuated coordinates at the reference."""
        return np.array([leg.values[leg.actuated] for leg in self.legs])

    def text(self, name: str) -> str:
        reference = dict(zip(("x", "y", "phi"), self.pose, strict=True))
        parts = [HEAD.format(name=name)]
        for k, leg in enumerate(self.legs, 1):
            parts += _leg_text(k, leg)
            names = [_name(k, leg, i) for i in range(JOINTS)]
            values = zip(names, leg.values, strict=True)
            reference |= {n: v for i, (n, v) in enumerate(values) if i != leg.closed}
        lines = "\n".join(f"{key} = {value}" for key, value in reference.items())
        return "".join(parts) + f"\n[reference]\n{lines}\n"

    def excess(self, x: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the closure errors of the legs.

        Args:
            x: (n, 6) platform pose (x, y, phi) and one passive joint value of each leg, as real or
                complex numbers.
            q: (3,) actuated coordinates, or (3, n) with the coordinates of each row of x.

        Returns:
            Closure errors (n, 6) with two errors per leg, and direction values (n, 3) with one
            value per leg. A direction value is positive if both frames of a prismatic closure point
            in the same direction.
        """
        gaps, facing = [], []
        pose = _frames(*x[:, :3].T)
        for k, leg in enumerate(self.legs):
            values = {leg.actuated: np.full(len(x), q[k]), leg.passive: x[:, 3 + k]}
            base, platform = _frames(*np.zeros((3, len(x)))), pose
            for i, place in zip(range(leg.closed), leg.front, strict=False):
                base = base @ _frames(*place) @ _moved(leg.kinds[i], values[i])
            for i, place in zip(leg.behind, leg.back, strict=False):
                platform = platform @ _frames(*place) @ _moved(leg.kinds[i], values[i])
            a, b = base @ _frames(*leg.front[-1]), platform @ _frames(*leg.back[-1])
            between = _inverse(a) @ b
            turns = leg.kinds[leg.closed] == "R"
            gaps += [between[:, 1, 2], between[:, 0, 2] if turns else between[:, 1, 0]]
            facing.append(np.ones(len(x)) if turns else between[:, 0, 0].real)
        return np.stack(gaps, -1), np.stack(facing, -1)

    def slopes(self, x: np.ndarray, q: np.ndarray) -> np.ndarray:
        """Return the derivatives (n, 6, 6) of the closure errors with respect to x."""
        moved = (x[:, None] + TINY * 1j * np.eye(6)).reshape(-1, 6)
        gaps, _ = self.excess(moved, np.repeat(q, 6, axis=1) if np.ndim(q) > 1 else q)
        return (gaps.imag / TINY).reshape(-1, 6, 6).swapaxes(1, 2)

    def closes(self) -> bool:
        """Test whether the loops of the legs close near the reference despite rounded numbers."""
        described = np.array([[*self.pose, *(leg.values[leg.passive] for leg in self.legs)]])
        x = described
        for _ in range(ITERATIONS):
            gaps, facing = self.excess(x, self.q)
            x = x - np.linalg.lstsq(self.slopes(x, self.q)[0], gaps[0], rcond=None)[0]
        is_near = np.abs(x - described).max() < AWAY
        return bool(is_near and np.abs(gaps).max() < CLOSED and (facing > 0).all())


def drawn_platform(
    generator: np.random.Generator, kinds: tuple[tuple[str, int], ...] = ()
) -> DrawnPlatform:
    """Return a random planar platform of about 1 m size.

    By default, the leg types are random.
    """
    platform = _drawn(generator, kinds)
    while not platform.closes():
        platform = _drawn(generator, kinds)
    return platform


def _drawn(generator: np.random.Generator, kinds: tuple[tuple[str, int], ...]) -> DrawnPlatform:
    pose = _rounded(generator.uniform([-0.3, -0.3, -0.8], [0.3, 0.3, 0.8]))
    kinds = kinds or tuple(LEGS[k] for k in generator.integers(len(LEGS), size=3))
    return DrawnPlatform(tuple(_drawn_leg(*kind, pose, generator) for kind in kinds), pose)


def _drawn_leg(kinds: str, actuated: int, pose: Place, generator: np.random.Generator) -> DrawnLeg:
    closed = int(generator.choice([i for i in range(JOINTS) if i != actuated]))
    values = tuple(
        round(float(generator.uniform(*((-2, 2) if kind == "R" else (0.2, 0.8)))), 3)
        for kind in kinds
    )
    front = [_rounded(generator.uniform([-1, -1, -3], [1, 1, 3]))]
    front += [_link(generator) for _ in range(closed)]
    back = [_rounded(generator.uniform([-0.6, -0.6, -3], [0.6, 0.6, 3]))]
    back += [_link(generator) for _ in range(JOINTS - 2 - closed)]
    base, platform = np.eye(3), _frames(*pose)
    for i, place in enumerate(front):
        base = base @ _frames(*place) @ _moved(kinds[i], values[i])
    behind = range(JOINTS - 1, closed, -1)
    for i, place in zip(behind, back, strict=False):
        platform = platform @ _frames(*place) @ _moved(kinds[i], values[i])
    between = _inverse(platform) @ base
    angle = np.arctan2(between[1, 0], between[0, 0])
    last = _rounded(np.array([between[0, 2], between[1, 2], angle]))
    back = [*back[: len(behind)], last]
    return DrawnLeg(kinds, actuated, closed, tuple(front), tuple(back), values)


def _link(generator: np.random.Generator) -> Place:
    return _rounded(generator.uniform([0.2, -0.2, -3], [0.8, 0.2, 3]))


def _rounded(place: np.ndarray) -> Place:
    """Round a frame to three decimals, because numbers in a robot file are exact decimals."""
    x, y, angle = (round(float(value), 3) for value in place)
    return x, y, angle


def _frames(x: np.ndarray, y: np.ndarray, angle: np.ndarray) -> np.ndarray:
    x, y, angle = np.broadcast_arrays(x, y, angle)
    c, s, one = np.cos(angle), np.sin(angle), np.ones(x.shape)
    rows = [[c, -s, x], [s, c, y], [0 * one, 0 * one, one]]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def _moved(kind: str, value: np.ndarray) -> np.ndarray:
    return _frames(0, 0, value) if kind == "R" else _frames(value, 0, 0)


def _inverse(T: np.ndarray) -> np.ndarray:
    """Return the inverses of planar poses, whose matrix entries may be complex."""
    found = np.zeros_like(T)
    found[..., :2, :2] = np.swapaxes(T[..., :2, :2], -1, -2)
    found[..., :2, 2:] = -found[..., :2, :2] @ T[..., :2, 2:]
    found[..., 2, 2] = 1
    return found


def _name(k: int, leg: DrawnLeg, i: int) -> str:
    return f"q_{k}" if i == leg.actuated else f"p_{k}{i}"


def _leg_text(k: int, leg: DrawnLeg) -> list[str]:
    parts, ends = [], []
    sides = (("0", range(leg.closed), leg.front), ("platform", leg.behind, leg.back))
    for root, joints, places in sides:
        parent = root
        for i, (x, y, angle) in zip(joints, places, strict=False):
            kind, axis = TYPES[leg.kinds[i]]
            name, link = _name(k, leg, i), f"link_{k}{i}"
            parts.append(
                JOINT.format(
                    name=name, kind=kind, parent=parent, link=link, x=x, y=y, angle=angle, axis=axis
                )
            )
            parent = link
        ends.append((parent, places[-1]))
    turns = leg.kinds[leg.closed] == "R"
    (body_a, a), (body_b, b) = ((body, _frame_text(place, turns)) for body, place in ends)
    kind = "pin" if turns else "slider"
    parts.append(CLOSURE.format(k=k, kind=kind, body_a=body_a, a=a, body_b=body_b, b=b))
    return parts


def _frame_text(place: Place, turns: bool) -> str:
    """Return the text of a closure frame with z along the pin axis or the prismatic direction."""
    x, y, angle = place
    return f"xyz = [{x}, {y}, 0]" + ("" if turns else f', rpy = [0, "pi/2", {angle}]')
