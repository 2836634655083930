"""URDF import agrees with Pinocchio on random trees.

Invalid URDF files raise errors.
"""

import pytest
import sympy as sp

from chasles.derive import DescriptionError, read, read_text
from tests.support.counting import calls_of
from tests.support.generators.random_urdf import compare

SEEDS = (16, 23)
"""Seeds of random robots with all joint types, in which some mimic joints follow mimic joints.

The test campaign `urdf` in ``tests/campaigns`` tests random robots of further seeds.
"""

TWO_LINKS = """\
<robot name="two-links">
  <link name="base"/>
  <link name="arm"/>
  <link name="tool-0"/>
  <joint name="turn" type="revolute">
    <parent link="base"/>
    <child link="arm"/>
    <origin xyz="0.1 0 0.2" rpy="0 1.57079632679 0"/>
    <axis xyz="0 0 1"/>
    <limit lower="-1.5" upper="2" effort="1" velocity="1"/>
  </joint>
  <joint name="mount" type="fixed">
    <parent link="arm"/>
    <child link="tool-0"/>
    <origin xyz="0 0 0.3" rpy="0 0 1.5708"/>
  </joint>
</robot>
"""


def test_random_urdf_robots_match_pinocchio_link_poses(tmp_path):
    pytest.importorskip("pinocchio", reason="the oracle needs the extra `crosscheck`")
    for seed in SEEDS:
        seen = compare(tmp_path / f"{seed}.urdf", seed)
        assert min(seen.values()) >= 1, seen


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "two.urdf"
    path.write_text(TWO_LINKS)
    return path


def test_urdf_import_keeps_names_and_limits_and_snaps_angles(path):
    robot = read(path)
    assert robot.name == "two_links"
    assert (robot.base_frame, robot.tool_frame) == ("base", "tool_0")
    assert robot.link_names == ("arm", "tool_0")
    assert robot.joints[0].limits == (sp.Rational(-3, 2), 2)
    given = dict(robot.joints[0].given)
    assert given["rpy_y"] == sp.pi / 2
    assert dict(robot.joints[1].given)["rpy_z"] == sp.pi / 2
    cleaned, noted = robot.notes
    # The difference between 1.5708 and pi/2 rotates the tool by 3.7e-6 rad at 0.3 m from the joint.
    assert cleaned == "2 numbers cleaned, at most 1.5e-12 m and 3.7e-06 rad"
    assert noted == "1.5708 interpreted as pi/2: yaw of mount"
    as_written = read(path, exact=True)
    assert dict(as_written.joints[0].given)["rpy_y"] == sp.Rational("1.57079632679")
    assert dict(as_written.joints[1].given)["rpy_z"] == sp.Rational("1.5708")
    assert as_written.notes == ()


def test_undeclared_xml_prefixes_are_ignored(tmp_path):
    arm = tmp_path / "arm.urdf"
    arm.write_text(TWO_LINKS)
    known = read(arm)
    arm.write_text(
        TWO_LINKS.replace("<limit", '<limit drake:acceleration="2"', 1).replace(
            "</robot>", '<drake:ignored name="x"><drake:member/></drake:ignored></robot>'
        )
    )
    assert read(arm) == known
    arm.write_text(arm.read_text().replace("</robot>", ""))
    with pytest.raises(DescriptionError, match="well-formed XML"):
        read(arm)
    arm.write_text('<drake:robot name="arm"/>')
    with pytest.raises(DescriptionError, match="expected a <robot>, found 'drake:robot'"):
        read(arm)


def test_unexpanded_xacro_macro_is_rejected(tmp_path):
    arm = tmp_path / "arm.urdf"
    space = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'
    arm.write_text(f'<robot name="a" {space}><link name="w"/><xacro:arm parent="w"/></robot>')
    with pytest.raises(DescriptionError, match=r"<xacro:arm> is not expanded.*ending \.xacro"):
        read(arm)


