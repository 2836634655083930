"""Result files: all fields of a frozen dataclass in one .npz file, without loss.

Arrays have the names of their fields. All other values, and the structure of nested objects such
as a grid, are JSON text with the name "facts".
"""

from __future__ import annotations

import csv
import json
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, ClassVar, Self, TypeVar
from zipfile import BadZipFile

import numpy as np

from chasles import InputValueError

T = TypeVar("T")
Arrays = dict[str, np.ndarray[Any, Any]]


class StudyResult:
    """Base class of frozen dataclasses that are saved to files and loaded from files.

    `_parts` lists the dataclasses and named tuples of its fields.
    """

    _parts: ClassVar[tuple[type, ...]] = ()

    def to_npz(self, path: str | os.PathLike[str]) -> None:
        """Write all data to a compressed .npz file."""
        arrays: Arrays = {}
        facts = json.dumps(_packed(self, "", arrays))
        named: dict[str, Any] = {"facts": np.array(facts), **arrays}
        np.savez_compressed(Path(path), **named)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a file; its suffix selects the format: .npz, or for tables also .csv.

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
        facts = json.loads(str(arrays["facts"])) if "facts" in arrays else {}
        if facts.get("type") != cls.__name__:
            raise InputValueError(f"{path}: expected a {cls.__name__} written by to_npz")
        types = {own.__name__: own for own in (cls, *cls._parts)}
        made: Self = _unpacked(facts, types, arrays)
        return made


def by_suffix(path: str | os.PathLike[str], formats: Mapping[str, T]) -> T:
    """Return the entry for the suffix of a path.

    Raises:
        InputValueError: The suffix is not supported.
    """
    suffix = Path(path).suffix.lower()
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
        with np.load(Path(path)) as file:
            return {name: file[name] for name in file.files}
    except (OSError, ValueError, BadZipFile) as error:
        raise InputValueError(f"{os.fspath(path)}: expected NumPy arrays ({error})") from error


def write_table(
    path: str | os.PathLike[str], head: Sequence[str], rows: Iterable[Iterable[float]]
) -> None:
    """Write numbers with full precision to a .csv file."""
    with Path(path).open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(head)
        writer.writerows([repr(value) for value in row] for row in rows)


def _packed(value: Any, name: str, arrays: Arrays) -> Any:
    """Return a value as JSON, and add its arrays to `arrays`, keyed by the name of the value."""
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
    if "array" in packed:
        return arrays[packed["array"]]
    values = {name: _unpacked(own, types, arrays) for name, own in packed["fields"].items()}
    return types[packed["type"]](**values)


def _field_names(value: Any) -> tuple[str, ...]:
    if is_dataclass(value):
        return tuple(item.name for item in fields(value))
    return getattr(value, "_fields", ())
