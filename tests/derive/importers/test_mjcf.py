"""MJCF import: random models against MuJoCo's own kinematics, and everything that can be wrong."""

import random

import numpy as np
import pytest
import sympy as sp
from tolerances import ORACLE
from typer.testing import CliRunner

from chasles.derive import DescriptionError, derive, from_file
from chasles.derive.build.generate import artifacts
from chasles.derive.cli import app
from chasles.derive.description.importers.mjcf.mjcf_file import MjcfFile
from chasles.derive.terms.casadi_graph import lower

mujoco = pytest.importorskip("mujoco", reason="the reader of MJCF and the oracle")

MODELS, POSES, LINKAGES, LOOPS, DELTAS = 14, 3, 6, 8, 3
SPATIAL_AXES = ("1 0 0", "0 1 0", "0 0 1", "0 3 4", "3 0 -4")
RIGHT = (0, 90, -90, 180, 45)


def numbers(dice, low=-1.0, high=1.0, digits=3):
    return " ".join(f"{dice.uniform(low, high):.{digits}f}" for _ in range(3))


def orientation(dice):
    """One of MJCF's forms of an orientation."""
    right = " ".join(str(dice.choice(RIGHT)) for _ in range(3))
    return dice.choice(
        (
            "",
            f'euler="{right}"',
            f'euler="{numbers(dice, -180, 180, 1)}"',
            f'axisangle="{numbers(dice)} {dice.uniform(-180, 180):.2f}"',
            f'quat="{dice.uniform(0.1, 1):.3f} {numbers(dice)}"',
            'quat="1 1 1 1"',
            'xyaxes="0 1 0 0 0 1"',
            'zaxis="1 0 0"',
        )
    )


def random_joint(dice, name):
    kind = dice.choice(("hinge", "hinge", "slide"))
    axis = dice.choice(("1 0 0", "0 1 0", "0 0 -1", "0 1 1", numbers(dice)))
    anchor = f'pos="{numbers(dice)}"' if dice.random() < 0.4 else ""
    reference = f'ref="{dice.uniform(-1, 1):.2f}"' if dice.random() < 0.4 else ""
    limits = 'range="-2 2"' if dice.random() < 0.5 else ""
    return f'<joint name="{name}" type="{kind}" axis="{axis}" {anchor} {reference} {limits}/>'


def random_model(dice):
    """A chain of bodies with none to three joints each, side branches, frames and sites."""
    count = dice.randint(2, 6)
    degree = dice.choice(("degree", "degree", "radian"))
    opened, closed, names = [], [], 0
    for k in range(1, count + 1):
        joints = []
        for _ in range(dice.choice((0, 1, 1, 2, 3)) if k > 1 else 1):
            names += 1
            joints.append(random_joint(dice, f"j{names}"))
        if dice.random() < 0.3:
            opened.append(f'<frame pos="{numbers(dice)}" {orientation(dice)}>')
            closed.append("</frame>")
        opened += [
            f'<body name="b{k}" pos="{numbers(dice)}" {orientation(dice)}>',
            *joints,
            '<geom type="mesh" mesh="missing" material="grey"/>' if k % 2 else '<geom size="0.1"/>',
            f'<site name="s{k}" pos="{numbers(dice)}" {orientation(dice)}/>',
            f'<body name="side{k}"><joint name="f{k}" type="ball"/><geom size="0.1"/></body>',
        ]
        closed.append("</body>")
    return "\n".join(
        [
            f'<mujoco model="random-{degree}"><compiler angle="{degree}"/>',
            '<default><joint armature="1"/></default>',
            '<asset><mesh name="missing" file="missing.stl"/><material name="grey"/></asset>',
            "<worldbody>",
            *opened,
            *reversed(closed),
            "</worldbody></mujoco>",
        ]
    ), count


def oracle(text):
    """MuJoCo's model, without the meshes that are missing."""
    return mujoco.MjModel.from_xml_string(
        text.replace('<mesh name="missing" file="missing.stl"/>', "").replace(
            'type="mesh" mesh="missing"', 'size="0.1"'
        )
    )


