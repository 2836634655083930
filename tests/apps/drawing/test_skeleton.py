"""Body poses agree with the robot's functions and with Pinocchio."""

import itertools
import json
import random
from dataclasses import replace

import numpy as np
import pytest

import chasles
from chasles import ManifestError
from chasles.contract import SkeletonFacts
from chasles.contract.bodies import check_bodies
from chasles.contract.records import Place, read
from chasles.drawing import skeleton
from tests.support.chains import random_chain
from tests.support.counting import calls_of
from tests.support.derivations import MECHANISMS
from tests.support.robot_stand_in import RobotStandIn
from tests.support.skeletons import described_skeleton

TRUE = 1e-12
CLOSED = 1e-9
"""Tolerance of poses."""
ROBOTS = chasles.robots()


def configurations(robot, n, seed=0):
    generator = np.random.default_rng(seed)
    low = np.where(np.isfinite(robot.lower), robot.lower, -1.0)
    high = np.where(np.isfinite(robot.upper), robot.upper, 1.0)
    if robot.reference is None:
        return generator.uniform(low, high, (n, robot.n))
    near = 0.05 * (high - low) * generator.uniform(-1, 1, (n, robot.n))
    return np.array(robot.reference.q) + near


def moved(T, point):
    return np.einsum("...ij,j->...i", T[..., :3, :3], np.array(point)) + T[..., :3, 3]


@pytest.mark.parametrize("name", ROBOTS)
def test_skeleton_poses_match_fk_and_link_poses(name):
    robot = chasles.load(name)
    bodies, q = skeleton(robot), configurations(robot, 40)
    poses, T = bodies.poses(q), robot.fk(q)
    closed = np.isfinite(T).all((1, 2))
    assert closed.sum() >= 20
    assert np.abs(bodies.tip_poses(poses) - T)[closed].max() < TRUE
    names = [body.name for body in bodies.bodies]
    links = robot.link_poses(q)
    for k, link in enumerate(robot.link_names):
        own = poses[:, names.index(link)]
        assert np.abs(own - links[:, k])[closed].max() < TRUE, link


@pytest.mark.parametrize("name", MECHANISMS)
def test_skeleton_closes_pins_and_keeps_strut_lengths(name):
    robot = chasles.load(name)
    bodies, q = skeleton(robot), configurations(robot, 40)
    z = robot.configuration(q)
    poses = bodies.poses(q)
    closed = np.isfinite(z).all(1)
    pins = {}
    for k, body in enumerate(bodies.bodies):
        for shape in body.shapes:
            if shape.kind == "pin":
                pins.setdefault(shape.name, []).append(moved(poses[:, k], shape.points[0]))
    for pin, ends in pins.items():
        assert len(ends) == 2
        assert np.abs(ends[0] - ends[1])[closed].max() < CLOSED, pin
    variables = [variable.name for variable in robot.configuration_variables]
    struts = [body for body in bodies.bodies if body.span and not body.span.from_end]
    for body in struts:
        a, b = (
            moved(poses[:, k], end) for k, end in zip(body.span.bodies, body.span.ends, strict=True)
        )
        length = np.linalg.norm(b - a, axis=1)[closed]
        if body.span.name in variables:
            length = length - z[closed, variables.index(body.span.name)]
        else:
            assert length == pytest.approx(body.shapes[0].points[1][2], abs=CLOSED)
        assert np.ptp(length) < CLOSED, body.name
    assert {*robot.loops} >= {*pins, *(body.span.name for body in struts)}


@pytest.mark.parametrize("name", ["excavator", "stewart_gough", "delta"])
def test_strut_frames_are_aligned_with_strut(name):
    robot = chasles.load(name)
    bodies, q = skeleton(robot), configurations(robot, 10)
    poses = bodies.poses(q)
    checked = 0
    for k, body in enumerate(bodies.bodies):
        if body.span is None:
            continue
        a, b = (
            moved(poses[:, m], end) for m, end in zip(body.span.bodies, body.span.ends, strict=True)
        )
        along = (b - a) / np.linalg.norm(b - a, axis=1, keepdims=True)
        assert poses[:, k, :3, 2] == pytest.approx(along, abs=TRUE)
        assert poses[:, k, :3, 3] == pytest.approx(b if body.span.from_end else a, abs=TRUE)
        R = poses[:, k, :3, :3]
        assert R @ R.swapaxes(1, 2) == pytest.approx(np.tile(np.eye(3), (10, 1, 1)), abs=TRUE)
        assert np.linalg.det(R) == pytest.approx(1)
        checked += 1
    assert checked >= 6


def test_random_chains_agree_with_pinocchio():
    pin = pytest.importorskip("pinocchio")
    generator, numbers = random.Random(5), np.random.default_rng(5)
    kinds = set()
    while len(kinds) < 4:
        chain = random_chain(generator, generator.randint(2, 8))
        robot = chain.robot()
        bodies = described_skeleton(robot)
        kinds |= {joint.kind for joint in robot.joints}
        q = numbers.uniform(-3, 3, len(robot.coordinates))
        model, frames = chain.pinocchio()
        data = model.createData()
        values = np.array([float(v) for v in robot.joint_values(list(map(float, q)))])
        pin.framesForwardKinematics(model, data, values)
        poses = bodies.poses(q)
        found = [*poses[1:], bodies.tip_poses(poses)]
        for T, frame in zip(found, frames, strict=True):
            assert np.abs(T - data.oMf[frame].homogeneous).max() < 1e-11
    assert kinds == {"revolute", "prismatic", "helical", "fixed"}


