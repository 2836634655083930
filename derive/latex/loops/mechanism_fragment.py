r"""Prints the description of a robot with loops."""

from collections.abc import Sequence

import sympy as sp

from ...chain.poe import placement_matrix
from ...model.mechanism import Coordinate, Drive, Frame, Strut
from ...model.robot import Joint, Placement
from ..chain import tables
from ..chain.given_fragment import UNITS_OF_TABLES, joints, noted, values
from ..chain.tables import NONE, Column, tabular
from ..setting.layout import aligned
from ..setting.names import escape
from ..setting.page import listed, sentence, text
from .loop_page import LoopPage

CLOSURES = {"pin": "pin", "slider": "slider", "ball": "ball", "weld": "weld"}


def description(page: LoopPage) -> str:
    """Print the coordinates, joints, loop closures, struts, drives and parameters of a robot."""
    shown = text(
        _coordinates(page),
        _followers(page),
        sentence(
            r"The main chain leads from the base to the tool; its joints are"
            rf" {listed(page.members.theta)}."
        ),
        joints(page.chain),
        _others(page),
        _closures(page),
        _struts(page),
        _couplings(page),
        values(page.chain),
    ).rstrip()
    return text(shown, tables.legend(shown), noted(page.mechanism))


def _coordinates(page: LoopPage) -> str:
    coordinates = page.mechanism.coordinates
    columns: list[Column] = [
        ("$q$", [f"${tex}$" for tex in page.members.q]),
        ("coordinate", [escape(c.name) for c in coordinates]),
        ("moves", [_moved(page, c) for c in coordinates]),
        ("unit", [c.unit for c in coordinates]),
        ("limits", [tables.marked(tables.limits(c.limits), c.assumed) for c in coordinates]),
    ]
    return sentence(
        f"{UNITS_OF_TABLES} The actuated coordinates are",
        tabular(columns, repeated=1),
    )


def _moved(page: LoopPage, c: Coordinate) -> str:
    symbol = page.joints[c.moves]
    if c.name != c.moves:
        ratio = page.printed_terms.constant(c.ratio)
        q = page.members.q[page.mechanism.coordinates.index(c)]
        advance = f"${page.tex(symbol)} = {page.tex(ratio)}\\,{q}$"
        (drive,) = (drive for drive in page.mechanism.drives if drive.name == c.name)
        return tables.marked(f"{advance}{_by(drive)}", drive.assumed)
    if page.members.of[c.moves] in page.members.q:
        return "cylinder" if isinstance(page.mechanism.members[c.moves], Strut) else "joint"
    return f"${page.tex(symbol)}$"


def _by(drive: Drive) -> str:
    return "" if drive.kind == "gear" else f", {drive.kind}"


def _followers(page: LoopPage) -> str:
    message = []
    for drive in page.mechanism.followers.values():
        symbol = page.tex(page.joints[drive.joint])
        ratio = page.tex(page.printed_terms.constant(drive.ratio))
        formula = tables.marked(f"${symbol} / {ratio}$", drive.assumed)
        message.append(f"the motor {escape(drive.name)} rotates by {formula}{_by(drive)}")
    return f"Drives of joints that are not actuated: {'; '.join(message)}." if message else ""


def _others(page: LoopPage) -> str:
    main = {joint.name for joint in page.chain.robot.joints}
    others = [joint for joint in page.mechanism.joints if joint.name not in main]
    if not others:
        return ""
    columns: list[Column] = [
        ("joint", [escape(joint.name) for joint in others]),
        ("variable", [_variable(page, joint) for joint in others]),
        ("type", [tables.TYPES[joint.kind] for joint in others]),
        ("parent", [_body(page, joint.parent) for joint in others]),
        ("child", [_body(page, joint.link) for joint in others]),
        ("at", [_point(page, joint.before) for joint in others]),
        ("axis", [_axis(page, joint) for joint in others]),
    ]
    return sentence(
        "The other joints, each at a point of its parent body, are",
        tabular(columns, repeated=1, apart="at"),
    )


