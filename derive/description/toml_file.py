"""Reads TOML files with exact numbers, units and parameters.

Each error states the file and the line.

``TomlFile`` handles values and lines, not robots.
"""

import keyword
import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from typing import NoReturn, TypeVar

import sympy as sp

from ..model.errors import DescriptionError
from ..model.exact import RESERVED, NotExact, checked, read
from ..model.kinds import ParameterKind
from ..model.names import check_robot_name
from ..model.placements import Vector
from ..model.robot import Parameter
from ..model.roots import at, drawn_out
from ..model.tolerances import LENGTH_SCALING
from ..model.values import NoValue, value_at
from .noise import radians_meant
from .plausibility import LARGEST, statement_of
from .suggestions import hint
from .toml_lines import MAX_PARTS, LongKeyError, first_line, is_unreadable, table_of

Keys = tuple[str | int, ...]
"""Path to a value in the file: table names, field names and list indices."""
Word = TypeVar("Word", bound=str)
OWN_FIELDS = ("name", "title", "source")
"""Fields of a robot file that a file with ``extends`` may replace. Such a file may also replace
parameter values."""
EXTENDING_FIELDS = ("extends", *OWN_FIELDS, "parameters")
LENGTHS = {
    "m": sp.Integer(1),
    "cm": sp.Rational(1, 100),
    "mm": sp.Rational(1, 1000),
    "inch": sp.Rational(254, 10000),
}
ANGLES = {"rad": sp.Integer(1), "deg": sp.pi / 180}
RATIOS = {"1": sp.Integer(1)}
MASSES = {"kg": sp.Integer(1), "g": sp.Rational(1, 1000)}
PARAMETER_UNITS = LENGTHS | ANGLES | RATIOS | MASSES
KIND_WORDS: dict[ParameterKind, str] = {
    "length": "a length",
    "angle": "an angle",
    "ratio": "a number",
    "mass": "a mass",
}
NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,62}")
NAMED = "a letter, then at most 62 letters, digits or _; not a Python keyword"
FRAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_]{0,62}")
COORDINATE = re.compile(r"qd{0,2}[0-9]*")
MAX_CHARACTERS_SHOWN = 80
_MISSING = "; it is missing"


_DECIMAL = re.compile(r"[+-]?[0-9]*\.[0-9]+")


def file_error(
    file: str, line: int | None, field: str, value: object, expected: str
) -> DescriptionError:
    """Return the error for a value in a robot file."""
    position = file if line is None else f"{file}:{line}"
    about = f"{field}: " if field else ""
    found = "" if value is None else f", found {shown_value(value)}"
    message = f"{position}: {about}expected {expected}{found}"
    return DescriptionError(
        message, file=file, line=line, field=field, value=value, expected=expected
    )


