"""Time from a description to equations, C and LaTeX."""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import casadi as ca
import sympy as sp

from chasles.derive import Joint, Rotation, SerialRobot, derive, files, read
from chasles.derive.build import ROBOTS
from chasles.derive.description.conventions import dh
from chasles.derive.program.counting import count_operations
from chasles.derive.program.reading import programs
from chasles.derive.terms.casadi_graph import lower

from ..report import Plan, alternated, seconds, table

ROUNDS = 3
LIMITS = {"ur5e": 3.0, "panda": 5.0, "all robots": 40.0, "nothing to do": 1.0, "64 joints": 8.0}


def run(plan: Plan) -> dict[str, object]:
    """Print all measurements, and return them for a result file."""
    rounds = min(plan.rounds, ROUNDS)
    times = {**whole_robots(rounds), **together(plan.robots)}
    growth = {k: [chain(k, joints) for joints in plan.chains] for k in ("planar", "spatial")}
    times[f"{plan.chains[-1]} joints"] = max(rows[-1]["seconds"] for rows in growth.values())
    table(
        "From description to C and LaTeX, two cores",
        ("what", "seconds", "bar"),
        [(name, value, LIMITS.get(name, "")) for name, value in times.items()],
    )
    table(
        "Chains of revolute joints: fk and jacobian_mixed",
        ("chain", "joints", "seconds", "C bytes", "per joint^2", "fk ops", "Jacobian ops"),
        [
            (
                kind,
                row["joints"],
                row["seconds"],
                row["bytes"],
                row["bytes"] / row["joints"] ** 2,
                *row["operations"],
            )
            for kind, rows in growth.items()
            for row in rows
        ],
    )
    sizes = operations(rounds)
    return {"seconds": times, "bars": LIMITS, "growth": growth, "operations": sizes}


def whole_robots(rounds: int) -> dict[str, float]:
    """Measure the time to derive, generate and write all functions of each robot.

    Each measurement runs in a separate process.
    """
    code = (
        "import sys, time; start = time.perf_counter()\n"
        "from chasles.derive import read, write\n"
        "write(read(sys.argv[1]), sys.argv[2])\n"
        "print(time.perf_counter() - start)"
    )
    found = {}
    for name in ("ur5e", "panda"):
        runs = []
        for _ in range(rounds):
            with tempfile.TemporaryDirectory() as folder:
                command = [sys.executable, "-c", code, str(ROBOTS / f"{name}.toml"), folder]
                done = subprocess.run(command, check=True, capture_output=True, text=True)
                runs.append(float(done.stdout))
        found[name] = max(runs)
    return found


def together(robots: tuple[str, ...]) -> dict[str, float]:
    """Measure the time of ``make derive`` for missing files and for up-to-date files."""
    with tempfile.TemporaryDirectory() as folder:
        environment = {"CHASLES_CACHE": f"{folder}/cache"}
        first = seconds(lambda: _make(robots, folder, environment))
        second = seconds(lambda: _make(robots, folder, environment))
    name = f"{len(robots)} robots" if robots else "all robots"
    return {name: first, "nothing to do": second}


def _make(robots: tuple[str, ...], folder: str, environment: dict[str, str]) -> None:
    chosen = robots or sorted(str(file) for file in ROBOTS.glob("*.toml"))
    command = [sys.executable, "-m", "chasles", "derive"]
    derive_all = [*command, *chosen, "--to", f"{folder}/generated"]
    subprocess.run(derive_all, check=True, capture_output=True)
    folders = [str(path.parent) for path in Path(folder).glob("generated/*/manifest.json")]
    build = [sys.executable, "-m", "chasles", "build", *sorted(folders)]
    subprocess.run(build, check=True, capture_output=True, env={**os.environ, **environment})


def chain(kind: str, joints: int) -> dict[str, object]:
    """Measure derivation time and file sizes for a chain of revolute joints."""
    robot = _chain(kind, joints)
    made: dict[str, bytes] = {}
    taken = seconds(lambda: made.update(files(robot, functions=("fk", "jacobian_mixed"))))
    functions = json.loads(made["manifest.json"])["functions"]
    return {
        "joints": joints,
        "seconds": taken,
        "bytes": len(made[f"{robot.name}.c"]),
        "operations": [function["operations"]["total"] for function in functions],
    }


