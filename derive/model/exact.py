"""Exact numbers. Text from a file is converted to a SymPy expression and never executed.

The reader traverses the Python syntax tree of the text. The reader accepts numbers, ``pi``,
parameters, the four operations, small powers and a few functions. Any other syntax raises an error.
The error message quotes this syntax.
"""

import ast
import difflib
import math
import operator
import re
from collections.abc import Callable, Mapping, Sequence
from decimal import Decimal, InvalidOperation
from fractions import Fraction

import sympy as sp

from .errors import DescriptionError
from .roots import angle_of, power, root
from .sizes import addends
from .tolerances import ANGLE_SNAP, ROUNDING
from .values import NoValue, Values

LONGEST_TEXT = 200
MAX_NESTED = 8
"""Maximum nesting of functions and powers. Each nesting level doubles the computing time of SymPy.
"""
MAX_ADDENDS = 200
"""Maximum number of terms after expansion of products."""
LARGEST_EXPONENT = 12
LARGEST_MAGNITUDE = 30
"""Maximum number of digits before the decimal point. A number such as ``1e999999999`` is
refused."""
SMALLEST_MAGNITUDE = 400
"""Maximum number of decimal places. Some programs write ``1.2246467991473532e-16`` and smaller
numbers."""
_FUNCTIONS: dict[str, tuple[Callable[..., sp.Expr], int]] = {
    "sqrt": (root, 1),
    "sin": (sp.sin, 1),
    "cos": (sp.cos, 1),
    "tan": (sp.tan, 1),
    "atan": (lambda tangent: angle_of(tangent, sp.S.One), 1),
    "atan2": (angle_of, 2),
}
_OPERATIONS: dict[type[ast.operator], Callable[[sp.Expr, sp.Expr], sp.Expr]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
}
_OF_ANGLES = frozenset({"sin", "cos", "tan"})
_TO_ANGLES = frozenset({"atan", "atan2"})
_KINDS = {dict: "a table", type(None): "None"}
KNOWN = "numbers, pi, parameters, + - * / **, " + ", ".join(_FUNCTIONS)
_WITH_UNIT = re.compile(r"[-+]?[0-9.]+ *(m|cm|mm|in|inch|rad|deg|degrees)")
EXPECTED = f"a number or an expression of {KNOWN}"
MAX_NAMED = 8
RESERVED = frozenset({"pi", *_FUNCTIONS})


class NotExact(DescriptionError):
    """Error for a value that is not an exact real number. The caller adds file and line."""


def read(
    value: object,
    names: Mapping[str, sp.Symbol] | None = None,
    angle_unit: sp.Expr = sp.S.One,
) -> sp.Expr:
    """Return the exact value of a number or text, such as ``"pi/2"`` or ``"sqrt(2)/2"``.

    Args:
        value: int, Decimal (both exact), or text of at most 200 characters.
        names: The parameters that the text may contain.
        angle_unit: The unit (radian) of the arguments of sin, cos, tan and of the results of atan,
            atan2.

    Returns:
        A SymPy expression of Rationals, pi and the named symbols.

    Raises:
        NotExact: The value has a wrong type or unknown syntax, or it is not finite, not real or too
            large.
    """
    if isinstance(value, bool):
        raise NotExact("a truth value is not an exact number")
    if isinstance(value, int):
        return _number(str(value)) if abs(value) <= 10**LARGEST_MAGNITUDE else _number("1e999")
    if isinstance(value, Decimal):
        return _number(str(value))
    if not isinstance(value, str):
        kind = _KINDS.get(type(value), f"a {type(value).__name__}")
        raise NotExact(f"expected an exact number, got {kind}")
    try:
        return checked(_Reader(value, names or {}, angle_unit).read())
    except NoValue as error:
        raise NotExact(str(error)) from error