class TomlFile:
    """A robot file with its table, units and parameters.

    Each error states its line in the file.
    """

    def __init__(self, file: str, text: str, extending: "TomlFile | None" = None) -> None:
        """Parse the text.

        Args:
            file: File name for error messages.
            text: TOML text.
            extending: A file that extends this file. The extending file overrides the name, title,
                source and parameter values of this file. The message of an error in the extending
                file contains the name of the extending file.

        Raises:
            DescriptionError: The text is empty or not valid TOML, or the extending file contains a
                field that is not allowed.
        """
        self.file, self.text = file, text
        self.extending: TomlFile | None = None
        self.table = self._parsed()
        self.scale: dict[ParameterKind, sp.Expr] = {"ratio": sp.Integer(1), "mass": sp.Integer(1)}
        self.stated: frozenset[str] = frozenset()
        self.symbols: dict[str, sp.Symbol] = {}
        self.kinds: dict[str, ParameterKind] = {}
        if extending is not None:
            self._leave_to(extending)

    def _parsed(self) -> dict[str, object]:
        try:
            table = table_of(self.text)
        except tomllib.TOMLDecodeError as error:
            position = re.search(r"at line (\d+)", str(error))
            line = int(position.group(1)) if position else self.text.rstrip().count("\n") + 1
            reason = str(error).split(" (at ")[0]
            raise file_error(self.file, line, "", None, f"valid TOML ({reason})") from error
        except (ValueError, ArithmeticError, RecursionError) as error:
            expected = "a number with fewer digits"
            if isinstance(error, RecursionError):
                expected = "fewer brackets in brackets"
            elif isinstance(error, LongKeyError):
                expected = f"keys of at most {MAX_PARTS} parts"
            line = first_line(self.text, is_unreadable)
            raise file_error(self.file, line, "", None, expected) from error
        if not table:
            raise file_error(self.file, None, "", None, "a robot in the file, which is empty")
        return table

    def _leave_to(self, extending: "TomlFile") -> None:
        extending.check_fields((), extending.table, EXTENDING_FIELDS)
        parameters = dict(self.table_at(("parameters",), {}))
        for name in extending.table_at(("parameters",), {}):
            keys: Keys = ("parameters", name)
            if name not in parameters:
                known = f"one of the parameters of {self.file}: {listed(parameters)}"
                extending.fail(keys, f"{known}{hint(name, parameters)}", shown=name)
            parameters[name] = _revalued(parameters[name], extending._new_value(keys))
        inherited = {field: v for field, v in self.table.items() if field != "name"}
        own = {field: extending.table[field] for field in OWN_FIELDS if field in extending.table}
        self.table = inherited | own | ({"parameters": parameters} if parameters else {})
        self.extending = extending

    def _new_value(self, keys: Keys) -> object:
        value = self.at(keys)
        if not isinstance(value, Mapping):
            return value
        self.check_fields(keys, value, ("value",))
        if "value" not in value:
            self.fail((*keys, "value"), "the parameter's value here")
        return value["value"]

    def declare_units(self) -> None:
        """Read the units of the file."""
        units = self.table_at(("units",), {})
        self.check_fields(("units",), units, ("length", "angle"))
        self.stated = frozenset(units)
        self.scale["length"] = self.choice(("units", "length"), LENGTHS, "m")
        self.scale["angle"] = self.choice(("units", "angle"), ANGLES, "rad")

    def declare_parameters(self) -> None:
        """Read the names and units of parameters.

        If a parameter has no unit, its first use determines whether it is a length or an angle.
        """
        for name, value in self.table_at(("parameters",), {}).items():
            keys: Keys = ("parameters", name)
            if not is_name(name) or name in RESERVED or COORDINATE.fullmatch(name):
                expected = (
                    f"a name ({NAMED}), not a coordinate such as q1 "
                    f"and not one of {listed(RESERVED)}"
                )
                self.fail(keys, expected, shown=name)
            self.symbols[name] = sp.Symbol(name, real=True)
            if isinstance(value, Mapping):
                self.check_fields(keys, value, ("value", "unit", "meaning", "assumed"))
                if "unit" in value:
                    self.choice((*keys, "unit"), PARAMETER_UNITS, "m")
                    self.kinds[name] = _kind_of_unit(str(value["unit"]))

    def parameter(self, name: str) -> Parameter:
        """Return a parameter with its value in meter, in radian or as a ratio."""
        keys: Keys = ("parameters", name)
        kind = self.kinds.get(name, "length")
        given = self.at(keys)
        if not isinstance(given, Mapping) or "unit" not in given:
            number = given.get("value") if isinstance(given, Mapping) else given
            self.check_degrees(keys, number, kind)
        if not isinstance(given, Mapping):
            return Parameter(name, self._sized(keys, self.literal(keys), kind), kind)
        scale = PARAMETER_UNITS.get(str(given.get("unit")), self.scale[kind])
        value = self.literal((*keys, "value"))
        value = value * scale if "unit" in given else self._sized(keys, value, kind)
        assumed = bool(self.assumed(keys, ("value",)))
        return Parameter(name, value, kind, self.string((*keys, "meaning"), ""), assumed)

    def assumed(self, keys: Keys, fields: Sequence[str]) -> tuple[str, ...]:
        """Return the fields of a table that are marked as assumed."""
        at: Keys = (*keys, "assumed")
        value = self.at(at)
        given = tuple(field for field in fields if self.at((*keys, field)) is not None)
        if value is None or value is False:
            return ()
        if value is True:
            return given
        if not isinstance(value, list) or not value:
            self.fail(at, "true, or a list of fields of this table")
        return tuple(self.option((*at, k), given, "") for k in range(len(value)))

    def _sized(self, keys: Keys, value: sp.Expr, kind: ParameterKind) -> sp.Expr:
        """Convert a number to meter or radian. A large number needs a stated unit."""
        if kind in LARGEST and kind not in self.stated and abs(float(value)) > LARGEST[kind]:
            self.fail(keys, statement_of(kind))
        return value * self.scale[kind]

    def vector(self, keys: Keys, kind: ParameterKind) -> Vector:
        """Read a list of three numbers. A missing field gives three zeros."""
        value = self.at(keys)
        if value is not None and (not isinstance(value, list) or len(value) != 3):  # noqa: PLR2004
            self.fail(keys, "a list of three numbers")
        x, y, z = (self.number((*keys, k), kind) for k in range(3))
        return x, y, z

    def number(self, keys: Keys, kind: ParameterKind) -> sp.Expr:
        """Read an expression (meter or radian), or return 0 for a missing field."""
        value = self.at(keys)
        if value is None:
            return sp.Integer(0)
        self.check_degrees(keys, value, kind)
        try:
            expression = read(value, self.symbols, self.scale["angle"])
        except NotExact as error:
            self.fail(keys, f"{KIND_WORDS[kind]} ({error})")
        in_file_units = {}
        for symbol in sorted(expression.free_symbols, key=str):
            known = self.kinds.setdefault(symbol.name, _use(symbol, expression, kind))
            in_file_units[symbol] = symbol / self.scale[known]
            is_meant = isinstance(expression, sp.Symbol) or "mass" in (kind, known)
            if known not in (kind, "ratio") and is_meant:
                self.fail(
                    keys,
                    f"{KIND_WORDS[kind]}; {symbol} is {KIND_WORDS[known]} by its unit or first use",
                )
        expression = self.scale[kind] * drawn_out(expression.xreplace(in_file_units))
        if not self._scales(expression, kind):
            self.fail(
                keys,
                f"{KIND_WORDS[kind]}; with length parameters, this expression has another unit; "
                'declare ratios as { value = ..., unit = "1" } in [parameters]',
            )
        if not expression.free_symbols:
            self._sized(keys, expression, kind)
        try:
            checked(self.at_defaults(expression))
        except (NotExact, NoValue) as error:
            self.fail(keys, f"{KIND_WORDS[kind]} ({error} at the parameters' values)")
        return sp.expand_mul(expression)

    def at_defaults(self, expression: sp.Expr) -> sp.Expr:
        """Evaluate an expression at default parameters."""
        symbols = sorted(expression.free_symbols, key=str)
        return at(expression, {s: self.parameter(s.name).value for s in symbols})

    def check_degrees(self, keys: Keys, value: object, kind: ParameterKind) -> None:
        """Raise an error for angles in degrees whose values look like radians, such as 1.5708."""
        if kind != "angle" or self.scale["angle"] == 1:
            return
        for text in map(str, _parts(value)):
            if re.search(r"\bpi\b", text):
                self.fail(keys, 'an angle in degrees, the stated unit; pi requires the unit "rad"')
            try:
                meant = radians_meant(read(text)) if _DECIMAL.fullmatch(text) else None
            except NotExact as error:
                self.fail(keys, f"{KIND_WORDS[kind]} ({error})")
            if meant is not None:
                self.fail(
                    keys,
                    f"an angle in degrees, the stated unit; {text} is {meant} in radians: write "
                    f'{meant * 180 / sp.pi}, or "{read(text)}" if {text} degrees are meant',
                )

    def _scales(self, expression: sp.Expr, kind: ParameterKind) -> bool:
        lengths = [s for s in expression.free_symbols if self.kinds[s.name] == "length"]
        if not lengths:
            return True
        point = {
            s: sp.Rational(7919 + 1009 * k**2, 10007)
            for k, s in enumerate(sorted(expression.free_symbols, key=str))
        }
        try:
            one, two, three = (
                value_at(expression, {s: v * (t if s in lengths else 1) for s, v in point.items()})
                for t in (1, 2, 3)
            )
        except NoValue:
            return False
        excess = three - 2 * two + one if kind == "length" else two - one
        return bool(abs(excess) < LENGTH_SCALING)

    def literal(self, keys: Keys, default: int | None = None) -> sp.Expr:
        """Read a number that contains no parameters.

        The number is in the units of the file.
        """
        value = self.at(keys)
        if value is None and default is not None:
            return sp.Integer(default)
        try:
            return read(value)
        except NotExact as error:
            self.fail(keys, f"a number without parameters ({error})")

    def name(self, keys: Keys, default: str | None = None) -> str:
        """Read a name that is valid in C."""
        value = self.at(keys)
        if value is None and default is not None:
            return default
        if not isinstance(value, str) or not is_name(value):
            self.fail(keys, f"a name: {NAMED}")
        return value

    def robot_name(self) -> str:
        """Read the name of the robot.

        All generated names start with this name.
        """
        name = self.name(("name",))
        try:
            check_robot_name(name)
        except DescriptionError as error:
            self.fail(("name",), f"a robot's name ({error})")
        return name

    def string(self, keys: Keys, default: str) -> str:
        """Read a text that consists of one line."""
        value = self.at(keys)
        if value is None:
            return default
        if not isinstance(value, str) or not value.isprintable():
            self.fail(keys, "one line of text")
        return value

    def option(self, keys: Keys, options: Iterable[Word], default: str) -> Word:
        """Read a text value that must be one of `options`."""
        value = self.at(keys)
        chosen = (
            value if isinstance(value, str) else default if value is None else shown_value(value)
        )
        if isinstance(value, bool | list | dict):
            chosen = ""
        found = next((option for option in options if option == chosen), None)
        if found is None:
            self.fail(keys, f"one of {listed(options)}{hint(chosen, options)}")
        return found

    def choice(self, keys: Keys, options: Mapping[str, sp.Expr], default: str) -> sp.Expr:
        """Read the name of a unit and return its conversion factor."""
        return options[self.option(keys, options, default)]

    def table_at(self, keys: Keys, default: dict[str, object] | None = None) -> dict[str, object]:
        """Read a table."""
        value = self.at(keys)
        if value is None and default is not None:
            return default
        if not isinstance(value, dict):
            self.fail(keys, "a table")
        return value

    def check_fields(self, keys: Keys, table: Mapping[str, object], known: Iterable[str]) -> None:
        """Raise DescriptionError if a table has an unknown field."""
        for field in table:
            if field not in known:
                expected = f"one of the fields {listed(known)}{hint(field, known)}"
                self.fail((*keys, field), expected, shown=field)

    def at(self, keys: Keys) -> object:
        """Return a value of the file, or None if the value is missing."""
        return _follow(self.table, keys)

    def fail(self, keys: Keys, expected: str, shown: object = ...) -> NoReturn:
        """Raise an error that shows the invalid value.

        If the value is missing, the error states the line of the table that should contain the
        value.

        Args:
            keys: The path to the value.
            expected: A valid value, in words.
            shown: The value that the error message shows. The default is the value at the path
                ``keys``.
        """
        value = self.at(keys) if shown is ... else shown
        if value is None and shown is ...:
            expected += _MISSING
        writer = self._writer(keys)
        raise file_error(writer.file, writer._line(keys), dotted(keys), value, expected) from None

    def _writer(self, keys: Keys) -> "TomlFile":
        """Return the file that contains a value: this file, or the file that extends it."""
        if self.extending is None or keys[2:] not in ((), ("value",)):
            return self
        return (
            self.extending if keys == ("name",) or self.extending.at(keys[:2]) is not None else self
        )

    def _line(self, keys: Keys) -> int | None:
        """Return the line of a value, or of its table if the value is missing."""
        while keys and self.at(keys) is None:
            keys = keys[:-1]
        if not keys:
            return None
        return first_line(self.text, lambda text: _follow(table_of(text), keys) is not None)


