r"""Prints the tables about a robot, such as joint, parameter and symbol tables."""

from collections.abc import Callable, Mapping, Sequence
from itertools import groupby

import sympy as sp

from ...model.cleaning import CleanedNumber, Cleaning, decimal_places, places, rounded_up
from ...model.convention import Convention, Field
from ...model.kinds import UNITS
from ...model.robot import Joint, SerialRobot
from ...model.tolerances import PRINTED_DIGITS
from ..setting import names
from ..setting.layout import MARGIN, Equation
from ..setting.nested_roots import as_angle, as_trigonometric, is_nested
from ..setting.notation import CONSTANT_TRIGONOMETRY, Notation
from ..setting.printer import Printer, cut, decimal, number
from ..setting.transforms import factors, first_number, placements, transform, turned_back
from ..setting.widths import LINE, width

Column = tuple[str, list[str]]
"""Heading and cells of one table column."""
Angle = tuple[sp.Expr, tuple[str, str]]
"""An angle, together with the accent and the index of the symbols that represent its cosine and
sine."""
COLUMN_SEPARATION = 12.0
BLOCK_GAP = r"@{\hspace{2.5em}}"
WIDEST_TABLE = 450.0
"""Text width of the LaTeX article (pt), which is the maximum width of a table."""
FRACTION_STRUT = r"\rule[-1.1ex]{0pt}{3.5ex}"
"""Invisible LaTeX rule that adds space above and below a table row with a fraction."""
WIDEST = LINE / 2
"""Maximum width (pt) of a table cell. The text of a wider cell is broken into lines of this width.
"""
MAX_BLOCKS, LOWEST_BLOCK = 3, 4
"""Maximum number of side-by-side blocks of a narrow table, and minimum number of rows in a block.
"""
MAX_ROWS = 36
"""Maximum number of table rows on a page."""
TYPES = {"revolute": "R", "prismatic": "P", "helical": "H", "fixed": "F"}
NONE = "--"
ASSUMED = r"\,$^{\ast}$"
"""LaTeX mark of a value that the description assumes and its source does not state."""
LEGEND = r"An asterisk marks a value that the description assumes and its source does not state."


def joint_tables(
    robot: SerialRobot, notation: Notation, printer: Printer
) -> list[tuple[Convention | None, str]]:
    """Return one table for each sequence of consecutive joints with the same convention.

    Each table is a tuple ``(convention, LaTeX)``.
    """
    values = iter(robot.joint_values(notation.q))
    rows = [
        (i, joint, sp.Integer(0) if joint.kind == "fixed" else next(values))
        for i, joint in enumerate(robot.joints, first_number(robot))
    ]
    numbers = moving_numbers(robot) if counts_moving(robot) else {}
    variable = "variable" if notation.called else "$q$"
    tables = []
    for convention, run in groupby(rows, key=lambda row: row[1].convention):
        columns, second_part = _joint_columns(list(run), numbers, printer, variable)
        tables.append((convention, tabular(columns, repeated=1, apart=second_part)))
    return tables


def transform_table(robot: SerialRobot, notation: Notation, printer: Printer) -> str:
    """Return one table of all joints with their link transforms."""
    found = placements(robot, notation.q)[1 if robot.base else 0 :]
    shown = [r"\,".join(factors(turned_back(p), printer)) for p in found[: len(robot.joints)]]
    columns: list[Column] = [
        ("$i$", [str(i) for i, _ in enumerate(robot.joints, first_number(robot))]),
        ("joint", [names.escape(joint.name) for joint in robot.joints]),
        ("type", [TYPES[joint.kind] for joint in robot.joints]),
        (f"${transform('i-1', 'i')}$", [f"${tex}$" if tex else "$I$" for tex in shown]),
        ("limits", [_limits(joint) for joint in robot.joints]),
    ]
    return tabular(columns, repeated=1)


def counts_moving(robot: SerialRobot) -> bool:
    """Whether the moving joints are numbered separately, without counting the fixed joints."""
    return len(robot.moving) < len(robot.joints) and first_number(robot) == 1


def moving_numbers(robot: SerialRobot) -> dict[str, int]:
    """Return the numbers of the moving joints, keyed by joint name.

    A screw axis has the number of its moving joint.
    """
    return {joint.name: k for k, joint in enumerate(robot.moving, 1)}


