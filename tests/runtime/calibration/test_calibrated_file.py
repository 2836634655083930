"""Calibrated robots as files: the same arm, with an inverse; and the command that makes one."""

import csv

import numpy as np
import pytest
from derivations import ROBOTS
from numpy.testing import assert_allclose

import chasles
from chasles.__main__ import main
from chasles.calibration import robot_file
from chasles.derive import load, write
from chasles.errors import InputValueError


def test_the_file_describes_the_same_arm_and_has_an_inverse(arm, truth, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(robot_file(arm, truth.p, "mine", "a test"))
    write(load(path), tmp_path / "mine")
    mine = chasles.load(tmp_path / "mine")
    q = np.random.default_rng(0).uniform(-2, 2, (2000, 6))
    assert_allclose(mine.fk(q), arm.fk_p(q, truth.p), atol=1e-14)
    found = mine.ik(mine.fk(q))
    apart = np.remainder(found.q - q[:, None] + np.pi, 2 * np.pi) - np.pi
    near = (np.abs(apart).max(-1) < 1e-8) & found.valid
    assert near.any(-1).mean() > 0.999


@pytest.mark.parametrize("name", ["stanford", "scara", "photo_robot", "lynxmotion"])
def test_slides_offsets_and_frames(name, tmp_path):
    write(load(ROBOTS / f"{name}.toml"), tmp_path / name, ["fk", "fk_p", "jacobian_p"])
    robot = chasles.load(tmp_path / name)
    random = np.random.default_rng(1)
    p = np.array([g.value for g in robot.geometry])
    off = np.array([g.part != "transmission" for g in robot.geometry])
    p[off] += random.uniform(-1e-2, 1e-2, off.sum())
    path = tmp_path / "mine.toml"
    path.write_text(robot_file(robot, p, "mine", "a test"))
    write(load(path), tmp_path / "mine", ["fk"])
    q = random.uniform(-2, 2, (100, robot.n))
    assert_allclose(chasles.load(tmp_path / "mine").fk(q), robot.fk_p(q, p), atol=1e-13)


def test_drives_are_refused(arm):
    p = np.array([g.value for g in arm.geometry])
    p[[g.name for g in arm.geometry].index("elbow_gain")] = 1.001
    with pytest.raises(InputValueError, match="elbow_gain were identified"):
        robot_file(arm, p, "mine", "a test")


def test_the_command(arm, truth, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("chasles.__main__.load", lambda _name, parametric: arm)
    table, to = tmp_path / "measured.csv", tmp_path / "mine.toml"
    with table.open("w", newline="", encoding="utf-8") as stream:
        lines = csv.writer(stream)
        lines.writerow([*(f"q{k + 1} [deg]" for k in range(6)), *["x [mm]", "y [mm]", "z [mm]"]])
        points = truth.positions(arm, truth.q)[:, 0]
        lines.writerows([*q, *y] for q, y in zip(np.degrees(truth.q), 1e3 * points, strict=True))
    assert main(["calibrate", str(table), "--robot", "ur5e", "--to", str(to)]) == 0
    assert "shoulder_lift_tilt_x" in capsys.readouterr().out
    calibrated = load(to)
    assert calibrated.name == "mine"
    assert "identified from measured.csv" in calibrated.source
    table.write_text("q1 [deg]\n1\n")
    assert main(["calibrate", str(table), "--robot", "ur5e"]) == 1
    assert "no column for coordinate" in capsys.readouterr().err
