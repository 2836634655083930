"""The subcommand `actuators`."""

from __future__ import annotations

from typing import Annotated

import numpy as np
import typer

import chasles
from chasles import InputValueError, load

from .console import err, print_json, say
from .options import Base, Exact, Json, Robot, Tip, add
from .values import FloatArray, positions, shown, shown_unit

_OPEN = "the loops do not close at these joints on the branch of the reference configuration"
_SAMPLES = 200
"""Number of random configurations for the test whether an actuator depends on other joints."""
_ALIKE = 1e-9
"""If an actuator coordinate varies by more than this value [rad or m] over the random
configurations, the coordinate depends on other joints."""


def add_to(app: typer.Typer) -> None:
    """Add the subcommand to the command line."""
    add(app, actuators, "chasles actuators excavator --theta boom=30deg,stick=-90deg")


def actuators(
    robot: Robot,
    theta: Annotated[
        str,
        typer.Option(
            metavar="JOINT=VALUE,...",
            help="Joints of the main chain, all or some. Actuators that depend on other joints "
            "are omitted.",
        ),
    ],
    base: Base = None,
    tip: Tip = None,
    exact: Exact = False,
    as_json: Json = False,
) -> None:
    """Compute the actuated coordinates, such as cylinder lengths, from joints of the main chain.

    The exit status is 1 if the loops do not close at these joints, or if these joints determine no
    actuator.
    """
    arm = load(robot, base=base, tip=tip, exact=exact)
    if "actuators" not in arm.functions:
        raise InputValueError(f"{arm.name}: the main-chain joints do not determine any actuator")
    joints = positions(arm.chain_joints, theta, "--theta")
    q = _determined(arm, joints)
    can_check = len(joints) == len(arm.chain_joints) and "chain_closes" in dir(arm)
    is_open = can_check and not arm.chain_closes(list(joints.values()))
    if is_open:
        err.print(_OPEN, style="yellow", markup=False)
    found = {one: float(x) for one, x in zip(arm.coordinates, q, strict=True) if np.isfinite(x)}
    if as_json:
        numbers = {one.name: x for one, x in found.items()}
        print_json({"robot": arm.name, "theta": joints, "actuators": numbers})
    elif not found:
        say(f"{arm.name}: no actuator follows from these joints, or the loops do not close")
    for one, x in () if as_json else found.items():
        say(f"{one.name:<20} {shown(x, one.unit):>12} {shown_unit(one.unit)}")
    if is_open or not found:
        raise typer.Exit(1)


def _determined(arm: chasles.Robot, joints: dict[str, float]) -> FloatArray:
    """Return the actuated coordinates (n,), or NaN if joint values are missing."""
    if len(joints) == len(arm.chain_joints):
        return np.ravel(arm.actuators([list(joints.values())]))
    if "chain" not in arm.functions:
        names = ", ".join(joint.name for joint in arm.chain_joints)
        raise InputValueError(f"{arm.name}: --theta requires all joints of the main chain: {names}")
    theta = np.asarray(arm.chain(arm.random_q(_SAMPLES, rng=0)))
    for column, joint in enumerate(arm.chain_joints):
        theta[:, column] = joints.get(joint.name, theta[:, column])
    q = np.asarray(arm.actuators(theta))
    q = q[np.isfinite(q).all(-1)]
    if not len(q):
        return np.full(arm.n, np.nan)
    return np.where(np.ptp(q, axis=0) <= _ALIKE, q[0], np.nan)
