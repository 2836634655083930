r"""The fragments that say what is given: parameters by convention, and the short symbols."""

from collections.abc import Sequence

import sympy as sp

from . import tables
from .layout import aligned
from .names import escape
from .notation import COMMAS_FROM
from .page import Page, sentence, text
from .transforms import transform

FEW = 4
"""Names that a sentence joins by "and"; more are a mere list."""


def parameters(page: Page) -> str:
    """The joints in their own conventions, and the values of the parameters."""
    robot, equations = page.derivation.robot, page.equations
    runs = tables.joint_tables(robot, equations.notation, equations.printer)
    joints = [sentence(_introduced(convention), table) for convention, table in runs]
    values = ""
    if robot.parameters:
        table = tables.value_table(robot, equations.printer)
        values = sentence("The parameters have the default values", table)
    notes = " ".join(escape(note) for note in robot.notes)
    return text(_coordinates(page), *joints, _legend(page), values, notes)


def symbols(page: Page) -> str:
    """The table of short symbols, and the rules by which they are made."""
    notation, printer = page.equations.notation, page.equations.printer
    table = tables.symbol_table(notation, printer)
    constants = ""
    if notation.constants:
        table_of_constants = tables.constant_table(notation, printer)
        constants = sentence("The named constants are", table_of_constants)
    return text(sentence(" ".join(_rules(page)), table), constants)


def _coordinates(page: Page) -> str:
    notation = page.equations.notation
    joints = dict(zip(notation.q, page.derivation.robot.coordinates, strict=True))
    parts = []
    for unit, one, many in (
        ("rad", "is an angle in radians", "are angles in radians"),
        ("m", "is a displacement in metres", "are displacements in metres"),
    ):
        names = [f"${notation.tex[q]}$" for q, joint in joints.items() if joint.unit == unit]
        if names:
            parts.append(f"{_listed(names)} {one if len(names) == 1 else many}")
    subject = "The joint coordinate" + ("s" if len(joints) > 1 else "")
    if len(parts) > 1:
        return f"Of the joint coordinates, {parts[0]} and {parts[1]}."
    return f"{subject} {parts[0]}."


def _listed(names: Sequence[str]) -> str:
    if len(names) > FEW:
        return rf"{names[0]}, \dots, {names[-1]}" if _consecutive(names) else ", ".join(names)
    return " and ".join(filter(None, [", ".join(names[:-1]), names[-1]]))


def _consecutive(names: Sequence[str]) -> bool:
    numbers = [int(name.strip("$q_{}")) for name in names]
    return numbers == list(range(numbers[0], numbers[0] + len(numbers)))


def _introduced(convention: str) -> str:
    words = tables.CONVENTION_NAMES.get(convention)
    if convention in tables.FORMULAS:
        _, formula = tables.FORMULAS[convention]
        link = transform("i-1", "i")
        return sentence(f"In {words},", aligned([(link, [formula])], end=","), "the joints are")
    return f"The joints are given by {words}:" if words else "The joints are"


def _legend(page: Page) -> str:
    """What the tables' abbreviations mean, for those that occur, and how joints are coupled."""
    joints = page.derivation.robot.joints
    kinds = {joint.kind for joint in joints}
    if kinds == {"revolute"}:
        sentences = ["All joints are revolute."]
    else:
        types = [f"{short} is {kind}" for kind, short in tables.TYPES.items() if kind in kinds]
        sentences = [f"Type {', '.join(types)}."]
    limits = [limit for joint in joints for limit in joint.limits if limit is not None]
    if not all(limit.has(sp.pi) for limit in limits):
        sentences.append("Limits without a degree sign are in radians or metres.")
    number = {joint.name: k for k, joint in enumerate(joints, 1)}
    for k, joint in enumerate(joints, 1):
        if joint.kind == "helical":
            pitch = page.tex(joint.pitch)
            sentences.append(rf"Joint {k} advances by ${pitch}$ (m) per radian.")
        if joint.mimic is not None:
            sentences.append(f"Joint {k} follows joint {number[joint.mimic.leader]}.")
    return " ".join(sentences)


def _rules(page: Page) -> list[str]:
    notation = page.equations.notation
    c, s = notation.letters["cos"], notation.letters["sin"]
    rules = [rf"Cosines and sines are written ${c}_i = \cos q_i$ and ${s}_i = \sin q_i$."]
    angles = notation.angles
    if any(len(angle.free_symbols & set(notation.q)) > 1 for angle in angles):
        comma = "," if len(notation.q) >= COMMAS_FROM else ""
        rules.append(rf"Joined indices stand for a sum, ${c}_{{i{comma}j}} = \cos(q_i + q_j)$.")
    if any(":" in index for _, index in angles.values()):
        rules.append(r"A range $i{:}j$ stands for all indices from $i$ to $j$.")
    if any(r"\bar" in index for _, index in angles.values()):
        rules.append("A barred index is subtracted.")
    if any(accent != "{}" for accent, _ in angles.values()):
        rules.append("An accent marks an angle with a constant or a factor, given in the table.")
    return rules
