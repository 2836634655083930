"""Robots with loops in robot files: what they may say, the shipped ones, and what is wrong."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import sympy as sp
from derivations import ROBOTS

from chasles.derive import DescriptionError, Robot, Rotation, load, loads
from chasles.derive.build import freshness
from chasles.derive.model.mechanism import Closure, Mechanism, Strut

# --- closing loops in numbers, without anything that the compiler derives ---

# Loops are closed to rounding; a reference is meant to be near, radians or metres.
CLOSED = 1e-12
NEAR = 0.15
# A loop is well closed where its equations are this far from singular.
HELD = 0.02


def pose(placement, values):
    """A placement in numbers, from its elementary motions."""
    T = np.eye(4)
    for motion in placement:
        step = np.eye(4)
        if isinstance(motion, Rotation):
            j, k = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[motion.axis]
            angle = float(motion.angle.xreplace(values))
            step[j, j] = step[k, k] = np.cos(angle)
            step[k, j] = np.sin(angle)
            step[j, k] = -step[k, j]
        else:
            step[:3, 3] = [float(c.xreplace(values)) for c in motion.vector]
        T = T @ step
    return T


def moved(joint, value):
    T = np.eye(4)
    if joint.kind == "prismatic":
        T[2, 3] = value
    elif joint.kind == "revolute":
        c, s = np.cos(value), np.sin(value)
        T[:2, :2] = [[c, -s], [s, c]]
    return T


class Model:
    """A mechanism in numbers; q are its coordinates and u its other joints."""

    def __init__(self, mechanism):
        values = {p.symbol: p.value for p in mechanism.parameters}
        self.mechanism = mechanism
        self.base, self.tool = pose(mechanism.base, values), pose(mechanism.tool, values)
        self.around = {
            joint.name: (pose(joint.before, values), pose(joint.after, values))
            for joint in mechanism.joints
        }
        self.places = {
            c.name: (pose(c.a.placement, values), pose(c.b.placement, values))
            for c in mechanism.closers
        }
        self.length = {s.name: float(s.length.xreplace(values)) for s in mechanism.struts}
        self.moves = {
            c.moves: (k, float(c.ratio.xreplace(values)))
            for k, c in enumerate(mechanism.coordinates)
        }
        moving = [joint.name for joint in mechanism.joints if joint.kind != "fixed"]
        self.unknown = [name for name in moving if name not in self.moves]
        self.q = np.array([float(mechanism.reference_of(c.name)) for c in mechanism.coordinates])
        self.u = np.array([float(mechanism.reference_of(name)) for name in self.unknown])

    def values(self, q, u):
        driven = {name: q[k] * ratio for name, (k, ratio) in self.moves.items()}
        return driven | dict(zip(self.unknown, u, strict=True))

    def poses(self, q, u):
        values = self.values(q, u)
        T = {self.mechanism.base_frame: self.base}
        for joint in self.mechanism.joints:
            before, after = self.around[joint.name]
            motion = moved(joint, joint.direction * values.get(joint.name, 0.0))
            T[joint.link] = T[joint.parent] @ before @ motion @ after
        return T

    def tip(self, q, u):
        return self.poses(q, u)[self.mechanism.tool_body] @ self.tool

    def ends(self, closer, q, u):
        T = self.poses(q, u)
        A, B = self.places[closer.name]
        return T[closer.a.body], T[closer.a.body] @ A, T[closer.b.body] @ B

    def residual(self, q, u):
        parts = [np.zeros(0)]
        for closer in self.mechanism.closers:
            _, A, B = self.ends(closer, q, u)
            if isinstance(closer, Strut):
                length = self.length[closer.name] + self.values(q, u).get(closer.name, 0.0)
                parts.append([np.linalg.norm(B[:3, 3] - A[:3, 3]) - length])
            else:
                assert closer.kind == "pin"
                apart = np.linalg.inv(A) @ B
                parts.append([*apart[:3, 3], *apart[:2, 2]])
        return np.concatenate(parts)

    def jacobian(self, q, u, step=1e-6):
        columns = [
            (self.residual(q, u + step * e) - self.residual(q, u - step * e)) / (2 * step)
            for e in np.eye(len(u))
        ]
        return np.array(columns).reshape(len(u), -1).T

    def closed(self, q, u):
        """The unknown joints near u that close all loops."""
        for _ in range(30):
            r = self.residual(q, u)
            if np.abs(r).max(initial=0.0) < CLOSED:
                return u
            du = np.linalg.lstsq(self.jacobian(q, u), -r, rcond=None)[0]
            u = u + du * min(1.0, 0.3 / np.abs(du).max())
        raise AssertionError(f"the loops of {self.mechanism.name} do not close at {q}")

    def held(self, q, u):
        """How far the loops are from a dead point: their Jacobian's smallest singular value."""
        return np.linalg.svd(self.jacobian(q, u), compute_uv=False)[len(u) - 1] if len(u) else 1.0

    def followed(self, q, steps=12):
        """The unknown joints at q on the branch of the reference, and the way's least hold."""
        u, held = self.closed(self.q, self.u), np.inf
        for part in np.linspace(0, 1, steps + 1):
            at = self.q + part * (np.asarray(q) - self.q)
            u = self.closed(at, u)
            held = min(held, self.held(at, u))
        return u, held


