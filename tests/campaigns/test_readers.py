"""Mutated files of every kind are read, or refused with an error that states the file."""

import random
from collections import Counter

import pytest

from tests.campaigns.readers import attempt, mutant, readers

FILES = 12


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
