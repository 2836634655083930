"""Reports: what they say, in HTML, in LaTeX and on the command line."""

import subprocess
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from chasles import screws
from chasles.calibration import Poses, Positions, identify, select_model
from chasles.calibration.report import html_page, residual_plot, tex_page
from chasles.calibration.report.contents import contents
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
    """A report in LaTeX."""
    folder = tmp_path_factory.mktemp("report")
    tex_page(chosen.calibration, folder / "report.tex", chosen.errors)
    return folder


def test_report_tables_match_calibration_results(chosen):
    found = chosen.calibration
    said = contents(found, chosen.errors)
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
    (held,) = (table for table in said.tables if table.title.startswith("Held back"))
    assert {row[0] for row in held.rows} == set(chosen.errors)


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
    T_tool_probe = screws.exp([0.1, 0.02, -0.05, 1.0, -0.5, 0.5])
    poses = Poses(truth.poses(arm, truth.q) @ T_tool_probe, (2e-5, 5e-5))
    text = str(found := identify(arm, truth.q, poses))
    assert "sigma = 0.02 mm and 0.05 mrad" in text
    (_, base), (name, probe) = found.frames
    assert name == "probe frame in the nominal tool frame"
    assert_allclose(base, truth.T_W_base, atol=1e-2)
    # The drawn tool is off by 1 mm and 1 mrad.
    assert_allclose(probe, T_tool_probe, atol=1e-2)
    assert f"{1e3 * probe[0, 3]:.4f}" in text


def test_html_report_is_deterministic_and_self_contained(chosen):
    page = html_page(chosen.calibration, chosen.errors)
    assert page == html_page(chosen.calibration, chosen.errors)
    root = ET.fromstring(page.split("\n", 1)[1])
    assert len(root.findall(".//{http://www.w3.org/2000/svg}svg")) == 2
    assert "<script" not in page
    assert "<link" not in page
    assert "src=" not in page


def test_latex_report_has_residual_plot(folder):
    assert (folder / "report_residual_plot.pdf").stat().st_size > 1000


@needs("pdflatex")
def test_latex_report_compiles_to_one_page(folder):
    command = ["pdflatex", "-interaction=batchmode", "-halt-on-error", "report.tex"]
    done = subprocess.run(command, cwd=folder, capture_output=True, check=False)
    assert done.returncode == 0
    log = (folder / "report.log").read_text(encoding="latin-1")
    assert "Output written on report.pdf (1 page" in log


def test_residual_plot_shows_before_after_and_outlier_points(chosen):
    (axes,) = residual_plot(chosen.calibration).axes
    before, after, left_out = axes.lines
    assert [len(line.get_xdata()) for line in (before, after, left_out)] == [180, 179, 1]
    assert left_out.get_xdata()[0] == 5
    assert np.median(before.get_ydata()) > 20 * np.median(after.get_ydata())
