"""Random parallel platforms with joints before or after the platform.

The platforms are rotary deltas and hexapods. Axes between a delta and its tool add degrees of
freedom to the tool. Joints before a platform, and joints after a hexapod, are redundant.
"""

import numpy as np

from chasles.derive import read_text

BEFORE = ("", "rail", "turntable")
BEHIND = {"delta": ("", "z", "zy", "xyz"), "hexapod": ("", "z", "zs")}
"""Joint sequences on each kind of platform, with x, y and z for revolute axes and s for a prismatic
joint along z."""
HEAD = """
name = "carried"
convention = "urdf"
actuated = [{actuated}]
units = {{ length = "m", angle = "rad" }}
tool = {{ body = "{tool}", xyz = {xyz} }}
"""


def drawn_platform(seed):
    """Return a robot with a platform.

    Further joints are before the platform, on the platform, or both.

    Args:
        seed: Random seed, which also selects the kind of platform and the additional joints.
    """
    kinds = [(kind, a, b) for kind in BEHIND for a in BEFORE for b in BEHIND[kind] if a or b]
    kind, before, behind = kinds[seed % len(kinds)]
    rng = np.random.default_rng(seed)
    base = "before" if before else "0"
    text = (
        _before(rng, before)
        + f"""
[[joints]]
name = "platform"
type = "free"
parent = "{base}"
link = "platform"
"""
    )
    legs, names, reference = (_delta if kind == "delta" else _hexapod)(rng, base)
    axes, tool = _behind(rng, behind)
    actuated = [*(["before"] if before else []), *names, *(f"axis_{k}" for k in range(len(behind)))]
    head = HEAD.format(
        actuated=", ".join(f'"{name}"' for name in actuated),
        tool=tool,
        xyz=_listed(rng.uniform(-0.1, 0.1, 3)),
    )
    return read_text(head + text + axes + legs + reference, exact=True)


def _before(rng, kind):
    if not kind:
        return ""
    motion = "prismatic" if kind == "rail" else "revolute"
    axis = [1, 0, 0] if kind == "rail" else [0, 0, 1]
    return _joint("before", "0", motion, rng.uniform(-0.3, 0.3, 3), axis)


def _behind(rng, kinds):
    text, parent = "", "platform"
    for k, kind in enumerate(kinds):
        motion = "prismatic" if kind == "s" else "revolute"
        axis = [int(kind == letter) for letter in "xyz"] if kind != "s" else [0, 0, 1]
        # The axes of a wrist intersect in one point, so that three axes orient the tool.
        offset = rng.uniform(-0.08, 0.08, 3) if k == 0 or len(kinds) < 3 else np.zeros(3)
        text += _joint(f"axis_{k}", parent, motion, offset, axis)
        parent = f"axis_{k}"
    return text, parent


def _joint(name, parent, kind, xyz, axis):
    return f"""
[[joints]]
name = "{name}"
parent = "{parent}"
link = "{name}"
type = "{kind}"
xyz = {_listed(xyz)}
axis = {axis}
"""


def _delta(rng, base):
    R, r, arm = (round(float(x), 3) for x in rng.uniform((0.2, 0.04, 0.2), (0.3, 0.08, 0.3)))
    rod, half = round(float(rng.uniform(0.6, 0.9)), 3), round(float(rng.uniform(0.02, 0.05)), 3)
    text, names = "", [f"leg_{k}" for k in range(3)]
    for k, name in enumerate(names):
        heading = 120 * k
        text += f"""
[[joints]]
name = "{name}"
parent = "{base}"
link = "{name}"
xyz = ["{R}*cos({heading}*pi/180)", "{R}*sin({heading}*pi/180)", 0]
rpy = [0, 0, "{heading}*pi/180"]
axis = [0, 1, 0]
"""
        for side, y in (("l", half), ("r", -half)):
            c, s = f"cos({heading}*pi/180)", f"sin({heading}*pi/180)"
            text += f"""
[[rods]]
name = "rod_{k}{side}"
length = {rod}
ends = "ball"
a = {{ body = "{name}", xyz = [{arm}, {y}, 0] }}
b = {{ body = "platform", xyz = ["{r}*{c} - ({y})*{s}", "{r}*{s} + ({y})*{c}", 0] }}
"""
    height = np.sqrt(rod**2 - (R + arm - r) ** 2)
    return text, names, f"\n[reference]\nz = {-height:.6f}\n"


def _hexapod(rng, base):
    text, names = "", [f"leg_{k}" for k in range(6)]
    lines = []
    for k, name in enumerate(names):
        around = np.pi / 3 * k + rng.uniform(-0.2, 0.2, 2) + [0.35 * (-1) ** k, -0.35 * (-1) ** k]
        a, b = (
            np.round([radius * np.cos(t), radius * np.sin(t), z], 3)
            for radius, t, z in zip((0.4, 0.25), around, rng.uniform(-0.03, 0.03, 2), strict=True)
        )
        length = np.linalg.norm(b - a + np.array([0, 0, 0.6]))
        text += f"""
[[cylinders]]
name = "{name}"
ends = "ball"
a = {{ body = "{base}", xyz = {_listed(a)} }}
b = {{ body = "platform", xyz = {_listed(b)} }}
"""
        lines.append(f"{name} = {length:.9f}")
    return text, names, "\n[reference]\nz = 0.6\n" + "\n".join(lines) + "\n"


def _listed(values):
    return [round(float(x), 3) for x in values]
