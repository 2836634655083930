"""CasADi's generated C, statement by statement, free of what surrounds it.

What CasADi's code generator exports around a function (sparsities, work vectors, memory) says
nothing for dense functions without state. The arithmetic is kept as it stands; a statement that is
not recognised is an error, never passed on.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca

from .lower import LoweringError

_BODY = re.compile(r"^static int casadi_f(\d+)\(.*?\) \{\n(.*?)^\}", re.MULTILINE | re.DOTALL)
_LOCALS = re.compile(r"  casadi_real ((?:a\d+(?:, )?)+);")
_LOAD = re.compile(r"  (a\d+)=arg\[(\d+)\]\? arg\[\2\]\[(\d+)\] : 0;")
_STORE = re.compile(r"  if \(res\[(\d+)\]!=0\) res\[\1\]\[(\d+)\]=(a\d+);")
_NUMBER = r"-?(?:\d+\.?\d*(?:e[+-]\d+)?)"
_CONSTANT = re.compile(rf"  (a\d+)=({_NUMBER});")
_COMPUTE = re.compile(
    rf"  (a\d+)=((?:a\d+|{_NUMBER}|sin|cos|tan|atan2?|sqrt|casadi_sq|[-+*/(),. ])+);"
)


_NUMBER_ALONE = re.compile(_NUMBER)
_OPERATION = re.compile(rf"({_NUMBER}|\w+)?([-+*/])({_NUMBER}|\w+)")
NAME = re.compile(r"\bv\d+\b")
"""The name of something computed."""
_VARIABLE = re.compile(r"\ba\d+\b")
ELEMENTARY = re.compile(r"(sin|cos|tan|atan|atan2|sqrt)\((.*)\)")
"""A call of the C library; its arguments are variables or numbers, never expressions."""


@dataclass(frozen=True)
class Compute:
    """``name = expression``, each name once; a square is written ``sq(name)``."""

    name: str
    expression: str


@dataclass(frozen=True)
class Store:
    """``output[entry] = value``, a name or a number."""

    output: int
    entry: int
    value: str


@dataclass(frozen=True)
class Body:
    """One function in single assignment: what it reads, then what it computes and stores.

    Attributes:
        loads: Input and entry of everything that is read; entry k of input i is called
            ``<its name>_<k>`` in expressions.
        statements: In order. Calls of the C library and what they need come first: a call ends the
            life of all registers, so that the arithmetic is best left in one piece.
    """

    loads: tuple[tuple[int, int], ...]
    statements: tuple[Compute | Store, ...]

    @property
    def computed(self) -> list[Compute]:
        """The statements that compute."""
        return [statement for statement in self.statements if isinstance(statement, Compute)]

    @property
    def squares(self) -> bool:
        """Whether a square is taken somewhere."""
        return any("sq(" in statement.expression for statement in self.computed)


def bodies(lowered: Sequence[ca.Function]) -> list[Body]:
    """What CasADi's code generator writes for functions.

    Raises:
        LoweringError: An output is not dense, or a statement is not known here.
    """
    generator = ca.CodeGenerator("kernels.c", {"casadi_real": "double", "casadi_int": "int"})
    for function in lowered:
        for k in range(function.n_out()):
            if function.nnz_out(k) != function.numel_out(k):
                raise LoweringError(f"{function.name()}: output {k} is not dense")
        generator.add(function)
    found = {int(number): text for number, text in _BODY.findall(generator.dump())}
    if len(found) != len(lowered):
        raise LoweringError(f"{len(lowered)} functions became {len(found)} in C")
    return [_body(function, found[k]) for k, function in enumerate(lowered)]


def _body(function: ca.Function, text: str) -> Body:
    loads: set[tuple[int, int]] = set()
    statements: list[Compute | Store] = []
    # What each of CasADi's variables, which it uses again and again, stands for at this line.
    now: dict[str, str] = {}

    def renamed(expression: str) -> str:
        return _VARIABLE.sub(lambda match: now[match.group()], expression)

    for line in text.splitlines():
        if load := _LOAD.fullmatch(line):
            source, entry = int(load.group(2)), int(load.group(3))
            loads.add((source, entry))
            now[load.group(1)] = f"{function.name_in(source)}_{entry}"
        elif store := _STORE.fullmatch(line):
            value = now[store.group(3)]
            statements.append(Store(int(store.group(1)), int(store.group(2)), value))
        elif constant := _CONSTANT.fullmatch(line):
            now[constant.group(1)] = _shortest(constant.group(2))
        elif compute := _COMPUTE.fullmatch(line):
            expression = renamed(compute.group(2)).replace("casadi_sq", "sq")
            name = f"v{sum(isinstance(s, Compute) for s in statements) + 1}"
            statements.append(Compute(name, _spaced(expression)))
            now[compute.group(1)] = name
        elif line not in ("  return 0;", "") and not _LOCALS.fullmatch(line):
            raise LoweringError(f"{function.name()}: unknown C statement {line.strip()!r}")
    return Body(tuple(sorted(loads)), tuple(_calls_first(statements)))


def _spaced(expression: str) -> str:
    """An expression as one writes it, with numbers in their shortest exact form."""
    if ELEMENTARY.fullmatch(expression) or expression.startswith("sq("):
        return expression
    bare = expression[1:-1] if expression.startswith("(") else expression
    operation = _OPERATION.fullmatch(bare)
    if operation is None:
        raise LoweringError(f"unknown C expression {expression!r}")
    left, sign, right = operation.groups()
    return f"{_shortest(left)} {sign} {_shortest(right)}" if left else f"{sign}{_shortest(right)}"


def _shortest(text: str) -> str:
    return repr(float(text)) if _NUMBER_ALONE.fullmatch(text) else text


def _calls_first(statements: Sequence[Compute | Store]) -> list[Compute | Store]:
    needed: set[str] = set()
    early: set[str] = set()
    for statement in reversed(statements):
        if isinstance(statement, Compute) and (
            statement.name in needed or ELEMENTARY.fullmatch(statement.expression)
        ):
            early.add(statement.name)
            needed.update(NAME.findall(statement.expression))
    first = [s for s in statements if isinstance(s, Compute) and s.name in early]
    rest = [s for s in statements if isinstance(s, Store) or s.name not in early]
    return _numbered([*first, *rest])


def _numbered(statements: Sequence[Compute | Store]) -> list[Compute | Store]:
    """Names counted in the order of the statements."""
    names: dict[str, str] = {}

    def renamed(text: str) -> str:
        return NAME.sub(lambda match: names[match.group()], text)

    numbered: list[Compute | Store] = []
    for statement in statements:
        if isinstance(statement, Compute):
            expression = renamed(statement.expression)
            names[statement.name] = f"v{len(names) + 1}"
            numbered.append(Compute(names[statement.name], expression))
        else:
            numbered.append(replace(statement, value=renamed(statement.value)))
    return numbered
