"""Planar loops are detected, and planar edges agree with the poses in space."""

from dataclasses import replace
from itertools import cycle

import numpy as np
import pytest
import sympy as sp

from chasles.derive.loops.model.planes import PinEdge, SlideEdge, WeldEdge, linkages, loops
from chasles.derive.model.mechanism import Closure, Frame, Mechanism, Strut
from tests.support.loops import mechanisms
from tests.support.loops.mechanisms import ALONG_X, ALONG_Y, BASE, at, body_poses, near, pin, slider

PLANAR = (
    mechanisms.four_bar,
    mechanisms.four_bar_rod,
    mechanisms.slider_crank,
    mechanisms.excavator_arm,
    mechanisms.parallelogram,
    mechanisms.trammel,
    mechanisms.slotted_rocker,
    mechanisms.welded,
    mechanisms.planar_3rrr,
)
TILTED = at("1/10", "1/5", "3/10", ("x", sp.pi / 2), ("y", sp.pi / 6), ("z", sp.pi / 4))
SKEW = at(0, 0, 0, ("z", sp.Rational(1, 3)), ("x", sp.Rational(2, 7)))
GROUNDS = {"flat": (), "tilted": TILTED, "skew": SKEW}


def planes_of(mechanism):
    return linkages(mechanism)


def numbers(mechanism, values):
    given = {p.symbol: p.value for p in mechanism.parameters}
    return np.array(
        [complex(sp.sympify(re).subs(given), sp.sympify(im).subs(given)) for re, im in values]
    )


class InSpace:
    """Points and directions in the plane of a loop, as vectors in the base frame."""

    def __init__(self, mechanism, linkage, z):
        self.mechanism, self.z = mechanism, z
        self.poses = body_poses(mechanism, z)
        self.axes = {
            body: np.array(sp.Matrix.hstack(*axes).evalf(), dtype=float)
            for body, axes in linkage.axes.items()
        }

    def direction(self, body, value):
        x, y, _ = (self.poses[body][:3, :3] @ self.axes[body]).T
        return value.real * x + value.imag * y

    def point(self, body, value):
        return self.poses[body][:3, 3] + self.direction(body, value)

    def along(self, body, vector):
        """Return planar coordinates of a base-frame vector, and its height above the plane."""
        x, y, n = (self.poses[body][:3, :3] @ self.axes[body]).T
        return complex(vector @ x, vector @ y), vector @ n


@pytest.mark.parametrize(
    ("build", "ground"),
    list(zip(PLANAR, cycle(GROUNDS), strict=False)),
    ids=lambda value: getattr(value, "__name__", value),
)
def test_linkage_edges_match_spatial_body_motion(build, ground):
    mechanism = build() if ground == "flat" else mechanisms.ground(build(), GROUNDS[ground])
    (linkage,), spatial = planes_of(mechanism)
    assert not spatial
    random = np.random.default_rng(3)
    z = {j.name: random.uniform(-2, 2) for j in mechanism.joints if j.kind != "fixed"}
    space = InSpace(mechanism, linkage, z)
    tree = {joint.name: joint for joint in mechanism.joints}
    checked = 0
    for edge in linkage.edges:
        if edge.name not in tree:
            continue
        checked += 1
        (rotor, at_a) = numbers(mechanism, (edge.rotor, edge.at_a))
        assert abs(rotor) == pytest.approx(1, abs=1e-14)
        if isinstance(edge, PinEdge):
            rotor *= np.exp(1j * edge.sense * z[edge.name])
        at_b = 0j
        if not isinstance(edge, WeldEdge):
            (at_b,) = numbers(mechanism, (edge.at_b,))
        if isinstance(edge, SlideEdge):
            (way,) = numbers(mechanism, (edge.direction,))
            at_a += z[edge.name] * way
        (seen, height) = space.along(edge.a, space.direction(edge.b, 1 + 0j))
        assert seen == pytest.approx(rotor, abs=1e-12)
        assert height == pytest.approx(0, abs=1e-12)
        gap = space.point(edge.b, at_b) - space.point(edge.a, at_a)
        assert space.along(edge.a, gap)[0] == pytest.approx(0, abs=1e-12)
    assert checked == len({joint.name for loop in loops(mechanism) for joint in loop.joints})


@pytest.mark.parametrize("build", PLANAR, ids=lambda build: build.__name__)
def test_body_axes_are_right_handed_with_common_normal(build):
    mechanism = mechanisms.ground(build(), SKEW)
    (linkage,), _ = planes_of(mechanism)
    space = InSpace(mechanism, linkage, dict.fromkeys((j.name for j in mechanism.joints), 0.4))
    normals = []
    for body, A in space.axes.items():
        np.testing.assert_allclose(A.T @ A, np.eye(3), atol=1e-14)
        assert np.linalg.det(A) == pytest.approx(1)
        normals.append(space.poses[body][:3, :3] @ A[:, 2])
    np.testing.assert_allclose(normals, np.broadcast_to(normals[0], (len(normals), 3)), atol=1e-13)


def test_a_rod_and_a_cylinder_are_bodies_of_the_linkage():
    (rod,), _ = planes_of(mechanisms.four_bar_rod())
    assert rod.root == BASE
    assert rod.bodies == (BASE, "input", "output", "rod")
    assert [edge.name for edge in rod.edges] == ["crank", "rocker", "rod_swing", "rod.end"]
    assert rod.joints == ("crank", "rocker")
    (lift,), _ = planes_of(mechanisms.excavator_arm())
    assert lift.root == "tower"
    assert lift.bodies == ("tower", "arm", "lift", "lift.piston")
    assert lift.joints == ("boom", "lift")
    slide = next(edge for edge in lift.edges if isinstance(edge, SlideEdge))
    assert slide.at_a == (2, 0)


