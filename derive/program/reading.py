"""Converts C code from CasADi to typed programs.

The arithmetic of the C code is preserved operation by operation. Sparsity, work vectors and memory
management are dropped, because functions with dense arguments and without state do not need them.
If a line or expression is unknown, the error message quotes it.
"""

import itertools
import re
from collections.abc import Sequence
from dataclasses import replace

import casadi as ca

from ..terms.casadi_graph import LoweringError
from .operations import (
    Compute,
    Constant,
    Input,
    Operand,
    Operation,
    Program,
    Statement,
    Store,
    Variable,
)
from .schedule import calls_first, needed_only

_BODY = re.compile(r"^static int casadi_f(\d+)\(.*?\) \{\n(.*?)^\}", re.MULTILINE | re.DOTALL)
_LOCALS = re.compile(r"  casadi_real ((?:a\d+(?:, )?)+);")
_LOAD = re.compile(r"  (a\d+)=arg\[(\d+)\]\? arg\[\2\]\[(\d+)\] : 0;")
_STORE = re.compile(r"  if \(res\[(\d+)\]!=0\) res\[\1\]\[(\d+)\]=(a\d+);")
_NUMBER = r"-?(?:\d+\.?\d*(?:e[+-]\d+)?)"
_CONSTANT = re.compile(rf"  (a\d+)=({_NUMBER});")
_COMPUTE = re.compile(r"  (a\d+)=(.+);")
_TERM = rf"(?:{_NUMBER}|a\d+)"
_NUMBER_ALONE = re.compile(_NUMBER)
_UNARY = re.compile(rf"([-!])({_TERM})")
_BINARY = re.compile(rf"({_TERM})([-+*/]|<=?|[!=]=|&&|\|\|)({_TERM})")
_SELECTION = re.compile(rf"({_TERM})\?({_TERM}):0")
_CALL = re.compile(rf"(?:casadi_)?(\w+)\(({_TERM}(?:,{_TERM})*)\)")

_PREFIXES = {"-": Operation.NEGATE, "!": Operation.NOT}
_INFIXES = {
    "+": Operation.ADD,
    "-": Operation.SUBTRACT,
    "*": Operation.MULTIPLY,
    "/": Operation.DIVIDE,
    "<": Operation.LESS,
    "<=": Operation.LESS_EQUAL,
    "==": Operation.EQUAL,
    "!=": Operation.NOT_EQUAL,
    "&&": Operation.AND,
    "||": Operation.OR,
}
_FUNCTIONS = {
    "sq": Operation.SQUARE,
    "sqrt": Operation.SQRT,
    "sin": Operation.SIN,
    "cos": Operation.COS,
    "tan": Operation.TAN,
    "atan": Operation.ATAN,
    "atan2": Operation.ATAN2,
    "fabs": Operation.ABS,
    "sign": Operation.SIGN,
    "fmin": Operation.MIN,
    "fmax": Operation.MAX,
}


def programs(lowered: Sequence[ca.Function]) -> list[Program]:
    """Return the programs of CasADi functions, read from the C code that CasADi generates.

    Raises:
        LoweringError: An output is not dense, or an operation is unknown.
    """
    generator = ca.CodeGenerator("kernels.c", {"casadi_real": "double", "casadi_int": "int"})
    for function in lowered:
        for k in range(function.n_out()):
            if function.nnz_out(k) != function.numel_out(k):
                raise LoweringError(f"{function.name()}: output {k} is not dense")
        generator.add(function)
    found = {int(number): text for number, text in _BODY.findall(generator.dump())}
    if len(found) != len(lowered):
        raise LoweringError(
            f"number of functions in the generated C: expected {len(lowered)}, got {len(found)}"
        )
    return [_program(function, found[k]) for k, function in enumerate(lowered)]


def _program(function: ca.Function, text: str) -> Program:
    reader = _Reader(function.name())
    for line in text.splitlines():
        reader.read(line)
    return calls_first(
        needed_only(
            Program(
                function.name(),
                tuple(function.name_in()),
                tuple(function.name_out()),
                tuple(sorted(reader.inputs, key=lambda i: (i.argument, i.entry))),
                tuple(_with_choices(reader.statements)),
            )
        )
    )


class _Reader:
    def __init__(self, name: str) -> None:
        self.name = name
        self.inputs: set[Input] = set()
        self.statements: list[Statement] = []
        # CasADi reuses variables, so this dictionary maps each variable to its current operand.
        self._now: dict[str, Operand] = {}
        self._numbers = itertools.count(1)

    def read(self, line: str) -> None:
        if load := _LOAD.fullmatch(line):
            entry = Input(int(load[2]), int(load[3]))
            self.inputs.add(entry)
            self._now[load[1]] = entry
        elif store := _STORE.fullmatch(line):
            value = self._now[store[3]]
            self.statements.append(Store(int(store[1]), int(store[2]), value))
        elif constant := _CONSTANT.fullmatch(line):
            self._now[constant[1]] = Constant(float(constant[2]))
        elif compute := _COMPUTE.fullmatch(line):
            operation, operands = self._expression(compute[2])
            result = Variable(next(self._numbers))
            self.statements.append(Compute(result, operation, operands))
            self._now[compute[1]] = result
        elif line not in ("  return 0;", "") and not _LOCALS.fullmatch(line):
            raise LoweringError(f"{self.name}: unknown C statement {line.strip()!r}")

    def _expression(self, text: str) -> tuple[Operation, tuple[Operand, ...]]:
        bare = text[1:-1] if text.startswith("(") else text
        if unary := _UNARY.fullmatch(bare):
            return _PREFIXES[unary[1]], (self._operand(unary[2]),)
        if binary := _BINARY.fullmatch(bare):
            return _INFIXES[binary[2]], (self._operand(binary[1]), self._operand(binary[3]))
        if selection := _SELECTION.fullmatch(bare):
            chosen = (self._operand(selection[1]), self._operand(selection[2]))
            return Operation.SELECT, (*chosen, Constant(0.0))
        call = _CALL.fullmatch(bare)
        if call is None:
            raise LoweringError(f"{self.name}: unknown C expression {text!r}")
        if call[1] not in _FUNCTIONS:
            raise LoweringError(f"{self.name}: unknown operation {call[1]!r} in {text!r}")
        return _FUNCTIONS[call[1]], tuple(map(self._operand, call[2].split(",")))

    def _operand(self, text: str) -> Operand:
        return Constant(float(text)) if _NUMBER_ALONE.fullmatch(text) else self._now[text]


def _with_choices(statements: Sequence[Statement]) -> list[Statement]:
    computed: dict[Operand, Compute] = {s.result: s for s in statements if isinstance(s, Compute)}

    def half(operand: Operand) -> Compute | None:
        statement = computed.get(operand)
        if statement is None or statement.operation is not Operation.SELECT:
            return None
        return statement if statement.operands[2] == Constant(0.0) else None

    def is_opposite(condition: Operand, other: Operand) -> bool:
        statement = computed.get(condition)
        return statement is not None and (
            statement.operation is Operation.NOT and statement.operands == (other,)
        )

    def joined(statement: Statement) -> Statement:
        if not isinstance(statement, Compute) or statement.operation is not Operation.ADD:
            return statement
        for this, other in itertools.permutations(map(half, statement.operands)):
            if this and other and is_opposite(other.operands[0], this.operands[0]):
                chosen = (*this.operands[:2], other.operands[1])
                return replace(statement, operation=Operation.SELECT, operands=chosen)
        return statement

    return [joined(statement) for statement in statements]
