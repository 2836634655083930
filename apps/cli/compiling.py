"""The subcommands of the compiler: `derive`, `explain`, `check`, `convert`, `export` and `new`."""

from __future__ import annotations

import os
import time
from collections.abc import Iterable
from dataclasses import asdict, replace
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from chasles import ChaslesError
from chasles.contract import make_folder, output_file, requires

from .console import err, out, print_json, say, stop
from .options import DEFAULT_TIP, Base, Exact, Json, Robot, Robots, Tip, add, listed

if TYPE_CHECKING:
    from chasles.derive import Finding
    from chasles.derive.build import Job, Report

LIMIT = 300.0
"""Time limit per robot in seconds, about sixty times the derivation time of a six-axis arm on one
core."""

Tips = Annotated[
    list[str] | None,
    typer.Option(
        metavar="LINK",
        help="Tip link in a tree of links; several tips define several robots. "
        "Default: " + DEFAULT_TIP,
    ),
]
Groups = Annotated[list[str] | None, typer.Option(help="Group of an SRDF instead of base and tip.")]
Srdf = Annotated[
    Path | None,
    typer.Option(
        exists=True,
        dir_okay=False,
        help="File with the groups. Default: the SRDF next to the robot's file.",
    ),
]
FixedNames = Annotated[
    str,
    typer.Option(
        help="Fixed joints, separated by commas; ik takes their values after the pose. "
        "Default: the joints that a redundant robot needs."
    ),
]
Calibration = Annotated[
    Path | None,
    typer.Option(
        exists=True,
        dir_okay=False,
        help="Factory calibration of a UR arm: the .yaml of its ROS driver or its "
        "calibration.conf.",
    ),
]
TimeLimit = Annotated[
    float, typer.Option(min=0, help="Time limit per robot in seconds; 0 is no limit.")
]
Name = Annotated[str | None, typer.Option(help="Name of the robot. Default: the name in its file.")]


def add_to(app: typer.Typer) -> None:
    """Add the subcommands to the command line."""
    add(app, derive, "chasles derive arm.urdf --to robots")
    add(app, explain, "chasles explain panda")
    add(app, check, "chasles check my_arm.toml")
    add(app, convert, "chasles convert panda --to panda.dh.csv")
    add(app, export, "chasles export casadi_c panda --to out")
    add(app, new, "chasles new dh --to my_arm.toml")


def derive(
    robots: Robots,
    to: Annotated[
        Path | None,
        typer.Option(
            help="Output folder, with one folder per robot. Shipped robots do not need it."
        ),
    ] = None,
    functions: Annotated[
        str, typer.Option(help="Functions to derive, separated by commas. Default: all.")
    ] = "",
    fixed: FixedNames = "",
    base: Base = None,
    tip: Tips = None,
    group: Groups = None,
    srdf: Srdf = None,
    name: Name = None,
    calibration: Calibration = None,
    exact: Exact = False,
    parametric: Annotated[
        bool,
        typer.Option(
            "--parametric",
            help="Also functions with geometry as input, such as fk_p; calibration needs them.",
        ),
    ] = False,
    detail: Annotated[
        Literal["full", "brief", "none"],
        typer.Option(
            help="The article: full, brief without screws, examples, singularities, or none."
        ),
    ] = "full",
    languages: Annotated[
        str,
        typer.Option(
            help="Languages to write, separated by commas; casadi_c is CasADi's own C. "
            "Default: c,casadi,python,latex."
        ),
    ] = "",
    jobs: Annotated[
        int, typer.Option(min=1, help="Number of robots to derive in parallel.")
    ] = os.cpu_count() or 1,
    time_limit: TimeLimit = LIMIT,
    up_to_date: Annotated[
        bool,
        typer.Option("--up-to-date", help="Write nothing; fail if generated files differ."),
    ] = False,
    no_progress: Annotated[bool, typer.Option("--no-progress", help="No progress bar.")] = False,
    sources: Annotated[Path | None, typer.Option(hidden=True)] = None,
) -> None:
    """Derive the equations, LaTeX, C and Python package of each robot.

    Robots that are up to date are skipped. An invalid description stops the command before a file
    is written.
    """
    changed = bool(calibration or fixed or languages)
    files = _files(robots)
    job = _job(
        to=_target([file for file, _ in files], to, changed),
        base=base,
        functions=listed(functions),
        calibration=calibration,
        exact=exact,
        fixed=listed(fixed),
        parametric=parametric,
        detail=detail,
        time_limit=time_limit,
        languages=listed(languages),
        name=name,
    )
    due = _each_robot(job, files, tip, group, srdf)
    if up_to_date:
        _compare(due, jobs, shows_bar=out.is_terminal and not no_progress)
    else:
        _write(due, jobs, sources, shows_bar=out.is_terminal and not no_progress)