def poses_of(model, values):
    """The pose of every body and site at values of joints."""
    data = mujoco.MjData(model)
    for name, value in values.items():
        data.qpos[model.joint(name).qposadr[0]] = value
    mujoco.mj_kinematics(model, data)
    found = {}
    for kind, count, xpos, xmat in (
        (model.body, model.nbody, data.xpos, data.xmat),
        (model.site, model.nsite, data.site_xpos, data.site_xmat),
    ):
        for k in range(count):
            pose = np.eye(4)
            pose[:3, :3], pose[:3, 3] = xmat[k].reshape(3, 3), xpos[k]
            found[kind(k).name] = pose
    return found


def read(path, text, base=None, tip=None):
    path.write_text(text)
    return MjcfFile(path).robot(base, tip, None)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "model.xml"


def compare(path, seed):
    """Poses of all links of a random model, beside MuJoCo's; the number of them."""
    dice = random.Random(seed)
    text, count = random_model(dice)
    robot = read(path, text, "world", f"s{count}")
    fk, links = lower(derive(robot, ("fk", "link_poses")).functions, "r")
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


def test_random_models_against_mujoco(path):
    words = ("ref", "range", "<frame", "pos=", "slide", "euler", "quat")
    texts, counts = zip(*(compare(path, seed) for seed in range(MODELS)), strict=True)
    assert sum(counts) > MODELS * POSES * 2
    assert min(sum(word in text for text in texts) for word in words) >= 3


def random_linkage(dice):
    """A four-bar linkage in a tilted plane, closed by one of MJCF's ways to do so."""
    A, D = np.zeros(2), np.array([dice.uniform(0.3, 0.4), dice.uniform(-0.1, 0.1)])
    B = np.array([dice.uniform(-0.05, 0.05), dice.uniform(0.08, 0.12)])
    C = D + np.array([dice.uniform(-0.1, 0.1), dice.uniform(0.2, 0.3)])
    A, B, C, D = (np.round(point, 3) for point in (A, B, C, D))
    turns = [dice.choice((0, 30, dice.randint(-170, 170))) for _ in range(3)]

    def local(point, origin, turn):
        c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
        x, y = point - origin
        return f"{float(c * x + s * y)!r} {float(c * y - s * x)!r} 0"

    crank, coupler, rocker = turns
    way = dice.choice(("bodies", "sites", "pin", "weld"))
    closure = {
        "bodies": f'<connect name="pin" body1="rocker" body2="coupler" '
        f'anchor="{local(C, D, rocker)}"/>',
        "sites": '<connect name="pin" site1="end" site2="other"/>',
        "pin": f'<connect name="pin" body1="rocker" body2="coupler" '
        f'anchor="{local(C, D, rocker)}"/><connect body1="rocker" body2="coupler" '
        f'anchor="{local(C, D, rocker)[:-1]}0.1"/>',
        "weld": '<weld name="pin" body1="rocker" body2="last"/>',
    }[way]
    last = (
        f'<body name="last" pos="{local(C, B, coupler)}"><joint name="last"/>'
        '<geom size=".01"/></body>'
        if way == "weld"
        else ""
    )
    return f"""<mujoco model="linkage"><compiler angle="degree"/><worldbody>
<body name="frame" pos="{numbers(dice)}" euler="{numbers(dice, -180, 180, 1)}">
<body name="crank" euler="0 0 {crank}"><joint name="crank"/><geom size=".01"/>
<body name="coupler" pos="{local(B, A, crank)}" euler="0 0 {coupler - crank}"><joint name="elbow"/>
<geom size=".01"/><site name="end" pos="{local(C, B, coupler)}"/><site name="tool" pos=".1 .1 0"/>
{last}</body></body>
<body name="rocker" pos="{local(D, A, 0)}" euler="0 0 {rocker}"><joint name="rocker"/>
<geom size=".01"/><site name="other" pos="{local(C, D, rocker)}"/></body>
</body></worldbody><equality>{closure}</equality>
<actuator><motor joint="crank"/></actuator></mujoco>"""


