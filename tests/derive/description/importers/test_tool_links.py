"""Infer the base and tip links of an arm from a tree of links."""

import random
from itertools import pairwise
from pathlib import Path

import pytest

from chasles.derive import DescriptionError, read
from chasles.derive.description.importers.chains import opened
from chasles.derive.description.importers.kinematic_tree import KinematicTree, TreeJoint
from chasles.derive.description.importers.tool_links import NoChain, chosen_ends, only_chain
from chasles.derive.description.urdf import UrdfFile

KINDS = {"m": "moving", "f": "fixed", "x": "free", "b": "ball", "c": "follower", "s": "moving"}
TREES = 200


def tree(text):
    """Build a tree of links from words such as ``parent>child:m``.

    The default joint name is ``<child>_joint``, and ``a>b:m:name`` sets the name. The kind ``s`` is
    prismatic. For a mimic joint, the word ends with the name of the leader joint:
    ``a>b:c:name:leader``.
    """
    links, joints = [], []
    for word in text.split():
        ends, kind, *names = word.split(":")
        name, leader, *_ = [*names, "", ""]
        parent, child = ends.split(">")
        links += [link for link in (parent, child) if link not in links]
        name = name or f"{child}_joint"
        joints.append(TreeJoint(name, KINDS[kind], parent, child, leader, kind == "s"))
    return KinematicTree(tuple(links), tuple(joints))


def arm(prefix, count, start):
    links = [start, *(f"{prefix}{k}" for k in range(1, count + 1))]
    return " ".join(f"{a}>{b}:m" for a, b in pairwise(links))


PANDA = f"""{arm("panda_link", 7, "panda_link0")} panda_link7>panda_link8:f panda_link8>panda_hand:f
panda_hand>panda_leftfinger:m:panda_finger_joint1
panda_hand>panda_rightfinger:c:panda_finger_joint2 panda_hand>camera_link:f panda_link0>sc0:f"""
UR = f"""world>base_link:f base_link>base:f base_link>inertia:f {arm("link", 6, "inertia")}
link6>ft_frame:f link6>flange:f flange>tool0:f tool0>camera_mount:f camera_mount>camera_optical:f
tool0>robotiq_base:f robotiq_base>left_outer:m:finger_joint robotiq_base>right_outer:c:mimic1"""
PALM = f"""base_link>torso:m {arm("arm", 6, "torso")} arm6>palm_link:f palm_link>a1:m:a1 a1>a2:m:a2
palm_link>b1:m:b1 b1>b2:m:b2 torso>head1:m head1>head2:m head2>camera:f base_link>wheel:m"""
LONG_FINGERS = f"""{arm("arm", 7, "base")} arm7>palm:f palm>thumb1:m {arm("t", 5, "thumb1")}
{arm("index", 6, "palm")} {arm("ring", 6, "palm")}"""
TWO = f"""base>body:f {arm("left", 7, "body")} {arm("right", 7, "body")} left7>left_tool0:f
right7>right_tool0:f body>head:m"""
LEGGED = f"world>trunk:x {arm('a', 3, 'trunk')} {arm('b', 5, 'trunk')} b5>b_ee:f"
COUPLED = f"{arm('l', 4, 'base')} l4>l5:c"
NO_NAME = f"{arm('l', 5, 'base')} l5>camera_a:f l5>imu:f l5>plate:f"
TWO_PLATES = f"{arm('l', 5, 'base')} l5>plate_a:f l5>plate_b:f"


