"""``python -m bench``: every benchmark, its tables printed and saved in bench/results/.

The figures in docs/performance.md are replaced by the new ones. With --quick nothing is saved.
"""

import argparse
import sys
from pathlib import Path

from . import check, count, document
from .accuracy import cleaned_files, field, general_arms, losses, misses
from .cases.poses import CASES
from .measures import derivation
from .peers.forward import absent
from .plans import FULL, QUICK, SECTIONS, without_slow_builds
from .report import Plan, out, records, save, tables
from .robustness import attempts, built_robots

DERIVATION = "derivation"
ARMS = 50
"""Number of random arms, of which about a sixth have a structure."""
MUTANTS = 200


def main() -> int:
    """Runs the benchmarks that the command line selects; returns the exit status."""
    options = _parser().parse_args()
    if options.command == "check":
        return check.run(options.write)
    if options.command == "count":
        return count.run(options.write)
    if options.command == "misses":
        return misses.run(options.quick, options.robot)
    if options.command == "field":
        return field.run(options.quick, options.arm)
    if options.command == "general":
        return general_arms.run(options)
    if options.command == "losses":
        return losses.run(options.arms, options.first)
    if options.command == "mutants":
        return cleaned_files.run(options.urdfs, options.count)
    if options.command == "as_built":
        return built_robots.run(options.draws, options.first)
    if options.command == "robust":
        return attempts.run(
            options.folder, options.files, options.derived, options.arms, options.seed
        )
    if options.quick:
        measure(without_slow_builds(QUICK), options.only, keep=False)
    else:
        measure(FULL, options.only, keep=True)
        document.write()
    return 0


def measure(plan: Plan, only: str | None, keep: bool) -> None:
    """Runs all benchmarks or a single one; prints the results, and saves them if requested."""
    for name, install in absent().items():
        out.print(f"no {name} to compare with: pip install {install}")
    for name in plan.leave_out:
        out.print(f"{name} is left out: it takes long to compile, and was not yet")
    for name in [only] if only else [*SECTIONS, DERIVATION]:
        content = derivation.run(plan) if name == DERIVATION else compared(plan, name)
        if keep:
            save(name, content)


def compared(plan: Plan, name: str) -> dict[str, object]:
    """Prints the ratios and limits of a benchmark, and returns them for a result file."""
    title, run = SECTIONS[name]
    found = run(plan)
    tables(title, found)
    return {"rounds": plan.rounds, "found": records(found)}


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m bench", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="few rounds, to see that all runs")
    parser.add_argument("--only", choices=[*SECTIONS, DERIVATION], help="one benchmark")
    commands = parser.add_subparsers(dest="command", metavar="command")
    texts = {
        "check": "compare the ratios of a short run with bench/baseline.json",
        "count": "count instructions and compare with bench/instructions.json",
    }
    for name, text in texts.items():
        command = commands.add_parser(name, help=text)
        command.add_argument("--write", action="store_true", help="write that file instead")
    lost = commands.add_parser(
        "misses", help="reachable targets that inverses miss, ours and peers'"
    )
    lost.add_argument("--quick", action="store_true", default=argparse.SUPPRESS, help="small sets")
    lost.add_argument("--robot", choices=[case.name for case in CASES], help="one robot")
    met = commands.add_parser("field", help="arms of other makers' files, derived and judged")
    met.add_argument("--quick", action="store_true", default=argparse.SUPPRESS, help="small sets")
    met.add_argument("--arm", help="arms with this text in their names")
    general = commands.add_parser("general", help="arms without a structure: judged and timed")
    general_arms.add_arguments(general)
    arms = commands.add_parser("losses", help="poses that inverses of random arms lose")
    arms.add_argument("--arms", type=int, default=ARMS, help="number of arms")
    arms.add_argument("--first", type=int, default=0, help="number of the first arm")
    mutants = commands.add_parser("mutants", help="mutated URDFs: structure and pose error")
    mutants.add_argument("--urdfs", type=Path, help="folder of URDFs besides the shipped robots")
    mutants.add_argument("--count", type=int, default=MUTANTS, help="number of mutants")
    built = commands.add_parser("as_built", help="a robot with loops as built, derived and judged")
    built.add_argument("--draws", type=int, default=100, help="number of draws")
    built.add_argument("--first", type=int, default=0, help="number of the first draw")
    robust = commands.add_parser("robust", help="read and derive mutated files and round arms")
    robust.add_argument("folder", type=Path, help="more .toml and .urdf files; crashes are kept")
    for name, default in (("files", 5_000), ("derived", 50), ("arms", 500), ("seed", 0)):
        robust.add_argument(f"--{name}", type=int, default=default)
    return parser


if __name__ == "__main__":
    sys.exit(main())