def test_a_linkage_in_any_plane_has_an_article(path):
    """Coefficients of its inverse and vectors of its loop stand in one product."""
    robot = read(path, random_linkage(random.Random(3)), "world", "tool")
    assert "latex/rates.tex" in artifacts(robot)


def random_spatial_loop(dice):
    """A loop of hinges in space: four closed by a connect, or seven closed by a weld."""
    is_weld = dice.random() < 0.5
    count = 7 if is_weld else 4
    split = dice.randint(2, count - 1)

    def branch(numbers_of):
        opened = "".join(
            f'<body name="b{k}" pos="{numbers(dice, -0.5, 0.5)}">'
            f'<joint name="j{k}" axis="{dice.choice(SPATIAL_AXES)}"/><geom size="0.01"/>'
            for k in numbers_of
        )
        return opened + "</body>" * len(numbers_of)

    first, second = range(1, split + 1), range(split + 1, count + 1)
    bodies = f'body1="b{split}" body2="b{count}"'
    closure = (
        f"<weld {bodies}/>"
        if is_weld
        else f'<connect {bodies} anchor="{numbers(dice, -0.5, 0.5)}"/>'
    )
    return f"""<mujoco model="loop"><compiler angle="degree"/><worldbody>
{branch(first)}{branch(second)}</worldbody><equality>{closure}</equality>
<actuator><motor joint="j1"/></actuator></mujoco>""".replace('"j1"', '"crank"')


def satisfied(model, crank):
    """MuJoCo's data where its equalities are satisfied, by Newton's method from its own pose.

    None where the loops do not close there.
    """
    data = mujoco.MjData(model)
    at = model.joint("crank").qposadr[0]
    free = [k for k in range(model.nq) if k != at]
    for step in np.linspace(0, crank, 5):
        data.qpos[at] = step
        for _ in range(30):
            mujoco.mj_forward(model, data)
            held = data.efc_type[: data.nefc] == mujoco.mjtConstraint.mjCNSTR_EQUALITY
            error = data.efc_pos[: data.nefc][held]
            J = data.efc_J.reshape(-1, model.nv)[: data.nefc][held]
            data.qpos[free] -= np.linalg.lstsq(J[:, free], error, rcond=1e-9)[0]
    mujoco.mj_kinematics(model, data)
    return data if np.abs(error).max() < 1e-12 else None


def at_solutions(path, text, tip, cranks):
    """A mechanism's functions by name, and MuJoCo's coordinates where its loops are closed."""
    robot = read(path, text, "world", tip)
    wanted = ("fk", "constraint") if tip == "tool" else ("constraint",)
    derived = derive(robot, wanted)
    kernels = lower(derived.functions, "r")
    functions = dict(zip((f.name for f in derived.functions), kernels, strict=True))
    model = mujoco.MjModel.from_xml_string(
        text.replace("<compiler", '<option jacobian="dense"/><compiler')
    )
    order = [joint.name for joint in robot.joints if joint.kind != "fixed"]
    solutions = []
    for data in (satisfied(model, crank) for crank in cranks):
        if data is None:
            break
        solutions.append({name: data.qpos[model.joint(name).qposadr[0]] for name in order})
    return robot, functions, model, solutions


def compare_linkage(path, seed):
    """Residuals and poses of a linkage at MuJoCo's solution."""
    dice = random.Random(seed)
    text = random_linkage(dice)
    cranks = [0.0, *(dice.uniform(-0.2, 0.2) for _ in range(POSES))]
    robot, functions, model, found = at_solutions(path, text, "tool", cranks)
    for crank, z in zip(cranks, found, strict=True):
        residual = np.array(functions["constraint"](list(z.values())))
        assert np.abs(residual).max() <= 1e-11, seed
        tool = np.array(functions["fk"]([crank])).reshape(4, 4)
        assert np.abs(tool - poses_of(model, z)["tool"]).max() <= 1e-9, seed
    return robot.closures[0].kind


