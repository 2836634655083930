"""Random parallel platforms with additional joints.

Each leg of a platform keeps a ball joint in a plane. The additional joints form a rail, a turntable
or an arm.
"""

from dataclasses import replace

import numpy as np

from chasles.derive import Joint
from chasles.derive.description.conventions import urdf
from tests.support.loops.legs_of_joints import FLAT, drawn, driven_by_a_leg

BEFORE = ("", "rail", "turntable")
BEHIND = ("", "r", "s", "rr", "rs", "rrr", "rrs")
"""Types of the joints on the platform, with r for revolute and s for prismatic."""
KINDS = [(a, b) for a in BEFORE for b in BEHIND if a or b]


def drawn_planes(seed):
    rng = np.random.default_rng(seed)
    before, behind = KINDS[seed % len(KINDS)]
    legs = tuple(FLAT[k] for k in rng.integers(0, len(FLAT), 3))
    mechanism = driven_by_a_leg() if rng.random() < 0.2 else drawn(seed, legs)
    axes = [(_direction(rng), _offset(rng)) for _ in behind]
    kinds = ["revolute" if letter == "r" else "prismatic" for letter in behind]
    mechanism = carrying(mechanism, axes, kinds) if behind else mechanism
    if before:
        mechanism = moved(mechanism, before, _direction(rng), _offset(rng))
    return mechanism, f"{before} {' '.join(legs)} {behind}"


def carrying(mechanism, axes, kinds=()):
    """Return a robot with further actuated joints on the body ``platform``.

    Args:
        mechanism: The platform.
        axes: Axis and origin (meter) of each joint.
        kinds: Type of each joint. By default, all joints are revolute.
    """
    joints, parent = [], "platform"
    for k, (axis, xyz) in enumerate(axes):
        kind = kinds[k] if kinds else "revolute"
        before, after = urdf(kind, xyz=xyz, rpy=(0, 0, 0), axis=axis)
        joints.append(Joint(f"axis_{k}", kind, before, after, link=f"hand_{k}", parent=parent))
        parent = f"hand_{k}"
    return replace(
        mechanism,
        joints=(*mechanism.joints, *joints),
        actuated=(*mechanism.actuated, *(joint.name for joint in joints)),
        tool_body=parent,
    )


def moved(mechanism, name, axis, xyz):
    """Return a robot whose legs start on a carriage that moves on the base.

    Args:
        mechanism: The platform.
        name: Name of the actuated joint, which is prismatic if the name is ``rail`` and revolute
            for other names.
        axis: Axis of the joint.
        xyz: Origin of the joint (meter).
    """
    kind, base = "prismatic" if name == "rail" else "revolute", mechanism.base_frame
    before, after = urdf(kind, xyz=xyz, rpy=(0, 0, 0), axis=axis)
    joint = Joint(name, kind, before, after, link="carriage", parent=base)
    others = (replace(j, parent="carriage") if j.parent == base else j for j in mechanism.joints)
    return replace(mechanism, joints=(joint, *others), actuated=(name, *mechanism.actuated))


def _direction(rng):
    if rng.random() < 0.5:
        return tuple(int(k) for k in np.eye(3)[rng.integers(3)])
    return tuple(int(k) for k in rng.integers(1, 6, 3) * rng.choice([-1, 1], 3))


def _offset(rng):
    return tuple(str(round(float(x), 3)) for x in rng.uniform(-0.1, 0.1, 3))
