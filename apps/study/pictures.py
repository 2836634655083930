"""Plots of study results.

Each function takes a result and matplotlib axes, and returns the axes.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from chasles.contract import requires

_COLORS = "cividis"
"""Color map whose colors are distinguishable in print and for color-blind readers."""
_EMPTY = "#ffffff00"
_COLOR_BLIND = ("#0072b2", "#e69f00", "#009e73", "#d55e00", "#cc79a7", "#000000")
"""Colors that color-blind readers (Okabe and Ito, 2008) can distinguish, also in print."""
_STYLES = ("-", "--", ":")
# Workspace figures are 4.2 inches wide, with their views stacked vertically.


def plot_workspace(found: Any, ax: Any = None) -> Any:
    """Plot the fraction of configurations in each column of grid cells along the view direction."""
    thin = int(np.argmin(found.grid.shape))
    if ax is not None:
        _view(found, thin, ax)
        return ax
    with requires("chasles[study]"):
        import matplotlib.pyplot as plt  # noqa: PLC0415

    normals = [thin] if found.grid.dimension < 3 else [2, 1]  # noqa: PLR2004 - a solid has three dimensions
    figure, axes = plt.subplots(
        len(normals), 1, squeeze=False, layout="constrained", figsize=(4.2, 3.5 * len(normals))
    )
    most = max(_shares(found.hits.sum(normal)).max() for normal in normals)
    for normal, own in zip(normals, axes[:, 0], strict=True):
        image = _view(found, normal, own, most)
    size, unit = found.size, found.size.unit.replace("^3", "³").replace("^2", "²")
    figure.suptitle(f"{found.robot}: {size.value:.3g} {unit} ± {size.error:.1g} {unit}")
    figure.colorbar(image, ax=axes, label="configurations in 1000")
    return axes[:, 0] if len(normals) > 1 else axes[0, 0]


def _view(found: Any, normal: int, ax: Any, most: float | None = None) -> Any:
    shares = _shares(found.hits.sum(normal, dtype=np.uint64))
    return _image(ax, found.grid, normal, shares, vmin=0, vmax=most)


def _image(ax: Any, grid: Any, normal: int, values: Any, **style: Any) -> Any:
    """Draw the cells of a grid as an image, seen along an axis.

    Masked cells stay empty.
    """
    with requires("chasles[study]"):
        from matplotlib import colormaps  # noqa: PLC0415

    across, up = (k for k in range(3) if k != normal)
    lower, upper = grid.lower, grid.upper
    image = ax.imshow(
        values.T,
        origin="lower",
        extent=(lower[across], upper[across], lower[up], upper[up]),
        cmap=colormaps[_COLORS].with_extremes(bad=_EMPTY),
        interpolation="nearest",
        **style,
    )
    ax.set_xlabel(f"{'xyz'[across]} [m]")
    ax.set_ylabel(f"{'xyz'[up]} [m]")
    return image


def _shares(hits: NDArray[np.uint64]) -> Any:
    """Return the number of configurations in each cell, per 1000 configurations.

    Empty cells are masked.
    """
    return np.ma.masked_equal(hits, 0) * (1000 / max(int(hits.sum()), 1))


def plot_trajectory(found: Any, ax: Any = None) -> Any:
    """Plot coordinates, rates and accelerations over time.

    Values in [rad] and in [m] share the same axes.
    """
    with requires("chasles[study]"):
        import matplotlib.pyplot as plt  # noqa: PLC0415

    axes = ax
    if axes is None:
        figure, axes = plt.subplots(3, 1, sharex=True, layout="constrained", figsize=(5.2, 6.4))
        figure.suptitle(found.robot)
    words = ("coordinate [rad, m]", "rate [1/s]", "acceleration [1/s²]")
    for own, values, word in zip(axes, (found.q, found.qd, found.qdd), words, strict=True):
        for j, name in enumerate(found.coordinate_names):
            style = _STYLES[j // len(_COLOR_BLIND) % len(_STYLES)]
            color = _COLOR_BLIND[j % len(_COLOR_BLIND)]
            own.plot(found.t, values[:, j], style, color=color, label=name, linewidth=1.2)
        own.set_ylabel(word)
        own.grid(alpha=0.3)
    handles, labels = axes[0].get_legend_handles_labels()
    if ax is None:
        figure.legend(handles, labels, loc="outside lower center", ncols=3, fontsize="small")
    else:
        axes[0].legend(ncols=3, fontsize="small")
    axes[-1].set_xlabel("time [s]")
    return axes


def plot_success(found: Any, ax: Any = None) -> Any:
    """Plot success rates against the number of samples, with one line per maximum step.

    Error bars show the 95 % confidence intervals of the success rates.
    """
    axes = _axes(ax, (4.4, 3.2))
    for k, step in enumerate(sorted({row.max_step for row in found.rows})):
        rows = [row for row in found.rows if row.max_step == step]
        rate = np.array([row.rate for row in rows])
        bars = np.array([[row.rate - row.lower, row.upper - row.rate] for row in rows]).T
        axes.errorbar(
            [row.samples for row in rows],
            100 * rate,
            yerr=100 * np.maximum(bars, 0),
            fmt="o" + _STYLES[k % len(_STYLES)],
            color=_COLOR_BLIND[k % len(_COLOR_BLIND)],
            label=f"step {step:g}" if np.isfinite(step) else "any step",
            capsize=3,
        )
    axes.set_xlabel("samples")
    axes.set_ylabel("paths found [%]")
    axes.set_ylim(-3, 103)
    axes.legend()
    axes.grid(alpha=0.3)
    return axes


def plot_plan(found: Any, ax: Any = None) -> Any:
    """Plot the coordinates along a path, or the path in the plane if it has two coordinates."""
    axes = _axes(ax, (4.4, 3.2))
    fractions = np.linspace(0, 1, 200)
    points = found.at(fractions)
    if points.shape[1] == 2:  # noqa: PLR2004 - a plane has two dimensions
        axes.plot(*found.q.T, "o-", color=_COLOR_BLIND[0], markersize=3)
        return _plane(axes)
    for k, values in enumerate(points.T):
        axes.plot(fractions, values, color=_COLOR_BLIND[k % len(_COLOR_BLIND)], label=f"q[{k}]")
    axes.set_xlabel("fraction of the path")
    axes.set_ylabel("coordinate [rad, m]")
    axes.legend(ncols=3, fontsize="small")
    axes.grid(alpha=0.3)
    return axes


def plot_roadmap(found: Any, ax: Any = None) -> Any:
    """Plot the points and edges of a roadmap, projected onto its first two coordinates."""
    axes = _axes(ax, (4.4, 3.6))
    gaps = np.full((len(found.edges), 1, 2), np.nan)
    lines = np.concatenate([found.q[found.edges][..., :2], gaps], axis=1).reshape(-1, 2)
    axes.plot(*lines.T, color=_COLOR_BLIND[0], lw=0.4, alpha=0.6)
    axes.plot(*found.q[:, :2].T, ".", color=_COLOR_BLIND[5], markersize=3)
    if found.q.shape[1] == 2:  # noqa: PLR2004 - a plane has two dimensions
        return _plane(axes)
    axes.set_xlabel("q[0] [rad, m]")
    axes.set_ylabel("q[1] [rad, m]")
    return axes


def plot_region(found: Any, ax: Any = None, singular: Any = None) -> Any:
    """Plot the border of a planar region, the limit circles of each leg, and singular positions."""
    with requires("chasles[study]"):
        from matplotlib.patches import Circle  # noqa: PLC0415

    axes = _axes(ax, (4.2, 4.2))
    for k, own in enumerate(found.pieces[0] if found.pieces else ()):
        for radius in (own.inner, own.outer):
            style = {"fill": False, "linestyle": ":", "linewidth": 0.8}
            axes.add_patch(Circle(own.center, radius, edgecolor=_COLOR_BLIND[k], **style))
    for arc in found.arcs:
        axes.plot(*arc.points().T, color=_COLOR_BLIND[-1], linewidth=1.6)
    for k, curve in enumerate(singular.type_2 if singular is not None else ()):
        label = None if k else "platform gains a degree of freedom"
        axes.plot(*curve.T, _STYLES[1], color=_COLOR_BLIND[3], linewidth=1.2, label=label)
    if singular is not None and singular.type_2:
        axes.legend(loc="lower center", fontsize="small")
    axes.autoscale_view()
    axes.set_title(f"{found.robot} {found.name}: {found.area * 1e6:.6g} mm²")
    return _plane(axes)


def plot_singularities(found: Any, ax: Any = None) -> Any:
    """Plot singular positions of a planar platform."""
    axes = _axes(ax, (4.2, 4.2))
    names = (
        "type 1: a leg is stretched or folded",
        "type 2: the platform gains a degree of freedom",
    )
    for curves, k, name in zip((found.type_1, found.type_2), (0, 3), names, strict=True):
        for i, curve in enumerate(curves):
            label = None if i else name
            axes.plot(*curve.T, _STYLES[k % 2], color=_COLOR_BLIND[k], linewidth=1.2, label=label)
    if found.type_1 or found.type_2:
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.15), fontsize="small")
    axes.set_title(f"{found.robot}: singular positions")
    return _plane(axes)


def plot_section(found: Any, ax: Any = None) -> Any:
    """Plot the boundary of a workspace section.

    In a section through the first joint axis, distances on the far side of this axis are negative.
    """
    axes = _axes(ax, (4.2, 4.2))
    curves = [arc.points() for arc in found.section.arcs]
    if found.offset:  # The section plane does not contain the first joint axis.
        curves = found.meridian.curves()
    for curve in curves:
        axes.plot(*curve.T, color=_COLOR_BLIND[0], linewidth=1.4)
    size = f"{found.area:.6g} m²" if not found.volume else f"{found.volume:.6g} m³"
    axes.set_title(f"{found.robot}, {found.point}: {size}")
    axes.grid(alpha=0.3)
    labels = (
        ("x [m]", "y [m]") if found.turn is None else ("distance from the first axis [m]", "z [m]")
    )
    return _plane(axes, *labels)


def plot_positions(found: Any, ax: Any = None) -> Any:
    """Plot reachable tool positions for one orientation, seen along z and along y."""
    with requires("chasles[study]"):
        import matplotlib.pyplot as plt  # noqa: PLC0415

    axes = ax
    if axes is None:
        figure, axes = plt.subplots(2, 1, layout="constrained", figsize=(4.2, 6.4))
        volume = found.size
        figure.suptitle(f"{found.robot}: {volume.value:.3g} m³ ± {volume.error:.1g} m³")
    for own, normal in zip(axes, (2, 1), strict=True):
        thick = found.inside.sum(normal) * found.grid.side
        image = _image(own, found.grid, normal, np.ma.masked_equal(thick, 0))
        own.figure.colorbar(image, ax=own, label=f"extent along {'xyz'[normal]} [m]", shrink=0.8)
    return axes


def plot_reach(found: Any, ax: Any = None) -> Any:
    """Plot the fraction of reached orientations, and the number of poses that each limit excludes.

    Each view shows the fraction of reached orientations, averaged over the reached grid cells along
    the view direction.
    """
    with requires("chasles[study]"):
        import matplotlib.pyplot as plt  # noqa: PLC0415

    share = np.ma.masked_equal(found.fraction_grid(), 0)
    axes = ax
    if axes is None:
        figure, axes = plt.subplots(3, 1, layout="compressed", figsize=(4.2, 9.0))
        figure.suptitle(f"{found.robot}: {found.reached.mean():.1%} of the poses are reached")
    for own, normal in zip(axes, (2, 1), strict=False):
        image = _image(own, found.grid, normal, 100 * share.mean(normal), vmin=0, vmax=100)
    axes[1].figure.colorbar(image, ax=axes[1], label="orientations reached [%]", shrink=0.8)
    counts = found.limit_counts()
    if not counts:
        axes[2].set_axis_off()
        return axes
    axes[2].barh(list(counts), list(counts.values()), color=_COLOR_BLIND[0])
    axes[2].invert_yaxis()
    axes[2].set_xlabel("poses excluded by its limit")
    return axes


def plot_orientations(found: Any, ax: Any = None) -> Any:
    """Plot the fraction of tool angles that a planar platform reaches in each grid cell."""
    axes = _axes(ax, (4.2, 3.6))
    possible = np.ma.masked_equal(100 * found.fraction, 0)
    image = _image(axes, found.grid, 2, possible, vmin=0, vmax=100)
    axes.figure.colorbar(image, ax=axes, label="angles possible [%]")
    return axes


def plot_total(found: Any, ax: Any = None) -> Any:
    """Plot the border of the region in which a planar platform reaches every angle of a range."""
    axes = _axes(ax, (4.2, 4.2))
    for arc in found.total.arcs:
        axes.plot(*arc.points().T, color=_COLOR_BLIND[0], linewidth=1.6)
    axes.set_title(f"{found.robot}, all angles: {found.total.area * 1e6:.6g} mm²")
    axes.grid(alpha=0.3)
    return _plane(axes)


def _axes(ax: Any, size: tuple[float, float]) -> Any:
    """Return the passed matplotlib axes, or the axes of a new figure with a size [inch]."""
    with requires("chasles[study]"):
        import matplotlib.pyplot as plt  # noqa: PLC0415

    return plt.subplots(layout="constrained", figsize=size)[1] if ax is None else ax


def _plane(axes: Any, x: str = "x [m]", y: str = "y [m]") -> Any:
    """Label the axes of a plane plot, and set the same scale in both directions."""
    axes.set_aspect("equal")
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    return axes
