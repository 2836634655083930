import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

class Solver:
    """A robot with one of its frames as the tip, its limits and its table of starts."""

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
        """Stores the compiled functions that a kind of robot needs.

        Args:
            kind: "tool": the kernels are fk_jacobian_mixed and hessian_mixed. "link": link_poses,
                with chain_D_q for a robot with loops. "platform": chain_fk, chain_jacobian_mixed,
                actuators and actuators_D_chain.
            kernels: Their capsules.
            lower: (n,) lower limits.
            upper: (n,) upper limits.
            starts: (m, n) coordinates at the start; for a platform, its chain's joints follow.
            poses: (12, m) their poses: the first three rows of each, entry by entry.
            link: Index of the link that is the tip.
            screws: (s, 8) the joints before it: the link in whose frame the axis is constant (-1:
                the base), the coordinate or chain's joint that moves it, and the axis.
        """

    def solve(
        self,
        T: FloatArray,
        seeds: FloatArray | None,
        weights: FloatArray,
        in_tool_axes: bool,
        tolerance: float,
        budget: int,
        threads: int,
        /,
    ) -> tuple[
        FloatArray,
        FloatArray,
        NDArray[np.bool_],
        NDArray[np.int8],
        NDArray[np.int32],
        NDArray[np.int32],
    ]:
        """At poses (..., 4, 4): coordinates, residual, success, ending, iterations, restarts.

        `seeds` has a row in the form of `starts` for each pose.
        """