@cache
def mechanism(name):
    return load(ROBOTS / f"{name}.toml")


@cache
def model(name):
    return Model(mechanism(name))


# --- the shipped robots ---

SHIPPED = {
    "four_bar": ("crank", "crank coupler", "rocker"),
    "slider_crank": ("crank", "slider", "rod_angle"),
    "five_bar": ("left right", "left left_elbow", "right_elbow"),
    "well_manipulator": (
        "theta1 cylinder_1 cylinder_2 l_HI cylinder_3 l_MN cylinder_4",
        "theta1 theta2 theta3 l_HI theta5 l_MN theta7",
        "theta8 theta9 theta10 theta11",
    ),
    "planar_3rrr": ("theta_1 theta_2 theta_3", "x y phi", "psi_1 psi_2 psi_3"),
    "planar_3rrr_170": ("theta_1 theta_2 theta_3", "x y phi", "psi_1 psi_2 psi_3"),
    "board_installer": (
        "waist slider crank yaw push_rod roll",
        "waist slider shoulder elbow wrist yaw pitch roll",
        "elbow_plate rod_KH_swing rod_FH_swing greater_rod_swing smaller_rod_swing push_rod_swing",
    ),
    "bricklaying_gantry": ("motor_x motor_y motor_z", "y x z", ""),
    "excavator": (
        "swing boom_cylinder stick_cylinder bucket_cylinder",
        "swing boom stick bucket",
        "rocker bucket_link_swing boom_cylinder_swing stick_cylinder_swing bucket_cylinder_swing",
    ),
    "delta": ("arm_1 arm_2 arm_3", "x y z yaw pitch roll", ""),
    "stewart_gough": ("leg_1 leg_2 leg_3 leg_4 leg_5 leg_6", "x y z yaw pitch roll", ""),
}


def test_every_shipped_robot_with_loops_is_here():
    names = [path.stem for path in ROBOTS.glob("*.toml")]
    assert sorted(SHIPPED) == sorted(n for n in names if isinstance(mechanism(n), Mechanism))


@pytest.mark.parametrize("name", SHIPPED)
def test_names(name):
    coordinates, chain, passive = (tuple(names.split()) for names in SHIPPED[name])
    robot = mechanism(name)
    assert robot.name == name
    assert tuple(c.name for c in robot.coordinates) == coordinates
    assert tuple(joint.name for joint in robot.main_chain.moving) == chain
    assert robot.passive == passive
    assert robot.title != name
    assert robot.source


@pytest.mark.parametrize("name", SHIPPED)
def test_the_reference_is_near_a_closed_configuration(name):
    m = model(name)
    u = m.closed(m.q, m.u)
    assert np.abs(u - m.u).max(initial=0.0) < NEAR
    for c, value in zip(m.mechanism.coordinates, m.q, strict=True):
        low, high = (None if limit is None else float(limit) for limit in c.limits)
        assert low is None or low <= value <= high, c.name
    for strut in m.mechanism.struts:
        if strut.ends == "pin":
            known = float(m.mechanism.reference_of(strut.swing_name))
            assert abs(swing(m, strut, m.q, u) - known) < NEAR, strut.name


