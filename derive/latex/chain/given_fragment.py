r"""Prints the description of a robot as LaTeX."""

import re
from collections.abc import Sequence

from ...model.cleaning import rounded_up
from ...model.convention import Convention, motions_before
from ...model.mechanism import Mechanism
from ...model.robot import SerialRobot
from ..setting.layout import aligned
from ..setting.names import escape, head
from ..setting.notation import COMMAS_FROM, Notation
from ..setting.page import Page, sentence, text
from ..setting.printer import Printer
from ..setting.transforms import symbolic_factors, transform
from . import tables

UNITS_OF_TABLES = (
    r"Equations and tables are in meters and radians; angles with the sign $^\circ$ are in degrees."
)
MAX_RUNS = 2
"""Maximum number of joint tables. A robot whose conventions need more joint tables gets one table
of all link transforms."""
FEW = 4
"""Maximum number of consecutive symbols that are printed one by one. A longer list of consecutive
symbols is shortened with dots."""


def parameters(page: Page, vector: str = "q") -> str:
    """Print the joint tables and the parameter values.

    Args:
        page: The chain.
        vector: LaTeX name of the vector of the robot's coordinates.
    """
    given = text(_coordinates(page, vector), joints(page), values(page)).rstrip()
    legend = tables.legend(given)
    return text(given, legend, cleaned(page.robot), noted(page.robot))


def joints(page: Page) -> str:
    """Print the joint tables and explain their abbreviations."""
    notation = page.equations.notation
    # The joint tables print numeric lengths as decimals.
    printer = Printer(notation.tex, notation.order)
    runs = tables.joint_tables(page.robot, notation, printer)
    if len(runs) > MAX_RUNS:
        table = tables.transform_table(page.robot, notation, printer)
        introduced = (
            "The joints are given in several conventions. Their link transforms, as products of"
            " elementary motions, are"
        )
        return text(sentence(introduced, table), _legend(page)).rstrip()
    shown = [sentence(_introduced(convention, notation), table) for convention, table in runs]
    return text(*shown, _legend(page)).rstrip()


def values(page: Page) -> str:
    """Print the values of the parameters, if the robot has any."""
    if not page.robot.parameters:
        return ""
    table = tables.value_table(page.robot, page.equations.printer)
    return sentence("The parameters have the default values", table)


def symbols(page: Page) -> str:
    """Print the table of the short symbols in the equations.

    The returned text is empty if the equations contain neither angles nor named constants.
    """
    notation, printer = page.equations.notation, page.equations.printer
    angles = ""
    if notation.angles or tables.constant_angles(notation):
        angles = sentence(" ".join(_rules(page)), tables.symbol_table(notation, printer))
    constants = ""
    if notation.constants:
        table_of_constants = tables.constant_table(notation, printer)
        long = tables.long_constants(notation, printer)
        constants = sentence(
            "The named constants are",
            table_of_constants,
            sentence("where", aligned(long)) if long else "",
        )
    return text(angles, constants) if angles or constants else ""


def _coordinates(page: Page, vector: str) -> str:
    notation = page.equations.notation
    joints = dict(zip(notation.q, page.robot.coordinates, strict=True))
    parts = []
    for unit, one, many in (
        ("rad", "is an angle", "are angles"),
        ("m", "is a displacement", "are displacements"),
    ):
        names = [f"${notation.tex[q]}$" for q, joint in joints.items() if joint.unit == unit]
        if names:
            parts.append(f"{_listed(names)} {one if len(names) == 1 else many}")
    units = UNITS_OF_TABLES
    subject = "joint coordinates" if " are " in parts[0] else "joint coordinate"
    if notation.called:
        entries = ", ".join(notation.tex[q] for q in notation.q)
        return f"{units} The {subject} are ${vector} = ({entries})$, where {' and '.join(parts)}."
    if len(parts) > 1:
        return f"{units} {subject.capitalize()} {parts[0]}, and {parts[1]}."
    return f"{units} The {subject} {parts[0]}."


def _listed(names: Sequence[str]) -> str:
    if len(names) > FEW and _consecutive(names):
        return rf"{names[0]}, \dots, {names[-1]}"
    return " and ".join(filter(None, [", ".join(names[:-1]), names[-1]]))


def _consecutive(names: Sequence[str]) -> bool:
    first = re.fullmatch(r"\$q_\{(\d+)\}\$", names[0])
    return first is not None and list(names) == [
        f"$q_{{{int(first[1]) + k}}}$" for k in range(len(names))
    ]