def test_loop_meeting_body_is_where_branches_separate():
    arm = mechanisms.excavator_arm()
    (loop,) = loops(arm)
    assert loop.meeting == "tower"
    assert [joint.name for joint in loop.joints] == ["boom"]
    assert loop.to_a == ()


@pytest.mark.parametrize(
    "build", [mechanisms.rssr, mechanisms.bennett, mechanisms.delta, mechanisms.stewart]
)
def test_spatial_loops_form_no_planar_linkage(build):
    planar, spatial = planes_of(build())
    assert planar == []
    assert len(spatial) == len(build().loop_joints)


def test_disjoint_loops_form_separate_linkages():
    first, second = mechanisms.four_bar_rod(), mechanisms.trammel()
    both = replace(
        first,
        joints=first.joints + second.joints,
        struts=(*first.struts, replace(second.struts[0], name="bar")),
        reference=(),
    )
    planar, _ = planes_of(both)
    assert [linkage.loop_joints for linkage in planar] == [("rod",), ("bar",)]


def test_prismatic_joint_may_belong_to_two_planes():
    def rod(name, joint):
        return Strut(name, Frame("carriage"), Frame(joint), 1)

    mechanism = Mechanism(
        "corner",
        (
            slider("x", BASE, "carriage", 0, 0, 0, ALONG_X),
            slider("y", BASE, "left", 0, 0, 0, ALONG_Y),
            slider("z", BASE, "up"),
        ),
        ("x",),
        struts=(rod("flat", "left"), rod("upright", "up")),
    )
    planar, spatial = planes_of(mechanism)
    assert not spatial
    assert [linkage.loop_joints for linkage in planar] == [("flat",), ("upright",)]
    heights = [tuple(linkage.axes[BASE].n) for linkage in planar]
    assert [tuple(map(abs, n)) for n in heights] == [(0, 0, 1), (0, 1, 0)]


def closed_by(kind, *turn):
    whole = mechanisms.four_bar()
    (old,) = whole.closures
    frame = replace(old.b, placement=(*old.b.placement, *at(0, 0, 0, *turn)))
    return replace(whole, closures=(Closure("wrist", kind, old.a, frame),))


@pytest.mark.parametrize(
    ("mechanism", "is_planar"),
    [
        (closed_by("pin"), True),
        (closed_by("pin", ("x", sp.pi)), True),
        (closed_by("pin", ("x", sp.pi / 2)), False),
        (closed_by("ball", ("x", sp.pi / 5)), True),
        (closed_by("weld", ("z", sp.pi / 5)), True),
        (closed_by("weld", ("x", sp.pi)), False),
        (closed_by("slider"), False),
        (mechanisms.four_bar(), True),
    ],
    ids=[
        "pin",
        "reversed pin",
        "tilted pin",
        "ball",
        "weld",
        "reversed weld",
        "slider",
        "four bar",
    ],
)
def test_closure_kind_decides_whether_loop_is_planar(mechanism, is_planar):
    assert bool(planes_of(mechanism)[0]) == is_planar


def test_out_of_plane_offset_or_screw_makes_loop_spatial():
    whole = mechanisms.four_bar_rod()
    (rod,) = whole.struts
    lifted = replace(rod, b=replace(rod.b, placement=at(2, 0, "1/100")))
    assert planes_of(replace(whole, struts=(lifted,)))[0] == []
    screw = replace(whole.joints[0], kind="helical", pitch="1/100")
    assert planes_of(replace(whole, joints=(screw, whole.joints[1])))[0] == []


def test_plane_of_slider_loop_follows_from_its_closing_pin():
    mechanism = Mechanism(
        "wedge",
        (slider("x", BASE, "low", 0, 0, 0, ALONG_X), slider("y", BASE, "high", 0, 0, 0, ALONG_Y)),
        ("x",),
        closures=(
            Closure(
                "hinge",
                "pin",
                Frame("low", at(0, 0, 0, ("y", -sp.pi / 2))),
                Frame("high", at(0, 0, 0, ("x", sp.pi / 2))),
            ),
        ),
        reference=near(("x", 0), ("y", 0)),
    )
    (linkage,), _ = planes_of(mechanism)
    assert tuple(linkage.axes[BASE].n) == (0, 0, 1)
    assert linkage.joints == ("x", "y")


def test_reversed_joint_direction_reverses_edge_sense():
    (linkage,), _ = planes_of(mechanisms.five_bar())
    senses = {edge.name: edge.sense for edge in linkage.edges if isinstance(edge, PinEdge)}
    assert senses["right"] == -1
    assert senses["left"] == 1
    whole = mechanisms.slider_crank()
    backwards = replace(whole.joints[2], direction=-1)
    (linkage,), _ = planes_of(replace(whole, joints=(*whole.joints[:2], backwards)))
    slide = next(edge for edge in linkage.edges if edge.name == "cross")
    assert slide.direction == (-1, 0)


def test_axis_opposite_to_normal_reverses_edge_sense():
    whole = mechanisms.four_bar()
    upside = pin("rocker", BASE, "output", whole.parameters[3].symbol, 0, 0, ("x", sp.pi))
    (linkage,), _ = planes_of(replace(whole, joints=(*whole.joints[:2], upside)))
    senses = {edge.name: edge.sense for edge in linkage.edges if isinstance(edge, PinEdge)}
    assert senses["rocker"] == -1
