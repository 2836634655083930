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
        robot: A robot name, a generated folder, a robot file or a description. Deriving a file or a
            description takes seconds.
        name: A function of positions, such as ``"fk"`` or ``"chain"``.
            ``casadi.jacobian`` and ``casadi.jtimes`` compute Jacobians and rates from the function.

    Returns:
        The CasADi function, with one matrix output. The inputs of the CasADi function are the robot
        arguments that affect the output.

    Raises:
        UnknownRobotError: The folder has no ``.casadi`` file.
        MismatchError: CasADi cannot read the robot's ``.casadi`` file.
        MissingFunctionError: The function does not compute positions.
        DescriptionError: The description is invalid.
        InputValueError: The robot has no function of that name.
    """
    folder = _folder(robot)
    if folder is not None:
        return _of_folder(folder, name)
    check_type("casadi_function: robot", robot, str, Path, SerialRobot, Mechanism)
    description = read(robot) if isinstance(robot, str | Path) else robot
    everything = joined(derive(description, functions=[name]))
    if everything is None or name not in everything.name_out():
        raise MissingFunctionError(
            f"{description.name}: {name!r} is not a function of positions; choose a function such "
            "as 'fk' and differentiate it"
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
        raise UnknownRobotError(f"folder {folder} contains no .casadi file")
    try:
        everything = ca.Function.load(str(found[0]))
    except RuntimeError as error:
        raise MismatchError(
            f"CasADi cannot read the file {found[0]}; derive the robot again"
        ) from error
    if name not in everything.name_out():
        raise MissingFunctionError(
            f"file {found[0]} has no function {name!r}; its functions are {everything.name_out()}"
        )
    return output_of(everything, name)
