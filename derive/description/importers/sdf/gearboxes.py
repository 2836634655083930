"""Converts ``gearbox`` joints to linear equations between the joints of an SDF model.

theta_1 is the angle from the reference body to the parent link, about ``<axis>``. theta_2 is the
angle from the reference body to the child link, about ``<axis2>``. A gearbox states theta_2 =
-ratio * theta_1. If all revolute joints between two links are parallel, the angle between the links
is the sum of the joint angles.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence

import mpmath as mp
import numpy as np
import sympy as sp
from lxml import etree
from numpy.typing import NDArray

from ....model.linear_equations import LinearEquation
from ....model.placements import Vector
from ....model.tolerances import EVALUATION_DIGITS, PARALLEL_GEARS
from ...pose_error import pose_in_digits
from ..kinematic_tree import KinematicTree, TreeJoint
from .sdf_frames import MODEL, SdfFrames

AxisReader = Callable[[etree._Element, str], Vector]
"""Returns the vector of the child element ``axis`` or ``axis2`` in the frame of a joint."""


class Gearboxes:
    """The gearboxes of a model."""

    def __init__(self, frames: SdfFrames, axis_of: AxisReader) -> None:
        self.frames, self.axis_of = frames, axis_of

    def equations(
        self, tree: KinematicTree, joints: Mapping[str, etree._Element]
    ) -> Iterator[LinearEquation]:
        """Yield the equation theta_2 + ratio * theta_1 = 0 of each gearbox.

        Args:
            tree: The links and joints of the model.
            joints: XML elements of the joints, keyed by joint name.

        Raises:
            DescriptionError: A joint axis is not parallel to the axis of a gearbox, or no joint
                moves the links of a gearbox relative to each other.
        """
        for gearbox in self.frames.model.findall("joint[@type='gearbox']"):
            text = gearbox.findtext("gearbox_ratio") or "1"
            ratio = self.frames.number(gearbox, "gearbox_ratio", text)
            base = self.frames.link_of(self.frames.text(gearbox, "gearbox_reference_body"))
            factors: dict[str, sp.Expr] = {}
            for tag, axis, factor in (("parent", "axis", ratio), ("child", "axis2", sp.S.One)):
                own = axis if gearbox.find(axis) is not None else "axis"
                link = self.frames.link_of(self.frames.text(gearbox, tag))
                path = tree.path(base, link) or ()
                moved = [joint for joint in path if joint.name in joints and joint.kind != "fixed"]
                for joint in moved:
                    sign = self._sign(gearbox, own, joints[joint.name])
                    sign *= 1 if self._is_downward(joint, base, path) else -1
                    factors[joint.name] = factors.get(joint.name, sp.S.Zero) + sign * factor
            kept = {name: factor for name, factor in factors.items() if factor != 0}
            if not kept:
                self.frames.fail(gearbox, "gearbox_reference_body", base, "links that move")
            yield LinearEquation(kept, sp.S.Zero)

    @staticmethod
    def _is_downward(joint: TreeJoint, base: str, path: Sequence[TreeJoint]) -> bool:
        """Whether a path from ``base`` reaches the parent link of a joint before its child link.

        The result is also True if the path does not contain the joint.
        """
        link = base
        for each in path:
            if each is joint:
                return each.parent == link
            link = each.child if each.parent == link else each.parent
        return True

    def _sign(self, gearbox: etree._Element, axis: str, joint: etree._Element) -> int:
        """Return 1 if the axes of joint and gearbox have the same direction, or -1 if opposite.

        The result is 0 for a prismatic joint.
        """
        if joint.get("type") == "prismatic":
            return 0
        cosine = float(self._direction(gearbox, axis) @ self._direction(joint, "axis"))
        if abs(abs(cosine) - 1) > PARALLEL_GEARS:
            name = str(joint.get("name"))
            expected = f"a direction parallel to the axis of joint {name!r}, which rotates a gear"
            self.frames.fail(gearbox, axis, gearbox.findtext(f"{axis}/xyz"), expected)
        return 1 if cosine > 0 else -1

    def _direction(self, joint: etree._Element, axis: str) -> NDArray[np.float64]:
        """Return the unit vector of an axis in the model frame, with all joints at zero."""
        with mp.workdps(EVALUATION_DIGITS):
            T = pose_in_digits(self.frames.relative(MODEL, str(joint.get("name"))), {})
            R = np.array([[float(T[i, j]) for j in range(3)] for i in range(3)])
        vector = R @ [float(part) for part in self.axis_of(joint, axis)]
        return np.asarray(vector / np.linalg.norm(vector))
