"""Records: frozen dataclasses that can be converted from and to JSON objects.

The annotations of a dataclass are its schema: An annotation is `str`, `bool`, `float`, `int` (0 or
greater), a tuple, a mapping, a record or a union with None. `Annotated[kind, Check(...)]` adds a
condition that the value must satisfy. A field with a default is optional. The field is written only
if its value differs from the default.
"""

from __future__ import annotations

import functools
import math
import re
import sys
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import MISSING, Field, dataclass, fields, is_dataclass, replace
from keyword import iskeyword
from pathlib import Path
from types import MappingProxyType, NoneType, UnionType
from typing import (
    Annotated,
    Any,
    NoReturn,
    TypeVar,
    Union,
    get_args,
    get_origin,
    get_type_hints,
)

from .errors import ManifestError

Record = TypeVar("Record")
_SPACE = 3
INLINE = MappingProxyType({"inline": True})
"""Metadata of a record whose fields are stored in the enclosing JSON object."""
NOT_STORED = MappingProxyType({"stored": False})
"""Metadata of a field that is not stored in JSON."""


@dataclass(frozen=True)
class Check:
    """A condition on a value, with a description and a test."""

    expected: str
    passes: Callable[[Any], bool]


def one_of(choices: Collection[str]) -> Check:
    """Return a check that passes if a text is one of the allowed choices."""
    return Check(" or ".join(f'"{choice}"' for choice in choices), lambda text: text in choices)


@dataclass(frozen=True)
class Place:
    """The location of a value in a file."""

    file: Path
    field: str = ""

    def __getitem__(self, key: str | int) -> Place:
        """Return the location of an entry of an object or list."""
        if isinstance(key, int):
            return Place(self.file, f"{self.field}[{key}]")
        return Place(self.file, f"{self.field}.{key}" if self.field else key)

    def fail(self, value: object, expected: str) -> NoReturn:
        """Raise a ManifestError with file, field, value and expected form."""
        field = f"{self.field}: " if self.field else ""
        raise ManifestError(f"{self.file}: {field}got {value!r}, expected {expected}")


