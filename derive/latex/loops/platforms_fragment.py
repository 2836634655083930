r"""Prints the equations of parallel robots (platforms on legs) as LaTeX.

The equations come from ``chasles.derive.loops.modes.rods`` and
``chasles.derive.loops.modes.triad``.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import sympy as sp

from ...loops.model.phasors import Complex
from ...loops.modes.hexapod import hexapod_of
from ...loops.modes.platforms import free_directions, triad_of
from ...loops.modes.rods import joint_values, line_coordinates, pins_in_tool, rods_of, tool_position
from ...loops.modes.triad import Triad, elimination
from ...loops.solve.solved_loops import SolvedLoops
from ..setting.layout import Equation, aligned, flowed
from ..setting.names import head
from ..setting.notation import LENGTH, TERM
from ..setting.page import listed, named_matrix, sentence, text
from ..setting.printed_terms import PrintedTerms
from ..setting.widths import LINE, width
from .loop_page import LoopPage

AXES = "xyz"
PLANE, SPACE = 2, 6
RANKS = ("l", "J", "k", "n", "u", "w")
"""Letters of the quantities that occur when the platform position is eliminated, in the order of
the factors of a printed product."""
WHOLE = 0.8 * LINE
"""Maximum width (pt) of a vector component that is printed on one line."""
ZERO = sp.Integer(0)
TWIST = (*(f"v_{axis}" for axis in AXES), *(rf"\omega_{axis}" for axis in AXES))
LETTERS = {
    "constant": ("k", "g", r"\mathrm{k}"),
    "cosine": (r"\alpha", r"\mu", r"\rho"),
    "sine": (r"\beta", r"\nu", r"\tau"),
    "root": (r"\xi", r"\varsigma", r"\mathrm{z}"),
}
"""Letters for the symbols in a platform's polynomial, in order of preference. Letters that already
denote a length or joint of the robot are skipped."""
Vector = tuple[sp.Expr, ...]


@dataclass(frozen=True)
class PrintedRod:
    """A rod of a platform in printed symbols, with all lengths in meters.

    Attributes:
        a: Position of the rod's lower end, which is on an actuated body or the base, in the base
            frame.
        b: Position of the rod's upper end, which is on the platform, in the base frame.
        pin: Position of the rod's upper end in the tool frame.
        length: Length of the rod.
    """

    a: Vector
    b: Vector
    pin: Vector
    length: sp.Expr


class PrintedPlatform:
    """The equations of a platform on legs, in printed symbols.

    Attributes:
        page: The robot.
        terms: Table of the robot's named terms, which depend only on coordinates and parameters.
        rods: The platform's rods, in the order of the robot description.
        axes: Indices of the base axes along which at least one rod end has a nonzero coordinate.
        free: Indices of the components of the tool twist (in base axes) that can be nonzero.
    """

    def __init__(self, page: LoopPage) -> None:
        hybrid = page.hybrid
        coordinates = (*hybrid.q, *hybrid.theta), (*page.q, *page.theta)
        known = dict(zip(*coordinates, strict=True))
        self.page = page
        self.printed_terms = PrintedTerms(page.terms, page.chain.equations.notation, known)
        self.rods = self._rods(hybrid)
        self.free = free_directions(hybrid)
        parts = [(*rod.a, *rod.b) for rod in self.rods]
        self.axes = [k for k in range(3) if any(part[k] != 0 or part[k + 3] != 0 for part in parts)]

    @property
    def is_planar(self) -> bool:
        """Whether all rods lie in a plane of the base frame."""
        return len(self.axes) == PLANE

    def length(self, length: sp.Expr) -> sp.Expr:
        """Return the length of a rod in printed symbols."""
        is_constant = self.page.terms.is_constant(length)
        return self.page.constant(length) if is_constant else self.of(length)

    @cached_property
    def n(self) -> tuple[Vector, ...]:
        """Return the symbols of the unit vectors along the rods towards the platform."""
        return self._symbols("n")

    @cached_property
    def r(self) -> tuple[Vector, ...]:
        """Return symbols of the vectors from the tool to the rods' platform ends, one per rod."""
        return self._symbols("r")

    @cached_property
    def J_x(self) -> sp.Matrix:
        """Return the line coordinates of the rods, one row for each rod.

        Each column of this matrix belongs to a component of the tool twist that can be nonzero.
        """
        rows = [line_coordinates(n, r) for n, r in zip(self.n, self.r, strict=True)]
        return sp.Matrix([[row[k] for k in self.free] for row in rows])

    @cached_property
    def J_q(self) -> sp.Matrix:
        """Return the axial speed of each rod per unit actuator rate."""
        hybrid = self.page.hybrid
        rows = [
            rod.actuator_row(hybrid.terms, n, hybrid.q)
            for n, rod in zip(self.n, rods_of(hybrid), strict=True)
        ]
        return sp.Matrix([[self.of(entry) for entry in row] for row in rows])

    @cached_property
    def triad(self) -> "PrintedTriad | None":
        """The polynomial whose roots are the assembly modes.

        The value is None if the platform has no polynomial for its assembly modes.
        """
        hybrid = self.page.hybrid
        triad = triad_of(hybrid) if hybrid.forward.open else None
        return None if triad is None else PrintedTriad(self, triad)

    def symbol(self, tex: str, rank: int = 0) -> sp.Symbol:
        """Return a symbol with the given LaTeX code."""
        return self.page.chain.equations.notation.symbol(tex, (TERM, (rank, tex)))

    def of(self, expression: sp.Expr) -> sp.Expr:
        """Convert an expression of named terms to printed symbols and expand it."""
        return sp.expand(self.printed_terms.of(expression))

    def _symbols(self, letter: str) -> tuple[Vector, ...]:
        return tuple(
            tuple(
                self.symbol(rf"\mathbf{{{letter}}}_{{{i}{AXES[k]}}}", "rn".find(letter))
                if k in self.axes
                else ZERO
                for k in range(3)
            )
            for i in range(1, len(self.rods) + 1)
        )

    @cached_property
    def tool(self) -> Vector:
        """Return the tool position in the base frame, in printed symbols."""
        return tuple(map(self.of, tool_position(self.page.hybrid)))

    def _rods(self, hybrid: SolvedLoops) -> tuple[PrintedRod, ...]:
        constant = self.page.constant
        values = joint_values(hybrid)
        found = []
        parts = zip(hybrid.mechanism.struts, rods_of(hybrid), pins_in_tool(hybrid), strict=True)
        for strut, rod, pin in parts:
            stroke = values[strut.name] if strut.is_cylinder else ZERO
            a, b = (tuple(map(self.of, end)) for end in (rod.a, rod.b))
            length = constant(strut.length) + self.of(stroke)
            found.append(PrintedRod(a, b, tuple(map(constant, pin)), length))
        return tuple(found)


