"""Random platforms of packaging robots and machine tools.

A Par4 has four arms with pairs of rods. Five legs carry the spindle of a pentapod, and one of these
legs keeps the platform from rotating. A Tricept carries a wrist.
"""

import numpy as np

from .leg_platforms import FREE, around, chain, closure, exechon, whole

SHAFT = ("z", "x", "y", "telescope", "y", "x")
ORIGIN = (0, 0, 0)
AXES = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}


def _arm_with_rods(name, heading, lengths, body, end):
    """Return an arm on the base, with two parallel rods to the platform.

    Args:
        name: Name of the arm.
        heading: Direction of the arm in degrees.
        lengths: (base radius, arm length, rod length, half the rod distance).
        body: The body on which the rods end.
        end: Midpoint of the two rod ends in the frame of ``body``.
    """
    base, arm, rod, half = lengths
    out, side = _directions(heading)
    text = chain([(name, "revolute", base * out, (0, 1, 0), (0, 0, heading))])
    for letter, y in (("l", half), ("r", -half)):
        text += f"""
[[rods]]
name = "rod_{name}{letter}"
length = {rod}
ends = "ball"
a = {{ body = "{name}", xyz = [{arm}, {y}, 0] }}
b = {{ body = "{body}", xyz = {whole(end + y * side)} }}
"""
    return text


def _directions(heading):
    c, s = np.cos(np.deg2rad(heading)), np.sin(np.deg2rad(heading))
    return np.array([c, s, 0]), np.array([-s, c, 0])


def _height(lengths, heading, end):
    base, arm, rod, _ = lengths
    gap = (base + arm) * _directions(heading)[0] - end
    return np.sqrt(rod**2 - gap @ gap)


def _par4(rng):
    """Return a Par4, whose platform consists of two parts and two bars."""
    lengths = [int(n) for n in rng.integers((180, 240, 620, 30), (240, 300, 760, 45))]
    wide, deep = (int(n) for n in rng.integers((50, 40), (70, 60)))
    text = FREE + chain(
        [
            ("bar", "revolute", (wide, 0, 0), AXES["z"]),
            ("part", "revolute", (0, -2 * deep, 0), AXES["z"]),
        ],
        "platform",
    )
    text += chain([("idle", "revolute", (-wide, 0, 0), AXES["z"])], "platform")
    text += closure(
        "pin",
        "pin",
        ("idle", (0, -2 * deep, 0), ORIGIN),
        ("part", (-2 * wide, 0, 0), ORIGIN),
    )
    names = [f"arm{k}" for k in range(4)]
    for k, name in enumerate(names):
        heading = 45 + 90 * k
        end = np.array([(wide + 10) * (1 if k in (0, 3) else -1), 0, 0])
        body, origin = ("platform", np.zeros(3)) if k < 2 else ("part", np.array([wide, 0, 0]))
        text += _arm_with_rods(name, heading, lengths, body, end - origin)
    height = _height(lengths, 45, np.array([wide + 10, deep, 0]))
    return names, text, {"y": deep, "z": -height, "tool": "bar"}


def _delta_with_shaft(rng):
    """Return a delta whose tool is rotated by a telescopic shaft between universal joints."""
    lengths = [int(n) for n in rng.integers((180, 240, 620, 30), (240, 300, 760, 45))]
    radius, below = (int(n) for n in rng.integers((40, 10), (60, 40)))
    text = FREE + chain([("tool", "revolute", (0, 0, -below), AXES["z"])], "platform")
    names = [f"arm{k}" for k in range(3)]
    for k, name in enumerate(names):
        out, _ = _directions(120 * k)
        text += _arm_with_rods(name, 120 * k, lengths, "platform", radius * out)
    joints = [
        (f"shaft{k}", "prismatic", ORIGIN, (0, 0, -1))
        if letter == "telescope"
        else (f"shaft{k}", "revolute", ORIGIN, AXES[letter])
        for k, letter in enumerate(SHAFT)
    ]
    text += chain(joints)
    text += closure("shaft", "weld", ("shaft5", ORIGIN, ORIGIN), ("tool", ORIGIN, ORIGIN))
    height = _height(lengths, 0, np.array([radius, 0, 0]))
    reference = {"z": -height, "shaft3": height + below, "tool": "tool"}
    return [*names, "shaft0"], text, reference


