"""Compare the drawing in a serial robot's LaTeX article with the kinematics of the robot."""

import re

import numpy as np
import pytest

from chasles.derive import derive, read_text
from chasles.derive.chain.drawn_configuration import from_aside
from chasles.derive.latex.drawing import DrawnMembers, arm_drawing
from chasles.derive.latex.drawing.paper import HEIGHT, WIDTH, Paper, at
from chasles.derive.latex.drawing.parts import scene
from chasles.derive.latex.drawing.view import view_of_arm
from chasles.derive.terms.casadi_graph import lower
from tests.support.derivations import committed
from tests.support.printed_robots import derived

DRAWN = ("ur5e", "scara", "iiwa14", "photo_robot")
"""Arms with four to seven joints, with and without prismatic joints and limits."""
TRUE = 1e-8
"""Tolerance of drawn points and directions: nine digits relative to the robot's size."""
EDGE = 1
"""Total free margin of a picture on both sides (mm)."""
LARGEST = 8000
"""Maximum size of a figure (byte)."""


def parts(name):
    found = derived(name)
    coordinates = {joint.name: k for k, joint in enumerate(found.robot.coordinates, 1)}
    members = DrawnMembers(coordinates, coordinates)
    return found.skeleton, scene(found.skeleton, found.skeleton.q_drawn, members)


@pytest.mark.parametrize("name", DRAWN)
def test_joints_lie_on_their_screw_axes_and_the_tool_is_at_its_pose(name):
    skeleton, scene = parts(name)
    q = np.array(skeleton.q_drawn)
    functions = [derived(name).function(function) for function in ("fk", "jacobian_space")]
    pose, screws = (np.array(kernel(q)) for kernel in lower(functions, name))
    assert scene.tool.ravel() == pytest.approx(pose.ravel(), abs=1e-12)
    screws = screws.reshape(6, -1)
    seen = set()
    for joint in (*scene.hinges, *scene.slides):
        v, w = np.split(screws[:, joint.coordinate - 1], 2)
        seen.add(joint.coordinate)
        if joint in scene.slides:
            assert np.abs(joint.axis) == pytest.approx(np.abs(v), abs=TRUE)
            continue
        assert joint.axis == pytest.approx(w, abs=TRUE)
        assert np.cross(joint.at, joint.axis) == pytest.approx(v, abs=TRUE)
    assert seen == set(range(1, len(q) + 1))


@pytest.mark.parametrize("name", DRAWN)
def test_the_figure_names_each_coordinate_and_fits_the_page(name):
    skeleton, scene = parts(name)
    text = arm_drawing(derived(name).robot, skeleton)
    assert len(text) < LARGEST
    indices = re.findall(r"\\node\[coordinate name[^\n]*\$q_\{(\d+)\}\$", text)
    assert sorted(map(int, indices)) == list(range(1, len(skeleton.q_drawn) + 1))
    paper = Paper.around(from_aside(), scene.points)
    assert f"\\draw[frame] {at(paper.at(scene.tool[:3, 3]))}" in text
    assert f"\\draw[frame] {at(paper.at(np.zeros(3)))}" in text
    low, high = re.search(r"boundingbox (\S+) rectangle (\S+);", text).groups()
    (left, bottom), (right, top) = (map(float, p[1:-1].split(",")) for p in (low, high))
    assert 0 < right - left <= WIDTH / 10 + EDGE
    assert 0 < top - bottom <= HEIGHT / 10 + EDGE


@pytest.mark.parametrize("name", DRAWN)
def test_drawn_configurations_are_round_and_within_limits(name):
    found = derived(name)
    for value, joint in zip(found.skeleton.q_drawn, found.robot.coordinates, strict=True):
        low, high = joint.limits
        assert low is None or value >= float(low)
        assert high is None or value <= float(high)
        if joint.kind == "revolute" and low is not None and float(low) < -0.3 < 0.3 < float(high):
            assert np.degrees(value) / 15 == pytest.approx(round(np.degrees(value) / 15))


@pytest.mark.parametrize("name", ["scara", "lynxmotion"])
def test_article_contains_the_figure_of_its_robot(name):
    found = derived(name)
    assert committed(name)["drawing.tex"] == arm_drawing(found.robot, found.skeleton)


@pytest.mark.parametrize("length", ["1e-12", "0.3", "1e27"])
def test_the_scale_bar_has_its_length_for_arms_of_any_size(length):
    robot = read_text(
        'name = "arm"\nconvention = "dh"\nunits = { length = "m" }\n'
        + 2 * f"[[joints]]\na = {length}\n"
    )
    skeleton = derive(robot, functions=["fk"]).skeleton
    text = arm_drawing(robot, skeleton)
    start, end, meters = re.search(
        r"\|-\|\] \((\S+),.*\) -- \((\S+),.*\n.*\$(\S+)\\,\\mathrm", text
    ).groups()
    coordinates = {joint.name: k for k, joint in enumerate(robot.coordinates, 1)}
    members = DrawnMembers(coordinates, coordinates)
    paper = Paper.around(
        view_of_arm(skeleton)[0], scene(skeleton, skeleton.q_drawn, members).points
    )
    drawn = float(end) - float(start)
    assert drawn == pytest.approx(float(meters) * paper.scale / 10, abs=0.1)
    assert 15 <= drawn < 40
