"""Converts SymPy terms of a derivation to a CasADi graph.

The conversion supports +, *, integer and half powers, sin, cos, tan, atan, atan2, Abs, sign, Min,
Max, and Piecewise with comparisons. Parameters are replaced by their default values. Exact numbers
are evaluated with 40 digits and then rounded once to floats.
"""

import operator
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import reduce

import casadi as ca
import numpy as np
import sympy as sp
from numpy.typing import NDArray
from sympy.core.relational import Relational
from sympy.logic.boolalg import Boolean

from ..model.errors import DescriptionError
from .branches import branch
from .symbolic_function import SymbolicFunction
from .terms import Terms


class LoweringError(DescriptionError):
    """Error for an expression that cannot be converted.

    The message quotes the part of the expression without a conversion rule.
    """


def lower(functions: Sequence[SymbolicFunction], prefix: str) -> list[ca.Function]:
    """Convert functions to CasADi.

    The CasADi functions have the names ``<prefix>_<name>`` and dense, row-major outputs.

    The outputs of solver calls become additional inputs of the CasADi function.

    A function with branch signs becomes ``<prefix>_<name>_branch``, which computes a single branch
    and whose last input ``choice`` contains the signs.

    Args:
        functions: The functions to convert. A term without branch signs is converted only once,
            even if it occurs in several functions.
        prefix: The robot's name.

    Raises:
        LoweringError: A part of an expression has no conversion rule.
    """
    shared = _Visitor(functions[0].terms) if functions else None
    return [
        _Visitor(function.terms, function.signs).function(branch(function), prefix)
        if function.signs or shared is None
        else shared.function(function, prefix)
        for function in functions
    ]


