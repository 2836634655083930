r"""Prints the equations of planar parallel robots (platforms on legs) as LaTeX.

The leg equations come from ``chasles.derive.loops.modes.planar_legs``, and the elimination of the
platform position from ``chasles.derive.loops.modes.leg_elimination``.
"""

from collections.abc import Iterable
from dataclasses import replace

import sympy as sp

from ...loops.model.phasors import Complex
from ...loops.modes.leg_elimination import LegElimination, leg_elimination
from ...loops.modes.platforms import triad_of
from ...loops.modes.triad import LEGS, Triad
from ..setting.layout import Equation, aligned
from ..setting.notation import TERM
from ..setting.page import sentence, text
from ..setting.printed_terms import PrintedTerms
from ..setting.widths import LINE, width
from .loop_page import LoopPage
from .platforms_fragment import RANKS, free_letters, in_brackets

COUNTS = {1: "one", 2: "two", 3: "three", 4: "four", 6: "six"}
VECTORS = {"w": r"\mathbf{w}", "u": r"\mathbf{u}", "n": r"\mathbf{n}", "l": r"\ell", "J": "J"}


class PrintedLegs:
    """The equations of a platform's three legs, in printed symbols.

    Attributes:
        page: The robot.
        terms: Table of the robot's named terms, which depend only on coordinates and parameters.
        phi: The platform's angle.
        letters: Letters for the symbols in the polynomial of the platform.
        legs: The circle or line on which the platform joint of each leg moves, with dimensions in
            meters.
        equations: Equations of the legs, from which the platform position is eliminated.
    """

    def __init__(self, page: LoopPage, triad: Triad) -> None:
        hybrid = page.hybrid
        coordinates = (*hybrid.q, *hybrid.theta), (*page.q, *page.theta)
        known = dict(zip(*coordinates, strict=True))
        self.page = page
        self.terms = PrintedTerms(page.terms, page.chain.equations.notation, known)
        self.phi, self.letters = page.theta[-1], free_letters(page)
        self.legs = Triad(
            tuple(map(self._pair, triad.A)),
            tuple(map(self._pair, triad.b)),
            tuple(map(self._length, triad.L)),
            tuple(replace(line, normal=self._pair(line.normal)) for line in triad.lines),
        )
        self.equations: LegElimination = leg_elimination(self.legs, self.phi, self.of)

    def tex(self, expression: sp.Expr) -> str:
        """Format an expression as LaTeX on one line."""
        return self.terms.tex(expression)

    def equation(self, name: str, value: sp.Expr) -> Equation:
        """Return the equation ``name = value``, with the right-hand side as signed terms."""
        return name, self.page.vectors.terms(value)

    def _pair(self, point: Iterable[sp.Expr]) -> Complex:
        x, y = (sp.expand(self.terms.of(part)) for part in point)
        return x, y

    def _length(self, length: sp.Expr) -> sp.Expr:
        is_constant = self.page.terms.is_constant(length)
        return self.page.constant(length) if is_constant else self.terms.of(length)

    def of(self, letter: str, index: str) -> sp.Symbol:
        """Return the symbol of a quantity in the elimination of the platform position."""
        if letter == "|u|":
            return self._symbol(rf"|\mathbf{{u}}_{{{index}}}|", 0)
        if letter in ("|a|", "|b|"):
            vector = r"\mathbf{a}" if letter == "|a|" else r"\mathbf{b}'"
            return self._symbol(rf"|{vector}_{index[0]} - {vector}_{index[1]}|", 0)
        head = self.letters["constant"] if letter == "k" else VECTORS[letter]
        return self._symbol(f"{head}_{{{index}}}" if index else head, RANKS.index(letter))

    def _symbol(self, tex: str, rank: int) -> sp.Symbol:
        return self.page.chain.equations.notation.symbol(tex, (TERM, (rank, tex)))


def legs(page: LoopPage) -> str:
    """Print the leg equations and their elimination to a polynomial for all assembly modes."""
    triad = triad_of(page.hybrid)
    assert triad is not None
    printed = PrintedLegs(page, triad)
    return text(_legs(printed), _elimination(printed), _harmonics(printed))