def compare_loop(path, seed):
    """Residuals of a spatial loop at MuJoCo's solution, and beside it."""
    dice = random.Random(seed)
    text = random_spatial_loop(dice)
    robot, functions, _, found = at_solutions(path, text, "b1", [0.0, 0.02, -0.03])
    for z in found:
        values = np.array(list(z.values()))
        assert np.abs(np.array(functions["constraint"](values))).max() <= 1e-11, seed
        beside = values + 1e-3 * np.array([dice.choice((-1, 1)) for _ in values])
        assert np.abs(np.array(functions["constraint"](beside))).max() > 1e-6, seed
    return robot.closures[0].kind, len(found)


def test_spatial_loops_against_mujoco(path):
    kinds, counts = zip(*(compare_loop(path, seed) for seed in range(LOOPS)), strict=True)
    assert set(kinds) == {"ball", "weld"}
    assert sum(counts) > 2 * LOOPS


def test_linkages_against_mujoco(path):
    kinds = {compare_linkage(path, seed) for seed in range(LINKAGES)}
    assert kinds == {"ball", "pin", "weld"}


def random_delta(dice):
    """A platform that slides along x, y, z on three rods between balls, moved by three arms."""
    sizes = [dice.uniform(*bounds) for bounds in ((0.15, 0.25), (0.15, 0.25), (0.04, 0.06))]
    radius, arm, edge = (round(size, 3) for size in sizes)
    height = round(dice.uniform(0.35, 0.45), 3)
    anchor = dice.choice(("", 'pos="0.01 0.02 -0.03"'))
    parts, closures, motors = [], [], []
    for k in range(3):
        parts.append(
            f'<body name="hub{k}" euler="0 0 {120 * k}"><body name="arm{k}" pos="{radius} 0 0">'
            f'<joint name="motor{k}" axis="0 1 0" range="-90 90"/><geom size="0.01"/>'
            f'<body name="rod{k}" pos="{arm} 0 0"><joint name="ball{k}" type="ball" {anchor}/>'
            f'<geom size="0.01"/></body></body></body>'
        )
        end = np.array([edge, 0, 0])
        turned = np.radians(120 * k)
        c, s = np.cos(turned), np.sin(turned)
        start = np.array([c * (radius + arm), s * (radius + arm), 0])
        far = np.array([c * end[0], s * end[0], -height]) - start
        x, y, z = c * far[0] + s * far[1], c * far[1] - s * far[0], far[2]
        closures.append(
            f'<connect name="link{k}" body1="rod{k}" body2="platform" '
            f'anchor="{float(x)!r} {float(y)!r} {float(z)!r}"/>'
        )
        motors.append(f'<motor joint="motor{k}"/>')
    slides = "".join(
        f'<joint name="{name}" type="slide" axis="{axis}"/>'
        for name, axis in (("x", "1 0 0"), ("y", "0 1 0"), ("z", "0 0 1"))
    )
    return f"""<mujoco model="delta"><compiler angle="degree"/><worldbody>{"".join(parts)}
<body name="platform" pos="0 0 -{height}">{slides}<geom size="0.01"/><site name="tool"/></body>
</worldbody><equality>{"".join(closures)}</equality><actuator>{"".join(motors)}</actuator></mujoco>"""


