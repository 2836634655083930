"""Eliminates the position of a planar platform, as equations for the LaTeX article.

The module ``triad`` derives the equations. Legs whose ends move on circles come before legs whose
ends move on lines. The two linear equations for the vector w are ``w . m_i = k_i``. If the end of
leg i moves on a circle, m_i is the vector u_i. If the end of leg i moves on a line, m_i is the
normal n_i of this line.
"""

from collections.abc import Callable
from dataclasses import dataclass

import sympy as sp

from ..model.phasors import Complex, dot, minus, product
from ..planar.loop_step import PLANE, Cross, Dot, half
from .triad import LEGS, LegLine, Triad

Named = tuple[sp.Symbol, sp.Expr]
Name = Callable[[str, str], sp.Symbol]
"""Returns the symbol of a letter (``w``, ``u``, ``n``, ``|u|``, ``k``, ``l``, ``J``) and an index.

The index is a leg number, an axis, or both.
"""


@dataclass(frozen=True)
class LegElimination:
    """The leg equations of a planar platform after elimination of the platform position.

    Attributes:
        u: Components of u_2 and u_3 with their symbols.
        n: Components of the line normals with their symbols, at the platform angle.
        norms: The norms of the vectors u, as functions of their components.
        k: The right-hand sides of the two linear equations in w.
        w: Symbols of the components of the vector w, which leads from the fixed point of the first
            leg to the platform point b_1.
        position: The coordinates x and y of the platform as functions of w.
        linear: The left-hand sides of the two linear equations in w.
        solution: The vector w. If the ends of all three legs move on lines, w follows from the
            first two lines.
        polynomial: Both sides of the equation for the platform angle.
        distances: Symbols and values of the distances between the platform points b_i. For legs
            whose ends move on lines, ``distances`` also contains the distances from a_1 to the base
            points a_i of these legs.
        scale: The square of the length that normalizes the polynomial, as a function of the
            distances and the rod lengths.
        power: The exponent of the length that normalizes the polynomial.
        harmonics: Maximum number of harmonics of the platform angle in the polynomial.
    """

    u: tuple[tuple[Named, ...], ...]
    n: tuple[tuple[Named, ...], ...]
    norms: tuple[Named, ...]
    k: tuple[Named, ...]
    w: Complex
    position: tuple[sp.Expr, ...]
    linear: tuple[sp.Expr, ...]
    solution: sp.Expr
    polynomial: tuple[sp.Expr, sp.Expr]
    distances: tuple[Named, ...]
    scale: sp.Expr
    power: int
    harmonics: int


def leg_elimination(legs: Triad, phi: sp.Expr, name: Name) -> LegElimination:
    """Return the equations of three legs, in the symbols that ``name`` returns.

    Args:
        legs: The legs. Legs whose ends move on circles come before legs with ends on lines.
        phi: The platform's angle.
        name: Returns the symbols.
    """
    circles, turn = len(legs.L), (sp.cos(phi), sp.sin(phi))
    sides = [minus(b, legs.b[0]) for b in legs.b[1:]]
    base_vectors = [minus(A, legs.A[0]) for A in legs.A[1:]]
    u = [
        _components(name, "u", i, minus(product(side, turn), base_vector))
        for i, (side, base_vector) in enumerate(zip(sides, base_vectors, strict=True), 2)
    ]
    n = [
        _components(name, "n", i, product(line.normal, turn) if line.turns else line.normal)
        for i, line in enumerate(legs.lines, circles + 1)
    ]
    norms = {
        i: (name("|u|", f"{i}"), sp.sqrt(sp.Add(*(part**2 for part, _ in u[i - 2]))))
        for i in range(2, circles + 1)
    }
    k = {i: (name("k", f"{i}"), _right_side(legs, i, norms, name)) for i in range(2, LEGS + 1)}
    w = name("w", "x"), name("w", "y")
    m = {i: name("u" if i <= circles else "n", f"{i}") for i in range(1, LEGS + 1)}
    distances = _distances(legs, sides, base_vectors, name)
    radii = [name("l", f"{i}") for i in range(1, circles + 1)]
    ends = zip(legs.A[0], w, product(legs.b[0], turn), strict=True)
    return LegElimination(
        u=tuple(u),
        n=tuple(n),
        norms=tuple(norms.values()),
        k=tuple(k.values()),
        w=w,
        position=tuple(sp.expand(a + along - pin) for a, along, pin in ends),
        linear=tuple(Dot(name("w", ""), m[i]) for i in range(2, LEGS + 1)),
        solution=_solution(m, k, name, circles),
        polynomial=_polynomial(m, k, norms, name, circles),
        distances=tuple(distances),
        scale=sp.Add(*(d**2 for d, _ in distances), *(r**2 for r in radii)) / LEGS,
        power=2 * circles if circles else 1,
        harmonics=_harmonics(legs),
    )


