"""Converts each universal joint of an SDF model to two revolute joints with a link between them."""

from copy import deepcopy

from lxml import etree


def split_universal_joints(model: etree._Element) -> None:
    """Replace each universal joint of a model by two revolute joints.

    A universal joint ``J`` becomes a revolute joint ``J`` about the first axis, a link ``J_cross``,
    and a revolute joint ``J_2`` about the second axis. The two revolute joints and the link have
    the frame of the universal joint.
    """
    for joint in model.findall("joint[@type='universal']"):
        _split(model, joint, str(joint.get("name")))


def _split(model: etree._Element, joint: etree._Element, name: str) -> None:
    cross, child = f"{name}_cross", joint.find("child")
    pose = joint.find("pose")
    if pose is None:
        pose = etree.SubElement(joint, "pose")
    if child is not None and not pose.get("relative_to"):
        pose.set("relative_to", (child.text or "").strip())
    second = deepcopy(joint)
    _change(joint, {"child": cross}, "axis2")
    _change(second, {"parent": cross}, "axis")
    second.set("name", f"{name}_2")
    at_joint = second.find("pose")
    assert at_joint is not None
    at_joint.attrib.clear()
    at_joint.text = None
    at_joint.set("relative_to", name)
    for axis in second.findall("axis2"):
        axis.tag = "axis"
    joint.addnext(second)
    etree.SubElement(etree.SubElement(model, "link", name=cross), "pose", relative_to=name)


def _change(joint: etree._Element, texts: dict[str, str], removed: str) -> None:
    """Make a joint revolute, set the texts of child elements, and remove one axis element."""
    joint.set("type", "revolute")
    for tag, text in texts.items():
        for element in joint.findall(tag):
            element.text = text
    for axis in joint.findall(removed):
        joint.remove(axis)