class PrintedTriad:
    """Elimination of the position of a planar platform, in printed symbols.

    Attributes:
        phi: The platform's angle.
        letters: Unused letters for the symbols of the platform polynomial.
        equations: The elimination.
        u: Vectors along the second and third rod minus the vector along the first rod, with named
            components.
        norms: Norms of the two vectors `u`, as functions of the components of `u`.
        k: Right-hand sides of the two linear equations for the first rod's vector `w`, as functions
            of `norms`.
        w: Symbols of the components of the vector along the first rod.
        position: The position (x, y) of the platform, as a function of coordinates, parameters and
            ``w``.
        scale: Squared length that normalizes the polynomial in the platform angle, which is divided
            by `scale`^3.
    """

    def __init__(self, platform: PrintedPlatform, triad: Triad) -> None:
        A, b = ([_pair(map(platform.of, point)) for point in of] for of in (triad.A, triad.b))
        L = list(map(platform.length, triad.L))
        self.phi = platform.page.theta[-1]
        self.letters = free_letters(platform.page)
        tex = {"w": r"\mathbf{w}", "u": r"\mathbf{u}", "l": r"\ell", "J": "J"}

        def name(letter: str, index: str) -> sp.Symbol:
            if letter == "|u|":
                return platform.symbol(rf"|\mathbf{{u}}_{{{index}}}|")
            head = self.letters["constant"] if letter == "k" else tex[letter]
            rank = RANKS.index(letter)
            return platform.symbol(f"{head}_{{{index}}}" if index else head, rank)

        self.equations = elimination(A, b, L, self.phi, name)
        self.u, self.norms, self.k = self.equations.u, self.equations.norms, self.equations.k
        self.w, self.position = self.equations.w, self.equations.position
        self.scale = self.equations.scale


