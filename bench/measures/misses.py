"""The command ``python -m bench misses`` counts the reachable targets that each solver misses.

Each robot has several sets of target poses. chasles solves all targets of each set. The other
libraries solve a sample of each set. A target is missed if no solution that the solver reports as
exact reaches the target within 1e-9. Least-squares results do not count as solutions.
"""

from collections.abc import Iterator
from dataclasses import asdict

from tests.support.generators.poses import CASES, FULL, SHORT, Case, PoseSet, sets
from tests.support.oracles.verdict import VALID, Verdict, judged
from tests.support.peers.case_answers import chooses_branches, own_answers, peer_answers
from tests.support.peers.interface import INSTALL, Unsolved, absent

from ..report import out, save, table

OWN = "chasles"
PEERS_POSES = 4096
"""Maximum number of target poses that other libraries must solve in each set. Some libraries take
milliseconds per target."""
PEERS_SHORT = 100
COLUMNS = ("set", "who", "targets", "missed", "unfound", "wrong", "lost", "worst")
RESULT = "misses"


def run(short: bool, robot: str | None) -> int:
    """Print a table per robot, and save all tables after a full run.

    Return 1 if chasles misses a target, returns a wrong solution, or does not support a robot.
    """
    for name, install in absent().items():
        out.print(f"{name} is not installed and not compared: pip install {install}")
    cases = [case for case in CASES if robot is None or case.name == robot]
    if not cases:
        out.print(f"no robot {robot}; available: {', '.join(case.name for case in CASES)}")
        return 1
    solved = [case for case in cases if case.function in case.robot.functions]
    for case in cases:
        if case not in solved:
            out.print(f"{case.name} has no {case.function}")
    found = {case.name: list(rows(case, short)) for case in solved}
    if not short and robot is None:
        save(RESULT, {"valid": VALID, "robots": found})
    own = [row for of in found.values() for row in of if row["who"] == OWN]
    failed = any(row["missed"] or row["wrong"] or row["lost"] for row in own)
    return int(failed or solved != cases)


def rows(case: Case, short: bool) -> Iterator[dict[str, object]]:
    """Yield the results for one robot, then print them as a table."""
    printed = []
    for poses in sets(case, SHORT if short else FULL):
        for who, verdict in verdicts(case, poses, PEERS_SHORT if short else PEERS_POSES):
            row = {"set": poses.name, "who": who, **asdict(verdict)}
            printed.append(tuple(row.values()))
            yield row
    table(f"{case.name}: reachable targets without a solution", COLUMNS, printed)


def verdicts(case: Case, poses: PoseSet, most: int) -> Iterator[tuple[str, Verdict]]:
    """Yield the results of chasles and of all suitable libraries on a limited set of targets."""
    yield OWN, judged(case, poses, lambda q: own_answers(case, q))
    if case.function != "ik" or not case.screws.revolute.all() or case.robot.loops:
        return
    some = poses.q[:: -(-len(poses.q) // most)]
    for name in (name for name in INSTALL if name not in absent()):
        try:
            asked = PoseSet(poses.name, some, poses.regular and not chooses_branches(name, case))
            yield (
                INSTALL[name],
                judged(case, asked, lambda q, name=name: peer_answers(name, case, q)),
            )
        except Unsolved:
            continue
