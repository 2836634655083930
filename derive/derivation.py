"""Everything that a robot offers, derived once over shared terms."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

from .chain.coordinates import InProportion
from .chain.groups import Group, groups
from .chain.kinematics import FUNCTIONS, Kinematics, arguments_of
from .inverse.families import FAMILIES
from .inverse.families.family import Family
from .inverse.hybrid_inverse import hybrid_inverses
from .inverse.serial_inverse import Inverses, inverses
from .loops import equations, maps, platforms
from .loops.hybrid import Hybrid
from .loops.maps import Maker
from .model.errors import RobotError
from .model.mechanism import Described, Mechanism
from .terms.symbolic_function import SymbolicFunction, WrittenFunction
from .terms.terms import Terms

_GUARDS = {"actuators": "margin", "chain": "actuator_margin"}
"""The function that says how far loops are from not closing, by the domain of those it guards."""


@dataclass(frozen=True)
class Derivation:
    """A robot with the functions derived for it.

    Attributes:
        robot: The description.
        terms: The terms and constants that all functions share.
        groups: The chain in its smallest form.
        functions: What was derived, in the order in which it is written out.
        hybrid: The loops and their solution, of a robot that has some.
        inverse: What is known of its inverse, where that was asked for.
        written: Functions whose C is written by hand over tables of the robot.
        families: The families of inverses that were tried.
    """

    robot: Described
    terms: Terms
    groups: tuple[Group, ...]
    functions: tuple[SymbolicFunction, ...]
    hybrid: Hybrid | None = None
    inverse: Inverses | None = None
    written: tuple[WrittenFunction, ...] = ()
    families: tuple[Family, ...] = FAMILIES

    def function(self, name: str) -> SymbolicFunction:
        """The function of that name.

        Raises:
            KeyError: There is none.
        """
        for function in self.functions:
            if function.name == name:
                return function
        raise KeyError(f"{self.robot.name} has no function {name!r}")


def derive(
    robot: Described,
    functions: Sequence[str] | None = None,
    families: tuple[Family, ...] = FAMILIES,
) -> Derivation:
    """Derives the functions of a robot: of its tool, and the maps through its loops.

    Args:
        robot: A serial robot or a mechanism, from a file, a URDF or built in Python.
        functions: Names of functions; all that the robot offers by default.
        families: The families of inverses to try, in order.

    Raises:
        RobotError: A name is no function of the robot, or a loop does not close at the reference.
    """
    if isinstance(robot, Mechanism):
        return _of_mechanism(robot, functions, families)
    terms = Terms({p.symbol: p.value for p in robot.parameters})
    arguments = arguments_of([joint.unit for joint in robot.coordinates])
    motion = InProportion(robot, terms, arguments["q"].symbols)
    found = groups(robot, terms, motion.values)
    kinematics = Kinematics(robot, terms, found, motion, arguments)
    made = {name: kinematics.function(name) for name in FUNCTIONS if _is_asked(name, functions)}
    inverse = None
    if functions is None or not set(functions) <= set(FUNCTIONS):
        inverse = inverses(robot, terms, families=families)
        made |= inverse.functions
    written = {function.name: function for function in inverse.written} if inverse else {}
    offered = [*FUNCTIONS, *(inverse.functions if inverse else ()), *written]
    chosen = _chosen(robot.name, _with_called(functions, written), offered)
    made |= {
        name: kinematics.function(name) for name in FUNCTIONS if name in chosen and name not in made
    }
    return Derivation(
        robot,
        terms,
        found,
        tuple(made[name] for name in chosen if name not in written),
        inverse=inverse,
        written=tuple(written[name] for name in chosen if name in written),
        families=families,
    )


def _with_called(
    functions: Sequence[str] | None, written: Mapping[str, WrittenFunction]
) -> Sequence[str] | None:
    """The names asked for, and those of the functions that these call."""
    if functions is None:
        return None
    return [*functions, *(c for name in functions if name in written for c in written[name].calls)]


def _is_asked(name: str, functions: Sequence[str] | None) -> bool:
    return functions is None or name in functions


def _of_mechanism(
    mechanism: Mechanism, functions: Sequence[str] | None, families: tuple[Family, ...]
) -> Derivation:
    hybrid = Hybrid(mechanism)
    offered = _offered(hybrid)
    inverse = None
    if not hybrid.forward.open and (functions is None or not set(functions) <= offered.keys()):
        inverse = hybrid_inverses(hybrid, families)
        offered |= {name: partial(_made, f) for name, f in inverse.functions.items()}
    chosen = _chosen(mechanism.name, functions, list(offered))
    made = tuple(_guarded(offered[name](hybrid), offered) for name in chosen)
    found = () if hybrid.forward.open else hybrid.groups
    return Derivation(mechanism, hybrid.terms, found, made, hybrid, inverse, families=families)


def _made(function: SymbolicFunction, _: Hybrid) -> SymbolicFunction:
    return function


def _offered(hybrid: Hybrid) -> dict[str, Maker]:
    """Every function that a robot with loops has in closed form, in order."""
    of_tool: dict[str, Maker] = {}
    if not hybrid.forward.open:
        of_tool = {name: partial(_of_tool, name) for name in FUNCTIONS}
    return of_tool | maps.makers(hybrid) | equations.makers(hybrid) | platforms.makers(hybrid)


def _of_tool(name: str, hybrid: Hybrid) -> SymbolicFunction:
    return hybrid.kinematics.function(name)


def _guarded(function: SymbolicFunction, offered: Collection[str]) -> SymbolicFunction:
    """The function with the name of the one that tells which of its loops do not close."""
    guard = _GUARDS.get(function.role.domain, "")
    if guard not in offered or function.role.name in ("margin", "branches"):
        return function
    return replace(function, margin=guard)


def _chosen(robot: str, functions: Sequence[str] | None, known: Sequence[str]) -> list[str]:
    """The functions asked for, in the order in which they are derived."""
    if functions is None:
        return list(known)
    unknown = [name for name in functions if name not in known]
    if unknown:
        there = ", ".join(known)
        raise RobotError(f"{robot} has no function {', '.join(unknown)}; there are {there}")
    return [name for name in known if name in functions]
