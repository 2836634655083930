"""``python -m bench studies``: workspaces, reach, a process and motions, beside plain loops.

The loops of the peers do the same work on fewer postures: kinematics of a posture and its cell in
the grid, or an inverse of a pose within limits. Their time is stated for one posture.
"""

import resource
import time
from collections.abc import Callable

import numpy as np
import roboticstoolbox as rtb
from rich.table import Table

import chasles
from chasles.study import evenly, reach, workspace
from chasles.study.cells import cells_of

from ..cases.arms import ARMS
from ..peers.forward import Call, pinocchio, toolbox
from ..report import out

LOOPED = 20_000
"""Postures of a peer's loop."""
ASKED = 200
"""Poses of a peer's inverse."""
SIDE, ORIENTATIONS = 50, 20


def run(samples: int) -> int:
    """Prints times beside peers and the memory of the process; returns 0."""
    table = Table(title=f"Studies, two cores where there are two; {samples:,} postures")
    for name in ("study", "seconds", "ns a posture", "a peer's ns", "ratio"):
        table.add_column(name, justify="left" if name == "study" else "right")
    _warm()
    arm = chasles.load("ur5e")
    own = _seconds(lambda: workspace(arm, samples)) / samples
    for call in _forward_peers():
        _row(table, f"workspace of ur5e: {call.name}", own, samples, _looped(arm, call))
    for name in ("excavator", "well_manipulator"):
        robot = chasles.load(name)
        _row(
            table,
            f"workspace of {name}",
            _seconds(lambda r=robot: workspace(r, samples)) / samples,
            samples,
        )
    cells = cells_of(np.full(3, -1.0), np.full(3, 1.0), SIDE)
    count = cells.count * ORIENTATIONS
    own = _seconds(lambda: reach(arm, cells, evenly(ORIENTATIONS))) / count
    _row(table, "reach of ur5e: Robotics Toolbox ik_LM, one solution", own, count, _asked())
    out.print(table)
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    out.print(f"memory of the process at most: {most:.0f} MB")
    return 0


def _warm() -> None:
    for name in ("ur5e", "excavator", "well_manipulator"):
        workspace(chasles.load(name), 1000)


def _seconds(work: Callable[[], object]) -> float:
    begin = time.perf_counter()
    work()
    return time.perf_counter() - begin


def _row(table: Table, name: str, own: float, count: int, peer: float | None = None) -> None:
    beside = ("", "") if peer is None else (f"{peer * 1e9:,.0f}", f"{peer / own:.0f}")
    table.add_row(name, f"{own * count:.2f}", f"{own * 1e9:.0f}", *beside)


def _forward_peers() -> list[Call]:
    arm = next(arm for arm in ARMS if arm.name == "ur5e")
    return [pinocchio.calls(arm)[0], toolbox.calls(arm)[0]]


def _looped(robot: chasles.Robot, call: Call) -> float:
    """Seconds a posture of a loop over a peer's forward kinematics, with the same cells."""
    postures = np.random.default_rng(0).uniform(robot.lower, robot.upper, (LOOPED, robot.n))
    cells = cells_of(np.full(3, -1.2), np.full(3, 1.2), 100)
    hits = np.zeros(cells.shape, dtype=np.uint32)

    def work() -> None:
        for q in postures:
            T = call.read(call.fk(q))[0]
            cell = ((T[:3, 3] - cells.lower) / cells.side).astype(int)
            hits[tuple(cell)] += 1

    return _seconds(work) / LOOPED


def _asked() -> float:
    """Seconds a pose of the Robotics Toolbox's inverse, on reachable poses."""
    model = rtb.models.DH.UR5()
    postures = np.random.default_rng(1).uniform(-3, 3, (ASKED, 6))
    poses = [model.fkine(q).A for q in postures]
    return _seconds(lambda: [model.ik_LM(T) for T in poses]) / ASKED
