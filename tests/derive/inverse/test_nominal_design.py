"""Inverse kinematics of as-built robots with loops, whose files name a nominal robot."""

import re
from dataclasses import replace
from functools import cache
from itertools import islice

import numpy as np
import pytest
import sympy as sp

from chasles.derive import DescriptionError, read, read_text
from chasles.derive.build.freshness import Job, is_up_to_date, stamp
from chasles.derive.inverse.mechanisms import hybrid_inverse
from chasles.derive.inverse.mechanisms.differences import apart
from chasles.derive.inverse.mechanisms.hybrid_inverse import hybrid_inverses
from chasles.derive.model.robot import Rotation, Translation
from tests.support.derivations import ROBOTS
from tests.support.generators.as_built import BOARD_INSTALLER, as_built
from tests.support.loops.solved import solved

TEXT = (ROBOTS / "board_installer.toml").read_text()
VALUES = {"L1": "1003.37", "L2": "1198.21", "k": "4.53", "r": "161.77", "p": "118.43"}
"""Lengths without a common ratio, so that the lengths of the pantograph are not proportional."""


def with_values(values):
    text = TEXT
    for name, value in values.items():
        pattern = rf"^{name} = {{ value = [^,]*,"
        text, count = re.subn(pattern, f'{name} = {{ value = "{value}",', text, flags=re.M)
        assert count == 1
    return text


@cache
def design():
    return read_text(with_values(VALUES))


@cache
def built(seed=3):
    """Return an as-built robot with length errors up to 0.1 mm and a crank error of 0.05 deg."""
    spoilt = as_built(design(), BOARD_INSTALLER, 1e-4, np.random.default_rng(seed))
    joints = tuple(
        replace(joint, before=(*joint.before, Rotation("x", sp.pi / 3600)))
        if joint.name == "crank"
        else joint
        for joint in spoilt.joints
    )
    return replace(spoilt, joints=joints, closure="least squares")


def test_nominal_design_gives_inverse_of_built_mechanism(monkeypatch):
    # To keep the test short, the derivation tries only the first nominal mechanism.
    tried = hybrid_inverse.nominal_mechanisms
    monkeypatch.setattr(hybrid_inverse, "nominal_mechanisms", lambda m: islice(tried(m), 1))
    alone = hybrid_inverses(solved(built()))
    assert not alone.solved
    assert 'nominal = "<file>" must name the robot as designed' in alone.missing
    nominal_start = hybrid_inverses(solved(replace(built(), nominal=design())))
    assert list(nominal_start.solved) == ["ik_nominal"]
    assert nominal_start.polished is not None
    (*_, lengths) = nominal_start.classification.found.requirements
    assert 1e-5 < lengths.deviation < 2e-4


def test_unsuitable_nominal_design_is_reported():
    other = as_built(design(), BOARD_INSTALLER, 1e-4, np.random.default_rng(4))
    found = hybrid_inverses(solved(replace(built(), nominal=other)))
    assert not found.solved
    assert (
        "no inverse of the nominal robot 'board_installer' can be refined to this robot"
        in found.missing
    )


def test_nominal_design_must_have_the_same_members():
    def off(**changes):
        return replace(built(), nominal=replace(design(), **changes))

    renamed = tuple(
        replace(strut, name="rod_X") if strut.name == "rod_KH" else strut
        for strut in design().struts
    )
    reference = tuple((n, v) for n, v in design().reference if n != "rod_KH_swing")
    with pytest.raises(
        DescriptionError, match=r"nominal robot .*: different struts: rod_KH, rod_X"
    ):
        off(struts=renamed, reference=reference)
    with pytest.raises(DescriptionError, match="its actuated coordinates"):
        off(actuated=design().actuated[::-1])


@pytest.fixture
def files(tmp_path):
    """Write the robot files of the nominal design and the as-built robot into one folder."""
    (tmp_path / "design.toml").write_text(with_values(VALUES))
    own = with_values(VALUES | {"r": "161.82"})
    own = own.replace('convention = "urdf"', 'convention = "urdf"\nnominal = "design.toml"', 1)
    (tmp_path / "built.toml").write_text(own)
    return tmp_path


def test_nominal_key_loads_the_design_file(files):
    robot = read(files / "built.toml")
    assert robot.nominal == design()
    assert robot.nominal.nominal is None


@pytest.mark.parametrize("is_in_folder", [False, True])
def test_nominal_key_accepts_installed_robot_name(files, is_in_folder):
    text = (files / "built.toml").read_text()
    (files / "built.toml").write_text(text.replace('"design.toml"', '"board_installer"'))
    if is_in_folder:
        # In the key `nominal`, a name without file suffix refers to an installed robot, even if a
        # file has this name.
        (files / "board_installer").write_text("")
    assert read(files / "built.toml").nominal == read(ROBOTS / "board_installer.toml")