def _chain(kind: str, joints: int) -> SerialRobot:
    zero, third, fifth = sp.Integer(0), sp.Rational(1, 3), sp.Rational(1, 5)
    tilts = (zero,) if kind == "planar" else (sp.pi / 2, -sp.pi / 2, third)
    offset = zero if kind == "planar" else fifth
    rows = [
        dh("revolute", a=third, alpha=tilts[k % len(tilts)], d=offset, theta=zero)
        for k in range(joints)
    ]
    built = [Joint(f"j{k}", "revolute", before, after) for k, (before, after) in enumerate(rows)]
    return SerialRobot(f"{kind}{joints}", tuple(built))


def operations(rounds: int) -> dict[str, dict[str, int]]:
    """Count FK operations in chasles, a CasADi matrix product and SymPy with cse."""
    sizes = {}
    rows = []
    for name in ("ur5e", "puma560", "panda", "iiwa14"):
        robot = read(ROBOTS / f"{name}.toml")
        works: dict[str, Callable[[], int]] = {
            "chasles": lambda robot=robot: _own(robot),
            "CasADi": lambda robot=robot: _casadi_product(robot),
            "SymPy": lambda robot=robot: _sympy_product(robot),
        }
        sizes[name] = {peer: work() for peer, work in works.items()}
        times = alternated(works, rounds)
        rows.append((name, *sizes[name].values(), *(min(times[peer]) * 1e3 for peer in works)))
    columns = ("robot", *(f"{p} ops" for p in works), *(f"{p} ms" for p in works))
    table("Forward kinematics: operations, and time to derive and lower them", columns, rows)
    return sizes


def _own(robot: SerialRobot) -> int:
    (program,) = programs(lower(derive(robot, functions=("fk",)).functions, robot.name))
    return count_operations(program).total


def _placements(robot: SerialRobot):
    values = {parameter.symbol: parameter.value for parameter in robot.parameters}
    q = sp.symbols(f"q1:{len(robot.coordinates) + 1}", real=True)
    motions = list(robot.base)
    joints = iter(robot.joint_values(q))
    for joint in robot.joints:
        motions += [*joint.before]
        if joint.kind != "fixed":
            motions.append(Rotation("z", next(joints)))
        motions += [*joint.after]
    return q, values, [*motions, *robot.tool]


def _casadi_product(robot: SerialRobot) -> int:
    q, values, motions = _placements(robot)
    symbols = ca.SX.sym("q", len(q))
    T = ca.SX.eye(4)
    for motion in motions:
        T = T @ _casadi_motion(motion, values, dict(zip(q, range(len(q)), strict=True)), symbols)
    function = ca.Function("fk", [symbols], [ca.cse(ca.densify(T))])
    return count_operations(programs([function])[0]).total


def _casadi_motion(motion, values, index, symbols):
    T = ca.SX.eye(4)
    if hasattr(motion, "vector"):
        T[:3, 3] = [float(component.xreplace(values)) for component in motion.vector]
        return T
    angle = symbols[index[motion.angle]] if motion.angle in index else float(motion.angle)
    j, k = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[motion.axis]
    T[j, j], T[j, k], T[k, j], T[k, k] = ca.cos(angle), -ca.sin(angle), ca.sin(angle), ca.cos(angle)
    return T


def _sympy_product(robot: SerialRobot) -> int:
    _, values, motions = _placements(robot)
    T = sp.eye(4)
    for motion in motions:
        T = T * _sympy_motion(motion)
    terms, (matrix,) = sp.cse([T.xreplace(values)], order="canonical")
    return sum(_count(expression) for _, expression in terms) + sum(map(_count, matrix))


def _sympy_motion(motion) -> sp.Matrix:
    T = sp.eye(4)
    if hasattr(motion, "vector"):
        T[:3, 3] = sp.Matrix(motion.vector)
        return T
    c, s = sp.cos(motion.angle), sp.sin(motion.angle)
    j, k = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[motion.axis]
    T[j, j], T[j, k], T[k, j], T[k, k] = c, -s, s, c
    return T


def _count(expression: sp.Expr) -> int:
    return int(sp.count_ops(expression))