def exact(value: object) -> sp.Expr:
    """Convert a Python value to an exact number.

    Raises:
        NotExact: The value is a float or has a wrong type.
    """
    if isinstance(value, sp.Expr) and not value.has(sp.Float):
        return checked(value)
    if isinstance(value, float | sp.Float):
        raise NotExact(
            f"expected an exact number, got the float {value}; write a fraction or '{value}'"
        )
    if isinstance(value, Fraction):
        return sp.Rational(value.numerator, value.denominator)
    return read(value)


def exact_vector(values: object) -> tuple[sp.Expr, sp.Expr, sp.Expr]:
    """Convert a sequence of three values to exact numbers.

    Raises:
        NotExact: The sequence does not have three values, or a value is not exact.
    """
    if not isinstance(values, Sequence) or isinstance(values, str) or len(values) != 3:  # noqa: PLR2004
        raise NotExact(f"{values!r}: expected three numbers")
    x, y, z = (exact(value) for value in values)
    return x, y, z


def snap_angle(value: sp.Expr) -> sp.Expr:
    """Round an angle (radian) to a multiple of pi/12 if it is within ``ANGLE_SNAP``."""
    twelfths = round(float(value) * 12 / math.pi)
    multiple = sp.pi * sp.Rational(twelfths, 12)
    return multiple if abs(float(value) - float(multiple)) <= ANGLE_SNAP else value


def is_zero(expression: sp.Expr) -> bool:
    """Whether an expression is zero. A constant without parameters is evaluated with 40 digits.

    An expression with parameters is zero only if SymPy has reduced it to 0.
    """
    if expression.is_Rational or expression.free_symbols:
        return bool(expression == 0)
    return bool(abs(Values().of(expression)) < ROUNDING)


def checked(expression: sp.Expr) -> sp.Expr:
    """Return the expression unchanged if its value is finite, real and not too large.

    Raises:
        NotExact: The expression is infinite, complex or too large.
    """
    if expression.has(sp.zoo, sp.nan, sp.oo, -sp.oo):
        raise NotExact("division by zero")
    if expression.has(sp.I):
        raise NotExact("not a real number")
    if not expression.free_symbols:
        try:
            value = Values().of(expression)
        except NoValue as error:
            raise NotExact(str(error)) from error
        if not -(10**LARGEST_MAGNITUDE) <= value <= 10**LARGEST_MAGNITUDE:
            raise NotExact(f"larger than 1e{LARGEST_MAGNITUDE}")
    return expression


def _number(text: str) -> sp.Rational:
    try:
        number = Decimal(text)
    except InvalidOperation as error:
        raise NotExact("an exponent with too many digits") from error
    if not number.is_finite():
        raise NotExact("not a finite number")
    _, digits, exponent = number.as_tuple()
    if len(digits) > 2 * LARGEST_MAGNITUDE:
        raise NotExact(f"more than {2 * LARGEST_MAGNITUDE} digits")
    if number and number.adjusted() > LARGEST_MAGNITUDE:
        raise NotExact(f"larger than 1e{LARGEST_MAGNITUDE}")
    if abs(int(exponent)) > SMALLEST_MAGNITUDE:
        raise NotExact(f"more than {SMALLEST_MAGNITUDE} decimal places")
    return sp.Rational(text)


