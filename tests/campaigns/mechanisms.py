"""Compares the solution branches of random mechanisms with multi-start Newton iteration.

The random mechanisms come from the generator ``drawn_mechanisms.py``. Each trial compares all
solution branches of the actuator map and of its inverse map at several inputs. No solution branch
may be missing, duplicated or wrong. A valid solution must close the loops with positive cylinder
lengths. Valid solutions of ``ik`` must reach the target pose, and one of them must be the
configuration that generated the pose.
"""

import tempfile
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import chasles
from chasles.contract import read_manifest
from chasles.derive import derive
from chasles.derive.build.generate import files_of, put
from tests.support.generators.drawn_mechanisms import DrawnMechanism, drawn_mechanism
from tests.support.loops.slot_faults import FAULTS as SLOT_FAULTS
from tests.support.loops.slot_faults import slot_faults
from tests.support.oracles.multi_start import SAME, Multistart

from .campaign import Campaign, Outcome

INPUTS = 20
LEFT = 1e-12
"""Maximum loop residual of a valid solution, relative to the mechanism size."""
AT_DEAD_POINT = 1e-5
"""Margin below which two solution branches nearly coincide, so that the number of solutions is
uncertain."""
FAULTS = (
    "missing",
    "repeated",
    "wrong",
    "not the first",
    "out of branch",
    "unlabelled",
    "finite where open",
    "not finite where closed",
    *SLOT_FAULTS,
)
NOT_MAPS = ("margin", "branches", "assembly polynomial", "assembly pose", "assembly mirror", "near")
"""Roles of functions that accept open loops or need a nearby configuration."""


@dataclass
class Verdict:
    """Faults found in one mechanism.

    Attributes:
        seed: Random seed that generates the mechanism.
        family: Family of the mechanism.
        faults: Number of faults, keyed by kind.
        branches: Number of solution branches that Newton's method finds at the compared inputs.
        inputs: Number of compared inputs.
        largest: Largest loop residual of a valid solution, divided by the mechanism size.
        open: Whether the loops have no closed-form solution.
        open_inputs: Number of inputs at which the loops do not close.
    """

    seed: int
    family: str
    faults: Counter[str] = field(default_factory=Counter)
    branches: int = 0
    inputs: int = 0
    largest: float = 0.0
    open: bool = False
    open_inputs: int = 0


def trial(number: int) -> Outcome:
    verdict = judged(drawn_mechanism(number), number)
    counts = {
        "mechanisms without a closed form": int(verdict.open),
        "inputs": verdict.inputs,
        "open inputs": verdict.open_inputs,
        "branches": verdict.branches,
    }
    faults = [f"{verdict.faults[kind]} {kind}" for kind in FAULTS if verdict.faults[kind]]
    failures = (f"{verdict.family}: {', '.join(faults)}",) if faults else ()
    return Outcome(counts, failures, {"residual": verdict.largest})


def judged(drawn: DrawnMechanism, seed: int, inputs: int = INPUTS) -> Verdict:
    """Derive, load and test a mechanism at random inputs."""
    verdict = Verdict(seed, drawn.family)
    derivation = derive(drawn.mechanism)
    with tempfile.TemporaryDirectory() as folder:
        put(files_of(derivation), Path(folder))
        robot = chasles.load(folder)
        _compare(verdict, robot, drawn, inputs)
    return verdict


