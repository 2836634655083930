"""Reports all errors of a robot description, not only the first.

The reader stops at the first error. The check then replaces the wrong value in memory, and reads
the description again. Only the reader decides whether a description is valid.
"""

import re
import tomllib
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from ..model.errors import DescriptionError
from ..model.mechanism import Described
from .conventions import CONVENTIONS
from .file_text import text_of
from .robot_files import read, reader_of
from .serial_file import RobotFile
from .shipped_files import located
from .suggestions import suggestion
from .toml_file import Keys, is_missing, keys_of
from .toml_lines import table_of

MAX_ERRORS = 100
"""Maximum number of errors that are reported per file."""
_UNITS = {"length": "mm", "angle": "rad"}
"""An unknown length unit is replaced by mm, and an unknown angle unit by rad."""
_MISSING = {"axis": [0, 0, 1], "length": 1, "mass": 1, "pitch": 1, "retracted": 1, "value": 1}
"""Values for missing required fields."""

Severity = Literal["error", "warning", "note"]


@dataclass(frozen=True)
class Finding:
    """An error, a warning or a note about a robot description.

    Attributes:
        severity: "error" if the robot cannot be derived, "warning" for numbers that are probably
            wrong, "note" for other remarks, such as assumed or rounded values.
        where: The file, followed by line and field if they are known.
        message: The text. The text of an error states the found and the expected value.
    """

    severity: Severity
    where: str
    message: str

    def __str__(self) -> str:
        """Return the finding as one line of text."""
        kind = "" if self.severity == "error" else f"{self.severity}: "
        return f"{self.where}: {kind}{self.message}"


def checked(
    source: str | Path,
    base: str | None,
    tip: str | None,
    group: str | None,
    arguments: Sequence[str],
) -> tuple[tuple[Finding, ...], Described | None]:
    """Return the findings for a description, and the robot. See ``check``.

    The robot is None if the description has errors.
    """
    file, _ = located(source)
    try:
        if file.suffix.lower() == ".toml":
            errors = tuple(_errors(text_of(file), str(file)))
            if errors:
                return errors, None
        with warnings.catch_warnings():
            # The notes of the robot already list all numbers that `read` changed.
            warnings.simplefilter("ignore")
            robot = read(source, base=base, tip=tip, group=group, arguments=arguments)
    except DescriptionError as error:
        return (finding_of(error, str(file)),), None
    warning = robot.cleaning.warning
    notes = tuple(Finding("note", str(file), note) for note in robot.notes)
    return ((Finding("warning", str(file), warning),) if warning else ()) + notes, robot


def finding_of(error: DescriptionError, file: str = "") -> Finding:
    """Convert an error to a finding.

    If the error names no file, ``file`` is used.
    """
    line = "" if error.line is None else f":{error.line}"
    where = f"{error.file or file}{line}" + (f": {error.field}" if error.field else "")
    return Finding("error", where, str(error).removeprefix(f"{where}: "))


def _errors(text: str, file: str) -> Iterator[Finding]:
    """Yield the errors of a robot file in the order of its lines."""
    repairs = _Repairs(file, text)
    errors: list[DescriptionError] = []
    is_complete = False
    for _ in range(MAX_ERRORS):
        reader = None
        try:
            reader = reader_of(repairs.text, file, CONVENTIONS)
            repairs.apply(reader)
            reader.described()
        except DescriptionError as error:
            if not repairs.caused(error):
                errors.append(error)
            if reader is None or not repairs.repair(reader, error):
                break
        else:
            is_complete = True
            break
    yield from map(finding_of, sorted(errors, key=lambda error: (error.file, error.line or 0)))
    if not is_complete:
        yield Finding("note", file, "the check ended early; correct these errors and check again")


@dataclass
class _Repairs:
    """Corrections of wrong values. The file itself does not change.

    Attributes:
        file: Name of the file.
        text: The text of the file, with misspelt words corrected.
        values: New values for entries of the file. If a new value is None, the entry is removed.
        removed: Names of the removed parameters.
        respelled: Fields of the file in which a misspelt word was corrected.
    """

    file: str
    text: str
    values: dict[Keys, object] = field(default_factory=dict)
    removed: set[str] = field(default_factory=set)
    respelled: set[Keys] = field(default_factory=set)

    def apply(self, reader: RobotFile) -> None:
        for keys, value in self.values.items():
            place = reader.at(keys[:-1])
            if isinstance(place, dict) and value is None:
                place.pop(keys[-1], None)
            elif isinstance(place, dict):
                place[keys[-1]] = value

    def caused(self, error: DescriptionError) -> bool:
        """Whether an earlier correction of the file caused an error."""
        names = set(re.findall(r"\w+", str(error.value)))
        is_repaired = keys_of(error.field) in (self.values.keys() | self.respelled)
        return is_repaired or bool(names & self.removed)

    def repair(self, reader: RobotFile, error: DescriptionError) -> bool:
        """Correct the value that caused an error.

        Returns False if the value cannot be corrected.
        """
        keys = keys_of(error.field)
        if not keys or error.file != self.file:
            return False
        word = suggestion(error.expected)
        if word and keys not in self.respelled and self._has_respelled(error, word):
            self.respelled.add(keys)
            return True
        if isinstance(keys[-1], int) and not isinstance(reader.at(keys), dict):
            keys = keys[:-1]
        value = self._value(keys, error)
        if keys in self.values and value in (None, self.values[keys]):
            # If no replacement value avoids the error, the table that contains the field is
            # removed.
            keys, value = keys[:-1], None
            if keys in self.values:
                return False
        if not keys or isinstance(keys[-1], int) or keys[-1] == "convention":
            return False
        self.values[keys] = value
        return True

    def _value(self, keys: Keys, error: DescriptionError) -> object:
        """Return a placeholder value for a field, or None if the field must be removed."""
        last = keys[-1]
        if is_missing(error.expected) or keys in self.values:
            return f"unnamed{len(self.values)}" if last == "name" else _MISSING.get(str(last))
        if keys[0] == "units":
            return _UNITS.get(str(last))
        if keys[0] == "parameters" and error.value == last:
            self.removed.add(str(last))
            return None
        return 1 if keys[0] == "parameters" and last != "unit" else None

    def _has_respelled(self, error: DescriptionError, word: str) -> bool:
        """Correct a misspelt word in its line. The result is False if the text stays the same."""
        lines = self.text.split("\n")
        if error.line is None or not isinstance(error.value, str):
            return False
        line = lines[error.line - 1]
        lines[error.line - 1] = re.sub(rf"\b{re.escape(error.value)}\b", word, line, count=1)
        text = "\n".join(lines)
        try:
            table_of(text)
        except tomllib.TOMLDecodeError:
            # The text is invalid TOML if the table already has a field with the suggested name.
            return False
        changed, self.text = text != self.text, text
        return changed