def variable_field(joint: Joint) -> str:
    """Return the convention parameter that contains the joint variable, or "" if none does."""
    field = joint.convention.variable(joint.kind) if joint.convention else ""
    return field if field in dict(joint.given) else ""


def _joint_columns(
    run: Sequence[tuple[int, Joint, sp.Expr]],
    numbers: Mapping[str, int],
    printer: Printer,
    variable: str,
) -> tuple[list[Column], str]:
    columns: list[Column] = [("$i$", [str(i) for i, _, _ in run])]
    if numbers:
        columns.append(("$k$", [str(numbers.get(joint.name, NONE)) for _, joint, _ in run]))
    columns.append(("joint", [names.escape(joint.name) for _, joint, _ in run]))
    if any(joint.kind != "revolute" for _, joint, _ in run):
        columns.append(("type", [TYPES[joint.kind] for _, joint, _ in run]))
    second_part = ""
    convention = run[0][1].convention
    for field, scalar, symbol in convention.columns if convention else ():
        cells = [_cell(joint, field, scalar, value, printer) for _, joint, value in run]
        heading = f"${symbol or names.parameter(scalar)}$"
        if any(cell != NONE for cell in cells):
            columns.append((heading, cells))
        if convention and field.name == convention.second_part:
            second_part = second_part or heading
    if any(_has_column(joint) for _, joint, _ in run):
        columns.append((variable, [_variable(joint, value, printer) for _, joint, value in run]))
    columns.append(("limits", [_limits(joint) for _, joint, _ in run]))
    return columns, second_part


def _cell(joint: Joint, field: Field, scalar: str, value: sp.Expr, printer: Printer) -> str:
    given = dict(joint.given)
    if scalar not in given or (joint.kind == "fixed" and field.is_of_motion):
        return NONE
    cell = _math(printer, given[scalar] + (value if scalar == variable_field(joint) else 0))
    return marked(cell, field.name in joint.assumed)


def marked(cell: str, is_assumed: bool) -> str:
    """Format a table cell, and mark an assumed value."""
    return f"{cell}{ASSUMED}" if is_assumed and cell != NONE else cell


def legend(cells: str) -> str:
    """Return an explanation of the asterisk for assumed values, or "" without an asterisk."""
    return LEGEND if ASSUMED in cells else ""


def _limits(joint: Joint) -> str:
    return marked(limits(joint.limits), "limits" in joint.assumed)


def _has_column(joint: Joint) -> bool:
    return joint.kind != "fixed" and not variable_field(joint)


def _variable(joint: Joint, value: sp.Expr, printer: Printer) -> str:
    return _math(printer, value) if _has_column(joint) else NONE


def limits(bounds: tuple[sp.Expr | None, sp.Expr | None]) -> str:
    """Format a pair of limits as an interval."""
    lower, upper = bounds
    if lower is None and upper is None:
        return NONE
    if lower is None or upper is None:
        return rf"$\ge {_limit(lower)}$" if upper is None else rf"$\le {_limit(upper)}$"
    if lower == -upper:
        return rf"$\pm {_limit(upper)}$"
    return f"$[{_limit(lower)}, {_limit(upper)}]$"


def _limit(value: sp.Expr) -> str:
    degrees = value * 180 / sp.pi
    if value != 0 and degrees.is_Rational:
        return f"{number(degrees)}^\\circ"
    is_decimal = value != 0 and decimal_places(value) is not None
    return cut(value, PRINTED_DIGITS) if is_decimal else number(value)


def value_table(robot: SerialRobot, printer: Printer) -> str:
    """Return the table of the default parameter values, with units and meanings."""
    columns: list[Column] = [
        ("parameter", [_math(printer, p.symbol) for p in robot.parameters]),
        ("value", [marked(value_cell(p.value), p.assumed) for p in robot.parameters]),
        ("unit", [UNITS[p.kind] for p in robot.parameters]),
    ]
    if any(p.meaning for p in robot.parameters):
        columns.append(("meaning", [names.escape(p.meaning) for p in robot.parameters]))
    return tabular(columns, repeated=1)


def value_cell(value: sp.Expr) -> str:
    """Format an exact number.

    For an irrational number, the text also contains a decimal approximation.
    """
    exact = number(value)
    return f"${exact}$" if value.is_Rational else rf"${exact} \approx {decimal(value)}$"


