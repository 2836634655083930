"""A function on lanes: its statements on vectors, by the names of ``chasles_lanes.h``."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from ...program.statements import CALLS, ELEMENTARY, INSTRUCTIONS, NAME, Body, Compute, Store
from ...program.strength import FUNCTIONS
from ...terms.symbolic_function import Signature
from .scalar import WIDTH

SUPPORT = "chasles_lanes.h"
_CALLED = re.compile(rf"({'|'.join((*CALLS, *INSTRUCTIONS, *FUNCTIONS))})\((.*)\)")
_SQUARE = re.compile(r"sq\((\w+)\)")
_COMPARISON = re.compile(r"(\S+) (<=?|[!=]=) (\S+)")
_COMPARISONS = {"<": "LT", "<=": "LE", "==": "EQ", "!=": "NE"}
_CONNECTION = re.compile(r"(\S+) (&&|\|\|) (\S+)")
_CONNECTIONS = {"&&": "AND", "||": "OR"}
_SELECTION = re.compile(r"(\S+) \? (\S+) : (\S+)")
_EXTREMES = {"fmin": "MIN", "fmax": "MAX"}
_PAIR = 2
_CONSTANT = "const lanes "


@dataclass(frozen=True)
class Sizes:
    """Doubles of each input and of each output of a kernel."""

    inputs: tuple[int, ...]
    outputs: tuple[int, ...]


def sizes(function: Signature) -> Sizes:
    """The sizes of a function's inputs and outputs."""
    inputs = tuple(argument.size for argument in function.inputs)
    return Sizes(inputs, tuple(result.size for result in function.outputs))


def kernel(body: Body, loads: Sequence[str], of: Sizes, alike: Sequence[str] = ()) -> list[str]:
    """The lines of a C function that puts its results into ``out``, one output behind the other.

    Args:
        body: Its statements.
        loads: The lines that give names to what it reads.
        of: Sizes of inputs and outputs.
        alike: Names of angles that are the same in lanes 2 k and 2 k + 1 of every vector; two such
            angles are computed at once, one in the even lanes and one in the odd.
    """
    first = offsets(of.outputs)
    given = {**_cosines_and_sines(body), **_angles_at_once(body, alike)}
    writer = _Writer(body)
    lines = list(loads)
    for statement in body.statements:
        match statement:
            case Compute(name) if name in given:
                lines += given[name]
            case Compute():
                lines += writer.computed(statement)
            case Store(i, entry, value):
                lines.append(f"  out[{first[i] + entry}] = {writer.vector(value)};")
    return _filled(lines)


def _filled(lines: Iterable[str]) -> list[str]:
    """Constants declared together and statements side by side, in lines of the page's width."""
    filled: list[str] = []
    declaring = False
    for line in map(str.strip, lines):
        constant = line.startswith(_CONSTANT)
        piece, goes_on = line, constant and declaring
        if goes_on:
            filled[-1] = f"{filled[-1][:-1]},"
            piece = line.removeprefix(_CONSTANT)
        beside = goes_on or not (constant or declaring)
        if filled and beside and len(filled[-1]) + len(piece) < WIDTH:
            filled[-1] += f" {piece}"
        else:
            filled.append(f"{'      ' if goes_on else '  '}{piece}")
        declaring = constant
    return filled


def offsets(of: Sequence[int]) -> list[int]:
    """Where each of several arrays begins, one behind the other."""
    return [sum(of[:k]) for k in range(len(of))]