def _legs(printed: PrintedLegs) -> str:
    legs, (x, y, phi) = printed.legs, map(printed.tex, printed.page.theta)
    shown: list[Equation] = [
        (rf"{letter}_{{{i}}}", in_brackets(printed.terms, point))
        for letter, points in ((r"\mathbf{a}", legs.A), (r"\mathbf{b}'", legs.b))
        for i, point in enumerate(points, 1)
    ]
    shown += [_radius(printed, i, L) for i, L in enumerate(legs.L, 1)]
    return sentence(
        "The platform rests on three legs. With a fixed actuator, each leg gives one equation"
        rf" between the platform's position $\mathbf{{p}} = ({x}, {y})$ and angle ${phi}$. With"
        r" points $\mathbf{a}_i$ of other bodies, and points"
        rf" $\mathbf{{b}}_i = \mathbf{{p}} + R({phi})\,\mathbf{{b}}'_i$ of the platform,",
        _conditions(len(legs.L)),
        _lines(legs),
        rf"In the axes of ${x}$ and ${y}$, and for $\mathbf{{b}}'_i$ in the axes of the platform,",
        aligned(shown),
    )


def _radius(printed: PrintedLegs, i: int, length: sp.Expr) -> Equation:
    is_long = width(printed.tex(length)) > LINE / 2
    if is_long and length.is_Pow and length.exp == sp.Rational(1, 2):
        return printed.equation(rf"\ell_{{{i}}}^2", length.base)
    return printed.equation(rf"\ell_{{{i}}}", length)


def _conditions(circles: int) -> str:
    numbers = [str(i) for i in range(1, LEGS + 1)]
    of = [
        (r"|\mathbf{b}_i - \mathbf{a}_i| = \ell_i", numbers[:circles]),
        (r"\mathbf{n}_i \cdot (\mathbf{b}_i - \mathbf{a}_i) = 0", numbers[circles:]),
    ]
    shown = [rf"{tex}, \quad i = {', '.join(some)}" for tex, some in of if some]
    return _equation(r", \qquad ".join(shown) + ".")


def _lines(legs: Triad) -> str:
    numbered = list(enumerate(legs.lines, len(legs.L) + 1))
    own, others = ([f"{i}" for i, line in numbered if line.turns is side] for side in (True, False))
    parts = [f"belongs to the platform for $i = {', '.join(own)}$"] if own else []
    parts += [f"belongs to another body for $i = {', '.join(others)}$"] if others else []
    if not parts:
        return ""
    return rf"A line with the unit normal $\mathbf{{n}}_i$ {' and '.join(parts)}."


def _elimination(printed: PrintedLegs) -> str:
    found, legs = printed.equations, printed.legs
    tex, vectors = printed.tex, printed.page.vectors
    phi, circles = tex(printed.phi), len(legs.L)
    components = [
        printed.equation(tex(name), value) for pair in (*found.u, *found.n) for name, value in pair
    ]
    linear = ", ".join(
        f"${vectors.tex(product)} = {tex(name)}$"
        for product, (name, _) in zip(found.linear, found.k, strict=True)
    )
    left, right = found.polynomial
    return sentence(
        r"\paragraph{All assembly modes} at actuator values follow from one polynomial. Let"
        r" $\mathbf{w} = \mathbf{b}_1 - \mathbf{a}_1$. The differences"
        r" $\mathbf{u}_i = (\mathbf{b}_i - \mathbf{b}_1) - (\mathbf{a}_i - \mathbf{a}_1)$"
        rf" between the vectors $\mathbf{{b}}_i - \mathbf{{a}}_i$ of the other legs and"
        rf" $\mathbf{{w}}$, and the normals, depend only on ${phi}$,",
        aligned(components),
        _pair_of(circles),
        rf"{linear}, with",
        aligned([printed.equation(tex(name), value) for name, value in found.k]),
        _solved(printed),
        _equation(f"{vectors.tex(left)} = {vectors.tex(right)}."),
    )


