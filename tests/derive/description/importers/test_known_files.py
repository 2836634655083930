"""The function `read` reads every robot file format, and ignores the case of the file suffix."""

import pytest

from chasles.derive import DescriptionError, Mechanism, SerialRobot, read

URDF = """\
<robot name="hinge">
  <link name="base"/><link name="lid"/>
  <joint name="turn" type="revolute">
    <parent link="base"/><child link="lid"/>
    <origin xyz="0 0 0.1" rpy="1.5708 0 0"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/>
  </joint>
</robot>
"""
MJCF = """\
<mujoco model="hinge"><worldbody><body name="lid" pos="0 0 0.1" euler="90 0 0">
  <joint name="turn" axis="0 0 1"/><geom size="0.01"/>
</body></worldbody></mujoco>
"""
TOML = """\
name = "hinge"
convention = "urdf"
joints = [{ name = "turn", axis = [0, 0, 1], xyz = [0, 0, 0.1], rpy = ["pi/2", 0, 0] }]
"""
FILES = {".urdf": URDF, ".xacro": URDF, ".xml": MJCF, ".toml": TOML, ".URDF": URDF, ".Toml": TOML}


@pytest.mark.parametrize("ending", FILES)
def test_load_reads_every_file_format_in_any_letter_case(tmp_path, ending):
    path = tmp_path / f"hinge{ending}"
    path.write_text(FILES[ending])
    robot = read(path)
    assert isinstance(robot, SerialRobot)
    assert not isinstance(robot, Mechanism)
    assert [joint.name for joint in robot.joints] == ["turn"]
    assert robot.name == "hinge"
    if ending.lower() != ".toml":
        assert robot == read(path)
        assert read(path, exact=True) == read(path, exact=True)
    assert ("3927/2500" in str(read(path, exact=True).joints)) == (FILES[ending] is URDF)


@pytest.mark.parametrize("name", ["arm.yaml", "arm.txt", "arm"])
def test_unknown_file_suffix_is_rejected(tmp_path, name):
    (tmp_path / name).write_text(TOML)
    with pytest.raises(DescriptionError, match=r"ends in one of \.toml, \.urdf, \.xacro, \.xml"):
        read(tmp_path / name)
