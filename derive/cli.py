"""``chasles-derive``: robot files in, generated folders out."""

import os
import time
from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from .build.freshness import ROOM, Job, is_up_to_date

if TYPE_CHECKING:
    from .build.jobs import Report

ROBOTS = ROOM / "robots"
SHELF = ROBOTS / "shelf"
"""Well-known arms, derived where they are asked for; their generated folders are not committed."""
GENERATED = ROOM.parent / "generated"

app = typer.Typer(pretty_exceptions_enable=False)
out = Console(highlight=False, soft_wrap=True)
err = Console(highlight=False, soft_wrap=True, stderr=True)


@app.command()
def derive(
    robots: Annotated[
        list[str] | None,
        typer.Argument(
            help="Robots by name, or files (.toml, .urdf). Default: all that are generated."
        ),
    ] = None,
    to: Annotated[
        Path | None,
        typer.Option(help="Folder that receives one folder a robot; shipped ones have theirs."),
    ] = None,
    shelf: Annotated[
        bool, typer.Option("--shelf", help="All arms of the shelf; with --to or --explain.")
    ] = False,
    functions: Annotated[
        str, typer.Option(help="Functions wanted, with commas between. Default: all.")
    ] = "",
    base: Annotated[str | None, typer.Option(help="Base link of a URDF.")] = None,
    tip: Annotated[str | None, typer.Option(help="Tip link of a URDF.")] = None,
    exact: Annotated[
        bool,
        typer.Option("--exact", help="Take all numbers as written: no noise dropped, no 1.5708."),
    ] = False,
    jobs: Annotated[int, typer.Option(min=1, help="Robots at once.")] = os.cpu_count() or 1,
    check: Annotated[
        bool, typer.Option("--check", help="Write nothing, compare, fail where files differ.")
    ] = False,
    explain: Annotated[
        bool,
        typer.Option("--explain", help="Write nothing, say which inverse each robot has and why."),
    ] = False,
) -> None:
    """Derives robots: equations, LaTeX, C and a Python package each.

    Skips robots that are up to date. A wrong description stops the run before a file is written.
    """
    started = time.perf_counter()
    wanted = tuple(name.strip() for name in functions.split(",") if name.strip())
    asked = [*(robots or []), *(_names(SHELF) if shelf else [])]
    files = [_file(robot) for robot in asked or _names(ROBOTS)]
    if explain:
        _explain([Job(file, GENERATED, base, tip, exact=exact) for file in files])
        return
    folder = _target(files, to)
    due = [Job(file, folder, base, tip, wanted, exact) for file in files]
    if not check:
        due = [job for job in due if not is_up_to_date(job)]
    if not due:
        out.print("nothing to derive: all is up to date")
        return
    # SymPy and CasADi are loaded only if a robot has to be derived.
    from .build import jobs as work  # noqa: PLC0415

    problems = work.problems(due)
    if problems:
        _stop("\n".join([*problems, "nothing was written"]))
    _make(folder)
    results = work.compared(due, jobs) if check else work.derived(due, jobs)
    good = _show(results, len(due))
    orphans = work.orphans(due, folder) if check and not asked else []
    if orphans:
        _stop(f"{folder}: no description for {', '.join(orphans)}")
    if not good:
        _stop("derive again what is out of date" if check else "some robots failed")
    count = f"{len(due)} robot{'s' if len(due) > 1 else ''}"
    done = "compared" if check else f"written to {folder}"
    out.print(f"{count} {done}, {time.perf_counter() - started:.1f} s")


def main() -> None:
    """The console script."""
    app()


def _explain(asked: list[Job]) -> None:
    from .build import jobs as work  # noqa: PLC0415

    problems = work.problems(asked)
    if problems:
        _stop("\n".join(problems))
    for text in work.explained(asked):
        out.print(text, end="\n\n", markup=False)


def _names(folder: Path) -> list[str]:
    return sorted(path.stem for path in folder.glob("*.toml"))


def _target(files: list[Path], to: Path | None) -> Path:
    """The folder to write into: the package's own folder for shipped robots alone."""
    own = [file for file in files if file.parent != ROBOTS]
    if to is None and own:
        _stop(f"{own[0]}: say where the robots shall go, with --to FOLDER")
    return to or GENERATED


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        _stop(f"{folder}: expected a folder that can be written to ({error.strerror})")


def _file(robot: str) -> Path:
    for folder in (ROBOTS, SHELF):
        if robot in _names(folder):
            return folder / f"{robot}.toml"
    if not Path(robot).is_file():
        known = [*_names(ROBOTS), *_names(SHELF)]
        close = get_close_matches(robot, known, n=1)
        hint = f" (did you mean {close[0]}?)" if close else ""
        _stop(f"{robot}: expected a robot file, or one of {', '.join(known)}{hint}")
    return Path(robot)


def _show(results: Iterable["Report"], total: int) -> bool:
    good = True
    columns = (TextColumn("deriving"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=out, transient=True) as progress:
        bar = progress.add_task("deriving", total=total)
        for report in results:
            good &= report.good
            progress.console.print(report.line)
            progress.advance(bar)
    return good


def _stop(message: str) -> NoReturn:
    err.print(message, style="red", markup=False)
    raise typer.Exit(1)
