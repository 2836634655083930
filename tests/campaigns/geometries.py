"""``python -m bench geometries``: arms without a structure, of every pattern of neighbouring axes.

Neighbouring axes are skew, parallel or meet: 243 patterns of six joints, the same where one of them
slides (--slides), and longer arms of which some may slide (--longs). The solver is
compiled once and takes the tables of each arm, so that an arm takes a fraction of a second.
Configurations at random and at right angles have to be among the solutions of their poses, except
where the Jacobian is singular.
"""

import ctypes
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np

from bench.native.library import UNPACKED, Source, compiled
from bench.report import out, paced
from chasles.derive import Robot
from chasles.derive.emit.c.header import support
from chasles.derive.emit.c.written import SUPPORTS
from chasles.derive.inverse.classify import classify
from chasles.derive.inverse.general.general_inverse import general_inverse
from chasles.derive.inverse.general.raghavan_roth import JOINTS
from chasles.derive.inverse.general.split_choice import slides_of
from chasles.derive.terms.terms import Terms
from tests.campaigns.general import apart, configurations
from tests.support.generators.random_arms import LINKS, long_arm, random_arm, sliding_arm

SHIM = Path(__file__).parents[1] / "native" / "any_arm.c"
SLOTS = 16
SAME, REACHED, REGULAR = 1e-6, 1e-8, 1e-5
"""Radians (or metres) by which a configuration is found, residual (metre or radian) of a solution,
and least singular value of a configuration that has to be found."""


class Split(ctypes.Structure):
    """``chasles_general_split`` in C."""

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
        ("splits", ctypes.c_int),
        ("split", Split * 4),
    )


@dataclass(frozen=True)
class Found:
    """How many poses of a set have no solution, and how many regular configurations are lost."""

    none: int
    lost: int

    def __bool__(self) -> bool:
        return self.none + self.lost > 0


def arms(first: int, seeds: int, slides: int, longs: int) -> Iterator[tuple[str, Robot]]:
    """The arms and their names: all patterns of six joints for each seed, and longer arms."""
    patterns = list(map("".join, product(LINKS, repeat=5)))
    for seed in range(first, first + seeds):
        for links in patterns:
            yield f"{links} of seed {seed}", random_arm(seed, f"{links}/")
    for seed in range(first, first + slides):
        for k, links in enumerate(patterns):
            place = (seed + k) % JOINTS
            name = f"{links} of seed {seed}, joint {place + 1} slides"
            yield name, random_arm(seed, f"{links}/", {place})
    for seed in range(first, first + longs):
        yield f"long arm {seed}", long_arm(seed)
        yield f"sliding arm {seed}", sliding_arm(seed)


@cache
def library() -> ctypes.CDLL:
    """The solver, for the tables of any arm."""
    files = {name: support(name) for name in ("chasles_cos_sin.h", *SUPPORTS["general"])}
    flags = ("-std=gnu99", "-O2", "-fvisibility=default", UNPACKED)
    text = SHIM.read_text(encoding="utf-8")
    source = Source("any_arm", {"any_arm.c": text, **files}, flags)
    return ctypes.CDLL(str(compiled(source)))


def judged(robot: Robot, count: int) -> tuple[Found, Found] | None:
    """An arm at random configurations and at a third as many right angles.

    None for arms with a structure, which are solved otherwise, and arms that never have full rank.
    """
    lines = classify(robot, Terms({p.symbol: p.value for p in robot.parameters}))
    general = general_inverse(robot) if lines.found is None else None
    if general is None:
        return None
    library().take(ctypes.byref(_told(general.function.tables)))
    q, right = configurations(robot, count, count // 3, seed=5)
    given, slides = general.choice.given, slides_of(robot)
    return _found(q, given, slides), _found(right, given, slides)


def _told(tables: tuple) -> Arm:
    """The tables of an arm in C's structure."""
    joints, kinds, directions, length, placed, splits, each = tables
    arm = Arm(joints=joints, length=length, splits=splits)
    arm.kind[:] = kinds
    arm.direction[: len(directions)] = directions
    for row, values in zip(arm.placed, placed, strict=True):
        row[:] = values
    for split, (order, sense, halved) in zip(arm.split, each, strict=False):
        split.joint[:], split.sense, split.halved = order, sense, halved
    return arm


def _found(q: np.ndarray, given: tuple[int, ...], slides: Collection[int]) -> Found:
    """What the solver finds of the poses of configurations (m, n)."""
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


def run(first: int, seeds: int, slides: int, longs: int, poses: int) -> int:
    """Prints the arms that lose poses, and the totals; returns 1 where there is one."""
    cases = list(arms(first, seeds, slides, longs))
    found = paced((_line(name, robot, poses) for name, robot in cases), len(cases), _so_far)
    out.print(f"{len(cases)} arms: {_so_far(found)}")
    return int(any(found))


def _line(name: str, robot: Robot, poses: int) -> bool | None:
    """Whether an arm loses poses, which is printed; None where it is skipped."""
    found = judged(robot, poses)
    if found is None:
        return None
    for kind, own in zip(("random", "right angles"), found, strict=True):
        if own:
            out.print(f"{name}, {kind}: {own.none} without a solution, {own.lost} lost")
    return any(found)


def _so_far(found: list[bool | None]) -> str:
    """The counts."""
    losing, skipped = sum(own is True for own in found), sum(own is None for own in found)
    return f"{losing} lose poses, {len(found) - skipped - losing} lose none, {skipped} skipped"
