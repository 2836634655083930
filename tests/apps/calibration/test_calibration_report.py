"""Calibration reports in HTML, in LaTeX and on the command line."""

import subprocess
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from chasles import InputValueError, se3
from chasles.calibration import Calibration, Poses, Positions, identify, select_model
from chasles.calibration.report.contents import contents
from chasles.study.results import read_npz
from tests.support.faults import check_writes
from tests.support.measured_arms import drawn
from tests.support.tools import needs


@pytest.fixture(scope="module")
def chosen(arm):
    truth = drawn(arm, 0)
    points = truth.positions(arm, truth.q)
    points += 2e-5 * np.random.default_rng(0).normal(size=points.shape)
    points[4, 1] += 5e-3
    return select_model(arm, truth.q, Positions(points, 2e-5))


@pytest.fixture(scope="module")
def folder(chosen, tmp_path_factory):
    folder = tmp_path_factory.mktemp("report")
    chosen.calibration.save(folder / "report.tex")
    return folder


def test_report_tables_match_calibration_results(chosen):
    found = chosen.calibration
    said = contents(found)
    rows = {row[0]: row[1:] for row in said.parameters.rows}
    assert set(rows) == {name for name in found.names if not name.startswith("base_")}
    k = found.names.index("elbow_shift_x")
    change, half = float(rows["elbow_shift_x"][1]), float(rows["elbow_shift_x"][2])
    assert change == pytest.approx(1e3 * found.deviations[k], abs=1e-3)
    assert half == pytest.approx(
        1e3 * (found.confidence_intervals[k, 1] - found.values[k]), abs=1e-3
    )
    assert [row[0] for row in said.tables[0].rows] == ["target 1", "target 2", "target 3"]
    assert [row[1] for row in said.tables[0].rows] == ["60", "59", "60"]
    assert any("measurement 5, target 2" in note for note in said.notes)
    (validation,) = (table for table in said.tables if "validation" in table.title)
    assert {row[0] for row in validation.rows} == set(chosen.errors)


def test_reports_print_frames_and_stated_noise(chosen, arm):
    found = chosen.calibration
    (frames,) = (table for table in contents(found).tables if table.title == "Frames")
    assert [row[0] for row in frames.rows] == ["base frame in the frame of the measurements"]
    x, y, z, *angles = map(float, frames.rows[0][1:])
    assert_allclose([x, y, z], 1e3 * found.T_W_base[:3, 3], atol=1e-4)
    R = Rotation.from_euler("xyz", angles, degrees=True).as_matrix()
    assert_allclose(R, found.T_W_base[:3, :3], atol=1e-5)
    assert "sigma = 0.02 mm" in contents(found).summary[2]
    truth = drawn(arm, 1)
    T_tool_probe = se3.exp([0.1, 0.02, -0.05, 1.0, -0.5, 0.5])
    poses = Poses(truth.poses(arm, truth.q) @ T_tool_probe, (2e-5, 5e-5))
    text = str(found := identify(arm, truth.q, poses))
    assert "sigma = 0.02 mm and 0.05 mrad" in text
    (_, base), (name, probe) = found.frames
    assert name == "probe frame in the nominal tool frame"
    assert_allclose(base, truth.T_W_base, atol=1e-2)
    # The true tool has an error of 1 mm and 1 mrad.
    assert_allclose(probe, T_tool_probe, atol=1e-2)
    assert f"{1e3 * probe[0, 3]:.4f}" in text


def test_html_report_is_deterministic_and_self_contained(chosen, tmp_path):
    for name in ("one.html", "two.html"):
        chosen.calibration.save(tmp_path / name)
    page = (tmp_path / "one.html").read_text(encoding="utf-8")
    assert page == (tmp_path / "two.html").read_text(encoding="utf-8")
    root = ET.fromstring(page.split("\n", 1)[1])
    assert len(root.findall(".//{http://www.w3.org/2000/svg}svg")) == 2
    assert "<script" not in page
    assert "<link" not in page
    assert "src=" not in page


def test_latex_report_has_plots(folder):
    for part in ("residuals", "parameters"):
        assert (folder / f"report_{part}.pdf").stat().st_size > 1000


