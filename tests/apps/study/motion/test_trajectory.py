"""Trajectory files are read without loss or rejected with a reason."""

import numpy as np
import pytest

import chasles
from chasles.errors import InputValueError, ShapeError
from chasles.study.motion import Motion, Trajectory, joint_line, time_scaling

ROBOT = chasles.load("scara")
NAMES = [c.name for c in ROBOT.coordinates]
HEAD = ",".join(NAMES)
END = np.array([0.3, -0.4, 0.05, 1.0])


def moved(frequency=20):
    curve = joint_line(np.zeros(4), END)
    timed = time_scaling("quintic", curve.length, duration=2.0)
    return Motion(ROBOT, curve, timed, np.zeros(4)).sample(frequency)


def written(tmp_path, text):
    file = tmp_path / "table.csv"
    file.write_text(text, encoding="utf-8")
    return file


@pytest.mark.parametrize("suffix", ["npz", "csv"])
def test_saved_trajectory_loads_without_loss(tmp_path, suffix):
    made, file = moved(), tmp_path / f"motion.{suffix}"
    made.save(file)
    found = Trajectory.load(file, robot=ROBOT)
    for name in ("t", "q", "qd", "qdd"):
        np.testing.assert_array_equal(getattr(found, name), getattr(made, name))
    for name in ("T", "V"):
        np.testing.assert_allclose(getattr(found, name), getattr(made, name), atol=1e-14)
    assert (found.robot, found.coordinate_names) == ("scara", tuple(NAMES))
    assert found.stage.dtype == made.stage.dtype


def test_npz_trajectory_loads_without_robot(tmp_path):
    made = moved()
    made.to_npz(tmp_path / "motion.npz")
    np.testing.assert_array_equal(Trajectory.load(tmp_path / "motion.npz").V, made.V)
    made.to_csv(tmp_path / "motion.csv")
    with pytest.raises(InputValueError, match="robot= is required"):
        Trajectory.load(tmp_path / "motion.csv")


def test_coordinates_between_samples_are_linear():
    made = moved()
    np.testing.assert_allclose(made.q_at(1.0), END / 2, atol=1e-12)
    middle = (made.t[3] + made.t[4]) / 2
    np.testing.assert_allclose(made.q_at([middle, 99.0]), [(made.q[3] + made.q[4]) / 2, END])


def test_table_columns_are_read_in_any_order_and_rates_are_differences(tmp_path):
    text = f"note,{','.join(reversed(NAMES))}\nx,4,3,2,1\n\ny,8,7,6,5\n"
    found = Trajectory.load(written(tmp_path, text), ROBOT)
    np.testing.assert_array_equal(found.q, [[1, 2, 3, 4], [5, 6, 7, 8]])
    np.testing.assert_allclose(found.t, [0, 0.05])
    np.testing.assert_allclose(found.qd, np.full((2, 4), 80))
    np.testing.assert_array_equal(found.T, ROBOT.fk(found.q))
    alone = Trajectory.load(written(tmp_path, f"{HEAD}\n1,2,3,4\n"), ROBOT)
    np.testing.assert_array_equal(alone.qd, np.zeros((1, 4)))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "header"),
        (f"{HEAD}\n", "at least one row"),
        ("0.1,0.2,0.3,0.4\n", "add the line shoulder,elbow,quill,flange, or t,shoulder"),
        ("shoulder,elbow\n1,2\n", "no column for quill, flange of robot scara"),
        (f"{HEAD}\n1,2,3,x\n", "line 2, flange: expected a number, got 'x'"),
        (f"{HEAD}\n1,2,3\n", "line 2, flange: expected a number, got no entry"),
        (f"{HEAD}\n1,2,3,nan\n", "finite"),
        (f"t,{HEAD}\n1,1,2,3,4\n0,1,2,3,4\n", "ascend"),
    ],
    ids=[
        "empty file",
        "no rows",
        "no header",
        "missing columns",
        "text cell",
        "missing cell",
        "nan cell",
        "decreasing time",
    ],
)
def test_malformed_table_is_rejected(tmp_path, text, message):
    with pytest.raises(InputValueError, match=message):
        Trajectory.load(written(tmp_path, text), ROBOT)


def test_trajectory_of_another_robot_is_rejected(tmp_path):
    file = tmp_path / "motion.npz"
    moved().to_npz(file)
    with pytest.raises(InputValueError, match=r"expected robot lynxmotion .*, got robot scara"):
        Trajectory.load(file, chasles.load("lynxmotion"))


def test_npz_of_bare_arrays_needs_t_and_q(tmp_path):
    file = tmp_path / "other.npz"
    np.savez(file, t=np.arange(3.0), q=np.zeros((3, 4)))
    assert Trajectory.load(file, ROBOT).q.shape == (3, 4)
    np.savez(file, t=np.arange(3.0), q=np.zeros((3, 6)))
    with pytest.raises(ShapeError, match=r"q \(m, 4\) of scara, got \(3,\) and \(3, 6\)"):
        Trajectory.load(file, ROBOT)
    np.savez(file, q=np.zeros((3, 4)))
    with pytest.raises(InputValueError, match="arrays t and q, got q"):
        Trajectory.load(file, ROBOT)


@pytest.mark.parametrize("name", ["absent.npz", "absent.csv"])
def test_missing_file_is_rejected(tmp_path, name):
    with pytest.raises(InputValueError, match="No such file"):
        Trajectory.load(tmp_path / name, ROBOT)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: moved().save("move.txt"), r"move\.txt: expected a file \.npz or \.csv, got \.txt"),
        (lambda: moved().save("move"), r"\.npz or \.csv, got no suffix"),
        (lambda: Trajectory.load("move.bag", ROBOT), r"expected a file \.npz or \.csv, got \.bag"),
    ],
    ids=["save .txt", "save without suffix", "load .bag"],
)
def test_unsupported_suffix_error_lists_supported_ones(call, message):
    with pytest.raises(InputValueError, match=message):
        call()
