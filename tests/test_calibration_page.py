"""The program on the calibration page runs as printed."""

import numpy as np
import pytest

from tests.support.compiling import deriving_only
from tests.support.pages import examples

PAGE = "how-to/calibration.md"
NOISE = 2e-5
OFF = {"axis": 3e-4, "offset": 5e-3}
"""Standard deviations of the parameters of the measured arm [m or rad]."""


def test_calibration_page_finds_measured_arm(tmp_path, monkeypatch):
    pytest.importorskip("scipy")
    monkeypatch.chdir(tmp_path)
    random, names = np.random.default_rng(0), {}
    before, *after = examples(PAGE)
    with deriving_only("fk", "ik"):
        exec(compile(before, PAGE, "exec"), names)
        arm, targets = names["arm"], names["targets"]
        std = [OFF.get(item.part, 0) for item in arm.geometry]
        p = np.array([item.value for item in arm.geometry])
        moved = np.flatnonzero([item.part != "parameter" for item in arm.geometry])
        p[moved] += random.normal(0, np.array(std)[moved])
        q = names["design"].q
        points = positions(arm.fk_p(q, p), targets) + random.normal(0, NOISE, (len(q), 3, 3))
        write_table(tmp_path / "tracker.csv", q, points)
        for block in after:
            exec(compile(block, PAGE, "exec"), names)
    result, mine = names["result"], names["mine"]
    assert (result.warnings, result.outliers) == ((), ())
    assert (tmp_path / "report.html").stat().st_size > 10_000
    q = arm.random_q(500, rng=2)
    found = positions(result.T_W_base @ mine.fk(q), result.unknowns.reshape(-1, 3))
    errors = np.linalg.norm(found - positions(arm.fk_p(q, p), targets), axis=-1)
    nominal = np.linalg.norm(positions(arm.fk(q) - arm.fk_p(q, p), targets), axis=-1)
    assert np.median(errors) < 1e-4
    assert np.median(nominal) > 5e-3
    solutions = mine.ik(mine.fk(q[0]))
    moves = np.remainder(solutions.q[solutions.valid] - q[0] + np.pi, 2 * np.pi) - np.pi
    assert np.abs(moves).max(-1).min() < 1e-9


def positions(T, targets):
    """Return positions (N, m, 3) of tool targets (m, 3) at poses (N, 4, 4)."""
    return T[:, None, :3, 3] + np.einsum("nij,mj->nmi", T[:, :3, :3], targets)


def write_table(path, q, points):
    """Write coordinates (N, n) and positions (N, m, 3) under headings with units."""
    coordinates = [f"q{k + 1} [rad]" for k in range(q.shape[1])]
    header = [
        *coordinates,
        *(f"{axis}{j + 1} [m]" for j in range(points.shape[1]) for axis in "xyz"),
    ]
    rows = np.hstack([q, points.reshape(len(q), -1)])
    np.savetxt(path, rows, delimiter=",", header=",".join(header), comments="", fmt="%.17g")