def _variable(page: LoopPage, joint: Joint) -> str:
    return NONE if joint.kind == "fixed" else f"${page.tex(page.joints[joint.name])}$"


def _axis(page: LoopPage, joint: Joint) -> str:
    if joint.kind == "fixed":
        return NONE
    return _vector(page, placement_matrix(joint.before)[:3, 2] * joint.direction)


def _closures(page: LoopPage) -> str:
    closures = page.mechanism.closures
    if not closures:
        return ""
    columns: list[Column] = [
        ("closure", [escape(closure.name) for closure in closures]),
        ("type", [CLOSURES[closure.kind] for closure in closures]),
        *_frames(page, [(closure.a, closure.b) for closure in closures]),
    ]
    return sentence("Loops are closed by", tabular(columns, repeated=1, apart="from"))


def _struts(page: LoopPage) -> str:
    struts = page.mechanism.struts
    if not struts:
        return ""
    columns: list[Column] = [
        ("member", [escape(strut.name) for strut in struts]),
        ("length", [_length(page, strut) for strut in struts]),
        ("ends", [_ends(strut) for strut in struts]),
    ]
    if any(strut.ends == "pin" for strut in struts):
        columns.append(("angle", [_angle(page, strut) for strut in struts]))
    columns += _frames(page, [(strut.a, strut.b) for strut in struts])
    kinds = [
        word
        for word, is_cylinder in (("rods of constant length", False), ("cylinders", True))
        if any(strut.is_cylinder is is_cylinder for strut in struts)
    ]
    begin = "Loops are also closed by" if page.mechanism.closures else "Loops are closed by"
    table = tabular(columns, repeated=1, apart="from")
    return sentence(f"{begin} {' and '.join(kinds)}:", table)


def _couplings(page: LoopPage) -> str:
    """Print each coupled joint as a linear function of the joints that it follows."""
    rows = []
    for coupling in page.mechanism.couplings:
        ratios = [
            page.printed_terms.constant(ratio) * page.joints[name]
            for name, ratio in coupling.ratios
        ]
        total = sp.Add(*ratios, page.constant(coupling.offset))
        rows.append(
            (page.tex(page.joints[coupling.joint]), page.printed_terms.printer.terms(total))
        )
    return sentence("Couplings between joints are", aligned(rows)) if rows else ""


def _ends(strut: Strut) -> str:
    return "universal joint and ball" if strut.has_universal else f"{strut.ends}s"


def _angle(page: LoopPage, strut: Strut) -> str:
    return f"${page.tex(page.joints[strut.swing_name])}$" if strut.ends == "pin" else NONE


def _length(page: LoopPage, strut: Strut) -> str:
    length = page.printed_terms.exact(sp.cancel(strut.length))
    variable = page.joints[strut.name] if strut.is_cylinder else sp.S.Zero
    is_assumed = bool({"length", "retracted"} & {*strut.assumed})
    return tables.marked(f"${page.tex(length + variable)}$", is_assumed)


def _frames(page: LoopPage, frames: Sequence[tuple[Frame, Frame]]) -> list[Column]:
    return [
        column
        for k, word in enumerate(("from", "to"))
        for column in (
            (word, [_body(page, pair[k].body) for pair in frames]),
            ("at", [_attached(page, pair[k]) for pair in frames]),
        )
    ]


def _body(page: LoopPage, name: str) -> str:
    return "base" if name == page.mechanism.base_frame else escape(name)


def _attached(page: LoopPage, frame: Frame) -> str:
    return tables.marked(_point(page, frame.placement), frame.assumed)


def _point(page: LoopPage, placement: Placement) -> str:
    return _vector(page, placement_matrix(placement)[:3, 3])


def _vector(page: LoopPage, vector: sp.Matrix) -> str:
    return f"$({', '.join(page.tex(page.constant(entry)) for entry in vector)})$"