@pytest.mark.parametrize(
    ("named", "message"),
    [
        ("none.toml", "a robot file in this folder"),
        (
            "panther",
            "the name of a robot that is installed with chasles, or a robot file in this folder",
        ),
        ("ur10e", "the file of a robot with loops"),
        ("built.toml", "names no nominal robot itself"),
        ("four_bar.toml", "nominal robot 'four_bar': different joints"),
        ("ur5e.toml", "the file of a robot with loops"),
    ],
)
def test_invalid_nominal_key_error_names_its_line(files, named, message):
    for name in ("four_bar", "ur5e"):
        (files / f"{name}.toml").write_text((ROBOTS / f"{name}.toml").read_text())
    text = (files / "built.toml").read_text()
    (files / "wrong.toml").write_text(text.replace('"design.toml"', f'"{named}"'))
    with pytest.raises(DescriptionError, match=re.escape(message)) as error:
        read(files / "wrong.toml")
    line = text[: text.index("nominal =")].count("\n") + 1
    assert str(error.value).startswith(f"{files / 'wrong.toml'}:{line}: nominal")


def test_change_of_design_file_makes_output_stale(files):
    job = Job(files / "built.toml", files / "out")
    folder = files / "out" / "board_installer"
    folder.mkdir(parents=True)
    stamp(job, folder)
    assert is_up_to_date(job)
    (files / "design.toml").write_text(with_values(VALUES | {"p": "119"}))
    assert not is_up_to_date(job)


def displacement(rng, length=1.27):
    """Return a random translation, followed by rotations by multiples of 90 degrees.

    Each coordinate of the translation is between -length and length.
    """
    angles = (sp.pi / 2 * int(k) for k in rng.integers(0, 4, 3))
    shift = Translation(tuple(sp.Rational(f"{x:.6f}") for x in rng.uniform(-length, length, 3)))
    return (shift, *(Rotation(axis, angle) for axis, angle in zip("xyz", angles, strict=True)))


def inverse(placement):
    def back(part):
        if isinstance(part, Translation):
            return Translation(tuple(-x for x in part.vector))
        return Rotation(part.axis, -part.angle)

    return tuple(back(part) for part in reversed(placement))


def in_other_frames(mechanism, seed=0):
    """Return the same mechanism with other body frames and joint frames."""
    rng = np.random.default_rng(seed)
    moved = {joint.link: displacement(rng) for joint in mechanism.joints}
    back = {body: inverse(by) for body, by in moved.items()}

    def along(joint):
        z, turns = sp.Rational(f"{rng.uniform(-1, 1):.6f}"), int(rng.integers(0, 4))
        own = (Translation((0, 0, z)), Rotation("z", sp.pi / 2 * turns))
        return own if joint.kind == "revolute" else ()

    joints = []
    for joint in mechanism.joints:
        own = along(joint)
        before = (*back.get(joint.parent, ()), *joint.before, *own)
        after = (*inverse(own), *joint.after, *moved[joint.link])
        joints.append(replace(joint, before=before, after=after))

    def frame(of):
        return replace(of, placement=(*back.get(of.body, ()), *of.placement))

    struts = tuple(replace(s, a=frame(s.a), b=frame(s.b)) for s in mechanism.struts)
    closures = tuple(replace(c, a=frame(c.a), b=frame(c.b)) for c in mechanism.closures)
    tool = (*back.get(mechanism.tool_body, ()), *mechanism.tool)
    return replace(mechanism, joints=tuple(joints), struts=struts, closures=closures, tool=tool)


@pytest.mark.parametrize("name", ["delta", "five_bar", "slider_crank"])
def test_design_difference_ignores_choice_of_frames(name):
    robot = read(ROBOTS / f"{name}.toml")
    moved, turned = apart(in_other_frames(robot), robot)
    assert moved < 1e-7
    assert turned < 1e-7


def test_design_difference_measures_length_errors():
    spoilt = as_built(design(), BOARD_INSTALLER, 5e-4, np.random.default_rng(0))
    moved, turned = apart(spoilt, design())
    # Each body position has errors of up to 0.5 mm along three axes.
    assert 2e-4 < moved < 1.2e-3
    assert turned < 1e-3
    again = apart(in_other_frames(spoilt), design())
    np.testing.assert_allclose(again, (moved, turned), atol=1e-6)


def test_design_difference_detects_axis_and_zero_errors():
    robot = design()
    off = Rotation("z", sp.Rational(2, 1000))

    def with_joint(name, **changes):
        joints = tuple(
            replace(j, **{k: (*getattr(j, k), of) for k, of in changes.items()})
            if j.name == name
            else j
            for j in robot.joints
        )
        return replace(robot, joints=joints)

    # The zero position of a motor is identifiable, whereas the zero position of a passive joint is
    # arbitrary.
    assert apart(with_joint("crank", before=off), robot)[1] == pytest.approx(2e-3, rel=0.05)
    tilted = with_joint("yaw", before=Rotation("x", sp.Rational(2, 1000)))
    assert 5e-4 < apart(tilted, robot)[1] < 3e-3
    shift = with_joint("pitch", before=Translation((sp.Rational(1, 1000), 0, 0)))
    assert 2e-4 < apart(shift, robot)[0] < 1.1e-3
