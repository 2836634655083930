"""Writes the URDF of a serial robot whose joints have URDF origins.

URDF has no joint directions and no helical joints. If a joint moves opposite to its coordinate, the
written axis is reversed. A helical joint is written as a revolute joint and a prismatic joint that
mimics the angle of the revolute joint.
"""

from dataclasses import dataclass, replace

import sympy as sp
from lxml import etree

from ..description.conventions import urdf
from ..description.importers.identifiers import identifier
from ..model.convention import Convention
from ..model.placements import Placement, Vector
from ..model.robot import Coupling, Joint, SerialRobot
from ..model.tolerances import UNLIMITED
from .number_text import nearest
from .origins import fields_of, placed
from .urdf_drives import Mimic, urdf_drives, write_gears

_EFFORT = "1000"
"""Placeholder for the effort and velocity limits, which URDF requires and robot descriptions do not
contain."""


@dataclass(frozen=True)
class UrdfNames:
    """Names of the base link, of the tool link, and of the two fixed joints that attach them."""

    base: str
    tool: str
    base_joint: str
    tool_joint: str


def robot_urdf(robot: SerialRobot) -> str:
    """Return the text of a URDF, with 17 significant digits.

    Args:
        robot: A robot without parameters, whose joints have the convention `urdf`.

    Raises:
        InputValueError: Mimic joints and transmissions cannot express the couplings of the robot.
    """
    mimics, gears = urdf_drives(robot)
    root = etree.Element("robot", name=robot.name)
    names = urdf_names(robot)
    has_tool = names.tool != robot.link_names[-1]
    links = zip(robot.joints, robot.link_names, strict=True)
    joints = [replace(joint, link=link) for joint, link in links]
    if robot.base:
        first = f"{names.base_joint}_link"
        joints.insert(0, _fixed(names.base_joint, first, robot.base))
    if has_tool:
        joints.append(_fixed(names.tool_joint, names.tool, robot.tool))
    etree.SubElement(root, "link", name=names.base)
    parent = names.base
    for joint in joints:
        etree.SubElement(root, "link", name=joint.link)
        _write(root, joint, parent, mimics.get(joint.name))
        parent = joint.link
    if gears:
        write_gears(root, robot.name, gears)
    etree.indent(root)
    return f'<?xml version="1.0"?>\n{etree.tostring(root, encoding="unicode")}\n'


def urdf_names(robot: SerialRobot) -> UrdfNames:
    """Return names of base and tool that differ from all link and joint names of the robot."""
    links, joints = set(robot.link_names), {joint.name for joint in robot.joints}
    base = robot.base_frame if identifier(robot.base_frame) == robot.base_frame else "base"
    base = _free(base, links)
    tool = robot.tool_frame if identifier(robot.tool_frame) == robot.tool_frame else "ee"
    is_last_link = not robot.tool and tool == robot.link_names[-1]
    tool = tool if is_last_link else _free(tool, {*links, base})
    base_joint = _free(f"{base}_joint", joints)
    return UrdfNames(base, tool, base_joint, _free(f"{tool}_joint", {*joints, base_joint}))


def _free(name: str, taken: set[str]) -> str:
    while name in taken:
        name += "_"
    return name


def _fixed(name: str, link: str, placement: Placement) -> Joint:
    xyz, rpy = placed(placement)
    axis: Vector = (sp.S.Zero, sp.S.Zero, sp.S.One)
    given = urdf.scalars({"xyz": xyz, "rpy": rpy, "axis": axis})
    return Joint(name, "fixed", link=link, convention=urdf, given=given)


def with_split_helical_joints(robot: SerialRobot) -> SerialRobot:
    """Return the robot with each helical joint split into a revolute and a prismatic joint."""
    taken = {joint.name for joint in robot.joints} | set(robot.link_names)
    values = {parameter.symbol: parameter.value for parameter in robot.parameters}
    rules, couplings = {rule.joint: rule for rule in robot.couplings}, [*robot.couplings]
    joints: list[Joint] = []
    links = zip(robot.joints, robot.link_names, strict=True)
    for joint in (replace(joint, link=link) for joint, link in links):
        if joint.kind != "helical":
            joints.append(joint)
            continue
        name = _free(f"{joint.name}_advance", taken)
        link = _free(f"{name}_link", taken)
        taken |= {name, link}
        rule = rules.get(joint.name) or Coupling(joint.name, ((joint.name, sp.S.One),))
        pitch = joint.pitch.xreplace(values)
        bare = replace(joint, pitch=sp.S.Zero, convention=None, given=(), assumed=())
        joints.append(replace(bare, kind="revolute", after=(), link=link))
        ratios = tuple((leader, pitch * ratio) for leader, ratio in rule.ratios)
        couplings.append(Coupling(name, ratios, pitch * rule.offset))
        joints.append(
            replace(
                bare,
                name=name,
                kind="prismatic",
                before=(),
                limits=(None, None),
            )
        )
    return replace(robot, joints=tuple(joints), couplings=tuple(couplings))


def _write(root: etree._Element, joint: Joint, parent: str, mimic: Mimic | None) -> None:
    convention: Convention = urdf
    fields = fields_of(joint, convention)
    kind = _urdf_kind(joint)
    element = etree.SubElement(root, "joint", name=joint.name, type=kind)
    _append_origin(element, fields["xyz"], fields["rpy"])
    etree.SubElement(element, "parent", link=parent)
    etree.SubElement(element, "child", link=joint.link)
    if joint.kind == "fixed":
        return
    axis = fields["axis"]
    assert isinstance(axis, tuple)
    x, y, z = (joint.direction * part for part in axis)
    etree.SubElement(element, "axis", xyz=_row((x, y, z)))
    if kind != "continuous":
        etree.SubElement(element, "limit", _limits(joint))
    if mimic is not None:
        etree.SubElement(
            element,
            "mimic",
            joint=mimic.leader,
            multiplier=nearest(mimic.multiplier),
            offset=nearest(mimic.offset),
        )


def _urdf_kind(joint: Joint) -> str:
    return "continuous" if joint.kind == "revolute" and None in joint.limits else joint.kind


def _append_origin(element: etree._Element, xyz: object, rpy: object) -> None:
    assert isinstance(xyz, tuple)
    assert isinstance(rpy, tuple)
    if any(xyz) or any(rpy):
        etree.SubElement(element, "origin", xyz=_row(xyz), rpy=_row(rpy))


def _limits(joint: Joint) -> dict[str, str]:
    """Return the limits of a joint as URDF attributes.

    A prismatic joint without limits is written with a range of 20 km.
    """
    lower, upper = joint.limits
    bounds = {"lower": str(-UNLIMITED), "upper": str(UNLIMITED)}
    if lower is not None and upper is not None:
        bounds = {"lower": nearest(lower), "upper": nearest(upper)}
    return {**bounds, "effort": _EFFORT, "velocity": _EFFORT}


def _row(vector: Vector) -> str:
    return " ".join(nearest(part) for part in vector)
