"""Malicious files raise an error that names the file."""

import csv
import io
import json
import os
import sys
from zipfile import ZIP_LZMA, ZIP_STORED, ZipFile

import numpy as np
import pytest

import chasles
from chasles import ChaslesError
from chasles.calibration import read_measurements
from chasles.study import Workspace, workspace
from chasles.study.motion import MotionSequence, Trajectory
from chasles.study.results import read_npz

ARM = chasles.load("ur5e")
Q = ARM.q_reference + 0.1
FACTS = {"list": "[1]", "deep": "[" * 50_000, "fields": '{"type": "Trajectory", "fields": {}}'}


@pytest.mark.parametrize("name", FACTS)
def test_crafted_result_is_refused(name, tmp_path):
    file = tmp_path / "result.npz"
    np.savez(file, facts=np.array(FACTS[name]))
    with pytest.raises(ChaslesError, match=r"result\.npz"):
        Trajectory.load(file)


def test_text_with_numbers_that_are_no_characters_is_refused(tmp_path):
    file = tmp_path / "result.npz"
    facts = np.array(['{"type": "T"}'])
    facts.view(np.uint32)[10] = 0x40000074
    np.savez(file, facts=facts.reshape(()))
    with pytest.raises(ChaslesError, match=r"result\.npz"):
        Trajectory.load(file)


def test_too_long_cells_are_refused(tmp_path):
    file = tmp_path / "table.csv"
    file.write_text("x," + "9" * (csv.field_size_limit() + 1) + "\n1,1\n")
    robot = chasles.load("ur5e")
    for load in (read_measurements, Trajectory.load):
        with pytest.raises(ChaslesError, match=r"table\.csv"):
            load(file, robot)


def test_too_many_columns_are_refused(tmp_path):
    file = tmp_path / "table.csv"
    file.write_text(",".join(["x"] * 10_001) + "\n1,1\n")
    with pytest.raises(ChaslesError, match=r"table\.csv, line 1: more than 10000 cells"):
        read_measurements(file, chasles.load("ur5e"))


ROWS = {"t": [0.0, 1.0], "q": np.zeros((2, 6))}
ARRAYS = {
    "scalar": ROWS | {"t": 0.0},
    "complex": ROWS | {"q": np.zeros((2, 6), complex)},
    "text": ROWS | {"qd": [["a"] * 6] * 2},
    "shape": ROWS | {"qdd": np.zeros((7, 3))},
    "nan": ROWS | {"qd": np.full((2, 6), np.nan)},
}


@pytest.mark.parametrize("name", ARRAYS)
def test_crafted_trajectory_is_refused(name, tmp_path):
    file = tmp_path / "result.npz"
    np.savez(file, **ARRAYS[name])
    with pytest.raises(ChaslesError, match=r"result\.npz"):
        Trajectory.load(file, chasles.load("ur5e"))


TRAJECTORY = MotionSequence(ARM, ARM.q_reference).move(Q, "quintic", duration=1).sample(3)


@pytest.mark.parametrize(
    ("field", "value"),
    [("coordinate_names", [["a"]] * 6), ("robot", 3), ("t", 1.0), ("q", None), ("stage", [])],
)
def test_fields_of_a_result_have_their_types(field, value, tmp_path):
    file = tmp_path / "result.npz"
    TRAJECTORY.save(file)
    arrays = read_npz(file)
    facts = json.loads(str(arrays["facts"]))
    facts["fields"][field] = value
    np.savez(file, **arrays | {"facts": np.array(json.dumps(facts))})
    with pytest.raises(ChaslesError, match=r"result\.npz: expected a Trajectory written by to_npz"):
        Trajectory.load(file, ARM)


def test_array_in_place_of_a_choice_is_refused(tmp_path):
    file = tmp_path / "result.npz"
    workspace(ARM, 10, resolution=2, progress=False).save(file)
    arrays = read_npz(file)
    facts = json.loads(str(arrays["facts"]))
    facts["fields"]["sampling"] = {"array": "bounds"}
    np.savez(file, **arrays | {"facts": np.array(json.dumps(facts))})
    with pytest.raises(ChaslesError, match=r"result\.npz: expected a Workspace"):
        Workspace.load(file)


HEADERS = {"code": b"[" * 40, "open": b"{'descr': ("}


@pytest.mark.parametrize("name", [*HEADERS, "text", "encrypted", "array", "lzma"])
def test_damaged_archive_is_refused(name, tmp_path):
    file = tmp_path / "result.npz"
    with ZipFile(file, "w", ZIP_LZMA if name == "lzma" else ZIP_STORED) as archive:
        if name in HEADERS:
            header = HEADERS[name].ljust(117) + b"\n"
            archive.writestr("t.npy", b"\x93NUMPY\x01\x00\x76\x00" + header)
        else:
            archive.writestr("t", bytes(100))
    content = file.read_bytes()
    if name == "array":
        np.save(opened := io.BytesIO(), np.zeros(3))
        file.write_bytes(opened.getvalue())
    elif name == "lzma":
        file.write_bytes(content.replace(content[40:44], b"\xff\xff\xff\xff", 1))
    elif name == "encrypted":
        entry = b"PK\x01\x02\x14\x03\x14\0"
        file.write_bytes(content.replace(entry + b"\0", entry + b"\1"))
    with pytest.raises(ChaslesError, match=r"result\.npz: expected NumPy arrays"):
        read_npz(file)


@pytest.mark.skipif(sys.platform == "win32", reason="named pipes")
@pytest.mark.parametrize("name", ["table.csv", "result.npz"])
def test_named_pipe_does_not_block(name, tmp_path):
    file = tmp_path / name
    os.mkfifo(file)
    robot = chasles.load("ur5e")
    kind = "NumPy arrays" if name == "result.npz" else "a table with a header"
    refused = rf"{name}: expected {kind} \(\[Errno 22\] not a regular file"
    with pytest.raises(ChaslesError, match=refused):
        Trajectory.load(file, robot)
    if name == "table.csv":
        refused = rf"{name}: cannot read the table \(not a regular file"
        with pytest.raises(ChaslesError, match=refused):
            read_measurements(file, robot)
