"""Reports whether a robot's model is complete, continuous and minimal.

A model is complete if the parameters can displace every axis in every direction. A model is
continuous if small axis displacements need only small changes of the parameters. A model is minimal
if no parameter is redundant.

Source:
    K. Schroeer, S. Albright, M. Grethlein, Complete, minimal and model-continuous kinematic models
    for robot calibration, Robotics and Computer-Integrated Manufacturing 13 (1997); Closed chain
    cascade manipulator with an improved kinematic model, Mathematical Problems in Engineering, 3.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from chasles.contract import check_type

from ..description.conventions import CONVENTIONS
from ..description.conventions.axis_maps import Motions, axis_map, field_values, free_of, symbols_in
from ..description.conventions.neighbours import Neighbours, least_singular_value, neighbours
from ..description.conventions.suited import suitable_conventions, with_suitable_conventions
from ..loops.closing.freedoms import virtual_joints
from ..model.convention import Convention, Placements
from ..model.errors import DescriptionError
from ..model.geometry import geometry
from ..model.mechanism import Described, Mechanism
from ..model.placements import Placement, inverse, rotation
from ..model.robot import Joint, SerialRobot
from ..model.tolerances import ZERO_SINGULAR_VALUE
from ..terms.terms import Terms
from .determinants import completed_determinant, determinant
from .quality_report import ConventionQuality, JointQuality, ModelReport

_Numbers = dict[sp.Symbol, sp.Expr]
_SHOWN = 1e-3
"""Smallest reported displacement, relative to the largest component."""
POSES = 60
"""Number of random configurations for the rank computation."""


def model_report(
    description: Described,
    *,
    conventions: Sequence[Convention] = CONVENTIONS,
    rng: int | np.random.Generator | None = 0,
) -> ModelReport:
    """Report which conventions suit the calibration of each joint.

    Args:
        description: A serial robot or a mechanism, from ``read`` or built in Python. For a
            mechanism, the report describes only the joints between base and tool.
        conventions: The conventions to compare; all conventions of chasles by default. Conventions
            that chasles cannot fit to a given joint transform are omitted.
        rng: Seed or generator of random configurations, at which the rank of the parameter Jacobian
            is computed. With None, each call uses different configurations.

    Raises:
        DescriptionError: The tool of a mechanism is on a platform that is carried only by legs, and
            the robot file describes no chain of joints to this platform.
    """
    check_type("model_report: description", description, SerialRobot, Mechanism)
    chain = _chain(description)
    fitting = [convention for convention in conventions if convention.fit]
    kinds = [joint.kind for joint in chain.moving]
    suits = suitable_conventions(chain)
    return ModelReport(
        description.title or description.name,
        tuple(
            _joint(pair, own_displacements(chain, pair), placed, suit.name, fitting)
            for pair, (placed, suit) in zip(neighbours(chain)[1:], suits[1:], strict=True)
        ),
        sum(kind != "prismatic" for kind in kinds),
        kinds.count("prismatic"),
        kinds.count("helical"),
        *_rank(chain, rng),
        *_rank(with_suitable_conventions(chain), rng),
    )


def _chain(robot: Described) -> SerialRobot:
    if not isinstance(robot, Mechanism):
        return replace(robot, load=None)
    terms = Terms({parameter.symbol: parameter.value for parameter in robot.parameters})
    free = {joint.name for run in virtual_joints(robot, terms) for joint in run}
    if any(joint.name in free for joint in robot.main_chain.joints):
        raise DescriptionError(f"{robot.name}: legs carry its tool; expected a chain of joints")
    return robot.main_chain


def _joint(
    pair: Neighbours,
    own: NDArray[np.float64],
    placed: Neighbours,
    suits: str,
    conventions: Sequence[Convention],
) -> JointQuality:
    return JointQuality(
        pair.joint.name,
        pair.joint.kind,
        pair.before.name if pair.before else "",
        pair.angle,
        pair.distance if pair.is_of_lines else 0.0,
        tuple(
            dict.fromkeys(
                joint.convention.name
                for joint in (pair.before, pair.joint)
                if joint and joint.convention
            )
        ),
        missed(own, pair.words),
        tuple(_quality(placed, convention) for convention in conventions),
        suits,
    )


def _quality(pair: Neighbours, convention: Convention) -> ConventionQuality:
    kind = pair.joint.kind
    link = axis_map(convention, kind)
    fit, rows = pair.fit(convention), pair.displacements(convention)
    completed = completed_determinant(convention, kind)
    value = None
    if fit is not None:
        known = field_values(fit)
        value = float(completed.xreplace({s: known.get(s.name, sp.S.Zero) for s in link.symbols}))
    return ConventionQuality(
        convention.name,
        tuple(symbol.name for symbol in link.own),
        len(free_of(kind)),
        determinant(convention, kind),
        completed,
        value,
        least_singular_value(rows),
        () if rows is None else missed(rows, pair.words),
    )


def _rank(robot: SerialRobot, rng: int | np.random.Generator | None) -> tuple[int, int]:
    q = sp.symbols(f"q1:{len(robot.coordinates) + 1}", real=True)
    found = geometry(robot, q)
    own = [
        k
        for k, item in enumerate(found.parameters)
        if item.part not in ("parameter", "axis", "transmission")
    ]
    symbols = [item.symbol for item in found.parameters]
    nominal = [float(item.value) for item in found.parameters]
    motions = Motions(found.motions, [*q, *symbols])
    random = np.random.default_rng(rng)
    J = np.concatenate(
        [motions([*at, *nominal])[0][:, len(q) :] for at in random.uniform(-2, 2, (POSES, len(q)))]
    )[:, own]
    return len(own), _rank_of(J)


def _rank_of(J: NDArray[np.float64]) -> int:
    size = np.linalg.norm(J, axis=0)
    # Rounding errors may make the column of a useless parameter nonzero.
    moving = size > ZERO_SINGULAR_VALUE * size.max()
    values = np.linalg.svd(J[:, moving] / size[moving], compute_uv=False)
    return int(np.sum(values > ZERO_SINGULAR_VALUE * values[0]))


def missed(rows: NDArray[np.float64], words: tuple[str, ...]) -> tuple[str, ...]:
    """Return a sentence for each displacement that no parameter produces.

    Args:
        rows: Displacements (d, k) for k parameters.
        words: Name of each row.
    """
    U, values, _ = np.linalg.svd(rows, full_matrices=True)
    rank = int(np.sum(values > ZERO_SINGULAR_VALUE))
    return tuple(_named(direction, words) for direction in _sparse(U[:, rank:].T))


def _sparse(directions: NDArray[np.float64]) -> NDArray[np.float64]:
    found = directions.copy()
    taken: list[int] = []
    for k in range(len(found)):
        size = np.abs(found[k])
        size[taken] = 0
        pivot = int(np.argmax(size))
        taken.append(pivot)
        found[k] /= found[k, pivot]
        for other in range(len(found)):
            if other != k:
                found[other] -= found[other, pivot] * found[k]
    return found


def _named(direction: NDArray[np.float64], words: tuple[str, ...]) -> str:
    largest = int(np.argmax(np.abs(direction)))
    direction = direction / direction[largest]
    others = [
        f"{abs(part):.3g} of a {word}"
        for k, (part, word) in enumerate(zip(direction, words, strict=True))
        if k != largest and abs(part) > _SHOWN
    ]
    return " with ".join([words[largest], *others])


def own_displacements(robot: SerialRobot, pair: Neighbours) -> NDArray[np.float64]:
    """Return the displacements (d, k) of a joint axis, with one column per parameter.

    The axis depends on the coordinate offset of the previous joint, and on the parameters of the
    transforms between the motions of the two joints. The axis of a prismatic joint has an arbitrary
    position.

    Args:
        robot: The robot.
        pair: A joint and the joint before it in the chain.
    """
    numbers: _Numbers = {parameter.symbol: parameter.value for parameter in robot.parameters}
    offset = sp.Symbol("_offset", real=True)
    product: Placement = ()
    named = {offset: sp.S.Zero}
    if pair.before is not None:
        before, after = _in_symbols(pair.before, named)
        turn = () if pair.before.kind == "prismatic" else rotation("z", offset)
        along = _moving_along(before)
        # The axis is expressed in the nominal frame directly before the motion of the previous
        # joint. This frame lies after the last motions along and about z.
        nominal = tuple(motion.at(named) for motion in along)
        product = inverse(nominal) + along + turn + after
    product += _between(robot, pair) + _in_symbols(pair.joint, named)[0]
    product = tuple(motion.at(numbers) for motion in product)
    symbols = [symbol for symbol in symbols_in(product) if symbol in named]
    values = [float(named[symbol].xreplace(numbers)) for symbol in symbols]
    return pair.by_numbers(product, symbols, values)


def _between(robot: SerialRobot, pair: Neighbours) -> Placement:
    joints = list(robot.joints)
    last = joints.index(pair.joint)
    first = joints.index(pair.before) + 1 if pair.before else 0
    return tuple(motion for j in joints[first:last] for motion in (*j.before, *j.after))


def _in_symbols(joint: Joint, named: _Numbers) -> Placements:
    if joint.convention is None:
        return joint.before, joint.after
    given = dict(joint.given)
    fields = {}
    for field in joint.convention.fields:
        if field.kind == "direction":
            fields[field.name] = tuple(given[name] for name in field.components)
            continue
        symbols = [sp.Symbol(f"_{joint.name}_{name}", real=True) for name in field.components]
        named |= dict(zip(symbols, (given[name] for name in field.components), strict=True))
        fields[field.name] = tuple(symbols) if field.is_vector else symbols[0]
    return joint.convention(joint.kind, **fields)


def _moving_along(before: Placement) -> Placement:
    count = len(before)
    while count and before[count - 1].is_along_z:
        count -= 1
    return before[count:]
