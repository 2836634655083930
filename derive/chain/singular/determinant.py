"""The determinant of an arm's Jacobian, factored: a factor is 0 in singular configurations.

The twist of the tool by the joints is written in the axes of the base, but as seen by a body in the
middle of the chain and at a point of it, where most entries are 0. Rows and columns are then sorted
so that blocks of few joints remain, and the determinant is the product of theirs. Half-angle
tangents make each a polynomial, which factors uniquely; its factors are turned back to cosines and
sines of sums of coordinates.

Source: the determinant does not depend on frame and point, Murray, Li and Sastry 1994, 3.4.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations
from operator import add
from typing import Any

import numpy as np
import sympy as sp
from numpy.typing import NDArray
from sympy.simplify.fu import TR8
from sympy.utilities.iterables import strongly_connected_components

from ...model.robot import Robot, Rotation
from ..poe import placement_matrix, to_poe

FloatArray = NDArray[np.float64]
Polynomial = Any
"""An element of a ring of polynomials, for which SymPy has no type."""
MOST_JOINTS = 6
"""Joints of a square Jacobian at most."""
LARGEST_BLOCK = 3
"""Most joints of a block whose determinant is written out."""
MOST_TERMS = 4000
"""Most terms of a polynomial that is factored."""
NOTHING = 1e-9
"""Entry of a Jacobian, beside lengths of about a metre, below which it counts as 0."""
SEED = 20
TRIES = 3
"""Configurations in general position at which an entry has to be 0."""


@dataclass(frozen=True)
class Determinant:
    """A determinant as a product.

    Attributes:
        constant: The factor without coordinates, in the robot's parameters.
        factors: The factors in cosines and sines of the coordinates, each with its power.
    """

    constant: sp.Expr
    factors: tuple[tuple[sp.Expr, int], ...]


def determinant(robot: Robot, q: Sequence[sp.Symbol]) -> Determinant | None:
    """The determinant of the Jacobian of the coordinates that a robot's tool can move in.

    Args:
        robot: A serial robot, whose joints each have a coordinate.
        q: Its coordinates.

    Returns:
        The determinant of the rows that are not 0 in the frame where it is written, up to sign;
        None where there are not as many as joints, where a joint follows another or advances as it
        turns, where the description has numbers other than fractions and parameters, or where the
        determinant does not fall into small blocks.
    """
    joints = robot.moving
    if len(q) != len(joints) or any(j.mimic or j.kind == "helical" for j in joints):
        return None
    if len(joints) > MOST_JOINTS or not _is_square_cut(robot):
        return None
    values = {parameter.symbol: float(parameter.value) for parameter in robot.parameters}
    S, _ = to_poe(robot)
    S = S * sp.diag(*(joint.direction for joint in joints))
    if not _is_rational(S):
        return None
    view = _sparsest(S, _points(robot), values)
    return _factored(_Ring(S, q), view) if view is not None else None


def _is_square_cut(robot: Robot) -> bool:
    """Whether all constant turns are by quarters, so that cosines and sines are whole numbers."""
    return all(
        (2 * motion.angle / sp.pi).is_Integer
        for placement in robot.placements[:-1]
        for motion in placement
        if isinstance(motion, Rotation)
    )


def _is_rational(S: sp.Matrix) -> bool:
    """Whether all entries are polynomials in parameters with fractions as coefficients."""
    return all(
        entry.is_polynomial(*entry.free_symbols)
        and not entry.has(sp.Function)
        and all(part.is_Rational or part.is_Symbol for part in entry.atoms())
        and not any(power.base.is_number for power in entry.atoms(sp.Pow))
        for entry in S
    )


@dataclass(frozen=True)
class _View:
    """Where the Jacobian is written.

    Attributes:
        body: The number of joints before the body that sees it.
        point: The point of the body, in the base frame with every joint at 0.
        blocks: Rows and columns of the blocks on the diagonal.
    """

    body: int
    point: sp.Matrix
    blocks: tuple[tuple[tuple[int, ...], tuple[int, ...]], ...]

    @property
    def size(self) -> int:
        """The joints of the largest block."""
        return max(len(columns) for _, columns in self.blocks)


def _points(robot: Robot) -> list[sp.Matrix]:
    """The origins of all frames of the chain, with every joint at 0."""
    T = placement_matrix(robot.base)
    found = [T[:3, 3]]
    for joint in robot.joints:
        for placement in (joint.before, joint.after):
            T = T * placement_matrix(placement)
            found.append(T[:3, 3])
    return [sp.ImmutableMatrix(point) for point in dict.fromkeys(map(sp.ImmutableMatrix, found))]


def _sparsest(
    S: sp.Matrix, points: Sequence[sp.Matrix], values: Mapping[sp.Symbol, float]
) -> _View | None:
    """The view with the smallest blocks, among equals that with most entries 0."""
    in_numbers = np.array(S.xreplace(values).evalf(), float)
    rng = np.random.default_rng(SEED)
    postures = rng.uniform(-3, 3, (TRIES, S.shape[1]))
    best: tuple[tuple[int, int], _View] | None = None
    for body in range(S.shape[1] + 1):
        stacked = np.stack([seen_screws(in_numbers, posture, body) for posture in postures])
        for point in points:
            at = np.array(point.xreplace(values).evalf(), float).ravel()
            moved = stacked.copy()
            moved[:, :3] += np.cross(stacked[:, 3:], at[None, :, None], axis=1)
            filled = np.asarray((np.abs(moved) > NOTHING).any(axis=0))
            blocks = _blocks(filled)
            if blocks is None:
                continue
            view = _View(body, point, blocks)
            key = (view.size, int(filled.sum()))
            if best is None or key < best[0]:
                best = key, view
    return best[1] if best and best[1].size <= LARGEST_BLOCK else None


def seen_screws(S: FloatArray, q: FloatArray, body: int) -> FloatArray:
    """The screws of all joints (6, n) as the body behind so many joints sees them."""
    columns = []
    for i, screw in enumerate(S.T):
        between = range(body - 1, i, -1) if i < body else range(body, i)
        carried = screw
        for k in between[::-1]:
            carried = _carried(S[:, k], -q[k] if i < body else q[k], carried)
        columns.append(carried)
    return np.stack(columns, axis=1)


def _carried(axis: FloatArray, angle: float, screw: FloatArray) -> FloatArray:
    """A screw that a joint carries along."""
    v, w = axis[:3], axis[3:]
    if not w.any():
        return np.hstack([screw[:3] + angle * np.cross(v, screw[3:]), screw[3:]])
    K = np.cross(np.eye(3), w)
    R = np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * (K @ K)
    p = (np.eye(3) - R) @ np.cross(w, v)
    turned = R @ screw[3:]
    return np.hstack([R @ screw[:3] + np.cross(p, turned), turned])


def _blocks(
    filled: NDArray[np.bool_],
) -> tuple[tuple[tuple[int, ...], tuple[int, ...]], ...] | None:
    """The blocks of a matrix without its rows of zeros; None where it is singular or not square."""
    rows = [i for i in range(6) if filled[i].any()]
    count = filled.shape[1]
    if len(rows) != count:
        return None
    row_of = next(
        (p for p in permutations(rows) if all(filled[r, c] for c, r in enumerate(p))), None
    )
    if row_of is None:
        return None
    edges = [(a, b) for a in range(count) for b in range(count) if filled[row_of[a], b]]
    components = strongly_connected_components((list(range(count)), edges))
    return tuple(
        (tuple(row_of[c] for c in sorted(part)), tuple(sorted(part))) for part in components
    )


class _Ring:
    """Screws as polynomials in parameters and the cosines and sines of the coordinates."""

    def __init__(self, S: sp.Matrix, q: Sequence[sp.Symbol]) -> None:
        self.q = tuple(q)
        self.parameters = sorted(S.free_symbols, key=str)
        self.cosines = [sp.Dummy(f"c{k}") for k, _ in enumerate(q)]
        self.sines = [sp.Dummy(f"s{k}") for k, _ in enumerate(q)]
        self.slides = [sp.Dummy(f"d{k}") for k, _ in enumerate(q)]
        symbols = [*self.parameters, *self.cosines, *self.sines, *self.slides]
        self.ring = sp.ring(symbols, sp.QQ)[0]
        self.S = [self.vector(S[:, k]) for k in range(S.shape[1])]

    def vector(self, column: sp.Matrix) -> list[Polynomial]:
        """A vector of polynomials in parameters."""
        return [self.ring.from_expr(sp.expand(entry)) for entry in column]

    def matrix(self, view: _View) -> list[list[Polynomial]]:
        """The Jacobian's columns in a view."""
        point = self.vector(view.point)
        columns = []
        for i, screw in enumerate(self.S):
            seen, before = screw, i < view.body
            between = range(i + 1, view.body) if before else range(i - 1, view.body - 1, -1)
            for k in between:
                seen = self._carried(k, -1 if before else 1, seen)
            shift = _cross(seen[3:], point)
            columns.append([self.reduced(x) for x in [*map(add, seen[:3], shift), *seen[3:]]])
        return columns

    def _carried(self, k: int, sense: int, screw: list[Polynomial]) -> list[Polynomial]:
        """A screw that a joint carries along, or back where the sense is -1."""
        v, w = self.S[k][:3], self.S[k][3:]
        ring, zero = self.ring, self.ring.zero
        if all(x == zero for x in w):
            slide = sense * ring.from_expr(self.slides[k])
            shift = _cross([slide * x for x in v], screw[3:])
            return [*map(add, screw[:3], shift), *screw[3:]]
        c, s = ring.from_expr(self.cosines[k]), sense * ring.from_expr(self.sines[k])

        def turned(x: list[Polynomial]) -> list[Polynomial]:
            once = _cross(w, x)
            twice = _cross(w, once)
            return [
                self.reduced(a + s * b + (1 - c) * d)
                for a, b, d in zip(x, once, twice, strict=True)
            ]

        point = _cross(w, v)
        moved = [a - b for a, b in zip(point, turned(point), strict=True)]
        h = turned(screw[3:])
        return [*map(add, turned(screw[:3]), _cross(moved, h)), *h]

    def reduced(self, polynomial: Polynomial) -> Polynomial:
        """A polynomial with 1 - c^2 for the square of every sine."""
        first = len(self.parameters)
        count = len(self.q)
        for k in range(count):
            cosine, sine = first + k, first + count + k
            if all(powers[sine] < 2 for powers in polynomial):  # noqa: PLR2004 - a square
                continue
            square = 1 - self.ring.gens[cosine] ** 2
            total = self.ring.zero
            for powers, factor in polynomial.items():
                left = list(powers)
                left[sine] %= 2
                term = self.ring.term_new(tuple(left), factor)
                total += term * square ** (powers[sine] // 2)
            polynomial = total
        return polynomial

    def block(self, columns: list[list[Polynomial]], rows: Sequence[int]) -> Polynomial:
        """The determinant of some rows of as many columns."""
        if len(rows) == 1:
            return columns[0][rows[0]]
        total = self.ring.zero
        for k, row in enumerate(rows):
            if columns[0][row] != 0:
                rest = self.block(columns[1:], [*rows[:k], *rows[k + 1 :]])
                total += (-1) ** k * columns[0][row] * rest
        return self.reduced(total)


def _cross(a: Sequence[Polynomial], b: Sequence[Polynomial]) -> list[Polynomial]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _factored(ring: _Ring, view: _View) -> Determinant | None:
    columns = ring.matrix(view)
    constant, factors = sp.S.One, dict[sp.Expr, int]()
    for rows, numbers in view.blocks:
        found = ring.block([columns[k] for k in numbers], rows)
        if found == 0 or len(found) > MOST_TERMS:
            return None
        parts = _Tangents(ring, found).parts()
        if parts is None:
            return None
        for part, power in parts:
            if part.free_symbols & {*ring.q}:
                content, primitive = part.primitive()
                if primitive.could_extract_minus_sign():
                    content, primitive = -content, -primitive
                constant *= content**power
                factors[primitive] = factors.get(primitive, 0) + power
            else:
                constant *= part**power
    return Determinant(constant, tuple(factors.items()))


class _Tangents:
    """A polynomial in cosines and sines by the tangents of half the angles.

    Attributes:
        budget: The power of 1 + t^2 in the denominator, for each coordinate.
        factors: The factors of the numerator in tangents, parameters and slides.
    """

    def __init__(self, ring: _Ring, polynomial: Polynomial) -> None:
        self.source = ring
        first, count = len(ring.parameters), len(ring.q)
        cosines, sines = range(first, first + count), range(first + count, first + 2 * count)
        self.budget = [
            max(powers[c] + powers[s] for powers in polynomial)
            for c, s in zip(cosines, sines, strict=True)
        ]
        self.t = [sp.Dummy(f"t{k}") for k in range(count)]
        symbols = [*ring.parameters, *ring.slides, *self.t]
        tangents = sp.ring(symbols, sp.QQ)[0]
        gens = dict(zip(symbols, tangents.gens, strict=True))
        numerator = tangents.zero
        for powers, factor in polynomial.items():
            term = tangents.ground_new(factor)
            for symbol, power in zip(ring.ring.symbols, powers, strict=True):
                if symbol in gens:
                    term *= gens[symbol] ** power
            for k, (c, s) in enumerate(zip(cosines, sines, strict=True)):
                t = gens[self.t[k]]
                term *= (1 - t**2) ** powers[c] * (2 * t) ** powers[s]
                term *= (1 + t**2) ** (self.budget[k] - powers[c] - powers[s])
            numerator += term
        content, found = numerator.factor_list()
        self.content = sp.Rational(int(content.numerator), int(content.denominator))
        self.factors = [f.as_expr() for f, power in found for _ in range(power)]

    def parts(self) -> list[tuple[sp.Expr, int]] | None:
        """The factors in cosines and sines, each with its power."""
        factors = self.factors
        for k, t in enumerate(self.t):
            factors = _paired(factors, t, self.budget[k])
        found: list[sp.Expr] = [self.content]
        left = list(self.budget)
        for factor in factors:
            degrees = [_half(sp.degree(factor, t)) for t in self.t]
            left = [a - b for a, b in zip(left, degrees, strict=True)]
            found.append(self._turned_back(factor, degrees))
        if any(power < 0 for power in left):
            return None
        for q, power in zip(self.source.q, left, strict=True):
            found += [(1 + sp.cos(q)) / 2] * power
        return [(part, found.count(part)) for part in dict.fromkeys(found)]

    def _turned_back(self, factor: sp.Expr, degrees: Sequence[int]) -> sp.Expr:
        """A factor over powers of 1 + t^2 in cosines and sines of sums of coordinates."""
        source = self.source
        for t, q, half in zip(self.t, source.q, degrees, strict=True):
            if half == 0:
                continue
            c, s = sp.cos(q), sp.sin(q)
            terms = sp.Poly(factor, t).terms()
            factor = sp.Add(
                *(
                    coefficient
                    * ((1 - c) / 2) ** (power // 2)
                    * (s / 2) ** (power % 2)
                    * ((1 + c) / 2) ** (half - power // 2 - power % 2)
                    for (power,), coefficient in terms
                )
            )
            factor = sp.expand(factor)
        factor = factor.xreplace(dict(zip(source.slides, source.q, strict=True)))
        summed = sp.expand(TR8(factor))
        return min((factor, summed), key=lambda form: len(sp.Add.make_args(form)))


def _half(degree: int) -> int:
    return -(-int(degree) // 2)


def _paired(factors: list[sp.Expr], t: sp.Symbol, budget: int) -> list[sp.Expr]:
    """The factors with those of odd degree in a tangent multiplied in pairs, as far as needed.

    The tangent alone is half a sine by itself.
    """
    odd = [f for f in factors if sp.degree(f, t) % 2 and f != t]
    alone = [f for f in factors if f == t]
    even = [f for f in factors if sp.degree(f, t) % 2 == 0]
    pairs = [sp.expand(a * b) for a, b in zip(odd[::2], odd[1::2], strict=False)]
    single = odd[len(odd) - len(odd) % 2 :]
    used = sum(_half(sp.degree(f, t)) for f in (*even, *pairs, *single, *alone))
    while used > budget and len(alone) > 1:
        pairs.append(t**2)
        alone = alone[2:]
        used -= 1
    return [*even, *pairs, *single, *alone]
