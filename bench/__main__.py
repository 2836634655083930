"""``python -m bench`` compares the speed and size of chasles with other libraries in the same run.

Without a command, the program runs all benchmarks and updates docs/performance.md. The tables are
saved in bench/results/. With --quick, the program saves nothing.
"""

import argparse
import sys
from importlib import import_module

from . import document
from .measures import derivation
from .peers.forward import absent
from .plans import FULL, QUICK, SECTIONS, without_slow_builds
from .report import Plan, out, records, save, tables

DERIVATION = "derivation"
COMMANDS = {
    "check": ("check", "compare the ratios of a short run with bench/baseline.json"),
    "count": ("count", "count instructions and compare with bench/instructions.json"),
    "misses": ("measures.misses", "count reachable targets that chasles and its peers miss"),
    "arms": ("measures.random_arms", "time the inverses of random arms"),
    "studies": ("measures.studies", "compare workspaces and reach with plain loops"),
    "nearest": ("measures.nearest", "compare ik_nearest with ik, in C and from Python"),
    "autodiff": ("measures.autodiff", "compare JAX and PyTorch with the batches in C"),
    "exports": ("measures.exports", "compare exported C++ with the generated C"),
    "view": ("measures.frames", "time the computation of a frame of the live view"),
}
"""Maps each command to (module with a function ``run``, help text)."""


def main() -> int:
    options = vars(_parser().parse_args())
    command, quick, only = (options.pop(name) for name in ("command", "quick", "only"))
    if command:
        # Import only the module of this command, because the modules of other commands may need
        # packages that are not installed.
        module = import_module(f".{COMMANDS[command][0]}", __package__)
        return int(module.run(**options))
    if quick:
        measure(without_slow_builds(QUICK), only, keep=False)
    else:
        measure(FULL, only, keep=True)
        document.write()
    return 0


def measure(plan: Plan, only: str | None, keep: bool) -> None:
    """Run benchmarks, print the results, and save the results if requested."""
    for name, install in absent().items():
        out.print(f"{name} is not installed and not compared: pip install {install}", markup=False)
    for name in plan.leave_out - absent().keys():
        out.print(f"{name} is skipped (long compile time); `make bench` compiles it once")
    for name in [only] if only else [*SECTIONS, DERIVATION]:
        content = derivation.run(plan) if name == DERIVATION else compared(plan, name)
        if keep:
            save(name, content)


def compared(plan: Plan, name: str) -> dict[str, object]:
    """Print and return the ratios and limits of a benchmark."""
    title, run = SECTIONS[name]
    found = run(plan)
    tables(title, found)
    return {"rounds": plan.rounds, "found": records(found)}


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m bench", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="few rounds, as a test")
    parser.add_argument("--only", choices=[*SECTIONS, DERIVATION], help="one benchmark")
    commands = parser.add_subparsers(dest="command", metavar="command")
    added = {name: commands.add_parser(name, help=text) for name, (_, text) in COMMANDS.items()}
    for name in ("check", "count"):
        added[name].add_argument("--write", action="store_true", help="write the expected values")
    added["misses"].add_argument("--quick", dest="short", action="store_true", help="small sets")
    added["misses"].add_argument("--robot", help="one robot")
    added["arms"].add_argument("--count", type=int, default=50, help="number of arms")
    added["arms"].add_argument("--first", type=int, default=0, help="number of the first arm")
    added["studies"].add_argument(
        "--samples", type=int, default=10_000_000, help="configurations of a workspace"
    )
    added["view"].add_argument("robots", nargs="*", help="names or files; default: all shipped")
    return parser


if __name__ == "__main__":
    sys.exit(main())