def explain(
    robots: Robots,
    fixed: FixedNames = "",
    conventions: Annotated[
        bool,
        typer.Option(
            "--conventions", help="Instead, the best convention for calibrating each joint."
        ),
    ] = False,
    base: Base = None,
    tip: Tips = None,
    group: Groups = None,
    srdf: Srdf = None,
    name: Name = None,
    exact: Exact = False,
    time_limit: TimeLimit = LIMIT,
) -> None:
    """Explain the structure and the inverse of robots, and write nothing."""
    from chasles.derive.build import GENERATED  # noqa: PLC0415

    job = _job(
        to=GENERATED, base=base, fixed=listed(fixed), exact=exact, name=name, time_limit=time_limit
    )
    due = _each_robot(job, _files(robots), tip, group, srdf)
    work = _work()
    _stop_at_problems(due, "")
    for report in work.judged(due) if conventions else work.explained(due):
        if not report.good:
            stop(report.line)
        out.print(report.line, end="\n\n", markup=False)
        _warn(report)


def check(
    robots: Robots,
    base: Base = None,
    tip: Tip = None,
    as_json: Json = False,
) -> None:
    """Report all errors of robot descriptions, and write nothing."""
    with requires("chasles[derive]"):
        from chasles.derive import check as findings_of  # noqa: PLC0415
    found: list[Finding] = []
    for file, arguments in _files(robots):
        findings = findings_of(file, base=base, tip=tip, arguments=arguments)
        found += findings
        if not (as_json or any(finding.severity == "error" for finding in findings)):
            say(f"{file}: no errors")
        for finding in () if as_json else findings:
            style = "" if finding.severity == "error" else "yellow"
            err.print(str(finding), style=style, markup=False)
    if as_json:
        print_json([asdict(finding) for finding in found])
    if any(finding.severity == "error" for finding in found):
        raise typer.Exit(1)


def convert(
    robot: Robot,
    to: Annotated[
        str,
        typer.Option(
            metavar="FILE|FORMAT",
            help="Format to print: toml, urdf, dh, mdh or poe. Or a file with the format in its "
            "name: arm.toml, arm.urdf, and arm.dh.toml, arm.dh.csv, arm.dh.tex for a table.",
        ),
    ],
    base: Base = None,
    tip: Tip = None,
    name: Name = None,
    exact: Exact = False,
) -> None:
    """Write a serial robot in another format, or as a table of joint parameters."""
    with requires("chasles[derive]"):
        from chasles.derive import convert as converted  # noqa: PLC0415
        from chasles.derive import read  # noqa: PLC0415
    words = Path(to).name.split(".")
    is_table = words[-1] in ("csv", "tex") or words[-2:-1] in (["dh"], ["mdh"], ["poe"])
    form: Any = words[-2] if is_table and len(words) > 1 else words[-1]
    if words[-1] in ("csv", "tex") and form not in ("dh", "mdh", "poe"):
        named = Path(to).with_suffix(f".dh.{words[-1]}")
        stop(f"{to}: expected a file name with the convention dh, mdh or poe, such as {named}")
    found = converted(read(robot, base=base, tip=tip, name=name, exact=exact), form)
    for note in found.notes:
        err.print(note, style="yellow", markup=False)
    if len(words) == 1:
        print(found.text, end="")
    else:
        found.save(to)
        say(f"written: {to}")


def export(
    language: Annotated[str, typer.Argument(help="The language, such as c, cpp or latex.")],
    robots: Robots,
    to: Annotated[Path, typer.Option(help="Output folder, with one folder per robot.")],
    functions: Annotated[
        str, typer.Option(help="Functions to export, separated by commas. Default: all.")
    ] = "",
    real: Annotated[
        Literal["double", "float"],
        typer.Option(help="Numbers of the language c; float is C for microcontrollers."),
    ] = "double",
    fixed: FixedNames = "",
    base: Base = None,
    tip: Tips = None,
    name: Name = None,
    exact: Exact = False,
    time_limit: TimeLimit = LIMIT,
) -> None:
    """Write the functions of robots in one language."""
    if real == "float" and language != "c":
        stop(f"--real float: {language} is written in double precision; use the language c")
    job = _job(
        to=to,
        base=base,
        functions=listed(functions),
        fixed=listed(fixed),
        exact=exact,
        languages=("c_float",) if real == "float" else listed(language),
        name=name,
        time_limit=time_limit,
    )
    due = _each_robot(job, _files(robots), tip, None, None)
    _write(due, os.cpu_count() or 1, None, shows_bar=out.is_terminal)


def new(
    kind: Annotated[Literal["arm", "dh", "mechanism"], typer.Argument(help="Kind of the robot.")],
    to: Annotated[Path | None, typer.Option(help="File to write. Default: KIND.toml.")] = None,
) -> None:
    """Write a commented robot file to start from."""
    from chasles.derive import template  # noqa: PLC0415

    file = to or Path(f"{kind}.toml")
    with output_file(file, is_new=True) as target:
        target.write_text(template(kind), encoding="utf-8")
    say(f"written: {file}; continue with: chasles explain {file}")