def _is_name(text: str) -> bool:
    # Names of robots and functions are identifiers in generated C and in Python.
    return bool(re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", text)) and not iskeyword(text)


Name = Annotated[str, Check("a name of ASCII letters, digits and underscores", _is_name)]
_is_digest = re.compile(r"[0-9a-f]{64}").fullmatch
Digest = Annotated[str, Check("a SHA-256 in lower-case hexadecimal", _is_digest)]
Sizes = Annotated[tuple[int, ...], Check("sizes of at least 1", lambda sizes: 0 not in sizes)]
Vector = Annotated[
    tuple[float, ...], Check("three numbers", lambda entries: len(entries) == _SPACE)
]
PoseRows = Annotated[
    tuple[tuple[float, ...], ...],
    Check("three rows of four numbers", lambda rows: [len(row) for row in rows] == [4, 4, 4]),
]


@dataclass(frozen=True)
class _Item:
    """A field of a record, with its JSON key."""

    name: str
    key: str
    kind: Any
    default: Any
    inline: bool


@functools.cache
def _items(record: Any) -> tuple[_Item, ...]:
    hints = get_type_hints(record, include_extras=True)
    found = [item for item in fields(record) if item.metadata.get("stored", True)]
    return tuple(
        _Item(
            item.name,
            item.metadata.get("key", item.name),
            hints[item.name],
            _default(item),
            item.metadata.get("inline", False),
        )
        for item in found
    )


def _default(item: Field[Any]) -> Any:
    return item.default if item.default_factory is MISSING else item.default_factory()


def read(record: type[Record], value: object, place: Place, **not_stored: Any) -> Record:
    """Read a record from plain JSON data.

    Args:
        record: The dataclass.
        value: A JSON object as a dictionary.
        place: The location of the value, for error messages.
        not_stored: Values of the fields that the JSON object does not contain, keyed by field name.

    Raises:
        ManifestError: A key is unknown or missing, or a value does not match its annotation. The
            message names file, field, value and expected form.
    """
    kind: Any = record
    try:
        found = _reader(kind)(value)
    except _AbsentError as error:
        field = ": ".join(filter(None, [str(place.file), _at(place, error).field]))
        raise ManifestError(f"{field}: has no {error.value!r}") from None
    except _MismatchError as error:
        _at(place, error).fail(error.value, error.expected)
    read_record: Record = replace(found, **not_stored) if not_stored else found
    return read_record


def _at(place: Place, error: _MismatchError) -> Place:
    for key in error.keys:
        place = place[key]
    return place


def _keys(record: Any) -> set[str]:
    found: set[str] = set()
    for item in _items(record):
        found |= _keys(item.kind) if item.inline else {item.key}
    return found


class _MismatchError(Exception):
    """Error for a JSON value of the wrong form.

    `keys` is the path to the value. Each enclosing JSON object or list adds its key to the path.
    """

    def __init__(self, value: object, expected: str) -> None:
        self.value, self.expected = value, expected
        self.keys: list[str | int] = []

    def within(self, key: str | int) -> _MismatchError:
        self.keys.insert(0, key)
        return self


class _AbsentError(_MismatchError):
    """Error for a missing required key."""

    def __init__(self, key: str) -> None:
        super().__init__(key, "a value")


Reader = Callable[[Any], Any]


@functools.cache
def _reader(kind: Any) -> Reader:
    """Return the cached reader of a type."""
    origin, parts = get_origin(kind), get_args(kind)
    if is_dataclass(kind):
        assert isinstance(kind, type)
        return _record_reader(kind)
    if origin is Annotated:
        return _checked_reader(_reader(parts[0]), parts[1:], is_name=kind == Name)
    if origin in (Union, UnionType):
        inner = _reader(next(part for part in parts if part is not NoneType))
        return lambda value: None if value is None else inner(value)
    if origin is tuple:
        return _list_reader(parts)
    if origin is Mapping:
        return _mapping_reader(_reader(parts[1]))
    return _plain_reader(kind)


def _record_reader(record: Any) -> Reader:
    known = frozenset(_keys(record))
    read_fields = _fields_reader(record)

    def read_record(value: Any) -> Any:
        if not isinstance(value, dict):
            raise _MismatchError(value, "an object")
        if not known.issuperset(value):
            unknown = sorted(set(value) - known)
            raise _MismatchError(unknown, f"keys among {', '.join(sorted(known))}")
        return read_fields(value)

    return read_record


def _fields_reader(record: Any) -> Reader:
    """Return the function that reads all fields of a record from an object.

    The object may have further keys.
    """
    items = [
        (item, _fields_reader(item.kind) if item.inline else _reader(item.kind))
        for item in _items(record)
    ]

    def read_fields(values: dict[str, Any]) -> Any:
        found = {}
        for item, reader in items:
            if item.inline:
                found[item.name] = reader(values)
            elif item.key in values:
                try:
                    found[item.name] = reader(values[item.key])
                except _MismatchError as error:
                    raise error.within(item.key)  # noqa: B904 - raises `error` again
            elif item.default is MISSING:
                raise _AbsentError(item.key)
        return record(**found)

    return read_fields


def _checked_reader(inner: Reader, checks: Sequence[Check], is_name: bool) -> Reader:
    def read_checked(value: Any) -> Any:
        found = inner(value)
        for check in checks:
            if not check.passes(found):
                raise _MismatchError(value, check.expected)
        # Interned strings make attribute lookup fastest.
        return sys.intern(found) if is_name else found

    return read_checked


def _list_reader(kinds: tuple[Any, ...]) -> Reader:
    readers = [_reader(kind) for kind in kinds if kind is not Ellipsis]

    def read_list(value: Any) -> tuple[Any, ...]:
        if not isinstance(value, list):
            raise _MismatchError(value, "a list")
        each = readers * len(value) if kinds[-1] is Ellipsis else readers
        if len(value) != len(each):
            raise _MismatchError(value, f"{len(each)} entries")
        found = []
        for k, (reader, item) in enumerate(zip(each, value, strict=True)):
            try:
                found.append(reader(item))
            except _MismatchError as error:
                raise error.within(k)  # noqa: B904 - raises `error` again
        return tuple(found)

    return read_list


def _mapping_reader(inner: Reader) -> Reader:
    def read_mapping(value: Any) -> Mapping[str, Any]:
        if not isinstance(value, dict):
            raise _MismatchError(value, "an object")
        found = {}
        for key, item in value.items():
            try:
                found[key] = inner(item)
            except _MismatchError as error:
                raise error.within(key)  # noqa: B904 - raises `error` again
        return MappingProxyType(found)

    return read_mapping


def _is_number(value: Any) -> bool:
    if isinstance(value, float):
        return not math.isnan(value)
    # Python reads integers beyond the range of a double without an error.
    return isinstance(value, int) and not isinstance(value, bool) and abs(value) < _MAX_INTEGER


def _is_count(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value <= _MAX_COUNT


_MAX_INTEGER = 2**1023
_MAX_COUNT = 2**31 - 1
"""Largest integer in a manifest. The C code uses int."""
_PLAIN: Mapping[type[Any], Check] = {
    str: Check("a string", lambda value: isinstance(value, str)),
    bool: Check("true or false", lambda value: isinstance(value, bool)),
    float: Check("a number", _is_number),
    int: Check("a count", _is_count),
}


def _plain_reader(kind: type[Any]) -> Reader:
    check = _PLAIN[kind]

    def read_plain(value: Any) -> Any:
        if not check.passes(value):
            raise _MismatchError(value, check.expected)
        return kind(value)

    return read_plain


def write(record: Any, value: Any) -> dict[str, Any]:
    """Write a record as plain JSON data.

    Args:
        record: The dataclass whose fields are written. If ``value`` is an instance of a subclass,
            the additional fields of the subclass are not written.
        value: An instance of the dataclass.
    """
    found: dict[str, Any] = {}
    for item in _items(record):
        content = getattr(value, item.name)
        if item.inline:
            found |= write(item.kind, content)
        elif item.default is MISSING or content != item.default:
            found[item.key] = _write(item.kind, content)
    return found


def _write(kind: Any, value: Any) -> Any:
    origin = get_origin(kind)
    if value is None:
        return None
    if is_dataclass(kind):
        assert isinstance(kind, type)
        return write(kind, value)
    if origin is Annotated:
        return _write(get_args(kind)[0], value)
    if origin in (Union, UnionType):
        return _write(next(k for k in get_args(kind) if k is not NoneType), value)
    if origin is tuple:
        kinds = get_args(kind)
        kinds = kinds[:1] * len(value) if kinds[-1] is Ellipsis else kinds
        return [_write(k, item) for k, item in zip(kinds, value, strict=True)]
    if origin is Mapping:
        return {key: _write(get_args(kind)[1], item) for key, item in value.items()}
    # Adding 0.0 replaces -0.0 by 0.0, because the sign of a zero depends on the order of additions
    # in the derivation.
    return float(value) + 0.0 if kind is float else value
