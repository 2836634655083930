"""Measures the times of workspaces, reach studies, motions, plans and plain loops.

The command is ``python -m bench studies``.

The plain loops are Python loops that call other libraries. In the comparison of workspaces, one
iteration of the loop computes the forward kinematics and the grid cell of the tool. Times are per
configuration, or per sample for a motion.
"""

import resource
import time
from collections.abc import Callable

import numpy as np
import roboticstoolbox as rtb
from rich.table import Table

import chasles
from chasles.study import reach, uniform_orientations, workspace
from chasles.study.grid import Grid
from chasles.study.motion import Motion, MotionSequence, line, time_optimal, time_scaling
from chasles.study.planning import box, configuration_space, prm, sphere

from ..cases.arms import ARMS
from ..peers.forward import Call, pinocchio, toolbox
from ..report import out

LOOPED = 20_000
"""Number of configurations for the forward kinematics of another library."""
ASKED = 200
"""Number of poses that another library's inverse kinematics function solves."""
SIDE, ORIENTATIONS = 50, 20
HOME = np.array([0, -1, 1.2, -0.4, 0.5, 0])
AWAY = np.array([0.3, 0.2, -0.2, 0.1, 0.2, 0.3])
LINED, PROCESS = 1000, 4901
"""Numbers of samples: `LINED` for the straight tool path of ur5e, `PROCESS` for the motion of
well_manipulator."""


def run(samples: int) -> int:
    """Print times of chasles and other libraries, and the memory of the process."""
    table = Table(title=f"Studies, two cores where there are two; {samples:,} configurations")
    for name in ("study", "seconds", "ns a configuration", "a peer's ns", "ratio"):
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
    cells = Grid.from_bounds(np.full(3, -1.0), np.full(3, 1.0), SIDE)
    count = cells.count * ORIENTATIONS
    own = _seconds(lambda: reach(arm, cells, uniform_orientations(ORIENTATIONS))) / count
    _row(table, "reach of ur5e: Robotics Toolbox ik_LM, one solution", own, count, _asked())
    _motions(table, arm)
    _plans(table, arm)
    out.print(table)
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    out.print(f"memory of the process at most: {most:.0f} MB")
    return 0


def _motions(table: Table, arm: chasles.Robot) -> None:
    """Measure the time for joint rates, time-optimal scaling and a motion sequence."""
    path = line(arm.fk(HOME), arm.fk(HOME + AWAY))
    motion = Motion(arm, path, time_scaling("quintic", path.length, duration=1), HOME)
    motion.sample(LINED)
    own = _seconds(lambda: motion.sample(LINED)) / LINED
    _row(table, "line of ur5e: Robotics Toolbox ctraj, ik_LM, no rates", own, LINED, _lined())
    own = _seconds(lambda: time_optimal(motion, rate_limits=2.0, acceleration_limits=8.0))
    _row(table, "its time-optimal scaling, 400 nodes", own, 1)
    well = chasles.load("well_manipulator")
    process(well)
    own = _seconds(lambda: process(well).sample(100)) / PROCESS
    _row(table, "49 s of well_manipulator", own, PROCESS)


def process(robot: chasles.Robot) -> MotionSequence:
    """Return the motion sequence in section 5 of the well manipulator paper."""
    initial = np.radians([0, 88.79, -49.2, 0, -86.76, 0, -40.62])
    turned = initial + np.radians([30, 0, 0, 0, 0, 0, 0])
    ready = np.array([[0, 1, 0, 1.237], [0, 0, -1, 0], [-1, 0, 0, 1.02], [0, 0, 0, 1]])
    middle, low = ready.copy(), ready.copy()
    middle[2, 3], low[2, 3] = 1.02 - 2.166, 1.02 - 4.332
    rest = ("theta1", "l_HI", "l_MN")
    near = robot.actuators(np.radians([0, 88.79, -11.3, 0, -129.8, 0, -35.6]))
    at_25 = robot.chain(robot.ik_numeric(ready, near, fixed=("theta2", *rest)).q)
    return (
        MotionSequence(robot, robot.actuators(initial))
        .move(turned, "constant", space="chain", duration=5)
        .pause(5)
        .move(initial, "constant", space="chain", duration=5)
        .move(at_25, "constant", space="chain", duration=10)
        .pause(2)
        .follow(line(ready, middle), "constant", fixed=("theta2", *rest), duration=10)
        .pause(2)
        .follow(line(middle, low), "constant", fixed=rest, redundancy="minimum_norm", duration=10)
    )


