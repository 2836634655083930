"""``python -m bench``: every benchmark, its tables printed and saved in bench/results/."""

import argparse
import sys

from . import check, count, derivation
from .plans import FULL, QUICK, SECTIONS, without_slow_builds
from .peers import absent
from .report import Plan, out, records, save, tables


def main() -> int:
    """Runs what the command line asks for; the exit status."""
    options = _parser().parse_args()
    if options.command == "check":
        return check.run(options.write)
    if options.command == "count":
        return count.run(options.write)
    measure(without_slow_builds(QUICK) if options.quick else FULL, options.only)
    return 0


def measure(plan: Plan, only: str | None) -> None:
    """Runs the benchmarks, or only one; prints and saves what they find."""
    for name, install in absent().items():
        out.print(f"no {name} beside us: pip install {install}")
    for name, (title, run) in SECTIONS.items():
        if only in (None, name):
            found = run(plan)
            tables(title, found)
            save(name, {"rounds": plan.rounds, "found": records(found)})
    if only in (None, "derivation"):
        derivation.run(plan)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m bench", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="few rounds, to see that all runs")
    parser.add_argument("--only", choices=[*SECTIONS, "derivation"], help="one benchmark")
    commands = parser.add_subparsers(dest="command", metavar="command")
    texts = {
        "check": "compare the ratios of a short run with bench/baseline.json",
        "count": "count instructions and compare with bench/instructions.json",
    }
    for name, text in texts.items():
        command = commands.add_parser(name, help=text)
        command.add_argument("--write", action="store_true", help="write that file instead")
    return parser


if __name__ == "__main__":
    sys.exit(main())
