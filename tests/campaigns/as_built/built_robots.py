"""``python -m bench as_built``: the board installer with lengths as built, derived and judged.

Every length of its pantograph and its parallelograms is off by a random amount. A draw is judged by
the time of its derivation, the residual of its loops, its inverse beside the nominal robot's, and
the time of a pose.
"""

import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import chasles
from bench.report import out
from chasles.derive import Mechanism, derive, load, write
from chasles.derive.emit.languages import EMITTERS
from tests.campaigns.as_built.draws import judged_draws
from tests.support.generators.as_built import BOARD_INSTALLER, as_built

ROBOT = Path(__file__).parents[2] / "derive" / "robots" / "board_installer.toml"
FUNCTIONS = ("fk", "fk_jacobian_mixed", "configuration", "constraint", "margin", "ik")
ERROR = 5e-4
"""Metre; half a millimetre."""
POSES = 2000
FOUND = 1e-6
"""Radian and metre: joints of one solution."""
NEAR = 0.02
"""Metre and entries of rotations: how far the tools of both robots are apart on one branch."""
SAME_POSTURE = 0.25
"""Radian and metre: how far the joints of both robots are apart in one posture."""
MOST_STEPS = 60
C_ALONE = ("c", "python")
BARS = {"derived": 5.0, "closure": 1e-12, "lost": 0, "fewer": 0, "fk": 5.0, "ik": 5.0}


@dataclass(frozen=True)
class Judged:
    """A draw.

    Attributes:
        derived: CPU time of the derivation (second).
        closure: The largest residual of its loops (metre).
        lost: Configurations that ``ik`` of their pose does not return.
        fewer: Solutions of the nominal robot, on the branch of the true loops, from which another
            iteration finds a true solution and ``ik`` does not.
        fk: Time of a pose (microsecond).
        ik: The same of the inverse.
    """

    derived: float
    closure: float
    lost: int
    fewer: int
    fk: float
    ik: float


def judged(design: Mechanism, number: int, poses: int = POSES) -> Judged:
    """Derives and judges a draw.

    Args:
        design: The robot as designed.
        number: The number of the draw, its seed.
        poses: Number of poses.
    """
    built = as_built(design, BOARD_INSTALLER, ERROR, np.random.default_rng(number))
    start = time.process_time()
    derive(built)
    derived = time.process_time() - start
    with tempfile.TemporaryDirectory() as folder:
        write(built, folder, FUNCTIONS, [e for e in EMITTERS if e.language in C_ALONE])
        robot, nominal = chasles.load(folder), chasles.load(design.name)
        rng = np.random.default_rng(number)
        q = rng.uniform(robot.lower, robot.upper, (poses, robot.n))
        q = q[robot.valid(q)]
        T = robot.fk(q)
        found = robot.ik(T)
        closure = float(np.abs(robot.constraint(robot.configuration(q))).max())
        lost = ~(found.valid & (_apart(found.q - q[:, None]) < FOUND)).any(-1)
        return Judged(
            derived,
            closure,
            int(lost.sum()),
            _fewer(robot, nominal, T, found),
            _microseconds(lambda: robot.fk(q), len(q)),
            _microseconds(lambda: robot.ik(T), len(q)),
        )


def _apart(difference: np.ndarray) -> np.ndarray:
    """The largest difference of joints, turns apart."""
    return np.asarray(np.abs(np.remainder(difference + np.pi, 2 * np.pi) - np.pi).max(-1))


def _fewer(
    robot: chasles.Robot, nominal: chasles.Robot, T: np.ndarray, found: chasles.Solutions
) -> int:
    """True solutions that are missing beside nominal ones on the branch of the true loops."""
    start = nominal.ik(T)
    of, slot = np.nonzero(start.valid)
    q = start.q[of, slot]
    apart = np.abs(robot.fk(q) - nominal.fk(q)).max((1, 2))
    on_branch = np.nan_to_num(apart, nan=np.inf) < NEAR
    apart = _apart(found.q[of] - q[:, None])
    beside = (found.valid[of] & (apart < SAME_POSTURE)).any(-1)
    missing = np.flatnonzero(on_branch & ~beside)
    return sum(_leads_to(robot, q[k], T[of[k]]) for k in missing)


def _leads_to(robot: chasles.Robot, q: np.ndarray, T: np.ndarray) -> bool:
    """Whether Newton's iteration with halved steps leads from q to a pose of the true robot.

    It ends at a least error where the true robot does not quite reach a pose of the nominal one.
    """
    error, J = _error(robot, q, T)
    for _ in range(MOST_STEPS):
        step = np.linalg.pinv(J) @ error
        for part in 0.5 ** np.arange(20):
            after = _error(robot, q + part * step, T)
            if np.linalg.norm(after[0]) < np.linalg.norm(error):
                break
        else:
            break
        q, (error, J) = q + part * step, after
    return bool(np.linalg.norm(error) < FOUND**1.5)


def _error(robot: chasles.Robot, q: np.ndarray, T: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The twist (metre, sine) from the tool to a pose, infinite out of reach; the Jacobian."""
    (here,), (J,) = robot.fk_jacobian_mixed(q[None])
    if not (np.isfinite(here).all() and np.isfinite(J).all()):
        return np.full(6, np.inf), J
    turn = T[:3, :3] @ here[:3, :3].T
    angular = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    return np.concatenate([T[:3, 3] - here[:3, 3], angular / 2]), J


def _microseconds(work, count: int) -> float:
    """The least of some times a pose, after a first call."""
    taken = []
    for _ in range(5):
        start = time.process_time()
        work()
        taken.append(time.process_time() - start)
    return min(taken[1:]) / count * 1e6


def run(draws: int, first: int) -> int:
    """Judges draws and prints them; returns the exit status, 0 where all bars hold."""
    design = load(ROBOT)
    out.print(f"{draws} draws of the board installer, lengths off by up to {ERROR * 1e3} mm:")
    numbers = range(first, first + draws)
    _, missed = judged_draws(lambda number: judged(design, number), numbers, BARS)
    out.print(f"{missed} draws miss a bar")
    return int(missed > 0)