def swing(m, strut, q, u):
    """The angle of a strut on the body at its beginning, about z or, where that is up, about -y."""
    body, A, B = m.ends(strut, q, u)
    x, y, z = body[:3, :3].T @ (B[:3, 3] - A[:3, 3])
    flat = abs(z) < 1e-9
    assert flat or abs(y) < 1e-9
    return np.arctan2(y if flat else z, x)


@pytest.mark.parametrize("name", SHIPPED)
def test_every_loop_closes_within_the_limits(name):
    m = model(name)
    limits = [c.limits for c in m.mechanism.coordinates]
    low = np.array([-np.pi if a is None else float(a) for a, _ in limits])
    high = np.array([np.pi if b is None else float(b) for _, b in limits])
    rng = np.random.default_rng(7)
    tried = 0
    for k in range(12):
        part = rng.random(len(low)) if k % 2 else rng.integers(0, 2, len(low))
        _, held = m.followed(low + (high - low) * part)
        assert held > HELD
        tried += 1
    assert tried == 12


WELL = [
    (
        [88.79, -49.2, -86.76, -40.62],
        [676.1398945, 748.2321208, 757.8045934, 668.0745509],
        [97.6300533, -3.7476803, 2.5048179, -46.5039847],
    ),
    (
        [88.79, -11.25844509, -129.76606998, -35.55548493],
        [676.1398945, 643.5014571, 829.8580386, 653.2639794],
        [97.6300533, -10.3861568, -5.367422, -41.2434955],
    ),
    (
        [88.79, -100.56101055, -88.57420215, 12.5552127],
        [676.1398945, 921.8775013, 762.1369402, 546.4268791],
        [97.6300533, -5.7127645, 2.2327224, 15.2850872],
    ),
]


@pytest.mark.parametrize(("angles", "lengths", "swings"), WELL)
def test_states_of_the_well_manipulator(angles, lengths, swings):
    m = model("well_manipulator")
    l1, l2, l3, l4 = np.array(lengths) / 1000
    q = np.array([0, l1, l2, 0, l3, 0, l4])
    u, _ = m.followed(q)
    assert m.unknown == ["theta2", "theta3", "theta5", "theta7"]
    # Printed to 1e-7 mm and, at dead points' distance, 1e-6 degrees.
    assert np.degrees(u) == pytest.approx(angles, abs=1e-6)
    found = [np.degrees(swing(m, strut, q, u)) for strut in m.mechanism.struts]
    assert found == pytest.approx(swings, abs=1e-6)


def test_the_tool_of_the_well_manipulator():
    m = model("well_manipulator")
    u = m.closed(m.q, m.u)
    R = 1000 * m.tip(m.q, u)[:3, 3]
    assert pytest.approx([2255.20386894, 0, 583.84702201], abs=2e-6) == R
    R = 1000 * m.tip(m.q + np.array([np.pi / 6, 0, 0, 0, 0, 0, 0]), u)[:3, 3]
    assert pytest.approx([1953.06384122, 1127.60193447, 583.84702201], abs=2e-6) == R


BOARDS = [
    ([0.0] * 6, [0.0] * 8, (1.5, 0.0, 1.24)),
    (
        [0.34906585, 0.03, 0.174532925, -0.34906585, 0.02, 0.0],
        [
            *(0.34906585, 0.03, 0.153260366, -0.027395016),
            *(-0.12586535, -0.34906585, 0.136203735, 0.0),
        ],
        (1.306884743, 0.331022897, 1.416937781),
    ),
    (
        [-0.610865238, -0.06, -0.261799388, 0.436332313, -0.03, 0.20943951],
        [
            *(-0.610865238, -0.06, -0.288224698, 0.149610191),
            *(0.138614507, 0.436332313, -0.200552588, 0.20943951),
        ],
        (1.463730419, -0.821441844, 0.977165719),
    ),
]


