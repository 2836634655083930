"""Workspaces of planar platforms with three legs, bounded by circles.

At a constant tool angle, a two-link leg or a cylinder with stroke limits restricts the tool to an
annulus. The center and the radii of the annulus are fitted to samples of the leg. The fit of the
annulus is exact, because a leg's margin or squared length is a polynomial in the squared distance
from the center. An error is raised if such a polynomial does not fit the samples of a leg.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chasles import InputValueError, Robot
from chasles.contract import check_type
from chasles.summaries import summary_repr

from ..arguments import finite
from ..grid import Grid
from ..results import StudyResult
from .annuli import Annulus, BorderArc, area, border

FloatArray = NDArray[np.float64]

_SAMPLES = 200
_FITS = 1e-9
"""Maximum relative residual of the polynomial fitted to a leg. With a larger residual, the boundary
of the leg's region does not consist of circular arcs."""
_AXES = ("prismatic", "prismatic", "revolute")


@dataclass(frozen=True, eq=False)
class PlanarRegion(StudyResult):
    """A region of tool positions (x, y) of a planar platform, in the base frame.

    Attributes:
        robot: The robot's name.
        name: Description of the region for plot titles and summaries, such as "at every angle".
        pieces: Disjoint parts of the region. Each part is the intersection of one annulus per leg.
    """

    _parts = (Annulus,)

    robot: str
    name: str
    pieces: tuple[tuple[Annulus, ...], ...]

    def __repr__(self) -> str:
        """Short summary with the main values."""
        arcs = f"{len(self.arcs)} arcs"
        facts = (self.name, f"area {self.area:.12g} m^2", arcs)
        return summary_repr(
            self, self.robot, *facts, methods="contains(points), plot(), save(path)"
        )

    @property
    def area(self) -> float:
        """The area of the region [m^2], exact up to rounding errors."""
        return sum(area(piece) for piece in self.pieces)

    @property
    def arcs(self) -> list[BorderArc]:
        """The arcs of the border, directed so that the region is on the left of each arc."""
        return [arc for piece in self.pieces for arc in border(piece)]

    def contains(self, points: FloatArray) -> NDArray[np.bool_]:
        """Return a mask (m,) of the points (m, 2) [m] that are in the region."""
        inside = [np.all([own.contains(points) for own in piece], axis=0) for piece in self.pieces]
        return np.asarray(np.any(inside, axis=0))

    def plot(self, ax: Any = None, singular: Any = None) -> Any:
        """Plot the border of the region, the circles that limit each leg, and singularity curves.

        Args:
            ax: The matplotlib axes, or None for a new figure.
            singular: The `SingularityCurves` to plot as well. If `singular` is None, no singularity
                curves are plotted.

        Returns:
            The axes.
        """
        from ..pictures import plot_region  # noqa: PLC0415

        return plot_region(self, ax, singular)


def constant_orientation_workspace(robot: Robot, phi: float) -> PlanarRegion:
    """Return the tool positions that a planar platform reaches at one tool angle.

    Args:
        robot: A planar platform with three legs. The tool moves in the x-y plane of the base frame
            and rotates about the z axis. Each leg is a chain of two links, or a cylinder with
            stroke limits.
        phi: The angle of the tool about the z axis of the base frame [rad].

    Returns:
        A `PlanarRegion` of positions (x, y) in the base frame [m]. `area` [m^2] is exact up to
        rounding errors. `contains(points)` tests whether points (m, 2) [m] are in the region.
        `arcs` lists the circular arcs of the border. If the tool reaches no position, `area` is 0.

    Raises:
        InputTypeError: `robot` is not a `Robot`, or `phi` is not a real number.
        ShapeError: `phi` is an array with one or more dimensions.
        InputValueError: `phi` is not finite. The robot is not a planar platform with three legs. A
            leg is neither a chain of two links nor a cylinder. A cylinder of the robot has no
            stroke limits.

    Source:
        J.-P. Merlet, C. Gosselin, N. Mouly, Workspaces of planar parallel manipulators, 1998.
    """
    check_type("constant_orientation_workspace: robot", robot, Robot)
    finite("constant_orientation_workspace: phi", phi, ())
    annuli = tuple(_annulus(robot, leg, phi) for leg in range(robot.n)) if _is_planar(robot) else ()
    if not annuli:
        raise InputValueError(f"{robot.name}: expected a planar platform with three legs")
    return PlanarRegion(robot.name, f"at {np.degrees(phi):.4g}°", (annuli,))


