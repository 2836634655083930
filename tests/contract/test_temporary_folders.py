"""Temporary folders of killed processes are removed, and folders in use are kept."""

import os
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

from chasles.contract import output_file, temporary_folder

HOLD = """
import sys, time
from pathlib import Path
from chasles.contract import temporary_folder
with temporary_folder(Path(sys.argv[1]), "arm") as folder:
    (folder / "half").write_text("half")
    print(folder, flush=True)
    time.sleep(600)
"""


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def lowest_free_descriptor():
    opened = os.open(os.devnull, os.O_RDONLY)
    os.close(opened)
    return opened


def test_folder_of_a_killed_process_is_removed_at_the_next_write(tmp_path):
    command = [sys.executable, "-c", HOLD, str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        locked = process.stdout.readline().strip()
        assert locked.startswith(f"{tmp_path}/.chasles-arm-")
        with output_file(tmp_path / "result") as file:
            file.touch()
        assert f"{tmp_path}/{names(tmp_path)[0]}" == locked
        os.kill(process.pid, signal.SIGKILL)
    assert len(names(tmp_path)) == 2
    with temporary_folder(tmp_path):
        pass
    assert names(tmp_path) == ["result"]


def test_removed_folder_leaves_no_open_file(tmp_path):
    before = lowest_free_descriptor()
    for digits in range(5):
        (tmp_path / f".chasles-arm-{digits:016x}").mkdir()
    with temporary_folder(tmp_path):
        assert len(names(tmp_path)) == 1
    assert lowest_free_descriptor() == before


def test_files_of_other_programs_are_kept(tmp_path):
    (tmp_path / ".config-of-another-program").mkdir()
    (tmp_path / ".chasles-file").touch()
    (tmp_path / ".chasles-notes").mkdir()
    before = names(tmp_path)
    with temporary_folder(tmp_path):
        assert len(names(tmp_path)) == 4
    assert names(tmp_path) == before


def test_concurrent_folders_are_never_removed_in_use(tmp_path):
    def write(index):
        with temporary_folder(tmp_path) as folder:
            (folder / "file").write_text(str(index))
            return (folder / "file").read_text()

    before = lowest_free_descriptor()
    with ThreadPoolExecutor(8) as pool:
        assert list(pool.map(write, range(500))) == [str(index) for index in range(500)]
    assert names(tmp_path) == []
    assert lowest_free_descriptor() == before