def _pentapod(rng):
    """Return a pentapod with five legs on ball joints at the base.

    Each leg ends in a ring on the spindle. One ring is fixed to the platform, and the other four
    rings rotate about the spindle.
    """
    base, top, height = rng.integers(380, 450), rng.integers(60, 90), 700
    rings = rng.permutation([-80, -40, 0, 40, 80])
    text, reference, names = FREE, {"z": -height}, []
    for k in range(5):
        heading = 72 * k
        out, _ = _directions(heading)
        depth = height - int(rings[k])
        slant = np.degrees(np.arctan2(base - top, depth))
        names.append(f"l{k}")
        text += chain(
            [
                (f"z{k}", "revolute", base * out, AXES["z"], (0, 0, heading)),
                (f"x{k}", "revolute", ORIGIN, AXES["x"]),
                (f"y{k}", "revolute", ORIGIN, AXES["y"]),
                (names[-1], "prismatic", ORIGIN, (0, 0, -1)),
                (f"r{k}", "revolute", ORIGIN, AXES["y"]),
            ]
        )
        kind, turn = ("pin", 0) if k else ("weld", heading)
        text += closure(
            f"ring{k}",
            kind,
            (f"r{k}", (-top, 0, 0), ORIGIN),
            ("platform", (0, 0, int(rings[k])), (0, 0, turn)),
        )
        reference |= {names[-1]: np.hypot(base - top, depth), f"y{k}": slant, f"r{k}": -slant}
    return names, text, reference


def _exechon_with_head(rng):
    """Return a five-axis machine, which is an Exechon with two rotary axes on its platform."""
    names, text, reference = exechon(rng)
    text += chain(
        [
            ("swivel", "revolute", (0, 0, -60), AXES["z"]),
            ("tilt", "revolute", ORIGIN, AXES["x"]),
            ("spindle", "fixed", ORIGIN, AXES["z"]),
        ],
        "platform",
    )
    return [*names, "swivel", "tilt"], text, reference | {"tilt": 30, "tool": "spindle"}


def _tricept(rng):
    """Return a Tricept.

    Three UPS legs move a tube, which has a universal joint at the base and carries a wrist.
    """
    base, top, depth = rng.integers(280, 340), rng.integers(80, 120), 700
    text = chain(
        [
            ("tube_x", "revolute", ORIGIN, AXES["x"]),
            ("tube_y", "revolute", ORIGIN, AXES["y"]),
            ("tube", "prismatic", ORIGIN, (0, 0, -1)),
        ]
    )
    reference = {"tube": depth, "tool": "w3"}
    for k in range(3):
        slant = np.degrees(np.arctan2(base - top, depth))
        text += chain(
            [
                (f"u{k}", "revolute", around(base, k), AXES["x"], (0, 0, 120 * k)),
                (f"v{k}", "revolute", ORIGIN, AXES["y"]),
                (f"l{k}", "prismatic", ORIGIN, (0, 0, -1)),
            ]
        )
        text += closure(
            f"ball{k}", "ball", (f"l{k}", ORIGIN, ORIGIN), ("tube", around(top, k), ORIGIN)
        )
        reference |= {f"v{k}": slant, f"l{k}": np.hypot(base - top, depth)}
    wrist = [("w1", (0, 0, 120), "z"), ("w2", ORIGIN, "y"), ("w3", ORIGIN, "z")]
    text += chain([(name, "revolute", at, AXES[axis]) for name, at, axis in wrist], "tube")
    return ["l0", "l1", "l2", "w1", "w2", "w3"], text, reference | {"w2": 40}


MACHINE_KINDS = {
    "Par4": _par4,
    "delta with a shaft": _delta_with_shaft,
    "pentapod": _pentapod,
    "Exechon with a head": _exechon_with_head,
    "Tricept with a wrist": _tricept,
}
"""Generators of platforms, keyed by kind. Each generator returns the actuated joints, the joints
and closures as text, and the reference configuration."""
