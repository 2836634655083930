"""Implements ``chasles-derive``: robot files in, generated folders out."""

import os
import time
from collections.abc import Iterable
from dataclasses import replace
from enum import StrEnum
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from .build.freshness import GENERATED, Job, is_up_to_date, write_sources
from .description.shipped_files import ROBOTS, SHELF, located, robot_names
from .model.errors import ChaslesError

if TYPE_CHECKING:
    from .build.jobs import Report

LIMIT = 300.0
"""Time limit per robot in seconds, about sixty times the derivation time of a six-axis arm on one
core."""


class Detail(StrEnum):
    """Levels of detail of an article."""

    FULL = "full"
    BRIEF = "brief"
    NONE = "none"


app = typer.Typer(pretty_exceptions_enable=False)
out = Console(highlight=False, soft_wrap=True)
err = Console(highlight=False, soft_wrap=True, stderr=True)


@app.command()
def derive(
    robots: Annotated[
        list[str] | None,
        typer.Argument(
            help="Robots by name, robot:NAME of robot_descriptions, or files (.toml, .urdf, "
            ".xacro and its arguments as name:=value, .xml of MuJoCo). "
            "Default: all shipped robots.",
            autocompletion=lambda: [*robot_names(ROBOTS), *robot_names(SHELF)],
        ),
    ] = None,
    to: Annotated[
        Path | None,
        typer.Option(
            help="Output folder, with one folder per robot. Shipped robots do not need it."
        ),
    ] = None,
    shelf: Annotated[
        bool,
        typer.Option("--shelf", help="All arms of the shelf; with --to, --explain, --conventions."),
    ] = False,
    functions: Annotated[
        str, typer.Option(help="Functions to derive, separated by commas. Default: all.")
    ] = "",
    fixed: Annotated[
        str,
        typer.Option(
            help="Fixed joints, separated by commas; ik takes their values after the pose. "
            "Default: the joints that a redundant robot needs."
        ),
    ] = "",
    base: Annotated[
        str | None, typer.Option(help="Base link in a tree of links. Default: its root.")
    ] = None,
    tip: Annotated[
        list[str] | None,
        typer.Option(
            help="Tip link in a tree of links; several tips define several robots. "
            "Default: the end of the longest chain."
        ),
    ] = None,
    group: Annotated[
        list[str] | None, typer.Option(help="Group of an SRDF instead of base and tip.")
    ] = None,
    srdf: Annotated[
        Path | None,
        typer.Option(
            exists=True,
            dir_okay=False,
            help="File with the groups. Default: the SRDF next to the robot's file.",
        ),
    ] = None,
    name: Annotated[
        str | None, typer.Option(help="Name of the robot. Default: the name in its file.")
    ] = None,
    calibration: Annotated[
        Path | None,
        typer.Option(
            exists=True,
            dir_okay=False,
            help="Factory calibration of a UR arm: the .yaml of its ROS driver or its "
            "calibration.conf.",
        ),
    ] = None,
    exact: Annotated[
        bool,
        typer.Option(
            "--exact", help="Take all numbers as written, without snapping to exact values."
        ),
    ] = False,
    parametric: Annotated[
        bool,
        typer.Option(
            "--parametric",
            help="Also functions with geometry as input, such as fk_p; calibration needs them.",
        ),
    ] = False,
    detail: Annotated[
        Detail,
        typer.Option(
            help="The article: full, brief without screws, examples, singularities, or none."
        ),
    ] = Detail.FULL,
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
    time_limit: Annotated[
        float,
        typer.Option(min=0, help="Time limit per robot in seconds; 0 is no limit."),
    ] = LIMIT,
    up_to_date: Annotated[
        bool,
        typer.Option("--up-to-date", help="Write nothing; fail if generated files differ."),
    ] = False,
    explain: Annotated[
        bool,
        typer.Option(
            "--explain", help="Write nothing; report the structure and the inverse of each robot."
        ),
    ] = False,
    conventions: Annotated[
        bool,
        typer.Option(
            "--conventions",
            help="Write nothing; report the best convention for calibrating each joint.",
        ),
    ] = False,
    no_progress: Annotated[bool, typer.Option("--no-progress", help="No progress bar.")] = False,
    sources: Annotated[Path | None, typer.Option(hidden=True)] = None,
) -> None:
    """Derives robots: equations, LaTeX, C and a Python package each.

    Skips robots that are up to date. An invalid description stops the run before a file is written.
    """
    started = time.perf_counter()
    if group and (base or tip):
        _stop("--group chooses base and tip: give a group, or --base and --tip")
    named = [*(robots or []), *(robot_names(SHELF) if shelf else [])]
    files = _files(named or robot_names(ROBOTS))
    says = explain or conventions
    folder = (
        GENERATED
        if says
        else _target([file for file, _ in files], to, calibration or fixed or languages)
    )
    asked = [
        Job(
            file,
            folder,
            base,
            functions=_listed(functions),
            arguments=words,
            calibration=calibration,
            exact=exact,
            fixed=_listed(fixed),
            parametric=parametric,
            detail=detail.value,
            time_limit=time_limit,
            languages=_listed(languages),
            name=name,
        )
        for file, words in files
    ]
    due = list(dict.fromkeys(_each_robot(asked, tip or [], group or [], srdf)))
    if says:
        _say(due, inverse=explain, conventions=conventions)
        return
    if not up_to_date:
        due = [job for job in due if not is_up_to_date(job)]
    if not due:
        out.print("nothing to derive: all is up to date")
        return
    # Imports SymPy and CasADi only if a robot has to be derived.
    from .build import jobs as work  # noqa: PLC0415

    problems = work.problems(due)
    if problems:
        _stop("\n".join([*problems, "nothing was written"]))
    _make(folder)
    if sources is not None:
        write_sources(due[0], sources)
    if len(due) > 1 and not out.is_terminal:
        # Without a progress bar, a pipe would be silent until the first robot is done.
        out.print(f"deriving {_counted(due)}")
    results = work.compared(due, jobs) if up_to_date else work.derived(due, jobs)
    good = _show(results, len(due), shows_bar=out.is_terminal and not no_progress)
    orphans = work.orphans(due, folder) if up_to_date and not named else []
    if orphans:
        _stop(f"{folder}: no description for {', '.join(orphans)}")
    if not good:
        if len(due) == 1 and not up_to_date:
            # The error message of the robot has already stated the reason.
            raise typer.Exit(1)
        _stop("derive again what is out of date" if up_to_date else "some robots failed")
    done = "compared" if up_to_date else f"written to {folder}"
    out.print(f"{_counted(due)} {done}, {time.perf_counter() - started:.1f} s")


