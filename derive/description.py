"""Robot files: TOML in, a :class:`~chasles.derive.robot.Robot` out, or an error with its line.

A robot file says what a data sheet says::

    name = "ur5e"
    title = "Universal Robots UR5e"
    source = "data sheet"
    convention = "dh"
    units = { length = "m", angle = "rad" }

    [parameters]
    d1 = "0.1625"

    [[joints]]
    name = "shoulder_pan"
    d = "d1"
    alpha = "pi/2"
    limits = ["-2*pi", "2*pi"]

Every number is exact: an integer, a decimal, or a text that :mod:`chasles.derive.exact` reads.
"""

import bisect
import difflib
import keyword
import re
import tomllib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from decimal import Decimal
from pathlib import Path
from typing import NoReturn

import sympy as sp

from .conventions import CONVENTIONS, FieldKind, urdf
from .errors import RobotError
from .exact import RESERVED, NotExact, checked, read
from .robot import Joint, JointKind, Mimic, Parameter, ParameterKind, Placement, Robot

Keys = tuple[str | int, ...]
"""The way to a value in the file's table: names of tables and fields, places in lists."""
Vector = tuple[sp.Expr, sp.Expr, sp.Expr]

LONGEST_FILE = 1_000_000
MOST_JOINTS = 256
LENGTHS = {
    "m": sp.Integer(1),
    "cm": sp.Rational(1, 100),
    "mm": sp.Rational(1, 1000),
    "inch": sp.Rational(254, 10000),
}
ANGLES = {"rad": sp.Integer(1), "deg": sp.pi / 180}
RATIOS = {"1": sp.Integer(1)}
_KIND: dict[ParameterKind, str] = {"length": "a length", "angle": "an angle", "ratio": "a number"}
ROBOT_FIELDS = (
    "name",
    "title",
    "source",
    "convention",
    "units",
    "parameters",
    "base",
    "tool",
    "joints",
)
JOINT_FIELDS = ("name", "type", "convention", "limits", "link", "pitch", "direction", "mimic")
KINDS = ("revolute", "prismatic", "helical", "fixed")
NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,62}")
NAMED = "a letter, then letters, digits and _, 63 at most, and no Python keyword"
FRAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_]{0,62}")
COORDINATE = re.compile(r"qd{0,2}[0-9]*")
MOST_CHARACTERS_SHOWN = 80
_BRACKETS = {"[": "]", "{": "}"}
_TOKEN = re.compile(
    r"""
    \#[^\n]*                                  # a comment
    | \"{3}(?:\\.|[^\\])*?(?:\"{3,5}|\Z)       # strings of several lines, perhaps unfinished
    | '{3}.*?(?:'{3,5}|\Z)
    | "(?:\\.|[^"\\\n])*" | '[^'\n]*'        # strings of one line
    | [][{}]
    """,
    re.DOTALL | re.VERBOSE,
)


class DescriptionError(RobotError):
    """A robot file that is wrong: the file, the line, the field, the value, what was expected.

    Attributes:
        file: The file as it was named.
        line: Line number from 1, None where the file has no such line.
        field: Dotted path of the field, empty for the file as a whole.
        value: The value found, None where there is none.
        expected: What would have been right.
    """

    def __init__(
        self, file: str, line: int | None, field: str, value: object, expected: str
    ) -> None:
        self.file, self.line, self.field = file, line, field
        self.value, self.expected = value, expected
        place = file if line is None else f"{file}:{line}"
        about = f"{field}: " if field else ""
        found = "" if value is None else f", found {_shown(value)}"
        super().__init__(f"{place}: {about}expected {expected}{found}")


def load(path: str | Path) -> Robot:
    """Reads a robot file.

    Args:
        path: A TOML file.

    Returns:
        The robot, in metres and radians.

    Raises:
        DescriptionError: The file cannot be read or is wrong.
    """
    return loads(read_text(path), str(path))