def wrong(path, text, base=None, tip=None):
    path.write_text(text)
    with pytest.raises(DescriptionError) as caught:
        read(path, base=base, tip=tip)
    message = str(caught.value)
    assert message.startswith(str(path))
    return message


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("</robot>", "", ":18: expected well-formed XML"),
        ("<robot", "<robott", "well-formed XML"),
        ('"0 0 1"', '"0 0 0"', "zero vector"),
        ('"0 0 1"', '"0 0"', "three numbers"),
        ('"0 0 1"', '"0 0 x"', "found 'x'"),
        ('type="fixed"', 'type="screw"', "one of revolute, continuous, prismatic, fixed"),
        ('<child link="arm"/>', "", "<child link=...>"),
        ('<child link="arm"/>', '<child link="leg"/>', "found 'leg'"),
        ('<child link="arm"/>', '<child link="tool-0"/>', "not the child of another joint"),
        ('lower="-1.5"', 'lower="3"', ":10: <joint turn><limit> limit: expected a lower"),
        (
            'lower="-1.5"',
            'lower="nan"',
            ":10: <joint turn><limit> lower: expected a decimal number",
        ),
        ('"0.1 0 0.2"', '"0.1 0 1e999999999"', "larger than 1e30"),
        ('"0.1 0 0.2"', '"0.1 0 9**9**9"', "found '9**9**9'"),
        ('"0.1 0 0.2"', '"pi 0 0"', "found 'pi'"),
        ('"0.1 0 0.2"', '"1_0 0 0"', "found '1_0'"),
        ('"0.1 0 0.2"', '"${x} 0 0"', "xyz: expected a decimal number, found '${x}'"),
        ('<link name="arm"/>', '<link name="arm"/><link name="arm"/>', "no other link has"),
        ('<link name="arm"/>', "<link/>", ":3: <robot two-links><link> name: expected"),
        ('name="mount"', 'name="turn"', "two joints are called 'turn'"),
        ('name="two-links"', "", ":1: <robot> name: expected"),
        ('type="revolute"', "", ":5: <joint turn> type: expected one of"),
        ("<robot", "<!DOCTYPE robot>\n<robot", "no document type"),
        ("<limit", "<mimic/><limit", '<joint turn><mimic> joint: expected joint="..."'),
        ('name="turn"', "", 'name="..."'),
        ("<limit", '<mimic joint="turn"/><limit', "without a cycle"),
        ("<limit", '<mimic joint="spin"/><limit', "found 'spin'"),
    ],
)
def test_invalid_urdf_raises_specific_error(old, new, words):
    """The test calls `read_text`, because `read` would need a separate process for each file."""
    with pytest.raises(DescriptionError) as caught:
        read_text(TWO_LINKS.replace(old, new), format="urdf", file="two.urdf")
    assert str(caught.value).startswith("two.urdf")
    assert words in str(caught.value)


def test_invalid_base_or_tip_link_is_rejected(path):
    assert "found 'tol0'" in wrong(path, TWO_LINKS, "base", "tol0")
    assert "tool-0" in wrong(path, TWO_LINKS, "base", "tol0")
    assert "other than the base" in wrong(path, TWO_LINKS, "base", "base")
    assert "its own coordinate" in wrong(path, TWO_LINKS, "arm", "tool-0")


def test_cyclic_links_are_rejected(path):
    circle = TWO_LINKS.replace('<link name="base"/>', '<link name="base"/><link name="x"/>')
    loop = '<joint name="back" type="fixed"><parent link="tool-0"/><child link="base"/></joint>'
    message = wrong(path, circle.replace("</robot>", f"{loop}</robot>"), "x", "arm")
    assert "not a descendant of the joint; cyclic joints: " in message
    assert "back" in message


def test_urdf_tip_is_inferred_and_alternatives_are_noted(path):
    fork = '<link name="side"/><joint name="f" type="fixed"><parent link="arm"/>'
    text = TWO_LINKS.replace("</robot>", f'{fork}<child link="side"/></joint></robot>')
    path.write_text(text)
    assert read(path).tool_frame == "arm"
    assert "tip: arm; also there: tool-0, side" in read(path).notes
    assert not any("also there" in note for note in read(path, tip="side").notes)
    assert [joint.name for joint in read(path, tip="side").joints] == ["turn", "f"]
    assert read(path, tip="arm").joints == read(path, tip="side").joints[:1]
    assert "base: expected a choice of the base link among base, x" in wrong(
        path, TWO_LINKS.replace("</robot>", '<link name="x"/></robot>')
    )
    assert read(path, base="base", tip="tool-0", name="my-arm 2").name == "my_arm_2"


def test_mimic_leader_outside_the_chain_is_rejected(path):
    text = TWO_LINKS.replace("<limit", '<mimic joint="f"/><limit')
    fork = '<link name="s"/><joint name="f" type="prismatic"><parent link="arm"/><child link="s"/>'
    message = wrong(path, text.replace("</robot>", f"{fork}</joint></robot>"), "base", "tool-0")
    assert ":5: <joint turn> mimic: expected a joint between base and tool-0" in message
    assert "turn follows; without the coupling, turn has its own coordinate" in message
    assert "found 'f'" in message


@pytest.mark.parametrize(
    ("given", "name"),
    [("class", "xclass"), ("3-axis", "x3_axis"), ("a" * 300, "a" * 60), ("Gerät", "Ger_t")],
    ids=["keyword", "digit first", "too long", "not ascii"],
)
def test_robot_names_are_made_valid_identifiers(given, name):
    assert read_text(TWO_LINKS.replace("two-links", given), format="urdf").name == name