def _follow(value: object, keys: Keys) -> object:
    for key in keys:
        if isinstance(value, Mapping):
            value = value.get(key)
        elif isinstance(value, list) and isinstance(key, int) and key < len(value):
            value = value[key]
        else:
            return None
    return value


def dotted(keys: Keys) -> str:
    """Return a path with dots, such as ``joints[2].alpha``. List indices start at 1."""
    text = ""
    for key in keys:
        text += f"[{key + 1}]" if isinstance(key, int) else f".{key}" if text else key
    return text


def is_name(text: str) -> bool:
    """Whether a text is a valid name in a robot file."""
    return bool(NAME.fullmatch(text)) and not keyword.iskeyword(text)


def _revalued(parameter: object, value: object) -> object:
    """Return a parameter with another value, and with the unchanged unit and meaning."""
    return {**parameter, "value": value} if isinstance(parameter, Mapping) else value


def _parts(value: object) -> list[object]:
    return list(value) if isinstance(value, list) else [value]


def _use(symbol: sp.Symbol, expression: sp.Expr, kind: ParameterKind) -> ParameterKind:
    """Return the kind of a parameter (length, angle or ratio) from an expression that uses it."""
    if any(symbol in part.free_symbols for part in expression.atoms(sp.atan, sp.atan2)):
        return "length"
    if any(symbol in part.free_symbols for part in expression.atoms(sp.sin, sp.cos, sp.tan)):
        return "angle"
    return kind


def _kind_of_unit(unit: str) -> ParameterKind:
    if unit in MASSES:
        return "mass"
    return "length" if unit in LENGTHS else "angle" if unit in ANGLES else "ratio"


def is_missing(expected: str) -> bool:
    """Whether an error reports a missing value."""
    return expected.endswith(_MISSING)


def keys_of(field: str) -> Keys:
    """Return the path to a value. Inverse of ``dotted``."""
    parts = re.findall(r"\[(\d+)\]|([^.\[]+)", field)
    return tuple(int(index) - 1 if index else name for index, name in parts)


def listed(words: Iterable[str]) -> str:
    """Join words with commas."""
    return ", ".join(sorted(words) if isinstance(words, frozenset) else words)


def shown_value(value: object) -> str:
    """Format a value as in the file. A long value is truncated."""
    try:
        text = repr(value) if isinstance(value, str | list | dict) else str(value)
    except ValueError:  # Python refuses to print integers with several thousand digits.
        return "a very large integer"
    if isinstance(value, bool):
        text = text.lower()
    return text if len(text) <= MAX_CHARACTERS_SHOWN else f"{text[: MAX_CHARACTERS_SHOWN - 3]}..."
