"""Poses that an arm reaches by a self-motion have a valid solution."""

import numpy as np

from chasles.derive import read_text
from tests.support.compiling import compiled

RAIL = """
name = "arm_on_rail"
convention = "urdf"
units = { length = "m", angle = "rad" }
tool = { xyz = [0.06, 0, 0] }
joints = [
  { name = "rail", type = "prismatic", axis = [0, 1, 0], limits = [0, 1] },
  { name = "j1", xyz = [0, 0, 0.1], axis = [0, 0, 1] },
  { name = "j2", axis = [0, 1, 0] },
  { name = "j3", xyz = [0, 0, 0.135], axis = [0, 1, 0] },
  { name = "j4", xyz = [0.147, 0, 0], axis = [0, 1, 0] },
]
"""
"""Robot file of a turntable arm on a rail, with three parallel joint axes. At j1 = 90 degrees, the
rail moves in the plane of the parallel axes."""

FAR_FROM_STARTS = (
    324,
    340,
    652,
    725,
    738,
    777,
    797,
    1166,
    1273,
    1284,
    1571,
    1583,
    1594,
    1649,
    1810,
)
"""Indices of poses for which Newton's method fails if it starts from the inverse solutions for a
rotated tool."""


def test_rail_in_plane_of_parallel_axes_loses_no_pose(tmp_path):
    functions = ("fk", "fk_jacobian_mixed", "ik")
    arm = compiled(
        read_text(RAIL, file="arm_on_rail.toml"), tmp_path / "arm_on_rail", functions, ["c"]
    )
    rng = np.random.default_rng(0)
    q = rng.uniform(-1.5, 1.5, (2000, 5))
    q[:, 0] = rng.uniform(0, 1, len(q))
    q[:, 1] = np.pi / 2
    T = arm.fk(q[list(FAR_FROM_STARTS)])
    solutions = arm.ik(T)
    assert (solutions.count > 0).all()
    np.testing.assert_array_equal(solutions.count, solutions.distinct().count)
    off = np.abs(arm.fk(solutions.q) - T[:, None]).max((-2, -1))
    assert off[solutions.valid].max() < 1e-8
