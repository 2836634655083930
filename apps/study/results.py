"""Saves all fields of a frozen dataclass to a file in the .npz format, and loads them.

Each array in an .npz file has the name of its dataclass field. The entry "facts" of the file
contains all other values as JSON text. The JSON text also describes nested objects such as a grid.
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
"""Errors that NumPy and zipfile raise for damaged files. RuntimeError occurs if an archive is
encrypted or its compression method is unknown. SyntaxError and TokenError occur because NumPy
parses the header of an array as Python code."""


def ranges(extents: Any) -> str:
    """Return coordinate ranges (2, k) [m] as text, such as "x -1 to 1, y 0 to 2 m"."""
    spans = zip(_AXES, np.asarray(extents).T, strict=False)
    return ", ".join(f"{axis} {low:.4g} to {high:.4g}" for axis, (low, high) in spans) + " m"


class StudyResult:
    """Base class of frozen dataclasses that can be saved to files and loaded from files.

    The class attribute `_parts` lists the dataclasses and named tuples that the fields contain.
    """

    _parts: ClassVar[tuple[type, ...]] = ()

    def to_npz(self, path: str | os.PathLike[str]) -> None:
        """Write all fields of the result to a compressed .npz file."""
        arrays: Arrays = {}
        facts = json.dumps(_packed(self, "", arrays))
        named: dict[str, Any] = {"facts": np.array(facts), **arrays}
        with output_file(path) as target, target.open("wb") as file:
            np.savez_compressed(file, **named)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the result to a file.

        The suffix of the path selects the format: .npz, or .csv for results with a method `to_csv`.

        Raises:
            InputValueError: The suffix is not supported.
        """
        writers: dict[str, Callable[[Path], None]] = {".npz": self.to_npz}
        if hasattr(self, "to_csv"):
            writers[".csv"] = self.to_csv
        by_suffix(path, writers)(Path(path))

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Self:
        """Return a result from a file that `to_npz` wrote.

        Raises:
            InputValueError: The suffix of `path` is not .npz, or the file does not contain a result
                of this class.
        """
        by_suffix(path, {".npz": cls})
        arrays = read_npz(path)
        types = {own.__name__: own for own in (cls, *cls._parts)}
        wrong = f"{os.fspath(path)}: expected a {cls.__name__} written by to_npz"
        try:
            made = _unpacked(json.loads(str(arrays["facts"])), types, arrays)
        except (KeyError, RecursionError, SystemError, TypeError, ValueError) as error:
            # A damaged string array can contain numbers that are not character codes. The
            # conversion of an array with invalid character codes to str raises SystemError.
            raise InputValueError(wrong) from error
        if not isinstance(made, cls) or not _fits(made, cls):
            raise InputValueError(wrong)
        return made


def by_suffix(path: str | os.PathLike[str], formats: Mapping[str, T]) -> T:
    """Return the entry of `formats` for the suffix of a path.

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
    """Return all arrays of an .npz file.

    Raises:
        InputValueError: The .npz file cannot be read.
    """
    try:
        with open_input(path) as file, NpzFile(file) as arrays:
            return {name: _array(name, arrays[name]) for name in arrays.files}
    except _DAMAGED as error:
        reason = str(error) or type(error).__name__
        raise InputValueError(f"{os.fspath(path)}: expected NumPy arrays ({reason})") from error


def _array(name: str, found: np.ndarray[Any, Any] | bytes) -> np.ndarray[Any, Any]:
    """Return the array of a member of an .npz archive.

    NumPy returns bytes for an archive member that is not an array.
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
    """Return whether a value from a file has the declared type.

    The types of array elements are not checked.
    """
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
