"""Drawings of mechanisms are complete, upright and reproducible, and they compile."""

import math
import re
import subprocess
from functools import cache

import pytest
import sympy as sp

from chasles.derive.chain.body_shapes import skeleton
from chasles.derive.chain.rigid_bodies import RigidBodies
from chasles.derive.latex.drawing import PREAMBLE, DrawnMembers, drawing
from chasles.derive.latex.drawing.paper import HEIGHT, WIDTH, Paper, at, rounded
from chasles.derive.latex.drawing.parts import scene
from chasles.derive.latex.drawing.view import view
from chasles.derive.latex.setting.names import escape
from chasles.derive.model.mechanism import Closure, Drive, Frame, Mechanism, Strut
from chasles.derive.model.robot import Joint, Rotation, Translation
from chasles.derive.terms.terms import Terms
from tests.support.tools import needs
from tests.support.waiting import SECONDS

ACROSS, LYING = Rotation("x", sp.pi / 2), Rotation("x", -sp.pi / 2)
ALONG_X = Rotation("y", sp.pi / 2)
DOCUMENT = r"""\documentclass[multi=tikzpicture]{standalone}
\pdfcompresslevel=0 \pdfobjcompresslevel=0
%s
\begin{document}
%s\end{document}
"""


def moved(*xyz):
    return Translation(tuple(map(sp.Rational, map(str, xyz))))


def hinge(name, parent, *before):
    return Joint(name, "revolute", before, (), link=f"{name}_body", parent=parent)


def on_body(body, *xyz):
    return Frame(body, (moved(*xyz),))


def third_side(a, b, angle):
    return math.sqrt(a * a + b * b - 2 * a * b * math.cos(angle))


def four_bar():
    joints = (
        hinge("crank", "0"),
        hinge("coupler", "crank_body", moved(0.1, 0, 0)),
        hinge("rocker", "0", moved(0.3, 0, 0)),
    )
    ends = on_body("coupler_body", 0.3, 0, 0), on_body("rocker_body", 0.1, 0, 0)
    robot = Mechanism(
        "four_bar",
        joints,
        ("crank",),
        closures=(Closure("rocker_pin", "pin", *ends),),
        tool_body="coupler_body",
        tool=(moved(0.15, 0.1, 0),),
    )
    return robot, {"crank": 1.0, "coupler": -1.0, "rocker": 1.0}


def slider_crank():
    joints = (
        hinge("crank", "0"),
        hinge("coupler", "crank_body", moved(0.3, 0, 0)),
        Joint("piston", "prismatic", (ALONG_X,), (), link="block", parent="0"),
    )
    # The z axis of the slider block is along the guide, and the pin axis is normal to the plane of
    # the mechanism.
    across = Frame("block", (Rotation("y", -sp.pi / 2),))
    robot = Mechanism(
        "slider_crank",
        joints,
        ("motor",),
        (Closure("wrist_pin", "pin", on_body("coupler_body", 0.5, 0, 0), across),),
        drives=(Drive("motor", "crank", sp.Rational(1, 20)),),
        tool_body="block",
    )
    coupler = -math.pi / 2 - math.atan2(3, 4)
    return robot, {"crank": math.pi / 2, "coupler": coupler, "piston": 0.4}


def hydraulic_arm(waist=0.0):
    joints = (
        hinge("waist", "0"),
        hinge("boom", "waist_body", moved(0, 0, 0.8), ACROSS),
        hinge("stick", "boom_body", moved(2, 0, 0)),
    )
    struts = (
        Strut(
            "lift_cylinder",
            on_body("waist_body", 0, 0, 0.2),
            on_body("boom_body", 0.9, 0, 0),
            length=sp.Rational(1, 2),
            is_cylinder=True,
        ),
        Strut(
            "stick_cylinder",
            on_body("boom_body", 0.8, 0, 0),
            on_body("stick_body", -0.3, 0, 0),
            is_cylinder=True,
        ),
    )
    robot = Mechanism(
        "hydraulic_arm",
        joints,
        ("waist", "lift_cylinder", "stick_cylinder"),
        struts=struts,
        tool=(moved(1.5, 0, 0),),
    )
    boom, stick = 0.7, -1.2
    lengths = {
        "lift_cylinder": third_side(0.6, 0.9, boom + math.pi / 2) - 0.5,
        "stick_cylinder": third_side(1.2, 0.3, stick),
    }
    return robot, {"waist": waist, "boom": boom, "stick": stick} | lengths