def compare_delta(path, seed):
    """The platform's pose beside MuJoCo's solution for the same motors."""
    dice = random.Random(seed)
    text = random_delta(dice)
    robot = read(path, text, "world", "tool")
    assert [strut.ends for strut in robot.struts] == ["ball"] * 3
    (fk,) = lower(derive(robot, ("fk",)).functions, "r")
    model = mujoco.MjModel.from_xml_string(
        text.replace("<compiler", '<option jacobian="dense"/><compiler')
    )
    data = mujoco.MjData(model)
    held = [model.joint(f"motor{k}").qposadr[0] for k in range(3)]
    moving = [model.joint(f"motor{k}").dofadr[0] for k in range(3)]
    free = [k for k in range(model.nv) if k not in moving]
    for _ in range(POSES):
        q = [dice.uniform(-0.3, 0.3) for _ in range(3)]
        data.qpos[:] = model.qpos0
        for part in (0.5, 1.0):
            data.qpos[held] = part * np.array(q)
            for _ in range(30):
                mujoco.mj_forward(model, data)
                kinds = data.efc_type[: data.nefc] == mujoco.mjtConstraint.mjCNSTR_EQUALITY
                error = data.efc_pos[: data.nefc][kinds]
                J = data.efc_J.reshape(-1, model.nv)[: data.nefc][kinds]
                step = np.zeros(model.nv)
                step[free] = -np.linalg.lstsq(J[:, free], error, rcond=1e-9)[0]
                mujoco.mj_integratePos(model, data.qpos, step, 1.0)
        assert np.abs(error).max() < 1e-12
        mujoco.mj_kinematics(model, data)
        tool = np.array(fk(q)).reshape(4, 4)[:3, 3]
        assert np.abs(tool - data.site("tool").xpos).max() <= 1e-9, seed


def test_rods_on_balls_against_mujoco(path):
    for seed in range(DELTAS):
        compare_delta(path, seed)


ARM = """\
<mujoco model="arm">
<worldbody><body name="base"><body name="link"><joint name="turn" range="-30 30"/>
<geom size="0.1"/><body name="hand" pos="0 0 1"><joint name="slide" type="slide"/>
<geom size="0.1"/></body></body></body>
<body name="free"><freejoint name="drift"/><geom size="0.1"/><body name="leg"><joint name="hip"/>
<geom size="0.1"/></body></body></worldbody>
</mujoco>
"""


def test_names_limits_and_notes(path):
    robot = read(path, ARM)
    assert (robot.name, robot.base_frame, robot.tool_frame) == ("arm", "world", "hand")
    assert [(joint.name, joint.kind) for joint in robot.joints] == [
        ("base_mount", "fixed"),
        ("turn", "revolute"),
        ("slide", "prismatic"),
    ]
    assert robot.joints[1].limits == (-sp.pi / 6, sp.pi / 6)
    assert robot.joints[2].limits == (None, None)
    assert robot.notes == ("tip: hand; also there: leg",)
    assert read(path, ARM, tip="leg").base_frame == "free"
    assert read(path, ARM.replace(' model="arm"', "")).name == "model"
    noisy = ARM.replace('name="hand" pos', 'name="hand" euler="0 0 30.00000001" pos')
    assert any("joint slide: y = 0.523598775" in note for note in read(path, noisy).notes)


def test_followers_and_sites(path):
    law = (
        '<equality><joint joint1="slide" joint2="turn" polycoef="0.1 2 0 0 0"/></equality></mujoco>'
    )
    robot = read(path, ARM.replace("</mujoco>", law), tip="hand")
    assert [joint.name for joint in robot.coordinates] == ["turn"]
    mimic = robot.joints[2].mimic
    assert (mimic.leader, mimic.multiplier, mimic.offset) == ("turn", 2, sp.Rational(1, 10))
    bent = law.replace("0.1 2 0", "0.1 2 1")
    assert "joint 'slide' is coupled by an equality" in wrong(path, ARM.replace("</mujoco>", bent))
    site = ARM.replace('name="hand" pos="0 0 1">', 'name="hand"><site name="tcp" pos="0 0 0.2"/>')
    assert read(path, site).tool_frame == "tcp"


def wrong(path, text, base=None, tip=None):
    with pytest.raises(DescriptionError) as caught:
        read(path, text, base, tip)
    assert str(caught.value).startswith(str(path))
    return str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("<geom size", "<geon size", "unrecognized element; Element 'geon', line"),
        ("</mujoco>", "", "expected MJCF that MuJoCo reads"),
        ('type="slide"', 'type="screw"', ":3: expected MJCF that MuJoCo reads"),
        ('name="slide"', 'name="turn"', "repeated name 'turn' in joint"),
        ("<mujoco", "<mujoko", "expected MJCF that MuJoCo reads"),
        ("</mujoco>", '<include file="none.xml"/></mujoco>', "none.xml"),
    ],
)
def test_wrong_models(path, old, new, words):
    assert words in wrong(path, ARM.replace(old, new))