def _pair(parts: Iterable[sp.Expr]) -> Complex:
    x, y = parts
    return x, y


def free_letters(page: LoopPage) -> dict[str, str]:
    """Return unused letters for the symbols of the platform polynomial."""
    notation = page.chain.equations.notation
    lengths = [
        notation.tex[symbol] for symbol, (kind, _) in notation.order.items() if kind == LENGTH
    ]
    taken = set(map(head, (*lengths, *page.members.of.values())))
    return {
        kind: next((letter for letter in options if letter not in taken), options[-1])
        for kind, options in LETTERS.items()
    }


def platform(page: LoopPage) -> str:
    """Print a platform's rods, velocity relation, singularity types and assembly modes."""
    printed = PrintedPlatform(page)
    triad = printed.triad
    return text(
        _lengths(printed),
        _velocities(printed),
        _singularities(printed),
        *([] if triad is None else [_elimination(printed, triad), _harmonics(printed, triad)]),
        *([] if hexapod_of(page.hybrid) is None else [_paths()]),
    )


def _lengths(printed: PrintedPlatform) -> str:
    page = printed.page
    pose = "" if printed.is_planar else r" = \mathbf{p} + R\,\mathbf{b}'_i"
    theta = ", ".join(page.members.theta) if printed.is_planar else r"\theta"
    on_platform = rf"$\mathbf{{b}}_i({theta}){pose}$"
    moved = any(part.has(*page.q) for rod in printed.rods for part in rod.a)
    from_points = rf"$\mathbf{{a}}_i{'(q)' if moved else ''}$"
    tool = r"$\mathbf{p}$ is the position of the tool"
    if not printed.is_planar:
        tool += rf" and $R$ its orientation, as in ${page.chain.pose}$"
    each = "Member $i$" if len(printed.rods) > 1 else "It"
    length = _common_length(printed)
    equal = "" if length is None else f" = {printed.printed_terms.tex(length)}"
    names = ", ".join(page.members.called(strut.name) for strut in page.mechanism.struts)
    return sentence(
        rf"The platform is supported by {names}. {each} has the length $\ell_i$ and connects the"
        rf" point {from_points} with the point {on_platform} of the platform:",
        _equation(rf"|\mathbf{{b}}_i - \mathbf{{a}}_i| = \ell_i{equal}."),
        _axes(printed),
        aligned(_points(printed)),
        f"Here {tool}.",
    )


def _axes(printed: PrintedPlatform) -> str:
    if not printed.is_planar:
        return r"In base axes, and for $\mathbf{b}'_i$ in tool axes,"
    return f"In the base axes {' and '.join(f'${AXES[k]}$' for k in printed.axes)},"


