"""Copies of the robot board_installer with geometric errors.

Random errors change every length of the robot's pantograph and parallelograms.

The loops of each copy must close, and ``ik`` must recover every configuration.
"""

import tempfile
from dataclasses import dataclass

import numpy as np

import chasles
from chasles.derive import read, write
from tests.support.derivations import ROBOTS
from tests.support.generators.as_built import BOARD_INSTALLER, as_built

from ..bars import barred
from ..campaign import Outcome

FUNCTIONS = ("fk", "fk_jacobian_mixed", "configuration", "constraint", "margin", "ik")
ERROR = 5e-4
"""Maximum length error (meter)."""
POSES = 2000
FOUND = 1e-6
"""Maximum joint difference (radian, meter) at which two solutions count as equal."""
NEAR = 0.02
"""Maximum tool pose difference (meter, rotation matrix entries) up to which the nominal robot and
its copy with errors count as being on the same branch."""
SAME_CONFIGURATION = 0.25
"""Maximum joint difference (radian, meter) at which solutions of the nominal robot and of its copy
count as the same configuration."""
MAX_STEPS = 60
C_ALONE = ("c", "python")
BARS = {"closure": 1e-12, "lost": 0, "fewer": 0}


@dataclass(frozen=True)
class Judged:
    """Error measures of one robot.

    Attributes:
        closure: The largest closure error of the loops (meter).
        lost: Number of configurations that ``ik`` does not recover.
        fewer: Number of solutions of the robot with errors that ``ik`` misses and Newton's method
            finds. Newton's method starts only from nominal solutions at which the tool poses of
            both robots nearly agree.
    """

    closure: float
    lost: int
    fewer: int


def trial(number: int) -> Outcome:
    return barred("board installers", judged(number), BARS)


def judged(number: int) -> Judged:
    rng = np.random.default_rng(number)
    design = read(ROBOTS / "board_installer.toml")
    built = as_built(design, BOARD_INSTALLER, ERROR, rng)
    with tempfile.TemporaryDirectory() as folder:
        write(built, folder, functions=FUNCTIONS, languages=C_ALONE)
        robot, nominal = chasles.load(folder), chasles.load(design.name)
        q = rng.uniform(robot.lower, robot.upper, (POSES, robot.n))
        q = q[robot.loops_close(q)]
        T = robot.fk(q)
        found = robot.ik(T)
        closure = float(np.abs(robot.constraint(robot.configuration(q))).max())
        lost = ~(found.valid & (_apart(found.q - q[:, None]) < FOUND)).any(-1)
        return Judged(closure, int(lost.sum()), _fewer(robot, nominal, T, found))


def _apart(difference: np.ndarray) -> np.ndarray:
    return np.asarray(np.abs(np.remainder(difference + np.pi, 2 * np.pi) - np.pi).max(-1))


def _fewer(
    robot: chasles.Robot, nominal: chasles.Robot, T: np.ndarray, found: chasles.Solutions
) -> int:
    """Count solutions that ``ik`` misses and Newton's method finds from nominal solutions."""
    start = nominal.ik(T)
    of, slot = np.nonzero(start.valid)
    q = start.q[of, slot]
    apart = np.abs(robot.fk(q) - nominal.fk(q)).max((1, 2))
    on_branch = np.nan_to_num(apart, nan=np.inf) < NEAR
    apart = _apart(found.q[of] - q[:, None])
    is_found = (found.valid[of] & (apart < SAME_CONFIGURATION)).any(-1)
    missing = np.flatnonzero(on_branch & ~is_found)
    return sum(_leads_to(robot, q[k], T[of[k]]) for k in missing)


def _leads_to(robot: chasles.Robot, q: np.ndarray, T: np.ndarray) -> bool:
    """Test whether a damped Newton iteration converges from coordinates q to a tool pose.

    If the robot cannot reach the pose, the Newton iteration ends at a minimum of the pose error.
    """
    error, J = _error(robot, q, T)
    for _ in range(MAX_STEPS):
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
    """Return the tool's pose error (meter, sine of the angle) and the Jacobian.

    If the loops cannot close, the returned pose error is infinite.
    """
    (here,), (J,) = robot.fk_jacobian_mixed(q[None])
    if not (np.isfinite(here).all() and np.isfinite(J).all()):
        return np.full(6, np.inf), J
    turn = T[:3, :3] @ here[:3, :3].T
    angular = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    return np.concatenate([T[:3, 3] - here[:3, 3], angular / 2]), J