@pytest.mark.parametrize(("q", "chain", "tip"), BOARDS)
def test_cases_of_the_board_installer(q, chain, tip):
    m = model("board_installer")
    u, _ = m.followed(q)
    values = m.values(q, u)
    found = [values[joint.name] for joint in m.mechanism.main_chain.moving]
    # The cases are printed to nine digits.
    assert found == pytest.approx(chain, abs=5e-9)
    assert m.tip(q, u)[:3, 3] == pytest.approx(tip, abs=5e-9)
    # The parallelograms keep the plate at the elbow level.
    assert values["elbow_plate"] == pytest.approx(-values["shoulder"], abs=1e-9)


@pytest.mark.parametrize(
    ("name", "legs"),
    [
        ("planar_3rrr", [78.52393138, 176.46904472, -29.82437852]),
        ("planar_3rrr_170", [92.25700039, -168.79837185 + 360, -8.8931441]),
    ],
)
def test_the_planar_robot_reaches_the_pose_of_its_inverse(name, legs):
    m = model(name)
    u, held = m.followed(np.radians(legs))
    assert held > HELD
    assert dict(zip(m.unknown, u, strict=True)) == pytest.approx(
        {"x": 0.02, "y": 0.05, "phi": 0.0}, abs=1e-9
    )


def test_the_couplers_make_two_planar_robots():
    short, long = mechanism("planar_3rrr"), mechanism("planar_3rrr_170")
    lengths = [{p.name: p.value for p in robot.parameters}["L"] for robot in (short, long)]
    assert lengths == [sp.Rational(13, 100), sp.Rational(17, 100)]
    assert long.joints == short.joints
    assert long.struts == short.struts
    assert long.reference != short.reference
    assert [p.meaning for p in long.parameters] == [p.meaning for p in short.parameters]


def test_the_motors_of_the_gantry():
    robot = mechanism("bricklaying_gantry")
    m = model("bricklaying_gantry")
    assert m.tip([10.0, 20.0, 4.0], [])[:3, 3] == pytest.approx([0.1, 0.2, 0.06], abs=1e-15)
    assert [c.limits for c in robot.coordinates] == [(0, 40), (0, 50), (0, sp.Rational(50, 3))]
    assert [c.unit for c in robot.coordinates] == ["rad"] * 3


def test_the_gantry_papers_count_is_three_legs_of_four_links():
    """N = 14, j = 15, sum f = 15: a slider, three parallel axes and a fourth across in each leg."""
    axes, point = np.eye(3, dtype=int), {"x": "rpy = [0, 90, 0]", "y": "rpy = [-90, 0, 0]", "z": ""}
    text = 'name = "legs"\nconvention = "poe"\nunits = { angle = "deg" }\nactuated = ["x1"]\n'
    for k, name in enumerate("xyz"):
        along, across, third = axes[k], axes[(k + 1) % 3], axes[(k + 2) % 3]
        at = [third, third + 2 * across, across, across]
        for i, (axis, p) in enumerate(zip([along] * 4 + [across], [at[0], *at], strict=True)):
            if name != "x" and i == 4:
                frame = f"xyz = {p.tolist()}, {point['xyz'[(k + 1) % 3]]}".rstrip(", ")
                text += f'[[closures]]\nname = "{name}5"\nkind = "pin"\n'
                text += f'a = {{ body = "l{name}4", {frame} }}\nb = {{ body = "lx5", {frame} }}\n'
                continue
            text += f'[[joints]]\nname = "{name}{i + 1}"\nlink = "l{name}{i + 1}"\n'
            text += f"axis = {axis.tolist()}\npoint = {p.tolist()}\n"
            text += 'parent = "0"\n' if i == 0 else ""
            text += 'type = "prismatic"\n' if i == 0 else ""
    robot = loads(text)
    bodies, joints = len(robot.bodies), len(robot.joints) + len(robot.closures)
    assert (bodies, joints, 6 * (bodies - joints - 1) + joints) == (14, 15, 3)
    sliders = tuple(f"{name}1" for name in "xyz")
    m = Model(replace(robot, actuated=sliders, tool_body="lx5"))
    assert len(m.unknown) - np.linalg.matrix_rank(m.jacobian(m.q, m.u), tol=1e-6) == 0
    q = np.array([0.1, -0.2, 0.05])
    T = m.tip(q, m.closed(q, m.u))
    assert pytest.approx(q, abs=1e-9) == T[:3, 3]
    assert pytest.approx(np.eye(3), abs=1e-9) == T[:3, :3]


