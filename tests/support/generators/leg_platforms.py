"""Random platforms on legs without ball joints.

Each leg is a serial arm between base and platform.

A tripteron has three PRRR legs. An Exechon has two UPR legs and one SPR leg. The universal joints
of 3-UPU, 3-URU, 3-PUU and 3-RUU legs keep the orientation of the platform constant.
"""

import numpy as np

from chasles.derive import read_text

HEAD = """
name = "legs"
convention = "urdf"
actuated = [{actuated}]
units = {{ length = "mm", angle = "deg" }}
tool = {{ body = "{body}", xyz = {tool} }}
"""
FREE = """
[[joints]]
name = "platform"
type = "free"
link = "platform"
"""


def drawn_legs(kind, seed):
    """Return a platform of a kind that is listed in ``LEG_KINDS``."""
    return drawn_as(LEG_KINDS[kind], seed)


def drawn_as(kind, seed):
    """Return the platform that the function ``kind`` generates.

    ``kind`` is a function, such as a value of ``LEG_KINDS``, whose third result is called
    ``reference`` here. The tool has a random position on the body ``reference["tool"]``, or on the
    platform if ``reference`` has no such entry.
    """
    rng = np.random.default_rng(seed)
    actuated, text, reference = kind(rng)
    reference = dict(reference)
    head = HEAD.format(
        actuated=", ".join(f'"{name}"' for name in actuated),
        body=reference.pop("tool", "platform"),
        tool=whole(rng.uniform(-80, 80, 3)),
    )
    lines = "".join(f"{name} = {value}\n" for name, value in reference.items())
    return read_text(f"{head}{text}\n[reference]\n{lines}", exact=True)


def joint(name, parent, kind, xyz, axis, rpy=(0, 0, 0), link=""):
    return f"""
[[joints]]
name = "{name}"
parent = "{parent}"
link = "{link or name}"
type = "{kind}"
xyz = {whole(xyz)}
rpy = {whole(rpy)}
axis = {[*axis]}
"""


def closure(name, kind, a, b):
    ends = [
        f'{{ body = "{body}", xyz = {whole(xyz)}, rpy = {whole(rpy)} }}'
        for body, xyz, rpy in (a, b)
    ]
    return f"""
[[closures]]
name = "{name}"
kind = "{kind}"
a = {ends[0]}
b = {ends[1]}
"""


def chain(joints, parent="0"):
    """Return the text of consecutive joints (name, kind, xyz, axis, rpy), the first on the link
    ``parent``."""
    text = ""
    for name, *rest in joints:
        text += joint(name, parent, *rest)
        parent = name
    return text


def _tripteron(rng):
    text, reference = "", {}
    pins = {"x": (90, 0, 90), "y": (-90, 0, 0), "z": (0, 0, 0)}
    for k, letter in enumerate("xyz"):
        axis = [int(j == k) for j in range(3)]
        upper, lower = rng.integers(280, 380, 2)
        first, second = rng.uniform(20, 50), -rng.uniform(50, 90)
        i, j = (k + 1) % 3, (k + 2) % 3
        foot, link = np.zeros(3), np.eye(3)[i]
        foot[i], foot[j] = rng.integers(-420, -380), rng.integers(-60, 60)
        text += chain(
            [
                (f"p{letter}", "prismatic", foot, axis),
                (f"{letter}1", "revolute", np.zeros(3), axis),
                (f"{letter}2", "revolute", upper * link, axis),
            ]
        )
        first, second = round(first), round(second)
        reference |= {f"{letter}1": first, f"{letter}2": second}
        a, b = np.deg2rad(first), np.deg2rad(first + second)
        end = foot.copy()
        end[i] += upper * np.cos(a) + lower * np.cos(b)
        end[j] += upper * np.sin(a) + lower * np.sin(b)
        if letter == "x":
            # The first leg carries the platform, whose axes are parallel to the axes of the base.
            text += joint("platform", "x2", "revolute", lower * link, axis)
            reference["platform"] = -first - second
            origin = end
        else:
            at = np.round(end - origin)
            text += closure(
                f"pin_{letter}",
                "pin",
                (f"{letter}2", lower * link, pins[letter]),
                ("platform", at, pins[letter]),
            )
    return ["px", "py", "pz"], text, reference


