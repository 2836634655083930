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
        """Takes the compiled functions that a kind of robot needs.

        Args:
            kind: "tool": kernels are fk_jacobian_mixed. "link": link_poses, and of a robot with
                loops chain_D_q. "platform": chain_fk, chain_jacobian_mixed, actuators and
                actuators_D_chain.
            kernels: Their capsules.
            lower: (n,) lower limits.
            upper: (n,) upper limits.
            starts: (m, n) coordinates to begin at; of a platform followed by its chain's joints.
            poses: (12, m) their poses: the first three rows of each, entry by entry.
            link: Which of the links is the tip.
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

        `seeds` are rows as of `starts`, one for each pose.
        """