def _components(name: Name, letter: str, i: int, parts: Complex) -> tuple[Named, ...]:
    names = [name(letter, f"{i}{axis}") for axis in PLANE]
    return tuple(zip(names, map(sp.expand, parts), strict=True))


def _right_side(legs: Triad, i: int, norms: dict[int, Named], name: Name) -> sp.Expr:
    if i not in norms:
        return -Dot(name("n", f"{i}"), name("u", f"{i}"))
    constant = _radius(legs, i, name) ** 2 - _radius(legs, 1, name) ** 2 - norms[i][0] ** 2
    return half(constant) if constant.is_Add else sp.Rational(1, 2) * constant


def _radius(legs: Triad, i: int, name: Name) -> sp.Expr:
    """Return the radius of the circle of leg ``i``.

    If the radius is a compound expression with symbols, a new symbol replaces the radius.
    """
    L = legs.L[i - 1]
    return L if L.is_Atom or not L.free_symbols else name("l", f"{i}")


def _solution(m: dict[int, sp.Symbol], k: dict[int, Named], name: Name, circles: int) -> sp.Expr:
    J = name("J", "")
    if circles:
        return J * (k[3][0] * m[2] - k[2][0] * m[3]) / Cross(m[2], m[3])
    return J * k[2][0] * m[1] / Cross(m[1], m[2])


def _polynomial(
    m: dict[int, sp.Symbol],
    k: dict[int, Named],
    norms: dict[int, Named],
    name: Name,
    circles: int,
) -> tuple[sp.Expr, sp.Expr]:
    k2, k3 = k[2][0], k[3][0]
    if not circles:
        return k2 * Cross(m[3], m[1]) + k3 * Cross(m[1], m[2]), sp.S.Zero
    s2, s3 = (norms[i][0] ** 2 if i in norms else sp.S.One for i in (2, 3))
    left = k2**2 * s3 - 2 * k2 * k3 * Dot(m[2], m[3]) + k3**2 * s2
    return left, name("l", "1") ** 2 * Cross(m[2], m[3]) ** 2


def _distances(
    legs: Triad, sides: list[Complex], base_vectors: list[Complex], name: Name
) -> list[Named]:
    """Return the lengths of the platform sides and of the base vectors of legs on lines."""
    vectors = [("|b|", "21", sides[0]), ("|b|", "31", sides[1])]
    vectors.append(("|b|", "32", minus(sides[1], sides[0])))
    others = max(0, len(legs.L) - 1)
    vectors += [("|a|", f"{i}1", v) for i, v in enumerate(base_vectors[others:], others + 2)]
    return [(name(letter, pair), sp.sqrt(dot(v, v))) for letter, pair, v in vectors]


def _harmonics(legs: Triad) -> int:
    """Return the degree of the polynomial in the cosine and sine of the platform angle.

    Each scalar k_i has degree 1, and so has each product of two vectors u_i or n_i. The product of
    two line normals is independent of the platform angle if both lines lie on one body.
    """
    kinds: list[LegLine | None] = [*([None] * len(legs.L)), *legs.lines]

    def degree(i: int, j: int) -> int:
        one, other = kinds[i - 1], kinds[j - 1]
        return int(one is None or other is None or one.turns != other.turns)

    if not legs.L:
        return 1 + max(degree(3, 1), degree(1, 2))
    return max(2 + degree(3, 3), 2 + degree(2, 3), 2 + degree(2, 2))
