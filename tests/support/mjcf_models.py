"""Random MJCF models for tests, and their poses from MuJoCo."""

import numpy as np
import pytest

from chasles.derive import DescriptionError
from chasles.derive.description.importers.mjcf.mjcf_file import MjcfFile

mujoco = pytest.importorskip("mujoco", reason="the reader of MJCF and the oracle")

SPATIAL_AXES = ("1 0 0", "0 1 0", "0 0 1", "0 3 4", "3 0 -4")
RIGHT = (0, 90, -90, 180, 45)


def numbers(dice, low=-1.0, high=1.0, digits=3):
    return " ".join(f"{dice.uniform(low, high):.{digits}f}" for _ in range(3))


def orientation(dice):
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
    """Return a random MJCF model with side branches, frames and sites."""
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
    """Return the MuJoCo model of an MJCF text, without its missing meshes."""
    return mujoco.MjModel.from_xml_string(
        text.replace('<mesh name="missing" file="missing.stl"/>', "").replace(
            'type="mesh" mesh="missing"', 'size="0.1"'
        )
    )


def poses_of(model, values):
    """Return the pose of every body and site at given joint values, keyed by name."""
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


def read_model(path, text, base=None, tip=None):
    path.write_text(text)
    return MjcfFile(path).robot(base, tip, None)


def random_linkage(dice):
    """Return a four-bar linkage in a tilted plane with one of the MJCF closure types."""
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


def random_spatial_loop(dice):
    """Return a loop of four hinges with a connect equality, or of seven hinges with a weld
    equality."""
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


def random_delta(dice):
    """Return a delta robot: three arms and three ball-joint rods move a translating platform."""
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


def rod_pair_delta(*, is_free):
    """Return a delta robot with a pair of rods on each arm."""
    radius, arm, rod, edge, aside = 0.2, 0.2, 0.5, 0.05, 0.04
    across = edge - radius - arm
    drop = (rod**2 - across**2) ** 0.5
    far, shape = f"{across!r} 0 {-drop!r}", '<geom size="0.01"/>'
    parts, closures = [], []
    for k in range(3):
        parts.append(
            f'<body name="hub{k}" euler="0 0 {120 * k}"><body name="arm{k}" pos="{radius} 0 0">'
            f'<joint name="motor{k}" axis="0 1 0" range="-60 60"/>{shape}'
        )
        for side in (-1, 1):
            name, inner = f"rod{k}{'ab'[side > 0]}", ""
            if name == "rod0a" and not is_free:
                hinge = '<joint name="hang" type="ball"/>'
                inner = f'<body name="platform" pos="{far}">{hinge}{shape}</body>'
            else:
                closures.append(f'<connect body1="{name}" body2="platform" anchor="{far}"/>')
            ball = f'<joint name="{name}" type="ball"/>'
            place = f'pos="{arm} {side * aside} 0"'
            parts.append(f'<body name="{name}" {place}>{ball}{shape}{inner}</body>')
        parts.append("</body></body>")
    if is_free:
        free = f'<freejoint name="float"/>{shape}'
        parts.append(f'<body name="platform" pos="0 0 {-drop!r}" euler="0 0 30">{free}</body>')
    motors = "".join(f'<motor joint="motor{k}"/>' for k in range(3))
    return f"""<mujoco model="delta"><compiler angle="degree"/><worldbody>{"".join(parts)}
</worldbody><equality>{"".join(closures)}</equality><actuator>{motors}</actuator></mujoco>"""


def wrong(path, text, base=None, tip=None):
    with pytest.raises(DescriptionError) as caught:
        read_model(path, text, base, tip)
    assert str(caught.value).startswith(str(path))
    return str(caught.value)