@needs("pdflatex")
def test_latex_report_compiles_to_one_page(folder):
    command = ["pdflatex", "-interaction=batchmode", "-halt-on-error", "report.tex"]
    done = subprocess.run(command, cwd=folder, capture_output=True, check=False)
    assert done.returncode == 0
    log = (folder / "report.log").read_text(encoding="latin-1")
    assert "Output written on report.pdf (1 page" in log


def test_residual_plot_shows_before_after_and_outlier_points(chosen):
    before, after, left_out = chosen.calibration.plot().lines
    assert [len(line.get_xdata()) for line in (before, after, left_out)] == [180, 179, 1]
    assert left_out.get_xdata()[0] == 5
    assert np.median(before.get_ydata()) > 20 * np.median(after.get_ydata())


def test_plots_keep_ticks_plain_and_points_off_the_frame(chosen):
    for axes in (chosen.calibration.plot(), chosen.calibration.plot_parameters()):
        figure = axes.figure
        figure.draw_without_rendering()
        (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
        points = np.concatenate(
            [line.get_xydata() for line in axes.lines if len(line.get_xdata()) > 2]
        )
        assert left < points[:, 0].min() <= points[:, 0].max() < right
        assert low < points[:, 1].min() <= points[:, 1].max() < high
        texts = [*axes.get_xticklabels(), *axes.get_yticklabels()]
        assert not any("^" in text.get_text() for text in texts)
        whole, shown = figure.bbox, axes.get_tightbbox()
        assert whole.x0 <= shown.x0 < shown.x1 <= whole.x1
        assert whole.y0 <= shown.y0 < shown.y1 <= whole.y1


@pytest.mark.parametrize("suffix", [".npz", ".csv", ".toml"])
def test_save_that_fails_leaves_the_former_files(chosen, tmp_path, suffix):
    file = tmp_path / f"found{suffix}"
    file.write_text("former")
    check_writes(lambda: chosen.calibration.save(file), tmp_path, "cannot be written")


@pytest.mark.parametrize("kind", ["positions", "poses"])
def test_calibration_survives_round_trip_through_npz(chosen, arm, tmp_path, kind):
    found = chosen.calibration
    if kind == "poses":
        truth = drawn(arm, 1)
        found = identify(arm, truth.q, Poses(truth.poses(arm, truth.q), (2e-5, 5e-5)))
    found.save(tmp_path / "found.npz")
    again = Calibration.load(tmp_path / "found.npz", arm)
    assert str(again) == str(found)
    assert again.model_errors == found.model_errors
    assert (again.covariance == found.covariance).all()
    assert type(again.measurements) is type(found.measurements)
    assert (again.poses(found.q) == found.poses(found.q)).all()
    with pytest.raises(InputValueError, match=r"\.toml or \.html or \.tex or \.csv or \.npz"):
        found.save(tmp_path / "found.json")


@pytest.mark.parametrize("robot", ["../ur5e", "/folder", "arm.toml"])
def test_loaded_calibration_names_no_path(chosen, tmp_path, robot):
    file = tmp_path / "found.npz"
    chosen.calibration.save(file)
    arrays = read_npz(file)
    facts = str(arrays["facts"]).replace('"robot": "ur5e"', f'"robot": "{robot}"')
    np.savez(file, **arrays | {"facts": np.array(facts)})
    with pytest.raises(InputValueError, match=r"found\.npz: expected the name of a robot"):
        Calibration.load(file)


def test_csv_holds_each_parameter_with_its_bounds(chosen, tmp_path):
    found = chosen.calibration
    found.save(tmp_path / "found.csv")
    head, *rows = (tmp_path / "found.csv").read_text(encoding="utf-8").splitlines()
    assert head == "parameter,unit,nominal,change,value,lower,upper"
    assert [row.split(",")[0] for row in rows] == list(found.names)
    numbers = np.array([row.split(",")[2:] for row in rows], dtype=float)
    assert (numbers[:, 2] == found.values).all()
    assert (numbers[:, 3:] == found.confidence_intervals).all()