# --- what files may say ---

LOOP = """\
name = "loop"
convention = "urdf"
units = { length = "mm", angle = "deg" }
actuated = ["motor", "jack", "slide"]
tool = { name = "tcp", body = "arm", xyz = [10, 0, 0], rpy = [0, 0, 90] }

[base]
name = "ground"

[parameters]
l = 300
n = { value = "1/50", unit = "1" }

[[joints]]
name = "turn"
link = "arm"
axis = [0, 0, 1]
limits = [-90, 45]

[[joints]]
name = "slide"
parent = "ground"
link = "sled"
type = "prismatic"
axis = [1, 0, 0]

[[joints]]
name = "hinge"
link = "flap"
axis = [0, 0, 1]

[[closures]]
name = "latch"
kind = "slider"
a = { body = "arm", xyz = ["l", 0, 0], rpy = [0, 90, 0] }
b = { body = "flap" }

[[rods]]
name = "stay"
length = "2*l"
a = { body = "ground" }
b = { body = "sled", xyz = [0, 0, 5] }
swing = "lean"

[[cylinders]]
name = "jack"
retracted = "l"
limits = [-100, 50]
a = { body = "ground", xyz = [0, 1, 0] }
b = { body = "flap" }
ends = "ball"

[[drives]]
name = "motor"
joint = "turn"
ratio = "-n"

[reference]
motor = 90
jack = 25
lean = "atan2(l, l)"
"""


def test_a_whole_file():
    robot = loads(LOOP)
    (length,) = (p.symbol for p in robot.parameters if p.name == "l")
    assert isinstance(robot, Mechanism)
    assert robot.bodies == ("ground", "arm", "sled", "flap")
    assert [joint.parent for joint in robot.joints] == ["ground", "ground", "sled"]
    latch, stay, jack = robot.closers
    assert isinstance(latch, Closure)
    assert (latch.kind, latch.a.body, latch.b.body) == ("slider", "arm", "flap")
    assert latch.a.placement[0].vector == (length, 0, 0)
    assert latch.a.placement[1] == Rotation("y", sp.pi / 2)
    assert (stay.length, stay.swing_name, stay.ends) == (2 * length, "lean", "pin")
    assert (jack.is_cylinder, jack.ends, jack.length) == (True, "ball", length)
    assert jack.limits == (sp.Rational(-1, 10), sp.Rational(1, 20))
    motor, extension, slide = robot.coordinates
    assert (motor.kind, motor.moves, motor.unit) == ("revolute", "turn", "rad")
    # The motor turns against the joint, fifty times as far.
    assert motor.limits == (-50 * sp.pi / 4, 50 * sp.pi / 2)
    assert (extension.name, extension.unit, slide.unit) == ("jack", "m", "m")
    assert (robot.tool_body, robot.tool_frame, robot.base_frame) == ("arm", "tcp", "ground")
    assert robot.reference_of("motor") == sp.pi / 2
    assert robot.reference_of("jack") == sp.Rational(1, 40)
    assert robot.reference_of("lean") == sp.pi / 4
    assert robot.reference_of("hinge") == 0
    assert robot.passive == ("hinge", "lean")


def test_a_drive_of_a_slider_has_a_radius():
    text = LOOP.replace('joint = "turn"\nratio = "-n"', 'joint = "slide"\nradius = "l/10"')
    robot = loads(text.replace('"jack", "slide"]', '"jack", "turn"]'))
    assert robot.coordinates[0].ratio.xreplace({sp.Symbol("l", real=True): sp.Rational(3, 10)}) == (
        sp.Rational(3, 100)
    )