def _points(printed: PrintedPlatform) -> list[Equation]:
    axes = printed.axes
    a = [(rf"\mathbf{{a}}_{{{i}}}", rod.a, axes) for i, rod in enumerate(printed.rods, 1)]
    if printed.is_planar:
        b = [(rf"\mathbf{{b}}_{{{i}}}", rod.b, axes) for i, rod in enumerate(printed.rods, 1)]
        b.append((r"\mathbf{p}", printed.tool, axes))
    else:
        every = list(range(3))
        b = [(rf"\mathbf{{b}}'_{{{i}}}", rod.pin, every) for i, rod in enumerate(printed.rods, 1)]
    shown: list[Equation] = [
        (name, in_brackets(printed.printed_terms, [vector[k] for k in axes]))
        for name, vector, axes in (*a, *b)
    ]
    if _common_length(printed) is None:
        shown += [
            (rf"\ell_{{{i}}}", printed.printed_terms.printer.terms(rod.length))
            for i, rod in enumerate(printed.rods, 1)
        ]
    return shown


def _common_length(printed: PrintedPlatform) -> sp.Expr | None:
    first, *others = (rod.length for rod in printed.rods)
    return first if all(length == first for length in others) else None


def in_brackets(terms: PrintedTerms, components: Iterable[sp.Expr]) -> list[str]:
    """Format a vector in brackets. Long vectors are broken across lines."""
    parts = [list(terms.printer.terms(component)) for component in components]
    parts = [part if width(" ".join(part)) > WHOLE else [" ".join(part)] for part in parts]
    for part in parts[:-1]:
        part[-1] += r",\;"
    for part in parts[1:]:
        # At the start of a line, a leading sign would look like the sign of the whole term.
        part[0] = part[0].replace("-", "{-}", 1) if part[0].startswith("-") else part[0]
    parts[0][0] = f"({parts[0][0]}"
    parts[-1][-1] += ")"
    return [term for part in parts for term in part]


def _velocities(printed: PrintedPlatform) -> str:
    free = listed(TWIST[k] for k in printed.free)
    alone = "" if len(printed.free) == SPACE else f" with the nonzero components {free}"
    return sentence(
        r"Differentiated and divided by $\ell_i$, with the directions"
        r" $\mathbf{n}_i = (\mathbf{b}_i - \mathbf{a}_i) / |\mathbf{b}_i - \mathbf{a}_i|$ and the"
        r" lever arms $\mathbf{r}_i = \mathbf{b}_i - \mathbf{p}$, these equations relate the"
        r" rates:",
        _equation(r"\mathbf{J}_x\,V = \mathbf{J}_q\,\dot{q},"),
        rf"where $V = (v; \omega)$ is the twist of the tool in base axes{alone}, and the"
        r" $i$-th rows are",
        _equation(
            r"\bigl(\mathbf{n}_i^{\mathsf{T}},"
            r" (\mathbf{r}_i \times \mathbf{n}_i)^{\mathsf{T}}\bigr)"
            "\n"
            r"\quad\text{and}\quad"
            "\n"
            r"\mathbf{n}_i^{\mathsf{T}}\,\frac{\partial \mathbf{a}_i}{\partial q}"
            r" + \frac{\partial \ell_i}{\partial q}."
        ),
        "For this robot",
        _line_coordinates(printed),
        _actuators(printed),
    )


def _line_coordinates(printed: PrintedPlatform) -> str:
    if len(printed.free) == SPACE:
        return ""
    rows = [[printed.printed_terms.tex(entry) for entry in row] for row in printed.J_x.tolist()]
    return flowed([named_matrix(r"\mathbf{J}_x", rows)], end=",", kept=True)


def _actuators(printed: PrintedPlatform) -> str:
    J, name = printed.J_q, r"\mathbf{J}_q"
    if sp.eye(J.rows) == J:
        return aligned([(name, ["1"])])
    entries: list[Equation] = [
        (f"({name})_{{{i + 1}{j + 1}}}", printed.printed_terms.printer.terms(J[i, j]))
        for i in range(J.rows)
        for j in range(J.cols)
        if J[i, j] != 0
    ]
    if len(entries) == len(J):
        return aligned(entries)
    return sentence(aligned(entries, end=","), rf"and all other entries of ${name}$ are $0$.")


