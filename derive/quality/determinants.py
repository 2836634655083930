"""Symbolic det(D^T D) of a link. The determinant is zero at discontinuities of the model.

D is the derivative of the link's homogeneous matrix with respect to the parameters. The diagonal
entries of D^T D are sums of squared entries of D. In these sums, a meter of translation has weight
1, and a radian of rotation has weight 2.

Source: Closed chain cascade manipulator with an improved kinematic model, Mathematical Problems in
Engineering, 3.1, after Schroeer.
"""

from collections.abc import Sequence
from functools import cache
from itertools import product as combinations

import sympy as sp
from sympy.polys.matrices import DomainMatrix

from ..description.conventions.axis_maps import POSE, AxisMap, axis_map, numbers_of, twists
from ..model.convention import Convention
from ..model.kinds import JointKind
from ..model.placements import Rotation

_WEIGHTS = sp.diag(1, 1, 1, 2, 2, 2)
_TURNS = 3
_OF_TURNS = 8
"""The product of the six weights for (v, omega)."""
_Pair = tuple[sp.Symbol, sp.Symbol]


@cache
def determinant(convention: Convention, kind: JointKind) -> sp.Expr:
    """Return det(D^T D) for the parameters of the convention.

    The unit is meter to some power.
    """
    found = axis_map(convention, kind)
    return _simplified(_gram(twists(numbers_of(convention, kind), found.own)))


@cache
def completed_determinant(convention: Convention, kind: JointKind) -> sp.Expr:
    """Return det(D^T D) for a link model that has all parameters of a pose.

    For a prismatic joint, D contains only rotations, because the position depends on the joint
    coordinate. The result is 0 if there are more than six parameters.
    """
    found = axis_map(convention, kind)
    if kind == "prismatic":
        return _simplified(_gram(_turns(found)))
    if found.columns.shape[1] == POSE:
        # For a square matrix, the squared determinant is a shorter expression than the Gram
        # determinant.
        return _simplified(found.columns, squared=True)
    return _simplified(_gram(found.columns))


def _turns(found: AxisMap) -> sp.Matrix:
    columns = dict(zip(found.symbols, found.columns[3:, :].T.tolist(), strict=True))
    turning = {symbol: column for symbol, column in columns.items() if any(column)}
    first = found.product[0]
    if len(turning) > _TURNS and isinstance(first, Rotation):
        # Two tilts and a rotation about the joint axis can produce a rotation about the previous
        # axis.
        turning.pop(first.angle, None)
    return sp.Matrix([[0, 0, 0, *column] for column in turning.values()]).T


def _gram(columns: sp.Matrix) -> sp.Matrix:
    return columns.T * _WEIGHTS * columns


def _simplified(matrix: sp.Matrix, *, squared: bool = False) -> sp.Expr:
    angles = sorted({f.args[0] for f in matrix.atoms(sp.sin, sp.cos)}, key=str)
    pairs = [sp.symbols(f"c_{k} s_{k}") for k in range(len(angles))]
    names = {
        function(angle): letter
        for angle, pair in zip(angles, pairs, strict=True)
        for function, letter in zip((sp.cos, sp.sin), pair, strict=True)
    }
    found = _reduced(_determinant(matrix.xreplace(names)), pairs, [s for _, s in pairs])
    if squared:
        found = _OF_TURNS * found**2
    forms = [sp.factor(_reduced(sp.expand(found), pairs, away)) for away in combinations(*pairs)]
    shortest = min(forms, key=sp.count_ops)
    return shortest.xreplace({letter: function for function, letter in names.items()})


def _determinant(matrix: sp.Matrix) -> sp.Expr:
    ring = DomainMatrix.from_Matrix(sp.Matrix(matrix))
    return ring.domain.to_sympy(ring.charpoly()[-1]) * (-1) ** matrix.shape[0]


def _reduced(polynomial: sp.Expr, pairs: Sequence[_Pair], away: Sequence[sp.Symbol]) -> sp.Expr:
    for (c, s), letter in zip(pairs, away, strict=True):
        circle = c**2 + s**2 - 1
        polynomial = sp.rem(polynomial, circle, letter)
    return sp.expand(polynomial)
