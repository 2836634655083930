"""The subcommands `draw`, `animate`, `view`, `workspace` and `pdf`."""

from __future__ import annotations

import io
import shutil
import subprocess
import tempfile
import warnings
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import typer

import chasles
from chasles import InputValueError, NotInstalledError, load
from chasles.contract import output_file, write_files
from chasles.library import is_description, shipped_folders

from .console import err, say, stop
from .options import Base, Exact, Picture, Robot, Tip, add, listed
from .values import coordinates

_LATEX = ("pdflatex", "-interaction=nonstopmode", "-halt-on-error")
_PICTURES = (".svg", ".pdf", ".png", ".npz")
Play = Annotated[
    Path | None, typer.Option(metavar="FILE", help="Motion (.npz) or table (.csv) to play.")
]
Views = Annotated[
    str,
    typer.Option(
        help="front, side, top, axonometric, plane; separated by commas. Default: all in a "
        "drawing; in an animation, the plane of a planar robot or axonometric."
    ),
]
_LINES = 20
"""Number of quoted lines from the end of the LaTeX log."""


def add_to(app: typer.Typer) -> None:
    """Add the subcommands to the command line."""
    add(app, draw, "chasles draw ur5e --to ur5e.svg")
    add(app, animate, "chasles animate ur5e --to ur5e.gif")
    add(app, view, "chasles view ur5e")
    add(app, workspace, "chasles workspace ur5e --to reach.png")
    add(app, pdf, "chasles pdf scara")


def draw(
    robot: Robot,
    to: Picture = None,
    q: Annotated[
        str | None,
        typer.Option("--q", metavar="NUMBERS", help="Coordinates. Default: a clear configuration."),
    ] = None,
    ghosts: Annotated[
        bool, typer.Option("--ghosts", help="Also the nearest other solutions, in pale colors.")
    ] = False,
    views: Views = "",
    base: Base = None,
    tip: Tip = None,
    exact: Exact = False,
) -> None:
    """Draw a robot with its joints and frames."""
    arm = load(robot, base=base, tip=tip, exact=exact)
    file = to or Path(f"{arm.name}.svg")
    at = None if q is None else coordinates(arm, q, "--q")
    chasles.draw(arm, at, ghosts=ghosts or None, views=listed(views) or None, file=file)
    say(f"written: {file}")


def animate(
    robot: Robot,
    to: Annotated[
        Path | None, typer.Option("--to", help="Animation to write: .gif, .mp4. Default: NAME.gif.")
    ] = None,
    play: Play = None,
    views: Views = "",
    fps: Annotated[float, typer.Option(help="Frames per second.")] = 20.0,
    base: Base = None,
    tip: Tip = None,
    exact: Exact = False,
) -> None:
    """Write an animation of a moving robot.

    Without --play, one coordinate after another moves in both directions. The coordinate of a
    linkage with one degree of freedom moves through a full turn, or through its range.
    """
    arm = load(robot, base=base, tip=tip, exact=exact)
    file = to or Path(f"{arm.name}.gif")
    chasles.animate(arm, _trajectory(play, arm), file, views=listed(views) or None, fps=fps)
    say(f"written: {file}")


def _trajectory(play: Path | None, arm: chasles.Robot) -> Any:
    """Return the trajectory of a file, or None without a file."""
    if play is None:
        return None
    from chasles.study.motion import Trajectory  # noqa: PLC0415

    return Trajectory.load(play, arm)


def view(
    robot: Robot,
    html: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write a self-contained page instead.")
    ] = None,
    play: Play = None,
    port: Annotated[
        int | None, typer.Option(help="Port of the page. Default: any free one.")
    ] = None,
    base: Base = None,
    tip: Tip = None,
    exact: Exact = False,
) -> None:
    """Show a moving robot in the browser; the view ends when the user presses Ctrl-C."""
    # The imports are slow, and only the subcommand `view` needs them.
    from chasles.view import LiveView, write_html  # noqa: PLC0415
    from chasles.view.meshes import count_meshes  # noqa: PLC0415

    if html and (play or port):
        raise InputValueError("--play and --port require the live view; omit them with --html")
    arm = load(robot, base=base, tip=tip, exact=exact)
    file = Path(robot) if is_description(Path(robot)) else None
    if html:
        write_html(arm, html)
        say(f"written: {html}")
        if file and (count := count_meshes(file)):
            meshes = "1 mesh" if count == 1 else f"{count} meshes"
            note = f"{file}: the page omits {meshes}; the links are drawn as rods"
            err.print(note, style="yellow", markup=False)
        return
    trajectory = _trajectory(play, arm)
    with warnings.catch_warnings(record=True) as given:
        warnings.simplefilter("always", UserWarning)
        shown = LiveView(arm, port=port, urdf=file, trajectory=trajectory)
    for warning in given:
        err.print(str(warning.message), style="yellow", markup=False)
    say(f"{arm.name}: {shown.address} (Ctrl-C stops it)")
    try:
        shown.wait()
    except KeyboardInterrupt:
        return
    finally:
        shown.close()