def _pair_of(circles: int) -> str:
    if circles == 0:
        return (
            r"The first leg gives the line $\mathbf{w} \cdot \mathbf{n}_1 = 0$. The other legs give"
            r" lines, too:"
        )
    other = r"the equation of a line is linear in $\mathbf{w}$"
    if circles == 1:
        return rf"The first leg gives the circle $|\mathbf{{w}}|^2 = \ell_1^2$, and {other}:"
    left = f"; {other}" if circles < LEGS else ""
    return (
        r"The first circle, $|\mathbf{w}|^2 = \ell_1^2$, subtracted from another leaves an equation"
        rf" that is linear in $\mathbf{{w}}${left}:"
    )


def _solved(printed: PrintedLegs) -> str:
    shown = printed.page.vectors.tex(printed.equations.solution)
    whose, into = (
        ("They are", "the first circle")
        if printed.legs.L
        else ("The first two lines are", "the third line")
    )
    return sentence(
        rf"With the rotation $J$ by $90^\circ$, {whose[0].lower()}{whose[1:]} solved by",
        _equation(rf"\mathbf{{w}} = {shown},"),
        f"which, substituted into {into}, gives",
    )


def _harmonics(printed: PrintedLegs) -> str:
    found, tex = printed.equations, printed.tex
    phi, root, count = tex(printed.phi), printed.letters["root"], found.harmonics
    first = f"{printed.letters['cosine']}_0"
    a, b = (f"{printed.letters[kind]}_m" for kind in ("cosine", "sine"))
    power = "" if found.power == 1 else f"^{found.power}"
    plural = "s" if count > 1 else ""
    names = map(tex, printed.page.theta[:2])
    return sentence(
        r"Rotations preserve lengths and scalar products, and normals that rotate together have a"
        r" constant product: the difference of both sides is of degree"
        rf" ${count}$ in $\cos {phi}$, $\sin {phi}$. Divided by $\bar{{\ell}}{power}$,",
        aligned([printed.equation(r"\bar{\ell}^2", found.scale)], end=","),
        f"it is a sum of {COUNTS[count]} harmonic{plural}, whose coefficients depend on the"
        " actuators,",
        _equation(
            rf"{first} + \sum_{{m=1}}^{{{count}}} \bigl({a} \cos m{phi} + {b} \sin m{phi}\bigr)"
            " = 0,"
        ),
        rf"and a polynomial of degree ${2 * count}$ in"
        rf" ${root} = \mathrm{{e}}^{{\mathrm{{i}}{phi}}}$. Its zeros with $|{root}| = 1$ give"
        rf" angles of the platform: there are at most {COUNTS[2 * count]} assembly modes. They are"
        " isolated on intervals of the circle, where the Taylor series of the sum proves that"
        " there is no zero or exactly one. The position follows as",
        aligned(
            [
                printed.equation(name, value)
                for name, value in zip(names, found.position, strict=True)
            ],
            end=",",
        ),
        "and Newton's iteration on the leg equations refines every pose.",
        _singular_pair(printed),
    )


def _singular_pair(printed: PrintedLegs) -> str:
    if not printed.legs.L:
        return "The two lines that intersect closest to a right angle give the position."
    constant = printed.letters["constant"]
    chosen = (
        r"the unit normal of a line"
        if printed.legs.lines
        else r"the longer of $\mathbf{u}_2$ and $\mathbf{u}_3$"
    )
    return sentence(
        rf"If both vectors of the linear pair are parallel, the pair is singular. With"
        rf" $\mathbf{{m}}$ {chosen}, and ${constant}$ of the same index,",
        _equation(
            rf"\mathbf{{w}} = \frac{{{constant}\,\mathbf{{m}} \pm \sqrt{{\ell_1^2"
            rf" |\mathbf{{m}}|^2 - {constant}^2}}\,J \mathbf{{m}}}}{{|\mathbf{{m}}|^2}}"
        ),
        "also holds. The other leg determines the sign; if it allows both signs, both are modes.",
    )


def _equation(tex: str) -> str:
    return f"\\begin{{equation*}}\n{tex}\n\\end{{equation*}}%"