def read_text(path: str | Path) -> str:
    """The text of a description file.

    Raises:
        DescriptionError: It cannot be read, is too long, or is not UTF-8.
    """
    file = str(path)
    try:
        with Path(path).open("rb") as stream:
            content = stream.read(LONGEST_FILE + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise DescriptionError(file, None, "", None, f"a readable file ({reason})") from error
    if len(content) > LONGEST_FILE:
        raise DescriptionError(file, None, "", None, f"at most {LONGEST_FILE} bytes")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content[: error.start].count(b"\n") + 1
        raise DescriptionError(file, line, "", None, "UTF-8 text") from error


def loads(text: str, file: str = "<text>") -> Robot:
    """Reads a robot from the text of a robot file; ``file`` is what errors call it.

    Raises:
        DescriptionError: The text is wrong.
    """
    return _Reader(file, text).robot()


class _Reader:
    """One file: its table, its units, its parameters and the place of every complaint."""

    def __init__(self, file: str, text: str) -> None:
        self.file, self.text = file, text
        self.table = self._parsed()
        self.scale: dict[ParameterKind, sp.Expr] = {"ratio": sp.Integer(1)}
        self.symbols: dict[str, sp.Symbol] = {}
        self.kinds: dict[str, ParameterKind] = {}

    def robot(self) -> Robot:
        self._check_fields((), self.table, ROBOT_FIELDS)
        name = self._name(("name",))
        units = self._table(("units",), {})
        self._check_fields(("units",), units, ("length", "angle"))
        self.scale["length"] = self._choice(("units", "length"), LENGTHS, "m")
        self.scale["angle"] = self._choice(("units", "angle"), ANGLES, "rad")
        self._declare_parameters()
        base, base_frame = self._frame("base", "0")
        tool, tool_frame = self._frame("tool", "ee")
        joints = self._joints()
        try:
            return Robot(
                name=name,
                joints=joints,
                title=self._string(("title",), name),
                source=self._string(("source",), ""),
                base=base,
                tool=tool,
                base_frame=base_frame,
                tool_frame=tool_frame,
                parameters=tuple(self._parameter(name) for name in self.symbols),
            )
        except DescriptionError:
            raise
        except RobotError as error:
            self._fail(("joints",), f"a robot ({error})", shown=None)

    # --- the parts of a file ---

    def _parsed(self) -> dict[str, object]:
        try:
            table = _table(self.text)
        except tomllib.TOMLDecodeError as error:
            place = re.search(r"at line (\d+)", str(error))
            line = int(place.group(1)) if place else self.text.rstrip().count("\n") + 1
            reason = str(error).split(" (at ")[0]
            raise DescriptionError(self.file, line, "", None, f"valid TOML ({reason})") from error
        except (ValueError, ArithmeticError, RecursionError) as error:
            nested = isinstance(error, RecursionError)
            expected = "fewer brackets in brackets" if nested else "a number of fewer digits"
            line = _first_line(self.text, _is_unreadable)
            raise DescriptionError(self.file, line, "", None, expected) from error
        if not table:
            raise DescriptionError(self.file, None, "", None, "a robot, the file says nothing")
        return table

    def _declare_parameters(self) -> None:
        for name, value in self._table(("parameters",), {}).items():
            keys: Keys = ("parameters", name)
            if not _is_name(name) or name in RESERVED or COORDINATE.fullmatch(name):
                expected = f"a name ({NAMED}), no coordinate such as q1, none of {_or(RESERVED)}"
                self._fail(keys, expected, shown=name)
            self.symbols[name] = sp.Symbol(name, real=True)
            if isinstance(value, Mapping):
                self._check_fields(keys, value, ("value", "unit", "meaning"))
                if "unit" in value:
                    self._choice((*keys, "unit"), LENGTHS | ANGLES | RATIOS, "m")
                    self.kinds[name] = _kind_of_unit(str(value["unit"]))

    def _parameter(self, name: str) -> Parameter:
        keys: Keys = ("parameters", name)
        kind = self.kinds.get(name, "length")
        given = self._at(keys)
        if not isinstance(given, Mapping) or "unit" not in given:
            self._check_degrees(keys, given, kind)
        if not isinstance(given, Mapping):
            return Parameter(name, self._literal(keys) * self.scale[kind], kind)
        scale = (LENGTHS | ANGLES | RATIOS).get(str(given.get("unit")), self.scale[kind])
        value = self._literal((*keys, "value")) * scale
        return Parameter(name, value, kind, self._string((*keys, "meaning"), ""))

    def _frame(self, which: str, default: str) -> tuple[Placement, str]:
        table = self._table((which,), {})
        self._check_fields((which,), table, ("name", "xyz", "rpy"))
        name = self._string((which, "name"), default)
        if not FRAME.fullmatch(name):
            self._fail((which, "name"), "letters, digits and _")
        xyz = self._vector((which, "xyz"), "length")
        rpy = self._vector((which, "rpy"), "angle")
        placement, _ = urdf("fixed", xyz=xyz, rpy=rpy, axis=xyz)
        return placement, name

    def _joints(self) -> tuple[Joint, ...]:
        joints = self.table.get("joints")
        if not isinstance(joints, list) or not 1 <= len(joints) <= MOST_JOINTS:
            self._fail(("joints",), f"a list of 1 to {MOST_JOINTS} joints")
        read = [self._joint(k) for k in range(len(joints))]
        for field in ("name", "link"):
            first: dict[str, int] = {}
            for k, joint in enumerate(read):
                value = getattr(joint, field)
                if first.setdefault(value, k) != k:
                    where = f"joints[{first[value] + 1}]"
                    self._fail(("joints", k, field), f"another {field} than {where} has", value)
        leaders = {j.name: j.kind for j in read if j.kind != "fixed" and j.mimic is None}
        if not leaders:
            self._fail(("joints",), "a joint that moves by itself", None)
        return tuple(self._led(k, joint, leaders) for k, joint in enumerate(read))

    def _joint(self, k: int) -> Joint:
        keys: Keys = ("joints", k)
        table = self._table(keys)
        kind = self._option((*keys, "type"), KINDS, "revolute")
        convention = self._convention(keys, table)
        fields = CONVENTIONS[convention].fields
        self._check_fields(keys, table, (*JOINT_FIELDS, *fields))
        given = {field: self._value((*keys, field), what) for field, what in fields.items()}
        if "axis" in fields and "axis" not in table:
            if kind != "fixed":
                self._fail((*keys, "axis"), "the direction that the joint moves about or along")
            given["axis"] = (sp.Integer(0), sp.Integer(0), sp.Integer(1))
        try:
            before, after = CONVENTIONS[convention].place(kind, **given)
        except DescriptionError:
            raise
        except RobotError as error:
            self._fail((*keys, "axis"), f"a direction: {error}")
        return Joint(
            name=self._name((*keys, "name"), f"joint{k + 1}"),
            kind=kind,
            before=before,
            after=after,
            link=self._name((*keys, "link"), f"link{k + 1}"),
            limits=self._limits(keys, kind),
            pitch=self._pitch(keys, kind),
            direction=int(self._option((*keys, "direction"), ("1", "-1"), "1")),
            mimic=self._mimic(keys, kind),
            convention=convention,
            given=_listed(given),
        )

    def _convention(self, keys: Keys, table: Mapping[str, object]) -> str:
        if "convention" in table:
            return self._option((*keys, "convention"), tuple(CONVENTIONS), "")
        return self._option(("convention",), tuple(CONVENTIONS), "")

    def _limits(self, keys: Keys, kind: JointKind) -> tuple[sp.Expr | None, sp.Expr | None]:
        keys = (*keys, "limits")
        value = self._at(keys)
        if value is None:
            return None, None
        if not isinstance(value, list) or len(value) != 2:  # noqa: PLR2004
            self._fail(keys, "two numbers, [lowest, highest]")
        if kind == "fixed":
            self._fail(keys, "nothing for a fixed joint")
        scale = self._coordinate_scale(kind)
        if kind != "prismatic":
            self._check_degrees(keys, value, "angle")
        lower, upper = (self._literal((*keys, side)) * scale for side in (0, 1))
        if not float(lower) < float(upper):
            self._fail(keys, "a lowest below the highest")
        return lower, upper

    def _pitch(self, keys: Keys, kind: JointKind) -> sp.Expr:
        keys = (*keys, "pitch")
        if kind == "helical" and self._at(keys) is None:
            self._fail(keys, "the advance per radian of a helical joint")
        if kind != "helical" and self._at(keys) is not None:
            self._fail(keys, f"nothing, a {kind} joint has no pitch")
        return self._number(keys, "length") if kind == "helical" else sp.Integer(0)

    def _mimic(self, keys: Keys, kind: JointKind) -> Mimic | None:
        keys = (*keys, "mimic")
        if self._at(keys) is None:
            return None
        if kind == "fixed":
            self._fail(keys, "nothing for a fixed joint")
        table = self._table(keys)
        self._check_fields(keys, table, ("joint", "multiplier", "offset"))
        return Mimic(
            leader=self._name((*keys, "joint")),
            multiplier=self._literal((*keys, "multiplier"), 1),
            offset=self._literal((*keys, "offset"), 0) * self._coordinate_scale(kind),
        )

    def _led(self, k: int, joint: Joint, leaders: Mapping[str, JointKind]) -> Joint:
        """A follower with its multiplier converted from units of the file to metre and radian."""
        if joint.mimic is None:
            return joint
        leader = joint.mimic.leader
        if leader not in leaders:
            keys = ("joints", k, "mimic", "joint")
            self._fail(keys, f"a joint that moves by itself ({_or(leaders)})")
        ratio = self._coordinate_scale(joint.kind) / self._coordinate_scale(leaders[leader])
        return replace(joint, mimic=replace(joint.mimic, multiplier=joint.mimic.multiplier * ratio))

    def _coordinate_scale(self, kind: JointKind) -> sp.Expr:
        return self.scale["length" if kind == "prismatic" else "angle"]

    # --- values ---

    def _value(self, keys: Keys, kind: FieldKind) -> sp.Expr | Vector:
        match kind:
            case "length" | "angle":
                return self._number(keys, kind)
            case "lengths":
                return self._vector(keys, "length")
            case "angles":
                return self._vector(keys, "angle")
            case "direction":
                return self._vector(keys, "ratio")

    def _vector(self, keys: Keys, kind: ParameterKind) -> Vector:
        value = self._at(keys)
        if value is not None and (not isinstance(value, list) or len(value) != 3):  # noqa: PLR2004
            self._fail(keys, "a list of three numbers")
        x, y, z = (self._number((*keys, k), kind) for k in range(3))
        return x, y, z

    def _number(self, keys: Keys, kind: ParameterKind) -> sp.Expr:
        """A field's expression in metres or radians, its parameters converted alike."""
        value = self._at(keys)
        if value is None:
            return sp.Integer(0)
        self._check_degrees(keys, value, kind)
        try:
            expression = read(value, self.symbols, self.scale["angle"])
        except NotExact as error:
            self._fail(keys, f"{_KIND[kind]} ({error})")
        in_file_units = {}
        for symbol in sorted(expression.free_symbols, key=str):
            known = self.kinds.setdefault(symbol.name, _use(symbol, expression, kind))
            in_file_units[symbol] = symbol / self.scale[known]
            if known not in (kind, "ratio") and isinstance(expression, sp.Symbol):
                self._fail(
                    keys, f"{_KIND[kind]}; by its unit or first use {symbol} is {_KIND[known]}"
                )
        expression = self.scale[kind] * expression.xreplace(in_file_units)
        if not self._scales(expression, kind):
            self._fail(
                keys,
                f"{_KIND[kind]}, which this is not if the parameters are lengths; declare ratios "
                'as { value = ..., unit = "1" } in [parameters]',
            )
        defaults = {s: self._parameter(s.name).value for s in expression.free_symbols}
        try:
            checked(expression.xreplace(defaults))
        except NotExact as error:
            self._fail(keys, f"{_KIND[kind]} ({error} at the parameters' values)")
        return sp.expand_mul(expression)

    def _check_degrees(self, keys: Keys, value: object, kind: ParameterKind) -> None:
        """A pi among degrees is a slip: it would be 3.14 degrees."""
        texts = [part for part in _parts(value) if isinstance(part, str)]
        in_degrees = kind == "angle" and self.scale["angle"] != 1
        if in_degrees and any(re.search(r"\bpi\b", text) for text in texts):
            self._fail(keys, 'an angle in degrees, as units say, and pi belongs to units of "rad"')

    def _scales(self, expression: sp.Expr, kind: ParameterKind) -> bool:
        """Whether lengths enter a length at most linearly, and an angle by their ratios alone."""
        lengths = [s for s in expression.free_symbols if self.kinds[s.name] == "length"]
        if not lengths:
            return True
        point = {
            s: sp.Rational(7919 + 1009 * k, 10007)
            for k, s in enumerate(sorted(expression.free_symbols, key=str))
        }
        one, two, three = (
            expression.xreplace(
                {s: v * (t if s in lengths else 1) for s, v in point.items()}
            ).evalf()
            for t in (1, 2, 3)
        )
        change = two - one
        bend = three - 2 * two + one
        excess = bend if kind == "length" else change
        return bool(excess.is_finite and abs(excess) < sp.Float("1e-10"))

    def _literal(self, keys: Keys, default: int | None = None) -> sp.Expr:
        """A number without parameters, in the file's own units."""
        value = self._at(keys)
        if value is None and default is not None:
            return sp.Integer(default)
        try:
            return read(value)
        except NotExact as error:
            self._fail(keys, f"a number without parameters ({error})")

    def _name(self, keys: Keys, default: str | None = None) -> str:
        value = self._at(keys)
        if value is None and default is not None:
            return default
        if not isinstance(value, str) or not _is_name(value):
            self._fail(keys, f"a name: {NAMED}")
        return value

    def _string(self, keys: Keys, default: str) -> str:
        value = self._at(keys)
        if value is None:
            return default
        if not isinstance(value, str) or not value.isprintable():
            self._fail(keys, "one line of text")
        return value

    def _option(self, keys: Keys, options: Iterable[str], default: str) -> JointKind:
        value = self._at(keys)
        chosen = value if isinstance(value, str) else default if value is None else _shown(value)
        if isinstance(value, bool | list | dict) or chosen not in options:
            self._fail(keys, f"one of {_or(options)}{_hint(chosen, options)}")
        return chosen  # type: ignore[return-value]

    def _choice(self, keys: Keys, options: Mapping[str, sp.Expr], default: str) -> sp.Expr:
        return options[self._option(keys, options, default)]

    def _table(self, keys: Keys, default: dict[str, object] | None = None) -> dict[str, object]:
        value = self._at(keys)
        if value is None and default is not None:
            return default
        if not isinstance(value, dict):
            self._fail(keys, "a table")
        return value

    def _check_fields(self, keys: Keys, table: Mapping[str, object], known: Iterable[str]) -> None:
        for field in table:
            if field not in known:
                expected = f"one of the fields {_or(known)}{_hint(field, known)}"
                self._fail((*keys, field), expected, shown=field)

    def _at(self, keys: Keys) -> object:
        return _follow(self.table, keys)

    def _fail(self, keys: Keys, expected: str, shown: object = ...) -> NoReturn:
        value = self._at(keys) if shown is ... else shown
        if value is None and shown is ...:
            expected += "; it is missing"
        raise DescriptionError(
            self.file, self._line(keys), _dotted(keys), value, expected
        ) from None

    def _line(self, keys: Keys) -> int | None:
        """The line on which a value stands, or else the table that should hold it."""
        while keys and self._at(keys) is None:
            keys = keys[:-1]
        if not keys:
            return None
        return _first_line(self.text, lambda text: _follow(_table(text), keys) is not None)


def _table(text: str) -> dict[str, object]:
    return tomllib.loads(text, parse_float=Decimal)


def _first_line(text: str, holds: Callable[[str], bool]) -> int:
    """The first line at which the text up to there, its brackets closed, has a property.

    The parser keeps no positions, so beginnings of the text are parsed.
    """
    lines = text.split("\n")

    def reached(number: int) -> bool:
        try:
            return holds(_closed("\n".join(lines[:number])))
        except tomllib.TOMLDecodeError:
            return False

    return bisect.bisect_left(range(1, len(lines)), True, key=reached) + 1


def _closed(text: str) -> str:
    """The beginning of a file with the strings and brackets closed that it leaves open."""
    open_brackets: list[str] = []
    string = ""
    for match in _TOKEN.finditer(text):
        token = match.group()
        quotes = token[:3]
        if token in _BRACKETS:
            open_brackets.append(_BRACKETS[token])
        elif token in ("]", "}"):
            del open_brackets[-1:]
        elif quotes in ('"""', "'''") and not (len(token) > 5 and token.endswith(quotes)):  # noqa: PLR2004
            string = quotes
    return f"{text}\n{string}{''.join(reversed(open_brackets))}"


def _is_unreadable(text: str) -> bool:
    try:
        _table(text)
    except tomllib.TOMLDecodeError:
        raise
    except (ValueError, ArithmeticError, RecursionError):
        return True
    return False


def _follow(value: object, keys: Keys) -> object:
    for key in keys:
        if isinstance(value, Mapping):
            value = value.get(key)
        elif isinstance(value, list) and isinstance(key, int) and key < len(value):
            value = value[key]
        else:
            return None
    return value


def _dotted(keys: Keys) -> str:
    """``joints[2].alpha``, lists counted from 1 as a reader counts."""
    text = ""
    for key in keys:
        text += f"[{key + 1}]" if isinstance(key, int) else f".{key}" if text else key
    return text


def _listed(given: Mapping[str, sp.Expr | Vector]) -> tuple[tuple[str, sp.Expr], ...]:
    """The fields as scalars, vectors by component: what a printed table shows."""
    listed: list[tuple[str, sp.Expr]] = []
    for field, value in given.items():
        if isinstance(value, tuple):
            listed += [(f"{field}_{c}", v) for c, v in zip("xyz", value, strict=True)]
        else:
            listed.append((field, value))
    return tuple(listed)


def _is_name(text: str) -> bool:
    return bool(NAME.fullmatch(text)) and not keyword.iskeyword(text)


def _parts(value: object) -> list[object]:
    return list(value) if isinstance(value, list) else [value]


def _use(symbol: sp.Symbol, expression: sp.Expr, kind: ParameterKind) -> ParameterKind:
    """What a parameter must be, by its place in an expression of some kind."""
    if any(symbol in part.free_symbols for part in expression.atoms(sp.atan, sp.atan2)):
        return "length"
    if any(symbol in part.free_symbols for part in expression.atoms(sp.sin, sp.cos, sp.tan)):
        return "angle"
    return kind


def _kind_of_unit(unit: str) -> ParameterKind:
    return "length" if unit in LENGTHS else "angle" if unit in ANGLES else "ratio"


def _hint(word: str, known: Iterable[str]) -> str:
    close = difflib.get_close_matches(word, list(known), n=1)
    return f" (did you mean {close[0]!r}?)" if close else ""


def _or(words: Iterable[str]) -> str:
    return ", ".join(sorted(words) if isinstance(words, frozenset) else words)


def _shown(value: object) -> str:
    """A value as a reader of the file knows it."""
    try:
        text = repr(value) if isinstance(value, str | list | dict) else str(value)
    except ValueError:  # Python writes no integer of thousands of digits.
        return "a very large integer"
    if isinstance(value, bool):
        text = text.lower()
    return text if len(text) <= MOST_CHARACTERS_SHOWN else f"{text[: MOST_CHARACTERS_SHOWN - 3]}..."
