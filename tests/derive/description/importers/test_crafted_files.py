"""Reading a malicious file raises an error that names the file."""

import sys

import pytest

import chasles
from chasles import NotInstalledError
from chasles.derive import ChaslesError, apply_calibration, read, read_text

ALIASES = "".join(f"a{k + 1}: &a{k + 1} [{', '.join([f'*a{k}'] * 9)}]\n" for k in range(12))
CALIBRATIONS = {
    "aliased-key.yaml": f"a0: &a0 [x]\n{ALIASES}? *a12\n: 1\n",
    "deep.yaml": "[" * 5000,
    "lines.conf": "\n" * 900_000,
}


@pytest.mark.parametrize("name", CALIBRATIONS)
def test_crafted_calibration_is_refused(name, tmp_path):
    file = tmp_path / name
    file.write_text(CALIBRATIONS[name])
    with pytest.raises(ChaslesError, match=name):
        apply_calibration(read("ur5e"), file)


@pytest.mark.parametrize("encoding", ["punycode", "undefined"])
def test_unusual_encoding_is_refused(encoding, tmp_path):
    file = tmp_path / "arm.urdf"
    file.write_text(f'<?xml version="1.0" encoding="{encoding}"?><robot name="r"/>')
    with pytest.raises(ChaslesError, match=r"arm\.urdf"):
        read(file)


def test_deep_manifest_is_refused(tmp_path):
    (tmp_path / "manifest.json").write_text("[" * 100_000)
    with pytest.raises(ChaslesError, match=r"manifest\.json"):
        chasles.load(tmp_path)


BODY = '<mujoco><worldbody><body name="b"><joint/><geom size="1"/></body></worldbody></mujoco>'
INCLUDES = {
    "arm.xml": ('<mujoco><include file="../common/b.xml"/></mujoco>', "b.xml", BODY),
    "arm.xacro": (
        '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">'
        '<xacro:include filename="../common/b.xacro"/></robot>',
        "b.xacro",
        '<robot><link name="a"/><link name="b"/><joint name="j" type="continuous">'
        '<parent link="a"/><child link="b"/></joint></robot>',
    ),
}


@pytest.mark.parametrize("name", INCLUDES)
def test_files_are_included_from_the_package_only(name, tmp_path):
    text, other, content = INCLUDES[name]
    for folder in ("arm", "common"):
        (tmp_path / folder).mkdir()
    (tmp_path / "common" / other).write_text(content)
    file = tmp_path / "arm" / name
    file.write_text(text)
    with pytest.raises(ChaslesError, match=r"expected included files inside .*package\.xml"):
        read(file)
    (tmp_path / "package.xml").write_text("<package><name>arms</name></package>")
    assert len(read(file).joints) == 1


def test_link_out_of_the_folder_is_not_followed(tmp_path):
    (tmp_path / "arm").mkdir()
    (tmp_path / "b.xml").write_text(BODY)
    file = tmp_path / "arm" / "arm.xml"
    (tmp_path / "arm" / "b.xml").symlink_to("../b.xml")
    file.write_text('<mujoco><include file="b.xml"/></mujoco>')
    with pytest.raises(ChaslesError, match="expected included files inside"):
        read(file)


def test_long_text_is_refused():
    with pytest.raises(ChaslesError, match="at most 1000000 bytes"):
        read_text("#" * 1_000_001)


def test_missing_yaml_is_reported_with_the_command(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "yaml", None)
    file = tmp_path / "arm.yaml"
    file.write_text("kinematics: {}")
    with pytest.raises(NotInstalledError, match=r"pip install 'chasles\[files\]'"):
        apply_calibration(read("ur5e"), file)