def _singularities(printed: PrintedPlatform) -> str:
    angular = [TWIST[k] for k in printed.free if k >= len(AXES)]
    turning = [
        tex
        for tex, c in zip(printed.page.members.q, printed.page.mechanism.coordinates, strict=True)
        if c.kind == "revolute"
    ]
    columns = [rf"of {listed(angular)} in $\mathbf{{J}}_x$"]
    columns += [rf"of {listed(turning)} in $\mathbf{{J}}_q$"] if turning else []
    units = (
        f" To make these dimensionless, the columns {' and '.join(columns)} are divided by one"
        r" constant length, by default the root mean square of the entries of angular rates in"
        r" $\mathbf{J}_x$ at the reference configuration."
    )
    return sentence(
        r"There are three types of singularity (Gosselin and Angeles 1990). Their distances"
        r" are, with $\sigma_{\min}$ the smallest singular value,",
        aligned(
            [
                (r"\sigma_{1}", [r"\sigma_{\min}(\mathbf{J}_q)"]),
                (r"\sigma_{2}", [r"\sigma_{\min}(\mathbf{J}_x)"]),
                (r"\sigma_{3}", [r"\max(\sigma_{1}, \sigma_{2})"]),
            ]
        ),
        r"At $\sigma_{1} = 0$ the platform loses a degree of freedom: a leg is stretched or"
        r" folded. At"
        r" $\sigma_{2} = 0$ it gains a degree of freedom: fixed actuators do not determine its"
        r" pose, and assembly"
        rf" modes meet. At $\sigma_{{3}} = 0$ both happen at once.{units if angular else ''}",
    )


def _elimination(printed: PrintedPlatform, triad: PrintedTriad) -> str:
    terms, tex = printed.printed_terms.printer.terms, printed.printed_terms.tex
    x, y, phi = map(tex, printed.page.theta)
    shown = printed.page.vectors.tex
    left, right = triad.equations.polynomial
    linear = ", ".join(
        f"${shown(product)} = {tex(name)}$"
        for product, (name, _) in zip(triad.equations.linear, triad.k, strict=True)
    )
    components = [(tex(name), terms(value)) for u in triad.u for name, value in u]
    return sentence(
        r"\paragraph{All assembly modes} at actuator values follow from one polynomial (Hunt 1983;"
        r" Gosselin, Sefrioui and Richard 1992). Let $\mathbf{w} = \mathbf{b}_1 - \mathbf{a}_1$ be"
        rf" the vector of the first rod, in the axes of ${x}$ and ${y}$. The differences"
        r" between the vectors of the other rods and $\mathbf{w}$,"
        r" $\mathbf{u}_i = (\mathbf{b}_i - \mathbf{b}_1) - (\mathbf{a}_i - \mathbf{a}_1)$,"
        rf" depend only on ${phi}$,",
        aligned(components, end=","),
        "and the rod lengths require",
        _equation(
            r"|\mathbf{w}|^2 = \ell_1^2, \qquad |\mathbf{w} + \mathbf{u}_i|^2 = \ell_i^2,"
            r" \quad i = 2, 3."
        ),
        r"Subtracting the first equation from the others gives two equations linear in"
        rf" $\mathbf{{w}}$, {linear}, with",
        aligned([(tex(name), terms(value)) for name, value in triad.k]),
        r"With the rotation $J$ by $90^\circ$, their solution is",
        _equation(rf"\mathbf{{w}} = {shown(triad.equations.solution)},"),
        "which, substituted into the first equation, gives",
        _equation(f"{shown(left)} = {shown(right)}."),
    )


