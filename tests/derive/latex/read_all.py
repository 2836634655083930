"""Tests the inverses printed in articles: ``python tests/derive/latex/read_all.py [ARM ...]``.

The script parses the printed formulas, evaluates the formulas at random poses, and compares the
solutions with ``ik``. By default, the script tests all shipped arms and all arms in
``derive/robots/shelf``. The script prints the number of agreeing solutions, or the reason for a
failed evaluation.
"""

import sys
import time
from pathlib import Path

ROOT = Path(__file__).parents[3]
sys.path.insert(0, str(ROOT))
POSES = 10


def message(name):
    """Evaluate the printed equations of an arm, and compare the solutions with ``ik``.

    Returns a message about the comparison, and whether a printed equation is wrong.
    """
    from chasles.derive import SerialRobot, derive, read
    from tests.support.derivations import description
    from tests.support.read_back import read_back, without_formula

    robot = read(description(name))
    if not isinstance(robot, SerialRobot):
        return "", False
    found = derive(robot, functions=["fk", "ik"])
    reason = without_formula(found)
    if reason:
        return f"-  {reason}", False
    try:
        count = read_back(found, POSES)
    except (AssertionError, KeyError) as error:
        return f"WRONG  {str(error).strip().splitlines()[0]}", True
    return f"{count} solutions agree", count < POSES


def main(names):
    """Return the number of robots whose LaTeX articles contain wrong formulas."""
    from tests.support.derivations import NAMES, ROBOTS

    shelf = sorted(path.stem for path in (ROBOTS / "shelf").glob("*.toml"))
    agreeing, wrong = 0, 0
    for name in names or [*NAMES, *shelf]:
        begin = time.perf_counter()
        words, is_wrong = message(name)
        if words:
            agreeing += "agree" in words
            wrong += is_wrong
            print(f"{name:<20} {words} ({time.perf_counter() - begin:.1f} s)", flush=True)
    print(f"{agreeing} arms agree, {wrong} are wrong")
    return wrong


if __name__ == "__main__":
    raise SystemExit(bool(main(sys.argv[1:])))