def dexterous_workspace(robot: Robot) -> PlanarRegion:
    """Return the positions that the tool of a planar platform reaches at every tool angle.

    At one tool angle, each leg restricts the tool to an annulus, the area between two concentric
    circles. As the angle changes, the center of the annulus moves on a circle of radius r about a
    fixed point. Let t be the distance of a position from this fixed point. If t + r is at most the
    outer radius and |t - r| at least the inner radius, the annulus contains the position at every
    angle. These conditions bound the region by circles.

    Args:
        robot: A planar platform with three legs. The tool moves in the x-y plane of the base frame
            and rotates about the z axis. Each leg is a chain of two links, or a cylinder with
            stroke limits.

    Returns:
        A `PlanarRegion` of positions (x, y) in the base frame [m]. `area` [m^2] is exact up to
        rounding errors. `contains(points)` tests whether points (m, 2) [m] are in the region.
        `arcs` lists the circular arcs of the border. If the region is empty, `area` is 0.

    Raises:
        InputTypeError: `robot` is not a `Robot`.
        InputValueError: The robot is not a planar platform with three legs. A leg is neither a
            chain of two links nor a cylinder. A cylinder of the robot has no stroke limits.
    """
    check_type("dexterous_workspace: robot", robot, Robot)
    legs = []
    turned = (constant_orientation_workspace(robot, phi).pieces[0] for phi in (0.0, np.pi))
    for at_0, at_half in zip(*turned, strict=True):
        middle = (at_0.center + at_half.center) / 2
        r = float(np.linalg.norm(at_0.center - at_half.center)) / 2
        least = at_0.inner + r if at_0.inner > 0 else 0.0
        most = at_0.outer - r
        parts = [Annulus(middle, least, most)] if most > least else []
        if 0 < at_0.inner < r and most > 0:
            parts.append(Annulus(middle, 0.0, min(r - at_0.inner, most)))
        legs.append(parts)
    return PlanarRegion(robot.name, "at every angle", tuple(itertools.product(*legs)))


@dataclass(frozen=True, eq=False)
class OrientationGrid(StudyResult):
    """The tool angles that a planar platform reaches at each cell of a position grid.

    Attributes:
        grid: Grid whose cell centers are the tool positions, in the base frame.
        angles: (k,) angles of the tool about the z axis of the base frame [rad].
        possible: (nx, ny, k) mask, True if the tool reaches the angle at the cell center.
    """

    _parts = (Grid,)

    grid: Grid
    angles: FloatArray
    possible: NDArray[np.bool_]

    def __repr__(self) -> str:
        """Short summary with the main values."""
        low, high = np.degrees([self.angles.min(), self.angles.max()])
        return summary_repr(
            self,
            "",
            f"{len(self.angles)} angles from {low:.4g}° to {high:.4g}°",
            f"all of them on {self.total:.4g} m^2, some on {self.inclusive:.4g} m^2",
            methods="fraction, possible, plot(), save(path)",
        )

    @property
    def fraction(self) -> FloatArray:
        """(nx, ny) fraction of the angles that the tool reaches in each cell."""
        return np.asarray(self.possible.mean(-1))

    @property
    def total(self) -> float:
        """Area in which the tool reaches all angles [m^2], accurate to one cell at the border."""
        return float(self.possible.all(-1).sum() * self.grid.side**2)

    @property
    def inclusive(self) -> float:
        """Area in which the tool reaches some angle [m^2], accurate to one cell at the border."""
        return float(self.possible.any(-1).sum() * self.grid.side**2)

    def plot(self, ax: Any = None) -> Any:
        """Plot the fraction of the angles that the tool reaches in each cell.

        Args:
            ax: The matplotlib axes, or None for a new figure.

        Returns:
            The axes.
        """
        from ..pictures import plot_orientations  # noqa: PLC0415

        return plot_orientations(self, ax)