def _compare(verdict: Verdict, robot: chasles.Robot, drawn: DrawnMechanism, inputs: int) -> None:
    numbers = Multistart(drawn.mechanism)
    rng = np.random.default_rng(verdict.seed)
    q = np.vstack([drawn.q, numbers.random_q(rng, inputs - 1)])
    modes = numbers.modes(q, numbers.actuated)
    if robot.loop_solution != "closed form":
        verdict.open = True
        reached = np.isfinite(robot.fk(q)).all((1, 2))
        closed = np.array([len(of) > 0 for of in modes])
        clear = reached | ~closed
        _silent(verdict, robot, "actuators", q[clear], closed[clear])
        _slots(verdict, robot, drawn, q[reached])
        return
    found = robot.chain_branches(q)
    labels = robot.labels["chain_branches"]
    _count(verdict, numbers, (numbers.actuated, q), (numbers.chain, found), labels, modes)
    _reference(verdict, numbers, drawn, robot)
    first = np.isclose(robot.chain(q), found[0][:, 0], rtol=0, atol=SAME * numbers.size)
    verdict.faults["not the first"] += int((~first.all(-1) & found[1][:, 0]).sum())
    closed = found[1][:, 0]
    clear = ~(np.abs(found[2][:, 0]).min(-1) < AT_DEAD_POINT)
    _silent(verdict, robot, "actuators", q[clear], closed[clear])
    _slots(verdict, robot, drawn, q[closed])
    some = [of[rng.integers(len(of))] for of in modes if of]
    if not hasattr(robot, "actuators") or not some:
        return
    theta = np.array([[mode[name] for name in numbers.chain] for mode in some])
    is_square = len(numbers.chain) == len(numbers.actuated)
    if is_square:
        moved = theta[::2] + numbers.scales(numbers.chain) * rng.uniform(-1, 1, theta[::2].shape)
        theta = np.vstack([theta, moved])
    else:
        # Change some joint values so that the loops no longer close.
        theta[::4] += 0.1 * numbers.scales(numbers.chain) * rng.uniform(-1, 1, theta[::4].shape)
    back = numbers.modes(theta, numbers.chain)
    found = robot.actuator_branches(theta)
    labels = robot.labels["actuator_branches"]
    _count(verdict, numbers, (numbers.chain, theta), (numbers.actuated, found), labels, back)
    _valid(verdict, numbers, robot, theta)
    if is_square:
        clear = np.ones(len(theta), dtype=bool)
        if hasattr(robot, "actuator_margin"):
            clear = ~(np.abs(robot.actuator_margin(theta)).min(-1) < AT_DEAD_POINT)
        # Other branches may close where the reference branch is open.
        _silent(verdict, robot, "chain", theta[clear], found[1][clear, 0])


def _silent(
    verdict: Verdict,
    robot: chasles.Robot,
    domain: str,
    values: np.ndarray,
    closed: np.ndarray,
) -> None:
    """Count finite results for open loops and non-finite results for closed loops.

    The input values (N, n) are away from dead points. The mask `closed` (N,) marks the input values
    at which the loops close.
    """
    verdict.open_inputs += int((~closed).sum())
    if closed.sum() < 2:
        return
    rng = np.random.default_rng(verdict.seed)
    for info in read_manifest(robot.folder).functions:
        is_relation = any(i.name in ("q", "theta") for i in info.inputs[1:])
        if info.role.domain != domain or is_relation or info.role.name in NOT_MAPS:
            continue
        rates = [rng.normal(size=(len(values), *i.shape)) for i in info.inputs[1:]]
        results = robot.functions[info.name](values, *rates)
        for result in results if isinstance(results, tuple) else (results,):
            flat = np.asarray(result, dtype=float).reshape(len(values), -1)
            varies = np.ptp(flat[closed], axis=0) > 0
            verdict.faults["not finite where closed"] += int((~np.isfinite(flat[closed])).sum())
            verdict.faults["finite where open"] += int(np.isfinite(flat[~closed][:, varies]).sum())


def _slots(verdict: Verdict, robot: chasles.Robot, drawn: DrawnMechanism, q: np.ndarray) -> None:
    """Count faults of the IK function at the tool poses of configurations (N, n)."""
    if hasattr(robot, "ik") and not robot.redundancy and len(q):
        verdict.faults.update(slot_faults(robot, drawn.mechanism, q))


def _reference(
    verdict: Verdict, numbers: Multistart, drawn: DrawnMechanism, robot: chasles.Robot
) -> None:
    """Count a fault if ``chain`` does not return the reference branch at the reference input."""
    theta = np.array([drawn.mode[name] for name in numbers.chain])
    apart = numbers.wrapped(numbers.chain, robot.chain(drawn.q[None])[0] - theta)
    verdict.faults["wrong"] += int(not np.abs(apart).max() < SAME)


