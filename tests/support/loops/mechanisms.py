"""Textbook mechanisms, built in Python, for tests of loops."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import sympy as sp

from chasles.derive.chain.poe import placement_matrix
from chasles.derive.model.exact import exact
from chasles.derive.model.mechanism import Closure, Drive, Frame, Mechanism, Strut
from chasles.derive.model.robot import Joint, Parameter, Rotation, Translation

BASE = "0"


def at(x=0, y=0, z=0, *turns):
    return (Translation((x, y, z)), *(Rotation(axis, angle) for axis, angle in turns))


def pin(name, parent, link, *before, **more):
    return Joint(name, "revolute", before=at(*before), link=link, parent=parent, **more)


def slider(name, parent, link, *before, **more):
    """Return a prismatic joint along the z axis of its joint frame."""
    return Joint(name, "prismatic", before=at(*before), link=link, parent=parent, **more)


def near(*values):
    return tuple((name, exact(value)) for name, value in values)


def body_poses(mechanism, z):
    """Return the pose (4, 4) of every body in the base frame at named joint values."""
    given = {p.symbol: p.value for p in mechanism.parameters}
    poses = {mechanism.base_frame: np.eye(4)}
    for joint in mechanism.joints:
        motion = np.eye(4)
        if joint.kind != "fixed":
            value = joint.direction * z[joint.name]
            if joint.kind != "prismatic":
                c, s = np.cos(value), np.sin(value)
                motion[:2, :2] = [[c, -s], [s, c]]
            motion[2, 3] = {"prismatic": 1, "revolute": 0, "helical": joint.pitch}[
                joint.kind
            ] * value
        before, after = (matrix(part, given) for part in (joint.before, joint.after))
        poses[joint.link] = poses[joint.parent] @ before @ motion @ after
    return poses


def matrix(placement, given):
    return np.array(placement_matrix(placement).subs(given).evalf(), dtype=float)


ALONG_X, BACK = ("y", sp.pi / 2), ("y", -sp.pi / 2)
ALONG_Y = ("x", -sp.pi / 2)


def ground(mechanism, placement):
    """Mount the mechanism on an additional body that is fixed to the base at ``placement``."""
    fixed = Joint("ground", "fixed", before=placement, link="ground", parent=BASE)
    joints = [j if j.parent != BASE else _on(j, "ground") for j in mechanism.joints]
    frame = lambda p: Frame("ground" if p.body == BASE else p.body, p.placement)  # noqa: E731
    moved = lambda c: replace(c, a=frame(c.a), b=frame(c.b))  # noqa: E731
    return replace(
        mechanism,
        joints=(fixed, *joints),
        closures=tuple(map(moved, mechanism.closures)),
        struts=tuple(map(moved, mechanism.struts)),
    )


def _on(joint, parent):
    return replace(joint, parent=parent)


def four_bar():
    """Four-bar with length parameters l1 (crank), l2 (coupler), l3 (rocker), l4 (ground)."""
    given = zip((1, 2, 3, 4), ("1", "3", "5/2", "3"), strict=True)
    lengths = [Parameter(f"l{k}", value) for k, value in given]
    l1, l2, l3, l4 = (length.symbol for length in lengths)
    return Mechanism(
        "four_bar",
        (
            pin("crank", BASE, "input"),
            pin("elbow", "input", "coupler", l1),
            pin("rocker", BASE, "output", l4),
        ),
        ("crank",),
        closures=(Closure("wrist", "pin", Frame("coupler", at(l2)), Frame("output", at(l3))),),
        tool_body="coupler",
        parameters=tuple(lengths),
        reference=near(("crank", "pi/3"), ("elbow", "-1/2"), ("rocker", "3/2")),
    )


def four_bar_rod():
    """Four-bar linkage whose coupler is a rod."""
    whole = four_bar()
    l1, l2, l3, _ = (parameter.symbol for parameter in whole.parameters)
    return replace(
        whole,
        joints=(whole.joints[0], whole.joints[2]),
        closures=(),
        struts=(Strut("rod", Frame("input", at(l1)), Frame("output", at(l3)), l2),),
        tool_body="output",
        reference=near(("crank", sp.pi / 3), ("rod_swing", -1), ("rocker", sp.Rational(3, 2))),
    )


def slider_crank():
    return Mechanism(
        "slider_crank",
        (
            pin("crank", BASE, "input"),
            pin("elbow", "input", "rod", 1),
            slider("cross", BASE, "piston", 0, "1/4", 0, ALONG_X),
        ),
        ("crank",),
        closures=(
            Closure("gudgeon", "pin", Frame("rod", at(3)), Frame("piston", at(0, 0, 0, BACK))),
        ),
        reference=near(("crank", 1), ("elbow", -1), ("cross", 3)),
    )


def five_bar():
    return Mechanism(
        "five_bar",
        (
            pin("left", BASE, "l"),
            pin("elbow", "l", "tip", 1),
            pin("right", BASE, "r", 1, direction=-1),
        ),
        ("left", "right"),
        struts=(Strut("rod", Frame("r", at(1)), Frame("tip", at("3/2")), "3/2"),),
        tool_body="tip",
        reference=near(
            ("left", sp.pi * 2 / 3),
            ("elbow", -1),
            ("right", -sp.pi / 3),
            ("rod_swing", 1),
        ),
    )


def excavator_arm():
    """Boom on a waist, lifted by a cylinder."""
    return Mechanism(
        "arm",
        (
            pin("waist", BASE, "tower"),
            pin("boom", "tower", "arm", 1, 0, 0, ("x", sp.pi / 2)),
        ),
        ("waist", "lift"),
        struts=(
            Strut("lift", Frame("tower", at("3/2", 0, -1)), Frame("arm", at(2, "1/2")), 2, True),
        ),
        reference=near(("boom", "1/5"), ("lift_swing", 1)),
    )


def parallelogram(cranks=3):
    """Parallelogram linkage: a bar on several equal cranks, of which all but two are redundant."""
    others = [pin(f"crank{k}", BASE, f"link{k}", k) for k in range(1, cranks)]
    return Mechanism(
        "parallelogram",
        (pin("crank0", BASE, "link0"), pin("bar", "link0", "coupler", 1), *others),
        ("crank0",),
        closures=tuple(
            Closure(f"pin{k}", "pin", Frame("coupler", at(k)), Frame(f"link{k}", at(1)))
            for k in range(1, cranks)
        ),
        tool_body="coupler",
        reference=near(*((f"crank{k}", 1) for k in range(cranks)), ("bar", -1)),
    )


def trammel():
    """Trammel: two perpendicular sliders that are connected by a rod."""
    return Mechanism(
        "trammel",
        (
            slider("x", BASE, "along", 0, 0, 0, ALONG_X),
            slider("y", BASE, "across", 0, 0, 0, ALONG_Y),
        ),
        ("x",),
        struts=(Strut("rod", Frame("along"), Frame("across"), 1),),
        reference=near(("x", "3/5"), ("y", "4/5"), ("rod_swing", 2)),
    )


def slotted_rocker():
    """Whitworth quick-return mechanism: a block on the crank slides along the rocker."""
    return Mechanism(
        "slotted_rocker",
        (
            pin("crank", BASE, "input"),
            pin("block", "input", "slide", 1),
            pin("rocker", BASE, "output", 0, -2),
        ),
        ("crank",),
        closures=(
            Closure(
                "slot",
                "slider",
                Frame("output", at(0, 0, 0, ALONG_X)),
                Frame("slide", at(0, 0, 0, ALONG_X)),
            ),
        ),
        reference=near(("crank", "1/2"), ("rocker", "6/5"), ("block", "7/10")),
    )


def welded():
    """Linkage with four pins in series, whose last body is welded to the base."""
    return Mechanism(
        "welded",
        (
            pin("j1", BASE, "b1"),
            pin("j2", "b1", "b2", 1),
            pin("j3", "b2", "b3", 2),
            pin("j4", "b3", "b4", 2, direction=-1),
        ),
        ("j1",),
        closures=(
            Closure(
                "weld",
                "weld",
                Frame("b4", at(0, 0, 0, ("z", "pi/7"))),
                Frame(BASE, at(2, 0, 0, ("z", "pi/7"))),
            ),
        ),
        tool_body="b2",
        reference=near(("j1", 1), ("j2", -1), ("j3", "-7/5"), ("j4", "-7/5")),
    )


def rssr():
    """RSSR linkage: a rod with two ball joints connects two cranks about skew axes."""
    return Mechanism(
        "rssr",
        (pin("crank", BASE, "input"), pin("rocker", BASE, "output", 3, 1, 0, ("x", sp.pi / 2))),
        ("crank",),
        struts=(Strut("rod", Frame("input", at(1)), Frame("output", at(2, 0, 0)), 3, ends="ball"),),
        reference=near(("crank", 1), ("rocker", 1)),
    )


def rsur():
    """RSUR linkage: two skew cranks, and a rod with a ball joint and an oblique universal joint."""
    return Mechanism(
        "rsur",
        (
            pin("crank", BASE, "input"),
            pin("rocker", BASE, "output", 3, 1, 0, ("x", sp.pi / 2)),
            pin("yoke", "output", "fork", 2, 0, "-1/10", ("y", sp.pi / 2)),
            pin("swing", "fork", "rod", 0, 0, "1/5", ("x", sp.pi * sp.Rational(2, 5))),
        ),
        ("crank",),
        closures=(Closure("ball", "ball", Frame("input", at(1)), Frame("rod", at(3, 0, "1/4"))),),
        tool_body="rod",
        reference=near(("crank", 1), ("rocker", "7/4"), ("yoke", 2), ("swing", "-7/10")),
    )


def bennett(kind="pin"):
    """Bennett linkage with four skew pin joints.

    The Bennett linkage has one degree of freedom, although Kutzbach's formula gives -2.
    """
    a, b, alpha = 1, 2, sp.pi / 6
    beta = sp.asin(sp.sin(alpha) * b / a)
    turn = lambda angle: ("x", angle)  # noqa: E731
    return Mechanism(
        "bennett",
        (
            pin("j1", BASE, "b1"),
            pin("j2", "b1", "b2", a, 0, 0, turn(alpha)),
            pin("j3", "b2", "b3", b, 0, 0, turn(beta)),
        ),
        ("j1",),
        closures=(
            Closure(
                "j4",
                kind,
                Frame("b3", at(a, 0, 0, turn(alpha))),
                Frame(BASE, at(-b, 0, 0, turn(-beta))),
            ),
        ),
        reference=near(("j1", 1), ("j2", "5/2"), ("j3", -1)),
    )


def free(name, parent, link, joints="x y z yaw pitch roll"):
    """Return the six virtual joints that connect a free platform to its parent body."""
    x, y, z, yaw, pitch, roll = joints.split()
    back = lambda *turns: tuple(Rotation(axis, angle) for axis, angle in turns)  # noqa: E731
    right = sp.pi / 2
    steps = (
        (x, "prismatic", (("y", right),), (("y", -right),)),
        (y, "prismatic", (("x", -right),), (("x", right),)),
        (z, "prismatic", (), ()),
        (yaw, "revolute", (), ()),
        (pitch, "revolute", (("x", -right),), (("x", right),)),
        (roll, "revolute", (("y", right),), (("y", -right),)),
    )
    found, body = [], parent
    for k, (step, kind, before, after) in enumerate(steps):
        carried = link if k == len(steps) - 1 else f"{name}_{step}"
        found.append(Joint(step, kind, back(*before), back(*after), link=carried, parent=body))
        body = carried
    return found


def delta():
    """Delta with three 0.24 m arms and three pairs of 0.8 m rods with ball joints."""
    arms, rods = [], []
    for k in range(3):
        around = ("z", sp.pi * Fraction(2 * k, 3))
        arms.append(
            Joint(
                f"arm{k}",
                "revolute",
                before=(Rotation(*around), Translation(("1/5", 0, 0)), Rotation("x", sp.pi / 2)),
                link=f"upper{k}",
                parent=BASE,
            )
        )
        for side in (1, -1):
            wide = Fraction(side, 20)
            rods.append(
                Strut(
                    f"rod{k}{'l' if side > 0 else 'r'}",
                    Frame(f"upper{k}", (Translation(("6/25", 0, wide)),)),
                    Frame("platform", (Rotation(*around), Translation(("1/20", -wide, 0)))),
                    sp.Rational(4, 5),
                    ends="ball",
                )
            )
    return Mechanism(
        "delta",
        (*arms, *free("platform", BASE, "platform")),
        ("arm0", "arm1", "arm2"),
        struts=tuple(rods),
        tool_body="platform",
        reference=near(("z", "-7/10"), *((f"arm{k}", "-1/10") for k in range(3))),
    )


def stewart():
    """Stewart platform: six cylinders with ball joints between hexagons of radius 1 and 1/2."""
    legs = []
    for k in range(6):
        low = Fraction(4 * (k // 2), 6) + Fraction(1 if k % 2 else -1, 12)
        high = Fraction(4 * (k // 2), 6) + Fraction(3 if k % 2 else -3, 12)
        legs.append(
            Strut(
                f"leg{k}",
                Frame(BASE, (Rotation("z", sp.pi * low), Translation((1, 0, 0)))),
                Frame("platform", (Rotation("z", sp.pi * high), Translation(("1/2", 0, 0)))),
                sp.Rational(6, 5),
                True,
                "ball",
            )
        )
    return Mechanism(
        "stewart",
        tuple(free("platform", BASE, "platform")),
        tuple(leg.name for leg in legs),
        struts=tuple(legs),
        tool_body="platform",
        reference=near(
            ("z", 1),
        ),
    )


def planar_3rrr():
    cranks, rods = [], []
    for k, angle in enumerate((210, 330, 90), 1):
        turn = sp.pi * Fraction(angle, 180)
        x, y = (sp.Rational(29, 100) * f(turn) for f in (sp.cos, sp.sin))
        cranks.append(pin(f"crank{k}", BASE, f"arm{k}", x, y))
        rods.append(
            Strut(
                f"rod{k}",
                Frame(f"arm{k}", at("17/100")),
                Frame("platform", (Rotation("z", turn), Translation(("13/100", 0, 0)))),
                sp.Rational(13, 100),
            )
        )
    x, y, _, phi, *_ = free("p", BASE, "platform")
    y, phi = replace(y, link="p_xy"), replace(phi, parent="p_xy", link="platform")
    return Mechanism(
        "planar_3rrr",
        (*cranks, x, y, phi),
        ("crank1", "crank2", "crank3"),
        struts=tuple(rods),
        tool_body="platform",
        reference=near(
            ("crank1", sp.pi * Fraction(30, 180) + 1),
            ("crank2", sp.pi * Fraction(150, 180) + 1),
            ("crank3", sp.pi * Fraction(270, 180) + 1),
            ("rod1_swing", "-19/10"),
            ("rod2_swing", "-19/10"),
            ("rod3_swing", "-19/10"),
        ),
    )


def sarrus():
    """Sarrus linkage.

    Its plate can only move up and down.
    """
    quarter = ("z", sp.pi / 2)
    level = ("x", -sp.pi / 2)
    hinges = (
        pin("a1", BASE, "a_low", 1, 0, 0, level),
        pin("a2", "a_low", "a_high", 1),
        pin("a3", "a_high", "plate", 1),
        Joint(
            "b1",
            "revolute",
            before=(Rotation(*quarter), Translation((1, 0, 0)), Rotation(*level)),
            link="b_low",
            parent=BASE,
        ),
        pin("b2", "b_low", "b_high", 1),
    )
    above = (Rotation("x", sp.pi / 2), Translation((-1, 0, 0)))
    on_plate = (*above, Rotation(*quarter), Translation((1, 0, 0)), Rotation(*level))
    return Mechanism(
        "sarrus",
        hinges,
        ("a1",),
        closures=(Closure("b3", "pin", Frame("b_high", at(1)), Frame("plate", on_plate)),),
        tool_body="plate",
        reference=near(("a1", -1), ("a2", -1), ("a3", 2), ("b1", -1), ("b2", -1)),
    )


def rail(kind="slider", *turn):
    """Return a mechanism whose free body is connected to a tilted rail by a closure.

    `kind` is the type of the closure, and `turn` rotates the frame of the closure on the body.
    """
    across = at("1/2", "1/3", "1/5", ("z", sp.pi / 5), ("x", sp.pi / 7))
    return Mechanism(
        "rail",
        tuple(free("body", BASE, "body")),
        ("x",),
        closures=(
            Closure("rail", kind, Frame(BASE, across), Frame("body", at("1/10", 0, 0, *turn))),
        ),
        tool_body="body",
        reference=near(("x", "1/2"), ("y", "1/3"), ("z", "1/5"), ("yaw", "3/5"), ("roll", "2/5")),
    )


def geared():
    """Four-bar linkage whose crank is driven by a motor through a 1:10 gear."""
    whole = four_bar_rod()
    return replace(
        whole,
        name="geared",
        actuated=("motor",),
        drives=(Drive("motor", "crank", sp.Rational(1, 10)),),
        reference=near(("motor", 10 * sp.pi / 3), *whole.reference[1:]),
    )