def exechon(rng):
    """Return an Exechon with two UPR legs in a plane and one SPR leg."""
    (wide, deep), (near, far) = rng.integers(250, 350, 2), rng.integers(80, 130, 2)
    text = chain(
        [
            ("u1x", "revolute", (wide, 0, 0), (1, 0, 0)),
            ("u1y", "revolute", (0, 0, 0), (0, 1, 0)),
            ("l1", "prismatic", (0, 0, 0), (0, 0, -1)),
            ("platform", "revolute", (0, 0, 0), (0, 1, 0)),
        ]
    )
    text += chain(
        [
            ("u2x", "revolute", (-wide, 0, 0), (1, 0, 0)),
            ("u2y", "revolute", (0, 0, 0), (0, 1, 0)),
            ("l2", "prismatic", (0, 0, 0), (0, 0, -1)),
        ]
    )
    text += chain(
        [
            ("s3x", "revolute", (0, deep, 0), (1, 0, 0)),
            ("s3y", "revolute", (0, 0, 0), (0, 1, 0)),
            ("s3z", "revolute", (0, 0, 0), (0, 0, 1)),
            ("l3", "prismatic", (0, 0, 0), (0, 0, -1)),
        ]
    )
    text += closure(
        "r2", "pin", ("l2", (0, 0, 0), (-90, 0, 0)), ("platform", (-2 * near, 0, 0), (-90, 0, 0))
    )
    text += closure(
        "r3", "pin", ("l3", (0, 0, 0), (0, 90, 0)), ("platform", (-near, far, 0), (0, 90, 0))
    )
    tilt = np.degrees(np.arctan2(wide - near, 850))
    slant = np.degrees(np.arctan2(deep - far, 850))
    reference = {"l1": np.hypot(wide - near, 850), "l2": np.hypot(wide - near, 850)}
    reference |= {"l3": np.hypot(deep - far, 850), "u1y": tilt, "platform": -tilt}
    return ["l1", "l2", "l3"], text, reference | {"u2y": -tilt, "s3x": -slant}


def _universal(rng):
    """Return a platform on three UPU legs."""
    base, top, height = rng.integers(300, 400), rng.integers(100, 200), 600
    text, reference = FREE, {"z": height}
    for k in range(3):
        foot, end, rpy = around(base, k), around(top, k), (0, 0, 120 * k)
        text += chain(
            [
                (f"a{k}", "revolute", foot, (0, 1, 0), rpy),
                (f"b{k}", "revolute", (0, 0, 0), (1, 0, 0)),
                (f"l{k}", "prismatic", (0, 0, 0), (0, 0, 1)),
                (f"c{k}", "revolute", (0, 0, 0), (1, 0, 0)),
                (f"d{k}", "revolute", (0, 0, 0), (0, 1, 0)),
            ]
        )
        text += closure(f"end{k}", "weld", (f"d{k}", (0, 0, 0), (0, 0, 0)), ("platform", end, rpy))
        tilt = np.degrees(np.arctan2(top - base, height))
        reference |= {f"a{k}": tilt, f"l{k}": np.hypot(top - base, height), f"d{k}": -tilt}
    return [f"l{k}" for k in range(3)], text, reference


def _elbows(rng):
    """Return a platform on three URU legs.

    Each leg has a driven elbow instead of the prismatic joint of a UPU leg. The elbow axis is
    parallel to the inner axes of the universal joints.
    """
    base, top, height = rng.integers(300, 400), rng.integers(100, 200), 600
    upper, lower = rng.integers(360, 420, 2)
    length = np.hypot(top - base, height)
    bend = np.degrees(np.arccos((length**2 + upper**2 - lower**2) / (2 * length * upper)))
    elbow = np.degrees(np.arccos((length**2 - upper**2 - lower**2) / (2 * upper * lower)))
    text, reference = FREE, {"z": height}
    for k in range(3):
        foot, end, rpy = around(base, k), around(top, k), (0, 0, 120 * k)
        text += chain(
            [
                (f"a{k}", "revolute", foot, (0, 1, 0), rpy),
                (f"b{k}", "revolute", (0, 0, 0), (1, 0, 0)),
                (f"e{k}", "revolute", (0, 0, upper), (1, 0, 0)),
                (f"c{k}", "revolute", (0, 0, lower), (1, 0, 0)),
                (f"d{k}", "revolute", (0, 0, 0), (0, 1, 0)),
            ]
        )
        text += closure(f"end{k}", "weld", (f"d{k}", (0, 0, 0), (0, 0, 0)), ("platform", end, rpy))
        tilt = np.degrees(np.arctan2(top - base, height))
        reference |= {f"a{k}": tilt, f"d{k}": -tilt}
        reference |= {f"b{k}": bend, f"e{k}": -elbow, f"c{k}": elbow - bend}
    return [f"e{k}" for k in range(3)], text, reference


