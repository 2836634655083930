"""Drawings: positions of shapes, number of branches, and label overlaps."""

import functools
import itertools
import random
import xml.etree.ElementTree as ET

import numpy as np
import pytest

import chasles
from chasles.derive import read
from chasles.drawing import skeleton
from chasles.drawing.figure import figure_of, other_inverses
from chasles.drawing.marks import hull, marks
from chasles.drawing.scene import _sides, corners, scenes
from chasles.drawing.views import AXONOMETRIC, SPATIAL, plane_of, views_of
from chasles.errors import InputValueError, ShapeError
from tests.support.chains import random_chain
from tests.support.derivations import NAMES as SERIAL
from tests.support.derivations import description
from tests.support.fixed import fixed_at
from tests.support.optional import requires
from tests.support.skeletons import described_skeleton

pytestmark = requires("matplotlib")

TRUE = 1e-9
"""The points of shapes are rounded to nine digits."""
ROBOTS = chasles.robots()
PLANAR = {"bricklaying_planar", "five_bar", "four_bar", "planar_3rrr", "slider_crank"}
CROWDED = ("photo_robot", "excavator", "planar_3rrr", "stewart_gough")
"""One robot of each kind: with a fixed joint, cylinders, planar loops, and spatial struts."""


def shown(bodies, views=None, q=None, ghosts=None, path=None):
    poses = bodies.poses(bodies.q_drawn if q is None else q)
    none = np.empty((0, *poses.shape))
    found = views_of(bodies, poses, views)
    pale = none if ghosts is None else bodies.poses(ghosts)
    return poses, scenes(bodies, poses, pale, path, found)


@functools.cache
def first_scenes(name):
    bodies = skeleton(chasles.load(name))
    return bodies, *shown(bodies)


def lettered(bodies):
    poses = bodies.poses(bodies.q_drawn)
    names = ("plane",) if plane_of(bodies, poses) else ("axonometric",)
    return figure_of(shown(bodies, names)[1], (), has_path=False)


def letters(figure):
    """Return the label boxes inside the axes of a figure [pixels]."""
    renderer = figure.canvas.get_renderer()
    texts = [text for ax in figure.axes for text in ax.texts if text.get_text()]
    return [(text.get_text(), text.get_window_extent(renderer)) for text in texts]


def overlaps(figure):
    return [
        (a, b)
        for (a, own), (b, other) in itertools.combinations(letters(figure), 2)
        if min(own.x1, other.x1) - max(own.x0, other.x0) > 0.5
        and min(own.y1, other.y1) - max(own.y0, other.y0) > 0.5
    ]


@pytest.mark.parametrize("name", SERIAL)
def test_link_ends_match_fk_joint_positions(name):
    robot = chasles.load(name)
    bodies = skeleton(robot)
    generator = np.random.default_rng(3)
    q = generator.uniform(-1, 1, robot.n)
    links = robot.link_poses(q)
    _, found = shown(bodies, ("front", "side", "top", "axonometric"), q)
    index = {link: k for k, link in enumerate(robot.link_names)}
    checked = 0
    for scene in found:
        for body in bodies.bodies[1:]:
            for shape in body.shapes:
                if shape.kind != "link":
                    continue
                T = links[index[body.name]]
                ends = np.array([T[:3, :3] @ p + T[:3, 3] for p in np.array(shape.points)])
                expected = scene.view.project(ends)
                own = [m.points for m in scene.marks if (m.style, m.name) == ("link", body.name)]
                assert any(np.allclose(points, expected, atol=TRUE) for points in own)
                checked += 1
    assert checked >= 8
    tip = robot.fk(q)[:3, 3]
    for scene in found:
        assert scene.frames[1].origin == pytest.approx(scene.view.project(tip), abs=TRUE)


@pytest.mark.parametrize("name", ROBOTS)
def test_all_marks_lie_inside_view_box(name):
    bodies, poses, found = first_scenes(name)
    for scene in found:
        low, high = scene.box
        for points in (
            scene.view.project(corners(bodies, poses)),
            *(m.points for m in scene.marks),
        ):
            assert (points >= low).all()
            assert (points <= high).all()
        styles = [mark.style for mark in scene.marks]
        assert "driven" in styles or "driven barrel" in styles
        depths = [mark.depth for mark in scene.marks]
        assert depths == sorted(depths)


def test_only_planar_robots_are_drawn_in_their_plane():
    planar = set()
    for name in ROBOTS:
        bodies, poses, found = first_scenes(name)
        if [scene.view.name for scene in found] == ["plane"]:
            planar.add(name)
            normal = found[0].view.rows[2]
            heights = corners(bodies, poses) @ normal
            assert np.ptp(heights) < TRUE
        else:
            assert [scene.view for scene in found] == list(SPATIAL)
    assert planar == PLANAR