@pytest.mark.parametrize(
    "signs", ["parent", "closures", "rods", "cylinders", "drives", "actuated", "reference"]
)
def test_what_makes_a_file_one_with_loops(signs):
    serial = 'name = "r"\nconvention = "dh"\n'
    joints = '[[joints]]\nname = "j"\n'
    assert isinstance(loads(serial + joints), Robot)
    if signs == "actuated":
        assert isinstance(loads(f'{serial}actuated = ["j"]\n{joints}'), Mechanism)
        return
    text = joints + 'parent = "0"\n' if signs == "parent" else f"{signs} = []\n{joints}"
    with pytest.raises(DescriptionError, match=r"actuated: expected a list of names.*missing"):
        loads(serial + (text if signs != "reference" else f"reference = {{}}\n{joints}"))


PLATFORM = """\
name = "p"
convention = "urdf"
actuated = ["crank"]
units = { angle = "deg" }
[[joints]]
name = "crank"
axis = [0, 0, 1]
[[joints]]
name = "plate"
type = "%s"
parent = "0"
xyz = [1, 2, 3]
rpy = [0, 0, 90]
link = "top"
"""


def test_a_planar_platform():
    extra = 'coordinates = ["u", "v", "turn"]\nlimits = [[-1, 1], [-2, 2], [-90, 90]]\n'
    m = Model(loads(PLATFORM % "planar" + extra))
    assert m.unknown == ["u", "v", "turn"]
    joints = m.mechanism.joints[1:]
    assert [joint.link for joint in joints] == ["plate_u", "plate_v", "top"]
    assert [joint.parent for joint in joints] == ["0", "plate_u", "plate_v"]
    assert [joint.limits for joint in joints] == [(-1, 1), (-2, 2), (-sp.pi / 2, sp.pi / 2)]
    expected = np.array([[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1.0]])
    assert np.allclose(m.tip([0], np.zeros(3)), expected, atol=1e-15)
    c, s = np.cos(0.3), np.sin(0.3)
    step = np.array([[c, -s, 0, 0.5], [s, c, 0, 0.7], [0, 0, 1, 0], [0, 0, 0, 1]])
    assert np.allclose(m.tip([0], np.array([0.5, 0.7, 0.3])), expected @ step, atol=1e-15)


def test_a_free_platform():
    m = Model(loads((PLATFORM % "free").replace("rpy = [0, 0, 90]\n", "")))
    assert m.unknown == ["x", "y", "z", "yaw", "pitch", "roll"]
    assert [joint.link for joint in m.mechanism.joints[1:]][-2:] == ["plate_pitch", "top"]

    def turn(axis, angle):
        return pose((Rotation(axis, sp.Rational(angle, 10)),), {})

    T = m.tip([0], np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6]))
    expected = turn("z", 4) @ turn("y", 5) @ turn("x", 6)
    expected[:3, 3] = 1.1, 2.2, 3.3
    assert np.allclose(T, expected, atol=1e-15)


