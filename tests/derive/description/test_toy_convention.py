"""A test adds a new link convention that the compiler does not know.

The new convention reorders the elementary motions of a Denavit-Hartenberg link: Rx(alpha) Tx(a)
Tz(d) Rz(theta). For this convention, a formula selected by the convention's name would be wrong.
"""

import pytest
import sympy as sp

from chasles.derive import DescriptionError, Mechanism, derive, read, read_text
from chasles.derive.description.conventions import CONVENTIONS
from chasles.derive.latex import fragments
from chasles.derive.model.convention import Convention, Field, of_transform
from chasles.derive.model.placements import align_z, inverse, rotation, translation

twist, reach, rise, spin = sp.symbols("twist reach rise spin", real=True)
toy = of_transform(
    "toy",
    (
        Field("reach", "length"),
        Field("twist", "angle"),
        Field("rise", "length"),
        Field("spin", "angle"),
    ),
    rotation("x", twist)
    + translation(reach, sp.S.Zero, sp.S.Zero)
    + translation(sp.S.Zero, sp.S.Zero, rise)
    + rotation("z", spin),
    source="this test",
    words="the toy convention",
    turning="spin",
    sliding="rise",
)
FILE = """name = "toy_arm"
convention = "toy"
units = { length = "mm", angle = "deg" }
[parameters]
l1 = 300
[[joints]]
name = "shoulder"
twist = 30
rise = 120
[[joints]]
name = "elbow"
reach = "l1"
twist = 90
spin = 45
[[joints]]
name = "slide"
type = "prismatic"
reach = 50
rise = 20
"""
q1, q2, q3, l1 = sp.symbols("q1 q2 q3 l1", real=True)
WITH_TOY = (*CONVENTIONS, toy)


def Rx(angle):
    c, s = sp.cos(angle), sp.sin(angle)
    return sp.Matrix([[1, 0, 0, 0], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1]])


def Rz(angle):
    c, s = sp.cos(angle), sp.sin(angle)
    return sp.Matrix([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])


def T(x, y, z):
    return sp.Matrix([[1, 0, 0, x], [0, 1, 0, y], [0, 0, 1, z], [0, 0, 0, 1]])


def by_hand():
    mm, deg = sp.Rational(1, 1000), sp.pi / 180
    first = Rx(30 * deg) * T(0, 0, 120 * mm) * Rz(q1)
    second = Rx(90 * deg) * T(l1, 0, 0) * Rz(45 * deg + q2)
    return first * second * T(50 * mm, 0, 20 * mm + q3)


def is_zero(M):
    return M.applyfunc(lambda e: sp.expand(sp.expand(e, trig=True))) == sp.zeros(*M.shape)


def test_fk_in_custom_convention_matches_hand_calculation():
    robot = read_text(FILE, conventions=WITH_TOY)
    (entries,) = derive(robot, functions=["fk"]).function("fk").expanded()
    assert is_zero(sp.Matrix(4, 4, entries) - by_hand())


def test_article_prints_table_and_transform_of_custom_convention():
    robot = read_text(FILE, conventions=WITH_TOY)
    table = fragments(derive(robot))["parameters.tex"]
    assert "In the toy convention," in table
    symbols = [rf"\mathit{{{name}}}" for name in ("twist", "reach", "rise", "spin")]
    assert r"R_x({})\,T_x({})\,T_z({})\,R_z({})".format(*symbols) in table
    assert r"& type & ${}$ & ${}$ & ${}$ & ${}$ & limits \\".format(*symbols) in table
    assert r"1 & shoulder & R & $\pi/6$ & $0$ & $0.12$ & $q_{1}$ & -- \\" in table
    assert r"2 & elbow & R & $\pi/2$ & $l_{1}$ & $0$ & $q_{2} + \pi/4$ & -- \\" in table
    assert r"3 & slide & P & $0$ & $0.05$ & $q_{3} + 0.02$ & $0$ & -- \\" in table


def test_custom_convention_is_known_only_to_its_call(tmp_path):
    path = tmp_path / "toy_arm.toml"
    path.write_text(FILE)
    assert read(path, conventions=WITH_TOY).joints[0].convention is toy
    with pytest.raises(DescriptionError, match="one of dh, mdh"):
        read(path)
    assert toy not in CONVENTIONS


def test_unknown_field_of_custom_convention_is_named():
    with pytest.raises(DescriptionError, match=r"joints\[1\].alpha: expected one of the fields"):
        read_text(FILE.replace("twist = 30", "alpha = 30"), conventions=WITH_TOY)
    with pytest.raises(DescriptionError, match="'toy' has no field alpha; fields: reach, twist"):
        toy("revolute", alpha=0)


def test_mechanism_file_accepts_custom_convention():
    text = FILE.replace("[parameters]", 'actuated = ["shoulder", "elbow", "slide"]\n[parameters]')
    robot = read_text(text, conventions=WITH_TOY)
    assert isinstance(robot, Mechanism)
    (entries,) = derive(robot, functions=["fk"]).function("fk").expanded()
    assert is_zero(sp.Matrix(4, 4, entries) - by_hand())


def test_joint_motion_must_be_rotation_or_translation_along_z():
    fields = (Field("spin", "angle"),)
    with pytest.raises(
        DescriptionError, match="'spin': expected a rotation about z or a translation"
    ):
        of_transform("no", fields, rotation("x", spin), source="", words="", turning="spin")


def test_custom_convention_with_vector_fields_is_derived_and_printed():
    """The new link convention has z-y-x Euler angles, a position, and a motion direction."""

    def place(kind, *, at, zyx, along):
        z, y, x = zyx
        there = translation(*at) + rotation("z", z) + rotation("y", y) + rotation("x", x)
        return there + align_z(along), inverse(align_z(along))

    fields = (
        Field("at", "lengths", ("x", "y", "z")),
        Field("zyx", "angles", (r"\psi", r"\vartheta", r"\phi")),
        Field("along", "direction", ("e_x", "e_y", "e_z"), needed_to="the joint's direction"),
    )
    euler = Convention("euler", fields, place, source="this test", words="positions and angles")
    text = 'name = "arm"\nconvention = "euler"\n[[joints]]\nat = [1, 0, "1/2"]\nalong = [0, 1, 0]\n'
    robot = read_text(text, conventions=(euler,))
    found = derive(robot)
    (entries,) = found.function("fk").expanded()
    c, s = sp.cos(q1), sp.sin(q1)
    half = sp.Rational(1, 2)
    expected = sp.Matrix([[c, 0, s, 1], [0, 1, 0, 0], [-s, 0, c, half], [0, 0, 0, 1]])
    assert is_zero(sp.Matrix(4, 4, entries) - expected)
    table = fragments(found)["parameters.tex"]
    assert "The joints are given by positions and angles and their variables $q$:" in table
    assert r"$x$ & $y$ & $z$ & $\psi$ & $\vartheta$ & $\phi$ & $e_x$ & $e_y$ & $e_z$" in table
    with pytest.raises(
        DescriptionError, match=r"joints\[1\].along: expected the joint's direction"
    ):
        read_text(text.replace("along = [0, 1, 0]\n", ""), conventions=(euler,))
