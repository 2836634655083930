"""Times of robots with loops.

A five-bar is compared with loop constraints in Pinocchio.
"""

import tempfile
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

import numpy as np

import chasles
from chasles.derive import read, write
from tests.support.oracles.screws import ROBOTS

from ..agreement import CONFIGURATIONS, require_same
from ..cores import one_core
from ..native.kernel import kernel
from ..native.library import Loop, aligned
from ..peers.forward import absent
from ..peers.forward.own import generated_loop
from ..report import Limit, Plan, Ratio, alternated, out, ratio, seconds
from .one_call import VECTORS, repeated

OWN = "chasles"
CHAIN = "open main chain"
BARS = {"well_manipulator": 1 / 2}
"""Required ratios. A robot with loops may take twice the time of its main chain without loops."""
CHAINS = ("well_manipulator", "excavator", "board_installer")
FIVE_BAR_BAR = 100.0
TIMED = (
    ("well_manipulator", "chain"),
    ("well_manipulator", "actuators"),
    ("delta", "fk"),
    ("delta", "actuators"),
    ("planar_3rrr", "actuators"),
    ("planar_3rrr", "actuators_all"),
    ("stewart_gough", "actuators"),
)
POSES = 20_000
SWING = 0.075
"""Amplitude of the crank angles [rad]."""
ITERATED = 1000
"""Number of poses in a batch for iterative functions."""
FOLLOWED = (
    ("planar_3rrr", "fk", {"C": 2.0, "Python": 4.0}),
    ("planar_3rrr", "fk_near", {}),
    ("stewart_gough", "fk", {}),
    ("stewart_gough", "fk_near", {"C": 3.0}),
)
"""Functions that iterate in C, with their maximum time [us]."""
FREE = 0.3
"""Range on both sides of the reference, for coordinates without limits [rad or m]."""
STEP = 1e-3
"""Maximum change of each coordinate between the seed and the solution [rad or m]."""


def run(plan: Plan) -> list[Ratio | Limit]:
    """Return the time ratios and times of all benchmarks of this module."""
    with one_core():
        return [*open_chains(plan), *five_bar(plan), *times(plan), *iterations(plan)]


def closed(robot: chasles.Robot, count: int) -> np.ndarray:
    """Return random configurations (at most count) at which the loops close.

    Random values of a coordinate without limits lie between reference - FREE and reference + FREE.
    """
    reference = robot.reference.q
    lower = np.where(np.isfinite(robot.lower), robot.lower, np.subtract(reference, FREE))
    upper = np.where(np.isfinite(robot.upper), robot.upper, np.add(reference, FREE))
    q = np.random.default_rng(0).uniform(lower, upper, (count, robot.n))
    return q[robot.loops_close(q)]


def open_chains(plan: Plan) -> list[Ratio]:
    found = []
    for name in CHAINS:
        robot = chasles.load(name)
        own, chain = chain_loops(robot)
        q = closed(robot, min(plan.batch, POSES))
        theta, some = robot.chain(q), q[:CONFIGURATIONS]
        T, J = robot.fk_jacobian_mixed(some)
        require_same(f"{name} in C", own.results(some), (T, T, J))
        *poses, J_theta = chain.results(theta[:CONFIGURATIONS])
        found_J = J_theta @ robot.chain_D_q(some)
        require_same(f"{CHAIN} of {name}", (*poses, found_J), (T, T, J))
        works = {OWN: _posed(own, q), CHAIN: _posed(chain, theta)}
        of = alternated(works, plan.rounds)
        key = f"scalar {name} fk_jacobian: {CHAIN}"
        found.append(ratio(key, of, (OWN, CHAIN), len(q), BARS.get(name)))
    return found


def chain_loops(robot: chasles.Robot) -> tuple[Loop, Loop]:
    """Return compiled code for a robot and for its main chain as a serial robot."""
    chain = read(ROBOTS / f"{robot.name}.toml").main_chain
    with tempfile.TemporaryDirectory() as folder:
        write(chain, Path(folder), functions=("fk", "fk_jacobian_mixed"))
        theirs = generated_loop(Path(folder), robot.name, len(chain.moving))
    return generated_loop(robot.folder, robot.name, robot.n), theirs


def _posed(loop: Loop, q: np.ndarray) -> Callable[[], None]:
    T, J = aligned(1, 4, 4), aligned(1, 6, loop.joints)
    return lambda: loop.fk_jacobian(q, T, J)


def five_bar_path(robot: chasles.Robot) -> np.ndarray:
    """Return crank angles (500, 2) on a closed path around the middle of the limits."""
    turn = np.linspace(0, 2 * np.pi, VECTORS, endpoint=False)
    middle = (robot.lower + robot.upper) / 2
    return middle + SWING * np.stack([np.cos(turn), np.sin(turn)], axis=-1)


def five_bar_peer(robot: chasles.Robot):
    """Return the five-bar in Pinocchio at the start of the path."""
    w, a, b = (robot.parameters[name].value for name in ("w", "a", "b"))
    z = robot.configuration(five_bar_path(robot)[0])
    return import_module("..peers.pinocchio_loops", __package__).FiveBar(w, a, b, z)