def _linear(rng, offset=0):
    """Return a delta robot with linear actuators.

    Each leg has an inclined slide, and a rod between universal joints.

    ``offset`` is the distance between the two axes of each universal joint.
    """
    base, top, rod = rng.integers(250, 300), rng.integers(30, 60), rng.integers(380, 480)
    out, length, lean = base - top, rod + 2 * offset, int(rng.integers(-3, 4))
    text, reference = FREE, {"z": -np.sqrt(length**2 - out**2)}
    down = np.degrees(np.arctan2(-reference["z"], -out))
    for k in range(3):
        foot, end, rpy = around(base, k), around(top, k), (0, 0, 120 * k)
        text += chain(
            [
                (f"l{k}", "prismatic", foot, (lean, 0, 10), rpy),
                (f"p{k}", "revolute", (0, 0, 0), (0, 1, 0)),
                (f"s{k}", "revolute", (offset, 0, 0), (0, 0, 1)),
                (f"t{k}", "revolute", (rod, 0, 0), (0, 0, 1)),
                (f"v{k}", "revolute", (offset, 0, 0), (0, 1, 0)),
            ]
        )
        text += closure(f"end{k}", "weld", (f"v{k}", (0, 0, 0), (0, 0, 0)), ("platform", end, rpy))
        reference |= {f"p{k}": down, f"v{k}": -down}
    return [f"l{k}" for k in range(3)], text, reference


def _rotary(rng, offset=0):
    """Return a delta robot with rotary actuators.

    Each leg has an arm, and a rod between universal joints.

    ``offset`` is the distance between the two axes of each universal joint.
    """
    base, top = rng.integers(120, 160), rng.integers(30, 50)
    arm, rod = rng.integers(100, 130), rng.integers(220, 260)
    out = base + arm - top
    rod = max(rod, out + 20)
    length = rod + 2 * offset
    text, reference = FREE, {"z": -np.sqrt(length**2 - out**2)}
    down = np.degrees(np.arctan2(-reference["z"], -out))
    for k in range(3):
        foot, end, rpy = around(base, k), around(top, k), (0, 0, 120 * k)
        text += chain(
            [
                (f"arm{k}", "revolute", foot, (0, 1, 0), rpy),
                (f"p{k}", "revolute", (arm, 0, 0), (0, 1, 0)),
                (f"s{k}", "revolute", (offset, 0, 0), (0, 0, 1)),
                (f"t{k}", "revolute", (rod, 0, 0), (0, 0, 1)),
                (f"v{k}", "revolute", (offset, 0, 0), (0, 1, 0)),
            ]
        )
        text += closure(f"end{k}", "weld", (f"v{k}", (0, 0, 0), (0, 0, 0)), ("platform", end, rpy))
        reference |= {f"p{k}": down, f"v{k}": -down}
    return [f"arm{k}" for k in range(3)], text, reference


LEG_KINDS = {
    "tripteron": _tripteron,
    "exechon": exechon,
    "3-UPU": _universal,
    "3-URU": _elbows,
    "3-PUU": _linear,
    "3-PUU with offsets": lambda rng: _linear(rng, 10),
    "3-RUU": _rotary,
    "3-RUU with offsets": lambda rng: _rotary(rng, 10),
}
"""Generators of platforms, keyed by kind. Each generator returns the actuated joints, the joints
and closures as text, and the reference configuration."""


def around(radius, k):
    return radius * np.cos(2 * np.pi * k / 3), radius * np.sin(2 * np.pi * k / 3), 0


def whole(values):
    """Round values in millimeters or degrees to enough decimal places to close the loops."""
    return [round(float(x), 9) for x in values]
