"""Plots of tool errors, designs and roadmaps show the correct values."""

import numpy as np
import pytest

from chasles.calibration import Design, FirstOrderErrors, MonteCarloErrors
from chasles.study.planning import OccupancyMap, prm

pytest.importorskip("matplotlib", reason="matplotlib is not installed")


def test_first_order_plot_shows_largest_effects_in_millimeters():
    names = tuple(f"p{k}" for k in range(15))
    effects = np.linspace(2e-3, 1e-4, 15)
    axes = FirstOrderErrors(np.eye(6), names, effects).plot()
    assert [bar.get_width() for bar in axes.patches] == pytest.approx(1e3 * effects[11::-1])
    assert [label.get_text() for label in axes.get_yticklabels()] == list(names[11::-1])


def test_monte_carlo_plot_is_the_cumulative_distribution():
    position = np.array([3e-3, 1e-3, 2e-3, 4e-3])
    axes = MonteCarloErrors(np.zeros((4, 3)), position, np.zeros(4)).plot()
    (line,) = axes.lines
    np.testing.assert_allclose(line.get_xdata(), [1, 2, 3, 4])
    np.testing.assert_allclose(line.get_ydata(), [0.25, 0.5, 0.75, 1])


def test_design_plot_shows_largest_deviations():
    std = np.array([1e-5, 3e-5, 2e-5])
    names = ("a", "b", "c")
    axes = Design(np.arange(2), np.zeros((2, 3)), names, std, 1.0, 0.0, 0.0).plot()
    (line,) = axes.lines
    np.testing.assert_allclose(line.get_xdata(), [1e-5, 2e-5, 3e-5])
    assert [label.get_text() for label in axes.get_yticklabels()] == ["a", "c", "b"]


def test_roadmap_plot_draws_each_edge_once():
    roadmap = prm(OccupancyMap(np.zeros((10, 10), bool), 0.1, np.zeros(2)), 20, rng=1)
    edges, points = roadmap.plot().lines
    x = edges.get_xdata().reshape(-1, 3)
    assert len(x) == len(roadmap.edges)
    np.testing.assert_array_equal(x[:, :2], roadmap.q[roadmap.edges][..., 0])
    assert np.isnan(x[:, 2]).all()
    np.testing.assert_array_equal(points.get_xydata(), roadmap.q)
