"""Derives all functions of a robot together. The functions can then share terms."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from chasles.contract import check_type, nearest_names

from .chain.body_shapes import Skeleton, skeleton
from .chain.coordinates import InProportion
from .chain.coupling_maps import coupling_maps
from .chain.groups import Group, groups
from .chain.kinematics import FUNCTIONS, Kinematics, arguments_of
from .chain.parametric import PARAMETRIC, Parametric
from .chain.parametric import ROLES as PARAMETRIC_ROLES
from .chain.rigid_bodies import RigidBodies
from .chain.transmissions import transmissions
from .inverse.arms import arm_step
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
"""Name of the loop margin function, keyed by the input vector: actuator or chain coordinates."""
_UNGUARDED = ("margin", "branches", "near", *PARAMETRIC_ROLES.values())
"""Roles of functions that have no loop margin function."""


@dataclass(frozen=True)
class Derivation:
    """The functions that ``derive`` derived for a robot.

    Attributes:
        robot: The robot description.
        terms: The named constants and subexpressions that the functions share.
        groups: The joints of the chain, combined into groups of axes.
        functions: The functions as symbolic expressions, in output order.
        hybrid: The loops and their solution, or None for a serial robot.
        inverse: The inverse kinematics, or None if no inverse kinematics function was requested.
        written: The functions with handwritten C code, which reads the robot's data from tables.
        families: The axis structures with a closed-form inverse kinematics function that were
            tried.
        closure: The equations of the loops that are solved by iteration, or None without such
            loops.
        geometry: The robot parameters as inputs of functions such as ``fk_p``, or None if no such
            function was requested.
        parametric_loops: The closure equations of the loops with the robot parameters as inputs, or
            None if no function of the robot parameters was requested.
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
        """Return the rigid bodies with their drawn shapes at the reference configuration."""
        robot, hybrid = self.robot, self.hybrid
        reference = hybrid.at_reference if hybrid else {c.name: 0.0 for c in robot.coordinates}
        if isinstance(robot, Mechanism):
            actuated = [coordinate.moves for coordinate in robot.coordinates]
        else:
            actuated = [joint.name for joint in robot.moving]
        return skeleton(RigidBodies(robot, self.terms, reference), actuated)

    def signature(self, name: str) -> SymbolicFunction | NativeSolverFunction:
        """Return the function of this name, whether symbolic or with handwritten C code.

        Raises:
            KeyError: The derivation has no function with this name.
        """
        by_hand = next((f for f in self.written if f.name == name), None)
        return by_hand if by_hand is not None else self.function(name)

    def function(self, name: str) -> SymbolicFunction:
        """Return the symbolic function of this name.

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
    """Derive the functions of a robot as symbolic expressions.

    Args:
        description: A serial robot or a mechanism, from ``read`` or built in Python.
        functions: Names of the functions to derive, in any order. By default, all functions are
            derived.
        fixed: Names of fixed joints, whose values are inputs of ``ik`` after the pose. By default,
            joints are fixed only if the robot is redundant.
        parametric: Whether to also derive functions of the robot parameters, such as ``fk_p``.
        families: The axis structures with a closed-form inverse kinematics function, in the order
            in which to try them.

    Raises:
        InputValueError: A function name is unknown, or the robot has no inverse kinematics function
            with these fixed joints.
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
    needed = {name: function.calls for name, function in written.items()}
    if maps and inverse:
        # The runtime checks the limits of coupled joints with `chain`.
        needed |= {name: (*needed.get(name, ()), "chain") for name in inverse.functions | written}
    chosen = _chosen(robot.name, _with_needed(functions, needed), capabilities, PARAMETRIC)
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


def _with_needed(
    functions: Sequence[str] | None, needed: Mapping[str, Iterable[str]]
) -> Sequence[str] | None:
    """Return the requested functions and every function that they call."""
    if functions is None:
        return None
    names = list(functions)
    for name in names:
        names += [other for other in needed.get(name, ()) if other not in names]
    return names


def _of_mechanism(
    mechanism: Mechanism,
    functions: Sequence[str] | None,
    families: tuple[Family, ...],
    fixed: str | Sequence[str],
    *,
    parametric: bool,
) -> Derivation:
    # Each derivation step uses only the results and folders of earlier steps.
    model = loop_model(mechanism)
    loops = solved_loops(model)
    loops = arm_step.with_arms(loops)
    makers = _LoopMakers.of(loops)
    is_varied = parametric or not set(PARAMETRIC).isdisjoint(functions or ())
    varied = ParametricLoops(loops) if is_varied else None
    makers = makers.with_legs()
    inverse = _loop_inverse(makers, functions, families, fixed)
    makers = makers.without_replaced(inverse)
    written = makers.handwritten_functions(functions, inverse)
    robot = with_pose_change(loops.mechanism)
    laws = transmissions(robot, loops.terms, loops.arguments["q"])
    of_inverse = inverse.functions if inverse else {}
    names = [name for name in (*makers.names, *of_inverse) if name not in written]
    names = list(dict.fromkeys([*names, *written, *laws]))
    inner, asked_p = varied.inner if varied else {}, PARAMETRIC if parametric else ()
    called = dict(makers.called) | {name: written[name].calls for name in written}
    called |= {name: varied.called(name) for name in PARAMETRIC} if varied else {}
    asked = None if functions is None else [*functions, *asked_p]
    chosen = _chosen(robot.name, _with_needed(asked, called), names, [*inner, *PARAMETRIC])
    chosen += [name for name in (*inner, *asked_p) if parametric and name not in chosen]
    made = makers.functions(chosen) | of_inverse | laws
    made |= {name: inner[name] for name in inner if name in chosen}
    made |= varied.functions(chosen) if varied else {}
    return Derivation(
        robot,
        loops.terms,
        () if loops.forward.open else tool_groups(loops),
        tuple(_guarded(made[name], chosen) for name in chosen if name not in written),
        loops,
        inverse,
        tuple(_unguarded_without(written[name], chosen) for name in chosen if name in written),
        families=families,
        closure=makers.closure,
        geometry=varied.geometry if varied else None,
        parametric_loops=varied,
    )