def test_planar_dimensions_match_description_lengths():
    robot = chasles.load("four_bar")
    (scene,) = shown(skeleton(robot))[1]
    lengths = sorted(round(dimension.length, 9) for dimension in scene.dimensions)
    expected = [parameter.value for parameter in robot.parameters.values()]
    named = {0.1, 0.3, 0.25, 0.35}
    assert named <= {round(value, 9) for value in expected}
    assert named <= set(lengths)
    texts = {text for text, _ in letters(figure_of([scene], (), has_path=False))}
    assert {"0.100 m", "0.300 m", "0.250 m", "0.350 m"} <= texts


@pytest.mark.parametrize("name", ["four_bar", "planar_3rrr"])
def test_lengths_stand_at_their_own_lines_and_on_no_other(name):
    (scene,) = shown(skeleton(chasles.load(name)))[1]
    (ax,) = figure_of([scene], (), has_path=False).axes
    lengths = [text for text in ax.texts if text.get_text().endswith(" m")]
    assert lengths
    for text in lengths:
        place = np.array(text.get_position())
        nearest = min(scene.dimensions, key=lambda own: from_line(place, own.a, own.b))
        assert text.get_text() == f"{nearest.length:.3f} m"
        turn = np.radians(text.get_rotation())
        text.set_rotation(0)
        box = text.get_window_extent()
        turned = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        for own in scene.dimensions:
            line = np.linspace(own.a, own.b, 500)
            seen = (ax.transData.transform(line) - ax.transData.transform(place)) @ turned
            assert not (np.abs(seen) < [box.width / 2, box.height / 2]).all(-1).any()


