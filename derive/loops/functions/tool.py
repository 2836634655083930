"""The tool of a mechanism in closed form, as a function of the actuators or of the main chain."""

from collections.abc import Collection

import sympy as sp

from ...chain.coordinates import InProportion, SolvedRates, ThroughLoops
from ...chain.forward import Forward
from ...chain.groups import Group, groups
from ...chain.kinematics import Kinematics
from ...terms.symbolic_function import SymbolicFunction
from ..solve.collapse import collapsed
from ..solve.solved_loops import SolvedLoops


def tool_groups(h: SolvedLoops) -> tuple[Group, ...]:
    """Return the main chain with its joint values as functions of the actuators."""
    return h.terms.memoize(("tool groups", h), lambda: groups(h.robot, h.terms, _joint_values(h)))


def _joint_values(h: SolvedLoops) -> list[sp.Expr]:
    return [joint.direction * h.forward.values[joint.name] for joint in h.robot.moving]


def tool_kinematics(h: SolvedLoops) -> Kinematics:
    """Return the kinematics of the tool as functions of the actuators."""
    return h.terms.memoize(("tool kinematics", h), lambda: _tool_kinematics(h))


def _tool_kinematics(h: SolvedLoops) -> Kinematics:
    values, found = _joint_values(h), tool_groups(h)
    shorter, translations = collapsed(h.terms, found, h.forward.relations, len(values))
    everything = [*values, *translations]
    kept = [everything[k] for group in shorter for s in group.stations for k in s.joints]
    motion = ThroughLoops(kept, SolvedRates(h.terms, h.forward.loops, h.q))
    links = Forward(h.terms, found)
    return Kinematics.of(h.robot, h.terms, shorter, motion, h.arguments, links)


def open_chain(h: SolvedLoops) -> Kinematics:
    """Return the kinematics of the tool as functions of the main-chain joints."""
    return h.terms.memoize(("open chain", h), lambda: _open_chain(h))


def _open_chain(h: SolvedLoops) -> Kinematics:
    motion = InProportion(h.robot, h.terms, h.theta)
    found = groups(h.robot, h.terms, motion.values)
    arguments = {f"q{d}": h.arguments[f"theta{d}"] for d in ("", "d", "dd")}
    return Kinematics.of(h.robot, h.terms, found, motion, arguments)


def tool_functions(h: SolvedLoops, names: Collection[str]) -> dict[str, SymbolicFunction]:
    """Return the tool functions by name, whose results are NaN if a loop does not close."""
    found = tool_kinematics(h).functions(names)
    return {name: h.of_closed_loops(function) for name, function in found.items()}
