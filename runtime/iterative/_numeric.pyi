import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

class Solver:
    """A robot with a frame of it as the tip, its limits and its table of starts."""

    def __new__(
        cls,
        kernels: tuple[object, ...],
        lower: FloatArray,
        upper: FloatArray,
        starts: FloatArray,
        poses: FloatArray,
        link: int = ...,
        screws: FloatArray = ...,
    ) -> Solver:
        """Take the compiled functions that the tip needs.

        Args:
            kernels: The capsules of fk_jacobian_mixed and hessian_mixed; for a link those of
                link_poses, and of chain_D_q of a robot with loops.
            lower: (n,) lower limits [rad or m].
            upper: (n,) upper limits [rad or m].
            starts: (m, n) coordinates at which attempts begin [rad or m].
            poses: (12, m) poses of the starts: the first three rows of each, entry by entry.
            link: The index of the link that is the tip; -1 for the tool.
            screws: (s, 8) the joints between the base and that link: index of the link that the
                joint carries, index of the coordinate or chain's joint, and the axis (v, omega) in
                the frame of that link.

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
            Coordinates (..., n) [rad or m], and over the batch: residual [m], validity, ending (an
            index: solved, limits, stalled, evaluations spent, not a pose), evaluations, restarts.
        """