@dataclass(frozen=True)
class _LoopMakers:
    """Derivation steps for the functions of a robot with loops.

    Attributes:
        loops: The loops and their solution.
        closure: The equations of the loops that are solved by iteration, or None.
        iteration: The iterative forward kinematics, or None.
        symbolic: The derivation of each symbolic function.
        handwritten: The derivation of each function with handwritten C code.
        called: Names of the functions that each function calls.
    """

    loops: SolvedLoops
    closure: LoopClosure | None
    iteration: Iteration | None
    symbolic: Mapping[str, maps.Maker]
    handwritten: Mapping[str, platforms.WrittenMaker]
    called: Mapping[str, Iterable[str]]

    @classmethod
    def of(cls, loops: SolvedLoops) -> "_LoopMakers":
        closed = maps.makers(loops) | arm_step.makers(loops)
        closed |= constraint_functions.makers(loops) | platforms.makers(loops)
        closure = loop_closure(loops) if loops.forward.open else None
        iteration = _iteration(closure)
        iterated = iterated_makers(iteration, closed) if iteration else {}
        solver = iteration.closure.functions if iteration else ()
        called = dict.fromkeys([*FUNCTIONS, *iterated], solver)
        handwritten = platforms.written_makers(loops)
        return cls(loops, closure, iteration, iterated | closed, handwritten, called)

    def with_legs(self) -> "_LoopMakers":
        legs = backward_inverse.makers(self.loops) | leg_inverse.makers(self.loops)
        if self.iteration is None:
            return replace(self, symbolic={**self.symbolic, **legs})
        closure = self.iteration.closure
        legs, checked = mode_check.with_legs(legs, closure)
        symbolic = {**self.symbolic, **legs, **inner_makers(closure)}
        return replace(self, symbolic=symbolic, handwritten={**self.handwritten, **checked})

    @property
    def names(self) -> list[str]:
        has_tool = self.iteration is not None or not self.loops.forward.open
        return [*(FUNCTIONS if has_tool else ()), *self.symbolic]

    def without_replaced(self, inverse: Inverses | None) -> "_LoopMakers":
        if inverse is None or mode_check.IK not in {f.name for f in inverse.written}:
            return self
        symbolic = {name: maker for name, maker in self.symbolic.items() if name != mode_check.LEGS}
        kept = {name: made for name, made in self.handwritten.items() if name != mode_check.IK}
        return replace(self, symbolic=symbolic, handwritten=kept)

    def handwritten_functions(
        self, functions: Sequence[str] | None, inverse: Inverses | None
    ) -> dict[str, NativeSolverFunction]:
        found = [*inverse.written] if inverse else []
        requested = [name for name in self.handwritten if functions is None or name in functions]
        made = [self.handwritten[name](self.loops) for name in requested]
        return {f.name: f for f in (*found, *made) if f is not None}

    def functions(self, chosen: Sequence[str]) -> dict[str, SymbolicFunction]:
        of_tool = [name for name in chosen if name in FUNCTIONS]
        is_closed = not self.loops.forward.open
        made = tool_functions(self.loops, of_tool) if is_closed and of_tool else {}
        made |= {name: self.symbolic[name](self.loops) for name in chosen if name in self.symbolic}
        # The functions of the tool pose reuse terms of the functions of the main chain.
        return made | (self.iteration.tool_functions(of_tool) if self.iteration else {})


def _loop_inverse(
    makers: _LoopMakers,
    functions: Sequence[str] | None,
    families: tuple[Family, ...],
    fixed: str | Sequence[str],
) -> Inverses | None:
    known = {*makers.names, *makers.handwritten}
    is_asked = functions is None or not set(functions) <= known
    if not makers.loops.may_have_inverse or not is_asked:
        return None
    closure = None if makers.loops.chain_is_known else makers.closure
    return hybrid_inverses_for_fixed(makers.loops, families, fixed, closure)


def _iteration(closure: LoopClosure | None) -> Iteration | None:
    if closure is None or not closure.is_determined or closure.hybrid.is_overdetermined:
        return None
    return Iteration(closure)


def _unguarded_without(
    function: NativeSolverFunction, chosen: Collection[str]
) -> NativeSolverFunction:
    return function if function.margin in chosen else replace(function, margin="")


def _guarded(function: SymbolicFunction, capabilities: Collection[str]) -> SymbolicFunction:
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
    if functions is None:
        return list(default)
    known = [*default, *on_demand]
    unknown = [name for name in functions if name not in known]
    if unknown:
        raise InputValueError(
            f"{robot} has no function {', '.join(unknown)}; nearest functions: "
            f"{nearest_names(unknown[0], known)} (chasles info lists the functions of a robot)"
        )
    return [name for name in known if name in functions]
