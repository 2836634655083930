"""Functions of a robot as ``casadi.Function``, for optimal control."""

import os
from pathlib import Path

import casadi as ca

from chasles.contract import check_type
from chasles.contract.errors import MismatchError, MissingFunctionError, UnknownRobotError

from ..derivation import derive
from ..description.robot_files import read
from ..emit.casadi_file import joined, output_of
from ..model.mechanism import Described, Mechanism
from ..model.robot import SerialRobot
from .freshness import GENERATED


def casadi_function(robot: str | Path | Described, name: str) -> ca.Function:
    """Return one function of a robot as a ``casadi.Function``, for use in an optimization.

    Args:
        robot: A robot name, a folder from ``write``, a robot file, or a description from ``read``.
            Deriving the function from a robot file or a description takes seconds.
        name: Name of a position function, such as ``"fk"`` or ``"chain"``. To get Jacobians or
            rates, differentiate the CasADi function with ``casadi.jacobian`` or ``casadi.jtimes``.

    Returns:
        A CasADi function with one matrix output and only those inputs of the robot function that
        affect the output.

    Raises:
        UnknownRobotError: The robot name is unknown, or the folder has no ``.casadi`` file.
        MismatchError: CasADi cannot read the robot's ``.casadi`` file.
        MissingFunctionError: The named function does not compute positions, or the ``.casadi`` file
            does not contain this function.
        DescriptionError: The robot description is invalid.
        InputValueError: The robot file or description has no function of this name.
    """
    folder = _folder(robot)
    if folder is not None:
        return _of_folder(folder, name)
    check_type("casadi_function: robot", robot, str, Path, SerialRobot, Mechanism)
    description = read(robot) if isinstance(robot, str | Path) else robot
    everything = joined(derive(description, functions=[name]))
    if everything is None or name not in everything.name_out():
        raise MissingFunctionError(
            f"{description.name}: expected a function of positions, got {name!r}; choose a "
            "function such as 'fk' and differentiate it"
        )
    return output_of(everything, name)


def _folder(robot: str | Path | Described) -> Path | None:
    if not isinstance(robot, str | Path):
        return None
    is_name = isinstance(robot, str) and os.sep not in robot
    if is_name and (GENERATED / robot / f"{robot}.casadi").is_file():
        return GENERATED / robot
    return Path(robot) if Path(robot).is_dir() else None


def _of_folder(folder: Path, name: str) -> ca.Function:
    found = sorted(folder.glob("*.casadi"))
    if not found:
        raise UnknownRobotError(f"{folder}: the folder contains no .casadi file")
    try:
        everything = ca.Function.load(str(found[0]))
    except RuntimeError as error:
        raise MismatchError(
            f"CasADi cannot read the file {found[0]}; derive the robot again"
        ) from error
    if name not in everything.name_out():
        raise MissingFunctionError(
            f"file {found[0]} has no function {name!r}; functions: {everything.name_out()}"
        )
    return output_of(everything, name)
