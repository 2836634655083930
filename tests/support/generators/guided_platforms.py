"""Random platforms on UPS legs, with a passive chain between base and platform.

The chain has one degree of freedom per leg. For example, the platform 3-UPS/UP has three legs and
the chain UP.
"""

from functools import partial

import numpy as np

from .leg_platforms import chain, closure

ORIGIN = (0, 0, 0)
X, Y, Z = (1, 0, 0), (0, 1, 0), (0, 0, 1)
HEIGHT = 600
"""Height of the platform at the reference configuration (mm)."""
GUIDES = {
    "2-UPS/U": (X, Y),
    "3-UPS/S": (X, Y, Z),
    "3-UPS/UP": (X, Y, "up"),
    "4-UPS/SP": (X, Y, Z, "up"),
    "5-UPS/UPU": (X, Y, "up", Y, X),
}
"""For each kind of platform, the joints of the passive chain that guides the platform."""
SLIDES = {"up": Z, "ahead": X}
"""Axes of the prismatic joints by name."""


def _guide(joints):
    """Return (robot file text, last link, reference values) of a passive chain."""
    # In a chain without a vertical prismatic joint, the first joint is at the height of the
    # platform.
    start = ORIGIN if "up" in joints else (0, 0, HEIGHT)
    listed = [
        (f"g{k}", "prismatic", ORIGIN, SLIDES[joint])
        if isinstance(joint, str)
        else (f"g{k}", "revolute", ORIGIN if k else start, joint)
        for k, joint in enumerate(joints)
    ]
    reference = {f"g{k}": HEIGHT for k, joint in enumerate(joints) if joint == "up"}
    return chain(listed), listed[-1][0], reference


def guided(joints, rng):
    """Return a platform with a passive chain, and with one UPS leg per joint of the chain."""
    count = len(joints)
    text, platform, reference = _guide(joints)
    # Two legs at opposite points of the platform would move only one of the platform's two axes.
    spread = 360 / max(count, 3)
    for k in range(count):
        heading = spread * k + rng.uniform(-8, 8)
        ahead = heading + rng.uniform(30, 50) * (-1) ** (k if count > 3 else 0)
        foot, top = _at(rng.integers(320, 400), heading), _at(rng.integers(140, 200), ahead)
        leg = top + np.array([0, 0, HEIGHT]) - foot
        length = np.linalg.norm(leg)
        text += chain(
            [
                (f"u{k}", "revolute", foot, X),
                (f"v{k}", "revolute", ORIGIN, Y),
                (f"l{k}", "prismatic", ORIGIN, Z),
            ]
        )
        text += closure(f"ball{k}", "ball", (f"l{k}", ORIGIN, ORIGIN), (platform, top, ORIGIN))
        tilt = np.degrees([np.arctan2(-leg[1], leg[2]), np.arcsin(leg[0] / length)])
        reference |= {f"u{k}": tilt[0], f"v{k}": tilt[1], f"l{k}": length}
    return [f"l{k}" for k in range(count)], text, reference | {"tool": platform}


def _at(radius, heading):
    angle = np.deg2rad(heading)
    return np.round([radius * np.cos(angle), radius * np.sin(angle), 0], 3)


GUIDED_KINDS = {kind: partial(guided, joints) for kind, joints in GUIDES.items()}
"""Generators of platforms, keyed by kind. Each generator returns the actuated joints, the joints
and closures as text, and the reference configuration."""