# The line of the file to be replaced, what stands there instead, its field, words of the complaint.
WRONG = [
    (4, 'actuated = ["moto", "jack"]', "actuated[1]", "did you mean 'motor'?"),
    (4, 'actuated = ["motor", "turn"]', "actuated[2]", "another joint than motor does"),
    (4, "actuated = []", "actuated", "a list of names"),
    (4, 'actuator = ["motor"]', "actuator", "did you mean 'actuated'?"),
    (5, 'tool = { body = "am" }', "tool.body", "did you mean 'arm'?"),
    (5, 'tool = { link = "arm" }', "tool.link", "one of the fields name, body, xyz, rpy"),
    (8, 'name = "arm"', "joints[1].link", "another link than base has"),
    (22, 'parent = "groud"', "joints[2].parent", "did you mean 'ground'?"),
    (22, 'parent = "flap"', "joints[2].parent", "one of ground, arm"),
    (24, 'type = "planer"', "joints[2].type", "did you mean 'planar'?"),
    (30, 'mimic = { joint = "turn" }', "joints[3].mimic", "one of the fields"),
    (33, 'name = "turn"', "closures[1].name", "another name than joints[1] has"),
    (34, 'kind = "hinge"', "closures[1].kind", "one of pin, slider, ball, weld"),
    (35, 'a = { body = "arms" }', "closures[1].a.body", "did you mean 'arm'?"),
    (35, 'a = { xyz = ["l", 0, 0] }', "closures[1].a.body", "it is missing"),
    (35, 'a = { body = "arm", at = 1 }', "closures[1].a.at", "one of the fields body, xyz, rpy"),
    (35, 'a = "arm"', "closures[1].a", "a table"),
    (36, 'b = { body = "arm" }', "closures[1].b.body", "another body than closures[1].a has"),
    (39, "nam = 5", "rods[1].nam", "did you mean 'name'?"),
    (40, "length = 0", "rods[1].length", "a length above 0"),
    (40, 'length = "l*l"', "rods[1].length", "a length, which this is not"),
    (41, 'a = { body = "ground", xyz = [0, 0] }', "rods[1].a.xyz", "a list of three numbers"),
    (43, 'swing = "hinge"', "rods[1].swing", "another name than joints[3] has"),
    (43, 'ends = "pins"', "rods[1].ends", "did you mean 'pin'?"),
    (43, "limits = [0, 1]", "rods[1].limits", "one of the fields name, length"),
    (47, 'retracted = "2*m"', "cylinders[1].retracted", "unknown parameter 'm'"),
    (48, "limits = [-300, 50]", "cylinders[1].limits[1]", "a cylinder longer than 0 there"),
    (48, 'swing = "s"', "cylinders[1].swing", "no swing: a member between balls"),
    (54, 'name = "jack"', "drives[1].name", "another name than cylinders[1] has"),
    (55, 'joint = "stay"', "drives[1].joint", "one of turn, slide, hinge, jack"),
    (56, "radius = 5", "drives[1].radius", "no radius: turn turns"),
    (56, "ratio = 0", "drives[1].ratio", "a number other than 0"),
    (56, "", "drives[1].ratio", "the advance of turn per radian"),
    (59, "moto = 90", "reference.moto", "did you mean 'motor'?"),
    (59, "stay = 90", "reference.stay", "a coordinate, a joint or a swing"),
    (60, 'jack = "m"', "reference.jack", "unknown parameter"),
]


@pytest.mark.parametrize(("line", "text", "field", "words"), WRONG)
def test_a_wrong_line(line, text, field, words):
    lines = LOOP.splitlines()
    lines[line - 1] = text
    with pytest.raises(DescriptionError) as caught:
        loads("\n".join(lines), "loop.toml")
    error = caught.value
    assert (error.field, words in str(error)) == (field, True), str(error)
    assert str(error).startswith(f"loop.toml:{error.line}: {field}: expected ")
    # What is missing is looked for in the table that should hold it.
    elsewhere = {"joints[1].link": 16, "drives[1].ratio": line if text else 53}
    assert error.line == elsewhere.get(field, line)


def test_enough_wrong_lines():
    assert len(WRONG) >= 30


@pytest.mark.parametrize(
    ("extra", "field", "words"),
    [
        ('coordinates = ["x", "y"]', "joints[2].coordinates", "a list of 3 names"),
        ('coordinates = ["x", "y", "crank"]', "joints[2].coordinates[3]", "another name"),
        ('coordinates = ["x", "y", "x"]', "joints[2].coordinates[3]", "another name"),
        ("limits = [-1, 1]", "joints[2].limits", "a list of 3 pairs"),
        ("limits = [[-1, 1], [2, -2], [0, 1]]", "joints[2].limits[2]", "a lowest below"),
        ("axis = [0, 0, 1]", "joints[2].axis", "one of the fields name, type, parent"),
    ],
)
def test_a_wrong_platform(extra, field, words):
    with pytest.raises(DescriptionError) as caught:
        loads(PLATFORM % "planar" + extra, "p.toml")
    assert (caught.value.field, caught.value.line) == (field, 15)
    assert words in str(caught.value)


@pytest.mark.parametrize("field", ["closures", "rods", "cylinders", "drives"])
def test_lists_that_are_none(field):
    text = f'name = "r"\nconvention = "dh"\nactuated = ["j"]\n{field} = 5\n[[joints]]\nname = "j"\n'
    with pytest.raises(DescriptionError, match=f":4: {field}: expected a list") as caught:
        loads(text)
    assert caught.value.value == 5


# --- files that extend others ---