class _Writer:
    """Writes statements; knows which names are conditions, that is, masks."""

    def __init__(self, body: Body) -> None:
        self.conditions = {s.name for s in body.computed if s.is_condition}
        self.numbers: set[str] = set()
        for statement in body.statements:
            if isinstance(statement, Store):
                self.numbers.add(statement.value)
            elif selection := _SELECTION.fullmatch(statement.expression):
                self.numbers.update(selection.groups()[1:])
            elif not statement.is_condition or _COMPARISON.fullmatch(statement.expression):
                self.numbers.update(NAME.findall(statement.expression))

    def computed(self, statement: Compute) -> list[str]:
        name, expression = statement.name, statement.expression
        if name in self.conditions:
            lines = [f"  const lanes_where {name} = {self._condition(expression)};"]
            if name in self.numbers:
                lines.append(f"  const lanes {self.number(name)} = LANES_NUMBER({name});")
            return lines
        if call := _CALLED.fullmatch(expression):
            return self._called(name, *call.groups())
        if selection := _SELECTION.fullmatch(expression):
            condition, this, other = selection.groups()
            terms = ", ".join((self._where(condition), self.number(this), self.number(other)))
            value = f"LANES_CHOICE({terms})"
        else:
            value = NAME.sub(lambda match: self.number(match.group()), expression)
            value = _SQUARE.sub(r"\1 * \1", value)
        return [f"  const lanes {name} = {value};"]

    def number(self, term: str) -> str:
        """A term as a number: of a condition, 1 or 0."""
        return f"{term}_number" if term in self.conditions else term

    def vector(self, term: str) -> str:
        """A term as lanes."""
        return f"LANES_OF({term})" if _is_number(term) else self.number(term)

    def _where(self, term: str) -> str:
        return term if term in self.conditions else f"LANES_NE({term}, 0.0)"

    def _condition(self, expression: str) -> str:
        if expression.startswith("!"):
            return f"LANES_NOT({self._where(expression[1:])})"
        if connection := _CONNECTION.fullmatch(expression):
            left, sign, right = connection.groups()
            return f"LANES_{_CONNECTIONS[sign]}({self._where(left)}, {self._where(right)})"
        comparison = _COMPARISON.fullmatch(expression)
        assert comparison
        left, sign, right = comparison.groups()
        return f"LANES_{_COMPARISONS[sign]}({self.number(left)}, {self.number(right)})"

    def _called(self, name: str, function: str, arguments: str) -> list[str]:
        """A call, by address; numbers among its arguments get a name of their own."""
        terms = arguments.split(", ")
        if function in _EXTREMES and any(map(_is_number, terms)):
            # A number is not NaN: it stands second, so that it takes the place of one.
            first, second = sorted(terms, key=_is_number)
            value = f"LANES_{_EXTREMES[function]}({self.number(first)}, {second})"
            return [f"  const lanes {name} = {value};"]
        lines: list[str] = []
        names: list[str] = []
        for k, argument in enumerate(terms):
            names.append(f"{name}_{k}" if _is_number(argument) else self.number(argument))
            if _is_number(argument):
                lines.append(f"  const lanes {names[-1]} = LANES_OF({argument});")
        return [*lines, f"  LANES_LET{len(names)}({name}, {function}, {', '.join(names)});"]


def _cosines_and_sines(body: Body) -> dict[str, list[str]]:
    """Calls that give both of an angle: the call at the first's name, nothing at the other's."""
    names: dict[str, dict[str, str]] = {}
    for statement in body.computed:
        call = ELEMENTARY.fullmatch(statement.expression)
        if call and call.group(1) in ("cos", "sin"):
            names.setdefault(call.group(2), {})[call.group(1)] = statement.name
    calls: dict[str, list[str]] = {}
    for angle, of in names.items():
        if len(of) == _PAIR:
            c, s = of["cos"], of["sin"]
            first, second = of.values()
            calls[first] = [f"  LANES_COS_SIN({c}, {s}, {angle});"]
            calls[second] = []
    return calls


def _angles_at_once(body: Body, alike: Sequence[str]) -> dict[str, list[str]]:
    """Calls that give two angles: the call at the second's name, nothing at the first's."""
    calls: dict[str, list[str]] = {}
    for first, second in zip(alike[::2], alike[1::2], strict=False):
        points = [
            call.group(2)
            for statement in body.computed
            if statement.name in (first, second)
            and (call := ELEMENTARY.fullmatch(statement.expression))
        ]
        (y1, x1), (y2, x2) = (point.split(", ") for point in points)
        addresses = ", ".join(f"&{name}" for name in (y1, x1, y2, x2, first, second))
        calls[first] = []
        calls[second] = [f"  lanes {first}, {second}; LANES_NAME(lanes_two_atan2)({addresses});"]
    return calls


def _is_number(value: str) -> bool:
    return value[0] in "-0123456789"
