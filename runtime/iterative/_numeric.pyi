import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

class Solver:
    """A robot with a frame of it as the tip, its limits and its table of starts."""

    def __new__(
        cls,
        kind: str,
        kernels: tuple[object, ...],
        lower: FloatArray,
        upper: FloatArray,
        starts: FloatArray,
        poses: FloatArray,
        link: int = ...,
        screws: FloatArray = ...,
    ) -> Solver:
        """Takes the compiled functions that this kind of tip needs.

        Args:
            kind: "tool": the kernels are fk_jacobian_mixed and hessian_mixed. "link": link_poses,
                and for a robot with loops chain_D_q. "platform": chain_fk, chain_jacobian_mixed,
                actuators and actuators_D_chain.
            kernels: The capsules of these functions.
            lower: (n,) lower limits [rad or m].
            upper: (n,) upper limits [rad or m].
            starts: (m, n) coordinates at which attempts begin [rad or m]; for a platform (m, 2 n),
                followed by the joints of its chain.
            poses: (12, m) poses of the starts: the first three rows of each, entry by entry.
            link: The index of the link that is the tip.
            screws: (s, 8) the joints between the base and that link: index of the link in whose
                frame the axis is constant (-1: the base), index of the coordinate or chain's joint,
                and the axis (v, omega) in that frame.

        Raises:
            ValueError: If the functions, arrays or indices do not match each other.
        """

    def solve(
        self,
        T: FloatArray,
        seeds: FloatArray | None,
        weights: FloatArray,
        in_tool_axes: bool,
        tolerance: float,
        unit: float,
        budget: int,
        threads: int,
        locked: NDArray[np.bool_],
        /,
    ) -> tuple[
        FloatArray,
        FloatArray,
        NDArray[np.bool_],
        NDArray[np.int8],
        NDArray[np.int32],
        NDArray[np.int32],
    ]:
        """Solves the inverse kinematics of poses (..., 4, 4).

        Args:
            T: (..., 4, 4) poses of the tip measured and expressed in the base frame.
            seeds: (number of poses, n) where the first attempt begins, as rows of `starts`; None:
                at the nearest start.
            weights: (6,) of the error, linear first.
            in_tool_axes: Whether the weights are along the axes of the tip instead of the base.
            tolerance: Residual [m] at which a pose is reached.
            unit: The length [m] that counts as much as a radian, in errors and residuals.
            budget: Evaluations of forward kinematics for each pose.
            threads: The greatest number of threads.
            locked: (n,) coordinates that keep the values of their seeds, also beyond a limit.

        Returns:
            Coordinates (..., n) [rad or m], and over the batch: residual [m], success,
            ending (an index: converged, limits, stalled, budget, no pose), evaluations, restarts.
        """
