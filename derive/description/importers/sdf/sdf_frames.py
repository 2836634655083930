"""Computes the poses of an SDF model at zero from ``<pose relative_to="...">``.

Links, joints and frames have poses in the model frame. By default, the pose of a link is relative
to the model, and the pose of a joint is relative to its child. The pose of a frame is relative to
the frame to which it is attached.
"""

from collections.abc import Mapping
from typing import NoReturn

import mpmath as mp
import sympy as sp
from lxml import etree

from ....model.exact import NotExact, read
from ....model.placements import (
    Placement,
    Rotation,
    Translation,
    Vector,
    from_xyz_rpy,
    inverse,
    rotation,
    translation,
)
from ....model.tolerances import EVALUATION_DIGITS
from ...pose_error import pose_in_digits
from ...toml_file import file_error, listed
from ...urdf import DECIMAL
from ..mjcf.mjcf_model import angle, length
from ..roll_pitch_yaw import of_matrix, of_quaternion

MODEL, WORLD = "__model__", "world"
_ORDER = "zyx"
_NUMBERS = {"euler_rpy": 6, "quat_xyzw": 7}


def merged(placement: Placement) -> Placement:
    """Return a placement with consecutive motions merged and zero motions removed."""
    found: Placement = ()
    for motion in placement:
        last = found[-1] if found else None
        if isinstance(motion, Translation):
            if isinstance(last, Translation):
                x, y, z = (a + b for a, b in zip(last.vector, motion.vector, strict=True))
                found = found[:-1] + translation(x, y, z)
            else:
                found += translation(*motion.vector)
        elif isinstance(last, Rotation) and last.axis == motion.axis:
            found = found[:-1] + rotation(motion.axis, last.angle + motion.angle)
        else:
            found += rotation(motion.axis, motion.angle)
    return found if len(found) == len(placement) else merged(found)


def origin_of(placement: Placement) -> tuple[Vector, Vector]:
    """Return the position, and roll, pitch and yaw.

    The result is exact for a product T Rz Ry Rx.
    """
    xyz: Vector = (sp.S.Zero, sp.S.Zero, sp.S.Zero)
    angles = dict.fromkeys(_ORDER, sp.S.Zero)
    axes = [motion.axis for motion in placement if isinstance(motion, Rotation)]
    is_first = not any(isinstance(motion, Translation) for motion in placement[1:])
    if is_first and axes == sorted(axes, reverse=True) and len(axes) == len({*axes}):
        for motion in placement:
            if isinstance(motion, Rotation):
                angles[motion.axis] = motion.angle
            else:
                xyz = motion.vector
        return xyz, (angles["x"], angles["y"], angles["z"])
    with mp.workdps(EVALUATION_DIGITS):
        T = pose_in_digits(placement, {})
        roll, pitch, yaw = (angle(float(value)) for value in of_matrix(T))
        x, y, z = (length(float(T[k, 3])) for k in range(3))
    return (x, y, z), (roll, pitch, yaw)


