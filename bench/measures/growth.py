"""Cost of fk per joint for longer chains, which may not fit into a cache."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import sympy as sp

import chasles
from chasles.derive import Joint, SerialRobot, write
from chasles.derive.description.conventions import dh

from ..cores import one_core
from ..native.library import aligned
from ..peers.forward.own import generated_loop
from ..report import Plan, Ratio, alternated, ratio, table

CHAINS = (6, 12, 24, 48)
POSES = 20_000
BAR = 1 / 1.2
"""The cost per joint of a chain may be at most 1.2 times the cost per joint of the shortest
chain."""


def run(plan: Plan) -> list[Ratio]:
    """Compare the time of fk per joint between long chains and the shortest chain."""
    works: dict[str, dict] = {"scalar": {}, "batch": {}}
    with _folder() as folder:
        for joints in CHAINS:
            robot = twisted(joints)
            write(robot, folder / robot.name, functions=("fk",))
            scalar, batch = _works(folder / robot.name, robot.name, joints)
            works["scalar"][str(joints)], works["batch"][str(joints)] = scalar, batch
        with one_core():
            times = {kind: alternated(of, plan.rounds) for kind, of in works.items()}
    found = [row for kind, of in times.items() for row in _rows(kind, of)]
    columns = ("fk of a chain", *(f"{joints} joints" for joints in CHAINS))
    cells = [(kind, *_per_joint(of)) for kind, of in times.items()]
    table("Growth: ns a joint", columns, cells)
    return found


def twisted(joints: int) -> SerialRobot:
    """Return a chain of revolute joints with lengths, offsets and twist angles of 90 degrees."""
    length, offset, zero = sp.Rational(1, 3), sp.Rational(1, 5), sp.Integer(0)
    rows = [
        dh("revolute", a=length, alpha=sp.pi / 2 * (-1) ** k, d=offset, theta=zero)
        for k in range(joints)
    ]
    built = [Joint(f"j{k}", "revolute", before, after) for k, (before, after) in enumerate(rows)]
    return SerialRobot(f"twisted{joints}", tuple(built))


@contextmanager
def _folder() -> Iterator[Path]:
    """Yield a temporary folder for derived chains, with its own cache of compiled code."""
    before = os.environ.get("CHASLES_CACHE")
    with tempfile.TemporaryDirectory() as folder:
        os.environ["CHASLES_CACHE"] = f"{folder}/cache"
        try:
            yield Path(folder)
        finally:
            os.environ.pop("CHASLES_CACHE")
            if before is not None:
                os.environ["CHASLES_CACHE"] = before


def _works(folder: Path, name: str, joints: int):
    q = np.random.default_rng(0).uniform(-np.pi, np.pi, (POSES, joints))
    T, one = np.zeros((POSES, 4, 4)), aligned(1, 4, 4)
    loop = generated_loop(folder, name, joints, pair=False)
    function = chasles.load(folder).fk
    return (lambda: loop.fk(q, one)), (lambda: function(q, out=T))


def _rows(kind: str, times: dict[str, list[float]]) -> list[Ratio]:
    joint = {n: [seconds / int(n) for seconds in of] for n, of in times.items()}
    first, *longer = joint
    return [
        ratio(f"{kind} fk, a joint of {n}: of {first}", joint, (n, first), POSES, BAR)
        for n in longer
    ]


def _per_joint(times: dict[str, list[float]]) -> list[float]:
    return [min(of) / POSES / int(joints) * 1e9 for joints, of in times.items()]