def test_what_no_chain_holds(path):
    ball = ARM.replace('name="turn" range="-30 30"', 'name="turn" type="ball"')
    message = wrong(path, ball, "world", "hand")
    assert "joint 'turn' is a ball joint; expected hinges, slides and fixed bodies" in message
    assert "--base link begins behind it" in message
    assert "joint 'drift' is a free joint" in wrong(path, ARM, "world", "leg")
    assert "such as hand" in wrong(path, ARM, tip="hant")
    loop = '<equality><connect name="pin" body1="hand" anchor="0 0 0"/></equality></mujoco>'
    assert "have no actuator" in wrong(path, ARM.replace("</mujoco>", loop), tip="hand")
    elsewhere = loop.replace('body1="hand"', 'body1="hand" body2="free"')
    drive = '<actuator><motor joint="turn"/></actuator><equality>'
    text = ARM.replace("</mujoco>", elsewhere.replace("<equality>", drive))
    assert "joint 'drift' is a free joint" in wrong(path, text, tip="hand")
    assert "'pin' holds 'free', which is not below the base 'base'" in wrong(
        path, text, "base", "hand"
    )
    side = loop.replace('body1="hand"', 'body1="free"')
    robot = read(path, ARM.replace("</mujoco>", side), tip="hand")
    assert robot.notes == ("pin: not on the way to the tip",)


def test_connects_that_are_no_hinge(path):
    linkage = random_linkage(random.Random(0))
    closure = linkage[linkage.index("<equality>") : linkage.index("</equality>")]
    frames = [f'body1="rocker" body2="coupler" anchor="0 0 {k / 10}"' for k in range(3)]
    three = "<equality>" + "".join(f"<connect {frame}/>" for frame in frames)
    assert "3 connects hold" in wrong(path, linkage.replace(closure, three), tip="tool")


def test_a_rod_that_holds_more_is_none(path):
    """A second connect of the same body: its ball joint is refused then."""
    text = random_delta(random.Random(0)).replace(
        "</equality>", '<connect body1="rod0" body2="arm1" anchor="0 0 0"/></equality>'
    )
    assert "joint 'ball0' is a ball joint" in wrong(path, text, tip="tool")


def test_a_program_that_moves_a_body_closes_no_loop(path):
    text = ARM.replace("<worldbody>", '<worldbody><body name="target" mocap="true"/>')
    weld = '<equality><weld body1="hand" body2="target"/></equality></mujoco>'
    assert read(path, text.replace("</mujoco>", weld), tip="hand").tool_frame == "hand"


def test_a_urdf_by_another_ending(path):
    text = (
        '<?xml version="1.0"?><!-- <mujoco> --><robot name="u"><link name="a"/><link name="b"/>'
        '<joint name="j" type="continuous"><parent link="a"/><child link="b"/></joint></robot>'
    )
    path.write_text(text)
    assert from_file(path).name == "u"


def test_included_files_make_a_robot_due(path):
    inner = path.with_name("hand.xml")
    inner.write_text('<mujocoinclude><site name="tcp" pos="0 0 0.3"/></mujocoinclude>')
    path.write_text(ARM.replace('pos="0 0 1">', 'pos="0 0 1"><include file="hand.xml"/>'))
    words = [path, "--to", path.parent / "out", "--tip", "tcp", "--functions", "fk", "--jobs", "1"]
    run = lambda: CliRunner().invoke(app, [*map(str, words)]).output  # noqa: E731
    assert "1 robot written" in run()
    assert "nothing to derive" in run()
    inner.write_text(inner.read_text().replace("0.3", "0.4"))
    assert "1 robot written" in run()
