"""The commands of the command line and their options."""

from __future__ import annotations

import argparse
import io
import json
import os
import sys
import time
import tomllib
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from chasles import ChaslesError, InputValueError, load, robots
from chasles.contract import Argument, Manifest, read_manifest
from chasles.library import build, find_folder, is_description, options_of, shelf, shipped_folders

USAGE = 2
"""Exit status without a command, equal to the status of argparse for invalid arguments."""
_ASKED_BY_A_SHELL = "_ARGCOMPLETE"
"""Environment variable that argcomplete sets for shell completion."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: The arguments after the program name, or None for the arguments of the process.

    Returns:
        The exit status: 0 for success, 1 after an error, 2 without a command.
    """
    parser = _parser()
    if _ASKED_BY_A_SHELL in os.environ:
        # Optional package; only completion needs it.
        from .completion import complete  # noqa: PLC0415

        complete(parser)
    options = parser.parse_args(arguments)
    if isinstance(sys.stdout, io.TextIOWrapper):
        # A reader of a pipe receives each line immediately.
        sys.stdout.reconfigure(line_buffering=True)
    if options.command is None:
        parser.print_help(sys.stderr)
        return USAGE
    try:
        status: int = options.run(options)
        sys.stdout.flush()
    except ChaslesError as error:
        print(f"chasles: {error}", file=sys.stderr)
        return 1
    except BrokenPipeError:
        # The reader (head, less) closed the pipe; this avoids an error message at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        print(f"chasles: {error.filename}: {error.strerror}", file=sys.stderr)
        return 1
    return status


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="chasles", description="Generated robot kinematics.")
    commands = parser.add_subparsers(dest="command", metavar="command")
    links = argparse.ArgumentParser(add_help=False)
    links.add_argument("--base", metavar="LINK", help="base link of a URDF, xacro or MJCF file")
    links.add_argument("--tip", metavar="LINK", help="tip link of a URDF, xacro or MJCF file")
    links.add_argument("--exact", action="store_true", help="do not snap numbers to exact values")
    json_ = argparse.ArgumentParser(add_help=False)
    json_.add_argument("--json", action="store_true", help="print machine-readable results")
    build_ = commands.add_parser("build", parents=[links], help="compile robots into the cache")
    build_.add_argument("--threads", type=int, default=2, help="robots at once; 2 by default")
    build_.add_argument(
        "robots", nargs="*", help="names, folders or descriptions; all generated ones if none"
    )
    build_.set_defaults(run=_build)
    calibrate = commands.add_parser(
        "calibrate", help="identify a robot from a table of measured positions or poses"
    )
    calibrate.add_argument("measurements", type=Path, help=".csv with units in its header")
    calibrate.add_argument("--robot", required=True, help="name or description of the robot")
    calibrate.add_argument("--to", type=Path, help="robot file (.toml) to write")
    calibrate.add_argument(
        "--vary",
        action="append",
        metavar="GROUP",
        help="parameters or groups: geometry, axis, loop, joint, offset, transmission; default: "
        "the model with the smallest cross-validation error",
    )
    calibrate.add_argument("--report", type=Path, help="report (.html or .tex) to write")
    calibrate.set_defaults(run=_calibrate)
    info = commands.add_parser("info", parents=[links, json_], help="show the functions of a robot")
    info.add_argument("robot", help="name, folder or description")
    info.set_defaults(run=_info)
    names = "show the robots that can be loaded by name"
    list_ = commands.add_parser("list", parents=[json_], help=names)
    list_.set_defaults(run=_list)
    view = commands.add_parser("view", parents=[links], help="show a moving robot in the browser")
    view.add_argument("robot", help="name, folder or description")
    view.add_argument("--html", type=Path, help="write a self-contained page instead")
    view.add_argument("--play", type=Path, help="motion (.npz) or table of coordinates (.csv)")
    view.add_argument("--port", type=int, help="port of the page; default: any free port")
    view.set_defaults(run=_view)
    return parser


def _manifest(robot: str, options: argparse.Namespace) -> Manifest:
    words = options_of(options.exact, parametric=False, base=options.base, tip=options.tip)
    return read_manifest(find_folder(robot, words))


def _build(options: argparse.Namespace) -> int:
    manifests = [_manifest(robot, options) for robot in options.robots or robots()]
    # Threads suffice: the compiler does the work, in processes of its own.
    with ThreadPoolExecutor(max(1, options.threads)) as pool:
        failed = 0
        for report in pool.map(_build_one, manifests):
            print(report.line, flush=True, file=sys.stderr if report.failed else sys.stdout)
            failed += report.failed
    return 1 if failed else 0


