"""Either all files of a group are written completely, or no file changes."""

import os

import pytest

from chasles import InputValueError
from chasles.contract import output_file, write_files
from tests.support.faults import check_writes, steps_of


def test_write_that_fails_leaves_all_former_files(tmp_path):
    for name in "ab":
        (tmp_path / name).write_text("former")
    new = {tmp_path / name: name.encode() * 100_000 for name in "abc"}
    check_writes(lambda: write_files(new), tmp_path, "cannot be written")


def test_last_file_moves_last(tmp_path):
    new = {tmp_path / name: name.encode() for name in "abc"}
    moves = [step for step in steps_of(lambda: write_files(new), tmp_path) if "rename" in step]
    assert [move[-1] for move in moves] == ["a", "b", "c"]


def test_new_file_replaces_no_file_that_appears_meanwhile(tmp_path):
    file = tmp_path / "arm.toml"

    def write():
        with output_file(file, is_new=True) as temporary:
            temporary.write_text("new")
            file.write_text("of another process")

    with pytest.raises(InputValueError, match="cannot be written"):
        write()
    assert file.read_text() == "of another process"
    assert list(tmp_path.iterdir()) == [file]


@pytest.mark.skipif(os.name == "nt", reason="Windows has no modes")
def test_written_file_keeps_its_mode(tmp_path):
    file = tmp_path / "secret"
    file.touch(0o600)
    file.chmod(0o640)
    write_files({file: b"new"})
    assert file.stat().st_mode & 0o777 == 0o640