def _harmonics(printed: PrintedPlatform, triad: PrintedTriad) -> str:
    tex = printed.printed_terms.tex
    phi, root = tex(triad.phi), triad.letters["root"]
    first = f"{triad.letters['cosine']}_0"
    a, b = (f"{triad.letters[kind]}_m" for kind in ("cosine", "sine"))
    return sentence(
        r"Rotations preserve lengths and scalar products: every factor is of degree $1$ in"
        rf" $\cos {phi}$, $\sin {phi}$. The difference of both sides, divided by $\bar{{\ell}}^6$,"
        rf" $\bar{{\ell}}^2 = {tex(triad.scale)}$, is a sum of three harmonics, whose coefficients"
        " depend on the actuators,",
        _equation(
            rf"{first} + \sum_{{m=1}}^{{3}} \bigl({a} \cos m{phi} + {b} \sin m{phi}\bigr) = 0,"
        ),
        rf"and a polynomial of degree $6$ in ${root} = \mathrm{{e}}^{{\mathrm{{i}}{phi}}}$,",
        _equation(
            rf"{first}\,{root}^3 + \sum_{{m=1}}^{{3}} \tfrac{{1}}{{2}}"
            rf" \bigl(({a} - \mathrm{{i}} {b})\,{root}^{{3+m}}"
            rf" + ({a} + \mathrm{{i}} {b})\,{root}^{{3-m}}\bigr) = 0."
        ),
        rf"Its zeros with $|{root}| = 1$ give angles ${phi}$ of the platform: there are at most six"
        " assembly modes. They are isolated on intervals of the circle, where the Taylor series"
        " of the sum proves that there is no zero or exactly one.",
        _position(printed, triad),
    )


def _paths() -> str:
    return sentence(
        r"\paragraph{All assembly modes} at actuator values are real solutions of equations in"
        r" Study coordinates (Wampler 1996). A quaternion $\mathbf{e}$ rotates the pins of the"
        r" platform, and $\mathbf{g} = \mathbf{p}\,\mathbf{e}$ contains its position,"
        r" $\mathbf{e} \cdot \mathbf{g} = 0$. With products of quaternions, the lengths are",
        _equation(
            r"|\mathbf{g} + \mathbf{e}\,\mathbf{b}'_i - \mathbf{a}_i\,\mathbf{e}|^2"
            r" = \ell_i^2\,|\mathbf{e}|^2, \quad i = 1, \dots, 6."
        ),
        r"Subtracting the last equation from the others eliminates $|\mathbf{g}|^2$. The"
        r" equations have at most forty solutions, most of them complex (Raghavan 1993). All are"
        r" known for rods with generic complex dimensions. When these dimensions move along a"
        r" straight line to the actual rods, the solutions follow paths that do not meet, and end"
        r" in all solutions for the actual rods. The real solutions are the modes.",
    )


def _position(printed: PrintedPlatform, triad: PrintedTriad) -> str:
    terms, constant = printed.printed_terms.printer.terms, triad.letters["constant"]
    names = map(printed.printed_terms.tex, printed.page.theta[:PLANE])
    return sentence(
        "The position follows as",
        aligned(
            [(name, terms(value)) for name, value in zip(names, triad.position, strict=True)],
            end=",",
        ),
        "and Newton's iteration on the rod lengths refines every pose. If"
        r" $\mathbf{u}_2$ and $\mathbf{u}_3$ are parallel, the linear pair is singular. With"
        rf" $\mathbf{{u}}$ the longer of both and ${constant}$ of the same index,",
        _equation(
            rf"\mathbf{{w}} = \frac{{{constant}\,\mathbf{{u}} \pm"
            rf" \sqrt{{\ell_1^2 |\mathbf{{u}}|^2 - {constant}^2}}\,J \mathbf{{u}}}}"
            rf"{{|\mathbf{{u}}|^2}}"
        ),
        "holds there too. The third rod determines the sign; if it allows both signs, both are"
        " modes.",
    )


def _equation(tex: str) -> str:
    return f"\\begin{{equation*}}\n{tex}\n\\end{{equation*}}%"