def cleaning_table(cleaning: Cleaning) -> str:
    """Return the table of values in the robot file that were replaced by exact values."""
    rows: dict[tuple[str, str], list[CleanedNumber]] = {}
    largest = max((abs(entry.change) for entry in cleaning.numbers if entry.taken == 0), default=0)
    small = rf"up to ${scientific(rounded_up(largest))}$"
    for entry in cleaning.numbers:
        found = f"${_as_written(entry.found)}$" if entry.taken != 0 else small
        rows.setdefault((found, f"${number(entry.taken)}$"), []).append(entry)
    columns: list[Column] = [
        ("in the file", [found for found, _ in rows]),
        ("replaced by", [taken for _, taken in rows]),
        ("at", [names.escape(places(numbers)) for numbers in rows.values()]),
    ]
    return tabular(columns, repeated=1)


def _as_written(value: sp.Expr) -> str:
    if value.is_Rational:
        return cut(value, PRINTED_DIGITS)
    degrees = 180 * value / sp.pi
    return rf"{cut(degrees, PRINTED_DIGITS)}^\circ" if degrees.is_Rational else number(value)


def scientific(text: str) -> str:
    """Format a decimal number in LaTeX, with a power of ten."""
    digits, _, exponent = text.partition("e")
    return rf"{digits} \cdot 10^{{{int(exponent)}}}" if exponent else digits


def symbol_table(notation: Notation, printer: Printer) -> str:
    """Return the table of the symbols for the cosine and the sine of every angle."""
    rows = []
    for angle, (accent, index) in sorted(notation.angles.items(), key=_angle_key(notation)):
        c, s = (f"{accent.format(notation.letters[kind])}_{{{index}}}" for kind in ("cos", "sin"))
        rows.append((f"${c}$", f"${s}$", _math(printer, angle)))
    for symbol in constant_angles(notation):
        c, s = (f"${notation.letters[kind]}_{{{printer.tex(symbol)}}}$" for kind in ("cos", "sin"))
        rows.append((c, s, _math(printer, symbol)))
    return side_by_side(("$\\cos$", "$\\sin$", "of"), rows)


def constant_angles(notation: Notation) -> list[sp.Symbol]:
    """Return the parameters whose cosine or sine is abbreviated by a symbol."""
    found = {
        meaning.args[0]
        for symbol, meaning in notation.meanings.items()
        if notation.order[symbol][0] == CONSTANT_TRIGONOMETRY
    }
    return [symbol for symbol in notation.terms.parameters if symbol in found]


def constant_table(notation: Notation, printer: Printer) -> str:
    """Return the tables of named constants.

    A second table lists the decimal values of constants without a short exact form.
    """
    exact, decimals = [], []
    values = notation.values()
    for symbol in notation.constants:
        name, rounded = _math(printer, symbol), f"${decimal(values[symbol])}$"
        shown = _exact(notation.meanings[symbol], printer)
        if shown:
            exact.append((name, f"${shown}$", rounded))
        else:
            decimals.append((name, rounded))
    tables = []
    if exact:
        tables.append(side_by_side(("constant", "exact", r"$\approx$"), exact))
    if decimals:
        tables.append(side_by_side(("constant", r"$\approx$"), decimals))
    return "\n".join(tables)


def _exact(meaning: sp.Expr, printer: Printer) -> str:
    tex = printer.tex(meaning)
    if meaning.free_symbols:
        return tex if _is_exact(tex) else ""
    recognized = as_trigonometric(meaning) or as_angle(meaning)
    return recognized or (tex if _is_exact(tex) and not is_nested(meaning) else "")


def long_constants(notation: Notation, printer: Printer) -> list[Equation]:
    """Return the equations of named constants whose exact form is too wide for a table."""
    return [
        (printer.tex(symbol), printer.terms(meaning))
        for symbol, meaning in ((s, notation.meanings[s]) for s in notation.constants)
        if meaning.free_symbols and not _is_exact(printer.tex(meaning))
    ]


def _is_exact(tex: str) -> bool:
    return width(tex) < WIDEST and r"\ldots" not in tex


