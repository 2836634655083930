"""``python -m bench``: every benchmark, its tables printed and saved in bench/results/.

The figures in docs/performance.md are replaced by the new ones. With --quick nothing is saved.
"""

import argparse
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import chasles
from tests.campaigns import calibration as calibrations
from tests.campaigns import (
    cleaned_files,
    displaced_arms,
    field,
    general_arms,
    loop_numbers,
    losses,
    mechanism_branches,
    misses,
    planar_modes,
    platform_modes,
)
from tests.campaigns import tracker as tracker_sets
from tests.campaigns.as_built import (
    any_geometry,
    attempts,
    built_arms,
    built_robots,
    open_loops,
    single_errors,
)
from tests.support.generators.poses import CASES

from . import check, count, document
from .measures import derivation, frames, scenes, studies
from .peers.forward import absent
from .plans import FULL, QUICK, SECTIONS, without_slow_builds
from .report import Plan, out, records, save, tables

DERIVATION = "derivation"
ARMS = 50
"""Number of random arms, of which about a sixth have a structure."""
MUTANTS = 200
MECHANISMS = 500
CONFIGURATIONS = 1_000_000


COMMANDS: dict[str, Callable[[argparse.Namespace], int]] = {
    "check": lambda o: check.run(o.write),
    "count": lambda o: count.run(o.write),
    "misses": lambda o: misses.run(o.quick, o.robot),
    "field": lambda o: field.run(o.quick, o.arm),
    "general": general_arms.run,
    "geometries": lambda o: any_geometry.run(o.first, o.seeds, o.slides, o.longs, o.poses),
    "platforms": lambda o: platform_modes.run(o.count, o.starts, o.seed),
    "planar": lambda o: planar_modes.run(o.count, o.starts, o.seed),
    "displaced": lambda o: displaced_arms.run(
        range(o.first, o.first + o.draws), o.poses, o.singles, drawn=o.drawn
    ),
    "studies": lambda o: studies.run(o.samples),
    "scenes": lambda o: scenes.run(o.count),
    "view": lambda o: frames.run(tuple(o.robots) or tuple(chasles.robots())),
    "calibration": lambda o: calibrations.run(o.runs, o.robots or ("ur5e",)),
    "tracker": lambda o: tracker_sets.run(tuple(o.robots) or tracker_sets.ARMS, o.seeds),
    "losses": lambda o: losses.run(o.arms, o.first, given=o.given),
    "mechanisms": lambda o: mechanism_branches.run(o.count, o.first),
    "loops": lambda o: loop_numbers.run(o.count),
    "mutants": lambda o: cleaned_files.run(o.urdfs, o.count, o.first),
    "as_built": lambda o: (
        single_errors.run(o.once)
        if o.once is not None
        else (built_arms if o.arms else built_robots).run(o.draws, o.first)
    ),
    "least_squares": lambda o: open_loops.run(o.draws, o.first),
    "robust": lambda o: attempts.run(o.folder, o.files, o.derived, o.arms, o.seed),
}
"""The benchmarks with a command of their own."""


def main() -> int:
    """Runs the benchmarks that the command line selects; returns the exit status."""
    options = _parser().parse_args()
    if options.command:
        return COMMANDS[options.command](options)
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
    axes = commands.add_parser("geometries", help="such arms of every pattern of axes, uncompiled")
    for name, default in (
        *(("first", 0), ("seeds", 1), ("slides", 1)),
        *(("longs", 20), ("poses", 1000)),
    ):
        axes.add_argument(f"--{name}", type=int, default=default)
    held = commands.add_parser("platforms", help="modes of platforms on six rods, judged and timed")
    held.add_argument("--count", type=int, default=platform_modes.COUNT, help="number of platforms")
    held.add_argument("--starts", type=int, default=platform_modes.STARTS, help="of the iteration")
    held.add_argument("--seed", type=int, default=0)
    legs = commands.add_parser("planar", help="modes of planar platforms on legs of all kinds")
    legs.add_argument("--count", type=int, default=planar_modes.COUNT, help="number of platforms")
    legs.add_argument("--starts", type=int, default=planar_modes.STARTS, help="of the iteration")
    legs.add_argument("--seed", type=int, default=0, help="of the first platform")
    _add_sweeps(commands)
    return parser