def from_line(point, a, b):
    along = np.clip((point - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
    return np.linalg.norm(point - a - along * (b - a))


@pytest.mark.parametrize("ghosts", [True, None])
def test_drawing_shows_at_most_three_inverses_by_itself(ghosts):
    robot = chasles.load("ur5e")
    q = np.array([0.5, -1.2, 1.4, -0.3, 1.0, 0.0])
    others = other_inverses(robot, q)
    figure = chasles.draw(robot, q, ghosts=others if ghosts is None else ghosts, views=("front",))
    (legend,) = figure.legends
    assert len(legend.get_texts()) == (3 if ghosts else others.count) < 8


def test_legend_names_solutions_whose_links_coincide():
    robot = chasles.load("irb6640")
    q = np.array([0.3, 0.2, -0.3, 0.4, 0.5, 0.6])
    figure = chasles.draw(robot, q, ghosts=True, views=("front",))
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert [label.partition(": ")[2] for label in labels] == [
        "coincides with the drawn robot",
        "",
        "coincides with line 2",
    ]


def test_collinear_plate_has_the_lengths_of_its_line():
    """If three corners of a plate are drawn on one line, only two lengths are shown."""
    around = np.array([[0.0, 0.0], [0.1, 1e-12], [0.3, 0.0]])
    assert [side.length for side in _sides(around)] == pytest.approx([0.1, 0.2])
    assert len(_sides(np.array([[0.0, 0.0], [0.2, 0.1], [0.3, 0.0]]))) == 3


def test_drawing_refuses_the_file_of_a_film(tmp_path):
    with pytest.raises(InputValueError, match=r"a picture, got '.*arm\.gif'; call animate"):
        chasles.draw(chasles.load("scara"), file=tmp_path / "arm.gif")


@pytest.mark.parametrize("name", ["ur5e", "panda", "excavator"])
def test_ghosts_show_every_other_ik_solution(name):
    robot = chasles.load(name)
    bodies = skeleton(robot)
    generator = np.random.default_rng(8)
    counted = 0
    for _ in range(1 if robot.n > 4 else 3):
        near = bodies.q_drawn if robot.reference else generator.uniform(-1, 1, robot.n)
        q = near + 0.02 * generator.uniform(-1, 1, robot.n)
        others = other_inverses(robot, q)
        every = robot.ik(robot.fk(q), fixed=fixed_at(robot, q)).distinct()
        assert others.count == every.count - 1
        ghosts = others.valid_q()
        views = ("front", "axonometric")
        _, found = shown(bodies, views, q, ghosts if len(ghosts) else None)
        for scene in found:
            assert len(scene.ghosts) == others.count
            for ghost in scene.ghosts:
                tips = np.concatenate(ghost)
                tip = scene.frames[1].origin
                assert np.linalg.norm(tips - tip, axis=1).min() < 0.05 * bodies.size
        counted += len(ghosts)
    assert counted >= (0 if name == "excavator" else 3)


def test_drawn_path_follows_tool_positions(tmp_path):
    robot = chasles.load("excavator")
    q = np.array(robot.reference.q) + np.linspace(0, 0.1, 12)[:, None]
    figure = chasles.draw(robot, q[-1], path=q, views=("front",), file=tmp_path / "path.svg")
    tips = robot.fk(q)[:, :3, 3]
    drawn = [line.get_xydata() for line in figure.axes[0].lines]
    assert any(len(d) == 12 and np.allclose(d, tips[:, [0, 2]], atol=TRUE) for d in drawn)
    root = ET.parse(tmp_path / "path.svg").getroot()
    assert root.tag.endswith("svg")
    assert root.findall(".//{http://www.w3.org/2000/svg}image") == []


@pytest.mark.parametrize("name", CROWDED)
def test_labels_do_not_overlap_for_shipped_robots(name):
    bodies = skeleton(chasles.load(name))
    figure = lettered(bodies)
    named = [text for text, _ in letters(figure) if text.startswith("$q_")]
    assert len(named) == chasles.load(name).n
    assert overlaps(figure) == []
    assert figure.get_figwidth() == pytest.approx(8 / 2.54, abs=0.01)


def test_labels_do_not_overlap_for_arm_with_seven_joints():
    bodies = described_skeleton(read(description("sawyer")))
    figure = lettered(bodies)
    assert len(letters(figure)) >= bodies.robot.n
    assert overlaps(figure) == []


def test_labels_do_not_overlap_for_random_arms():
    generator = random.Random(17)
    for _ in range(2):
        bodies = described_skeleton(random_chain(generator, generator.randint(3, 7)).robot())
        assert overlaps(lettered(bodies)) == []


def test_marks_of_random_arms_are_finite_and_near_the_robot():
    generator = random.Random(4)
    for _ in range(3):
        bodies = described_skeleton(random_chain(generator, generator.randint(2, 8)).robot())
        poses = bodies.poses(bodies.q_drawn)
        found = marks(bodies, poses, AXONOMETRIC, 0.02 * bodies.size)
        points = np.concatenate([mark.points for mark in found])
        own = AXONOMETRIC.project(corners(bodies, poses))
        assert np.isfinite(points).all()
        assert (points.min(0) >= own.min(0) - 0.2 * bodies.size).all()
        assert (points.max(0) <= own.max(0) + 0.2 * bodies.size).all()


def test_hull_contains_all_points_counterclockwise():
    generator = np.random.default_rng(2)
    for _ in range(100):
        points = generator.normal(size=(generator.integers(3, 12), 2))
        around = hull(points)
        ways = np.roll(around, -1, axis=0) - around
        for start, (x, y) in zip(around, ways, strict=True):
            apart = points - start
            assert (x * apart[:, 1] - y * apart[:, 0] >= -1e-12).all()


def test_draw_uses_supplied_axes():
    from matplotlib.figure import Figure

    ax = Figure().add_subplot()
    assert chasles.draw(chasles.load("ur5e"), ax=ax) is ax
    assert len(ax.patches) > 6
    with pytest.raises(InputValueError, match="expected one view, got 2 views"):
        chasles.draw(chasles.load("ur5e"), ax=ax, views=("front", "top"))
    with pytest.raises(InputValueError, match="ax and file: expected one of them"):
        chasles.draw(chasles.load("ur5e"), ax=ax, file="arm.pdf")


def without_inverse(name):
    return "ik" not in chasles.load(name).functions


def test_invalid_draw_arguments_are_rejected():
    robot = chasles.load("ur5e")
    with pytest.raises(ShapeError, match=r"draw: q: expected shape \(6,\), got \(5,\)"):
        chasles.draw(robot, np.zeros(5))
    with pytest.raises(ShapeError, match=r"draw: ghosts: expected shape \(k, 6\), got \(6,\)"):
        chasles.draw(robot, ghosts=np.zeros(6))
    with pytest.raises(
        InputValueError, match=r"expected some of top, axonometric, front, side, got 'below'"
    ):
        chasles.draw(robot, views=("below",))
    with pytest.raises(chasles.OutOfReachError):
        chasles.draw(chasles.load("excavator"), [0, 90.0, 0, 0])
    with pytest.raises(InputValueError, match="expected a robot with a closed-form inverse, got"):
        chasles.draw(chasles.load(next(filter(without_inverse, ROBOTS))), ghosts=True)