def _introduced(convention: Convention | None, notation: Notation) -> str:
    if convention is None:
        return "The joints are"
    if convention.transform:
        formula = r"\,".join(symbolic_factors(convention.transform))
        link = transform("i-1", "i")
        opening = f"In {convention.words},"
        return sentence(opening, aligned([(link, [formula])], end=","), "the joints are")
    variables = "their variables" if notation.called else "their variables $q$"
    return f"The joints are given by {convention.words} and {variables}:"


def _legend(page: Page) -> str:
    robot = page.robot
    kinds = {joint.kind for joint in robot.joints}
    if kinds == {"revolute"}:
        sentences = ["All joints are revolute."]
    else:
        types = [f"{short} is {kind}" for kind, short in tables.TYPES.items() if kind in kinds]
        sentences = [f"Type {', '.join(types)}."]
    sentences += _displacements(robot)
    one = "joint"
    if tables.counts_moving(robot):
        one = "moving joint"
        sentences.append("The index $k$ counts the moving joints and the screw axes.")
    count = tables.moving_numbers(robot)
    for joint in robot.moving:
        this = f"{one.capitalize()} {count[joint.name]}"
        if joint.kind == "helical":
            sentences.append(f"{this} advances by ${page.tex(joint.pitch)}$ (m) per radian.")
    return " ".join(sentences)


def _displacements(robot: SerialRobot) -> list[str]:
    bare = [
        joint.convention
        for joint in robot.joints
        if joint.kind == "prismatic" and joint.convention and not tables.variable_field(joint)
    ]
    factors = []
    for convention in bare:
        if convention.turning:
            count = motions_before(convention.transform, convention.turning)
            factors += symbolic_factors(convention.transform[count - 1 : count])
    return [
        f"A displacement $q$ is along $z$, right after ${factor}$."
        for factor in dict.fromkeys(factors)
    ]


def cleaned(robot: SerialRobot) -> str:
    """Print the values changed by noise removal, and the change of the tool pose."""
    cleaning = robot.cleaning
    if not cleaning.numbers:
        return ""
    bounds = rf"${tables.scientific(rounded_up(cleaning.position))}$ m"
    if cleaning.orientation:
        bounds += rf" and ${tables.scientific(rounded_up(cleaning.orientation))}$ rad"
    opening = (
        "Rounded or noisy values in the file were replaced by exact values; in total, the"
        f" replacements change the pose of the tool by at most {bounds}:"
    )
    return sentence(opening, tables.cleaning_table(cleaning))


def noted(robot: SerialRobot | Mechanism) -> str:
    """Print the notes about a robot, except notes about values that noise removal replaced."""
    said = {robot.cleaning.line, *robot.cleaning.sentences}
    others = [escape(note) for note in robot.notes if note not in said]
    # LaTeX cannot hyphenate names and digits, so wide spaces between words are allowed.
    body = f"Notes: {'; '.join(others)}." if others else ""
    return f"\\begin{{sloppypar}}\n{body}\n\\end{{sloppypar}}" if body else ""


def _rules(page: Page) -> list[str]:
    notation = page.equations.notation
    c, s = notation.letters["cos"], notation.letters["sin"]
    q = "q"
    rules = []
    if notation.called:
        q, *others = {head(name) for name in notation.called}
        q = r"\theta" if others else q
        rules = [rf"Here ${q}_i$ stands for the coordinate of the $i$-th joint."]
    rules.append(rf"Cosines and sines are written ${c}_i = \cos {q}_i$ and ${s}_i = \sin {q}_i$.")
    angles = notation.angles
    if any(len(angle.free_symbols & set(notation.q)) > 1 for angle in angles):
        comma = "," if len(notation.q) >= COMMAS_FROM else ""
        rules.append(rf"Joined indices stand for a sum, ${c}_{{i{comma}j}} = \cos({q}_i + {q}_j)$.")
    if any(":" in index for _, index in angles.values()):
        rules.append(r"A range $i{:}j$ stands for all indices from $i$ to $j$.")
    if any(r"\bar" in index for _, index in angles.values()):
        rules.append("A barred index is subtracted.")
    if any(accent != "{}" for accent, _ in angles.values()):
        rules.append("An accent marks an angle with a constant or a factor, given in the table.")
    return rules
