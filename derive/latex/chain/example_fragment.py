r"""Prints a worked example of forward and inverse kinematics."""

import math
from collections.abc import Iterable, Mapping, Sequence
from itertools import cycle

import numpy as np
from numpy.typing import NDArray

from ...inverse.general.elimination_choice import choice_at, slides_left, slides_of, without
from ...inverse.general.raghavan_roth import is_fit, moved, numbers
from ...inverse.general.real_solutions import real_solutions
from ...inverse.lost_poses import TARGETS, WHOLE
from ...inverse.structure.words import listed
from ...model.mechanism import Coordinate
from ...model.robot import Joint, Motor
from ...terms.branches import patterns
from ...terms.casadi_graph import lower
from ...terms.symbolic_function import SymbolicFunction
from ..setting.layout import flowed, named_matrix
from ..setting.names import parameter
from ..setting.page import Page, sentence, text
from .tables import Column, tabular

FloatArray = NDArray[np.float64]
AnyCoordinate = Joint | Coordinate | Motor
ANGLES = (20, -50, 70, 30, 40, -60, 10, 25)
"""Joint angles (degree) of the worked example, used cyclically. An angle outside the joint limits
is replaced by means of ``SHARE``."""
SLIDE = 0.3
"""Displacement (m) of a prismatic joint without limits in the example."""
SHARE = 0.4
"""Value of a coordinate in the worked example if the default value is outside the limits.

``SHARE`` is a fraction of the range between the limits, with 0 at the lower limit and 1 at the
upper limit.
"""
_UNITS = {"rad": "angles in degrees", "m": "displacements in meters"}
OUTSIDE = r"$^{\dagger}$"
"""LaTeX mark of a coordinate value outside its limits."""
MAX_WIDE = 6
"""Maximum number of coordinates for which a solution table prints angles with two decimals instead
of one."""
SOLVED = 1e-9
"""Largest residual (meter, radian) of a valid inverse kinematics solution."""
SLACK = 1e-9
"""Distance (radian or meter) by which a coordinate value may exceed a limit and still count as
inside the limits."""


def worked_example(page: Page) -> str:
    """Print a configuration of a serial robot, its tool pose and all solutions."""
    angles = cycle(ANGLES)
    coordinates = page.robot.coordinates
    q = np.array([within(c, math.radians(next(angles))) for c in coordinates])
    symbols = [page.tex(symbol) for symbol in page.equations.notation.q]
    functions = page.inverse.functions
    # In the printed equations, the inputs of an inverse kinematics function have the names of the
    # coordinates.
    known = dict(zip((s.name for s in page.equations.notation.q), q, strict=True))
    for name, function in functions.items():
        if function.role.name == "redundancy":
            known[name] = float(value_at(function, q).item())
    forward, inverses = page.equations.forward, functions.values()
    called = dict(zip((s.name for s in page.equations.notation.q), symbols, strict=True))
    shown = example(forward, inverses, coordinates, symbols, q, known, called, page.pose)
    return text(shown.rstrip(), _in_numbers(page, symbols, q, value_at(forward, q)))


def _in_numbers(page: Page, symbols: Sequence[str], q: FloatArray, T: FloatArray) -> str:
    robot, inverse = page.robot, page.inverse
    if not inverse.written:
        return ""
    given = inverse.written[0].role.fixed
    if not is_fit(robot, given):
        return ""
    constants, slides = numbers(robot), slides_of(robot)
    choice = choice_at(constants, given, slides)
    if choice is None:
        return ""
    local = np.array([float(joint.direction) for joint in robot.moving]) * q
    six = without(constants, {k: moved(local[k], k in slides) for k in given})
    left = [k for k in range(len(q)) if k not in given]
    found = []
    for values in real_solutions(six, choice.orders, T, slides_left(slides, len(q), given)):
        local[left] = values
        found.append(np.array([float(joint.direction) for joint in robot.moving]) * local)
    if not found:
        return ""
    columns = [("solution", [f"${k}$" for k, _ in enumerate(found, 1)])]
    columns += _columns(symbols, robot.coordinates, found)
    table = tabular(columns, repeated=1)
    parameters = [f"${symbols[k]}$" for k in given]
    of_configuration = f" and {listed(parameters)} of this configuration" if given else ""
    return sentence(
        f"For this pose{of_configuration}, the arm has {_count(len(found))}"
        f" ({_measured(robot.coordinates)}), found numerically by the determinant of Raghavan and"
        " Roth:",
        table,
        _dagger(table),
    )


