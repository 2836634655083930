"""Platforms with jointed legs: random platforms, a 3-RPS, a tripod and an agile eye (spherical
3-RRR)."""

import random
from functools import cache

import numpy as np

from chasles.derive import read_text

HEAD = """
name = "drawn"
convention = "urdf"
units = {{ length = "m", angle = "rad" }}
tool = {{ body = "platform" }}
actuated = [{actuated}]
[[joints]]
name = "platform"
type = "free"
link = "platform"
"""
FLAT = ("RPS", "PRS", "RRS")
SPATIAL = ("UPS", "PUS", "RUS")


def turned(rpy):
    """Return the rotation matrix (3, 3) of roll, pitch and yaw angles."""
    (a, b, c), (d, e, f) = np.cos(rpy), np.sin(rpy)
    return np.array(
        [
            [c * b, c * e * d - f * a, c * e * a + f * d],
            [f * b, f * e * d + c * a, f * e * a - c * d],
            [-e, b * d, b * a],
        ]
    )


def joint(name, parent, kind, xyz, rpy, axis=(0, 0, 1)):
    return f"""
[[joints]]
name = "{name}"
parent = "{parent}"
link = "{name}"
type = "{kind}"
xyz = {[*map(float, xyz)]}
rpy = {[*map(float, rpy)]}
axis = {[*axis]}
"""


def leg(rng, k, kind, foot, heading):
    """Return a leg's description, the name of its driven joint, and that joint's reference value.

    Planar legs lie in the x-z plane of their foot. A leg of the kind "C" is a cylinder between two
    ball joints.
    """

    def drawn(*share):
        flat = share if kind in FLAT else (1, 1, 1)
        return np.round(rng.uniform(-0.15, 0.15, 3), 3) * flat

    if kind == "C":
        return cylinder(rng, k, np.round(foot, 3))
    xyz, R, at = np.round(foot, 3), np.eye(3), np.round(foot, 3)
    rpy = np.round([*rng.uniform(-0.4, 0.4, 2), heading], 3)
    parent, text, driven, travel = "0", "", "", 0.0
    for place, letter in enumerate(kind[:-1]):
        at, R, local = at + R @ (xyz if place else 0 * xyz), R @ turned(rpy), (0, 1, 0)
        name = f"{letter.lower()}{place}_{k}"
        if letter == "P":
            tilt = drawn(0, 2, 0)
            R, rpy = R @ turned(tilt), rpy if place == 0 else tilt
            if place == 0:
                text += joint(f"foot_{k}", parent, "fixed", xyz, rpy)
                parent, xyz, rpy = f"foot_{k}", np.zeros(3), tilt
            travel, driven = round(float(rng.uniform(0.2, 0.4)), 3), name
            text += joint(name, parent, "prismatic", xyz, rpy)
            at = at + R @ [0, 0, travel]
        else:
            text += joint(name, parent, "revolute", xyz, rpy, local)
        if letter == "U":
            # The frame of the universal joint's second axis lies on this axis, 0.05 m from the
            # joint center.
            aside, at = np.array([0.05, 0, 0]), at + R @ [0.05, 0, 0]
            text += joint(f"fork{place}_{k}", name, "revolute", aside, np.zeros(3), (1, 0, 0))
            name = f"fork{place}_{k}"
        parent, rpy = name, np.zeros(3)
        xyz = drawn(1, 0, 1) + np.array([0, 0, 0.15 if "P" in kind else 0.3])
    driven = driven or f"r0_{k}"
    end = drawn(1, 0, 1) + np.array([0, 0, 0.3])
    ball = at + R @ end
    text += f"""
[[closures]]
name = "ball_{k}"
kind = "ball"
a = {{ body = "{parent}", xyz = {[*map(float, end)]} }}
b = {{ body = "platform", xyz = {[*map(float, ball)]} }}
"""
    return text, driven, travel


def cylinder(rng, k, foot):
    """Return a cylinder between two ball joints: its description, name and reference length."""
    ball = np.round(foot + rng.uniform(-0.15, 0.15, 3) + [0, 0, 0.6], 3)
    text = f"""
[[cylinders]]
name = "c_{k}"
retracted = 0
ends = "ball"
a = {{ body = "0", xyz = {[*map(float, foot)]} }}
b = {{ body = "platform", xyz = {[*map(float, ball)]} }}
"""
    return text, f"c_{k}", float(np.linalg.norm(ball - foot))


@cache
def drawn(seed, kinds):
    """Return a random robot whose platform frame equals the base frame at the reference."""
    rng = np.random.default_rng(seed)
    legs, actuated, at = "", [], {}
    for k, kind in enumerate(kinds):
        angle = 2 * np.pi * (k + rng.uniform(-0.2, 0.2)) / len(kinds)
        foot = 0.6 * np.array([np.cos(angle), np.sin(angle), -1]) + rng.uniform(-0.1, 0.1, 3)
        text, name, travel = leg(rng, k, kind, foot, angle)
        legs, actuated = legs + text, [*actuated, name]
        at |= {name: travel} if travel else {}
    names = ", ".join(f'"{name}"' for name in actuated)
    reference = "\n[reference]\n" + "\n".join(f"{k} = {v!r}" for k, v in at.items())
    return read_text(HEAD.format(actuated=names) + legs + reference)


