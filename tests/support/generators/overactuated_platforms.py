"""Random overactuated platforms: cable robots, and platforms on four cranks."""

import numpy as np

from chasles.derive import read_text

HEAD = """
name = "spare"
convention = "urdf"
actuated = [{actuated}]
units = {{ length = "m", angle = "rad" }}
tool = {{ body = "platform", xyz = {tool} }}
{closure}
[[joints]]
name = "platform"
type = "{kind}"
link = "platform"
"""
CABLE = """
[[cylinders]]
name = "{name}"
ends = "{ends}"
a = {{ body = "0", xyz = {a} }}
b = {{ body = "platform", xyz = {b} }}
"""
CRANK = """
[[joints]]
name = "{name}"
link = "{name}"
parent = "0"
xyz = {a}
axis = [0, 0, 1]
[[rods]]
name = "{name}_rod"
length = 0.5
a = {{ body = "{name}", xyz = [0.4, 0, 0] }}
b = {{ body = "platform", xyz = {b} }}
"""
PLATFORMS = ("planar", "spatial", "cranks")


def drawn_overactuated(kind, seed, *, closure="exact"):
    """Return a platform with one or two redundant actuators.

    Args:
        kind: One of ``PLATFORMS``.
        seed: Random seed of the platform.
        closure: Kind of the loop closure, which is ``exact`` or ``least squares``.
    """
    rng = np.random.default_rng(seed)
    count = {"planar": 4 + seed % 2, "spatial": 7 + seed % 2, "cranks": 4}[kind]
    names = [f"leg_{k}" for k in range(count)]
    text, reference = "", {}
    for k, name in enumerate(names):
        around = 2 * np.pi * k / count + rng.uniform(-0.2, 0.2, 2)
        if kind == "cranks":
            a, b = _on_circle(0.8, around[0], 0), _on_circle(0.1, around[1], 0)
            reference[name] = _crank(a, b)
            text += CRANK.format(name=name, a=_listed(a), b=_listed(b))
            continue
        up = 0.0 if kind == "planar" else (-1) ** k
        a = _on_circle(1.2, around[0], 0.8 * up)
        # Pairs of cables rotate the platform in opposite directions, which fixes its orientation.
        b = _on_circle(0.3, around[1] + 0.8 * abs(up) * (-1) ** (k // 2), -0.25 * up)
        reference[name] = float(np.linalg.norm(np.array(_listed(a)) - _listed(b)))
        ends = "pin" if kind == "planar" else "ball"
        text += CABLE.format(name=name, ends=ends, a=_listed(a), b=_listed(b))
    head = HEAD.format(
        actuated=", ".join(f'"{name}"' for name in names),
        tool=_listed(rng.uniform(-0.05, 0.05, 3) * ([1, 1, 1] if kind == "spatial" else [1, 1, 0])),
        kind="free" if kind == "spatial" else "planar",
        closure=f'closure = "{closure}"',
    )
    lines = [
        f"{name} = {value:.6f}"
        for name, value in reference.items()
        if kind != "planar" or name != names[-1]
    ]
    return read_text(f"{head}{text}\n[reference]\n" + "\n".join(lines) + "\n", exact=True)


def _crank(a, b):
    a, b = np.array(_listed(a)), np.array(_listed(b))
    d = b - a
    D = np.linalg.norm(d)
    return float(np.arctan2(d[1], d[0]) + np.arccos((0.4**2 + D**2 - 0.5**2) / (0.8 * D)))


def _on_circle(radius, angle, z):
    return radius * np.cos(angle), radius * np.sin(angle), z


def _listed(values):
    return [round(float(x), 3) for x in values]