def workspace(
    robot: Robot,
    to: Picture = None,
    samples: Annotated[int, typer.Option(min=1, help="Number of configurations.")] = 1_000_000,
    sampling: Annotated[
        Literal["sobol", "uniform", "grid"], typer.Option(help="Kind of samples.")
    ] = "sobol",
    resolution: Annotated[
        int, typer.Option(min=1, help="Number of cells along the longest side.")
    ] = 100,
    rng: Annotated[int, typer.Option(help="Seed of random samples.")] = 0,
    threads: Annotated[str, typer.Option(help="Number of threads, or all.")] = "all",
    no_progress: Annotated[bool, typer.Option("--no-progress", help="No progress bar.")] = False,
    base: Base = None,
    tip: Tip = None,
    exact: Exact = False,
) -> None:
    """Sample the positions that the tool reaches.

    The command prints the size of the reachable region. The size is a volume, an area for a planar
    robot, or a path length for a robot with one coordinate. A file that ends in .npz holds the
    counts of all cells instead of a picture.
    """
    from chasles import study  # noqa: PLC0415

    if threads != "all" and not threads.isdecimal():
        raise InputValueError(f"--threads: expected a number or all, got {threads!r}")
    if to and to.suffix not in _PICTURES:
        raise InputValueError(f"--to: expected a file {' or '.join(_PICTURES)}, got {to.name!r}")
    arm = load(robot, base=base, tip=tip, exact=exact)
    found = study.workspace(
        arm,
        samples,
        sampling=sampling,
        resolution=resolution,
        rng=rng,
        threads="all" if threads == "all" else int(threads),
        progress=False if no_progress else None,
    )
    _say_workspace(found)
    file = to or Path(f"{arm.name}_workspace.svg")
    if file.suffix == ".npz":
        found.save(file)
    else:
        stream = io.BytesIO()
        figure = np.atleast_1d(found.plot())[0].figure
        figure.savefig(stream, dpi=200, bbox_inches="tight", format=file.suffix[1:])
        write_files({file: stream.getvalue()})
    say(f"written: {file}")


def _say_workspace(found: Any) -> None:
    """Print size, bounds and samples of a workspace."""
    of = " of the path of the tool" if found.path_length else ""
    spans = zip("xyz", found.bounds.T * 1000, strict=True)
    say(f"{found.robot}: {found.size}{of}")
    say(", ".join(f"{axis} {low:.4g} to {high:.4g} mm" for axis, (low, high) in spans))
    cells = " x ".join(map(str, found.grid.shape))
    lost = f", loops open at {found.n_open:,}" if found.n_open else ""
    say(
        f"{found.samples:,} configurations by {found.sampling}{lost}; "
        f"{cells} cells of {found.grid.side * 1000:.4g} mm"
    )


def pdf(
    robot: Robot,
    to: Annotated[Path | None, typer.Option(help="File to write. Default: NAME.pdf.")] = None,
    base: Base = None,
    tip: Tip = None,
    exact: Exact = False,
) -> None:
    """Print the LaTeX article of a robot, with all its equations.

    Needs pdflatex (Debian: texlive-latex-extra and lmodern).
    """
    if shutil.which(_LATEX[0]) is None:
        raise NotInstalledError(
            "pdflatex is not installed (Debian: apt install texlive-latex-extra lmodern)",
            name=_LATEX[0],
        )
    with tempfile.TemporaryDirectory() as build:
        article = _article(robot, Path(build), base=base, tip=tip, exact=exact)
        command = [*_LATEX, f"-output-directory={build}", article.name]
        done = subprocess.run(command, cwd=article.parent, capture_output=True, check=False)
        if done.returncode:
            log = done.stdout.decode(errors="replace").splitlines()[-_LINES:]
            stop("\n".join([f"{article.name}: pdflatex failed", *log]))
        file = to or Path(f"{article.stem}.pdf")
        with output_file(file) as target:
            shutil.copyfile(Path(build) / f"{article.stem}.pdf", target)
    say(f"written: {file}")


def _article(robot: str, build: Path, *, base: str | None, tip: str | None, exact: bool) -> Path:
    """Return the LaTeX article of a robot.

    If the LaTeX article does not exist, derive the robot.
    """
    generated = shipped_folders().get(robot)
    if generated and (generated / f"{robot}.tex").is_file():
        return generated / f"{robot}.tex"
    folder = Path(robot)
    if folder.is_dir():
        article = folder / f"{folder.resolve().name}.tex"
        if not article.is_file():
            stop(f"{folder}: has no article; derive the robot with latex among its languages")
        return article
    from chasles.derive import read, write  # noqa: PLC0415

    described = read(robot, base=base, tip=tip, exact=exact)
    write(described, build / described.name, languages=["latex"])
    return build / described.name / f"{described.name}.tex"
