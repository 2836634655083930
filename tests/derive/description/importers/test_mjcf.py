"""MJCF import agrees with MuJoCo on random models. Invalid models raise errors."""

import random

import numpy as np
import pytest
import sympy as sp

from chasles.derive import Coupling, DescriptionError, derive, read
from chasles.derive.terms.casadi_graph import lower
from tests.support.command_line import run
from tests.support.mjcf_models import oracle, poses_of, random_model, read_model, wrong
from tests.support.tolerances import ORACLE

MODELS, POSES = 3, 2


@pytest.fixture
def path(tmp_path):
    return tmp_path / "model.xml"


def compare(path, seed):
    dice = random.Random(seed)
    text, count = random_model(dice)
    robot = read_model(path, text, "world", f"s{count}")
    fk, links = lower(derive(robot, functions=("fk", "link_poses")).functions, "r")
    model = oracle(text)
    checked = 0
    for _ in range(POSES):
        q = np.array([dice.uniform(-2, 2) for _ in robot.coordinates])
        names = [joint.name for joint in robot.coordinates]
        expected = poses_of(model, dict(zip(names, q, strict=True)))
        tool = np.array(fk(q)).reshape(4, 4)
        assert np.abs(tool - expected[f"s{count}"]).max() <= ORACLE, seed
        for name, pose in zip(robot.link_names, np.array(links(q)).reshape(-1, 4, 4), strict=True):
            if name in expected:
                assert np.abs(pose - expected[name]).max() <= ORACLE, (seed, name)
                checked += 1
    return text, checked


def test_random_mjcf_models_match_mujoco_link_poses(path):
    words = ("ref", "range", "<frame", "pos=", "slide", "euler", "quat")
    texts, counts = zip(*(compare(path, seed) for seed in range(MODELS)), strict=True)
    assert sum(counts) > MODELS * POSES * 2
    assert min(sum(word in text for text in texts) for word in words) >= 1


ARM = """\
<mujoco model="arm">
<worldbody><body name="base"><body name="link"><joint name="turn" range="-30 30"/>
<geom size="0.1"/><body name="hand" pos="0 0 1"><joint name="slide" type="slide"/>
<geom size="0.1"/></body></body></body>
<body name="free"><freejoint name="drift"/><geom size="0.1"/><body name="leg"><joint name="hip"/>
<geom size="0.1"/></body></body></worldbody>
</mujoco>
"""


def test_mjcf_import_keeps_names_limits_and_notes(path):
    robot = read_model(path, ARM)
    assert (robot.name, robot.base_frame, robot.tool_frame) == ("arm", "world", "hand")
    assert [(joint.name, joint.kind) for joint in robot.joints] == [
        ("base_mount", "fixed"),
        ("turn", "revolute"),
        ("slide", "prismatic"),
    ]
    assert robot.joints[1].limits == (-sp.pi / 6, sp.pi / 6)
    assert robot.joints[2].limits == (None, None)
    assert robot.notes == (
        "tip: hand; also there: leg",
        "the file states no limits for joint slide, which is unlimited",
    )
    leg = read_model(path, ARM, tip="leg")
    assert leg.base_frame == "free"
    assert "base: free, the child of the floating or planar joint drift" in leg.notes
    assert read_model(path, ARM.replace(' model="arm"', "")).name == "model"
    noisy = ARM.replace('name="hand" pos', 'name="hand" euler="0 0 30.00000001" pos')
    assert any("joint slide: y = 0.523598775" in note for note in read_model(path, noisy).notes)


