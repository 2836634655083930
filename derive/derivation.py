"""The derivation of a robot: all its functions, in one pass over shared terms."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

from .chain.coordinates import InProportion
from .chain.groups import Group, groups
from .chain.kinematics import FUNCTIONS, Kinematics, arguments_of
from .inverse.families import FAMILIES
from .inverse.families.family import Family
from .inverse.hybrid_inverse import hybrid_inverses
from .inverse.serial_inverse import Inverses, inverses
from .loops import constraint_functions, maps, platforms
from .loops.hybrid import Hybrid
from .loops.maps import Maker
from .model.errors import RobotError
from .model.mechanism import Described, Mechanism
from .terms.symbolic_function import SymbolicFunction, WrittenFunction
from .terms.terms import Terms

_GUARDS = {"actuators": "margin", "chain": "actuator_margin"}
"""The function that gives the loops' margins, by the domain of the functions that it guards."""


@dataclass(frozen=True)
class Derivation:
    """A robot with the functions derived for it.

    Attributes:
        robot: The description.
        terms: The terms and constants that all functions share.
        groups: The chain reduced to groups of axes.
        functions: The derived functions, in the order in which they are generated.
        hybrid: The loops and their solution; None for a serial robot.
        inverse: The inverse kinematics; None if none of its functions was requested.
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
        """The function with a name.

        Raises:
            KeyError: There is no function with this name.
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
    """Derives the functions of a robot: kinematics of its tool, and the maps through its loops.

    The order of derivation is fixed, so that neither a function nor a name of its terms depends on
    the order of ``functions``.

    Args:
        robot: A serial robot or a mechanism, from a file, a URDF or built in Python.
        functions: Names of functions; all functions of the robot by default.
        families: The families of inverses to try, in order.

    Raises:
        RobotError: The robot has no function of a name, a loop does not close at the reference, or
            the actuated coordinates of a mechanism are not as many as its freedoms.
    """
    if isinstance(robot, Mechanism):
        return _of_mechanism(robot, functions, families)
    terms = Terms({p.symbol: p.value for p in robot.parameters})
    arguments = arguments_of([joint.unit for joint in robot.coordinates])
    motion = InProportion(robot, terms, arguments["q"].symbols)
    found = groups(robot, terms, motion.values)
    kinematics = Kinematics.of(robot, terms, found, motion, arguments)
    made = kinematics.functions(FUNCTIONS if functions is None else functions)
    inverse = None
    if functions is None or not set(functions) <= set(FUNCTIONS):
        inverse = inverses(robot, terms, families=families)
        made |= inverse.functions
    written = {function.name: function for function in inverse.written} if inverse else {}
    capabilities = [*FUNCTIONS, *(inverse.functions if inverse else ()), *written]
    chosen = _chosen(robot.name, _with_called(functions, written), capabilities)
    made |= kinematics.functions([name for name in chosen if name not in made])
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
    """Names of the requested functions, and of the functions that their written C calls."""
    if functions is None:
        return None
    return [*functions, *(c for name in functions if name in written for c in written[name].calls)]


def _of_mechanism(
    mechanism: Mechanism, functions: Sequence[str] | None, families: tuple[Family, ...]
) -> Derivation:
    hybrid = Hybrid(mechanism)
    has_chain = not hybrid.forward.open
    hybrid.check()
    of_tool = FUNCTIONS if has_chain else ()
    makers = _makers(hybrid)
    capabilities = [*of_tool, *makers]
    inverse = None
    if has_chain and (functions is None or not set(functions) <= set(capabilities)):
        inverse = hybrid_inverses(hybrid, families)
        capabilities += [name for name in inverse.functions if name not in capabilities]
    chosen = _chosen(mechanism.name, functions, capabilities)
    asked_of_tool = [name for name in chosen if name in of_tool]
    made = hybrid.kinematics.functions(asked_of_tool) if asked_of_tool else {}
    made |= {name: makers[name](hybrid) for name in chosen if name in makers}
    made |= inverse.functions if inverse else {}
    return Derivation(
        mechanism,
        hybrid.terms,
        hybrid.groups if has_chain else (),
        tuple(_guarded(made[name], capabilities) for name in chosen),
        hybrid,
        inverse,
        families=families,
    )


def _makers(hybrid: Hybrid) -> dict[str, Maker]:
    """The derivation of each function through the loops with a closed form, in order."""
    return maps.makers(hybrid) | constraint_functions.makers(hybrid) | platforms.makers(hybrid)


def _guarded(function: SymbolicFunction, capabilities: Collection[str]) -> SymbolicFunction:
    """The function, with the function that gives the margins of its loops named as its guard."""
    guard = _GUARDS.get(function.role.domain, "")
    if guard not in capabilities or function.role.name in ("margin", "branches"):
        return function
    return replace(function, margin=guard)


def _chosen(robot: str, functions: Sequence[str] | None, known: Sequence[str]) -> list[str]:
    """The requested functions, in the order of derivation."""
    if functions is None:
        return list(known)
    unknown = [name for name in functions if name not in known]
    if unknown:
        functions_there = ", ".join(known)
        raise RobotError(
            f"{robot} has no function {', '.join(unknown)}; its functions are {functions_there}"
        )
    return [name for name in known if name in functions]
