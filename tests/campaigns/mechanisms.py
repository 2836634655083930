"""``python -m bench mechanisms``: the branches of drawn mechanisms beside a multi-start Newton's.

Each mechanism of ``bench/cases/drawn_mechanisms.py`` is derived, its folder is written and loaded,
and both its maps are asked for all branches at a number of inputs. No branch may be missing, none
may come twice, and none may be wrong: no slot may be valid that the loops do not allow, or whose
cylinders are of negative length. Mechanisms without a closed form are counted apart.
"""

import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

import chasles
from bench.report import out, paced
from chasles.derive import derive
from chasles.derive.build.generate import files_of, put
from tests.support.generators.drawn_mechanisms import DrawnMechanism, drawn_mechanism
from tests.support.oracles.multi_start import SAME, Multistart

INPUTS = 20
LEFT = 1e-12
"""Residual of a valid slot, parts of the mechanism's size."""
AT_DEAD_POINT = 1e-5
"""Margin below which a branch is about to meet another one, and no count is certain."""
SLOW = 10.0
"""Seconds of the processor that a derivation may take."""
MAPS = ("map", "margin", "branches")
FAULTS = ("missing", "repeated", "wrong", "not the first", "out of branch", "unlabelled")


@dataclass
class Verdict:
    """The faults of one mechanism.

    Attributes:
        seed: Its number.
        family: Its family.
        faults: Number of faults by kind.
        branches: Number of branches that were compared.
        inputs: Number of inputs at which they were compared.
        largest: Largest residual of a valid slot, parts of the mechanism's size.
        open: Whether its loops have no closed form.
        crash: The error that ended it.
        seconds: Time of its derivation.
    """

    seed: int
    family: str
    faults: Counter[str] = field(default_factory=Counter)
    branches: int = 0
    inputs: int = 0
    largest: float = 0.0
    open: bool = False
    crash: str = ""
    seconds: float = 0.0

    @property
    def is_clean(self) -> bool:
        """Whether nothing is wrong."""
        return not self.crash and not self.faults.total() and self.seconds <= SLOW

    def __str__(self) -> str:
        """The verdict in one line."""
        faults = ", ".join(f"{count} {kind}" for kind, count in self.faults.items())
        ends = [text for text in (faults, self.crash) if text]
        if self.seconds > SLOW:
            ends.append(f"{self.seconds:.1f} s")
        return f"mechanism {self.seed}, {self.family}: {'; '.join(ends) or 'clean'}"


def run(count: int, first: int) -> int:
    """Prints each mechanism with a fault and the sums; returns 1 if there is one.

    Args:
        count: Number of mechanisms.
        first: Number of the first.
    """
    verdicts = paced(_verdicts(count, first), count, _so_far)
    families = Counter(v.family for v in verdicts)
    for family, of in families.items():
        without = sum(v.open for v in verdicts if v.family == family)
        out.print(f"{of:5d} {family}, {without} of them without a closed form")
    sums = sum((v.faults for v in verdicts), Counter())
    out.print(
        f"{count} mechanisms, {sum(v.inputs for v in verdicts)} inputs, "
        f"{sum(v.branches for v in verdicts)} branches, "
        f"largest residual {max(v.largest for v in verdicts):.1e} of the size: "
        + ", ".join(f"{sums[kind]} {kind}" for kind in FAULTS)
        + f", {sum(bool(v.crash) for v in verdicts)} crashes, "
        f"{sum(v.seconds > SLOW for v in verdicts)} above {SLOW:.0f} s "
        f"(longest {max(v.seconds for v in verdicts):.1f} s)"
    )
    return int(not all(v.is_clean for v in verdicts))


def _verdicts(count: int, first: int) -> Iterator[Verdict]:
    """Judges mechanisms one after the other, and prints those with a fault."""
    for seed in range(first, first + count):
        verdict = judged(drawn_mechanism(seed), seed)
        if not verdict.is_clean:
            out.print(str(verdict))
        yield verdict


def _so_far(verdicts: Sequence[Verdict]) -> str:
    faults = sum(v.faults.total() for v in verdicts)
    with_fault = sum(not v.is_clean for v in verdicts)
    return f"{sum(v.branches for v in verdicts)} branches, {faults} faults, {with_fault} not clean"