def _add_sweeps(commands: Any) -> None:
    """The commands that draw robots by their numbers."""
    drawn = commands.add_parser("calibration", help="identification of drawn arms")
    drawn.add_argument("robots", nargs="*", help="names or descriptions; ur5e if none")
    drawn.add_argument("--runs", type=int, default=200, help="drawn arms of each kind")
    off = commands.add_parser("displaced", help="arms with random errors, judged and timed")
    for name, default in (("draws", 30), ("first", 0), ("poses", 10_000), ("singles", 1000)):
        off.add_argument(f"--{name}", type=int, default=default)
    off.add_argument("--drawn", action="store_true", help="arms of round numbers instead")
    studied = commands.add_parser("studies", help="workspaces and reach beside plain loops")
    studied.add_argument("--samples", type=int, default=10_000_000, help="postures of a workspace")
    among = commands.add_parser("scenes", help="paths of robots with loops among obstacles")
    among.add_argument("--count", type=int, default=100, help="number of random scenes")
    shown = commands.add_parser("view", help="the computing for a frame of the live view")
    shown.add_argument("robots", nargs="*", help="names or descriptions; all shipped ones if none")
    tracked = commands.add_parser("tracker", help="simulated sets of a laser tracker")
    tracked.add_argument("robots", nargs="*", help="names or descriptions")
    tracked.add_argument("--seeds", type=int, default=3, help="drawn arms of each robot")
    arms = commands.add_parser("losses", help="poses that inverses of random arms lose")
    arms.add_argument("--arms", type=int, default=ARMS, help="number of arms")
    arms.add_argument("--first", type=int, default=0, help="number of the first arm")
    arms.add_argument("--given", action="store_true", help="joints are given by chance")
    loops = commands.add_parser("mechanisms", help="branches of drawn mechanisms, one to one")
    loops.add_argument("--count", type=int, default=MECHANISMS, help="number of mechanisms")
    loops.add_argument("--first", type=int, default=0, help="number of the first mechanism")
    far = commands.add_parser("loops", help="configurations of robots with loops, far out of reach")
    far.add_argument("--count", type=int, default=CONFIGURATIONS, help="number for each robot")
    mutants = commands.add_parser("mutants", help="mutated URDFs: structure and pose error")
    mutants.add_argument("--urdfs", type=Path, help="folder of URDFs besides the shipped robots")
    mutants.add_argument("--count", type=int, default=MUTANTS, help="number of mutants")
    mutants.add_argument("--first", type=int, default=0, help="number of the first mutant")
    built = commands.add_parser("as_built", help="a robot with loops as built, derived and judged")
    built.add_argument("--draws", type=int, default=100, help="number of draws")
    built.add_argument("--first", type=int, default=0, help="number of the first draw")
    built.add_argument("--arms", action="store_true", help="arms that rods and cylinders drive")
    alone = "each error alone instead, of these robots; of all with loops if none is named"
    built.add_argument("--once", nargs="*", metavar="ROBOT", help=alone)
    open_ = commands.add_parser("least_squares", help="overconstrained loops that cannot close")
    open_.add_argument("--draws", type=int, default=60, help="number of draws")
    open_.add_argument("--first", type=int, default=0, help="number of the first draw")
    robust = commands.add_parser("robust", help="read and derive mutated files and round arms")
    robust.add_argument("folder", type=Path, help="more .toml and .urdf files; crashes are kept")
    for name, default in (("files", 5_000), ("derived", 50), ("arms", 500), ("seed", 0)):
        robust.add_argument(f"--{name}", type=int, default=default)


if __name__ == "__main__":
    sys.exit(main())
