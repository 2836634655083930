"""All assembly modes of parallel platforms."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import BoolArray, FloatArray
from ..call.capabilities import needs
from ..facts import RobotFacts
from .closures import is_planar


class PlanarAssemblyModes(NamedTuple):
    """The assembly modes of a planar platform, sorted by phi. Unused solution slots are last.

    Attributes:
        x: (..., 6, 3) poses (x, y [m], phi [rad] in (-pi, pi]) of the platform. NaN in unused
            slots.
        valid: (..., 6) whether a slot holds a mode. Rod lengths are accurate to 1e-12 of the
            platform size.
    """

    x: FloatArray
    valid: BoolArray


class AssemblyModes(NamedTuple):
    """The assembly modes of a parallel platform in k solution slots; unused slots are last.

    Attributes:
        T: (..., k, 4, 4) poses of the tool. NaN in unused slots.
        theta: (..., k, n_theta) joints of the main chain [rad or m].
        valid: (..., k) whether a slot holds a mode. Rod lengths are accurate to 1e-12 of the
            platform size.
        margin: (..., k) the determinant of J_x divided by the product of its row norms
            (dimensionless). The margin is 0 at a singularity, where two assembly modes are equal.
        complete: (...,) whether it is certain that all modes were found.
    """

    T: FloatArray
    theta: FloatArray
    valid: BoolArray
    margin: FloatArray
    complete: BoolArray


def _has_chain_pose(robot: RobotFacts) -> bool:
    return ("pose", "chain", "") in robot._roles


class PlatformMethods(RobotFacts):
    """Methods of platforms that have a function for all assembly modes."""

    @needs("modes", when=_has_chain_pose)
    def fk_all(self, q: ArrayLike, *, threads: int | Literal["all"] = 1) -> AssemblyModes:
        """Return the tool poses of all assembly modes of the platform.

        At some singularities of type 2, the poses are not isolated. If the poses are not isolated,
        only some modes are found, and `complete` is False.

        Args:
            q: (..., n) actuated coordinates [rad or m].
            threads: The number of threads for a large batch; "all" is one per core.

        Returns:
            `T (..., k, 4, 4)`, `theta (..., k, n_theta)`, `valid (..., k)`, `margin (..., k)` and
            `complete (...,)`. Assembly modes of a planar platform are sorted by phi. Assembly modes
            of a spatial platform are sorted by height, highest first.

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
        """Return all assembly modes `x (..., 6, 3)`, `valid (..., 6)` of a planar platform at q.

        Modes closer than 1e-7 of the platform size and 1e-7 rad count as equal. At singularities of
        type 2, assembly modes coincide. If the three rods stay parallel along a circle of poses, no
        mode is found.

        Source:
            Gosselin, Sefrioui and Richard, Solutions polynomiales au probleme de la cinematique des
            manipulateurs paralleles plans a trois degres de liberte, 1992.
        """
        x, margin, _ = self.functions["modes"](q)
        return PlanarAssemblyModes(x, np.asarray(np.isfinite(margin)))
