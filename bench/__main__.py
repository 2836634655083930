"""``python -m bench``: every benchmark, its tables printed and saved in bench/results/.

The figures in docs/performance.md are replaced by the new ones. With --quick nothing is saved.
"""

import argparse
import sys

from . import check, count, derivation, document
from .peers import absent
from .plans import FULL, QUICK, SECTIONS, without_slow_builds
from .report import Plan, out, records, save, tables


def main() -> int:
    """Runs what the command line asks for; the exit status."""
    options = _parser().parse_args()
    if options.command == "check":
        return check.run(options.write)
    if options.command == "count":
        return count.run(options.write)
    results = measure(without_slow_builds(QUICK) if options.quick else FULL, options.only)
    if not options.quick:
        for name, content in results.items():
            save(name, content)
        document.write()
    return 0


def measure(plan: Plan, only: str | None) -> dict[str, dict[str, object]]:
    """Runs the benchmarks, or only one, and prints what they find; for result files, by name."""
    for name, install in absent().items():
        out.print(f"no {name} to compare with: pip install {install}")
    for name in plan.leave_out:
        out.print(f"{name} is left out: it takes long to compile, and was not yet")
    results: dict[str, dict[str, object]] = {}
    for name, (title, run) in SECTIONS.items():
        if only in (None, name):
            found = run(plan)
            tables(title, found)
            results[name] = {"rounds": plan.rounds, "found": records(found)}
    if only in (None, "derivation"):
        results["derivation"] = derivation.run(plan)
    return results


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
