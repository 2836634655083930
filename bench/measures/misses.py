"""``python -m bench misses``: counts the reachable targets that each solver misses, on equal sets.

chasles solves every target of every set, the peers solve a sample. A target is missed if no claimed
solution reaches it to 1e-9; an answer marked as least squares is not claimed.
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
"""Largest number of targets of a set that a peer solves: some peers take milliseconds for each."""
PEERS_SHORT = 100
COLUMNS = ("set", "who", "targets", "missed", "unfound", "wrong", "lost", "worst")
RESULT = "misses"


def run(short: bool, robot: str | None) -> int:
    """Prints a table for each robot, and saves all after a full run; returns 1 if chasles fails."""
    for name, install in absent().items():
        out.print(f"no {name} to compare with: pip install {install}")
    cases = [case for case in CASES if robot is None or case.name == robot]
    if not cases:
        out.print(f"no robot {robot}; there are {', '.join(case.name for case in CASES)}")
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
    """The verdicts on one robot, printed as a table at the end."""
    printed = []
    for poses in sets(case, SHORT if short else FULL):
        for who, verdict in verdicts(case, poses, PEERS_SHORT if short else PEERS_POSES):
            row = {"set": poses.name, "who": who, **asdict(verdict)}
            printed.append(tuple(row.values()))
            yield row
    table(f"{case.name}: reachable targets without a solution", COLUMNS, printed)


def verdicts(case: Case, poses: PoseSet, most: int) -> Iterator[tuple[str, Verdict]]:
    """The verdicts on chasles and on the peers that can solve the robot, on limited target sets."""
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
