"""Recordings: read from files of motions and from tables, and refused where they are none."""

import numpy as np
import pytest

import chasles
from chasles.errors import InputValueError
from chasles.study.motion import Motion, joint_line, time_scaling
from chasles.view import read_recording

ROBOT = chasles.load("scara")
HEAD = ",".join(c.name for c in ROBOT.coordinates)


def written(tmp_path, text):
    file = tmp_path / "table.csv"
    file.write_text(text, encoding="utf-8")
    return file


@pytest.mark.parametrize("ending", ["npz", "csv"])
def test_motion_files_survive_round_trip(tmp_path, ending):
    a, b = np.zeros(4), np.array([0.3, -0.4, 0.05, 1.0])
    curve = joint_line(a, b)
    sampled = Motion(ROBOT, curve, time_scaling("quintic", curve.length, duration=2.0), a).sample(
        20
    )
    file = tmp_path / f"motion.{ending}"
    getattr(sampled, f"to_{ending}")(file)
    found = read_recording(file, ROBOT)
    np.testing.assert_array_equal(found.q, sampled.q)
    np.testing.assert_array_equal(found.t, sampled.t - sampled.t[0])
    np.testing.assert_allclose(found.at(1.0), (a + b) / 2, atol=1e-12)
    np.testing.assert_array_equal(found.at(99.0), sampled.q[-1])


def test_recording_columns_are_read_in_any_order(tmp_path):
    names = [c.name for c in ROBOT.coordinates]
    text = f"note,{','.join(reversed(names))}\nx,4,3,2,1\n\ny,8,7,6,5\n"
    found = read_recording(written(tmp_path, text), ROBOT)
    np.testing.assert_array_equal(found.q, [[1, 2, 3, 4], [5, 6, 7, 8]])
    np.testing.assert_allclose(found.t, [0, 0.05])


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("", "header"),
        (f"{HEAD}\n", "at least one row"),
        ("shoulder,elbow\n1,2\n", "no column for quill, flange of scara"),
        (f"{HEAD}\n1,2,3,x\n", "line 2, flange: expected a number, got 'x'"),
        (f"{HEAD}\n1,2,3\n", "line 2, flange: expected a number, got no entry"),
        (f"{HEAD}\n1,2,3,nan\n", "finite"),
        (f"t,{HEAD}\n1,1,2,3,4\n0,1,2,3,4\n", "never fall"),
    ],
    ids=[
        "empty file",
        "no rows",
        "missing columns",
        "text cell",
        "missing cell",
        "nan cell",
        "decreasing time",
    ],
)
def test_malformed_recording_table_is_rejected(tmp_path, text, word):
    with pytest.raises(InputValueError, match=word):
        read_recording(written(tmp_path, text), ROBOT)


def test_recording_of_another_robot_is_rejected(tmp_path):
    file, own = tmp_path / "other.npz", [c.name for c in ROBOT.coordinates]
    arrays = {"t": np.arange(3.0), "q": np.zeros((3, 4))}
    np.savez(file, **arrays, robot="gantry", names=own)
    with pytest.raises(InputValueError, match=r"recording of gantry .*, expected one of scara"):
        read_recording(file, ROBOT)
    np.savez(file, **arrays, robot="scara", names=["a", "b", "c", "d"])
    with pytest.raises(InputValueError, match=r"\(a, b, c, d\).*\(shoulder, elbow, quill, flange"):
        read_recording(file, ROBOT)
    np.savez(file, **arrays)
    assert read_recording(file, ROBOT).q.shape == (3, 4)


def test_recording_with_wrong_arrays_is_rejected(tmp_path):
    file = tmp_path / "other.npz"
    np.savez(file, t=np.arange(3.0), q=np.zeros((3, 6)))
    with pytest.raises(InputValueError, match=r"q \(m, 4\) of scara, got \(3,\) and \(3, 6\)"):
        read_recording(file, ROBOT)
    np.savez(file, q=np.zeros((3, 4)))
    with pytest.raises(InputValueError, match="arrays t and q"):
        read_recording(file, ROBOT)
    with pytest.raises(InputValueError, match="arrays t and q"):
        read_recording(tmp_path / "absent.npz", ROBOT)