def example(
    fk: SymbolicFunction,
    functions: Iterable[SymbolicFunction],
    coordinates: Sequence[AnyCoordinate],
    symbols: Sequence[str],
    q: FloatArray,
    known: Mapping[str, float],
    called: Mapping[str, str],
    pose: str,
) -> str:
    """Print the tool pose of a configuration and all inverse kinematics solutions for this pose.

    The solutions are those of the first inverse kinematics function whose inputs except the pose
    are in ``known``.

    Args:
        fk: The forward kinematics.
        functions: The functions of the robot.
        coordinates: The coordinates of the robot.
        symbols: LaTeX names of the robot's coordinates.
        q: The values of the coordinates (radian, meter).
        known: Values of all inputs of an inverse kinematics function except the pose, keyed by
            joint name.
        called: LaTeX names of the joints in ``known``, if the LaTeX names differ from the joint
            names.
        pose: LaTeX name of the tool's pose.
    """
    T = value_at(fk, q)
    forward = _pose_at(T, coordinates, symbols, q, pose)
    backward = ""
    inverse = next((f for f in functions if f.role.is_inverse and _is_known(f, known)), None)
    if inverse is not None:
        backward = _solutions(inverse, symbols, coordinates, known, called, T)
    return text(forward, backward)


def _pose_at(
    T: FloatArray,
    coordinates: Sequence[AnyCoordinate],
    symbols: Sequence[str],
    q: FloatArray,
    pose: str,
) -> str:
    rows = [[_decimal(entry, 6) for entry in row] for row in T.tolist()]
    return sentence(
        f"At {_listed(symbols, coordinates, q)} the pose of the tool is (lengths in meters)",
        flowed([named_matrix(pose, rows)]),
    )


def solutions_of_pose(
    fk: SymbolicFunction,
    name: str,
    joints: Sequence[AnyCoordinate],
    symbols: Sequence[str],
    theta: FloatArray,
    pose: str,
    coordinates: Sequence[AnyCoordinate],
    actuators: Sequence[str],
    found: Mapping[int, FloatArray],
) -> str:
    """Print the tool pose of a main chain and all solutions for its actuated coordinates.

    Args:
        fk: The forward kinematics of the main chain.
        name: Name of the function that computes the actuated coordinates from the main-chain
            joints.
        joints: The joints of the main chain.
        symbols: LaTeX names of the main-chain joints.
        theta: The values of the main-chain joints.
        pose: LaTeX name of the tool's pose.
        coordinates: The actuated coordinates.
        actuators: LaTeX names of the actuated coordinates.
        found: The actuated coordinates of each solution, keyed by the number of the solution slot.
    """
    columns: list[Column] = [("slot", [f"${slot}$" for slot in found])]
    columns += _columns(actuators, coordinates, [*found.values()])
    table = tabular(columns, repeated=1)
    shown = name.replace("_", r"\_")
    opening = rf"For this pose, \texttt{{{shown}}} has {_count(len(found))}"
    return text(
        _pose_at(value_at(fk, theta), joints, symbols, theta, pose),
        sentence(f"{opening} ({_measured(coordinates)}):", table, _dagger(table)),
    )


def within(coordinate: AnyCoordinate, angle: float) -> float:
    """Return an example value of a coordinate, within the limits of the coordinate."""
    lower, upper = bounds(coordinate)
    wished = SLIDE if coordinate.unit == "m" else angle
    if lower <= wished <= upper:
        return wished
    return rounded(lower + SHARE * (upper - lower), coordinate.unit)


def rounded(value: float, unit: str) -> float:
    """Round an angle (radian) to whole degrees, or a length (meter) to centimeters."""
    return math.radians(round(math.degrees(value))) if unit == "rad" else round(value, 2)


def bounds(coordinate: AnyCoordinate) -> tuple[float, float]:
    """Return the limits of a coordinate (radian, meter). Missing limits are infinite."""
    lower, upper = coordinate.limits
    return (
        -math.inf if lower is None else float(lower),
        math.inf if upper is None else float(upper),
    )