def test_skeleton_poses_accept_batches_and_seeds():
    robot = chasles.load("stewart_gough")
    bodies, q = skeleton(robot), configurations(robot, 6)
    poses = bodies.poses(q.reshape(2, 3, robot.n))
    assert poses.shape == (2, 3, len(bodies.bodies), 4, 4)
    assert poses.reshape(6, -1, 4, 4) == pytest.approx(bodies.poses(q))
    seeded = bodies.poses(q, z_seed=robot.configuration(q))
    assert seeded == pytest.approx(bodies.poses(q), abs=CLOSED)
    assert bodies.poses_from_configuration(robot.configuration(q)) == pytest.approx(bodies.poses(q))


@pytest.mark.parametrize("name", ["ur5e", "excavator", "stewart_gough", "board_installer"])
def test_poses_of_many_configurations_take_as_many_calls_as_of_few(name):
    robot = chasles.load(name)
    bodies, few, many = skeleton(robot), configurations(robot, 8), configurations(robot, 80)
    bodies.poses(few)
    calls = calls_of(lambda: bodies.poses(few))
    assert calls == calls_of(lambda: bodies.poses(many))
    assert calls < 300


@pytest.mark.parametrize("name", ROBOTS)
def test_skeleton_bodies_form_tree_with_finite_shapes(name):
    bodies = skeleton(chasles.load(name))
    assert bodies.bodies[0].parent is None
    names = [body.name for body in bodies.bodies]
    assert len(names) == len(set(names))
    for k, body in enumerate(bodies.bodies[1:], 1):
        assert (body.joint is None) != (body.span is None)
        assert body.parent is None or body.parent < k
        for shape in body.shapes:
            assert np.isfinite(shape.points).all()
            assert not shape.axis or np.linalg.norm(shape.axis) == pytest.approx(1)
    robot = chasles.load(name)
    drawn = [bodies.actuator(body.joint) for body in bodies.bodies]
    cylinders = {body.span.name for body in bodies.bodies if body.span and body.span.from_end}
    assert len([k for k in drawn if k is not None]) + len(cylinders) >= robot.n
    assert bodies.q_drawn.shape == (robot.n,)
    assert np.isfinite(bodies.poses(bodies.q_drawn)).all()
    within = (bodies.q_drawn >= robot.lower) & (bodies.q_drawn <= robot.upper)
    assert within.all()


def test_manifest_without_skeleton_is_rejected():
    robot = chasles.load("ur5e")
    manifest = replace(robot.manifest, skeleton=None)
    with pytest.raises(ManifestError, match="the manifest has no skeleton"):
        skeleton(RobotStandIn(manifest=manifest, folder=robot.folder, name=robot.name))


def test_symbols_of_adjacent_joints_are_separated():
    checked = 0
    for name in ("ur5e", "puma560", "iiwa14", "panda"):
        robot = chasles.load(name)
        bodies = skeleton(robot)
        poses = bodies.poses(bodies.q_drawn)
        at = [
            moved(T, shape.points[0])
            for body, T in zip(bodies.bodies, poses, strict=True)
            for shape in body.shapes
            if shape.kind == "revolute"
        ]
        for a, b in itertools.pairwise(at):
            assert np.linalg.norm(a - b) > 0.02 * bodies.size
            checked += 1
    assert checked > 20


WRONG = (
    (lambda s: s["bodies"][1].update(parent=1), r"bodies\[1\].parent.*an index below 1"),
    (lambda s: s["bodies"][2]["joint"].update(coordinate=6), "joint.coordinate.*below 6"),
    (lambda s: s["bodies"][2]["joint"].update(kind="rubber"), 'joint.kind.*"revolute"'),
    (lambda s: s["bodies"][0].update(s["bodies"][1]), "bodies.*the ground first"),
    (lambda s: s["bodies"][1].pop("joint"), r"bodies\[1\].*a joint or a span"),
    (lambda s: s["tip"].update(body=99), "tip.body.*an index below 7"),
    (lambda s: s["tip"]["placement"].pop(), "tip.placement.*three rows of four numbers"),
    (lambda s: s["bodies"][2]["shapes"][0].update(points=[[0, 1]]), "points.*three numbers"),
    (lambda s: s.pop("size"), "has no 'size'"),
    (lambda s: s.update(q_drawn=[0.0]), "q_drawn.*6 numbers"),
)


@pytest.mark.parametrize(
    ("change", "message"),
    WRONG,
    ids=[
        "own parent",
        "coordinate out of range",
        "unknown joint kind",
        "base with parent",
        "neither joint nor span",
        "tip out of range",
        "short placement",
        "two-dimensional point",
        "size missing",
        "short configuration",
    ],
)
def test_invalid_skeleton_entry_in_manifest_is_rejected(change, message):
    manifest = chasles.load("ur5e").folder / "manifest.json"
    entry = json.loads(manifest.read_text(encoding="utf-8"))["skeleton"]
    place = Place(manifest, "skeleton")
    found = read(SkeletonFacts, entry, place)
    assert found.tip.body == 6
    check_bodies(found, 6, place)
    change(entry)
    with pytest.raises(ManifestError, match=message):
        check_bodies(read(SkeletonFacts, entry, place), 6, place)