class SdfFrames:
    """The frames of a model."""

    def __init__(self, file: str, model: etree._Element) -> None:
        self.file, self.model = file, model
        self.elements: dict[str, etree._Element] = {}
        for kind in ("link", "joint", "frame"):
            for element in model.findall(kind):
                name = self.attribute(element, "name")
                if name in {*self.elements, MODEL, WORLD}:
                    self.fail(element, "name", name, "a name that nothing else in the model has")
                self.elements[name] = element
        self._known: dict[str, Placement] = {MODEL: ()}
        self._known[WORLD] = inverse(self._pose(model.find("pose")))

    def placed(self, name: str, waiting: tuple[str, ...] = ()) -> Placement:
        """Return the pose of a frame in the model frame."""
        if name not in self._known:
            element = self._element(name)
            if name in waiting or len(waiting) > len(self.elements):
                self.fail(element, "relative_to", name, "frames that do not refer to each other")
            pose = element.find("pose")
            at = pose.get("relative_to", "") if pose is not None else ""
            above = self.placed(at or self._default(element), (*waiting, name))
            self._known[name] = merged(above + self._pose(pose))
        return self._known[name]

    def relative(self, base: str, name: str) -> Placement:
        """Return the pose of a frame in another frame, with all joints at zero."""
        return merged(inverse(self.placed(base)) + self.placed(name))

    def link_of(self, name: str, waiting: tuple[str, ...] = ()) -> str:
        """Return the link to which a frame is rigidly attached."""
        if name == WORLD:
            return name
        if name == MODEL:
            first = self.model.get("canonical_link") or self.attribute(
                self.model.find("link"), "name"
            )
            return self.link_of(first, (*waiting, name)) if MODEL not in waiting else first
        element = self._element(name)
        if element.tag == "link":
            return name
        if name in waiting:
            self.fail(element, "attached_to", name, "frames that do not refer to each other")
        above = self.text(element, "child") if element.tag == "joint" else ""
        return self.link_of(above or element.get("attached_to") or MODEL, (*waiting, name))

    def _element(self, name: str) -> etree._Element:
        if name not in self.elements:
            known = listed([*self.elements, WORLD])
            self.fail(self.model, "frame", name, f"a link, joint or frame of the model ({known})")
        return self.elements[name]

    def _default(self, element: etree._Element) -> str:
        if element.tag == "joint":
            return self.text(element, "child")
        return element.get("attached_to") or MODEL if element.tag == "frame" else MODEL

    def _pose(self, pose: etree._Element | None) -> Placement:
        if pose is None or not (pose.text or "").strip():
            return ()
        form = pose.get("rotation_format", "euler_rpy")
        words = str(pose.text).split()
        if form not in _NUMBERS or len(words) != _NUMBERS[form]:
            self.fail(pose, "pose", pose.text, "x y z roll pitch yaw, or x y z and quat_xyzw")
        x, y, z, *turn = (self.number(pose, "pose", word) for word in words)
        if form == "quat_xyzw":
            if not any(turn):
                self.fail(pose, "pose", pose.text, "a quaternion that is not 0")
            with mp.workdps(EVALUATION_DIGITS):
                a, b, c, w = (mp.mpf(value.p) / value.q for value in turn)
                turn = [angle(float(value)) for value in of_quaternion(w, a, b, c)]
        elif pose.get("degrees", "false") in ("true", "1"):
            turn = [value * sp.pi / 180 for value in turn]
        return from_xyz_rpy((x, y, z), (turn[0], turn[1], turn[2]))

    # --- values ---

    def number(self, element: etree._Element, field: str, text: str) -> sp.Expr:
        """Return a decimal number exactly as written in the file."""
        if not DECIMAL.fullmatch(text.strip()):
            self.fail(element, field, text, "a decimal number")
        try:
            return read(text.strip())
        except NotExact as error:
            self.fail(element, field, text, f"a number ({error})")

    def text(self, element: etree._Element, tag: str) -> str:
        """Return the text of a child element."""
        child = element.find(tag)
        found = (child.text or "").strip() if child is not None else ""
        if not found:
            self.fail(element, tag, None, f"<{tag}>")
        return found

    def attribute(self, element: etree._Element | None, name: str) -> str:
        """Return an attribute of an element. The attribute must not be empty."""
        value = None if element is None else element.get(name)
        if not value:
            self.fail(self.model if element is None else element, name, value, f'{name}="..."')
        return value

    def fail(self, element: etree._Element, field: str, value: object, expected: str) -> NoReturn:
        """Raise an error with file, line and element."""
        words: Mapping[str, str] = {"tag": str(element.tag), "name": element.get("name") or ""}
        about = f"<{' '.join(filter(None, words.values()))}> {field}".strip()
        raise file_error(self.file, element.sourceline, about, value, expected) from None