def tabular(columns: Sequence[Column], repeated: int, apart: str = "") -> str:
    """Print a table. A table that is too wide is split into parts.

    A table that is slightly wider than the text is centered.

    Args:
        columns: Heading and cells of each table column.
        repeated: Number of columns at the left that are repeated in every part of a split table.
        apart: Heading of the column at which a wide table is split.
    """
    parts = _parts(columns, repeated)
    heads = [heading for heading, _ in columns]
    if len(parts) > 1 and apart in heads:
        index = heads.index(apart)
        parts = _parts(columns[:index], repeated)
        parts += _parts([*columns[:repeated], *columns[index:]], repeated)
    rows = range(0, len(columns[0][1]), MAX_ROWS)
    return "\n".join(
        _tabular([(head, cells[k : k + MAX_ROWS]) for head, cells in part])
        for part in parts
        for k in rows
    )


def _parts(columns: Sequence[Column], repeated: int) -> list[list[Column]]:
    parts: list[list[Column]] = []
    left = 0.0
    for column in columns[repeated:]:
        wide = _column_width(column)
        if not parts or wide > left:
            parts.append(list(columns[:repeated]))
            left = WIDEST_TABLE - MARGIN - sum(_column_width(first) for first in columns[:repeated])
        parts[-1].append(column)
        left -= wide
    return parts


def _tabular(columns: Sequence[Column], blocks: int = 1) -> str:
    kinds = "".join(_column_kind(column) for column in columns)
    block = len(kinds) // blocks
    kinds = BLOCK_GAP.join(kinds[k : k + block] for k in range(0, len(kinds), block))
    head = " & ".join(heading for heading, _ in columns)
    body = map(_row, zip(*(c for _, c in columns), strict=True))
    begin, end = rf"\begin{{tabular}}{{@{{}}{kinds}@{{}}}}", r"\end{tabular}"
    if sum(map(_column_width, columns)) > LINE:
        begin, end = rf"\makebox[\linewidth]{{{begin}", f"{end}}}"
    lines = [r"\begin{center}", begin, r"\toprule", head + r" \\", r"\midrule"]
    return "\n".join([*lines, *body, r"\bottomrule", end, r"\end{center}"])


def _row(cells: Sequence[str]) -> str:
    row = " & ".join(map(_boxed, cells))
    return rf"{FRACTION_STRUT}{row} \\" if r"\frac" in row else rf"{row} \\"


def _column_kind(column: Column) -> str:
    return "c" if all(len(cell.strip("$")) <= 1 for cell in column[1]) else "l"


def _boxed(cell: str) -> str:
    if width(cell.replace("$", "")) <= WIDEST:
        return cell
    if cell.startswith("$"):
        # TeX breaks a formula after a comma only at an explicit break point.
        cell = cell.replace(", ", r",\allowbreak ")
    return rf"\parbox[t]{{{WIDEST:.0f}pt}}{{\raggedright {cell}\strut}}"


def _column_width(column: Column) -> float:
    heading, cells = column
    wide = max(width(cell.replace("$", "")) for cell in (heading, *cells))
    return min(wide, WIDEST) + COLUMN_SEPARATION


def side_by_side(heading: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Divide a narrow table into side-by-side blocks."""
    columns = [(head, [row[k] for row in rows]) for k, head in enumerate(heading)]
    wide = sum(_column_width(column) for column in columns) + COLUMN_SEPARATION
    fitting = int((WIDEST_TABLE - MARGIN) // wide)
    blocks = max(1, min(MAX_BLOCKS, fitting, -(-len(rows) // LOWEST_BLOCK)))
    page = blocks * MAX_ROWS
    return "\n".join(
        _block_table(heading, rows[k : k + page], blocks) for k in range(0, len(rows), page)
    )


def _block_table(heading: Sequence[str], rows: Sequence[Sequence[str]], blocks: int) -> str:
    height = -(-len(rows) // blocks)
    padded = [*rows, *[[""] * len(heading)] * (blocks * height - len(rows))]
    blocked: list[Column] = [
        (head, [row[k] for row in padded[block * height : (block + 1) * height]])
        for block in range(blocks)
        for k, head in enumerate(heading)
    ]
    return _tabular(blocked, blocks)


def _math(printer: Printer, expression: sp.Expr) -> str:
    return f"${printer.tex(expression)}$"


def _angle_key(notation: Notation) -> Callable[[Angle], tuple[int, list[int], bool]]:
    index = {symbol: k for k, symbol in enumerate(notation.q)}

    def key(item: Angle) -> tuple[int, list[int], bool]:
        angle, (accent, _) = item
        joints = sorted(index[symbol] for symbol in angle.free_symbols if symbol in index)
        return len(joints), joints, accent != "{}"

    return key
