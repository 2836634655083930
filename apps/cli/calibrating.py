"""The subcommand `calibrate`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from chasles import load

from .console import say
from .options import add, names


def add_to(app: typer.Typer) -> None:
    """Add the subcommand to the command line."""
    add(app, calibrate, "chasles calibrate points.csv --robot ur5e --to measured.toml")


def calibrate(
    measurements: Annotated[
        Path, typer.Argument(metavar="TABLE", help="Measurements (.csv) with units in the header.")
    ],
    robot: Annotated[
        str, typer.Option(help="Name or description of the robot.", autocompletion=names)
    ],
    to: Annotated[Path | None, typer.Option(help="Robot file (.toml) to write.")] = None,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            metavar="GROUP",
            help="Parameter, or group: geometry, axis, loop, joint, offset, transmission. Default: "
            "the model with the smallest cross-validation error.",
        ),
    ] = None,
    report: Annotated[Path | None, typer.Option(help="Report (.html or .tex) to write.")] = None,
) -> None:
    """Identify a robot from a table of measured positions or poses."""
    # SciPy is optional and takes a second to import.
    from chasles import calibration  # noqa: PLC0415

    arm = load(robot, parametric=True)
    measured = calibration.read_measurements(measurements, arm)
    for sentence in measured.assumptions:
        say(f"{measurements}: {sentence}")
    if vary:
        found = calibration.identify(arm, measured.q, measured.measurements, vary=vary)
    else:
        chosen = calibration.select_model(arm, measured.q, measured.measurements)
        found = chosen.calibration
        say(f"model: {chosen.model.name}")
    say(str(found))
    if report:
        found.save(report)
        say(f"\nwritten: {report}")
    if to:
        source = f"{arm.source}; identified from {measurements.name}"
        design = Path(robot)
        nominal = str(design.resolve()) if design.is_file() else robot
        found.save(to, source=source, nominal=nominal)
        say(f"\nwritten: {to}")
        if to.suffix == ".toml" and "[[transmissions]]" in to.read_text(encoding="utf-8"):
            say("its functions expect true coordinates: coordinates_from_readings(r)")