def five_bar(plan: Plan) -> list[Ratio]:
    """Compare pose, Jacobian and velocity map of five_bar with Pinocchio.

    Both libraries are called from Python.
    """
    if "pinocchio" in absent():
        return []
    robot = chasles.load("five_bar")
    require_same_five_bar(robot)
    peer, q = five_bar_peer(robot), five_bar_path(robot)
    z = robot.configuration(q)
    newton, known = "Pinocchio, Newton", "Pinocchio, z known"
    pairs = {
        ("fk_jacobian", newton, FIVE_BAR_BAR): (robot.fk_jacobian_mixed, peer.fk_jacobian, q),
        ("velocity map", known, None): (robot.chain_D_q, peer.velocity_map, z),
    }
    repeats = max(plan.calls // VECTORS, 1)
    found = []
    for (function, name, bar), (own, theirs, rows) in pairs.items():
        works = {OWN: repeated(own, q, repeats), name: repeated(theirs, rows, repeats)}
        of, key = alternated(works, plan.rounds), f"python five_bar {function}: {name}"
        found.append(ratio(key, of, (OWN, name), VECTORS * repeats, bar))
    corrections = peer.corrections / (VECTORS * repeats * (plan.rounds + 1))
    out.print(f"five_bar: {corrections:.2f} Newton steps per pose")
    return found


def require_same_five_bar(robot: chasles.Robot) -> None:
    """Compare configurations, poses, Jacobians and velocity maps with Pinocchio."""
    peer, q = five_bar_peer(robot), five_bar_path(robot)[:CONFIGURATIONS]
    z = robot.configuration(q)
    for own_z, angles, T, J in zip(z, q, *robot.fk_jacobian_mixed(q), strict=True):
        pose, jacobian = peer.fk_jacobian(angles)
        found = pose.homogeneous, jacobian, peer.z, peer.velocity_map(own_z)[:2]
        require_same("Pinocchio for five_bar", found, (T, J, own_z, robot.chain_D_q(angles)))


def times(plan: Plan) -> list[Limit]:
    """Return times of loop functions such as `chain` and `actuators`, in C and from Python."""
    found = []
    for name, function in TIMED:
        robot = chasles.load(name)
        call = robot.functions[function]
        q = closed(robot, VECTORS)
        rows = q if robot.functions[function].inputs[0].name == "q" else robot.chain(q)
        in_C = kernel(robot, function)
        require_same(f"{name} {function} in C", in_C.at(rows[0]), several(call(rows[0])))
        repeats = max(plan.calls // VECTORS, 1)
        many = np.ascontiguousarray(np.tile(rows, (repeats, 1)))
        works = {
            "C": lambda k=in_C, m=many: k.run(m),
            "Python": repeated(call, rows, repeats),
        }
        of = alternated(works, plan.rounds)
        found += [
            _time(f"{name} {function}, {method}", of[method], len(many), "ns") for method in of
        ]
    return found


def iterations(plan: Plan) -> list[Limit]:
    """Return the times per pose of the iterative functions in FOLLOWED."""
    found = []
    repeats = max(plan.calls // VECTORS, 1)
    for name, function, bars in FOLLOWED:
        robot = chasles.load(name)
        call, inputs = robot.functions[function], followed(robot, function)
        many = np.ascontiguousarray(np.tile(np.concatenate(inputs, axis=-1), (repeats, 1)))
        in_C = kernel(robot, function)
        expected = several(call(*(rows[0] for rows in inputs)))
        require_same(f"{name} {function} in C", in_C.at(many[0]), expected)
        works = {
            "C": lambda k=in_C, m=many: k.run(m),
            "Python": lambda f=call, i=inputs: [f(*r) for r in zip(*i, strict=True)],
            "in a batch": lambda f=call, i=inputs: f(*i),
        }
        counts = {"C": len(many), "Python": len(inputs[0]), "in a batch": len(inputs[0])}
        of = alternated(works, plan.rounds)
        found += [
            _time(
                f"{name} {function}, {method}", of[method], counts[method], "us", bars.get(method)
            )
            for method in of
        ]
    robot = chasles.load("planar_3rrr")
    q = closed(robot, ITERATED)
    of_modes = [seconds(lambda: robot.fk_planar_all(q)) for _ in range(plan.rounds)]
    return [*found, _time("planar_3rrr fk_planar_all, in a batch", of_modes, len(q), "us")]


def several(results: object) -> tuple:
    return results if isinstance(results, tuple) else (results,)


def followed(robot: chasles.Robot, function: str) -> tuple[np.ndarray, ...]:
    """Return random coordinates, and nearby configurations for functions with a seed."""
    q = closed(robot, VECTORS)
    if not function.endswith("_near"):
        return (q,)
    away = np.random.default_rng(1).uniform(-STEP, STEP, q.shape)
    return q, robot.configuration(q + away)


def _time(key: str, taken: list[float], count: int, unit: str, bar: float | None = None) -> Limit:
    return Limit(key, min(taken) / count * {"ns": 1e9, "us": 1e6}[unit], unit, bar)
