"""Derives all functions of a robot together, so that functions can share terms."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from chasles.contract import check_type

from .chain.body_shapes import Skeleton, skeleton
from .chain.coordinates import InProportion
from .chain.coupling_maps import coupling_maps
from .chain.groups import Group, groups
from .chain.kinematics import FUNCTIONS, Kinematics, arguments_of
from .chain.parametric import PARAMETRIC, Parametric
from .chain.parametric import ROLES as PARAMETRIC_ROLES
from .chain.rigid_bodies import RigidBodies
from .chain.transmissions import transmissions
from .inverse.chosen_joints import hybrid_inverses_for_fixed, inverses_for_fixed
from .inverse.families import FAMILIES
from .inverse.families.family import Family
from .inverse.mechanisms import backward_inverse, leg_inverse, mode_check
from .inverse.serial_inverse import Inverses
from .loops.closing.loop_model import loop_model
from .loops.closing.pose_change import with_pose_change
from .loops.functions import constraint_functions, maps
from .loops.functions.tool import tool_functions, tool_groups
from .loops.iterated.closure_equations import LoopClosure, loop_closure
from .loops.iterated.iteration import Iteration, inner_makers, iterated_makers
from .loops.model.mechanism_geometry import MechanismGeometry
from .loops.modes import platforms
from .loops.parametric.parametric_loops import ParametricLoops
from .loops.solve.solved_loops import SolvedLoops, solved_loops
from .model.errors import InputValueError
from .model.geometry import Geometry
from .model.mechanism import Described, Mechanism
from .model.robot import SerialRobot
from .terms.symbolic_function import NativeSolverFunction, SymbolicFunction
from .terms.terms import Terms

_GUARDS = {"actuators": "margin", "chain": "actuator_margin"}
"""Name of the function that computes the loop margin, keyed by the inputs of the functions that it
guards."""
_UNGUARDED = ("margin", "branches", "near", *PARAMETRIC_ROLES.values())
"""Roles of the functions that are not guarded by a loop margin."""


@dataclass(frozen=True)
class Derivation:
    """A robot with the functions that were derived for it.

    Attributes:
        robot: The description.
        terms: The terms and constants that all functions share.
        groups: The chain of the robot, reduced to groups of axes.
        functions: The derived functions, in the order of output.
        hybrid: The loops and their solution, or None for a serial robot.
        inverse: The inverse kinematics, or None if none of its functions was requested.
        written: Functions with handwritten C code that reads tables of the robot.
        families: The families of closed-form inverses that the derivation tested.
        closure: The equations of loops without a closed form, or None for other robots.
        geometry: The functions whose geometry is an input, or None if no parametric function was
            requested.
        parametric_loops: The closure equations whose geometry is an input. None likewise.
    """

    robot: Described
    terms: Terms
    groups: tuple[Group, ...]
    functions: tuple[SymbolicFunction, ...]
    hybrid: SolvedLoops | None = None
    inverse: Inverses | None = None
    written: tuple[NativeSolverFunction, ...] = ()
    families: tuple[Family, ...] = FAMILIES
    closure: LoopClosure | None = None
    geometry: Geometry | MechanismGeometry | None = None
    parametric_loops: ParametricLoops | None = None

    @cached_property
    def skeleton(self) -> Skeleton:
        """Returns the rigid bodies with their drawn shapes at the reference configuration."""
        robot, hybrid = self.robot, self.hybrid
        reference = hybrid.at_reference if hybrid else {c.name: 0.0 for c in robot.coordinates}
        if isinstance(robot, Mechanism):
            actuated = [coordinate.moves for coordinate in robot.coordinates]
        else:
            actuated = [joint.name for joint in robot.moving]
        return skeleton(RigidBodies(robot, self.terms, reference), actuated)

    def signature(self, name: str) -> SymbolicFunction | NativeSolverFunction:
        """Returns the derived or handwritten function that has this name.

        Raises:
            KeyError: The derivation has no function with this name.
        """
        by_hand = next((f for f in self.written if f.name == name), None)
        return by_hand if by_hand is not None else self.function(name)

    def function(self, name: str) -> SymbolicFunction:
        """Returns the derived function that has this name.

        Raises:
            KeyError: The derivation has no function with this name.
        """
        for function in self.functions:
            if function.name == name:
                return function
        raise KeyError(f"{self.robot.name} has no function {name!r}")


def derive(
    description: Described,
    *,
    functions: Sequence[str] | None = None,
    fixed: str | Sequence[str] = (),
    parametric: bool = False,
    families: tuple[Family, ...] = FAMILIES,
) -> Derivation:
    """Derives the functions of a robot: tool kinematics, and the solution of its loops.

    The derivation order is fixed, so neither functions nor names of terms depend on the order of
    ``functions``.

    Args:
        description: A serial robot or a mechanism, from :func:`~chasles.derive.read` or built in
            Python.
        functions: Names of the functions; by default, all functions of the robot.
        fixed: Names of the joints with fixed values, which are inputs of ``ik`` after the pose, or
            () for the default choice of a redundant robot.
        parametric: Whether functions whose geometry is an input, such as ``fk_p``, are derived too.
        families: The families of closed-form inverses to try, in order.

    Raises:
        InputValueError: A function name is unknown, or there is no closed form for the fixed
            joints.
        LoopError: A loop cannot be closed at the reference configuration.
        DescriptionError: The number of actuated coordinates differs from the degrees of freedom.
    """
    check_type("derive: description", description, SerialRobot, Mechanism)
    if isinstance(description, Mechanism):
        return _of_mechanism(description, functions, families, fixed, parametric=parametric)
    robot = description
    terms = Terms({p.symbol: p.value for p in robot.parameters})
    arguments = arguments_of([joint.unit for joint in robot.coordinates])
    motion = InProportion(robot, terms, arguments["q"].symbols)
    found = groups(robot, terms, motion.values)
    kinematics = Kinematics.of(robot, terms, found, motion, arguments)
    made = kinematics.functions(FUNCTIONS if functions is None else functions)
    inverse = None
    if functions is None or not set(functions) <= set(FUNCTIONS):
        inverse = inverses_for_fixed(robot, terms, families, fixed)
        made |= inverse.functions
    written = {function.name: function for function in inverse.written} if inverse else {}
    laws = transmissions(robot, terms, arguments["q"])
    maps = coupling_maps(robot, terms, arguments)
    capabilities = [*FUNCTIONS, *maps, *(inverse.functions if inverse else ()), *written, *laws]
    called = {name: function.calls for name, function in written.items()}
    chosen = _chosen(robot.name, _with_called(functions, called), capabilities, PARAMETRIC)
    chosen += [name for name in PARAMETRIC if parametric and name not in chosen]
    made |= laws | maps
    made |= kinematics.functions([name for name in chosen if name not in made])
    longer = None
    if requested := [name for name in chosen if name in PARAMETRIC]:
        longer = Parametric.of(robot, terms)
        made |= longer.functions(requested)
    return Derivation(
        robot,
        terms,
        found,
        tuple(made[name] for name in chosen if name not in written),
        inverse=inverse,
        written=tuple(written[name] for name in chosen if name in written),
        families=families,
        geometry=longer.geometry if longer else None,
    )


def _with_called(
    functions: Sequence[str] | None, called: Mapping[str, Iterable[str]]
) -> Sequence[str] | None:
    """Returns the names of the requested functions, and of all functions called by their C code."""
    if functions is None:
        return None
    names = list(functions)
    for name in names:
        names += [other for other in called.get(name, ()) if other not in names]
    return names


def _of_mechanism(
    mechanism: Mechanism,
    functions: Sequence[str] | None,
    families: tuple[Family, ...],
    fixed: str | Sequence[str],
    *,
    parametric: bool,
) -> Derivation:
    # Each step of the derivation uses only results and folders of earlier steps.
    model = loop_model(mechanism)
    loops = solved_loops(model)
    has_chain = not loops.forward.open
    closed = maps.makers(loops) | constraint_functions.makers(loops)
    closed |= platforms.makers(loops)
    by_hand = platforms.written_makers(loops)
    closure = None if has_chain else loop_closure(loops)
    iteration = _iteration(closure)
    iterated = iterated_makers(iteration, closed) if iteration else {}
    is_varied = parametric or not set(PARAMETRIC).isdisjoint(functions or ())
    varied = ParametricLoops(loops) if is_varied else None
    legs = backward_inverse.makers(loops) | leg_inverse.makers(loops)
    makers = iterated | closed | legs
    called: dict[str, Iterable[str]] = {}
    if iteration is not None:
        legs, checked = mode_check.with_legs(legs, iteration.closure)
        makers = iterated | closed | legs | inner_makers(iteration.closure)
        by_hand |= checked
        called = dict.fromkeys([*FUNCTIONS, *iterated], iteration.closure.functions)
    capabilities = [*(FUNCTIONS if has_chain or iteration else ()), *makers]
    inverse = None
    is_asked = functions is None or not set(functions) <= {*capabilities, *by_hand}
    if loops.may_have_inverse and is_asked:
        refined_through = None if loops.chain_is_known else closure
        inverse = hybrid_inverses_for_fixed(loops, families, fixed, refined_through)
        capabilities += [name for name in inverse.functions if name not in capabilities]
    written = {function.name: function for function in inverse.written} if inverse else {}
    if mode_check.IK in written:
        # The refined inverse of the nominal design replaces the inverse that solves each leg.
        by_hand.pop(mode_check.IK, None)
        capabilities = [name for name in capabilities if name != mode_check.LEGS]
    requested = [name for name in by_hand if functions is None or name in functions]
    found = [function for name in requested if (function := by_hand[name](loops)) is not None]
    written |= {function.name: function for function in found}
    robot = with_pose_change(loops.mechanism)
    laws = transmissions(robot, loops.terms, loops.arguments["q"])
    capabilities = [name for name in capabilities if name not in written]
    capabilities += [*written, *laws]
    asked_p, inner = PARAMETRIC if parametric else (), varied.inner if varied else {}
    called |= {name: varied.called(name) for name in PARAMETRIC} if varied else {}
    called |= {name: function.calls for name, function in written.items()}
    wanted = _with_called([*functions, *asked_p], called) if functions is not None else None
    chosen = _chosen(robot.name, wanted, capabilities, [*inner, *PARAMETRIC])
    chosen += [name for name in (*inner, *asked_p) if parametric and name not in chosen]
    asked_of_tool = [name for name in chosen if name in FUNCTIONS]
    made = tool_functions(loops, asked_of_tool) if has_chain and asked_of_tool else {}
    made |= {name: makers[name](loops) for name in chosen if name in makers}
    # The functions of the tool share terms with the functions of the main chain.
    made |= iteration.tool_functions(asked_of_tool) if iteration else {}
    made |= inverse.functions if inverse else {}
    made |= {name: function for name, function in inner.items() if name in chosen} | laws
    made |= varied.functions(chosen) if varied else {}
    return Derivation(
        robot,
        loops.terms,
        tool_groups(loops) if has_chain else (),
        tuple(_guarded(made[name], chosen) for name in chosen if name not in written),
        loops,
        inverse,
        tuple(_unguarded_without(written[name], chosen) for name in chosen if name in written),
        families=families,
        closure=closure,
        geometry=varied.geometry if varied else None,
        parametric_loops=varied,
    )


def _iteration(closure: LoopClosure | None) -> Iteration | None:
    """Returns the forward solution by iteration, or None if the actuators do not determine it."""
    if closure is None or not closure.is_determined or closure.hybrid.is_overdetermined:
        return None
    return Iteration(closure)


def _unguarded_without(
    function: NativeSolverFunction, chosen: Collection[str]
) -> NativeSolverFunction:
    """Drops the margin function of the loops if it was not requested."""
    return function if function.margin in chosen else replace(function, margin="")


def _guarded(function: SymbolicFunction, capabilities: Collection[str]) -> SymbolicFunction:
    """Returns the function with the margin function of its loops as guard."""
    guard = _GUARDS.get(function.role.domain, "")
    if guard not in capabilities or function.role.name in _UNGUARDED:
        return function
    return replace(function, margin=guard)


def _chosen(
    robot: str,
    functions: Sequence[str] | None,
    default: Sequence[str],
    on_demand: Sequence[str] = (),
) -> list[str]:
    """Returns the requested functions, in derivation order."""
    if functions is None:
        return list(default)
    known = [*default, *on_demand]
    unknown = [name for name in functions if name not in known]
    if unknown:
        functions_there = ", ".join(known)
        raise InputValueError(
            f"{robot} has no function {', '.join(unknown)}; its functions are {functions_there}"
        )
    return [name for name in known if name in functions]