def judged(
    drawn: DrawnMechanism, seed: int, inputs: int = INPUTS, is_short: bool = False
) -> Verdict:
    """The verdict on a mechanism, after deriving, writing and loading it.

    Args:
        drawn: The mechanism.
        seed: Its number.
        inputs: Number of inputs.
        is_short: Whether only the maps are written and compiled.
    """
    verdict = Verdict(seed, drawn.family)
    try:
        begin = time.process_time()
        derivation = derive(drawn.mechanism)
        verdict.seconds = time.process_time() - begin
        if is_short and not derivation.hybrid.forward.open:
            maps = (f for f in derivation.functions if f.role.name in MAPS)
            derivation = replace(derivation, functions=tuple(maps), inverse=None)
        with tempfile.TemporaryDirectory() as folder:
            put(files_of(derivation), Path(folder))
            robot = chasles.load(folder)
            _compare(verdict, robot, drawn, inputs)
    except Exception as error:  # every end of a mechanism is counted
        verdict.crash = f"{type(error).__name__}: {error}"
    return verdict


def _compare(verdict: Verdict, robot: chasles.Robot, drawn: DrawnMechanism, inputs: int) -> None:
    numbers = Multistart(drawn.mechanism)
    rng = np.random.default_rng(verdict.seed)
    q = np.vstack([drawn.q, numbers.random_q(rng, inputs - 1)])
    if robot.solution != "closed form":
        verdict.open = True
        return
    modes = numbers.modes(q, numbers.actuated)
    found = robot.chain_branches(q)
    labels = robot.labels["chain_all"]
    _count(verdict, numbers, (numbers.actuated, q), (numbers.chain, found), labels, modes)
    _reference(verdict, numbers, drawn, robot)
    first = np.isclose(robot.chain(q), found[0][:, 0], rtol=0, atol=SAME * numbers.size)
    verdict.faults["not the first"] += int((~first.all(-1) & found[1][:, 0]).sum())
    some = [of[rng.integers(len(of))] for of in modes if of]
    if not hasattr(robot, "actuators") or not some:
        return
    theta = np.array([[mode[name] for name in numbers.chain] for mode in some])
    if len(numbers.chain) > len(numbers.actuated):
        # Joints that the loops do not allow together.
        theta[::4] += 0.1 * numbers.scales(numbers.chain) * rng.uniform(-1, 1, theta[::4].shape)
    back = numbers.modes(theta, numbers.chain)
    found = robot.actuator_branches(theta)
    labels = robot.labels["actuators_all"]
    _count(verdict, numbers, (numbers.chain, theta), (numbers.actuated, found), labels, back)
    _valid(verdict, numbers, robot, theta)


def _reference(
    verdict: Verdict, numbers: Multistart, drawn: DrawnMechanism, robot: chasles.Robot
) -> None:
    """The map's branch is that of the configuration at which the mechanism was drawn."""
    theta = np.array([drawn.mode[name] for name in numbers.chain])
    apart = numbers.wrapped(numbers.chain, robot.chain(drawn.q[None])[0] - theta)
    verdict.faults["wrong"] += int(not np.abs(apart).max() < SAME)


def _valid(verdict: Verdict, numbers: Multistart, robot: chasles.Robot, theta: np.ndarray) -> None:
    """``actuators_valid`` is true where the actuators lead back to theta, and only there.

    Near a dead point another mode may be as near as the tolerance: the chain that comes back must
    be nearer to theta than half the way to any other mode.
    """
    q = robot.actuators(theta)
    apart = np.abs(numbers.wrapped(numbers.chain, robot.chain(q) - theta)).max(-1)
    modes = numbers.modes(q, numbers.actuated)
    back = apart < [half_way(numbers, modes[k], theta[k]) for k in range(len(theta))]
    verdict.faults["out of branch"] += int((back != robot.actuators_valid(theta)).sum())


def half_way(numbers: Multistart, modes: list[dict[str, float]], theta: np.ndarray) -> float:
    """Half the distance from joints to the nearest mode beside them, the tolerance at most."""
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
    """Compares the branches of each input one to one."""
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
    """The modes that differ in some values: passive joints alone make no branch."""
    kept: list[dict[str, float]] = []
    for mode in modes:
        values = np.array([mode[name] for name in names])
        if _match(numbers, names, values, kept, [0] * len(kept)) is None:
            kept.append(mode)
    return kept
