"""The file that `chasles calibrate` writes reproduces the calibrated arm and its IK function."""

import csv

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chasles.calibration.calibrated_file import robot_file
from chasles.cli.app import run as main
from chasles.derive import DescriptionError, read
from tests.support.compiling import compiled, compiled_with_vectors
from tests.support.derivations import ROBOTS
from tests.support.measured_arms import drawn


@pytest.fixture(scope="module")
def driven(arm):
    """Return geometry parameters p with transmission errors, and random motor positions."""
    random, p = np.random.default_rng(3), drawn(arm, 0).p
    drives = np.array([g.part == "transmission" for g in arm.geometry])
    p[drives] += random.uniform(-3e-3, 3e-3, drives.sum())
    return p, random.uniform(-6, 6, (1000, 6))


@pytest.fixture(scope="module")
def mine(arm, driven, tmp_path_factory):
    """Load the robot from its calibrated file."""
    folder = tmp_path_factory.mktemp("mine")
    path = folder / "mine.toml"
    path.write_text(robot_file(arm, driven[0], "mine", "a test"))
    functions = ["fk", "ik", "coordinates_from_readings", "readings_from_coordinates"]
    with compiled_with_vectors():
        return compiled(read(path), folder / "mine", functions, ["c"])


def test_robot_file_reproduces_calibrated_fk_and_ik_inverts_it(arm, truth, mine):
    """`fk` takes joint positions, so transmissions do not change the result."""
    q = np.random.default_rng(0).uniform(-2, 2, (2000, 6))
    assert_allclose(mine.fk(q), arm.fk_p(q, truth.p), atol=1e-14)
    found = mine.ik(mine.fk(q))
    apart = np.remainder(found.q - q[:, None] + np.pi, 2 * np.pi) - np.pi
    near = (np.abs(apart).max(-1) < 1e-8) & found.valid
    assert near.any(-1).mean() > 0.999


def test_robot_file_reproduces_fk_with_prismatic_joints_and_offsets(loaded, tmp_path):
    robot = loaded("stanford")
    random = np.random.default_rng(1)
    p = np.array([g.value for g in robot.geometry])
    off = np.array([g.part != "transmission" for g in robot.geometry])
    p[off] += random.uniform(-1e-2, 1e-2, off.sum())
    path = tmp_path / "mine.toml"
    path.write_text(robot_file(robot, p, "mine", "a test"))
    q = random.uniform(-2, 2, (100, robot.n))
    mine = compiled(read(path), tmp_path / "mine", ["fk"], ["c"])
    assert_allclose(mine.fk(q), robot.fk_p(q, p), atol=1e-13)


def test_robot_file_reproduces_identified_transmissions(arm, driven, mine):
    p, r = driven
    q = mine.coordinates_from_readings(r)
    assert np.abs(q - r).max() > 1e-2
    assert_allclose(mine.readings_from_coordinates(q), r, rtol=0, atol=1e-14)
    assert_allclose(mine.fk(q), arm.fk_p(r, p), rtol=0, atol=1e-13)
    found = mine.ik(mine.fk(q))
    back = arm.fk_p(mine.readings_from_coordinates(found.q), p)
    gaps = np.abs(back - arm.fk_p(r, p)[:, None]).max((-2, -1))[found.valid]
    assert len(gaps) > 1000
    assert gaps.max() < 1e-10


def test_non_invertible_transmissions_are_rejected(tmp_path):
    path = tmp_path / "scara.toml"
    text = (ROBOTS / "scara.toml").read_text()
    for law, words in (
        ('gain = 1\nsin1 = "3"', "waves relative to the gain of at most"),
        ("gain = 0", "a nonzero gain"),
    ):
        path.write_text(f'{text}\n[[transmissions]]\ncoordinate = "shoulder"\n{law}\n')
        with pytest.raises(DescriptionError, match=words):
            read(path)
    path.write_text(f'{text}\n[[transmissions]]\ncoordinate = "none"\n')
    with pytest.raises(DescriptionError, match="transmission of 'none'"):
        read(path)


def test_calibrate_command_writes_robot_file_and_reports_errors(
    arm, truth, tmp_path, monkeypatch, capsys
):
    monkeypatch.setattr("chasles.cli.calibrating.load", lambda _name, parametric: arm)
    table, to = tmp_path / "measured.csv", tmp_path / "mine.toml"
    with table.open("w", newline="", encoding="utf-8") as stream:
        lines = csv.writer(stream)
        lines.writerow([*(f"q{k + 1} [deg]" for k in range(6)), *["x [mm]", "y [mm]", "z [mm]"]])
        points = truth.positions(arm, truth.q)[:, 0]
        lines.writerows([*q, *y] for q, y in zip(np.degrees(truth.q), 1e3 * points, strict=True))
    assert main(["calibrate", str(table), "--robot", "ur5e", "--to", str(to)]) == 0
    assert "shoulder_lift_tilt_x" in capsys.readouterr().out
    calibrated = read(to)
    assert calibrated.name == "mine"
    assert "identified from measured.csv" in calibrated.source
    table.write_text("q1 [deg],x [mm]\n1,2\n")
    assert main(["calibrate", str(table), "--robot", "ur5e"]) == 1
    assert "no column for coordinate" in capsys.readouterr().err
