"""Reports: what they say, in HTML, in LaTeX and on the command line."""

import subprocess
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from chasles.calibration import Positions, best_model
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
    return best_model(arm, truth.q, Positions(points, 2e-5))


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
    assert half == pytest.approx(1e3 * (found.intervals[k, 1] - found.values[k]), abs=1e-3)
    assert [row[0] for row in said.tables[0].rows] == ["target 1", "target 2", "target 3"]
    assert [row[1] for row in said.tables[0].rows] == ["60", "59", "60"]
    assert any("measurement 5, target 2" in note for note in said.notes)
    assert {row[0] for row in said.tables[1].rows} == set(chosen.errors)


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