def _lined() -> float:
    """Return the time [s] of the Robotics Toolbox per pose on a straight tool path."""
    model = rtb.models.DH.UR5()
    poses = rtb.ctraj(model.fkine(HOME), model.fkine(HOME + AWAY), LINED)

    def work() -> None:
        q = HOME
        for T in poses:
            q = model.ik_LM(T.A, q0=q)[0]

    return _seconds(work) / LINED


def _plans(table: Table, arm: chasles.Robot) -> None:
    """Measure the time to plan paths among obstacles, and the time to compute distances."""
    floor = np.eye(4)
    floor[2, 3] = -0.2
    space = configuration_space(
        arm, [sphere([0.4, 0.3, 0.5], 0.1), box(floor, [2, 2, 0.1])], radius=0.05
    )
    drawn = np.random.default_rng(2).uniform(-np.pi, np.pi, (400, arm.n))
    free = drawn[space.is_free(drawn)][:20]
    own = _seconds(lambda: [space.distances(q) for q in free]) / len(free)
    _row(table, "distances of ur5e among obstacles", own, len(free))
    pairs = list(zip(free[::2], free[1::2], strict=True))
    made = prm(space, 150, rng=1)
    own = _seconds(lambda: [made.plan(a, b) for a, b in pairs]) / len(pairs)
    _row(table, "plans of ur5e, roadmap of 150 samples", own, len(pairs))


def _warm() -> None:
    for name in ("ur5e", "excavator", "well_manipulator"):
        workspace(chasles.load(name), 1000)


def _seconds(work: Callable[[], object]) -> float:
    begin = time.perf_counter()
    work()
    return time.perf_counter() - begin


def _row(table: Table, name: str, own: float, count: int, peer: float | None = None) -> None:
    peer_cells = ("", "") if peer is None else (f"{peer * 1e9:,.0f}", f"{peer / own:.0f}")
    table.add_row(name, f"{own * count:.2f}", f"{own * 1e9:.0f}", *peer_cells)


def _forward_peers() -> list[Call]:
    arm = next(arm for arm in ARMS if arm.name == "ur5e")
    return [pinocchio.calls(arm)[0], toolbox.calls(arm)[0]]


def _looped(robot: chasles.Robot, call: Call) -> float:
    """Return the time per configuration [s] of a loop that calls another library's fk."""
    configurations = np.random.default_rng(0).uniform(robot.lower, robot.upper, (LOOPED, robot.n))
    cells = Grid.from_bounds(np.full(3, -1.2), np.full(3, 1.2), 100)
    hits = np.zeros(cells.shape, dtype=np.uint32)

    def work() -> None:
        for q in configurations:
            T = call.read(call.fk(q))[0]
            cell = ((T[:3, 3] - cells.lower) / cells.side).astype(int)
            hits[tuple(cell)] += 1

    return _seconds(work) / LOOPED


def _asked() -> float:
    """Return the time per reachable pose of the Robotics Toolbox's IK function [s]."""
    model = rtb.models.DH.UR5()
    configurations = np.random.default_rng(1).uniform(-3, 3, (ASKED, 6))
    poses = [model.fkine(q).A for q in configurations]
    return _seconds(lambda: [model.ik_LM(T) for T in poses]) / ASKED