def orientation_grid(robot: Robot, phi: ArrayLike, *, resolution: int = 200) -> OrientationGrid:
    """Return the tool angles that a planar platform reaches at each cell of a position grid.

    Args:
        robot: A planar platform with three legs. The tool moves in the x-y plane of the base frame
            and rotates about the z axis. Each leg is a chain of two links, or a cylinder with
            stroke limits.
        phi: (k,) angles of the tool about the z axis of the base frame [rad].
        resolution: Number of grid cells along the longest side, at least 2.

    Returns:
        An `OrientationGrid`. `possible` (nx, ny, k) is True if the tool reaches the angle at the
        cell center. `grid` describes the cells in the base frame [m]. `fraction` (nx, ny) is the
        fraction of the angles that the tool reaches. `total` [m^2] is the area in which the tool
        reaches all angles, and `inclusive` [m^2] is the area in which it reaches at least one.

    Raises:
        InputTypeError: `robot` is not a `Robot`, or `phi` or `resolution` contains values that are
            not real numbers.
        ShapeError: `phi` has two or more dimensions, or `resolution` has one or more.
        InputValueError: `phi` is empty, or contains a number that is not finite. `resolution` is
            less than 2 or has a fractional part, or the grid would have more than 1e9 cells. The
            robot is not a planar platform with three legs. A leg is neither a chain of two links
            nor a cylinder. A cylinder of the robot has no stroke limits.
    """
    check_type("orientation_grid: robot", robot, Robot)
    angles = np.atleast_1d(finite("orientation_grid: phi", phi))
    if not len(angles):
        raise InputValueError("orientation_grid: expected at least one angle")
    regions = [constant_orientation_workspace(robot, angle) for angle in angles]
    disks = [(own.center, own.outer) for region in regions for own in region.pieces[0]]
    lower = np.min([np.r_[center - radius, 0] for center, radius in disks], axis=0)
    upper = np.max([np.r_[center + radius, 0] for center, radius in disks], axis=0)
    grid = Grid.from_bounds(lower, upper, resolution)
    x, y, _ = grid.centers()
    positions = np.stack(np.meshgrid(x, y, indexing="ij"), -1).reshape(-1, 2)
    possible = np.column_stack([region.contains(positions) for region in regions])
    return OrientationGrid(grid, angles, possible.reshape(len(x), len(y), len(angles)))


def _is_planar(robot: Robot) -> bool:
    joints = [joint.kind for joint in robot.chain_joints]
    return tuple(joints) == _AXES and robot.n == len(_AXES)


def _annulus(robot: Robot, leg: int, phi: float) -> Annulus:
    coordinate = robot.coordinates[leg]
    if coordinate.kind == "prismatic":
        c, (a, b) = _of_distance(robot, leg, lambda x: robot.actuators(x)[:, leg] ** 2, phi, 1)
        lower, upper = robot.lower[leg], robot.upper[leg]
        if not np.isfinite([lower, upper]).all():
            raise InputValueError(f"{robot.name}: coordinate {coordinate.name} has no limits")
        squares = (np.array([max(lower, 0.0), upper]) ** 2 - a) / b
    else:
        c, polynomial = _of_distance(robot, leg, lambda x: robot.actuator_margin(x)[:, leg], phi, 2)
        squares = np.sort(np.roots(polynomial[::-1]).real)
    inner, outer = np.sqrt(np.maximum(squares, 0))
    return Annulus(c, float(inner), float(outer))


def _of_distance(
    robot: Robot, leg: int, value: Callable[[FloatArray], FloatArray], phi: float, degree: int
) -> tuple[FloatArray, FloatArray]:
    """Fit a polynomial in |p - c|^2 to samples of `value`.

    Return the center c and the coefficients.
    """
    size = robot.unit_length
    p = np.random.default_rng(0).uniform(-size, size, (_SAMPLES, 2))
    found = value(np.column_stack([p, np.full(len(p), phi)]))
    kept = np.isfinite(found)
    p, found = p[kept], found[kept]
    center = _center(p / size, found, degree) * size
    square = ((p - center) ** 2).sum(-1) / size**2
    powers = square[:, None] ** np.arange(degree + 1)
    coefficients = np.linalg.lstsq(powers, found, rcond=None)[0]
    residual = np.abs(powers @ coefficients - found).max()
    if not residual <= _FITS * np.abs(found).max():
        raise InputValueError(
            f"{robot.name}: leg {leg + 1}: the boundary does not consist of circles; the "
            f"residual is {residual:.3g} of {np.abs(found).max():.3g}"
        )
    return center, coefficients / size ** (2.0 * np.arange(degree + 1))


def _center(p: FloatArray, value: FloatArray, degree: int) -> FloatArray:
    """Return the center of a leg's annulus, computed from the leading terms of the polynomial.

    Let m be `degree`, let a be the leading coefficient, and let d be the distance of (x, y) from
    the center (c_x, c_y). Then a d^(2m) = a (x^2 + y^2)^m - 2 m a (x^2 + y^2)^(m - 1) (c_x x + c_y
    y) + lower orders.
    """
    x, y = p.T
    orders = [(i, j) for i in range(2 * degree + 1) for j in range(2 * degree + 1 - i)]
    terms = np.column_stack([x**i * y**j for i, j in orders])
    by_order = dict(zip(orders, np.linalg.lstsq(terms, value, rcond=None)[0], strict=True))
    lead = by_order[2 * degree, 0]
    below = np.array([by_order[2 * degree - 1, 0], by_order[0, 2 * degree - 1]])
    return np.asarray(-below / (2 * degree * lead))