def kinds_of(seed):
    draw = random.Random(seed)
    count, of = draw.choice([(3, FLAT), (3, FLAT), (6, SPATIAL)])
    return tuple(draw.choice(of) for _ in range(count))


DRIVEN_BY_A_LEG = """
name = "driven_by_a_leg"
convention = "urdf"
units = { length = "m", angle = "deg" }
actuated = ["slide_0", "slide_1", "slide_2"]
tool = { body = "platform", xyz = [-0.2, 0, 0] }
"""
FOOT = """
[[joints]]
name = "hinge_{k}"
parent = "0"
link = "tube_{k}"
xyz = ["0.3*cos({at})", "0.3*sin({at})", 0]
rpy = [0, 0, {at}]
axis = [0, 1, 0]
[[joints]]
name = "slide_{k}"
parent = "tube_{k}"
link = "rod_{k}"
type = "prismatic"
axis = [0, 0, 1]
"""
BALL = """
[[closures]]
name = "ball_{k}"
kind = "ball"
a = {{ body = "rod_{k}" }}
b = {{ body = "platform", xyz = ["0.2*cos({at}) - 0.2", "0.2*sin({at})", 0] }}
"""
AGILE_EYE = """
name = "agile_eye"
convention = "urdf"
units = { length = "mm", angle = "deg" }
actuated = ["motor_1", "motor_2", "motor_3"]
tool = { body = "platform" }
"""
ARM = """
[[joints]]
name = "{name}"
parent = "{parent}"
link = "{link}"
axis = {axis}
"""


def driven_by_a_leg():
    """Return a 3-RPS platform whose main chain is one leg.

    Three revolute joints represent the ball joint of the leg in the main chain.
    """
    text = DRIVEN_BY_A_LEG + "".join(FOOT.format(k=k, at=120 * k) for k in range(3))
    links = ["rod_0", "s1", "s2", "platform"]
    for k, axis in enumerate(([0, 0, 1], [0, 1, 0], [1, 0, 0])):
        name, (parent, link) = f"turn_{'zyx'[k]}", links[k : k + 2]
        text += ARM.format(name=name, parent=parent, link=link, axis=axis)
    text += "".join(BALL.format(k=k, at=120 * k) for k in (1, 2))
    slides = "".join(f"slide_{k} = 0.5\nhinge_{k} = -11.5\n" for k in range(3))
    return read_text(f"{text}[reference]\n{slides}turn_y = 11.5")


def agile_eye():
    """Return a spherical 3-RRR robot with perpendicular axes and pins that close the loops."""
    text, axes = AGILE_EYE, ([1, 0, 0], [0, 1, 0], [0, 0, 1])
    for k in range(3):
        elbow = axes[k - 1]
        link = f"near_{k + 1}"
        text += ARM.format(name=f"motor_{k + 1}", parent="0", link=link, axis=axes[k])
        text += ARM.format(name=f"elbow_{k + 1}", parent=link, link=f"far_{k + 1}", axis=elbow)
    text += ARM.format(name="wrist", parent="far_1", link="platform", axis=[0, 1, 0])
    for k, turn in ((2, [0, 0, 0]), (3, [0, 90, 0])):
        ends = f"rpy = {turn} }}\n"
        text += f'[[closures]]\nname = "pin_{k}"\nkind = "pin"\n'
        text += f'a = {{ body = "far_{k}", {ends}b = {{ body = "platform", {ends}'
    return read_text(text)


TRIPOD = """
name = "tripod"
convention = "urdf"
actuated = ["slide_0", "slide_1", "slide_2"]
units = { length = "m", angle = "deg" }
tool = { body = "platform" }
[[joints]]
name = "tilt_x"
parent = "0"
link = "fork"
axis = [1, 0, 0]
[[joints]]
name = "tilt_y"
parent = "fork"
link = "sleeve"
axis = [0, 1, 0]
[[joints]]
name = "extend"
parent = "sleeve"
link = "platform"
type = "prismatic"
xyz = [0, 0, "9/10"]
axis = [0, 0, 1]
"""
STRUT = """
[[joints]]
name = "u_{k}"
parent = "0"
link = "u_{k}"
xyz = ["0.5*cos({at})", "0.5*sin({at})", 0]
rpy = [0, 0, {at}]
axis = [0, 1, 0]
[[joints]]
name = "v_{k}"
parent = "u_{k}"
link = "v_{k}"
axis = [1, 0, 0]
[[joints]]
name = "slide_{k}"
parent = "v_{k}"
link = "slide_{k}"
type = "prismatic"
xyz = ["0.02", "0.01", 0]
rpy = [5, 0, 0]
axis = [0, 0, 1]
[[closures]]
name = "ball_{k}"
kind = "ball"
a = {{ body = "slide_{k}", xyz = [0, 0, "0.4"] }}
b = {{ body = "platform", xyz = ["0.2*cos({at})", "0.2*sin({at})", 0] }}
"""


def tripod():
    """Return a tripod: three UPS legs move a platform on a central tube, as in a Tricept."""
    legs = "".join(STRUT.format(k=k, at=120 * k) for k in range(3))
    slides = "".join(f"slide_{k} = 0.55\nu_{k} = -17\n" for k in range(3))
    return read_text(f"{TRIPOD}{legs}[reference]\n{slides}")