def values_at(function: ca.Function, arguments: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the outputs (m, k) of a CasADi function with one input at m input vectors (m, n).

    CasADi reads and writes the NumPy arrays directly, which is ten times faster than the use of
    CasADi matrices.
    """
    arguments = np.ascontiguousarray(arguments)
    results = np.empty((len(arguments), function.numel_out(0)))
    if not len(arguments):
        return results
    buffer, run = function.map(len(arguments)).buffer()
    buffer.set_arg(0, arguments.data)  # type: ignore[call-arg]
    buffer.set_res(0, results.data)  # type: ignore[call-arg]
    run()
    return results


def combined(functions: Sequence[SymbolicFunction], name: str) -> ca.Function:
    """Join functions with one output each to a single CasADi function, for optimal control.

    The joined function has the arguments of all functions. Each output has the name of its
    function, such as ``fk``. All dimensions of an output after the first are flattened.
    """
    visitor = _Visitor(functions[0].terms)
    arguments = {argument.name: argument for f in functions for argument in f.arguments}
    inputs = [visitor.vector(argument.symbols) for argument in arguments.values()]
    outputs = []
    for function in functions:
        (entries,) = visitor.outputs(function)
        rows = function.outputs[0].shape[0]
        outputs.append(ca.reshape(entries, entries.numel() // rows, rows).T)
    return ca.Function(name, inputs, outputs, list(arguments), [f.name for f in functions])


class _Visitor:
    """Builds the CasADi graph of shared terms."""

    def __init__(self, terms: Terms, signs: Iterable[sp.Symbol] = ()) -> None:
        self.terms = terms
        self.signs = frozenset(signs)
        self.nodes: dict[sp.Expr, ca.SX] = {
            symbol: ca.SX(float(terms.value(symbol)))
            for symbol in (*terms.parameters, *terms.constants)
        }

    def function(self, function: SymbolicFunction, prefix: str) -> ca.Function:
        return ca.Function(
            f"{prefix}_{function.name}",
            [self.vector(argument.symbols) for argument in function.arguments],
            self.outputs(function),
            [argument.name for argument in function.arguments],
            [result.name for result in function.outputs],
        )

    def outputs(self, function: SymbolicFunction) -> list[ca.SX]:
        for symbol, term in function.definitions():
            if symbol not in self.nodes:
                self.nodes[symbol] = self.node(term)
        nodes = [
            ca.densify(ca.vertcat(*(self.node(entry) for entry in result.entries)))
            for result in function.outputs
        ]
        # Equal terms already share a name. In addition, CasADi shares equal parts of long sums.
        with _as_written():
            return ca.cse(nodes)

    def node(self, expression: sp.Expr) -> ca.SX:
        known = self.nodes.get(expression)
        if known is None:
            known = self.nodes[expression] = self._lowered(expression)
        return known

    def vector(self, symbols: Iterable[sp.Symbol]) -> ca.SX:
        for symbol in symbols:
            self.nodes.setdefault(symbol, ca.SX.sym(symbol.name))
        return ca.vertcat(*(self.nodes[symbol] for symbol in symbols))

    def _lowered(self, expression: sp.Expr) -> ca.SX:
        if self.terms.is_constant(expression):
            return ca.SX(float(self.terms.value(expression)))
        if expression.is_Add:
            return self._sum(expression)
        if expression.is_Mul:
            return self._product(expression)
        if expression.is_Pow:
            return self._power(expression)
        if expression.is_Piecewise:
            return self._choice(expression)
        if expression.func is sp.atan2:
            return self._angle(*expression.args)
        rule = _FUNCTIONS.get(expression.func)
        if rule is None:
            raise LoweringError(
                f"no conversion to CasADi for {expression.func.__name__}: {expression}"
            )
        return rule(*(self.node(argument) for argument in expression.args))

    def _sum(self, expression: sp.Expr) -> ca.SX:
        plus: list[ca.SX] = []
        minus: list[ca.SX] = []
        for term in expression.args:
            negative = term.as_coeff_Mul()[0].is_negative
            (minus if negative else plus).append(self.node(-term if negative else term))
        if not plus:
            return -_added(minus)
        total = _added(plus)
        for term in minus:
            total = total - term
        return total

    def _product(self, expression: sp.Expr) -> ca.SX:
        coefficient, rest = expression.as_coeff_Mul()
        if coefficient == -1:
            return -self.node(rest)
        constant = [factor for factor in expression.args if self.terms.is_constant(factor)]
        product = self.node(sp.Mul(*constant)) if constant else None
        for factor in expression.args:
            if self.terms.is_constant(factor):
                continue
            if factor.is_Pow and factor.exp.is_negative:
                divisor = self.node(1 / factor)
                product = 1 / divisor if product is None else product / divisor
            else:
                product = self.node(factor) if product is None else product * self.node(factor)
        assert product is not None
        return product

    def _power(self, expression: sp.Expr) -> ca.SX:
        base, exponent = expression.args
        if not exponent.is_Rational or exponent.q not in (1, 2):
            raise LoweringError(f"no conversion to CasADi for the power {expression}")
        node = self.node(base)
        factors = [node] * (abs(exponent.p) // exponent.q)
        if exponent.q == 2:  # noqa: PLR2004
            factors.insert(0, ca.sqrt(node))
        power = reduce(operator.mul, factors)
        return power if exponent > 0 else 1 / power

    def _angle(self, y: sp.Expr, x: sp.Expr) -> ca.SX:
        if y.as_coeff_Mul()[0].is_negative:
            return -self._angle(-y, x)
        factors = sp.Mul.make_args(self.terms.definitions.get(y, y))
        rest = [factor for factor in factors if factor not in self.signs]
        if len(rest) == len(factors):
            return ca.atan2(self.node(y), self.node(x))
        signs = [self.node(factor) for factor in factors if factor in self.signs]
        return reduce(operator.mul, signs) * self._angle(sp.Mul(*rest), x)

    def _choice(self, expression: sp.Piecewise) -> ca.SX:
        """Return the value of the first true condition.

        A NaN in the other values has no effect.
        """
        *cases, (value, last) = expression.args
        if last != sp.true:
            raise LoweringError(f"no value if no condition is true: {expression}")
        node = self.node(value)
        for value, condition in reversed(cases):
            node = _chosen(self._condition(condition), self.node(value), node)
        return node

    def _condition(self, condition: Boolean) -> ca.SX:
        if condition in (sp.true, sp.false):
            return ca.SX(int(bool(condition)))
        if isinstance(condition, Relational):
            return _RELATIONS[condition.func](*(self.node(side) for side in condition.args))
        rule = _LOGIC.get(condition.func)
        if rule is None:
            raise LoweringError(
                f"no conversion to CasADi for {condition.func.__name__}: {condition}"
            )
        return rule(*(self._condition(part) for part in condition.args))


@contextmanager
def _as_written() -> Iterator[None]:
    """Disable CasADi's simplification, because it would create the product (c ? x : 0) * y."""
    ca.GlobalOptions.setSimplificationOnTheFly(False)
    try:
        yield
    finally:
        ca.GlobalOptions.setSimplificationOnTheFly(True)


def _chosen(condition: ca.SX, this: ca.SX, other: ca.SX) -> ca.SX:
    if condition.is_constant():
        return this if condition.is_one() else other
    with _as_written():
        return ca.if_else(condition, this, other)


def _folded(operation: Callable[[ca.SX, ca.SX], ca.SX]) -> Callable[..., ca.SX]:
    return lambda *nodes: reduce(operation, nodes)


_FUNCTIONS: Mapping[type[sp.Expr], Callable[..., ca.SX]] = {
    sp.sin: ca.sin,
    sp.cos: ca.cos,
    sp.tan: ca.tan,
    sp.atan: ca.atan,
    sp.Abs: ca.fabs,
    sp.sign: ca.sign,
    sp.Min: _folded(ca.fmin),
    sp.Max: _folded(ca.fmax),
}
_RELATIONS: Mapping[type[Relational], Callable[[ca.SX, ca.SX], ca.SX]] = {
    sp.Lt: operator.lt,
    sp.Le: operator.le,
    sp.Gt: operator.gt,
    sp.Ge: operator.ge,
    sp.Eq: operator.eq,
    sp.Ne: operator.ne,
}
_LOGIC: Mapping[type[Boolean], Callable[..., ca.SX]] = {
    sp.And: _folded(ca.logic_and),
    sp.Or: _folded(ca.logic_or),
    sp.Not: ca.logic_not,
}


def _added(nodes: list[ca.SX]) -> ca.SX:
    total = nodes[0]
    for node in nodes[1:]:
        total = total + node
    return total