def _work() -> ModuleType:
    """Import SymPy and CasADi only when a robot is derived."""
    with requires("chasles[derive]"):
        from chasles.derive.build import jobs  # noqa: PLC0415
    return jobs


def _job(**fields: Any) -> Job:
    from chasles.derive.build import Job  # noqa: PLC0415

    return Job(Path(), **fields)


def _write(due: list[Job], workers: int, sources: Path | None, *, shows_bar: bool) -> None:
    from chasles.derive.build import is_up_to_date, write_sources  # noqa: PLC0415

    started = time.perf_counter()
    due = [job for job in due if not is_up_to_date(job)]
    if not due:
        say("nothing to derive: all is up to date")
        return
    work = _work()
    _stop_at_problems(due, "nothing was written")
    folder = due[0].to
    make_folder(folder)
    if sources is not None:
        write_sources(due[0], sources)
    _announce(due)
    if not _show(work.derived(due, workers), len(due), shows_bar=shows_bar):
        if len(due) == 1:
            # The error message has already stated the reason for this exit.
            raise typer.Exit(1)
        stop("some robots failed")
    say(f"{_counted(due)} written to {folder}, {time.perf_counter() - started:.1f} s")


def _compare(due: list[Job], workers: int, *, shows_bar: bool) -> None:
    from chasles.derive.build import GENERATED, ROBOTS  # noqa: PLC0415

    started = time.perf_counter()
    work = _work()
    _stop_at_problems(due, "")
    _announce(due)
    good = _show(work.compared(due, workers), len(due), shows_bar=shows_bar)
    folder = due[0].to
    # Generated folders without a robot file can be found only if all shipped robots are compared.
    is_complete = set(ROBOTS.glob("*.toml")) <= {job.file.resolve() for job in due}
    orphans = work.orphans(due, folder) if folder == GENERATED and is_complete else []
    if orphans:
        stop(f"{folder}: no description for {', '.join(orphans)}")
    if not good:
        stop("derive again what is out of date")
    say(f"{_counted(due)} compared, {time.perf_counter() - started:.1f} s")


def _stop_at_problems(due: list[Job], ending: str) -> None:
    problems = _work().problems(due)
    if problems:
        stop("\n".join([*problems, ending]).rstrip())


def _announce(due: list[Job]) -> None:
    if len(due) > 1 and not out.is_terminal:
        # Without a progress bar, the next output appears when the first robot is complete.
        say(f"deriving {_counted(due)}")


def _counted(jobs: list[Job]) -> str:
    return f"{len(jobs)} robot{'s' if len(jobs) > 1 else ''}"


def _target(files: list[Path], to: Path | None, changed: bool) -> Path:
    """Return the output folder of the robots."""
    from chasles.derive.build import GENERATED, ROBOTS  # noqa: PLC0415

    own = [file for file in files if file.parent.resolve() != ROBOTS or changed]
    if to is None and own:
        stop(f"{own[0]}: --to FOLDER is required, except for unmodified shipped robots")
    return to or GENERATED


def _files(words: Iterable[str]) -> list[tuple[Path, tuple[str, ...]]]:
    """Return the robot files, each with the xacro arguments that follow the file."""
    files: list[tuple[Path, tuple[str, ...]]] = []
    for word in words:
        if ":=" not in word:
            files.append(_file(word))
        elif files:
            files[-1] = (files[-1][0], (*files[-1][1], word))
        else:
            stop(f"{word}: expected a xacro file before its arguments")
    return files


def _file(robot: str) -> tuple[Path, tuple[str, ...]]:
    from chasles.derive.build import located  # noqa: PLC0415

    file, arguments = located(robot)
    if not file.is_file():
        stop(f"{robot}: no such file")
    return file, arguments


def _each_robot(
    job: Job,
    files: list[tuple[Path, tuple[str, ...]]],
    tips: list[str] | None,
    groups: list[str] | None,
    srdf: Path | None,
) -> list[Job]:
    """Return the jobs for all robots of all files."""
    if groups and (job.base or tips):
        stop("--group chooses base and tip: give a group, or --base and --tip")
    jobs = [replace(job, file=file, arguments=words) for file, words in files]
    if not groups and not tips and all(one.file.suffix.lower() == ".toml" for one in jobs):
        return list(dict.fromkeys(jobs))
    work, found, problems = _work(), [], []
    for one in jobs:
        try:
            found += work.robots_of(one, tips or [], groups or [], srdf)
        except ChaslesError as error:
            problems.append(str(error))
    if problems:
        stop("\n".join([*problems, "nothing was written"]))
    return list(dict.fromkeys(found))


def _show(results: Iterable[Report], total: int, *, shows_bar: bool) -> bool:
    good = True
    columns = (TextColumn("deriving"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=out, transient=True, disable=not shows_bar) as progress:
        bar = progress.add_task("deriving", total=total)
        for report in results:
            good &= report.good
            progress.console.print(report.line, markup=False)
            _warn(report)
            progress.advance(bar)
    return good


def _warn(report: Report) -> None:
    if report.warning:
        err.print(report.warning, style="yellow", markup=False)