def platform_3rrr():
    quarter = Rotation("y", sp.pi / 2)
    joints = [
        Joint("x", "prismatic", (quarter,), (Rotation("y", -sp.pi / 2),), "bx", "0"),
        Joint("y", "prismatic", (LYING,), (ACROSS,), "by", "bx"),
        hinge("phi", "by"),
    ]
    # Each crank is inclined so that the forearm reaches its platform joint.
    gap, crank, forearm = 0.2, 0.17, 0.13
    turn = math.acos((gap**2 + crank**2 - forearm**2) / (2 * gap * crank))
    bend = math.acos((crank**2 + forearm**2 - gap**2) / (2 * crank * forearm)) - math.pi
    closures, values = [], {"x": 0.0, "y": 0.0, "phi": 0.0}
    for k in range(3):
        around = Rotation("z", 2 * sp.pi * k / 3 + sp.pi / 2)
        at_base = (around, moved(0.3, 0, 0), Rotation("z", sp.pi))
        joints += [
            hinge(f"crank_{k}", "0", *at_base),
            hinge(f"elbow_{k}", f"crank_{k}_body", moved(crank, 0, 0)),
        ]
        ends = (
            on_body(f"elbow_{k}_body", forearm, 0, 0),
            Frame("phi_body", (around, moved(0.1, 0, 0))),
        )
        closures.append(Closure(f"pin_{k}", "pin", *ends))
        values |= {f"crank_{k}": turn, f"elbow_{k}": bend}
    cranks = tuple(f"crank_{k}" for k in range(3))
    robot = Mechanism("rrr", tuple(joints), cranks, tuple(closures), tool_body="phi_body")
    return robot, values


def delta():
    joints = [
        Joint("x", "prismatic", (ALONG_X,), (Rotation("y", -sp.pi / 2),), "bx", "0"),
        Joint("y", "prismatic", (LYING,), (ACROSS,), "by", "bx"),
        Joint("z", "prismatic", (), (), "platform", "by"),
    ]
    struts, values = [], {"x": 0.0, "y": 0.0, "z": -0.4}
    for k in range(3):
        around = Rotation("z", 2 * sp.pi * k / 3)
        joints.append(hinge(f"arm_{k}", "0", around, moved(0.15, 0, 0), ACROSS))
        values[f"arm_{k}"] = 0.0
        for side in (-0.04, 0.04):
            a = on_body(f"arm_{k}_body", 0.2, 0, side)
            b = Frame("platform", (around, moved(0.05, -side, 0)))
            name = f"rod_{k}_{'left' if side < 0 else 'right'}"
            struts.append(Strut(name, a, b, sp.Rational(1, 2), ends="ball"))
    arms = tuple(f"arm_{k}" for k in range(3))
    robot = Mechanism("delta", tuple(joints), arms, struts=tuple(struts), tool_body="platform")
    return robot, values


def welded():
    """Return a telescope whose inner tube is welded to a block on a guide."""
    joints = (
        hinge("post", "0"),
        Joint("reach", "prismatic", (ALONG_X,), (Rotation("y", -sp.pi / 2),), "tube", "post_body"),
        Joint("ride", "prismatic", (ALONG_X,), (Rotation("y", -sp.pi / 2),), "block", "0"),
    )
    closures = (
        Closure("bracket", "weld", on_body("tube", 0.1, 0, 0), on_body("block", 0.2, 0, 0)),
        Closure("rail", "slider", Frame("0", (moved(0, 0.1, 0), ALONG_X)),
                Frame("block", (moved(0.2, 0.1, 0), ALONG_X))),
    )  # fmt: skip
    robot = Mechanism("welded", joints, ("reach",), closures, tool_body="tube")
    return robot, {"post": 0.0, "reach": 0.4, "ride": 0.3}


def universal():
    """Return a four-bar with a universal joint and a ball joint at its coupler."""
    joints = (
        hinge("crank", "0"),
        hinge("swing", "crank_body", moved(0.1, 0, 0)),
        hinge("sway", "swing_body", LYING),
        hinge("rocker", "0", moved(0.3, 0, 0)),
    )
    ends = on_body("sway_body", 0.3, 0, 0), on_body("rocker_body", 0.1, 0, 0)
    ball = Closure("ball", "ball", *ends)
    robot = Mechanism("universal", joints, ("crank",), (ball,), tool_body="rocker_body")
    return robot, {"crank": 1.0, "swing": -1.0, "sway": 0.0, "rocker": 1.0}


MECHANISMS = {
    found.__name__: found
    for found in (four_bar, slider_crank, hydraulic_arm, platform_3rrr, delta, welded, universal)
}
every = pytest.mark.parametrize("name", MECHANISMS)


@cache
def pictured(name):
    robot, values = MECHANISMS[name]()
    return robot, values, drawn(robot, values)


def bodies(robot, values):
    terms = Terms({p.symbol: p.value for p in robot.parameters})
    rigid = RigidBodies(robot, terms, values)
    return terms, rigid, skeleton(rigid, [c.moves for c in robot.coordinates])


def drawn(robot, values):
    terms, _, shapes = bodies(robot, values)
    return drawing(robot, terms, shapes, [*values.values()])


