"""Random tests of the general inverse solver on arms with every pattern of consecutive axes.

Consecutive axes are skew, parallel or intersecting, which gives 243 patterns of six joints. Each
trial tests arms with 27 of the 243 axis patterns, once with six revolute joints and once with a
prismatic joint. The general solver is compiled only once, and reads the numerical tables of each
arm. Each pose must have a solution, and every nonsingular configuration must be among the
solutions.
"""

import ctypes
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np

from chasles.derive import SerialRobot
from chasles.derive.emit.c.header import support
from chasles.derive.emit.c.written import SUPPORTS
from chasles.derive.inverse.classify import classify
from chasles.derive.inverse.general.elimination_choice import Choice, slides_of
from chasles.derive.inverse.general.general_inverse import GeneralArm, general_inverse
from chasles.derive.inverse.general.raghavan_roth import JOINTS
from chasles.derive.terms.terms import Terms
from tests.support.generators.random_arms import LINKS, long_arm, random_arm, sliding_arm
from tests.support.native import UNPACKED, Source, compiled

from .campaign import Campaign, Outcome
from .general import apart, configurations

SHIM = Path(__file__).parents[1] / "support" / "native" / "any_arm.c"
PATTERNS = tuple(map("".join, product(LINKS, repeat=5)))
STRIDE = 9
POSES = 1000
"""Number of random configurations per arm. Each arm is also tested at a third as many
configurations with multiples of 90 degrees."""
SLOTS = 16
SAME, REACHED, REGULAR = 1e-6, 1e-8, 1e-5
"""Maximum joint error (radian or meter) of a recovered configuration. Maximum residual (meter or
radian) of a solution. Minimum singular value of a regular configuration."""


class EliminationOrder(ctypes.Structure):
    """``chasles_general_order`` in C."""

    _fields_ = (
        ("joint", ctypes.c_int * 6),
        ("sense", ctypes.c_int),
        ("halved", ctypes.c_int),
    )


class Arm(ctypes.Structure):
    """``chasles_general_arm`` in C."""

    _fields_ = (
        ("pose_jacobian", ctypes.c_void_p),
        ("joints", ctypes.c_int),
        ("kind", ctypes.c_int * 12),
        ("direction", ctypes.c_double * 12),
        ("length", ctypes.c_double),
        ("placed", (ctypes.c_double * 12) * 13),
        ("orders", ctypes.c_int),
        ("order", EliminationOrder * 4),
    )


@dataclass(frozen=True)
class Found:
    """Numbers of unsolved poses and of missing regular configurations."""

    none: int
    lost: int

    def __bool__(self) -> bool:
        return self.none + self.lost > 0


def arms(number: int) -> Iterator[tuple[str, SerialRobot]]:
    """Yield the name and the description of each arm of a trial."""
    for k, links in enumerate(PATTERNS[number % STRIDE :: STRIDE]):
        yield links, random_arm(number, f"{links}/")
        place = (number // STRIDE + k) % JOINTS
        yield f"{links}, joint {place + 1} slides", random_arm(number, f"{links}/", {place})
    yield "long arm", long_arm(number)
    yield "sliding arm", sliding_arm(number)


@cache
def library() -> ctypes.CDLL:
    files = {name: support(name) for name in ("chasles_cos_sin.h", *SUPPORTS["general"])}
    flags = ("-std=gnu99", "-O2", "-fvisibility=default", UNPACKED)
    text = SHIM.read_text(encoding="utf-8")
    source = Source("any_arm", {"any_arm.c": text, **files}, flags)
    return ctypes.CDLL(str(compiled(source)))


def judged(robot: SerialRobot, count: int, seed: int = 5) -> tuple[Found, Found] | None:
    """Test an arm at random configurations and at multiples of 90 degrees.

    Returns None if the arm is singular or belongs to a closed-form family.
    """
    q, right = configurations(robot, count, count // 3, np.random.default_rng(seed))
    found = judged_at(robot, q), judged_at(robot, right)
    return None if None in found else found


def judged_at(robot: SerialRobot, q: np.ndarray) -> Found | None:
    """Test an arm at configurations (m, n), or return None if the general solver does not
    apply."""
    choice = _taken(robot)
    return None if choice is None else _found(q, choice.given, slides_of(robot))


def _taken(robot: SerialRobot) -> Choice | None:
    lines = classify(robot, Terms({p.symbol: p.value for p in robot.parameters}))
    general = general_inverse(robot) if lines.found is None else None
    if general is None:
        return None
    library().take(ctypes.byref(_arm_of(general.function.tables)))
    return general.choice


def _arm_of(tables: GeneralArm) -> Arm:
    arm = Arm(joints=tables.joints, length=tables.length, orders=tables.order_count)
    arm.kind[:] = tables.kinds
    arm.direction[: len(tables.directions)] = tables.directions
    for row, values in zip(arm.placed, tables.placed, strict=True):
        row[:] = values
    for order, (joints, sense, halved) in zip(arm.order, tables.orders, strict=False):
        order.joint[:], order.sense, order.halved = joints, sense, halved
    return arm


def _found(q: np.ndarray, given: tuple[int, ...], slides: Collection[int]) -> Found:
    """Solve the inverse kinematics for the tool poses at configurations (m, n).

    Counts unsolved poses, and nonsingular configurations that are not among the solutions.
    """
    m, n = q.shape
    slots, residual = np.empty((m, SLOTS, n)), np.empty((m, SLOTS))
    library().solve(m, *map(_pointer, (np.ascontiguousarray(q), slots, residual)))
    solved = residual < REACHED
    missing = q[~(solved & (apart(slots, q[:, None], slides) < SAME)).any(-1)]
    free = [k for k in range(n) if k not in given]
    lost = sum(bool(np.linalg.svd(_jacobian(row)[:, free])[1][-1] > REGULAR) for row in missing)
    return Found(int((~solved.any(-1)).sum()), lost)


def _jacobian(q: np.ndarray) -> np.ndarray:
    J = np.empty((6, len(q)))
    library().jacobian(_pointer(np.ascontiguousarray(q)), _pointer(J))
    return J


def _pointer(array: np.ndarray) -> ctypes.c_void_p:
    return array.ctypes.data_as(ctypes.c_void_p)


def trial(number: int) -> Outcome:
    found = {name: judged(robot, POSES, number) for name, robot in arms(number)}
    failures = [
        f"{name}, {kind}: {own.none} without a solution, {own.lost} lost"
        for name, both in found.items()
        for kind, own in zip(("random", "right angles"), both or (), strict=False)
        if own
    ]
    skipped = sum(both is None for both in found.values())
    return Outcome({"arms": len(found) - skipped, "arms skipped": skipped}, tuple(failures))


CAMPAIGN = Campaign(
    "geometries",
    "The general solver misses no configuration, for any pattern of axes.",
    trial,
)
