"""The parts of a robot file of any geometry: frames and lengths, in the order of the file.

Each body's frame is that of the joint that carries it, since a robot file describes a joint by its
own frame alone; the placement behind a joint goes to the joints, ends and tool on its body.
"""

from collections.abc import Collection, Mapping

import sympy as sp

from ...model.mechanism import Mechanism
from ...model.placements import Placement, Rotation, Translation, translation
from .mechanism_geometry import MechanismGeometry


def parts(
    mechanism: Mechanism, geometry: MechanismGeometry, coordinates: Collection[sp.Symbol]
) -> list[Placement]:
    """Frames at coordinates zero.

    Args:
        mechanism: The description.
        geometry: Its geometry as variables.
        coordinates: The symbols of coordinates and unknown variables.

    Returns:
        The base body's frame in the base frame, each joint's in its parent's body, both ends of
        each closer in their bodies, the tool's in its body; and the end of each strut that lies
        along x, at its beginning.
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
