"""CasADi's generated C, statement by statement, free of what surrounds it.

What CasADi's code generator exports around a function (sparsities, work vectors, memory) says
nothing for dense functions without state. The arithmetic is kept as it stands; a statement that is
not recognised is an error, never passed on.
"""

import itertools
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca

from ..terms.casadi_graph import LoweringError

_BODY = re.compile(r"^static int casadi_f(\d+)\(.*?\) \{\n(.*?)^\}", re.MULTILINE | re.DOTALL)
_LOCALS = re.compile(r"  casadi_real ((?:a\d+(?:, )?)+);")
_LOAD = re.compile(r"  (a\d+)=arg\[(\d+)\]\? arg\[\2\]\[(\d+)\] : 0;")
_STORE = re.compile(r"  if \(res\[(\d+)\]!=0\) res\[\1\]\[(\d+)\]=(a\d+);")
_NUMBER = r"-?(?:\d+\.?\d*(?:e[+-]\d+)?)"
_CONSTANT = re.compile(rf"  (a\d+)=({_NUMBER});")
_COMPUTE = re.compile(r"  (a\d+)=(.+);")
_TERM = rf"(?:{_NUMBER}|\w+)"
_NUMBER_ALONE = re.compile(_NUMBER)
_UNARY = re.compile(rf"([-!])({_TERM})")
_BINARY = re.compile(rf"({_TERM})([-+*/]|<=?|[!=]=|&&|\|\|)({_TERM})")
_SELECTION = re.compile(rf"(\w+)\?({_TERM}):0")
_HALF = re.compile(r"(\S+) \? (\S+) : 0\.0")
_SUM = re.compile(r"(\w+) \+ (\w+)")
_CONDITION = re.compile(r"!.+|\S+ (?:<=?|[!=]=|&&|\|\|) \S+")
_CALL = re.compile(rf"(?:casadi_)?(\w+)\(({_TERM}(?:,{_TERM})*)\)")
CALLS = ("sin", "cos", "tan", "atan", "atan2")
"""Functions that are calls of the C library on any machine."""
INSTRUCTIONS = ("sqrt", "fabs", "fmin", "fmax", "sign")
"""Functions that are a few instructions on most."""
NAME = re.compile(r"\bv\d+\b")
"""The name of something computed."""
_VARIABLE = re.compile(r"\ba\d+\b")
ELEMENTARY = re.compile(rf"({'|'.join((*CALLS, *INSTRUCTIONS))})\((.*)\)")
"""A function's name and its arguments, which are variables or numbers, never expressions."""


@dataclass(frozen=True)
class Compute:
    """``name = expression``, each name once.

    An expression is one operation of C on names and numbers; ``sq(x)`` is a square and ``sign(x)``
    is -1, 1 or x itself. Conditions are 0 or 1, and what they choose is ``condition ? x : y``.
    """

    name: str
    expression: str

    @property
    def is_condition(self) -> bool:
        """Whether it is a comparison or a logical connection."""
        return bool(_CONDITION.fullmatch(self.expression))


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

    def by_depth(self) -> "Body":
        """The same body, each statement as early as what it depends on allows.

        CasADi's order ends one sum before it begins the next, and in a long chain those sums are
        further apart than a processor looks ahead: it would wait for one product after the other.
        """
        depth: dict[str, int] = {}

        def deep(statement: Compute | Store) -> int:
            text = statement.value if isinstance(statement, Store) else statement.expression
            return max((depth[name] for name in NAME.findall(text)), default=0)

        for statement in self.computed:
            depth[statement.name] = deep(statement) + 1
        return replace(self, statements=tuple(_numbered(sorted(self.statements, key=deep))))

    def used(self) -> "Body":
        """The same body without statements whose value nothing takes."""
        return replace(self, statements=tuple(_used(self.statements)))

    def calls(self, function: str) -> bool:
        """Whether a function is called somewhere."""
        return any(statement.expression.startswith(f"{function}(") for statement in self.computed)


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
            name = f"v{sum(isinstance(s, Compute) for s in statements) + 1}"
            statements.append(Compute(name, renamed(_spaced(compute.group(2)))))
            now[compute.group(1)] = name
        elif line not in ("  return 0;", "") and not _LOCALS.fullmatch(line):
            raise LoweringError(f"{function.name()}: unknown C statement {line.strip()!r}")
    return Body(tuple(sorted(loads)), tuple(_calls_first(_used(_choices(statements)))))


def _spaced(expression: str) -> str:
    """An expression as one writes it, with numbers in their shortest exact form."""
    bare = expression[1:-1] if expression.startswith("(") else expression
    if unary := _UNARY.fullmatch(bare):
        sign, term = unary.groups()
        return f"{sign}{_shortest(term)}"
    if binary := _BINARY.fullmatch(bare):
        left, sign, right = binary.groups()
        return f"{_shortest(left)} {sign} {_shortest(right)}"
    if selection := _SELECTION.fullmatch(bare):
        condition, chosen = selection.groups()
        return f"{condition} ? {_shortest(chosen)} : 0.0"
    call = _CALL.fullmatch(bare)
    if call is None or call.group(1) not in ("sq", *CALLS, *INSTRUCTIONS):
        raise LoweringError(f"unknown C expression {expression!r}")
    function, terms = call.groups()
    return f"{function}({', '.join(map(_shortest, terms.split(',')))})"


def _shortest(text: str) -> str:
    return repr(float(text)) if _NUMBER_ALONE.fullmatch(text) else text


def _choices(statements: Sequence[Compute | Store]) -> list[Compute | Store]:
    """CasADi's (c ? x : 0) + (!c ? y : 0) as one choice, which also keeps the sign of -0."""
    expressions = {s.name: s.expression for s in statements if isinstance(s, Compute)}

    def chosen(left: str, right: str) -> str | None:
        halves = [_HALF.fullmatch(expressions.get(term, "")) for term in (left, right)]
        for this, other in itertools.permutations(halves):
            if this and other and expressions.get(other.group(1)) == f"!{this.group(1)}":
                return f"{this.group(1)} ? {this.group(2)} : {other.group(2)}"
        return None

    return [
        replace(statement, expression=choice)
        if isinstance(statement, Compute)
        and (total := _SUM.fullmatch(statement.expression))
        and (choice := chosen(*total.groups()))
        else statement
        for statement in statements
    ]


def _used(statements: Sequence[Compute | Store]) -> list[Compute | Store]:
    """The statements without those whose value nothing takes."""
    needed: set[str] = set()
    kept: list[Compute | Store] = []
    for statement in reversed(statements):
        if isinstance(statement, Store) or statement.name in needed:
            text = statement.value if isinstance(statement, Store) else statement.expression
            needed.update(NAME.findall(text))
            kept.append(statement)
    return kept[::-1]


def _calls_first(statements: Sequence[Compute | Store]) -> list[Compute | Store]:
    calls = tuple(f"{function}(" for function in CALLS)
    needed: set[str] = set()
    early: set[str] = set()
    for statement in reversed(statements):
        if isinstance(statement, Compute) and (
            statement.name in needed or statement.expression.startswith(calls)
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
