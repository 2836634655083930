"""Tables of parameters in an article: fields of the convention, and columns of the variables."""

import re

import pytest
import sympy as sp
from exact_joints import R, joint

from chasles.derive import Joint, Robot, derive, from_urdf, load
from chasles.derive.description.conventions import CONVENTIONS
from chasles.derive.latex import fragments
from chasles.derive.latex.setting.names import parameter


def urdf(folder, *joints):
    """A chain of URDF joints, each its name, type, axis, roll and more elements."""
    parts = ['<robot name="chain"><link name="l0"/>']
    for k, (name, kind, axis, roll, more) in enumerate(joints, 1):
        parts.append(
            f'<link name="l{k}"/><joint name="{name}" type="{kind}"><parent link="l{k - 1}"/>'
            f'<child link="l{k}"/><origin xyz="0.1 0.2 0.5" rpy="{roll} 0 0.3"/>'
            f'<axis xyz="{axis}"/>{more}<limit lower="-2" upper="2"/></joint>'
        )
    path = folder / "chain.urdf"
    path.write_text("\n".join([*parts, "</robot>"]))
    return from_urdf(path)


SLIDERS = [("sx", "1 0 0"), ("sy", "0 1 0"), ("sz", "0 0 1")]


def test_a_slider_of_a_urdf_has_its_variable_in_a_column_of_its_own(tmp_path):
    robot = urdf(tmp_path, *((name, "prismatic", axis, "0", "") for name, axis in SLIDERS))
    table = fragments(derive(robot))["parameters.tex"]
    roll, pitch, yaw = (rf"$\mathrm{{{angle}}}$" for angle in ("roll", "pitch", "yaw"))
    assert rf"$x$ & $y$ & $z$ & {roll} & {pitch} & {yaw} \\" in table
    assert r"$e_x$ & $e_y$ & $e_z$ & $q$ & limits" in table
    for k, (name, axis) in enumerate(SLIDERS, 1):
        e = " & ".join(f"${x}$" for x in axis.split())
        assert f"{k} & {name} & P & $0.1$ & $0.2$ & $0.5$ & $0$ & $0$ & $0.3$ " in table
        assert f"{k} & {e} & $q_{{{k}}}$ & $\\pm 2$" in table


def test_both_spellings_of_urdf_print_the_same_table(tmp_path):
    robot = urdf(tmp_path, *((name, "prismatic", axis, "0", "") for name, axis in SLIDERS))
    joints = [
        f'[[joints]]\nname = "{name}"\ntype = "prismatic"\nxyz = ["0.1", "0.2", "0.5"]\n'
        f'rpy = [0, 0, "0.3"]\naxis = [{", ".join(axis.split())}]\nlimits = [-2, 2]\n'
        for name, axis in SLIDERS
    ]
    path = tmp_path / "chain.toml"
    path.write_text("\n".join(['name = "chain"\nconvention = "urdf"\n', *joints]))
    tables = [fragments(derive(one))["parameters.tex"] for one in (robot, load(path))]
    assert tables[0] == tables[1]


@pytest.mark.parametrize("convention", ["urdf", "poe"])
@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
def test_variables_without_a_field_count_the_other_way(convention, kind):
    axis = (R(1), R(0), R(0))
    at = {"urdf": {"xyz": (0, 0, R(1, 2)), "rpy": (0, 0, 0)}, "poe": {"point": (0, 0, R(1, 2))}}
    vectors = {f: tuple(map(sp.sympify, v)) for f, v in at[convention].items()} | {"axis": axis}
    before, after = CONVENTIONS[convention].place(kind, **vectors)
    given = [(f"{f}_{c}", x) for f, v in vectors.items() for c, x in zip("xyz", v, strict=True)]
    back = Joint(
        "back", kind, before, after, direction=-1, convention=convention, given=tuple(given)
    )
    table = fragments(derive(Robot("one", (back,))))["parameters.tex"]
    assert "$q$ & limits" in table
    assert "& $-q_{1}$ & --" in table
    assert "& $0.5$ " in table


@pytest.mark.parametrize(
    ("convention", "turning", "sliding"),
    [
        ("dh", "theta", "d"),
        ("mdh", "theta", "d"),
        ("hayati", "theta", None),
        ("mdh5", "theta", None),
        ("hayati5", "theta", "d"),
        ("s_model", "theta", "z"),
    ],
)
def test_variables_stand_in_the_columns_of_their_conventions(convention, turning, sliding):
    joints = (joint("turn", convention), joint("slide", convention, "prismatic"))
    table = fragments(derive(Robot("two", joints)))["parameters.tex"]
    header, *rows = re.findall(r"^(?:\$i\$|\d) & .*(?= \\\\)", table, re.MULTILINE)
    headings = header.split(" & ")
    for row, field, q in zip(rows, (turning, sliding), ("$q_{1}$", "$q_{2}$"), strict=True):
        cells = dict(zip(headings, row.split(" & "), strict=True))
        assert [head for head, cell in cells.items() if cell == q] == [
            f"${parameter(field)}$" if field else "$q$"
        ]
    assert (r"right after $R_z(\theta)$" in table) == (sliding is None)


def test_moving_joints_are_numbered_where_some_are_fixed(tmp_path):
    robot = urdf(
        tmp_path,
        ("mount", "fixed", "1 0 0", "0", ""),
        ("leader", "revolute", "0 0 1", "0", ""),
        ("bracket", "fixed", "1 0 0", "0", ""),
        ("led", "revolute", "0 0 1", "0", '<mimic joint="leader" multiplier="2"/>'),
    )
    found = fragments(derive(robot))
    table, screws = found["parameters.tex"], found["screws.tex"]
    assert "$i$ & $k$ & joint" in table
    for row in ("1 & -- & mount", "2 & 1 & leader", "3 & -- & bracket", "4 & 2 & led"):
        assert row in table
    assert "3 & -- & -- & -- & --" in table
    assert "Moving joint 2 follows moving joint 1." in table
    assert r"\theta_{2} = 2 q_{1}" in screws
    assert r"$\mathcal{S}_{k} = (v_{k}; \omega_{k})$" in screws


def test_snapped_angles_make_a_sentence(tmp_path):
    half, tiny = "3.14159265358979", "1.2e-16"
    joints = [("a_1", half), ("b", tiny), ("c", half)]
    robot = urdf(tmp_path, *((name, "revolute", "0 0 1", roll, "") for name, roll in joints))
    table = fragments(derive(robot))["parameters.tex"]
    assert (
        r"Angles within $10^{-9}$ of a multiple of $\pi/12$ were taken as that multiple: "
        r"$3.14159265358979$ as $\pi$ (roll of a\_\allowbreak{}1, roll of c), "
        r"$1.2 \cdot 10^{-16}$ as $0$ (roll of b)."
    ) in table
