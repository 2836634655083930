"""Test a four-bar linkage whose cranks are coaxial, so that its loop is a rigid triangle."""

from pathlib import Path

import numpy as np

from chasles.derive import read
from tests.support.compiling import compiled


def test_linkage_with_coaxial_cranks_rotates_as_one_body(tmp_path):
    linkage = read(Path(__file__).with_name("coaxial_four_bar.toml"))
    robot = compiled(linkage, tmp_path, ["fk", "configuration", "margin"], ["c"])
    q = np.linspace(-3, 3, 7)[:, None]
    p, alone = robot.fk(q)[:, :2, 3], robot.fk([0.0])[:2, 3]
    c, s = np.cos(q[:, 0]), np.sin(q[:, 0])
    rotated = np.stack([c * alone[0] - s * alone[1], s * alone[0] + c * alone[1]], axis=-1)
    np.testing.assert_allclose(p, rotated, atol=1e-12)
    assert robot.loops_close(q).all()
