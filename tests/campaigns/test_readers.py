"""A reader accepts a randomly changed file, or raises an error that names the file."""

import random
import re
from collections import Counter

import pytest

from tests.campaigns.readers import attempt, mutant, readers

FILES = 3
"""Number of mutated files for each reader."""
ROUNDS = 2
"""Number of test files for each pair of reader and command."""
COMMANDS = (
    "$(touch mark)",
    "`touch mark`",
    "; touch mark ;",
    "| touch mark",
    "=cmd|'/C touch mark'!A0",
    "!!python/object/apply:os.system ['touch mark']",
    "!!python/object/new:subprocess.Popen [['touch', 'mark']]",
    "__import__('os').system('touch mark')",
    "${__import__('os').system('touch mark')}",
    "$(eval __import__('os').system('touch mark'))",
    "${xacro.load_yaml.__globals__['os'].system('touch mark')}",
    "$(find ;touch mark)",
    "{{ cycler.__init__.__globals__.os.system('touch mark') }}",
    "\\immediate\\write18{touch mark}",
)
"""Texts that create a file if a shell, spreadsheet, YAML reader, Python, xacro, template engine or
LaTeX runs them as commands."""
PLACES = re.compile(
    r"(?<=\")[^\"\n]+(?=\")|(?<=[=,:] )[^\s,]+|(?<=,)[^\s,]+|^[^\s,<>]+", re.MULTILINE
)
"""Pattern of the values in a file: text between quotes, after an equal sign, colon or comma, or at
the start of a line."""


@pytest.fixture(scope="module")
def every_reader():
    return readers()


def test_every_file_of_the_corpus_is_read(every_reader, tmp_path):
    for reader in every_reader:
        for content in reader.corpus:
            (tmp_path / reader.file).write_bytes(content)
            assert attempt(reader, tmp_path / reader.file) == "read", reader.name


def test_mutated_files_are_read_or_refused(every_reader, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    dice = random.Random(3)
    ends = Counter()
    for reader in every_reader:
        for _ in range(FILES):
            (tmp_path / reader.file).write_bytes(mutant(reader, dice))
            ends[attempt(reader, tmp_path / reader.file)] += 1
    assert ends.keys() == {"read", "refused"}


def test_commands_in_files_are_not_executed(every_reader, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    dice, count = random.Random(5), 0
    for reader in every_reader:
        texts = [content.decode() for content in reader.corpus if content.isascii()]
        for command in COMMANDS * ROUNDS if texts and reader.files > len(COMMANDS) else ():
            text = dice.choice(texts)
            place = dice.choice(list(PLACES.finditer(text)))
            file = tmp_path / reader.file
            file.write_text(text[: place.start()] + command + text[place.end() :])
            assert attempt(reader, file) in ("read", "refused"), command
            assert not (tmp_path / "mark").exists(), (reader.name, command)
            count += 1
    assert count >= 200
