"""URDF files with various encodings or missing limits."""

import re

import pytest

from chasles.derive import DescriptionError, read

URDF = """<?xml version="1.0"{encoding}?>
<!-- Prüfling -->
<robot name="arm">
  <link name="base"/><link name="upper"/><link name="fore"/><link name="hand"/>
  <joint name="shoulder" type="revolute">
    <parent link="base"/><child link="upper"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="2"/>
  </joint>
  <joint name="elbow" type="revolute">
    <parent link="upper"/><child link="fore"/><origin xyz="1 0 0"/><axis xyz="0 0 1"/>
    {limit}
  </joint>
  <joint name="wrist" type="continuous">
    <parent link="fore"/><child link="hand"/><origin xyz="1 0 0"/><axis xyz="1 0 0"/>
  </joint>
</robot>
"""
LIMIT = '<limit lower="-1" upper="1"/>'
DECLARED = {
    "utf-8": "",
    "utf-8-sig": ' encoding="UTF-8"',
    "latin-1": ' encoding="ISO-8859-1"',
    "cp1252": " encoding='windows-1252'",
    "utf-16": ' encoding="UTF-16"',
    "utf-16-le": ' encoding="UTF-16"',
    "utf-16-be": "",
}


@pytest.mark.parametrize("encoding", DECLARED)
def test_urdf_is_read_in_the_encoding_that_it_declares(tmp_path, encoding):
    path = tmp_path / "arm.urdf"
    text = URDF.format(encoding=DECLARED[encoding], limit=LIMIT)
    path.write_bytes(text.encode(encoding))
    robot = read(path)
    assert [joint.name for joint in robot.moving] == ["shoulder", "elbow", "wrist"]
    assert robot.notes == ()


@pytest.mark.parametrize(
    ("declared", "message"),
    [("UTF-8", "UTF-8 text"), ("klingon", "a known encoding")],
    ids=["other bytes than declared", "unknown encoding"],
)
def test_undecodable_urdf_is_refused_with_its_encoding(tmp_path, declared, message):
    path = tmp_path / "arm.urdf"
    text = URDF.format(encoding=f' encoding="{declared}"', limit=LIMIT)
    path.write_bytes(text.encode("latin-1"))
    with pytest.raises(DescriptionError, match=message):
        read(path)


@pytest.mark.parametrize(
    ("tag", "suffix"),
    [('robot xmlns="http://www.ros.org"', ".urdf"), ("u:robot", ".urdf"), ("u:robot", ".xml")],
    ids=["default namespace", "prefix", "prefix without ending"],
)
def test_namespace_of_urdf_is_accepted(tmp_path, tag, suffix):
    text = URDF.format(encoding="", limit=LIMIT)
    path = tmp_path / f"arm{suffix}"
    path.write_text(text, encoding="utf-8")
    known = read(path)
    if tag.startswith("u:"):
        text = re.sub(r"<(/?)(?=[a-z])", r"<\1u:", text)
    text = text.replace("<u:robot", '<u:robot xmlns:u="http://www.ros.org"')
    path.write_text(text.replace("<robot", f"<{tag}"), encoding="utf-8")
    assert read(path) == known


def test_elements_of_other_namespaces_stay_apart(tmp_path):
    path = tmp_path / "arm.urdf"
    text = URDF.format(encoding="", limit=LIMIT).replace("<robot", '<robot xmlns="urn:a"')
    other = '<joint xmlns="urn:b" name="none"/></robot>'
    path.write_text(text.replace("</robot>", other), encoding="utf-8")
    assert len(read(path).joints) == 3


@pytest.mark.parametrize(
    "limit",
    ["", '<limit effort="1" velocity="1"/>', '<limit lower="0" upper="0.0"/>'],
    ids=["no limit", "limit without range", "zero range"],
)
def test_missing_and_zero_limits_are_noted_as_unlimited(tmp_path, limit):
    path = tmp_path / "arm.urdf"
    path.write_text(URDF.format(encoding="", limit=limit), encoding="utf-8")
    robot = read(path)
    assert robot.moving[1].limits == (None, None)
    assert robot.notes == ("the file states no limits for joint elbow, which is unlimited",)