@pytest.mark.parametrize(
    ("text", "base", "tip"),
    [
        (PANDA, "panda_link0", "panda_hand"),
        (UR, "world", "tool0"),
        (PALM, "base_link", "palm_link"),
        (LONG_FINGERS, "base", "palm"),
        (LEGGED, "trunk", "b_ee"),
        (COUPLED, "base", "l5"),
        (NO_NAME, "base", "plate"),
        (TWO_PLATES, "base", "l5"),
        (UR.replace("tool0>camera_mount:f", "tool0>tcp:f tool0>camera_mount:f"), "world", "tool0"),
        (
            PANDA.replace("panda_hand>camera_link:f", "panda_hand>panda_hand_tcp:f"),
            "panda_link0",
            "panda_hand_tcp",
        ),
        (NO_NAME.replace("camera_a", "arm_end_link"), "base", "arm_end_link"),
        (arm("l", 2, "base"), "base", "l2"),
        (arm("l", 3, "base") + " l3>ball:x", "base", "l3"),
        (arm("l", 3, "base") + " l3>ball:x " + arm("m", 4, "ball"), "ball", "m4"),
    ],
    ids=[
        "panda",
        "ur",
        "palm",
        "long fingers",
        "legged",
        "coupled",
        "unnamed plate",
        "two plates",
        "ur tcp",
        "panda tcp",
        "arm end link",
        "two joints",
        "free ball",
        "free base",
    ],
)
def test_base_and_tip_are_inferred_from_typical_trees(text, base, tip):
    ends = only_chain(tree(text), None, None)
    assert (ends.base, ends.tip) == (base, tip)


def test_note_lists_alternative_tip_links():
    found = only_chain(tree(NO_NAME), None, None)
    assert found.notes == ("tip: plate; also there: camera_a, imu",)
    assert only_chain(tree(arm("l", 3, "base")), None, None).notes == ()
    many = arm("l", 2, "b") + "".join(f" b>s{k}:f" for k in range(9))
    assert only_chain(tree(many), None, None).notes[0].endswith("s4, s5 and 3 more")


JAWS = f"{arm('l', 3, 'base')} l3>a:s:left l3>b:s:right"
MIMIC_JAWS = f"{arm('l', 2, 'base')} l2>a:m:drive l2>b:c:other:drive"
ON_A_GRIPPER = f"{arm('l', 3, 'base')} l3>gripper_body:f gripper_body>pad:m:j4"
SWERVE = " ".join(f"base>s{k}:m s{k}>w{k}:m:drive_wheel_{k}" for k in range(4))
ROPE = f"{arm('l', 2, 'base')} l2>rod:b"


@pytest.mark.parametrize(
    ("text", "tip", "note"),
    [
        (JAWS, "l3", "fingers left, right (--tip a includes left)"),
        (MIMIC_JAWS, "l2", "fingers drive (--tip a includes drive)"),
        (ON_A_GRIPPER, "gripper_body", "fingers j4 (--tip pad includes j4)"),
        (PANDA, "panda_hand", "fingers panda_finger_joint1 (--tip panda_leftfinger includes"),
        (
            f"{SWERVE} base>a1:m a1>x:s a1>y:s",
            "a1",
            "wheels s0_joint, s1_joint, s2_joint, s3_joint; fingers x",
        ),
        (f"{arm('l', 2, 'base')} base>w:m:caster", "l2", "wheels caster (--tip w includes caster)"),
        (f"{arm('l', 2, 'base')} l2>front_wheel:m", "l2", "wheels front_wheel_joint"),
        (f"{arm('l', 4, 'base')} l4>a:m l4>b:m", "l4", "short branches a_joint, b_joint (--tip a"),
        (ROPE, "l2", "ball joints rod_joint"),
    ],
    ids=[
        "sliding jaws",
        "mimic jaws",
        "on a gripper",
        "panda",
        "swerve",
        "caster",
        "wheel link",
        "branches",
        "ball",
    ],
)
def test_fingers_wheels_and_rods_are_left_out_with_a_note(text, tip, note):
    found = only_chain(tree(text), None, None)
    assert found.tip == tip
    assert any(line.startswith(f"not part of the arm: {note}") for line in found.notes)
    assert only_chain(tree(text), found.base, tip).notes == ()