def test_byte_order_mark_encoding_and_rounding_noise_are_accepted(path):
    """The URDF has rounding noise, a byte order mark, Windows line ends and a wrong encoding."""
    noisy = TWO_LINKS.replace('"0.1 0 0.2"', '"1.2246467991473532E-16 -6.1e-33 0.2"')
    content = '\ufeff<?xml version="1.0" encoding="ISO-8859-1"?>\n' + noisy.replace("\n", "\r\n")
    path.write_bytes(content.replace("two-links", "Gerät").encode())
    robot = read(path, exact=True)
    assert robot.title == "Gerät"
    given = dict(robot.joints[0].given)
    assert given["xyz_x"] == sp.Rational("1.2246467991473532e-16")
    assert given["xyz_y"] == sp.Rational("-6.1e-33")
    cleaned = read(path)
    assert dict(cleaned.joints[0].given)["xyz_x"] == 0
    assert cleaned.joints[0].before[0].vector == (0, 0, sp.Rational("0.2"))


def test_missing_urdf_elements_take_their_defaults(path):
    """Missing origin, axis and limit elements of a URDF joint have default values."""
    bare = TWO_LINKS.replace('<origin xyz="0.1 0 0.2" rpy="0 1.57079632679 0"/>', "")
    bare = bare.replace('<axis xyz="0 0 1"/>', "").replace(
        'type="fixed">', 'type="fixed"><axis xyz="0 0 0"/>'
    )
    path.write_text(bare)
    given = dict(read(path).joints[0].given)
    assert [given[f"axis_{c}"] for c in "xyz"] == [1, 0, 0]
    assert given["xyz_x"] == given["rpy_x"] == 0
    path.write_text(bare.replace('lower="-1.5" upper="2"', ""))
    assert read(path).joints[0].limits == (None, None)


@pytest.mark.parametrize(
    ("lower", "upper", "limited"),
    [
        *(("-1e16", "1e16", False), ("-1e4", "0", False), ("-5000", "5000", False)),
        *(("-4999", "5000", True), ("-100", "100", True)),
    ],
)
def test_absurdly_wide_limits_are_dropped(lower, upper, limited):
    text = TWO_LINKS.replace('lower="-1.5" upper="2"', f'lower="{lower}" upper="{upper}"')
    limits = read_text(text, format="urdf").joints[0].limits
    assert limits == ((sp.Integer(int(lower)), sp.Integer(int(upper))) if limited else (None, None))


def test_missing_axis_is_noted():
    robot = read_text(TWO_LINKS.replace('<axis xyz="0 0 1"/>', ""), format="urdf")
    assert "joint turn states no axis; the axis is x, the default of URDF" in robot.notes
    assert not any("axis" in note for note in read_text(TWO_LINKS, format="urdf").notes)


MAX_CALLS = 1000


def test_entities_are_not_expanded(path):
    bomb = '<!DOCTYPE r [<!ENTITY a "aaaaaaaaaa">' + "".join(
        f'<!ENTITY {chr(98 + k)} "{f"&{chr(97 + k)};" * 10}">' for k in range(9)
    )
    in_name = f'{bomb}]>\n<robot name="&j;"><link name="base"/></robot>'
    in_text = f'{bomb}]>\n<robot name="r"><link name="base">&j;</link></robot>'
    unused = f'{bomb}]>\n<robot name="r"><link name="base"/></robot>'
    file = '<!DOCTYPE r [<!ENTITY x SYSTEM "file:///etc/hostname">]><robot name="r">&x;</robot>'
    for text in (in_name, in_text, unused, file):
        message = []

        def attempt(text=text, message=message):
            message.append(wrong(path, text))

        # The XML entity in the URDF would expand to 10^10 characters.
        assert calls_of(attempt) < MAX_CALLS
        assert "expected" in message[0]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", ":1: expected well-formed XML"),
        (b"hello", ":1: expected well-formed XML"),
        (b"<robot name='x'>" + b"<a>" * 50_000, "expected well-formed XML"),
        (b"<robot name='x'>\n\xff</robot>", ":2: expected UTF-8 text"),
        ("<robot name='x'/>".encode("utf-16"), "expected links; the file has no links"),
        (b"<robot name='x'/>", "expected links; the file has no links"),
        (b"<robot name='x'><link name='a'/></robot>", "a link other than the base"),
        (b"<!--" + b"x" * 1_000_000, "at most 1000000 bytes"),
    ],
    ids=[
        "empty",
        "plain text",
        "deep nesting",
        "not utf-8",
        "utf-16",
        "no links",
        "one link",
        "too large",
    ],
)
def test_content_that_is_not_urdf_is_rejected(path, content, words):
    path.write_bytes(content)
    with pytest.raises(DescriptionError) as caught:
        read(path)
    assert words in str(caught.value)


def test_missing_file_or_folder_is_rejected(tmp_path):
    for path in (tmp_path, tmp_path / "none.urdf"):
        with pytest.raises(DescriptionError, match="a readable file"):
            read(path)


def test_explicit_tip_equals_inferred_tip(path):
    path.write_text(TWO_LINKS, encoding="utf-8")
    assert read(path, tip="tool-0") == read(path)
    assert read(path, tip="tool-0").base_frame == "base"


def test_text_of_urdf_equals_its_file(tmp_path):
    path = tmp_path / "arm.urdf"
    path.write_text(TWO_LINKS)
    assert read_text(TWO_LINKS, format="urdf", file=str(path)) == read(path)