class _Reader:
    """Reads an expression from a text, given the symbols of its parameters and its angle unit."""

    def __init__(self, text: str, names: Mapping[str, sp.Symbol], angle_unit: sp.Expr) -> None:
        self.text = text.strip()
        self.names = names
        self.angle_unit = angle_unit

    def read(self) -> sp.Expr:
        if not self.text:
            raise NotExact("an empty text")
        if len(self.text) > LONGEST_TEXT:
            raise NotExact(f"more than {LONGEST_TEXT} characters")
        if not self.text.isascii():
            raise NotExact("letters other than ASCII")
        try:
            tree = ast.parse(self.text, mode="eval")
        except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
            if _WITH_UNIT.fullmatch(self.text):
                raise NotExact(
                    "a number with a unit; state the unit in the file's field 'units'"
                ) from error
            raise NotExact(f"not {EXPECTED}") from error
        if _nesting(tree.body) > MAX_NESTED:
            raise NotExact(f"more nested functions and powers than {MAX_NESTED}")
        expression = self._expression(tree.body)
        if addends(expression) > MAX_ADDENDS:
            raise NotExact(f"more terms after expansion of products than {MAX_ADDENDS}")
        return expression

    def _expression(self, node: ast.expr) -> sp.Expr:
        match node:
            case ast.Constant():
                return self._constant(node)
            case ast.Name(id=name):
                return self._name(name)
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return -self._expression(operand)
            case ast.UnaryOp(op=ast.UAdd(), operand=operand):
                return self._expression(operand)
            case ast.BinOp(left=left, op=ast.Pow(), right=right):
                return self._power(self._expression(left), self._expression(right))
            case ast.BinOp(left=left, op=ast.Div(), right=right):
                return self._quotient(self._expression(left), self._expression(right))
            case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATIONS:
                return _OPERATIONS[type(op)](self._expression(left), self._expression(right))
            case ast.Call(func=ast.Name(id=name), args=args, keywords=[]) if name in _FUNCTIONS:
                return self._call(name, args)
        written = ast.get_source_segment(self.text, node)
        raise NotExact(f"expected {KNOWN}, got {written!r}")

    def _constant(self, node: ast.Constant) -> sp.Expr:
        # Reads the digits from the text, because Python would round the number.
        written = ast.get_source_segment(self.text, node) or ""
        if type(node.value) not in (int, float) or not re.fullmatch(r"[0-9.eE+_-]+", written):
            raise NotExact(f"expected a decimal number, got {written!r}")
        return _number(written.replace("_", ""))

    def _name(self, name: str) -> sp.Expr:
        if name == "pi":
            return sp.pi
        if name in self.names:
            return self.names[name]
        if not self.names:
            raise NotExact(f"unknown name {name!r}")
        close = difflib.get_close_matches(name, self.names, n=1) or list(self.names)[:MAX_NAMED]
        expected = "the parameter" if len(close) == 1 else "one of the parameters"
        raise NotExact(
            f"unknown parameter {name!r}; expected {expected} {', '.join(map(repr, close))}"
        )

    def _power(self, base: sp.Expr, exponent: sp.Expr) -> sp.Expr:
        if not exponent.is_Rational or max(abs(exponent.p), exponent.q) > LARGEST_EXPONENT:
            raise NotExact(f"an exponent must be a fraction of numbers up to {LARGEST_EXPONENT}")
        if base.is_Rational and max(abs(base.p), base.q) > 10**LARGEST_MAGNITUDE:
            raise NotExact("the power is too large")
        return checked(power(base, exponent))

    def _quotient(self, numerator: sp.Expr, denominator: sp.Expr) -> sp.Expr:
        if is_zero(denominator):
            raise NotExact("division by zero")
        return numerator / denominator

    def _call(self, name: str, args: list[ast.expr]) -> sp.Expr:
        function, count = _FUNCTIONS[name]
        if len(args) != count:
            raise NotExact(f"{name} takes {count} argument{'s' if count > 1 else ''}")
        values = [self._expression(arg) for arg in args]
        if name in _OF_ANGLES:
            values = [value * self.angle_unit for value in values]
        result = function(*values)
        return checked(result / self.angle_unit if name in _TO_ANGLES else result)


def _nesting(node: ast.expr) -> int:
    """Return the maximum nesting depth of functions and powers."""
    deepest = max(map(_nesting, _operands(node)), default=0)
    is_power = isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow)
    return deepest + (is_power or isinstance(node, ast.Call))


def _operands(node: ast.expr) -> Sequence[ast.expr]:
    match node:
        case ast.BinOp(left=left, right=right):
            return left, right
        case ast.UnaryOp(operand=operand):
            return (operand,)
        case ast.Call(args=args):
            return args
    return ()
