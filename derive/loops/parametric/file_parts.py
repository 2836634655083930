"""Frames and lengths of a parametric robot, in the order of a robot file.

A robot file describes a joint only by the joint's own frame, so each body uses the frame of the
joint that carries it. The placement after a joint becomes part of the placements of joints, ends
and tool on the joint's body.
"""

from collections.abc import Collection, Mapping

import sympy as sp

from ...model.mechanism import Mechanism
from ...model.placements import Placement, Rotation, Translation, translation
from .mechanism_geometry import MechanismGeometry


def parts(
    mechanism: Mechanism, geometry: MechanismGeometry, coordinates: Collection[sp.Symbol]
) -> list[Placement]:
    """Returns the frames at zero coordinates.

    Args:
        mechanism: The description.
        geometry: Its geometry as variables.
        coordinates: The symbols of coordinates and unknown variables.

    Returns:
        The base body in the base frame, each joint in its parent body, both ends of each closer in
        their bodies, and the tool in its body. Then, for each strut along x, its far end relative
        to its first end.
    """
    zero: dict[sp.Symbol, sp.Expr] = dict.fromkeys(coordinates, sp.S.Zero)
    behind: dict[str, Placement] = {mechanism.base_frame: ()}
    frames = [geometry.base]
    for joint in mechanism.joints:
        step = geometry.steps[joint.link]
        frames.append(behind[joint.parent] + step.before + _at(step.motion, zero))
        behind[joint.link] = step.after
    for closer in mechanism.closers:
        a, b = geometry.ends[closer.name]
        frames += [behind[closer.a.body] + a, behind[closer.b.body] + b]
    frames.append(behind[mechanism.tool_body] + geometry.tool)
    for strut in mechanism.struts:
        length = geometry.lengths[strut.name].xreplace(zero)
        frames.append(translation(length, sp.S.Zero, sp.S.Zero))
    return frames


def _at(placement: Placement, values: Mapping[sp.Symbol, sp.Expr]) -> Placement:
    return tuple(
        Rotation(motion.axis, motion.angle.xreplace(values))
        if isinstance(motion, Rotation)
        else Translation(tuple(part.xreplace(values) for part in motion.vector))
        for motion in placement
    )