def _is_known(inverse: SymbolicFunction, known: Mapping[str, float]) -> bool:
    return all(argument.name in known for argument in inverse.inputs[1:])


def value_at(function: SymbolicFunction, q: FloatArray) -> FloatArray:
    """Evaluate the output of a symbolic function at a configuration."""
    (kernel,) = lower([function], "example")
    return np.array(kernel(q)).reshape(function.outputs[0].shape)


def _solutions(
    inverse: SymbolicFunction,
    symbols: Sequence[str],
    coordinates: Sequence[AnyCoordinate],
    known: Mapping[str, float],
    called: Mapping[str, str],
    T: FloatArray,
) -> str:
    role = inverse.role
    inputs = [
        np.concatenate(
            [TARGETS[component](T[None]) for component in role.components or WHOLE], axis=1
        )[0]
    ]
    inputs += [np.array([known[argument.name]]) for argument in inverse.inputs[1:]]
    (kernel,) = lower([inverse], "example")
    found: list[tuple[int, FloatArray]] = []
    for slot, signs in enumerate(patterns(inverse)):
        solution, residual, *_ = kernel(*inputs, *([np.array(signs)] if signs else []))
        if float(residual) <= SOLVED:
            found.append((slot, np.array(solution)[:, 0]))
    if not found:
        return ""
    columns: list[Column] = [("slot", [f"${slot}$" for slot, _ in found])]
    columns += _columns(symbols, coordinates, [solution for _, solution in found])
    table = tabular(columns, repeated=1)
    given = ""
    if len(inputs) > 1:
        others = [argument.name for argument in inverse.inputs[1:]]
        names = [f"${called.get(name) or parameter(name)}$" for name in others]
        given = f" and {listed(names)} of this configuration"
    name = inverse.name.replace("_", r"\_")
    return sentence(
        rf"For this pose{given}, \texttt{{{name}}} has {_count(len(found))}"
        f" ({_measured(coordinates)}):",
        table,
        _dagger(table),
    )


def _columns(
    symbols: Sequence[str], coordinates: Sequence[AnyCoordinate], found: Sequence[FloatArray]
) -> list[Column]:
    places = 2 if len(coordinates) <= MAX_WIDE else 1
    return [
        (f"${symbol}$", [_value(coordinate, solution[k], places) for solution in found])
        for k, (symbol, coordinate) in enumerate(zip(symbols, coordinates, strict=True))
    ]


def _measured(coordinates: Sequence[AnyCoordinate]) -> str:
    units = {coordinate.unit for coordinate in coordinates}
    return " and ".join(words for unit, words in _UNITS.items() if unit in units)


def _dagger(table: str) -> str:
    return "A dagger marks a value outside its limits." if OUTSIDE in table else ""


def _count(count: int) -> str:
    return "one solution" if count == 1 else f"{count} solutions"


def _value(coordinate: AnyCoordinate, value: float, places: int) -> str:
    lower, upper = bounds(coordinate)
    if coordinate.unit == "rad":
        shown = f"{round(math.degrees(value), places) + 0.0:.{places}f}"
        turns = (value + 2 * math.pi * k for k in (-1, 0, 1))
        inside = any(lower - SLACK <= turn <= upper + SLACK for turn in turns)
    else:
        shown = f"{round(value, 4) + 0.0:.4f}"
        inside = lower - SLACK <= value <= upper + SLACK
    return f"${shown}$" + ("" if inside else OUTSIDE)


def _decimal(value: float, places: int) -> str:
    rounded = round(value, places) + 0.0
    return f"{rounded:.{places}f}" if rounded != int(rounded) else str(int(rounded))


def _short(value: float, places: int) -> str:
    return f"{round(value, places) + 0.0:.{places}f}".rstrip("0").rstrip(".")


def _listed(symbols: Sequence[str], coordinates: Sequence[AnyCoordinate], q: FloatArray) -> str:
    return ", ".join(map(at_value, symbols, coordinates, q))


def at_value(symbol: str, coordinate: AnyCoordinate, value: float) -> str:
    """Format a coordinate and its value in degrees or meters."""
    if coordinate.unit == "rad":
        return rf"${symbol} = {_short(math.degrees(value), 3)}^\circ$"
    return rf"${symbol} = {_short(value, 4)}$ m"