def test_joint_equality_becomes_coupling_and_site_becomes_tip(path):
    law = (
        '<equality><joint joint1="slide" joint2="turn" polycoef="0.1 2 0 0 0"/></equality></mujoco>'
    )
    robot = read_model(path, ARM.replace("</mujoco>", law), tip="hand")
    assert [joint.name for joint in robot.coordinates] == ["turn"]
    assert robot.couplings == (Coupling("slide", (("turn", 2),), "0.1"),)
    bent = law.replace("0.1 2 0", "0.1 2 1")
    message = wrong(path, ARM.replace("</mujoco>", bent))
    assert "joint 'slide' is coupled to 'turn' by an equality" in message
    site = ARM.replace('name="hand" pos="0 0 1">', 'name="hand"><site name="tcp" pos="0 0 0.2"/>')
    assert read_model(path, site).tool_frame == "tcp"


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("<geom size", "<geon size", "unrecognized element; Element 'geon', line"),
        ("<geom size", "<ge:om size", "unrecognized element; Element 'ge:om', line"),
        ("</mujoco>", "", "expected well-formed XML"),
        ('type="slide"', 'type="screw"', ":3: expected MJCF that MuJoCo reads"),
        ('name="slide"', 'name="turn"', "repeated name 'turn' in joint"),
        ("<mujoco", "<mujoko", "expected well-formed XML"),
        ("</mujoco>", '<include file="none.xml"/></mujoco>', "none.xml"),
        (
            'name="hand" pos="0 0 1"',
            'name="hand" pos="nan 0 1"',
            "<body> pos: expected finite numbers",
        ),
    ],
    ids=[
        "element",
        "unknown element with a prefix",
        "truncated",
        "joint type",
        "repeated name",
        "root element",
        "missing include",
        "not finite",
    ],
)
def test_invalid_mjcf_raises_specific_error(path, old, new, words):
    assert words in wrong(path, ARM.replace(old, new))


def test_unsupported_mjcf_joints_and_loops_are_rejected(path):
    ball = ARM.replace('name="turn" range="-30 30"', 'name="turn" type="ball"')
    for base in ("world", None):
        message = wrong(path, ball, base, "hand")
        assert "between base and tip, not a ball joint" in message
        hint = "(to exclude this joint, use --base link or --tip base), found 'turn'"
        assert hint in message
    message = wrong(path, ARM, "world", "leg")
    assert "not a floating or planar joint" in message
    assert "found 'drift'" in message
    assert "such as hand" in wrong(path, ARM, tip="hant")
    loop = '<equality><connect name="pin" body1="hand" anchor="0 0 0"/></equality></mujoco>'
    assert "have no actuator" in wrong(path, ARM.replace("</mujoco>", loop), tip="hand")
    elsewhere = loop.replace('body1="hand"', 'body1="hand" body2="free"')
    drive = '<actuator><motor joint="turn"/></actuator><equality>'
    text = ARM.replace("</mujoco>", elsewhere.replace("<equality>", drive))
    carrying = read_model(path, text, tip="hand")
    with pytest.raises(DescriptionError, match="slide, drift_x, drift_y, drift_z, drift_yaw"):
        derive(carrying)
    side = loop.replace('body1="hand"', 'body1="free"')
    robot = read_model(path, ARM.replace("</mujoco>", side), tip="hand")
    assert "pin: not on the path to the tip" in robot.notes


def test_weld_to_mocap_body_closes_no_loop(path):
    text = ARM.replace("<worldbody>", '<worldbody><body name="target" mocap="true"/>')
    weld = '<equality><weld body1="hand" body2="target"/></equality></mujoco>'
    assert read_model(path, text.replace("</mujoco>", weld), tip="hand").tool_frame == "hand"


def test_default_namespace_of_mjcf_is_accepted(path):
    spaced = ARM.replace("<mujoco", '<mujoco xmlns="http://www.mujoco.org"')
    assert read_model(path, spaced) == read_model(path, ARM)
    message = wrong(path, spaced.replace('pos="0 0 1"', 'pos="nan 0 1"'))
    assert "<body> pos: expected finite numbers" in message


def test_urdf_with_xml_suffix_is_recognized(path):
    text = (
        '<?xml version="1.0"?><!-- <mujoco> --><robot name="u"><link name="a"/><link name="b"/>'
        '<joint name="j" type="continuous"><parent link="a"/><child link="b"/></joint></robot>'
    )
    path.write_text(text)
    assert read(path).name == "u"


def test_change_of_included_file_triggers_derivation(path):
    inner = path.with_name("hand.xml")
    inner.write_text('<mujocoinclude><site name="tcp" pos="0 0 0.3"/></mujocoinclude>')
    path.write_text(ARM.replace('pos="0 0 1">', 'pos="0 0 1"><include file="hand.xml"/>'))
    words = [path, "--to", path.parent / "out", "--tip", "tcp", "--functions", "fk", "--jobs", "1"]
    assert "1 robot written" in run("derive", *words).output
    assert "nothing to derive" in run("derive", *words).output
    inner.write_text(inner.read_text().replace("0.3", "0.4"))
    assert "1 robot written" in run("derive", *words).output
