r"""Prints the tool position as a function of the actuated coordinates."""

import sympy as sp

from ...terms.terms import Terms
from ..setting.layout import aligned
from ..setting.notation import OTHER
from ..setting.page import sentence, text
from ..setting.widths import LINE, width
from .loop_page import LoopPage

_POSITION = (3, 7, 11)
"""Indices of the position entries in a row-major pose."""
_BRACKET = 0.36 * LINE
"""Maximum width (pt) of a sum that is printed in brackets as a factor."""
_LETTER = r"\varrho"


def tool_position(page: LoopPage) -> str:
    """Print the tool position as a function of the actuated coordinates.

    The returned text is empty if an iteration solves the loops.
    """
    fk = next((function for function in page.functions if function.name == "fk"), None)
    if fk is None or page.hybrid.forward.open:
        return ""
    # The solution steps must exist first, because they name the angles on which the tool position
    # depends.
    assert page.forward_steps is not None
    assert page.backward_steps is not None
    entries = [without_guard(page.terms, fk.outputs[0].entries[k]) for k in _POSITION]
    shown = [page.printed_terms.of(entry) for entry in entries]
    if any(expression.has(sp.Piecewise) for expression in shown):
        return ""
    names = [page.chain.equations.fk.names[k] for k in _POSITION]
    brackets: dict[sp.Expr, sp.Symbol] = {}
    terms = page.printed_terms.printer.terms
    equations = [
        (page.tex(name), terms(_named_factors(page, expression, brackets)))
        for name, expression in zip(names, shown, strict=True)
        if name is not None
    ]
    angles = {s for e in shown for f in e.atoms(sp.cos, sp.sin) for s in f.free_symbols}
    known = " with the angles from the solution of the loops," if angles - {*page.q} else ""
    return text(
        sentence(
            f"As a function of the actuated coordinates,{known} the position of the tool is",
            aligned(equations, end="," if brackets else "."),
            "with" if brackets else "",
            aligned([(page.tex(name), terms(value)) for value, name in brackets.items()])
            if brackets
            else "",
        )
    )


def without_guard(terms: Terms, entry: sp.Expr) -> sp.Expr:
    """Return a pose entry without the addend that is NaN if a loop does not close."""
    definition = terms.definitions.get(entry, entry)
    kept = [part for part in sp.Add.make_args(definition) if not _is_guard(terms, part)]
    return entry if len(kept) == len(sp.Add.make_args(definition)) else sp.Add(*kept)


def _is_guard(terms: Terms, addend: sp.Expr) -> bool:
    definition = terms.definitions.get(addend, addend)
    if not definition.is_Pow:
        return False
    return bool(terms.definitions.get(definition.base, definition.base).has(sp.Piecewise))


def _named_factors(
    page: LoopPage, expression: sp.Expr, brackets: dict[sp.Expr, sp.Symbol]
) -> sp.Expr:
    notation = page.chain.equations.notation
    found = []
    for addend in sp.Add.make_args(expression):
        factors = []
        for factor in sp.Mul.make_args(addend):
            if factor.is_Add and addend.is_Mul and width(page.tex(factor)) > _BRACKET:
                if factor not in brackets:
                    tex = f"{_LETTER}_{{{len(brackets) + 1}}}"
                    brackets[factor] = notation.symbol(tex, (OTHER, ("position", len(brackets))))
                factors.append(brackets[factor])
            else:
                factors.append(factor)
        found.append(sp.Mul(*factors))
    return sp.Add(*found)
