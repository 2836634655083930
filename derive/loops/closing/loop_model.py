"""The coordinates and symbolic terms of a mechanism whose loops close."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import sympy as sp

from ...chain.kinematics import arguments_of, common_unit, coordinates
from ...model.mechanism import Mechanism
from ...model.robot import SerialRobot
from ...terms.role import OTHER, Role
from ...terms.symbolic_function import Argument, Result, SymbolicFunction
from ...terms.terms import Terms
from ..model.constraints import ConfigurationVariable, configuration_names
from .least_squares_closure import LeastSquaresClosure, least_squares_closure, overactuated
from .tilted_pins import closable

_DOMAINS = {"q": "actuators", "theta": "chain", "z": "configuration"}


@dataclass(frozen=True, eq=False)
class LoopModel:
    """A mechanism with symbols for its coordinates.

    Attributes:
        mechanism: Description of the mechanism, with tilted pins modeled as ball joints if the file
            allows least-squares closure.
        terms: Table of named symbolic expressions.
        least_squares_closure: The least-squares configuration of overconstrained loops, or None if
            all loops close.
        robot: The main chain as a serial robot.
        variables: The coordinates of the full configuration z.
        arguments: Arguments of the symbolic functions, by argument name.
        q: Symbols of the actuated coordinates.
        theta: Symbols of the main-chain joints.
    """

    mechanism: Mechanism
    terms: Terms
    least_squares_closure: LeastSquaresClosure | None
    robot: SerialRobot
    variables: tuple[ConfigurationVariable, ...]
    arguments: Mapping[str, Argument] = field(repr=False)
    q: tuple[sp.Symbol, ...]
    theta: tuple[sp.Symbol, ...]

    def function(
        self,
        name: str,
        summary: str,
        identity: str,
        inputs: tuple[str, ...],
        *outputs: Result,
        role: Role = OTHER,
    ) -> SymbolicFunction:
        """Build a symbolic function whose first input determines its domain."""
        arguments = tuple(self.arguments[argument] for argument in inputs)
        text = replace(role, domain=_DOMAINS[inputs[0]])
        return SymbolicFunction(name, summary, identity, arguments, outputs, self.terms, role=text)


def loop_model(mechanism: Mechanism, terms: Terms | None = None) -> LoopModel:
    """Return the loop model of a mechanism, with symbols for its coordinates.

    Args:
        mechanism: The description.
        terms: Table of symbolic terms to reuse, for example from a mechanism with the same
            parameters. If None, a new table is created.

    Raises:
        DescriptionError: The pins of a rod are not parallel, and either the tilt is too large or
            the robot file does not allow least-squares closure.
    """
    terms = terms or Terms({p.symbol: p.value for p in mechanism.parameters})
    mechanism, closure_errors = closable(mechanism, terms), None
    if mechanism.closure == "least squares":
        closure_errors = least_squares_closure(mechanism) or overactuated(mechanism)
    if closure_errors is not None:
        text = f"closed in least squares: {closure_errors}"
        mechanism = replace(mechanism, notes=(*mechanism.notes, text))
    robot, variables = mechanism.main_chain, configuration_names(mechanism)
    moving = robot.moving
    arguments = arguments_of([c.unit for c in mechanism.coordinates], "actuator")
    unit, either = common_unit(joint.unit for joint in moving), "(rad or m)"
    for name, count, shown, meaning in (
        ("theta", len(moving), unit, "joints of the main chain"),
        ("thetad", len(moving), f"{unit}/s", "joint rates of the main chain"),
        ("thetadd", len(moving), f"{unit}/s^2", "joint accelerations of the main chain"),
        ("z", len(variables), either, "full configuration"),
        ("zd", len(variables), f"{either}/s", "rates of the full configuration"),
    ):
        # The prefix _ avoids name conflicts, because a parameter may be called theta4, but never
        # _theta4.
        symbols = coordinates(f"_{name}", count)
        arguments[name] = Argument(name, symbols, (count,), shown, meaning)
    q, theta = arguments["q"].symbols, arguments["theta"].symbols
    return LoopModel(mechanism, terms, closure_errors, robot, variables, arguments, q, theta)