def test_joints_of_arms_are_not_taken_for_fingers_or_wheels():
    for text, tip in (
        (f"{arm('l', 2, 'base')} l2>tool0:s l2>camera:s", None),
        (f"{arm('l', 2, 'wheelchair_base')} l2>bent:c:follower:l1_joint", "bent"),
        (f"claw_machine>x1:s x1>y1:s {arm('z', 2, 'y1')}", "z2"),
        (f"base>lift:s lift>w:f {arm('l', 3, 'w')} w>wheel_l:m", "l3"),
    ):
        found = chosen_ends(tree(text), None, None)
        assert [ends.tip for ends in found] == ([tip] if tip else ["tool0", "camera"]), text


def test_wheels_alone_are_no_arm():
    for text, words in (
        (f"base>l:m:left_wheel base>r:m:right_wheel {SWERVE}", "only wheels move: left_wheel"),
        ("odom>base:x base>l:m:left_wheel base>r:m:right_wheel", r"\(only wheels move: left_wheel"),
        (f"{SWERVE} base>a:m:thumb base>b:m:finger", "; fingers move: thumb, finger"),
        (f"{SWERVE} base>a:s base>b:s base>c:s", "chains of equal length end at a, b, c"),
    ):
        with pytest.raises(NoChain, match=words):
            only_chain(tree(text), None, None)


def test_joints_before_an_inferred_base_are_noted():
    lifted = tree(f"world>lift:m lift>trunk:x {arm('l', 3, 'trunk')}")
    for tip in (None, "l3", "l1"):
        found = only_chain(lifted, None, tip)
        note = "base: trunk, the child of the floating or planar joint trunk_joint"
        assert found.base == "trunk"
        assert f"{note}; left out before it: lift_joint" in found.notes
    assert only_chain(lifted, "trunk", "l3").notes == ()
    hint = "to exclude this joint, use --base trunk or --tip lift"
    with pytest.raises(NoChain, match=hint):
        only_chain(lifted, "world", "l3")


def test_ball_joint_between_base_and_tip_is_refused():
    delta = tree(f"base>crank:m crank>rod:b {arm('wrist', 2, 'rod')} base>plate:m")
    for tip in (None, "wrist2"):
        with pytest.raises(
            NoChain, match=r"not a ball joint \(.*--base rod or --tip crank"
        ) as caught:
            only_chain(delta, None, tip)
        assert caught.value.value == "rod_joint"
    assert only_chain(delta, "rod", None).tip == "wrist2"


def test_two_arm_tree_yields_a_robot_per_arm():
    found = chosen_ends(tree(TWO), None, None)
    assert [(ends.base, ends.tip) for ends in found] == [
        ("base", "left_tool0"),
        ("base", "right_tool0"),
    ]
    with pytest.raises(NoChain, match="chains of equal length end at left_tool0, right_tool0"):
        only_chain(tree(TWO), None, None)
    assert only_chain(tree(TWO), "base", "right_tool0").notes == ()


def test_missing_end_is_inferred_and_invalid_ends_are_rejected():
    assert only_chain(tree(UR), "base_link", None).base == "base_link"
    assert only_chain(tree(LEGGED), None, "a3").base == "trunk"
    assert only_chain(tree(UR), None, "ft_frame").base == "world"
    for base, tip, words in (
        ("tool0", "tool0", "other than the base"),
        ("tool0", None, "only fingers move: finger_joint"),
        ("tol0", None, "such as tool0"),
    ):
        with pytest.raises(NoChain, match=words):
            only_chain(tree(UR), base, tip)
    with pytest.raises(NoChain, match="a joint that moves, or a choice"):
        only_chain(tree("a>b:f a>c:f"), None, None)
    finger = only_chain(tree("base>a:m:finger_1 a>b:m:finger_2"), None, None)
    assert (finger.base, finger.tip) == ("base", "b")
    jaws = tree("base>l:m:left_jaw base>r:m:right_jaw")
    with pytest.raises(NoChain, match=r"only fingers move: left_jaw, right_jaw"):
        only_chain(jaws, None, None)


