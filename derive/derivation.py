"""Everything that a robot offers, derived once over one scope of shared terms."""

from collections.abc import Sequence
from dataclasses import dataclass

from .chain import Group, groups
from .coordinates import InProportion
from .errors import RobotError
from .function import SymbolicFunction
from .hybrid import Hybrid
from .kinematics import FUNCTIONS, Kinematics, arguments_of
from .mechanism import Described, Mechanism
from .scope import Scope


@dataclass(frozen=True)
class Derivation:
    """A robot with the functions derived for it.

    Attributes:
        robot: The description.
        scope: The terms and constants that all functions share.
        groups: The chain in its smallest form.
        functions: What was derived, in the order in which it is written out.
        hybrid: The loops and their solution, of a robot that has some.
    """

    robot: Described
    scope: Scope
    groups: tuple[Group, ...]
    functions: tuple[SymbolicFunction, ...]
    hybrid: Hybrid | None = None

    def function(self, name: str) -> SymbolicFunction:
        """The function of that name.

        Raises:
            KeyError: There is none.
        """
        for function in self.functions:
            if function.name == name:
                return function
        raise KeyError(f"{self.robot.name} has no function {name!r}")


def derive(robot: Described, functions: Sequence[str] | None = None) -> Derivation:
    """Derives the functions of a robot: of its tool, and the maps through its loops.

    Args:
        robot: A serial robot or a mechanism, from a file, a URDF or built in Python.
        functions: Names of functions; all that the robot offers by default.

    Raises:
        RobotError: A name is no function of the robot, or a loop does not close at the reference.
    """
    if isinstance(robot, Mechanism):
        return _of_mechanism(robot, functions)
    chosen = _chosen(robot.name, functions, FUNCTIONS)
    scope = Scope({p.symbol: p.value for p in robot.parameters})
    arguments = arguments_of([joint.unit for joint in robot.coordinates])
    motion = InProportion(robot, scope, arguments["q"].symbols)
    found = groups(robot, scope, motion.values)
    kinematics = Kinematics(robot, scope, found, motion, arguments)
    made = tuple(kinematics.function(name) for name in chosen)
    return Derivation(robot, scope, found, made)


def _of_mechanism(mechanism: Mechanism, functions: Sequence[str] | None) -> Derivation:
    hybrid = Hybrid(mechanism)
    chosen = _chosen(mechanism.name, functions, hybrid.offered)
    made = tuple(hybrid.function(name) for name in chosen)
    return Derivation(mechanism, hybrid.scope, hybrid.groups, made, hybrid)


def _chosen(robot: str, functions: Sequence[str] | None, known: Sequence[str]) -> list[str]:
    """The functions asked for, in the order in which they are derived."""
    if functions is None:
        return list(known)
    unknown = [name for name in functions if name not in known]
    if unknown:
        there = ", ".join(known)
        raise RobotError(f"{robot} has no function {', '.join(unknown)}; there are {there}")
    return [name for name in known if name in functions]