def main() -> None:
    """Runs the console script."""
    app()


def _counted(jobs: list[Job]) -> str:
    return f"{len(jobs)} robot{'s' if len(jobs) > 1 else ''}"


def _say(asked: list[Job], *, inverse: bool, conventions: bool) -> None:
    from .build import jobs as work  # noqa: PLC0415

    problems = work.problems(asked)
    if problems:
        _stop("\n".join(problems))
    explained = work.explained(asked) if inverse else ()
    for report in chain(explained, work.judged(asked) if conventions else ()):
        if not report.good:
            _stop(report.line)
        out.print(report.line, end="\n\n", markup=False)
        _warn(report)


def _listed(names: str) -> tuple[str, ...]:
    return tuple(name.strip() for name in names.split(",") if name.strip())


def _target(files: list[Path], to: Path | None, changed: object) -> Path:
    """Returns the output folder: the package's own folder for unmodified shipped robots."""
    own = [file for file in files if file.parent != ROBOTS or changed]
    if to is None and own:
        _stop(f"{own[0]}: --to FOLDER is required, except for unmodified shipped robots")
    return to or GENERATED


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        _stop(f"{folder}: expected a folder that can be written to ({error.strerror})")


def _files(words: Iterable[str]) -> list[tuple[Path, tuple[str, ...]]]:
    """Returns the files on the command line, each with its arguments."""
    files: list[tuple[Path, tuple[str, ...]]] = []
    for word in words:
        if ":=" not in word:
            files.append(_file(word))
        elif files:
            files[-1] = (files[-1][0], (*files[-1][1], word))
        else:
            _stop(f"{word}: expected a xacro file before its arguments")
    return files


def _file(robot: str) -> tuple[Path, tuple[str, ...]]:
    try:
        file, arguments = located(robot)
    except ChaslesError as error:
        _stop(str(error))
    if not file.is_file():
        _stop(f"{robot}: no such file")
    return file, arguments


def _each_robot(
    jobs: list[Job], tips: list[str], groups: list[str], srdf: Path | None
) -> list[Job]:
    """Returns the jobs for all robots of all files, without reading single-robot files."""
    if not groups and all(job.file.suffix.lower() == ".toml" for job in jobs):
        return [replace(job, tip=tips[0] if tips else None) for job in jobs]
    from .build.jobs import robots_of  # noqa: PLC0415

    found: list[Job] = []
    problems = []
    for job in jobs:
        try:
            found += robots_of(job, tips, groups, srdf)
        except ChaslesError as error:
            problems.append(str(error))
    if problems:
        _stop("\n".join([*problems, "nothing was written"]))
    return found


def _show(results: Iterable["Report"], total: int, *, shows_bar: bool) -> bool:
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


def _warn(report: "Report") -> None:
    if report.warning:
        err.print(report.warning, style="yellow", markup=False)


def _stop(message: str) -> NoReturn:
    err.print(message, style="red", markup=False)
    raise typer.Exit(1)
