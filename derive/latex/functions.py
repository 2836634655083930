r"""The fragments of derived functions: forward kinematics, Jacobians."""

from collections.abc import Sequence

import sympy as sp

from .layout import MARGIN, Equation, aligned, chain, flowed, matrix, read_down
from .page import Page, sentence, text
from .sharing import Definition, Printed
from .widths import LINE

POSE_COLUMNS = 4
TWIST_ROWS = 6


def forward_kinematics(page: Page) -> str:
    """The tool's pose entry by entry, or as one matrix where that fits a line."""
    fk = page.equations.fk
    T = sp.ImmutableMatrix(POSE_COLUMNS, POSE_COLUMNS, fk.entries)
    names = sp.ImmutableMatrix(
        POSE_COLUMNS,
        POSE_COLUMNS,
        [entry if name is None else name for name, entry in zip(fk.names, fk.entries, strict=True)],
    )
    shared = _definitions(page, fk.definitions)
    terms = sentence("With the shared terms", shared) if shared else ""
    if page.matrix(page.pose, T).width <= LINE - MARGIN:
        article = "the" if shared else "The"
        opening = f"{article} pose of the tool in the base frame is"
        return text(sentence(terms, opening, _two_matrices(page, names, T)))
    generic = flowed([page.matrix(page.pose, names)], end="." if shared else "")
    middle = [terms, "its entries are"] if shared else ["with"]
    opening = "The pose of the tool in the base frame is"
    return text(sentence(opening, generic, *middle, aligned(read_down(_entries(page)))))


def jacobians(page: Page) -> str:
    """The columns of the mixed and of the spatial Jacobian."""
    mixed, space = page.equations.jacobian_mixed, page.equations.jacobian_space
    return text(
        r"Twists are $(v; \omega)$, linear velocity first, in the axes of the base frame. In the"
        " mixed Jacobian, $v$ is the velocity of the tool's origin; in the spatial Jacobian, it is"
        " that of the point of the tool's body at the base frame's origin.",
        sentence(
            _with_terms(page, mixed, "columns of the mixed Jacobian are"),
            _columns(page, mixed, "J"),
        ),
        sentence(
            _with_terms(page, space, "columns of the spatial Jacobian are"),
            _columns(page, space, r"J^{\mathrm{s}}"),
        ),
    )


def _entries(page: Page) -> list[Equation]:
    """The entries by name, the rotation first."""
    fk = page.equations.fk
    named = [
        (page.tex(name), page.equations.printer.terms(entry))
        for name, entry in zip(fk.names, fk.entries, strict=True)
        if name is not None
    ]
    position = named[POSE_COLUMNS - 1 :: POSE_COLUMNS]
    return [*(equation for equation in named if equation not in position), *position]


def _two_matrices(page: Page, names: sp.Matrix, T: sp.Matrix) -> str:
    """The matrix of names, and below it that of entries."""
    return chain(
        page.pose,
        [matrix([[page.tex(entry) for entry in row] for row in M.tolist()]) for M in (names, T)],
    )


def _with_terms(page: Page, function: Printed, statement: str) -> str:
    if not function.definitions:
        return f"The {statement}"
    further = "further" if page.equations.fk.definitions else "shared"
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