def _valid(verdict: Verdict, numbers: Multistart, robot: chasles.Robot, theta: np.ndarray) -> None:
    """Check that ``chain_closes`` is true exactly if ``chain(actuators(theta))`` equals theta.

    The tolerance is half the distance from theta to the nearest other mode, because a wrong mode
    may be close near a dead point.
    """
    q = robot.actuators(theta)
    apart = np.abs(numbers.wrapped(numbers.chain, robot.chain(q) - theta)).max(-1)
    modes = numbers.modes(q, numbers.actuated)
    back = apart < [half_distance(numbers, modes[k], theta[k]) for k in range(len(theta))]
    verdict.faults["out of branch"] += int((back != robot.chain_closes(theta)).sum())


def half_distance(numbers: Multistart, modes: list[dict[str, float]], theta: np.ndarray) -> float:
    """Return half the distance from theta to the nearest other assembly mode.

    The returned distance is limited to 100 times ``SAME``.
    """
    others = np.array([[mode[name] for name in numbers.chain] for mode in modes])
    apart = np.abs(numbers.wrapped(numbers.chain, others.reshape(-1, len(theta)) - theta)).max(-1)
    return min([100 * SAME, *(apart[apart > SAME] / 2)])


def _count(
    verdict: Verdict,
    numbers: Multistart,
    given: tuple[list[str], np.ndarray],
    found: tuple[list[str], tuple[np.ndarray, np.ndarray, np.ndarray]],
    labels: tuple[str, ...],
    modes: list[list[dict[str, float]]],
) -> None:
    """Match each input's branches one to one with the assembly modes that Newton's method finds."""
    (known, values), (names, (branches, valid, margin)) = given, found
    verdict.faults["unlabelled"] += int(len(set(labels)) < len(labels) or not all(labels))
    for row, of in enumerate(modes):
        ours = branches[row][valid[row]]
        close = np.where(np.isfinite(margin[row]), margin[row], 1.0)
        if (np.abs(close) < AT_DEAD_POINT).any():
            continue
        verdict.inputs += 1
        theirs = _distinct(numbers, names, of)
        fixed = dict(zip(known, map(float, values[row]), strict=True))
        matched = [0] * len(theirs)
        for one in ours:
            mode = _match(numbers, names, one, theirs, matched)
            residual = np.inf
            if mode is not None:
                whole = mode | fixed | dict(zip(names, map(float, one), strict=True))
                residual = numbers.residual(whole, list(dict.fromkeys([*known, *names])))
                verdict.largest = max(verdict.largest, residual)
            verdict.faults["wrong"] += int(not residual < LEFT)
        verdict.branches += len(theirs)
        verdict.faults["missing"] += sum(count == 0 for count in matched)
        verdict.faults["repeated"] += sum(count > 1 for count in matched)


def _match(
    numbers: Multistart,
    names: list[str],
    one: np.ndarray,
    theirs: list[dict[str, float]],
    matched: list[int],
) -> dict[str, float] | None:
    for k, mode in enumerate(theirs):
        difference = one - np.array([mode[name] for name in names])
        if np.abs(numbers.wrapped(names, difference)).max() < SAME:
            matched[k] += 1
            return mode
    return None


def _distinct(
    numbers: Multistart, names: list[str], modes: list[dict[str, float]]
) -> list[dict[str, float]]:
    """Remove assembly modes that differ from an earlier mode only in joints outside `names`."""
    kept: list[dict[str, float]] = []
    for mode in modes:
        values = np.array([mode[name] for name in names])
        if _match(numbers, names, values, kept, [0] * len(kept)) is None:
            kept.append(mode)
    return kept


CAMPAIGN = Campaign(
    "mechanisms",
    "Both maps of a drawn mechanism have exactly the branches that Newton's iteration finds.",
    trial,
)