PARENT = """\
name = "short"
title = "Short arm"
source = "our shop"
convention = "dh"
units = { length = "mm" }

[parameters]
l = { value = 300, meaning = "arm" }
h = 20
n = { value = 2, unit = "1" }

[[joints]]
a = "n*l"
d = "h"
"""


def extended(tmp_path, text, parent=PARENT):
    (tmp_path / "short.toml").write_text(parent)
    child = tmp_path / "long.toml"
    child.write_text(text)
    return child


def test_a_file_that_extends_another(tmp_path):
    text = (
        'extends = "short.toml"\nname = "long"\ntitle = "Long arm"\n'
        "[parameters]\nl = { value = 450 }\nh = 25\nn = 3\n"
    )
    robot = load(extended(tmp_path, text))
    short = load(tmp_path / "short.toml")
    assert (robot.name, robot.title, robot.source) == ("long", "Long arm", "our shop")
    assert [p.value for p in robot.parameters] == [sp.Rational(9, 20), sp.Rational(1, 40), 3]
    assert [p.kind for p in robot.parameters] == [p.kind for p in short.parameters]
    assert robot.parameters[0].meaning == "arm"
    assert robot.joints == short.joints
    assert [p.value for p in short.parameters] == [sp.Rational(3, 10), sp.Rational(1, 50), 2]


@pytest.mark.parametrize(
    ("text", "line", "field", "words"),
    [
        ('extends = "short.toml"\n', None, "name", "it is missing"),
        ('name = "l"\nextends = 5\n', 2, "extends", "one line of text"),
        ('name = "l"\nextends = "no.toml"\n', 2, "extends", "no.toml: expected a readable file"),
        ('name = "l"\nextends = "long.toml"\n', 2, "extends", "a file that extends no other"),
        ('extends = "short.toml"\nname = "2"\n', 2, "name", "a letter"),
        ('extends = "short.toml"\nname = "l"\njoints = []\n', 3, "joints", "one of the fields"),
        ('extends = "short.toml"\nname = "l"\nparameters = 1\n', 3, "parameters", "a table"),
        (
            'extends = "short.toml"\nname = "l"\n[parameters]\nm = 1\n',
            *(4, "parameters.m", "one of the parameters of"),
        ),
        (
            'extends = "short.toml"\nname = "l"\n[parameters]\nh = { value = 1, unit = "m" }\n',
            *(4, "parameters.h.unit", "one of the fields value"),
        ),
        (
            'extends = "short.toml"\nname = "l"\n[parameters]\n\nl = "x"\n',
            *(5, "parameters.l.value", "a number"),
        ),
        (
            'extends = "short.toml"\nname = "l"\n[parameters]\nl = {}\n',
            *(4, "parameters.l.value", "the parameter's value"),
        ),
    ],
)
def test_a_wrong_extension(tmp_path, text, line, field, words):
    child = extended(tmp_path, text)
    with pytest.raises(DescriptionError) as caught:
        load(child)
    assert (caught.value.line, caught.value.field) == (line, field)
    assert caught.value.file == str(child)
    assert words in str(caught.value)


def test_what_is_wrong_with_the_extended_file_is_said_of_it(tmp_path):
    child = extended(tmp_path, 'extends = "short.toml"\nname = "l"\n', PARENT + "alpha = true\n")
    with pytest.raises(DescriptionError, match=r"short.toml:15: joints\[1\].alpha"):
        load(child)


def test_an_extension_is_due_where_the_other_file_changed(tmp_path):
    child = extended(tmp_path, 'extends = "short.toml"\nname = "long"\n')
    folder = tmp_path / "out" / "long"
    folder.mkdir(parents=True)
    job = freshness.Job(child, folder.parent)
    assert not freshness.is_up_to_date(job)
    freshness.stamp(job, folder)
    assert freshness.is_up_to_date(job)
    (tmp_path / "short.toml").write_text(PARENT + "alpha = 1\n")
    assert not freshness.is_up_to_date(job)
    for broken in ('extends = "gone.toml"\n', "extends = 5\n", "extends = \n"):
        child.write_text(broken)
        assert not freshness.is_up_to_date(job)