def on_paper(robot, values):
    terms, rigid, shapes = bodies(robot, values)
    parts = scene(shapes, [*values.values()], DrawnMembers({}, ()))
    directions, is_planar = view(robot, terms, shapes, [*values.values()])
    return rigid, Paper.around(directions, parts.points), is_planar


@every
def test_drawing_is_insensitive_to_rounding(name):
    robot, values, text = pictured(name)
    assert text == drawn(robot, {key: v * (1 + 1e-13) + 1e-13 for key, v in values.items()})
    assert text == drawn(robot, {key: v * (1 - 1e-13) - 1e-13 for key, v in values.items()})
    assert "-0)" not in text
    assert "(-0," not in text
    assert "e-" not in text.replace("line-", "")


@every
def test_drawing_labels_actuated_but_not_platform_coordinates(name):
    robot, _, text = pictured(name)
    for k, coordinate in enumerate(robot.coordinates, 1):
        assert f"{{$q_{{{k}}}$ {escape(coordinate.name)}}};" in text
    named = re.findall(r"\\node\[name,anchor=[a-z ]+\] at \S+ \{(.*)\};", text)
    assert not {"$x$", "$y$", "$z$", r"$\phi$"} & set(named)


@every
def test_closures_and_struts_are_drawn(name):
    robot, values, text = pictured(name)
    rigid, paper, _ = on_paper(robot, values)

    def place(frame):
        body, T = rigid.end(frame)
        return at(paper.at((rigid.poses[body] @ T)[:3, 3]))

    count = 0
    for loop_joint in robot.loop_joints:
        points = [place(end) for end in (loop_joint.a, loop_joint.b)]
        if isinstance(loop_joint, Strut):
            style = "piston" if loop_joint.is_cylinder else "rod"
            assert f"\\draw[{style}] {points[0]} -- {points[1]};" in text
            assert all(f"{point} circle" in text for point in points)
        elif loop_joint.kind in {"pin", "ball"}:
            assert f"{points[0]} circle" in text
        elif loop_joint.kind == "weld":
            assert f"\\fill[weld,shift={{{points[0]}}}]" in text
        else:
            assert f"[pin] [shift={{{points[1]}}}" in text
        count += 1
    assert count == len(robot.loop_joints) > 0
    assert len(re.findall(r"\\node\[loop\]", text)) == count


@every
def test_robots_stand_upright_in_their_plane(name):
    robot, values = MECHANISMS[name]()
    _, paper, is_planar = on_paper(robot, values)
    # Prismatic joints alone define no plane.
    assert is_planar == (name not in {"delta", "welded", "universal"})
    vertical = paper.along([0, 0, 1])
    assert abs(vertical[0]) < 1e-9
    assert vertical[1] > 0.9 or vertical == (0, 0, 1)
    assert paper.along([1, 0, 0])[0] > 0


@needs("pdflatex")
def test_drawings_compile_and_fit_the_page(tmp_path):
    """A single LaTeX run compiles all drawings as pages of one document."""
    pictures = "".join(pictured(name)[2] for name in MECHANISMS)
    (tmp_path / "robot.tex").write_text(DOCUMENT % (PREAMBLE, pictures))
    run = subprocess.run(
        ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "robot.tex"],
        cwd=tmp_path,
        capture_output=True,
        check=False,
        timeout=SECONDS,
    )
    assert run.returncode == 0, run.stdout.decode(errors="replace")[-2000:]
    pdf = (tmp_path / "robot.pdf").read_bytes()
    pages = re.findall(rb"/MediaBox \[0 0 ([\d.]+) ([\d.]+)\]", pdf)
    assert len(pages) == len(MECHANISMS)
    for page in pages:
        w, h = (float(size) / 72 * 254 for size in page)
        assert w <= WIDTH + 10
        assert h <= HEIGHT + 10
        assert max(w / WIDTH, h / HEIGHT) > 0.75


def test_drawing_is_independent_of_waist_angle():
    assert drawn(*hydraulic_arm(0.4)) == drawn(*hydraulic_arm(-0.9)) == drawn(*hydraulic_arm())


def test_motor_is_drawn_at_its_driven_joint():
    robot, values = slider_crank()
    _, paper, _ = on_paper(robot, values)
    text = drawn(robot, values)
    assert f"\\filldraw[pin,driven] {at(paper.at([0, 0, 0]))} circle" in text
    assert text.count("\\filldraw[pin,driven]") == text.count("\\draw[motor") == 1


def test_coincident_hinges_are_drawn_as_single_ball():
    text = drawn(*universal())
    inner = re.findall(r"\\fill\[outline\] (\S+) circle", text)
    assert len(inner) == len(set(inner)) == 2


def test_rounding_of_ties_ignores_last_digits():
    for value in (-1.5, -0.5, 0.5, 7.5):
        assert rounded(value - 1e-9) == rounded(value) == rounded(value + 1e-9) == math.ceil(value)