def random_tree(dice):
    """Return a random link tree with an arm and other branches, and the arm's base and tip."""
    count = dice.randint(4, 7)
    words = [arm("j", count, "base")]
    tool = dice.choice(("tool0", "my_tcp", "left_ee_link", "flange", "gripper/tool_frame"))
    words.append(f"j{count}>mount:f mount>{tool}:f")
    for k in range(dice.randint(0, 5)):
        at = dice.choice(("base", "mount", tool, *(f"j{n}" for n in range(1, count + 1))))
        words.append(
            dice.choice(
                (
                    f"{at}>camera{k}:f camera{k}>optical{k}:f",
                    f"{at}>plate{k}:f",
                    f"base>head{k}:m",
                    f"base>wheel{k}:m",
                    f"{tool}>hand{k}x:f hand{k}x>l{k}:m:left_finger{k} hand{k}x>r{k}:c:right{k}",
                    f"mount>grip{k}:f grip{k}>k{k}:m:drive{k} grip{k}>n{k}:m:other{k}",
                    f"mount>jaw{k}:m:gripper_jaw{k}",
                )
            )
        )
    parts = " ".join(words).split()
    dice.shuffle(parts)
    return tree(" ".join(parts)), "base", tool


def test_base_and_tip_are_inferred_from_random_trees():
    for seed in range(TREES):
        made, base, tip = random_tree(random.Random(seed))
        found = only_chain(made, None, None)
        assert (found.base, found.tip) == (base, tip), seed


def test_tip_is_inferred_for_chains_of_hundreds_of_links():
    found = only_chain(tree(arm("l", 480, "base")), None, None)
    assert found.tip == "l480"
    rigid = " ".join(f"r{k}>r{k + 1}:f" for k in range(480)) + " r480>last:m"
    assert only_chain(tree(rigid), None, None).tip == "last"


def test_cyclic_or_oversized_trees_require_a_tip():
    circle = KinematicTree(
        ("a", "b"), (TreeJoint("1", "moving", "a", "b"), TreeJoint("2", "moving", "b", "a"))
    )
    for made, base in ((circle, "a"), (tree(arm("l", 600, "base")), None)):
        with pytest.raises(NoChain, match="a tip link"):
            only_chain(made, base, None)


def test_two_arm_urdf_requires_a_tip(tmp_path):
    parts = ["<robot name='two'><link name='body'/>"]
    for side in ("left", "right"):
        parts.append(
            f"<link name='{side}'/><joint name='{side}_turn' type='continuous'>"
            f"<parent link='body'/><child link='{side}'/></joint>"
        )
    path = tmp_path / "two.urdf"
    path.write_text("".join([*parts, "</robot>"]))
    with pytest.raises(DescriptionError, match="equal length end at left, right"):
        read(path)
    assert read(path, tip="right").tool_frame == "right"
    assert len(UrdfFile(str(path), path.read_text()).ends(None, None)) == 2


@pytest.mark.parametrize(
    ("file", "base", "tips"),
    [
        ("abb_irb140_description/urdf/irb140.urdf", "base_link", ["tool0"]),
        ("kuka_description/kuka_kr10/urdf/kr10r1100sixx.xacro", "base_link", ["tool0"]),
        ("lynxmotion_al5d_description/urdf/al5d_robot.urdf", "base", ["link4"]),
        ("qut_frankie_description/robots/panda_arm_hand.urdf.xacro", "panda_link0", ["panda_hand"]),
        (
            "qut_frankie_description/robots/dual_panda_example.urdf.xacro",
            "base",
            ["panda_1_hand", "panda_2_hand"],
        ),
        ("trossen_descriptions/urdf/wx250s.urdf.xacro", "/base_link", ["/ee_gripper_link"]),
        ("unimation_puma560_description/urdf/puma560_robot.urdf.xacro", "link1", ["link7"]),
    ],
    ids=["irb140", "kr10", "al5d", "panda", "dual panda", "wx250s", "puma560"],
)
def test_ends_of_published_urdf_files_are_inferred(file, base, tips):
    data = pytest.importorskip("rtbdata", reason="files of real robots need the extra `crosscheck`")
    path = Path(next(iter(data.__path__))) / "xacro" / file
    found = opened(path).ends(None, None)
    assert [(ends.base, ends.tip) for ends in found] == [(base, tip) for tip in tips]
