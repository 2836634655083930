"""Result files with all fields of a frozen dataclass in the .npz format.

Each array in the file has the name of its field. The entry "facts" contains all other values as
JSON text. The text also describes nested objects such as a grid.
"""

from __future__ import annotations

import csv
import json
import os
import zlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from lzma import LZMAError
from pathlib import Path
from tokenize import TokenError
from types import UnionType
from typing import (
    Any,
    ClassVar,
    Literal,
    Self,
    TypeVar,
    Union,
    get_args,
    get_origin,
    get_type_hints,
)
from zipfile import BadZipFile

import numpy as np
from numpy.lib.npyio import NpzFile

from chasles import InputValueError, Robot
from chasles.contract import as_path, open_input, output_file

T = TypeVar("T")
_AXES = "xyz"
Arrays = dict[str, np.ndarray[Any, Any]]
_DAMAGED = (
    *(BadZipFile, EOFError, LZMAError, MemoryError, OSError, RuntimeError),
    *(SyntaxError, TokenError, ValueError, zlib.error),
)
"""Errors of NumPy and zipfile for damaged files. RuntimeError: the archive is encrypted, or its
compression method is unknown. SyntaxError, TokenError: NumPy parses the header of an array as
Python."""


def ranges(extents: Any) -> str:
    """Return the text of extents (2, k) [m], such as "x -1 to 1, y 0 to 2 m"."""
    spans = zip(_AXES, np.asarray(extents).T, strict=False)
    return ", ".join(f"{axis} {low:.4g} to {high:.4g}" for axis, (low, high) in spans) + " m"


class StudyResult:
    """Base class of frozen dataclasses that can be saved to files and loaded from files.

    `_parts` lists the dataclasses and named tuples among the fields of a class.
    """

    _parts: ClassVar[tuple[type, ...]] = ()

    def to_npz(self, path: str | os.PathLike[str]) -> None:
        """Write all data to a compressed .npz file."""
        arrays: Arrays = {}
        facts = json.dumps(_packed(self, "", arrays))
        named: dict[str, Any] = {"facts": np.array(facts), **arrays}
        with output_file(path) as target, target.open("wb") as file:
            np.savez_compressed(file, **named)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a file. The suffix selects the format: .npz, or .csv for tables.

        Raises:
            InputValueError: The suffix is not supported.
        """
        writers: dict[str, Callable[[Path], None]] = {".npz": self.to_npz}
        if hasattr(self, "to_csv"):
            writers[".csv"] = self.to_csv
        by_suffix(path, writers)(Path(path))

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Self:
        """Return the result that `to_npz` wrote.

        Raises:
            InputValueError: The suffix is not .npz, or the file contains a different kind of
                result.
        """
        by_suffix(path, {".npz": cls})
        arrays = read_npz(path)
        types = {own.__name__: own for own in (cls, *cls._parts)}
        wrong = f"{os.fspath(path)}: expected a {cls.__name__} written by to_npz"
        try:
            made = _unpacked(json.loads(str(arrays["facts"])), types, arrays)
        except (KeyError, RecursionError, SystemError, TypeError, ValueError) as error:
            # A damaged string array can contain numbers that are not character codes. Its
            # conversion to str then raises SystemError.
            raise InputValueError(wrong) from error
        if not isinstance(made, cls) or not _fits(made, cls):
            raise InputValueError(wrong)
        return made


def by_suffix(path: str | os.PathLike[str], formats: Mapping[str, T]) -> T:
    """Return the dictionary entry for the suffix of a path.

    Raises:
        InputValueError: The suffix is not supported.
    """
    suffix = as_path("path", path).suffix.lower()
    if suffix not in formats:
        raise InputValueError(
            f"{os.fspath(path)}: expected a file {' or '.join(formats)}, got "
            f"{suffix or 'no suffix'}"
        )
    return formats[suffix]


def read_npz(path: str | os.PathLike[str]) -> Arrays:
    """Return all arrays of a file.

    Raises:
        InputValueError: The file cannot be read.
    """
    try:
        with open_input(path) as file, NpzFile(file) as arrays:
            return {name: _array(name, arrays[name]) for name in arrays.files}
    except _DAMAGED as error:
        reason = str(error) or type(error).__name__
        raise InputValueError(f"{os.fspath(path)}: expected NumPy arrays ({reason})") from error


def _array(name: str, found: np.ndarray[Any, Any] | bytes) -> np.ndarray[Any, Any]:
    """Return the array of an archive member.

    NumPy returns bytes for a member that is not an array.
    """
    if isinstance(found, bytes):
        raise ValueError(f"expected an array as entry {name}")
    return found


def write_table(
    path: str | os.PathLike[str], head: Sequence[str], rows: Iterable[Iterable[float]]
) -> None:
    """Write numbers with full precision to a .csv file."""
    with output_file(path) as target, target.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(head)
        writer.writerows([repr(value) for value in row] for row in rows)


def _packed(value: Any, name: str, arrays: Arrays) -> Any:
    """Return a value as JSON data, and store the arrays of the value in `arrays`."""
    if isinstance(value, np.ndarray):
        arrays[name] = value
        return {"array": name}
    if names := _field_names(value):
        prefix = f"{name}." if name else ""
        packed = {own: _packed(getattr(value, own), prefix + own, arrays) for own in names}
        return {"type": type(value).__name__, "fields": packed}
    if isinstance(value, tuple):
        return [_packed(item, f"{name}.{k}", arrays) for k, item in enumerate(value)]
    return value.item() if isinstance(value, np.generic) else value


def _unpacked(packed: Any, types: Mapping[str, type], arrays: Arrays) -> Any:
    if isinstance(packed, list):
        return tuple(_unpacked(item, types, arrays) for item in packed)
    if not isinstance(packed, dict):
        return packed
    match packed:
        case {"array": str(name)}:
            return arrays[name]
        case {"type": str(name), "fields": dict(own)}:
            return types[name](**{key: _unpacked(own[key], types, arrays) for key in own})
    raise ValueError("an object without type and fields")


def _fits(value: Any, hint: Any) -> bool:
    """Whether a value from a file has the declared type. Array elements are not checked."""
    origin, words = get_origin(hint), get_args(hint)
    if origin in (Union, UnionType):
        return any(_fits(value, word) for word in words)
    if origin is Literal:
        return isinstance(value, str | int) and value in words
    if origin is tuple and words[-1] is Ellipsis:
        return isinstance(value, tuple) and all(_fits(item, words[0]) for item in value)
    if origin is tuple:
        return (
            isinstance(value, tuple) and len(value) == len(words) and all(map(_fits, value, words))
        )
    if hint is Robot:
        return isinstance(value, str)
    if hint is float:
        return isinstance(value, int | float) and not isinstance(value, bool)
    kind = object if hint is Any else origin or hint
    if not isinstance(kind, type):
        return True
    if not isinstance(value, kind):
        return False
    own = get_type_hints(kind) if _field_names(value) else {}
    return all(_fits(getattr(value, name), own.get(name, object)) for name in _field_names(value))


def _field_names(value: Any) -> tuple[str, ...]:
    if is_dataclass(value):
        return tuple(item.name for item in fields(value))
    return getattr(value, "_fields", ())
