"""Every assembly mode of a platform on legs, at given actuators."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import BoolArray, FloatArray
from ..call.capabilities import needs
from ..facts import RobotFacts
from .closures import is_planar


class PlanarAssemblyModes(NamedTuple):
    """The assembly modes of a planar platform, in the order of phi.

    Attributes:
        x: (..., 6, 3) poses (x, y [m], phi [rad] in (-pi, pi]) of the platform; unused slots, which
            are the last, are NaN.
        valid: (..., 6) whether a slot holds a mode: all rods then have their lengths to 1e-12 of
            the platform's size.
    """

    x: FloatArray
    valid: BoolArray


class AssemblyModes(NamedTuple):
    """The assembly modes of a platform on legs, in slots, of which the last are unused.

    Attributes:
        T: (..., k, 4, 4) poses of the tool; NaN in unused slots.
        theta: (..., k, n_theta) joints of the main chain [rad or m].
        valid: (..., k) whether a slot holds a mode: all rods then have their lengths to 1e-12 of
            the platform's size.
        margin: (..., k) the determinant of J_x over the lengths of its rows, a pure number: 0 where
            the platform is singular and two modes meet.
        complete: (...,) whether no mode can be missing: every complex solution is accounted for.
    """

    T: FloatArray
    theta: FloatArray
    valid: BoolArray
    margin: FloatArray
    complete: BoolArray


def _has_chain_pose(robot: RobotFacts) -> bool:
    return ("pose", "chain", "") in robot._roles


class PlatformMethods(RobotFacts):
    """The methods of a platform on legs whose modes are all known."""

    @needs("modes", when=_has_chain_pose)
    def fk_all(self, q: ArrayLike, *, threads: int | Literal["all"] = 1) -> AssemblyModes:
        """Every pose of the tool in which the platform can be assembled at given actuators.

        Where the poses are not isolated, as at some singularities of type 2, some of them are
        found, and `complete` is False.

        Args:
            q: (..., n) actuated coordinates [rad or m].
            threads: The number of threads for a large batch; "all" is one per core.

        Returns:
            `T (..., k, 4, 4)`, `theta (..., k, n_theta)`, `valid (..., k)`, `margin (..., k)` and
            `complete (...,)`. The modes of a planar platform are in the order of phi, all other
            modes from the highest downwards.

        Source:
            Planar: Gosselin, Sefrioui and Richard 1992. Six rods: Wampler, Forward displacement
            analysis of general six-in-parallel SPS (Stewart) platform manipulators using soma
            coordinates, 1996.
        """
        theta, margin, unsure = self.functions["modes"](q, threads=threads)
        T = self._roles["pose", "chain", ""](theta)
        T[~np.isfinite(margin)] = np.nan
        complete = np.asarray(unsure[..., 0] == 0)
        return AssemblyModes(T, theta, np.isfinite(margin), margin, complete)

    @needs("modes", when=is_planar)
    def fk_planar_all(self, q: ArrayLike) -> PlanarAssemblyModes:
        """Every pose in which a planar platform can be assembled at given actuators.

        Two modes less than 1e-7 of the platform's size, and 1e-7 rad, apart count as one; where
        they meet the platform is at a singularity of type 2. Where the three rods turn in parallel,
        a whole circle of poses is possible and the method finds none of them.

        Args:
            q: (..., n) actuated coordinates [rad or m].

        Returns:
            `x (..., 6, 3)` and `valid (..., 6)`.

        Source:
            Gosselin, Sefrioui and Richard, Solutions polynomiales au probleme de la cinematique des
            manipulateurs paralleles plans a trois degres de liberte, 1992.
        """
        x, margin, _ = self.functions["modes"](q)
        return PlanarAssemblyModes(x, np.asarray(np.isfinite(margin)))
