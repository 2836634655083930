r"""Prints a table of joint parameters as CSV or LaTeX, in meter and radian.

All joints of the table have the same convention. Numbers in the table have 17 significant digits,
or more if the table contains lengths of 10 m or more.
"""

import csv
import io
from collections.abc import Iterator, Sequence

import sympy as sp

from ..description.pose_error import robot_size
from ..latex.setting.names import escape
from ..model.cleaning import decimal_places
from ..model.convention import Convention
from ..model.placements import Placement
from ..model.robot import Coupling, Joint, SerialRobot
from .number_text import digits_for, nearest
from .origins import placed

_POSE = ("xyz_x", "xyz_y", "xyz_z", "rpy_x", "rpy_y", "rpy_z")


def csv_table(robot: SerialRobot, convention: Convention) -> str:
    """Return the joint table as CSV, with rows for the base, each joint and the tool.

    The table has columns for directions, screw pitches, couplings and limits only if a joint needs
    them.
    """
    digits = digits_for(robot_size(robot))
    rules = {rule.joint: rule for rule in robot.couplings}
    joints = [_csv_row(joint, digits, rules.get(joint.name)) for joint in robot.joints]
    known = {name for row in joints for name in row}
    fields = [name for field in convention.fields for name in field.components]
    optional = ("direction", "pitch", "coupling", "lower", "upper")
    columns = ["name", "type", *fields, *(name for name in optional if name in known), *_POSE]
    text = io.StringIO()
    writer = csv.DictWriter(text, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerow(_pose_row(robot.base_frame, "base", robot.base, digits))
    writer.writerows(joints)
    writer.writerow(_pose_row(robot.tool_frame, "tool", robot.tool, digits))
    return text.getvalue()


def _csv_row(joint: Joint, digits: int, rule: Coupling | None) -> dict[str, str]:
    row = {"name": joint.name, "type": joint.kind}
    row |= {name: nearest(value, digits) for name, value in joint.given}
    if joint.direction != 1:
        row["direction"] = str(joint.direction)
    if joint.kind == "helical":
        row["pitch"] = nearest(joint.pitch)
    if rule is not None:
        parts = [f"{nearest(ratio)} * {name}" for name, ratio in rule.ratios]
        row["coupling"] = " + ".join([*parts, *([nearest(rule.offset)] if rule.offset else [])])
    limits = zip(("lower", "upper"), joint.limits, strict=True)
    return row | {name: nearest(limit) for name, limit in limits if limit is not None}


def _pose_row(name: str, kind: str, placement: Placement, digits: int) -> dict[str, str]:
    xyz, rpy = placed(placement)
    numbers = (nearest(value, digits) for value in (*xyz, *rpy))
    return {"name": name, "type": kind, **dict(zip(_POSE, numbers, strict=True))}


def latex_table(robot: SerialRobot, convention: Convention) -> str:
    r"""Return the joint table as a LaTeX `tabular`, which needs the package booktabs."""
    columns = [(name, heading) for _, name, heading in convention.columns]
    headings = ["joint", "type", *(f"${tex or _symbol(name)}$" for name, tex in columns)]
    rows = [_latex_row(robot, joint, [name for name, _ in columns]) for joint in robot.joints]
    if any(row[-1] for row in rows):
        headings.append("variable")
    rows = [row[: len(headings)] for row in rows]
    return "\n".join(_tabular(headings, rows, robot)) + "\n"


def _symbol(name: str) -> str:
    return name if len(name) == 1 else rf"\{name}"


def _tabular(
    headings: Sequence[str], rows: Sequence[Sequence[str]], robot: SerialRobot
) -> Iterator[str]:
    yield rf"\begin{{tabular}}{{@{{}}{'l' * len(headings)}@{{}}}}"
    yield r"\toprule"
    yield rf"{' & '.join(headings)} \\"
    yield r"\midrule"
    yield from (rf"{' & '.join(row)} \\" for row in rows)
    yield r"\bottomrule"
    yield r"\end{tabular}"
    for word, placement in (("Base", robot.base), ("Tool", robot.tool)):
        if placement:
            xyz, rpy = (f"({', '.join(map(_tex, v))})" for v in placed(placement))
            yield rf"\par {word}: position ${xyz}$ m, roll, pitch and yaw ${rpy}$ rad."


def _latex_row(robot: SerialRobot, joint: Joint, names: Sequence[str]) -> list[str]:
    assert joint.convention is not None
    given = dict(joint.given)
    variable = joint.convention.variable(joint.kind)
    cells = [
        _with_variable(robot, joint, given[name]) if name == variable else f"${_tex(given[name])}$"
        for name in names
    ]
    kind: str = joint.kind
    if kind == "helical":
        kind += f", ${_tex(joint.pitch)}$ m/rad"
    last = "" if variable in names else _with_variable(robot, joint, sp.S.Zero)
    return [escape(joint.name), kind, *cells, last]


def _with_variable(robot: SerialRobot, joint: Joint, constant: sp.Expr) -> str:
    k = [other.name for other in robot.moving].index(joint.name)
    own = robot.linear_map
    constant += joint.direction * own.c[k]
    shown = ""
    for index, ratio in enumerate(own.C.row(k), 1):
        factor = joint.direction * ratio
        if factor != 0:
            size = "" if abs(factor) == 1 else rf"{_tex(abs(factor))}\,"
            sign = "-" if factor < 0 else "+"
            shown += f"{f' {sign} ' if shown else sign.strip('+')}{size}q_{{{index}}}"
    if constant != 0 or not shown:
        sign = "-" if constant < 0 else "+"
        shown += f"{f' {sign} ' if shown else sign.strip('+')}{_tex(abs(constant))}"
    return f"${shown}$"


def _tex(value: sp.Expr) -> str:
    multiple = value / sp.pi
    if value != 0 and multiple.is_Rational:
        times = "" if abs(multiple.p) == 1 else str(abs(multiple.p))
        over = "" if multiple.q == 1 else f"/{multiple.q}"
        return rf"{'-' if multiple < 0 else ''}{times}\pi{over}"
    if not value.is_Rational or decimal_places(value) is not None:
        mantissa, _, exponent = nearest(value).partition("e")
        return rf"{mantissa} \cdot 10^{{{int(exponent)}}}" if exponent else mantissa
    return f"{value.p}/{value.q}"
