r"""Prints the forward kinematics and the Jacobians as LaTeX."""

from collections.abc import Sequence

import sympy as sp

from ..setting.layout import MARGIN, Equation, aligned, chain, flowed, matrix, read_down
from ..setting.notation import TERM
from ..setting.page import Page, sentence, text
from ..setting.sharing import Definition, Printed
from ..setting.widths import LINE, width

POSE_COLUMNS = 4
TWIST_ROWS = 6
SHORT = 50.0
"""Maximum width (pt) of an entry inside the pose matrix."""


def forward_kinematics(page: Page) -> str:
    """Print the tool pose as a matrix, or entry by entry if the matrix is too wide."""
    fk = page.equations.fk
    T = sp.ImmutableMatrix(POSE_COLUMNS, POSE_COLUMNS, fk.entries)
    terms = _shared(page, fk.definitions, "shared")
    if page.matrix(page.pose, T).width <= LINE - MARGIN:
        article = "the" if terms else "The"
        opening = f"{article} pose of the tool in the base frame is"
        return text(sentence(terms, opening, _two_matrices(page, T)))
    generic = page.matrix(page.pose, _generic(page, short=True))
    opening = "The pose of the tool in the base frame is"
    rotation, position = _entries(page)
    if not terms:
        pose = flowed([generic], end="", kept=True)
        both = rotation and position
        shown = (
            sentence(aligned(rotation, end=""), "and", aligned(position))
            if both
            else aligned(rotation + position)
        )
        return text(sentence(opening, pose, "with", shown))
    pose = flowed([generic], kept=True)
    of_rotation, of_position = _split(fk)
    return text(
        sentence(opening, pose),
        _with(page, of_rotation, "shared", "entries of its rotation are", rotation),
        _with(
            page,
            of_position,
            "further" if of_rotation else "shared",
            "coordinates of its position are",
            position,
        ),
    )


def _split(fk: Printed) -> tuple[list[Definition], list[Definition]]:
    meanings = dict(fk.definitions)
    needed: set[sp.Symbol] = set()
    waiting = [
        symbol
        for k, entry in enumerate(fk.entries)
        if k % POSE_COLUMNS < POSE_COLUMNS - 1
        for symbol in entry.free_symbols
    ]
    while waiting:
        symbol = waiting.pop()
        if symbol in meanings and symbol not in needed:
            needed.add(symbol)
            waiting.extend(meanings[symbol].free_symbols)
    first = [(name, value) for name, value in fk.definitions if name in needed]
    return first, [(name, value) for name, value in fk.definitions if name not in needed]


def _with(
    page: Page,
    definitions: Sequence[Definition],
    kind: str,
    statement: str,
    entries: Sequence[Equation],
) -> str:
    if not entries:
        return ""
    terms = _shared(page, definitions, kind)
    return sentence(terms, f"{'the' if terms else 'The'} {statement}", aligned(entries))


def _shared(page: Page, definitions: Sequence[Definition], kind: str) -> str:
    shown = _definitions(page, definitions)
    return sentence(f"With the {kind} terms", shown) if shown else ""


def jacobians(page: Page) -> str:
    """Print the columns of the mixed and the spatial Jacobian."""
    mixed, space = page.equations.jacobian_mixed, page.equations.jacobian_space
    return text(
        r"Twists are $(v; \omega)$, linear velocity first, in the axes of the base frame. In the"
        " mixed Jacobian, $v$ is the velocity of the tool's origin; in the spatial Jacobian, it is"
        " the velocity of the point of the tool body at the base origin.",
        sentence(
            _with_terms(page, mixed, "columns of the mixed Jacobian are"),
            _columns(page, mixed, "J"),
        ),
        sentence(
            _with_terms(page, space, "columns of the spatial Jacobian are"),
            _columns(page, space, r"J^{\mathrm{s}}"),
        ),
    )


def _generic(page: Page, *, short: bool) -> sp.ImmutableMatrix:
    fk = page.equations.fk
    shown = [
        entry if name is None or (short and _is_short(page, entry)) else name
        for name, entry in zip(fk.names, fk.entries, strict=True)
    ]
    return sp.ImmutableMatrix(POSE_COLUMNS, POSE_COLUMNS, shown)


def _is_short(page: Page, entry: sp.Expr) -> bool:
    order = page.equations.notation.order
    known = all(order[symbol][0] < TERM for symbol in entry.free_symbols)
    return known and not entry.is_Add and width(page.tex(entry)) < SHORT


def _entries(page: Page) -> tuple[list[Equation], list[Equation]]:
    fk = page.equations.fk
    rotation: list[Equation] = []
    position: list[Equation] = []
    for k, (name, entry) in enumerate(zip(fk.names, fk.entries, strict=True)):
        if name is not None and not _is_short(page, entry):
            part = position if k % POSE_COLUMNS == POSE_COLUMNS - 1 else rotation
            part.append((page.tex(name), page.equations.printer.terms(entry)))
    return read_down(rotation), position if rotation else read_down(position)


def _two_matrices(page: Page, T: sp.Matrix) -> str:
    matrices = (_generic(page, short=False), T)
    return chain(
        page.pose,
        [matrix([[page.tex(entry) for entry in row] for row in M.tolist()]) for M in matrices],
    )


def _with_terms(page: Page, function: Printed, statement: str) -> str:
    if not function.definitions:
        return f"The {statement}"
    earlier = (page.equations.fk, page.equations.jacobian_mixed)
    is_first = not any(other.definitions for other in earlier if other is not function)
    further = "shared" if is_first else "further"
    terms = _definitions(page, function.definitions)
    return sentence(f"With the {further} terms", terms, f"the {statement}")


def _definitions(page: Page, definitions: Sequence[Definition]) -> str:
    printer = page.equations.printer
    listed = [(page.tex(name), printer.terms(value)) for name, value in definitions]
    return aligned(listed, end=",") if listed else ""


def _columns(page: Page, function: Printed, name: str) -> str:
    count = len(function.entries) // TWIST_ROWS
    return flowed(
        [page.column(f"{name}_{{{k + 1}}}", function.entries[k::count]) for k in range(count)]
    )
