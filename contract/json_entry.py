"""A JSON value with its place in the file, so that an error names file and field."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator, Sequence
from keyword import iskeyword
from pathlib import Path
from typing import Any, NoReturn

from .errors import ManifestError


class Entry:
    """A JSON value with its file and field."""

    def __init__(self, file: Path, field: str, value: object) -> None:
        self.file, self.field, self.value = file, field, value

    def fail(self, expected: str) -> NoReturn:
        """Raises a ManifestError that names file, field, value and the expected form."""
        raise ManifestError(f"{self.file}: {self.field}: got {self.value!r}, expected {expected}")

    def __getitem__(self, key: str) -> Entry:
        fields = self.fields()
        if key not in fields:
            raise ManifestError(f"{self.file}: {self.field}: has no {key!r}")
        return self._inner(key, fields[key])

    def get(self, key: str, default: object) -> Entry:
        """The entry of a key, with a default where it is absent."""
        return self._inner(key, self.fields().get(key, default))

    def mapping(self) -> dict[str, Entry]:
        """The entries of an object by key."""
        return {key: self._inner(key, value) for key, value in self.fields().items()}

    def fields(self) -> dict[str, Any]:
        """The value as an object."""
        if not isinstance(self.value, dict):
            self.fail("an object")
        return self.value

    def _inner(self, key: str, value: object) -> Entry:
        # The manifest itself has no name in the fields of its entries.
        field = key if self.field == "manifest" else f"{self.field}.{key}"
        return Entry(self.file, field, value)

    def __iter__(self) -> Iterator[Entry]:
        if not isinstance(self.value, list):
            self.fail("a list")
        for index, value in enumerate(self.value):
            yield Entry(self.file, f"{self.field}[{index}]", value)

    def text(self) -> str:
        """The value as a string."""
        if not isinstance(self.value, str):
            self.fail("a string")
        return self.value

    def one_of(self, choices: Sequence[str]) -> str:
        """The value, one of some strings."""
        if self.value not in choices:
            self.fail(" or ".join(f'"{choice}"' for choice in choices))
        return self.text()

    def texts(self) -> tuple[str, ...]:
        """The value as strings."""
        return tuple(item.text() for item in self)

    def identifier(self) -> str:
        """The value as a name that C and Python accept."""
        # Goes into generated C as it stands, so nothing but a plain name may pass.
        text = self.text()
        if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", text) or iskeyword(text):
            self.fail("a name of ASCII letters, digits and underscores")
        # Attributes are found fastest by the very strings that the interpreter has for them.
        return sys.intern(text)

    def number(self) -> float:
        """The value as a float."""
        if isinstance(self.value, bool) or not isinstance(self.value, int | float):
            self.fail("a number")
        return float(self.value)

    def numbers(self) -> tuple[float, ...]:
        """The value as floats."""
        return tuple(item.number() for item in self)

    def limit(self) -> float | None:
        """The value as a float, None where there is no limit."""
        return None if self.value is None else self.number()

    def count(self) -> int:
        """The value as an integer of at least 0."""
        if isinstance(self.value, bool) or not isinstance(self.value, int) or self.value < 0:
            self.fail("a count")
        return self.value

    def flag(self) -> bool:
        """True or false."""
        if not isinstance(self.value, bool):
            self.fail("true or false")
        return self.value

    def shape(self) -> tuple[int, ...]:
        """The value as the shape of an array."""
        shape = tuple(size.count() for size in self)
        if 0 in shape:
            self.fail("sizes of at least 1")
        return shape

    def sha256(self) -> str:
        """The value as a digest in hexadecimal."""
        text = self.text()
        if not re.fullmatch(r"[0-9a-f]{64}", text):
            self.fail("a SHA-256 in lower-case hexadecimal")
        return text

    def unique(self, names: list[str]) -> None:
        """Checks that no name occurs twice."""
        for name in names:
            if names.count(name) > 1:
                raise ManifestError(f"{self.file}: {self.field}: {name!r} occurs twice")