def _calibrate(options: argparse.Namespace) -> int:
    # SciPy is optional and takes a second to import.
    from chasles import calibration  # noqa: PLC0415

    robot = load(options.robot, parametric=True)
    measured = calibration.read_measurements(options.measurements, robot)
    for sentence in measured.assumptions:
        print(f"{options.measurements}: {sentence}")
    q, measurements = measured.q, measured.measurements
    if options.vary:
        found = calibration.identify(robot, q, measurements, vary=options.vary)
    else:
        chosen = calibration.select_model(robot, q, measurements)
        found = chosen.calibration
        print(f"model: {chosen.model.name}")
    print(found)
    if options.report:
        found.save(options.report)
        print(f"\nwritten: {options.report}")
    if options.to:
        source = f"{robot.source}; identified from {options.measurements.name}"
        design = Path(options.robot)
        nominal = str(design.resolve()) if design.is_file() else options.robot
        found.save(options.to, source=source, nominal=nominal)
        print(f"\nwritten: {options.to}")
        is_robot = options.to.suffix == ".toml"
        if is_robot and "[[transmissions]]" in options.to.read_text(encoding="utf-8"):
            print("its functions expect true coordinates: coordinates_from_readings(r)")
    return 0


def _view(options: argparse.Namespace) -> int:
    # Other commands do not need these imports.
    from chasles.study.motion import Trajectory  # noqa: PLC0415
    from chasles.view import LiveView, write_html  # noqa: PLC0415

    robot = load(options.robot, base=options.base, tip=options.tip, exact=options.exact)
    if options.html and (options.play or options.port):
        raise InputValueError("--play and --port require the live view; omit them with --html")
    if options.html:
        write_html(robot, options.html)
        print(f"written: {options.html}")
        return 0
    trajectory = Trajectory.load(options.play, robot) if options.play else None
    file = Path(options.robot) if is_description(Path(options.robot)) else None
    shown = LiveView(robot, port=options.port, urdf=file, trajectory=trajectory)
    print(f"{robot.name}: {shown.address} (Ctrl-C stops it)", flush=True)
    try:
        shown.wait()
    except KeyboardInterrupt:
        return 0
    finally:
        shown.close()


@dataclass(frozen=True)
class _Report:
    line: str
    failed: bool


def _build_one(manifest: Manifest) -> _Report:
    start = time.perf_counter()
    try:
        result = "compiled" if build(manifest) else "in the cache"
    except ChaslesError as error:
        return _Report(f"{manifest.name}: {error}", failed=True)
    seconds = time.perf_counter() - start
    return _Report(f"{manifest.name:<24} {result:<12} {seconds:7.3f} s", failed=False)


def _info(options: argparse.Namespace) -> int:
    manifest = _manifest(options.robot, options)
    if options.json:
        print((manifest.folder / "manifest.json").read_text(encoding="utf-8"))
        return 0
    print("\n".join([f"{manifest.name}: {manifest.title}", manifest.source, *manifest.notes, ""]))
    print(f"frames: {manifest.frames.base} to {manifest.frames.tip}\n\ncoordinates (q):")
    for coordinate in manifest.coordinates:
        limits = f"{_limit(coordinate.lower, '-')} to {_limit(coordinate.upper, '')}"
        print(f"    {coordinate.name:<20} {coordinate.kind:<10} {limits} {coordinate.unit}")
    if manifest.loops.solution:
        joints = ", ".join(f"{item.name} [{item.unit}]" for item in manifest.loops.chain)
        passive = ", ".join(f"{item.name} [{item.unit}]" for item in manifest.loops.passive)
        print(f"\nloops ({manifest.loops.solution}): {', '.join(manifest.loops.names)}")
        print(f"    main chain (theta): {joints}\n    passive: {passive or 'none'}")
    print("\nparameters:")
    for parameter in manifest.parameters:
        value = f"{parameter.value:.10g} {parameter.unit}"
        print(f"    {parameter.name:<20} {value:<20} {parameter.meaning}")
    print("\nfunctions:")
    for function in manifest.functions:
        counts = ", ".join(f"{n} {kind}" for kind, n in function.operations.items() if n)
        print(f"    {function.name}({_arguments(function.inputs)})")
        print(f"        -> {_arguments(function.outputs)}")
        print(f"        {function.summary}\n        {counts}")
    return 0


def _list(options: argparse.Namespace) -> int:
    generated = {name: read_manifest(folder).title for name, folder in shipped_folders().items()}
    texts = {name: file.read_text(encoding="utf-8") for name, file in shelf().items()}
    derived = {name: str(tomllib.loads(text)["title"]) for name, text in texts.items()}
    if options.json:
        print(json.dumps({"generated": generated, "derived_on_first_use": derived}, indent=2))
        return 0
    for name, title in generated.items():
        print(f"{name:<24} {title}")
    print("\nderived on first use:")
    for name, title in derived.items():
        print(f"{name:<24} {title}")
    return 0


def _limit(limit: float | None, sign: str) -> str:
    return f"{sign}inf" if limit is None else f"{limit:.6g}"


def _arguments(arguments: Sequence[Argument]) -> str:
    return ", ".join(f"{item.name} {list(item.shape)} [{item.unit}]" for item in arguments)
